"""AT and RT by hand."""

import numpy as np
import pytest
from clouds import cloud

from thermal_robot.iso9283 import Attained, accuracy, along_path, repeatability

COMMANDED = Attained(np.zeros((1, 3)), np.eye(3)[None])


def test_the_worst_point_is_that_of_the_path():
    """Points 3, 7 and 5 mm off their commands, with RP of 22, 11 and 5.5 mm."""
    points = [cloud([1e-3, 2e-3, 2e-3], 2.0), cloud([2e-3, 3e-3, 6e-3]), cloud([0, 4e-3, 3e-3], 0.5)]
    assert along_path([accuracy(p, COMMANDED) for p in points]).position == pytest.approx(7e-3)
    assert along_path([repeatability(p) for p in points]).position == pytest.approx(22e-3)
    assert along_path([repeatability(p) for p in points]).angles is None


def test_angles_count_by_size():
    points = [cloud(about_z=1.0, mean_turn=2e-3), cloud(about_z=0.5, mean_turn=-4e-3)]
    assert along_path([accuracy(p, COMMANDED) for p in points]).angles == pytest.approx((0, 0, 4e-3), abs=1e-9)
    assert along_path([repeatability(p) for p in points]).angles == pytest.approx((0, 0, 6e-3), abs=1e-9)
