"""The demo: its diagnosis names exactly what was simulated."""

import json

import numpy as np
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
    known = [p for p in found.finding("backlash").parameters if p.identified]
    true = truth["parts"]["backlash"]["values"]
    assert {p.name for p in known} & set(true)
    assert all(abs(p.value - true.get(p.name, 0.0)) < 4.0 * p.std for p in known)
    strains_are_told(found.finding("thermal_elongation"), truth["parts"]["thermal_elongation"]["values"])
    assert found.gap.rms_after < 1.1 * found.gap.noise_floor < found.gap.rms_before
    faulty = {name.rsplit(", ", 1)[1] for name in truth["parts"]["backlash"]["values"]}
    assert found.finding("backlash").locations[0].name in faulty


def strains_are_told(finding, true):
    """Each link has its own; or one is about their mean, and what a link is said to deviate is what it does."""
    told = {p.name: p for p in finding.parameters if p.identified}
    assert told
    if "strain per kelvin" not in told:
        assert all(abs(p.value - true[p.name]) < 4.0 * p.std for p in told.values())
        return
    common = told.pop("strain per kelvin")
    assert abs(common.value - np.mean(list(true.values()))) < 4.0 * common.std
    assert told
    for name, deviation in told.items():
        own = true[name.replace("deviation of", "strain per kelvin of")]
        assert abs(common.value + deviation.value - own) < 4.0 * np.hypot(common.std, deviation.std)
