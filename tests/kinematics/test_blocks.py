"""What is computed of a chunk whose frames are known."""

import numpy as np

from thermal_robot import kinematics as kin
from thermal_robot.kinematics import lanes


def test_cross_product():
    a, b = np.random.default_rng(1).normal(size=(2, 3, 40))
    out, term = np.empty((3, 40)), np.empty(40)
    lanes.cross(a, b, out, term)
    np.testing.assert_allclose(out, np.cross(a, b, axis=0), rtol=0.0, atol=1e-15)


def test_a_part_of_the_places_is_theirs(awkward, configurations):
    places = kin.chain_frames(awkward, configurations(awkward, 30)).rows_last()
    part = slice(10, 17)
    some = places.of(part)
    np.testing.assert_array_equal(some.positions, places.positions[..., part])
    np.testing.assert_array_equal(some.tool_rotation, places.tool_rotation[..., part])


def test_the_target_is_the_point_carried_by_the_tool(awkward, configurations):
    q, point = configurations(awkward, 30), np.array([0.1, -0.2, 0.3])
    places, poses = kin.chain_frames(awkward, q).rows_last(), kin.tool_poses(awkward, q)
    carried = (poses @ [*point, 1.0])[:, :3].T
    np.testing.assert_allclose(places.target(point, slice(0, 30)), carried, rtol=0.0, atol=1e-14)
    each = places.target(np.tile(point, (30, 1)), slice(0, 30))
    np.testing.assert_allclose(each, carried, rtol=0.0, atol=1e-14)
    assert places.target(None, slice(0, 30)) is places.tool_position
