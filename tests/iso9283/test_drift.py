"""Drift by hand."""

import numpy as np
import pytest
from clouds import cloud

from thermal_robot.iso9283 import Attained, drift_of

COMMANDED = [Attained(np.zeros((1, 3)), np.eye(3)[None])] * 3


def test_the_largest_change_against_the_first_time_counts():
    """AP is 5, 7 and 3 mm, RP 11, 22 and 5.5 mm; the barycentre goes √74 and √12 mm."""
    times = [cloud([3e-3, 4e-3, 0]), cloud([0, 0, 7e-3], size=2.0), cloud([1e-3, 2e-3, 2e-3], size=0.5)]
    found = drift_of(times, COMMANDED)
    assert found.accuracy == pytest.approx(2e-3)
    assert found.repeatability == pytest.approx(11e-3)
    assert found.shift == pytest.approx(1e-3 * 8.602325)
    assert (found.accuracy_angles, found.repeatability_angles) == (None, None)


def test_what_goes_to_the_other_side_of_the_command_shifts_without_a_drift_of_accuracy():
    found = drift_of([cloud([3e-3, 0, 0]), cloud([-3e-3, 0, 0])], COMMANDED[:2])
    assert found.accuracy == pytest.approx(0.0, abs=1e-15)
    assert found.shift == pytest.approx(6e-3)


def test_angles_drift_likewise():
    """AP_c is −2, 3 and 1 mrad, which may change sign; RP_c is 6, 12 and 3 mrad."""
    turns = [(1.0, -2e-3), (2.0, 3e-3), (0.5, 1e-3)]
    found = drift_of([cloud(about_z=size, mean_turn=mean) for size, mean in turns], COMMANDED)
    assert found.accuracy_angles == pytest.approx((0, 0, 5e-3), abs=1e-8)
    assert found.repeatability_angles == pytest.approx((0, 0, 6e-3), abs=1e-8)


def test_without_commanded_poses_repeatability_and_shift_are_told():
    found = drift_of([cloud(), cloud([0, 1e-3, 0], size=3.0)])
    assert (found.accuracy, found.accuracy_angles) == (None, None)
    assert found.repeatability == pytest.approx(22e-3)
    assert found.shift == pytest.approx(1e-3)
