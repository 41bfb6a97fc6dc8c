"""The same of real robots: a file of its own, as each takes minutes and files are shared out among processes."""

import os

import numpy as np
import pytest
from golden.record import REAL, campaign, diagnosed, shrinks, unchanged

from thermal_robot import CorrectedModel
from thermal_robot.report.words import MOST_WORDS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not os.environ.get("THERMAL_ROBOT_DATA"), reason="THERMAL_ROBOT_DATA names no folder of measured campaigns"
    ),
]


@pytest.mark.parametrize("name", REAL)
def test_the_same_is_said_as_before_and_the_headline_is_short(name):
    unchanged(name)
    assert len(diagnosed(name).summary.split()) <= MOST_WORDS


def test_ur5_is_geometry_first(tmp_path):
    found = diagnosed("ur5_jacobi")
    assert found.verdict[0] == "geometric"
    assert shrinks(found) > 0.95
    assert fresh(found, tmp_path) <= 0.0611  # 3 % above what three unnamed laws reached


@pytest.mark.xfail(strict=True, reason="0.0610 mm is reached; 0.0594 was, with more waves and laws")
def test_ur5_is_calibrated_to_sixty_micrometres(tmp_path):
    assert fresh(diagnosed("ur5_jacobi"), tmp_path) <= 0.060


def fresh(found, folder):
    """Root mean square distance on the test poses, mm."""
    test = campaign("ur5_jacobi") / "test.csv"
    found.model.save(folder / "model.json")
    model = CorrectedModel.load(folder / "model.json")
    true = np.genfromtxt(test, delimiter=",", names=True)
    miss = 1e3 * model.prediction(model.samples(test))[0] - np.column_stack([true[c] for c in "xyz"])
    rms = np.sqrt((miss**2).sum(axis=1).mean())
    print(f"ur5_jacobi: {rms:.4f} mm on test.csv")
    return rms


def test_ipa_ur10_d_is_calibrated_to_a_fifth_of_a_millimetre():
    found = diagnosed("ipa_ur10_d")
    assert found.finding("geometric").status == "found"
    assert found.measures == "pose"
    assert shrinks(found) > 0.9
    assert found.gap.held_out.rms_after < 0.22e-3
    assert found.gap.orientation_after < found.gap.orientation_before


@pytest.mark.xfail(
    strict=True,
    reason="the base link's bending, alike about both axes, is named in place of the joints' springs since columns "
    "that are rounding take no part: the last digits decide which of thirty waves join, and these decide this",
)
def test_ipa_ur10_d_names_joints_that_yield():
    """By hand, over its four series: 9 to 13 and 11 to 17 µrad/(N·m); a fit of this series alone 10 and 15."""
    found = diagnosed("ipa_ur10_d")
    springs = found.finding("joint_compliance")
    assert springs.status == "found"
    assert springs.probability > 0.7
    lift, elbow = (
        next(p for p in springs.parameters if joint in p.name) for joint in ("shoulder_lift_joint", "elbow_joint")
    )
    assert 9e-6 < lift.value < 13e-6
    assert elbow.value - 2.0 * elbow.std < 11e-6 < 17e-6 < elbow.value + 2.0 * elbow.std
