"""Joint positions for poses: reached exactly where they can be, the point first where they cannot."""

import numpy as np
import pytest
from conftest import load_arm

from thermal_robot.errors import RobotError
from thermal_robot.kinematics import Displacement, frame_jacobians, inverse_kinematics, nearest_postures, tool_poses

ROWS = 40
TOOL = np.eye(4)
TOOL[:3, 3] = 0.03, -0.02, 0.08


def inside(robot, rows, seed=0):
    """Configurations away from the limits, by a tenth of the range."""
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    return rng.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low), (rows, robot.n))


def easy(robot, rows):
    """Configurations far from singular ones: a millimetre there asks for less than a fiftieth of a radian."""
    q = inside(robot, 20 * rows)
    weakest = np.linalg.svd(frame_jacobians(robot, q), compute_uv=False)[:, 5]
    return q[weakest > 0.05][:rows]


def test_poses_of_the_chain_itself_are_found_from_nearby(arm):
    q = inside(arm, ROWS)
    start = q + np.random.default_rng(1).normal(scale=0.01, size=q.shape)
    wanted = tool_poses(arm, q) @ TOOL
    found = inverse_kinematics(arm, wanted, start, tool=TOOL)
    reached = tool_poses(arm, found.q) @ TOOL
    np.testing.assert_allclose(reached[:, :3, 3], wanted[:, :3, 3], rtol=0, atol=1e-9)
    assert found.miss.max() < 1e-9
    assert np.median(found.turned) < 1e-6
    assert ((arm.lower <= found.q) & (found.q <= arm.upper)).all()
    # the start is the answer where it is there already
    np.testing.assert_array_equal(inverse_kinematics(arm, tool_poses(arm, q), q).q, q)


@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_a_displaced_chain_reaches_the_nominal_pose(name):
    arm = load_arm(name)
    rng, q = np.random.default_rng(2), easy(arm, ROWS)
    segments = 1e-3 * rng.normal(size=(len(arm.segments), 6))

    def displaced(at):  # a joint that yields moves on with the pose
        return Displacement(joint=2e-3 * np.sin(at), segment=segments)

    found = inverse_kinematics(arm, tool_poses(arm, q), q, displaced=displaced)
    reached = tool_poses(arm, found.q, displaced(found.q))
    np.testing.assert_allclose(reached, tool_poses(arm, q), rtol=0, atol=1e-9)
    assert 1e-4 < np.abs(found.q - q).max() < 0.2


def test_what_is_reported_is_what_is_left(rv_m2):
    q = inside(rv_m2, ROWS)
    wanted = tool_poses(rv_m2, q)
    wanted[:, :3, :3] = wanted[:, :3, :3] @ np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    found = inverse_kinematics(rv_m2, wanted, q)
    reached = tool_poses(rv_m2, found.q)
    np.testing.assert_allclose(found.position, wanted[:, :3, 3] - reached[:, :3, 3], atol=1e-15)
    cosine = (np.einsum("nij,nij->n", wanted[:, :3, :3], reached[:, :3, :3]) - 1.0) / 2.0
    np.testing.assert_allclose(found.turned, np.arccos(np.clip(cosine, -1.0, 1.0)), atol=1e-6)
    # five joints cannot turn a tool anywhere, but they bring its point there
    assert np.quantile(found.miss, 0.9) < 1e-9
    assert np.median(found.turned) > 0.1


def test_an_arm_with_seven_joints_stays_near():
    arm = load_arm("panda")
    q = easy(arm, ROWS)
    wanted = tool_poses(arm, q)
    wanted[:, :3, 3] += 1e-3
    found = inverse_kinematics(arm, wanted, q)
    assert found.miss.max() < 1e-9
    assert found.turned.max() < 1e-6
    # 1.7 mm over a gain of 0.05 at the least
    assert np.linalg.norm(found.q - q, axis=1).max() < 1.1 * np.sqrt(3.0) * 1e-3 / 0.05


def test_limits_are_kept_and_what_cannot_be_reached_is_told(rv_m2):
    q = inside(rv_m2, ROWS)
    wanted = tool_poses(rv_m2, q)
    wanted[::2, :3, 3] *= 3.0 / np.linalg.norm(wanted[::2, :3, 3], axis=1)[:, None]  # two metres beyond its reach
    found = inverse_kinematics(rv_m2, wanted, q)
    assert ((rv_m2.lower <= found.q) & (found.q <= rv_m2.upper)).all()
    assert (found.miss[::2] > 1.0).all()
    assert (found.miss[1::2] < 1e-9).all()


def test_a_joint_at_its_end_leaves_the_work_to_the_others():
    arm = load_arm("panda")
    q = inside(arm, ROWS)
    low, high = q - 0.5, q + 0.5
    high[:, 2] = q[:, 2]
    wanted = tool_poses(arm, q)
    wanted[:, :3, 3] += 2e-3
    found = inverse_kinematics(arm, wanted, q, within=(low, high))
    assert ((low <= found.q) & (found.q <= high)).all()
    assert np.quantile(found.miss, 0.9) < 1e-9


def test_shapes_that_do_not_fit_are_refused(rv_m2):
    q = inside(rv_m2, 3)
    with pytest.raises(RobotError, match=r"\(3, 4, 4\)"):
        inverse_kinematics(rv_m2, tool_poses(rv_m2, q)[:2], q)
    with pytest.raises(RobotError):
        inverse_kinematics(rv_m2, tool_poses(rv_m2, q), q[:, :4])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rv_m2", "ur10", "panda"])
def test_poses_are_found_from_anywhere(name):
    arm = load_arm(name)
    q = inside(arm, ROWS)
    wanted = tool_poses(arm, q) @ TOOL
    found = nearest_postures(arm, wanted, tool=TOOL)
    reached = tool_poses(arm, found.q) @ TOOL
    np.testing.assert_allclose(reached[:, :3, 3], wanted[:, :3, 3], rtol=0, atol=1e-9)
    assert np.quantile(found.turned, 0.9) < 1e-6
    assert ((arm.lower <= found.q) & (found.q <= arm.upper)).all()


@pytest.mark.slow
def test_of_several_postures_the_nearest_is_taken():
    arm = load_arm("ur10")
    q = easy(arm, ROWS)
    wanted = tool_poses(arm, q)
    np.testing.assert_allclose(nearest_postures(arm, wanted, near=q).q, q, atol=1e-6)
    middle = nearest_postures(arm, wanted)
    assert middle.miss.max() < 1e-9
    assert np.linalg.norm(middle.q, axis=1).mean() < np.linalg.norm(q, axis=1).mean()
