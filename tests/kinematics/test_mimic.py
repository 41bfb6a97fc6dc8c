"""Joints that mimic others: against the same arm driven by hand, arithmetic, and Pinocchio's own mimics."""

import numpy as np
import pinocchio
import pytest
from coupled import ARMS, DRIVEN, by_hand, coupled, explicit, joint, link, urdf

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.model import Mimic, common_limits, couple, followed, mimics
from thermal_robot.robot import load_robot

ROWS = 40


@pytest.mark.parametrize("name", ARMS)
def test_it_is_the_arm_driven_by_hand(name, configurations):
    """That derivatives are those of its poses, and torques of its energy, the tests of all arms say."""
    arm, driven = coupled(name), explicit(name)
    q = configurations(arm, ROWS)
    whole = by_hand(name, q)
    assert arm.joint_names == DRIVEN[name]
    assert arm.n == len(arm.joint_types) == len(arm.lower) < driven.n
    assert [(s.name, s.movable) for s in arm.segments] == [(s.name, s.movable) for s in driven.segments]
    # a displaced joint takes along what mimics it
    error = np.random.default_rng(3).normal(0.0, 0.1, q.shape)
    segment = np.random.default_rng(4).normal(0.0, 0.1, (len(arm.segments), 6))
    displaced = kin.tool_poses(arm, q, kin.Displacement(joint=error, segment=segment))
    expected = kin.tool_poses(driven, by_hand(name, q + error), kin.Displacement(segment=segment))
    np.testing.assert_allclose(displaced, expected, rtol=0.0, atol=1e-12)
    for function, within in (
        (kin.tool_poses, 1e-12),
        (kin.placement_sensitivities, 1e-12),
        (kin.segment_loads, 1e-10),
    ):
        np.testing.assert_allclose(function(arm, q), function(driven, whole), rtol=0.0, atol=within)
    assert kin.static_regressor(arm, q).shape == (ROWS, arm.n, driven.n, 4)


@pytest.mark.skipif(not hasattr(pinocchio, "JointModelMimic"), reason="this Pinocchio has no mimics of its own")
def test_pinocchios_own_mimic_agrees_where_it_has_one(configurations):
    # it knows poses, Jacobians and gravity torques, of a joint that follows one nearer to the root
    arm = coupled("parallelogram")
    model = pinocchio.buildModelFromXML(arm.urdf, mimic=True)
    assert model.nv == arm.n
    data, tool = model.createData(), model.getFrameId("tool")
    q = configurations(arm, ROWS)
    ours = zip(q, kin.tool_poses(arm, q), kin.frame_jacobians(arm, q), kin.gravity_torques(arm, q), strict=True)
    for row, pose, jacobian, torque in ours:
        theirs = np.array([*row[:3], np.cos(row[3]), np.sin(row[3])])
        pinocchio.framesForwardKinematics(model, data, theirs)
        np.testing.assert_allclose(pose, data.oMf[tool].homogeneous, rtol=0.0, atol=1e-12)
        found = pinocchio.computeFrameJacobian(model, data, theirs, tool, pinocchio.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(jacobian, found, rtol=0.0, atol=1e-12)
        held = pinocchio.computeGeneralizedGravity(model, data, theirs)
        np.testing.assert_allclose(torque, held, rtol=0.0, atol=1e-10)


def test_the_hand_stays_upright_however_the_arm_reaches():
    arm = coupled("parallelogram")
    q = np.zeros((7, 4))
    q[:, 2] = np.linspace(-1.4, 1.3, 7)
    poses = kin.tool_poses(arm, q)
    np.testing.assert_allclose(poses[:, 2, 2], np.cos(0.3), rtol=1e-14)
    assert np.ptp(poses[:, 0, 3]) > 0.3
    np.testing.assert_allclose(kin.frame_jacobians(arm, q)[:, 3:, 2], 0.0, atol=1e-15)
    # as it does not turn, the forearm's drive does not feel where on the hand a load is: the shoulder does
    near, far = (kin.gravity_torques(arm, q, payload=5.0, payload_com=[x, 0.0, 0.0]) for x in (0.0, 0.4))
    np.testing.assert_allclose(far[:, 2], near[:, 2], atol=1e-12)
    np.testing.assert_allclose(near[:, 1] - far[:, 1], 5.0 * 9.81 * 0.4 * np.cos(0.3), rtol=1e-12)
    # the hand reaches its lower limit of −1.0 where 0.3 − reach does
    np.testing.assert_allclose(arm.upper[2], 1.3, rtol=1e-15)
    np.testing.assert_array_equal(arm.lower, [-2.5, -1.2, -1.4, -np.inf])


def test_a_telescope_grows_by_all_its_stages():
    stages = [
        joint("first", "prismatic", "ground", "one", "0 0 0.5", limits=(0.0, 0.6)),
        joint("second", "prismatic", "one", "two", "0 0 0.1", limits=(0.0, 0.5), mimic='joint="first" offset="0.02"'),
        joint("third", "prismatic", "two", "three", limits=(-1, 0.2), mimic='joint="second" multiplier="0.5"'),
    ]
    arm = load_robot(urdf(link("ground"), link("one", 4.0), link("two", 3.0), link("three", 2.0), *stages), "three")
    q = np.linspace(0.0, 0.38, 5)[:, None]
    np.testing.assert_allclose(kin.tool_poses(arm, q)[:, 2, 3], 0.6 + 2.5 * q[:, 0] + 0.03, rtol=1e-15)
    np.testing.assert_allclose(kin.frame_jacobians(arm, q), np.tile([[0], [0], [2.5], [0], [0], [0]], (5, 1, 1)))
    # the drive of the first stage lifts each stage as far as it goes
    np.testing.assert_allclose(kin.gravity_torques(arm, q), np.full((5, 1), 9.81 * (4.0 + 3.0 * 2 + 2.0 * 2.5)))
    np.testing.assert_allclose([arm.lower, arm.upper], [[0.0], [0.38]], atol=1e-15)


def test_a_joint_that_mimics_one_beside_the_chain_is_driven_by_it():
    arm = coupled("coupled")
    # a continuous joint that drives a rack of ±1 m at 0.05 m/rad turns no further than that
    np.testing.assert_allclose([arm.lower[0], arm.upper[0]], [-20.0, 20.0], rtol=1e-14)
    jaw = next(s for s in arm.segments if s.name == "jaw")
    assert jaw.movable
    assert jaw.joint == "finger"
    assert arm.joint_types[arm.joint_names.index("finger")] == "prismatic"
    # what drives the first joints behind this link stands before it
    end = load_robot(arm.urdf, "tip", root_frame="geared")
    assert end.joint_names == ("turret", "finger")
    q = np.array([[0.4, 0.2, 0.1, 0.25]])
    whole, base = kin.tool_poses(arm, q)[0], kin.link_poses(arm, q)[0, arm.urdf_links.index("geared")]
    np.testing.assert_allclose(base @ kin.tool_poses(end, q[:, [0, 3]])[0], whole, atol=1e-12)


@pytest.mark.parametrize("times", [(0.5, 0.5), (1.0, -0.25), (2.0, 0.0)])
def test_a_lift_of_two_stages_that_a_joint_beside_it_tells(times):
    """As a vehicle's column: a pseudo joint of its whole stroke, which both stages mimic."""
    one, two = (f'joint="stroke" multiplier="{m}" offset="{o}"' for m, o in zip(times, (-0.706, -0.736), strict=True))
    stages = [
        joint("middle", "prismatic", "floor", "one", limits=(-9, 9), mimic=one),
        joint("top", "prismatic", "one", "two", limits=(-9, 9), mimic=two),
        joint("stroke", "prismatic", "floor", "pseudo", limits=(1.48, 3.972)),
        joint("turn", "revolute", "two", "arm", "0.1 0 0.3", axis="0 1 0", limits=(-2, 2)),
    ]
    arm = load_robot(urdf(*(link(name, 1.0) for name in ("floor", "one", "two", "pseudo", "arm")), *stages), "arm")
    assert arm.joint_names == ("stroke", "turn")
    np.testing.assert_allclose([arm.lower[0], arm.upper[0]], [1.48, 3.972])
    q = np.array([[1.5, 0.3], [3.0, -1.0], [3.9, 0.0]])
    np.testing.assert_allclose(kin.tool_poses(arm, q)[:, 2, 3], sum(times) * q[:, 0] - 1.442 + 0.3, atol=1e-12)
    np.testing.assert_allclose(kin.frame_jacobians(arm, q)[:, 2, 0], sum(times), atol=1e-12)
    # the joint beside lifts each stage as far as it goes
    np.testing.assert_allclose(kin.gravity_torques(arm, q)[:, 0], 9.81 * (times[0] + 2 * sum(times)), atol=1e-9)


DRESSES = [
    ('<joint name="j" type="revolute"><mimic joint="k"/></joint>', {"j": Mimic("k")}),
    ("<joint type='revolute' name='j'>\n<mimic joint='k' multiplier='-1'/>\n</joint>", {"j": Mimic("k", -1.0)}),
    (
        '<joint name = "j"><mimic offset= "-2e-1"\n multiplier ="+.5" joint = "k" ></mimic></joint>',
        {"j": Mimic("k", 0.5, -0.2)},
    ),
    ('<joint name="j"/><joint name="k"><mimic joint="j"/></joint>', {"k": Mimic("j")}),
    ('<joint name="j"><!-- <mimic joint="k"/> --></joint>', {}),
    ('<joint name="j"><!-- -- --><mimic joint="k"/></joint>', {"j": Mimic("k")}),
    ('<joint_states name="j"><mimic joint="k"/></joint_states>', {}),
    ('<joint name="j"><mimicry/><mimic-ry joint="k"/></joint>', {}),
    ('<joint xname="i" name="j"><mimic x:joint="l" joint="k"/></joint>', {"j": Mimic("k")}),
]


@pytest.mark.parametrize(("text", "found"), DRESSES)
def test_mimicking_joints_are_found_in_any_dress(text, found):
    assert mimics(f'<robot name="r">{text}</robot>') == found


def test_a_chain_of_mimics_is_followed_to_its_end():
    found = {"b": Mimic("a", 2.0, 0.1), "c": Mimic("b", -3.0, 0.5), "d": Mimic("c", 0.5)}
    ends = followed(found, {"a", "b", "c", "d"}, {"d"})
    # c = −3 (2 a + 0.1) + 0.5, d half of it
    assert {name: end.joint for name, end in ends.items()} == {"b": "a", "c": "a", "d": "a"}
    np.testing.assert_allclose([ends[n].multiplier for n in "bcd"], [2.0, -6.0, -3.0], rtol=1e-15)
    np.testing.assert_allclose([ends[n].offset for n in "bcd"], [0.1, 0.2, 0.1], rtol=1e-14)


@pytest.mark.parametrize(
    ("found", "words", "name"),
    [
        ({"a": Mimic("a")}, "in a circle: 'a' mimics 'a'", "a"),
        ({"c": Mimic("a"), "a": Mimic("b"), "b": Mimic("a")}, "in a circle: 'a' mimics 'b' mimics 'a'", "a"),
        ({"b": Mimic("elbo")}, "joint 'b' mimics 'elbo', which is not a joint of the robot; nearest: elbow", "b"),
        ({"c": Mimic("b"), "b": Mimic("")}, "joint 'b' mimics '', which is not a joint", "b"),
    ],
)
def test_circles_and_missing_joints_are_named(found, words, name):
    with pytest.raises(RobotError) as refused:
        followed(found, ["elbow", "a", "b", "c"], list(found)[:1])
    assert words in str(refused.value)
    assert refused.value.name == name
    # beyond the tool it is nobody's concern
    assert followed({**found, "d": Mimic("elbow")}, ["elbow", "a", "b", "c", "d"], []) == {"d": Mimic("elbow")}


def test_the_coupling_of_a_chain():
    ends = {"b": Mimic("d", 2.0, 0.1), "c": Mimic("outside", 5.0, 7.0), "e": Mimic("a", 0.0, -1.0)}
    coupling = couple("abcde", ends)
    assert (coupling.names, coupling.driving.tolist()) == (("a", "d"), [0, 3])
    assert [coupling.leader(j) for j in range(5)] == [0, 1, None, 1, None]
    np.testing.assert_allclose(coupling.positions(np.array([[1.0, 10.0]])), [[1.0, 20.1, 7.0, 10.0, -1.0]])
    # a joint beside the chain drives it, and stands where the first is that follows it
    coupling = couple("abcde", {**ends, "e": Mimic("outside", -1.0)}, ["outside", "other"])
    assert (coupling.names, coupling.driving.tolist()) == (("a", "outside", "d"), [0, 2, 3])
    assert [coupling.leader(j) for j in range(5)] == [0, 2, 1, 2, 1]
    np.testing.assert_allclose(coupling.positions(np.array([[1.0, 2.0, 10.0]])), [[1.0, 20.1, 17.0, 10.0, -2.0]])


def test_limits_are_those_of_all_who_move_together():
    coupling = couple("abcd", {"b": Mimic("a", -2.0, 0.5), "c": Mimic("a", 0.1), "d": Mimic("a", 0.0, 9.0)})
    low, high, own = np.array([-1.0, -0.5, -np.inf, -1.0]), np.array([np.inf, 1.5, 0.2, 1.0]), ([-1.0], [np.inf])
    found = common_limits(coupling, "abcd", low, high, own)
    # −0.5 ≤ 0.5 − 2 a ≤ 1.5 and 0.1 a ≤ 0.2; d stands still, wherever
    np.testing.assert_allclose(found, [[-0.5], [0.5]], atol=1e-15)
    with pytest.raises(RobotError, match="'b' mimics 'a', but the two are never both within their limits"):
        common_limits(coupling, "abcd", np.array([0.6, -0.5, 0, 0]), np.array([1, 1.5, 1, 1]), ([0.6], [1.0]))
