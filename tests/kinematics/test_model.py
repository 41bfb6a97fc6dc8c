"""The constant arrays of a chain, what hangs on it, and where joints stand that are no part of it."""

import io

import numpy as np
import pinocchio
import pytest
import yourdfpy
from coupled import COUPLED, PARALLELOGRAM, joint, link, urdf

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.links import to_pinocchio
from thermal_robot.kinematics.model import (
    FIXED,
    PRISMATIC,
    REVOLUTE,
    Mimic,
    followed,
    held_configuration,
    held_position,
    mimics,
    unit_motion,
)
from thermal_robot.kinematics.urdf import parse_urdf
from thermal_robot.robot import load_robot


def test_the_chain_is_what_the_text_says(awkward):
    chain = awkward.chain
    names = ("turret", "slide", "post_joint", "roll_joint", "rail_joint", "hand_joint", "tip_joint")
    assert chain.names == names
    assert chain.parent_links == ("base", "turret", "slide", "post", "roll", "rail", "hand")
    assert chain.kinds.tolist() == [REVOLUTE, PRISMATIC, FIXED, REVOLUTE, PRISMATIC, REVOLUTE, FIXED]
    assert awkward.joint_types == ("revolute", "prismatic", "continuous", "prismatic", "continuous")
    assert chain.movable.tolist() == [0, 1, 3, 4, 5]
    np.testing.assert_allclose(chain.translations[2], [0.05, -0.3, 0.1])
    np.testing.assert_allclose(chain.axes[0], np.array([1, 2, -3]) / np.sqrt(14), rtol=1e-15)
    assert not chain.axes[2].any()
    np.testing.assert_array_equal(awkward.lower, [-2, -0.5, -np.inf, 0, -np.inf])
    np.testing.assert_array_equal(awkward.upper, [2.5, 0.8, np.inf, 0.3, np.inf])
    # the branch's kilogram hangs on the slide; post, rail and tip have no mass
    np.testing.assert_allclose(chain.masses, [3.0, 2.0 + 1.0, 1.5, 0.0, 0.5], rtol=1e-14)
    # names include what is beyond the tool and before the root
    assert set(awkward.urdf_links) - {*chain.parent_links, "tip"} == {"ground", "branch"}
    assert set(awkward.urdf_joints) - set(names) == {"lift", "branch_joint"}
    assert not any(array.flags.writeable for array in (chain.rotations, chain.coupling.matrix, awkward.lower))


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
            assert chain.masses[j] == pytest.approx(model.inertias[j + 1].mass, abs=1e-12)
            np.testing.assert_allclose(position + rotation @ chain.mass_centres[j], theirs, rtol=0.0, atol=1e-10)


def test_names_and_what_hangs_are_those_of_the_whole_tree(arm):
    """What a fixed frame carries is the sum over the tree up to the next joint of the chain."""
    tree = yourdfpy.URDF.load(io.BytesIO(arm.urdf.encode()), load_meshes=False, build_scene_graph=False).robot
    assert sorted(arm.urdf_links) == sorted(link.name for link in tree.links)
    assert sorted(arm.urdf_joints) == sorted(joint.name for joint in tree.joints)
    assert set(arm.joint_names) <= set(arm.urdf_joints)
    assert {arm.tool_frame, arm.root_frame} <= set(arm.urdf_links)
    mass = {link.name: link.inertial.mass for link in tree.links if link.inertial is not None}
    children = {item.name: item.child for item in tree.joints}
    movable = {arm.chain.names[k] for k in arm.chain.movable}

    def beyond(name):
        onward = [item for item in tree.joints if item.parent == name and item.name not in movable]
        return mass.get(name, 0.0) + sum(beyond(item.child) for item in onward)

    expected = [0.0 if name in movable else beyond(children[name]) for name in arm.chain.names]
    np.testing.assert_allclose(arm.chain.hanging, expected, rtol=0.0, atol=1e-9)


def test_a_fixed_frame_carries_what_is_fixed_behind_it_at_its_centre():
    # base - j - body - (fixed) adapter - (fixed) extension - k - hand - (fixed) tool, and a branch held on the adapter
    text = urdf(
        link("base"), link("body", 7, "0.1 0 0"), link("adapter", 2, "0 0.1 0"), link("branch", 1, "0 0 0.5"),
        link("extension", 3, "0.4 0 0"), link("hand", 5), link("tool", 0.5, "0 0 0.1"),
        joint("j", "revolute", "base", "body", "0 0 1", limits=(-1, 1)),
        joint("flange", "fixed", "body", "adapter", "0.3 0 0", "0 0 1.5707963267948966"),
        joint("held", "revolute", "adapter", "branch", "0 0.2 0", limits=(-1, 1)),
        joint("rod", "fixed", "adapter", "extension", "0.2 0 0"),
        joint("k", "revolute", "extension", "hand", "0.8 0 0", limits=(-1, 1)),
        joint("grip", "fixed", "hand", "tool", "0 0 0.2"),
    )  # fmt: skip
    chain = load_robot(text, "tool").chain
    hanging = dict(zip(chain.names, chain.hanging, strict=True))
    assert hanging == pytest.approx({"j": 0.0, "flange": 2 + 1 + 3, "rod": 3.0, "k": 0.0, "grip": 0.5})
    centres = dict(zip(chain.names, chain.hanging_centres, strict=True))
    # adapter, branch and extension in the frame of the flange; its quarter turn must not show
    parts = 2 * np.array([0, 0.1, 0]) + 1 * np.array([0, 0.2, 0.5]) + 3 * np.array([0.2 + 0.4, 0, 0])
    np.testing.assert_allclose(centres["flange"], parts / 6, atol=1e-14)
    np.testing.assert_allclose(centres["rod"], [0.4, 0, 0], atol=1e-14)
    np.testing.assert_allclose(centres["grip"], [0, 0, 0.1], atol=1e-14)
    np.testing.assert_array_equal(centres["j"], np.zeros(3))
    without = load_robot(text.replace("inertial>", "ignored>"), "tool").chain
    assert not without.hanging.any()
    assert not without.hanging_centres.any()


def test_a_joints_unit_motion_is_how_it_moves(arm):
    model, step = arm.model, 1e-6
    q = np.asarray(pinocchio.neutral(model))
    for moving in list(model.joints)[1:]:
        speed = np.zeros(model.nv)
        speed[moving.idx_v] = step
        data, moved = moving.createData(), moving.createData()
        moving.calc(data, q)
        moving.calc(moved, pinocchio.integrate(model, q, speed))
        twist = pinocchio.log6(data.M.actInv(moved.M)).vector / step
        np.testing.assert_allclose(unit_motion(model, moving), twist, rtol=0.0, atol=1e-9)


def test_gravity_is_the_same_down_for_every_root(awkward_urdf):
    full = parse_urdf(awkward_urdf, "awkward")
    found = {root: load_robot(awkward_urdf, "tip", root_frame=root) for root in (None, "base", "turret")}
    assert found[None].root_frame == "ground"
    np.testing.assert_allclose(found[None].gravity, [0, 0, -9.81])
    for robot in found.values():
        np.testing.assert_allclose(robot.model.gravity.linear, full.gravity.linear, atol=1e-14)
        assert np.linalg.norm(robot.gravity) == pytest.approx(9.81)


@pytest.mark.parametrize(
    ("tool", "root", "name", "words"),
    [
        ("tipp", None, "tipp", "tool frame 'tipp' is not a link of robot 'awkward'; nearest: tip"),
        ("tip", "bas", "bas", "root frame 'bas' is not a link .* nearest: base"),
        ("branch", "roll", "branch", "'branch' is not below root frame 'roll'"),
        ("tip", "hand", "", "no movable joint"),
        ("", None, "", "the links at the ends of this robot are branch, tip"),
    ],
)
def test_what_cannot_be_built_names_what_offends(awkward_urdf, tool, root, name, words):
    with pytest.raises(RobotError, match=words) as caught:
        load_robot(awkward_urdf, tool, root_frame=root)
    assert caught.value.name == name


def held(text):
    model = parse_urdf(text, "a test")
    q = held_configuration(model, followed(mimics(text), list(model.names), []))
    return {name: held_position(model, q, name) for name in list(model.names)[1:]}


def test_joints_beside_a_chain_stand_at_zero_or_the_limit_nearest_to_it_or_where_what_they_follow_is(awkward_urdf):
    expected = {"lift": 0.2, "turret": 0.0, "slide": 0.0, "branch_joint": -0.3, "roll_joint": 0.0}
    assert held(awkward_urdf) == pytest.approx(expected | {"rail_joint": 0.0, "hand_joint": 0.0}, abs=1e-15)
    found = held(COUPLED)
    expected = {"early": -0.2, "stage_2": 0.02, "stage_3": 0.05 - 0.04, "half": 1.3, "rack": 0.0, "jaw": 0.7}
    for name, position in (expected | {"finger": 0.2, "thumb": -0.7}).items():
        assert found[name] == pytest.approx(position, abs=1e-15)
    assert held(PARALLELOGRAM)["upright"] == pytest.approx(0.3)


def test_a_fixed_joint_stays_and_can_be_followed():
    text = urdf(
        link("a"), link("b"), link("c"), link("d"),
        joint("f", "fixed", "a", "b", mimic='joint="k" offset="0.5"'),
        joint("j", "continuous", "b", "c", mimic='joint="f" multiplier="3" offset="0.25"'),
        joint("k", "continuous", "c", "d", "1 0 0"),
    )  # fmt: skip
    robot = load_robot(text, "d")
    assert robot.joint_names == ("k",)
    expected = [np.cos(0.25), np.sin(0.25), 0.0]
    np.testing.assert_allclose(kin.tool_poses(robot, [1.0])[0, :3, 3], expected, atol=1e-15)


def test_what_has_no_single_position_cannot_be_followed():
    text = urdf(*map(link, "abc"), joint("free", "floating", "a", "b"), joint("j", "continuous", "b", "c"))
    with pytest.raises(RobotError, match="'free', which another one mimics, has no single position") as refused:
        held_configuration(parse_urdf(text, "a test"), {"j": Mimic("free")})
    assert refused.value.name == "free"


def test_a_column_that_follows_a_lift_below_the_root_frame_carries_the_arm():
    # a second stage follows the first, wherever the root frame is
    text = urdf(
        link("floor"), link("one"), link("two", 2.0), link("arm"),
        joint("first", "prismatic", "floor", "one", limits=(0.2, 1.0)),
        joint("second", "prismatic", "one", "two", limits=(0.0, 3.0), mimic='joint="first" multiplier="2"'),
        joint("turn", "continuous", "two", "arm", axis="0 1 0"),
    )  # fmt: skip
    for root, height in (("floor", 0.9), ("one", 0.6)):
        robot = load_robot(text, "arm", root_frame=root)
        assert robot.joint_names == ("first", "turn")
        np.testing.assert_allclose(kin.tool_poses(robot, [0.3, 1.0])[0, :3, 3], [0.0, 0.0, height], atol=1e-15)
        np.testing.assert_allclose(robot.upper, [1.0, np.inf])
