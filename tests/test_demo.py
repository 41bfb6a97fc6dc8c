"""The demo: its diagnosis names exactly what was simulated."""

import json

import pytest

from thermal_robot import demo_campaign, diagnose
from thermal_robot.datasets import demo_directory


@pytest.fixture(scope="module")
def truth():
    return json.loads((demo_directory() / "truth.json").read_text(encoding="utf-8"))


def test_the_diagnosis_names_exactly_the_truth(truth):
    campaign = demo_campaign()
    found = diagnose(campaign)
    assert set(found.verdict) == set(truth["effects"])
    assert not found.unexplained.flagged
    assert set(found.outliers) == set(truth["outliers"])
    assert all(found.finding(name).status == "found" for name in truth["effects"])
    for name in truth["effects"]:
        true = truth["parts"][name]["values"]
        known = [p for p in found.finding(name).parameters if p.identified]
        assert {p.name for p in known} & set(true)
        assert all(abs(p.value - true.get(p.name, 0.0)) < 4.0 * p.std for p in known)
    assert found.gap.rms_after < 1.1 * found.gap.noise_floor < found.gap.rms_before
    faulty = {name.rsplit(", ", 1)[1] for name in truth["parts"]["backlash"]["values"]}
    assert found.finding("backlash").locations[0].name in faulty
