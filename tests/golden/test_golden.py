"""The program says of known campaigns what the files beside this test hold."""

import json
import os

import numpy as np
import pytest
from golden.record import campaign, diagnosed, differences, golden, names, said

from thermal_robot import CorrectedModel
from thermal_robot.report.sentence import MOST_WORDS

TOLERANCE = 1e-6
"""Relative: other processors and versions of BLAS round otherwise, and fits multiply that by their condition."""
QUICK = ("demo", "open_cases/case_000", "open_cases/case_007", "open_cases/case_016")
REWRITE = "python tests/golden/record.py --only {name}"
measured = pytest.mark.skipif(
    not os.environ.get("THERMAL_ROBOT_DATA"), reason="THERMAL_ROBOT_DATA names no folder of measured campaigns"
)


def listed(name):
    marks = [] if name in QUICK else [pytest.mark.slow]
    return pytest.param(name, marks=marks if name == "demo" else [*marks, measured])


@pytest.mark.parametrize("name", [listed(name) for name in names()])
def test_the_same_is_said_as_before(name):
    old = json.loads(golden(name).read_text(encoding="utf-8"))
    lines = differences(old, said(name), TOLERANCE)
    rewrite = REWRITE.format(name=name)
    assert not lines, (
        f"{name}: {len(lines)} figures changed, the first: {lines[:3]}. If that is meant, write them anew with "
        f"`{rewrite}`, and let the commit message tell what changed, where and why."
    )


@pytest.mark.parametrize("name", [listed(name) for name in names()])
def test_no_campaign_has_a_long_headline(name):
    assert len(diagnosed(name).summary.split()) <= MOST_WORDS


def shrinks(found):
    """Held-out rows, not those of the fit, say so; and the interval holds the figure."""
    held_out = found.gap.held_out
    low, high = held_out.shrinkage_ci95
    assert 0.0 < low <= held_out.shrinkage <= high < 1.0
    assert held_out.rms_after < held_out.rms_before
    return held_out.shrinkage


@measured
@pytest.mark.slow
def test_ur5_is_calibrated_to_sixty_micrometres(tmp_path):
    found = diagnosed("ur5_jacobi")
    assert found.verdict[0] == "geometric"
    assert shrinks(found) > 0.95
    test = campaign("ur5_jacobi") / "test.csv"
    found.model.save(tmp_path / "model.json")
    model = CorrectedModel.load(tmp_path / "model.json")
    true = np.genfromtxt(test, delimiter=",", names=True)
    miss = 1e3 * model.predict(model.samples(test))[0] - np.column_stack([true[c] for c in "xyz"])
    rms = np.sqrt((miss**2).sum(axis=1).mean())
    print(f"ur5_jacobi: {rms:.4f} mm on test.csv")
    assert rms <= 0.060


@measured
@pytest.mark.slow
def test_ipa_ur10_d_names_joints_that_yield():
    """By hand, over its four series: 9 to 13 and 11 to 17 µrad/(N·m); a fit of this series alone 10 and 15."""
    found = diagnosed("ipa_ur10_d")
    assert found.finding("geometric").status == "found"
    assert found.measures == "pose"
    assert shrinks(found) > 0.9
    assert found.gap.held_out.rms_after < 0.22e-3
    assert found.gap.orientation_after < found.gap.orientation_before
    springs = found.finding("joint_compliance")
    assert springs.status == "found"
    assert springs.probability > 0.7
    lift, elbow = (
        next(p for p in springs.parameters if joint in p.name) for joint in ("shoulder_lift_joint", "elbow_joint")
    )
    assert 9e-6 < lift.value < 13e-6
    assert elbow.value - 2.0 * elbow.std < 11e-6 < 17e-6 < elbow.value + 2.0 * elbow.std


def test_every_campaign_has_its_file_and_every_file_its_campaign():
    held = {golden(name).name for name in names()}
    assert held == {file.name for file in golden("demo").parent.glob("*.json")}
    assert set(QUICK) < set(names())


def test_the_demo_is_no_measured_campaign(monkeypatch):
    monkeypatch.delenv("THERMAL_ROBOT_DATA", raising=False)
    assert (campaign("demo") / "campaign.toml").exists()
    with pytest.raises(KeyError):
        campaign("ur5_jacobi")


@pytest.mark.parametrize(
    ("old", "new", "said_of_it"),
    [
        ({"a": 1.0}, {"a": 1.0 + 1e-8}, []),
        ({"a": 1.0}, {"a": 1.0 + 1e-5}, ["/a: 1.0 became 1.00001"]),
        ({"a": {"b": [1, 2]}}, {"a": {"b": [1, 3]}}, ["/a/b[1]: 2 became 3"]),
        ({"a": [1]}, {"a": [1, 2]}, ["/a: [1] became [1, 2]"]),
        ({"a": "found"}, {"a": "not_found"}, ["/a: 'found' became 'not_found'"]),
        ({"a": 1e-13}, {}, []),
        ({}, {"a": 1e-3}, ["/a: 0.0 became 0.001"]),
        ({"a": float("nan")}, {"a": 1.0}, ["/a: nan became 1.0"]),
        ({"probability": 1.80763633126e-06}, {"probability": 1.80762545937e-06}, []),
        ({"probability": 1e-6}, {"probability": 3e-6}, ["/probability: 1e-06 became 3e-06"]),
    ],
)
def test_a_difference_is_one_line(old, new, said_of_it):
    assert differences(old, new, TOLERANCE) == said_of_it
