"""Kinematics ask of a robot no more than the protocol says."""

from types import SimpleNamespace

import numpy as np
import pytest

from thermal_robot.errors import RobotError
from thermal_robot.kinematics import Displacement, chain_frames, frame_jacobians, placement_sensitivities, tool_poses


@pytest.fixture
def bare(rv_m2):
    """Nothing but the four attributes of the protocol."""
    return SimpleNamespace(name=rv_m2.name, n=rv_m2.n, segments=rv_m2.segments, chain=rv_m2.chain)


def test_four_attributes_suffice(bare, rv_m2):
    q = np.random.default_rng(5).uniform(-1.0, 1.0, (3, rv_m2.n))
    moved = Displacement(joint=np.full(rv_m2.n, 1e-3), segment=np.full((len(rv_m2.segments), 6), 1e-3))
    np.testing.assert_array_equal(tool_poses(bare, q, moved), tool_poses(rv_m2, q, moved))
    np.testing.assert_array_equal(chain_frames(bare, q).tool_position, chain_frames(rv_m2, q).tool_position)
    for function in (frame_jacobians, placement_sensitivities):
        np.testing.assert_array_equal(function(bare, q), function(rv_m2, q))


def test_it_is_named_where_joints_are_missing(bare):
    with pytest.raises(RobotError, match=bare.name):
        tool_poses(bare, np.zeros((2, bare.n - 1)))
