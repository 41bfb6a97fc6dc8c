"""The four channels: the displaced robot against its linear response, by a five-point stencil."""

import io

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError

STEP = 1e-3
TOLERANCE = 5e-10  # STEP⁴ times lengths of a metre or two, by what mimic joints multiply; rounding over STEP
ROWS = 20


def twist_between(before, after):
    """Twist (N, 6) in root axes, at the tool, that carries one pose to the other in a unit of time."""
    turn = kin.log3(after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], 1, 2))
    return np.concatenate([after[:, :3, 3] - before[:, :3, 3], turn], axis=1)


def response(robot, q, **channel):
    """Twist of the tool by a channel, each row of which has an error of one unit, about errors everywhere."""
    ((name, units),) = channel.items()
    rng = np.random.default_rng(5)
    # large errors but in the segments, which are differentiated about zero
    about = {"joint": rng.normal(0, 0.3, robot.n), "segment": np.zeros((len(robot.segments), 6))}
    about |= {"base": rng.normal(0, 0.3, 6), "tool": rng.normal(0, 0.3, 6)}
    about = about if name in ("joint", "segment") else {name: np.zeros(6)}
    for unit in units:
        steps = (-2 * STEP, -STEP, STEP, 2 * STEP)
        poses = [kin.tool_poses(robot, q, kin.Displacement(**{**about, name: about[name] + h * unit})) for h in steps]
        yield (8 * twist_between(*poses[1:3]) - twist_between(poses[0], poses[3])) / (12 * STEP)
    yield kin.chain_frames(robot, q, kin.Displacement(**about))


def test_joint_and_segment_channels_are_jacobian_and_placement_sensitivity(arm, configurations):
    q, s = configurations(arm, ROWS), len(arm.segments)
    *found, frames = response(arm, q, joint=np.eye(arm.n))
    jacobians = kin.frame_jacobians(arm, q, frames=frames)
    np.testing.assert_allclose(jacobians, np.stack(found, axis=-1), rtol=0.0, atol=TOLERANCE)
    *found, frames = response(arm, q, segment=np.eye(s * 6).reshape(-1, s, 6))
    sensitivities = kin.placement_sensitivities(arm, q, frames=frames).reshape(ROWS, 6, -1)
    np.testing.assert_allclose(sensitivities, np.stack(found, axis=-1), rtol=0.0, atol=TOLERANCE)


def test_base_channel_moves_the_whole_robot_and_tool_channel_turns_with_the_tool(arm, configurations):
    q = configurations(arm, ROWS)
    poses = kin.tool_poses(arm, q)
    rotation, position = poses[:, :3, :3], poses[:, :3, 3]
    *base, _ = response(arm, q, base=np.eye(6))
    *tool, _ = response(arm, q, tool=np.eye(6))
    for unit, of_base, of_tool in zip(np.eye(6), base, tool, strict=True):
        whole = np.concatenate([unit[:3] + np.cross(unit[3:], position), np.tile(unit[3:], (ROWS, 1))], axis=1)
        np.testing.assert_allclose(of_base, whole, rtol=0.0, atol=TOLERANCE)
        turned = np.concatenate([rotation @ unit[:3], rotation @ unit[3:]], axis=1)
        np.testing.assert_allclose(of_tool, turned, rtol=0.0, atol=TOLERANCE)


def test_what_the_sum_of_the_channels_leaves_out_is_of_second_order(arm, configurations):
    q, rng = configurations(arm, ROWS), np.random.default_rng(6)
    joint, base, tool = rng.normal(size=arm.n), rng.normal(size=6), rng.normal(size=6)
    segment = rng.normal(size=(len(arm.segments), 6))
    nominal = kin.tool_poses(arm, q)
    rotation, position = nominal[:, :3, :3], nominal[:, :3, 3]
    linear = kin.frame_jacobians(arm, q) @ joint
    linear += np.einsum("nask,sk->na", kin.placement_sensitivities(arm, q), segment)
    linear += np.concatenate([base[:3] + np.cross(base[3:], position), np.tile(base[3:], (ROWS, 1))], axis=1)
    linear += np.concatenate([rotation @ tool[:3], rotation @ tool[3:]], axis=1)

    def left_out(size):
        errors = kin.Displacement(size * joint, size * segment, size * base, size * tool)
        return np.linalg.norm(twist_between(nominal, kin.tool_poses(arm, q, errors)) - size * linear)

    assert left_out(1e-3) / left_out(1e-4) == pytest.approx(100.0, rel=0.1)


def test_elongation_lengthens_the_placement_and_turns_nothing(arm):
    growing, q = [s for s, segment in enumerate(arm.segments) if segment.length > 0.0], np.zeros((1, arm.n))
    assert growing
    before = kin.chain_frames(arm, q)
    for s in growing:
        segment, twists = arm.segments[s], np.zeros((len(arm.segments), 6))
        twists[s, :3] = 1e-3 * segment.direction
        after, k = kin.chain_frames(arm, q, kin.Displacement(segment=twists)), segment.index
        np.testing.assert_array_equal(after.rotations, before.rotations)
        moved = after.positions[0, k] - before.positions[0, k]
        parent = before.rotations[0, k] @ arm.chain.rotations[k].T
        np.testing.assert_allclose(moved, 1e-3 * parent @ arm.chain.translations[k] / segment.length, atol=1e-15)


def test_the_stretched_arm(rv_m2):
    pose = kin.tool_poses(rv_m2, np.zeros(5))[0]
    np.testing.assert_allclose(pose[:3, 3], [0.0, 0.12 + 0.25 + 0.20 + 0.15, 0.40], atol=1e-15)
    np.testing.assert_allclose(pose[:3, :3], np.eye(3), atol=1e-15)


# ---- augmented models and links


POSES = 200


def paper_jacobian(q):
    """Eqs 9–11 of Kluz et al. (2018), as printed: (N, 3, 5)."""
    q1, q2, q3, q4 = q[:, 0], q[:, 1], q[:, 2], q[:, 3]
    zero, one = np.zeros(len(q)), np.ones(len(q))
    horizontal = np.stack([zero, one, np.cos(q2), np.cos(q2 + q3), np.cos(q2 + q3 + q4)], axis=-1)
    vertical = np.stack([one, zero, np.sin(q2), np.sin(q2 + q3), np.sin(q2 + q3 + q4)], axis=-1)
    return np.stack([np.sin(q1)[:, None] * horizontal, np.cos(q1)[:, None] * horizontal, vertical], axis=1)


def test_rv_m2_has_the_five_virtual_joints_of_the_paper(rv_m2):
    augmented = kin.augmented_model(rv_m2)
    assert augmented.segments == ("column_top", "joint_2", "joint_3", "joint_4", "tool_point")
    # its virtual joint comes before a movable one, so that it is not turned by it
    virtual = [f"elongation of {name}" for name in augmented.segments]
    own = [f"joint_{k}" for k in range(1, 6)]
    expected = [own[0], *virtual[:2], own[1], virtual[2], own[2], virtual[3], *own[3:], virtual[4]]
    assert list(augmented.model.names)[1:] == expected
    assert augmented.model.nq == augmented.model.nv == 10


def test_pinocchios_jacobian_is_equations_9_to_11(rv_m2, configurations):
    q, augmented = configurations(rv_m2, POSES), kin.augmented_model(rv_m2)
    theirs = augmented.jacobians(q)[:, :, augmented.elongations]
    np.testing.assert_allclose(theirs[:, :3], paper_jacobian(q), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(theirs[:, 3:], 0.0, atol=1e-15)
    np.testing.assert_allclose(kin.elongation_jacobian(rv_m2, q), paper_jacobian(q), rtol=0.0, atol=1e-12)


def test_pinocchios_jacobian_is_the_placement_sensitivity_along_each_segment(arm, configurations):
    q, augmented = configurations(arm, POSES), kin.augmented_model(arm)
    jacobians = augmented.jacobians(q)
    sensitivities = kin.placement_sensitivities(arm, q)
    along = [sensitivities[:, :, s, :3] @ arm.segments[s].direction for s in kin.growing(arm)]
    expected = np.stack(along, axis=-1)
    np.testing.assert_allclose(jacobians[:, :, augmented.elongations], expected, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(jacobians[:, :, augmented.joints], kin.frame_jacobians(arm, q), rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(kin.elongation_jacobian(arm, q), expected[:, :3], rtol=0.0, atol=1e-12)


def test_the_augmented_model_knows_the_robots_limits_and_gravity(arm):
    augmented = kin.augmented_model(arm)
    # of a joint beside the chain the limits are those between which it takes the first that follows it
    some = np.isfinite(arm.lower) & np.isfinite(arm.upper)
    bounds = np.where(some, [arm.lower, arm.upper], 0.0)
    ends = augmented.configurations(bounds)[:, augmented.joints[some]]
    model = augmented.model
    limits = np.array([model.lowerPositionLimit, model.upperPositionLimit])[:, augmented.joints]
    np.testing.assert_allclose(limits[:, some], np.sort(ends, axis=0), rtol=1e-15)
    assert np.isinf(limits[:, ~some]).any(axis=0).all()
    np.testing.assert_array_equal(model.gravity.linear, arm.gravity)


def test_elongated_it_is_the_elongated_robot(arm, configurations):
    q, augmented = configurations(arm, 50), kin.augmented_model(arm)
    grown = np.random.default_rng(7).normal(0.0, 0.1, (50, len(augmented.segments)))
    twists = np.zeros((50, len(arm.segments), 6))
    for column, s in enumerate(kin.growing(arm)):
        twists[:, s, :3] = grown[:, column, None] * arm.segments[s].direction
    expected = kin.tool_poses(arm, q, kin.Displacement(segment=twists))
    np.testing.assert_allclose(augmented.tool_poses(q, grown), expected, rtol=0.0, atol=1e-10)


def test_shapes_that_do_not_fit_are_said(rv_m2):
    augmented = kin.augmented_model(rv_m2)
    with pytest.raises(RobotError, match=r"\(3, 4\) do not fit: expected \(N, 5\)"):
        augmented.tool_poses(np.zeros((3, 4)))
    with pytest.raises(RobotError, match=r"elongations of shape \(4,\) do not fit: expected \(5,\)"):
        augmented.tool_poses(np.zeros((3, 5)), np.zeros(4))
    assert augmented.tool_poses(np.empty((0, 5))).shape == (0, 4, 4)


def test_no_configurations_have_no_elongations(rv_m2):
    assert kin.elongation_jacobian(rv_m2, np.empty((0, 5))).shape == (0, 3, 5)


def test_links_are_where_pinocchio_has_them_in_the_whole_robot(rv_m2, configurations):
    model = pin.buildModelFromXML(rv_m2.urdf)
    data, q = model.createData(), configurations(rv_m2, 20)
    for row, configuration in zip(kin.link_poses(rv_m2, q), q, strict=True):
        pin.framesForwardKinematics(model, data, configuration)
        expected = [data.oMf[model.getFrameId(link)].homogeneous for link in rv_m2.urdf_links]
        np.testing.assert_allclose(row, expected, atol=1e-9)


def test_links_of_the_chain_are_where_the_batch_kinematics_have_them(arm, configurations):
    q = configurations(arm, 5)
    found = dict(zip(arm.urdf_links, np.moveaxis(kin.link_poses(arm, q), 1, 0), strict=True))
    np.testing.assert_allclose(found[arm.tool_frame], kin.tool_poses(arm, q), atol=1e-9)
    np.testing.assert_allclose(found[arm.root_frame], np.broadcast_to(np.eye(4), (5, 4, 4)), atol=1e-12)
    frames = kin.chain_frames(arm, q)
    for k, link in enumerate(arm.chain.parent_links):
        placed = found[link][:, :3, :3] @ arm.chain.translations[k] + found[link][:, :3, 3]
        np.testing.assert_allclose(placed, frames.positions[:, k], atol=1e-9)


def test_a_branch_beside_the_chain_stands_where_it_is_held(awkward, awkward_urdf):
    whole = yourdfpy.URDF.load(io.StringIO(awkward_urdf), load_meshes=False, build_scene_graph=True)
    q = 0.5 * (np.maximum(awkward.lower, -1.0) + np.minimum(awkward.upper, 1.0))
    q[awkward.joint_names.index("slide")] = 0.0  # yourdfpy takes an axis for a unit vector, which this one is not
    # the lift below the root frame does not matter here; the branch may turn from −0.9 to −0.3 only: nearest to zero
    whole.update_cfg({**dict(zip(awkward.joint_names, q, strict=True)), "lift": 0.2, "branch_joint": -0.3})
    for link, pose in zip(awkward.urdf_links, kin.link_poses(awkward, q)[0], strict=True):
        np.testing.assert_allclose(pose, whole.get_transform(link, awkward.root_frame), atol=1e-9, err_msg=link)
