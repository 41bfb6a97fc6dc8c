"""Gravity torques and loads against arithmetic and against Pinocchio."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.kinematics.links import to_pinocchio
from thermal_robot.kinematics.urdf import parse_urdf
from thermal_robot.robot import load_robot


def potential_energy(robot, q, payload, com):
    model, data = robot.model, robot.model.createData()
    arm = [pinocchio.computePotentialEnergy(model, data, row) for row in to_pinocchio(robot, q)]
    poses = kin.tool_poses(robot, q)
    return np.array(arm) - payload * ((poses[:, :3, 3] + poses[:, :3, :3] @ com) @ robot.gravity)


def test_torque_is_the_gradient_of_the_potential_energy(arm, configurations):
    q = configurations(arm, 30)
    payload, com, step = np.linspace(0.0, 10.0, 30), np.array([0.05, -0.02, 0.1]), 1e-5
    torques = kin.gravity_torques(arm, q, payload=payload, payload_com=com)
    for j, unit in enumerate(np.eye(arm.n)):
        below, above = (potential_energy(arm, q + h * unit, payload, com) for h in (-step, step))
        np.testing.assert_allclose(torques[:, j], (above - below) / (2 * step), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("gravity", "arms"),
    # 2 kg at l3 + l4 + l5, l4 + l5 and l5 from the three pitch axes; nothing turns the waist or the roll. On the wall
    # q1 turns the arm, stretched along y over 0.72 m, toward +x, where gravity pulls: it must be held back.
    [(None, [0.0, 0.60, 0.35, 0.15, 0.0]), ([9.81, 0.0, 0.0], [-0.72, 0.0, 0.0, 0.0, 0.0])],
)
def test_payload_on_the_stretched_arm(gravity, arms):
    robot = load_robot("builtin:rv_m2", "tool0", gravity=gravity)
    share = kin.gravity_torques(robot, np.zeros(5), payload=2.0) - kin.gravity_torques(robot, np.zeros(5))
    np.testing.assert_allclose(share[0], 2 * 9.81 * np.array(arms), atol=1e-12)


def test_without_masses_only_the_payload_weighs(awkward_urdf, configurations):
    massless = load_robot(awkward_urdf.replace("inertial>", "ignored>"), "tip")
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


def test_what_a_segment_carries_is_what_pinocchio_says(arm, configurations):
    """Force and moment across every placement from the links of the URDF one by one, none of them lumped."""
    q, payload, com = configurations(arm, 4), np.linspace(0.0, 9.0, 4), np.array([0.05, -0.02, 0.1])
    loads, frames = kin.segment_loads(arm, q, payload=payload, payload_com=com), kin.chain_frames(arm, q)
    full = parse_urdf(arm.urdf, "the robot")
    rows = whole_configurations(full, arm, q)
    behind = links_behind(arm.urdf)
    bodies = {f.name: i for i, f in enumerate(full.frames) if f.type == pinocchio.FrameType.BODY}
    for i, row in enumerate(rows):
        data = full.createData()
        pinocchio.framesForwardKinematics(full, data, row)
        root = data.oMf[full.getFrameId(arm.root_frame, pinocchio.FrameType.BODY)]
        for s, segment in enumerate(arm.segments):
            mass, moment = payload[i], payload[i] * data.oMf[bodies[arm.tool_frame]].act(com)
            for link, weight, centre in behind[segment.name]:
                mass, moment = mass + weight, moment + weight * data.oMf[bodies[link]].act(centre)
            centre = root.actInv(moment / mass) if mass > 0 else np.zeros(3)
            axes, origin = frames.rotations[i, segment.index], frames.positions[i, segment.index]
            expected = np.concatenate([mass * arm.gravity, np.cross(mass * (centre - origin), arm.gravity)])
            expected = np.concatenate([axes.T @ expected[:3], axes.T @ expected[3:]])
            np.testing.assert_allclose(loads[i, s], expected, atol=1e-8 * (1.0 + np.abs(expected).max()))


def whole_configurations(full, arm, q):
    """The chain's joints as given, every other one where it is held, even if it drives the chain, for Pinocchio."""
    rows, tree = [], ElementTree.fromstring(arm.urdf)
    for values in q:
        row, at, held = pinocchio.neutral(full), {}, {}
        for j, name in enumerate(full.names[1:], start=1):
            joint = full.joints[j]
            low, high = full.lowerPositionLimit[joint.idx_q], full.upperPositionLimit[joint.idx_q]
            value = min(max(0.0, low), high) if joint.nq == 1 and low < high else 0.0
            held[name] = value
            at[name] = values[arm.joint_names.index(name)] if name in arm.joint_names else value
        for j, name in enumerate(full.names[1:], start=1):
            joint, value = full.joints[j], position(tree, name, at if name in arm.chain.names else held)
            if joint.nq == 2:
                row[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            elif joint.nq == 1:
                row[joint.idx_q] = value
        rows.append(row)
    return rows


def position(tree, joint, at):
    """Where a joint is, by the mimic tags and where those stand that follow none."""
    mimic = next(item for item in tree.findall("joint") if item.get("name") == joint).find("mimic")
    if mimic is None:
        return at[joint]
    followed = position(tree, mimic.get("joint"), at)
    return float(mimic.get("multiplier", 1.0)) * followed + float(mimic.get("offset", 0.0))


def links_behind(urdf):
    """Links that hang on each URDF joint, each with its mass and centre, read from the text of the URDF."""
    tree = ElementTree.fromstring(urdf)
    below, child = {}, {}
    for item in tree.findall("joint"):
        child[item.get("name")] = item.find("child").get("link")
        below.setdefault(item.find("parent").get("link"), []).append(child[item.get("name")])
    masses = {}
    for link in tree.findall("link"):
        if (inertial := link.find("inertial")) is not None:
            origin = inertial.find("origin")
            centre = np.zeros(3) if origin is None else np.array(origin.get("xyz", "0 0 0").split(), dtype=float)
            masses[link.get("name")] = float(inertial.find("mass").get("value")), centre
    behind = {}
    for joint, link in child.items():
        links = [link]
        for name in links:
            links += below.get(name, [])
        behind[joint] = [(name, *masses[name]) for name in links if name in masses]
    return behind


def test_the_static_regressor_gives_the_torques(arm, configurations):
    q = configurations(arm, 20)
    chain = arm.chain
    moments = np.concatenate([chain.masses[:, None], chain.masses[:, None] * chain.mass_centres], axis=1)
    torques = np.einsum("njbm,bm->nj", kin.static_regressor(arm, q), moments)
    np.testing.assert_allclose(torques, kin.gravity_torques(arm, q), atol=1e-9)
