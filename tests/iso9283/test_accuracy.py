"""AP by hand."""

import numpy as np
import pytest
from clouds import cloud

from thermal_robot.iso9283 import Attained, accuracy
from thermal_robot.kinematics import exp3


def test_the_barycentre_is_one_two_two_from_the_command_so_three():
    commanded = Attained(np.array([[0.5, 0.1, 0.9]]))
    found = accuracy(cloud([0.501, 0.102, 0.902]), commanded)
    assert found.position == pytest.approx(3e-3)
    assert found.axes == pytest.approx((1e-3, 2e-3, 2e-3))
    assert found.angles is None


def test_the_mean_turn_counts_not_its_scatter():
    commanded = Attained(np.zeros((1, 3)), np.eye(3)[None])
    found = accuracy(cloud(about_z=1.0, mean_turn=7e-3), commanded)
    assert found.angles == pytest.approx((0.0, 0.0, 7e-3), abs=1e-9)
    assert found.position == pytest.approx(0.0, abs=1e-15)


def test_a_model_that_predicts_each_cycle_is_compared_with_all():
    """Cycles that grow with temperature, as predicted: nothing is left but what the mean is off by."""
    growing = np.outer(np.arange(10.0), [1e-3, 0, 0])
    predicted = Attained(cloud().position + growing + [0, 0, 4e-3])
    assert accuracy(Attained(cloud().position + growing), predicted).position == pytest.approx(4e-3)


def test_orientations_of_the_command_need_not_be_known():
    assert accuracy(cloud(about_z=1.0), Attained(np.zeros((1, 3)))).angles is None
    turned = Attained(np.zeros((1, 3)), exp3(np.array([[0.0, 0, 1]])))
    assert accuracy(cloud(), turned).angles is None
