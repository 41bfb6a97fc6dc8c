"""The oracle itself: known poses, and derivatives by differences of its own poses and energies."""

import numpy as np
import pinocchio
import pytest
import reference

from thermal_robot import kinematics as kin

STEP = 1e-5
TOLERANCE = 2e-9  # STEP² times lengths of a metre or two, and rounding over STEP


@pytest.fixture(params=["rv_m2", "awkward"])
def robot(request):
    return request.getfixturevalue(request.param)


def twist_between(before, after):
    """Twist (N, 6) in root axes, at the tool, that carries one pose to the other in a unit of time."""
    turns = [pinocchio.log3(b[:3, :3] @ a[:3, :3].T) for a, b in zip(before, after, strict=True)]
    return np.concatenate([after[:, :3, 3] - before[:, :3, 3], np.array(turns)], axis=1)


def difference(robot, q, displace):
    below, above = (reference.tool_poses(robot, q, displace(step)) for step in (-STEP, STEP))
    return twist_between(below, above) / (2 * STEP)


def test_continuous_joints_are_cosine_and_sine(awkward):
    q = np.array([[0.1, 0.2, 3.0, 0.05, -2.0]])
    written = reference.to_pinocchio(awkward, q)
    expected = [0.1, 0.2, np.cos(3.0), np.sin(3.0), 0.05, np.cos(-2.0), np.sin(-2.0)]
    np.testing.assert_allclose(written, [expected], rtol=1e-15)
    assert written.shape[1] == awkward.model.nq


def test_the_stretched_arm(rv_m2):
    pose = reference.tool_poses(rv_m2, np.zeros(5))[0]
    np.testing.assert_allclose(pose[:3, 3], [0.0, 0.12 + 0.25 + 0.20 + 0.15, 0.40], atol=1e-15)
    np.testing.assert_allclose(pose[:3, :3], np.eye(3), atol=1e-15)


def test_jacobian_is_the_difference_of_poses(robot, configurations):
    q = configurations(robot, 10)
    jacobians = reference.frame_jacobians(robot, q)
    for j, unit in enumerate(np.eye(robot.n)):
        below, above = (reference.tool_poses(robot, q + h * unit) for h in (-STEP, STEP))
        np.testing.assert_allclose(jacobians[:, :, j], twist_between(below, above) / (2 * STEP), atol=TOLERANCE)


def test_regressor_is_the_difference_of_displaced_poses(robot, configurations):
    q = configurations(robot, 5)
    sensitivities = reference.placement_sensitivities(robot, q)
    for s in range(len(robot.segments)):
        for axis in range(6):
            unit = np.zeros((len(robot.segments), 6))
            unit[s, axis] = 1.0
            response = difference(robot, q, lambda h, u=unit: kin.Displacement(segment=h * u))
            np.testing.assert_allclose(sensitivities[:, :, s, axis], response, rtol=0.0, atol=TOLERANCE)


def test_displacing_by_nothing_changes_nothing(robot, configurations):
    q = configurations(robot, 5)
    plain, displaced = (reference.chain_frames(robot, q, d) for d in (None, kin.Displacement()))
    for field in ("rotations", "positions", "tool_rotation", "tool_position"):
        np.testing.assert_allclose(getattr(displaced, field), getattr(plain, field), rtol=0.0, atol=1e-14)


def test_torque_is_the_gradient_of_the_energy(robot, configurations):
    q = configurations(robot, 10)
    torques = reference.gravity_torques(robot, q)
    model = robot.model

    def energy(at):
        data = model.createData()
        return np.array(
            [pinocchio.computePotentialEnergy(model, data, row) for row in reference.to_pinocchio(robot, at)]
        )

    for j, unit in enumerate(np.eye(robot.n)):
        slope = (energy(q + STEP * unit) - energy(q - STEP * unit)) / (2 * STEP)
        np.testing.assert_allclose(torques[:, j], slope, rtol=0.0, atol=1e-6)


def test_a_point_moves_as_the_tool_and_its_lever(robot, configurations):
    q, point = configurations(robot, 10), np.array([0.05, -0.1, 0.2])
    at_point, at_tool = (reference.frame_jacobians(robot, q, point=p) for p in (point, np.zeros(3)))
    lever = reference.tool_poses(robot, q)[:, :3, :3] @ point
    moved = at_tool[:, :3] + np.cross(at_tool[:, 3:], lever[:, :, None], axis=1)
    np.testing.assert_allclose(at_point[:, :3], moved, atol=1e-14)
    np.testing.assert_allclose(at_point[:, 3:], at_tool[:, 3:], atol=1e-14)
