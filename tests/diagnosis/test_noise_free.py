"""A simulated campaign without any noise is diagnosed as every other: warnings are errors here."""

import pytest

import thermal_robot as tr

AT_WORK = [
    {"joint_offset": 1e-3},
    {"joint_compliance": 1e-5},
    {"backlash": 1e-3},
    {"joint_gain": 1e-3},
    {"thermal_elongation": 1.2e-5},
]


def campaign(at_work):
    return tr.simulate(tr.load_robot("builtin:rv_m2", "tool0"), at_work, rows=60, seed=1)


@pytest.mark.parametrize("at_work", AT_WORK, ids=["".join(a) for a in AT_WORK])
def test_one_effect_and_no_noise(at_work):
    found = tr.diagnose(campaign(at_work))
    assert found.verdict == tuple(at_work)
    assert found.gap.held_out.rms_after < 1e-9
    assert "less than 1 nm" in found.summary


def test_no_effect_and_no_noise():
    found = tr.diagnose(campaign(None))
    assert found.verdict == ()
    assert "less than 1 nm" in found.summary
