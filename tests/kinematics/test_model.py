"""The constant arrays of a chain: what they say of a robot whose numbers are known, and what Pinocchio says."""

import io

import numpy as np
import pinocchio
import pytest
import yourdfpy

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.augmented import to_pinocchio
from thermal_robot.kinematics.model import FIXED, PRISMATIC, REVOLUTE, build_chain_model, leaf_links, unit_motion
from thermal_robot.kinematics.urdf import parse_urdf


@pytest.fixture
def built(awkward_urdf):
    return build_chain_model(awkward_urdf, "tip", "base", None)


def test_the_chain_is_what_the_text_says(built):
    chain = built.chain
    assert chain.names == (
        "turret", "slide", "post_joint", "roll_joint", "rail_joint", "hand_joint", "tip_joint",
    )  # fmt: skip
    assert chain.parent_links == ("base", "turret", "slide", "post", "roll", "rail", "hand")
    assert chain.kinds.tolist() == [REVOLUTE, PRISMATIC, FIXED, REVOLUTE, PRISMATIC, REVOLUTE, FIXED]
    assert built.joint_types == ("revolute", "prismatic", "continuous", "prismatic", "continuous")
    assert chain.movable.tolist() == [0, 1, 3, 4, 5]
    np.testing.assert_allclose(chain.translations[2], [0.05, -0.3, 0.1])
    np.testing.assert_allclose(chain.axes[0], np.array([1, 2, -3]) / np.sqrt(14), rtol=1e-15)
    assert not chain.axes[2].any()
    np.testing.assert_array_equal(built.lower, [-2, -0.5, -np.inf, 0, -np.inf])
    np.testing.assert_array_equal(built.upper, [2.5, 0.8, np.inf, 0.3, np.inf])


def test_a_joint_carries_its_link_and_the_branches_on_it(built):
    # the branch's kilogram hangs on the slide; post, rail and tip have no mass
    np.testing.assert_allclose(built.chain.masses, [3.0, 2.0 + 1.0, 1.5, 0.0, 0.5], rtol=1e-14)


def test_every_placement_is_a_rotation_and_every_axis_a_unit_vector(arm):
    chain = arm.chain
    products = chain.rotations @ np.swapaxes(chain.rotations, 1, 2)
    np.testing.assert_allclose(products, np.broadcast_to(np.eye(3), products.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(chain.rotations), 1.0, atol=1e-14)
    lengths = np.linalg.norm(chain.axes, axis=1)
    np.testing.assert_allclose(lengths, (chain.kinds != FIXED).astype(float), atol=1e-14)
    assert np.flatnonzero(chain.kinds).tolist() == chain.movable.tolist()
    assert set(chain.movable) <= set(chain.placed)


def test_masses_and_their_centres_are_pinocchios(arm, configurations):
    q = configurations(arm, 3)
    frames, chain, model = kin.chain_frames(arm, q), arm.chain, arm.model
    root = model.frames[model.getFrameId(arm.root_frame, pinocchio.FrameType.BODY)].placement
    for i, row in enumerate(to_pinocchio(arm, q)):
        data = model.createData()
        pinocchio.forwardKinematics(model, data, row)
        for j, k in enumerate(chain.movable):
            theirs = root.actInv(data.oMi[j + 1].act(model.inertias[j + 1].lever))
            last = k + 1 == len(chain.names)
            rotation = frames.tool_rotation[i] if last else frames.rotations[i, k + 1]
            position = frames.tool_position[i] if last else frames.positions[i, k + 1]
            ours = position + rotation @ chain.mass_centres[j]
            assert chain.masses[j] == pytest.approx(model.inertias[j + 1].mass, abs=1e-12)
            np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-10)


def test_all_names_of_the_urdf_are_there(arm):
    tree = yourdfpy.URDF.load(io.BytesIO(arm.urdf.encode()), load_meshes=False, build_scene_graph=False).robot
    assert sorted(arm.urdf_links) == sorted(link.name for link in tree.links)
    assert sorted(arm.urdf_joints) == sorted(joint.name for joint in tree.joints)
    assert set(arm.joint_names) <= set(arm.urdf_joints)
    assert {arm.tool_frame, arm.root_frame} <= set(arm.urdf_links)


def test_names_include_what_is_beyond_the_tool_and_before_the_root(built):
    assert set(built.urdf_links) - {*built.chain.parent_links, "tip"} == {"ground", "branch"}
    assert set(built.urdf_joints) - set(built.chain.names) == {"lift", "branch_joint"}


def test_a_joints_unit_motion_is_how_it_moves(arm):
    model, step = arm.model, 1e-6
    q = np.asarray(pinocchio.neutral(model))
    for j in range(1, model.njoints):
        joint = model.joints[j]
        speed = np.zeros(model.nv)
        speed[joint.idx_v] = step
        data, moved = joint.createData(), joint.createData()
        joint.calc(data, q)
        joint.calc(moved, pinocchio.integrate(model, q, speed))
        twist = pinocchio.log6(data.M.actInv(moved.M)).vector / step
        np.testing.assert_allclose(unit_motion(model, joint), twist, rtol=0.0, atol=1e-9)


def test_gravity_is_the_same_down_for_every_root(awkward_urdf):
    full = parse_urdf(awkward_urdf, "awkward")
    found = {root: build_chain_model(awkward_urdf, "tip", root, None) for root in (None, "base", "turret")}
    assert found[None].root_frame == "ground"
    np.testing.assert_allclose(found[None].gravity, [0, 0, -9.81])
    for built in found.values():
        np.testing.assert_allclose(built.model.gravity.linear, full.gravity.linear, atol=1e-14)
        assert np.linalg.norm(built.gravity) == pytest.approx(9.81)


def test_the_ends_of_the_tree(awkward_urdf):
    assert leaf_links(awkward_urdf) == ("branch", "tip")


def test_what_cannot_be_built_names_what_offends(awkward_urdf):
    for tool, root, name, words in (
        ("tipp", None, "tipp", "tool frame 'tipp' is not a link of robot 'awkward'; nearest: tip"),
        ("tip", "bas", "bas", "root frame 'bas' is not a link .* nearest: base"),
        ("branch", "roll", "branch", "'branch' is not below root frame 'roll'"),
        ("tip", "hand", "", "no movable joint"),
    ):
        with pytest.raises(RobotError, match=words) as caught:
            build_chain_model(awkward_urdf, tool, root, None)
        assert caught.value.name == name
