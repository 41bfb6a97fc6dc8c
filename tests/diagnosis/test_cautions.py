"""Data that are not what they seem: copies, another robot's table, a fault of the log."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose


def test_a_table_pasted_twice_is_not_taken_for_repeats(clean):
    twice = clean.take(np.tile(np.arange(60), 2))
    found = diagnose(replace(twice, rows=np.arange(2, 122), noise_position=None))
    assert not found.unexplained.flagged
    assert any("60 rows repeat another" in warning for warning in found.warnings)


@pytest.mark.parametrize("spoilt", ["mirrored", "scrambled"])
def test_another_robots_table_is_said_to_be_that(clean, spoilt):
    position = clean.position * [1, -1, 1] if spoilt == "mirrored" else clean.position[::-1]
    found = diagnose(replace(clean, position=position))
    assert found.summary.startswith("Robot and table do not describe the same motion")
    assert found.unexplained.flagged


def test_noise_stated_ten_times_too_large_is_remarked(clean):
    found = diagnose(replace(clean, noise_position=200e-6))
    assert any("stated too large" in warning for warning in found.warnings)


def test_encoders_that_deny_the_commands_are_a_fault_of_the_log(rv_m2):
    clean = simulate(rv_m2, ["drift"], seed=1)[0]
    read = clean.q[:, 2] + 1e-4
    spoilt = np.array(read)
    spoilt[[10, 40, 41]] += 0.2
    agreeing = diagnose(replace(clean, covariates={**clean.covariates, "encoder.joint_3": read}))
    denying = diagnose(replace(clean, covariates={**clean.covariates, "encoder.joint_3": spoilt}))
    assert not any("encoder" in warning for warning in agreeing.warnings)
    told = next(warning for warning in denying.warnings if "encoder.joint_3" in warning)
    assert "3 of 120 rows" in told
    assert f"row {int(clean.rows[10])}" in told
    assert "fault of the log" in told
    assert denying.verdict == agreeing.verdict == ("drift",)
