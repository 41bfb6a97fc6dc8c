"""Segments that grow: Pinocchio's virtual joints, the paper's formula, finite differences; and where all links are."""

import io

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError

ROWS = 200


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
    q, augmented = configurations(rv_m2, ROWS), kin.augmented_model(rv_m2)
    theirs = augmented.jacobians(q)[:, :, augmented.elongations]
    np.testing.assert_allclose(theirs[:, :3], paper_jacobian(q), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(theirs[:, 3:], 0.0, atol=1e-15)
    np.testing.assert_allclose(kin.elongation_jacobian(rv_m2, q), paper_jacobian(q), rtol=0.0, atol=1e-12)


def test_pinocchios_jacobian_is_the_placement_sensitivity_along_each_segment(arm, configurations):
    q, augmented = configurations(arm, ROWS), kin.augmented_model(arm)
    jacobians = augmented.jacobians(q)
    sensitivities = kin.placement_sensitivities(arm, q)
    along = [sensitivities[:, :, s, :3] @ arm.segments[s].direction for s in kin.growing(arm)]
    expected = np.stack(along, axis=-1)
    np.testing.assert_allclose(jacobians[:, :, augmented.elongations], expected, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(jacobians[:, :, augmented.joints], kin.frame_jacobians(arm, q), rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(kin.elongation_jacobian(arm, q, rows=6), expected, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(
        kin.elongation_jacobian(arm, q), kin.elongation_jacobian(arm, q, frames=kin.chain_frames(arm, q))
    )


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


def test_an_elongation_has_a_position_or_a_twist(rv_m2):
    with pytest.raises(RobotError, match="3 or 6 rows, not 4"):
        kin.elongation_jacobian(rv_m2, np.zeros(5), rows=4)
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
