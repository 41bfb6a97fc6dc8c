"""Gravity torques against the potential energy and against arithmetic."""

import numpy as np
import pinocchio
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.kinematics import reference
from thermal_robot.robot import load_robot


def potential_energy(robot, q, payload, com):
    model, data = robot.model, robot.model.createData()
    arm = [pinocchio.computePotentialEnergy(model, data, row) for row in reference.to_pinocchio(robot, q)]
    poses = kin.tool_poses(robot, q)
    return np.array(arm) - payload * ((poses[:, :3, 3] + poses[:, :3, :3] @ com) @ robot.gravity)


def test_torque_is_the_gradient_of_the_potential_energy(arm, configurations):
    q = configurations(arm, 30)
    payload, com, step = np.linspace(0.0, 10.0, 30), np.array([0.05, -0.02, 0.1]), 1e-5
    torques = kin.gravity_torques(arm, q, payload=payload, payload_com=com)
    for j, unit in enumerate(np.eye(arm.n)):
        below, above = (potential_energy(arm, q + h * unit, payload, com) for h in (-step, step))
        np.testing.assert_allclose(torques[:, j], (above - below) / (2 * step), rtol=0.0, atol=1e-6)


def test_payload_on_the_stretched_arm(rv_m2):
    q = np.zeros((1, 5))
    share = kin.gravity_torques(rv_m2, q, payload=2.0) - kin.gravity_torques(rv_m2, q)
    # 2 kg at l3 + l4 + l5, l4 + l5 and l5 from the three pitch axes; nothing turns the waist or the roll.
    np.testing.assert_allclose(share[0], [0.0, 2 * 9.81 * 0.60, 2 * 9.81 * 0.35, 2 * 9.81 * 0.15, 0.0], atol=1e-12)


def test_a_robot_on_the_wall_holds_itself_with_the_waist(configurations):
    wall = load_robot("builtin:rv_m2", "tool0", gravity=[9.81, 0.0, 0.0])
    share = kin.gravity_torques(wall, np.zeros(5), payload=2.0) - kin.gravity_torques(wall, np.zeros(5))
    # q1 turns the arm, stretched along y over 0.72 m, toward +x, where gravity pulls: it must be held back.
    np.testing.assert_allclose(share[0], [-2 * 9.81 * 0.72, 0.0, 0.0, 0.0, 0.0], atol=1e-12)


def test_without_masses_only_the_payload_weighs(awkward_urdf, configurations):
    massless = load_robot(
        awkward_urdf.replace("<mass value", "<mass ignored='1' value").replace("inertial>", "ignored>"), "tip"
    )
    assert not massless.has_masses
    q = configurations(massless, 5)
    assert np.all(kin.gravity_torques(massless, q) == 0.0)
    one, three = (kin.gravity_torques(massless, q, payload=m) for m in (1.0, 3.0))
    np.testing.assert_allclose(three, 3.0 * one, atol=1e-12)
    assert np.all(np.abs(one).max(axis=0) > 0.1)


def test_gravity_default_is_down_in_the_root_of_the_urdf(awkward, awkward_urdf, configurations):
    q = configurations(awkward, 10)
    from_ground = load_robot(awkward_urdf, "tip")
    assert from_ground.joint_names[1:] == awkward.joint_names
    lifted = np.column_stack([np.full(10, 0.2), q])
    np.testing.assert_allclose(
        kin.gravity_torques(awkward, q), kin.gravity_torques(from_ground, lifted)[:, 1:], atol=1e-12
    )
    assert np.linalg.norm(awkward.gravity) == pytest.approx(9.81)
    np.testing.assert_allclose(from_ground.gravity, [0.0, 0.0, -9.81])
