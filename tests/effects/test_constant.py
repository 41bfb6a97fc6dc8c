"""Constant errors: a twist of a placement is an edited URDF, frames and scale are what they say of the target."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import commanded, tool_at, tool_with
from scipy.spatial.transform import Rotation
from simulate import simulate

import thermal_robot as tr
from thermal_robot.effects import BaseFrame, Geometric, InstrumentScale, JointOffset, ToolFrame
from thermal_robot.inference.columns import frame_columns, moved_by
from thermal_robot.kinematics import exp6, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_a_geometric_error_is_an_edited_urdf(arm):
    campaign, effect = commanded(arm), Geometric()
    parameters = effect.parameters(observe(campaign))
    values = np.where([p.unit == "m" for p in parameters], 2e-3, 3e-3) * np.cos(np.arange(len(parameters)))
    tree = ElementTree.fromstring(arm.urdf)
    origins = {j.get("name"): j for j in tree.findall("joint")}
    for k in range(0, len(parameters), 6):
        joint = origins[parameters[k].label.split(" of ")[1]]
        origin = joint.find("origin")
        origin = ElementTree.SubElement(joint, "origin") if origin is None else origin
        place = np.eye(4)
        place[:3, 3] = [float(v) for v in origin.get("xyz", "0 0 0").split()]
        rpy = [float(v) for v in origin.get("rpy", "0 0 0").split()]
        place[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
        place = place @ exp6(values[k : k + 6])
        turned = Rotation.from_matrix(place[:3, :3]).as_euler("xyz")
        for key, numbers in (("xyz", place[:3, 3]), ("rpy", turned)):
            origin.set(key, " ".join(repr(float(v)) for v in numbers))
    edited = load_robot(ElementTree.tostring(tree, encoding="unicode"), arm.tool_frame, root_frame=arm.root_frame)
    expected = tool_at(edited, campaign.q)
    assert np.abs(expected - tool_at(arm, campaign.q)).max() > 1e-3
    np.testing.assert_allclose(tool_with(campaign, effect, values), expected, atol=1e-12)


@pytest.mark.parametrize("arm", ["rv_m2", "panda", "awkward", "coupled"], indirect=True)
def test_it_is_drawn_against_the_position_of_the_joint_whose_placement_it_is(arm):
    observations, seen = observe(commanded(arm)), set()
    moved = {s.name: s.joint for s in arm.segments}
    for parameter in Geometric().parameters(observations):
        driver = Geometric().driver(observations, [parameter], np.zeros(10))
        joint = moved[parameter.label.split(" of ")[1]]
        assert (driver is None) == (joint is None)
        if joint is not None:
            assert driver[0] == f"position of {joint}"
            np.testing.assert_array_equal(driver[2], observations.q[:, arm.joint_names.index(joint)])
            seen.add(joint)
    assert seen == set(arm.joint_names)


@pytest.mark.parametrize("name", ["ur10", "rv_m2", "panda", "tiago", "awkward", "kinova"])
def test_with_the_zeros_the_parameters_of_axes_do_all_that_geometry_does(name):
    """Four numbers an axis (Denavit and Hartenberg), and whatever base and tool can do."""
    seen = observe(simulate(load_arm(name), samples=40, seed=3, turning=3e-5)[0])
    frames = frame_columns(seen)[0]

    def rank(*parts):
        whole = np.concatenate([part.reshape(frames.shape[0] * frames.shape[1], -1) for part in parts], axis=1)
        length = np.linalg.norm(whole, axis=0)
        return np.linalg.matrix_rank(whole[:, length > 1e-9] / length[length > 1e-9], tol=1e-7)

    few = moved_by(seen, (*JointOffset().parameters(seen), *Geometric().independent(seen)))
    many = moved_by(seen, Geometric().parameters(seen))
    assert rank(frames, few) == rank(frames, few, many) == rank(frames, many)
    place = seen.robot.segments[2].parent_link
    some = Geometric(places=(place,)).independent(seen)
    assert {p.place for p in some} <= {place}
    assert len(some) < len(Geometric().independent(seen))


def test_a_twist_of_an_axis_keeps_its_distance_from_the_one_before():
    seen = observe(simulate(load_arm("panda"), samples=3, seed=3)[0])
    robot, chain = seen.robot, seen.commanded
    named = {p.label: p for p in Geometric().independent(seen)}
    (twist,) = named["twist α of panda_joint5"].responses
    before, own = robot.segments[twist.index - 1].index, robot.segments[twist.index].index

    def distance(shift, turn):
        frame = chain.rotations[0, own]
        axis = frame @ (robot.chain.axes[own] + np.cross(turn, robot.chain.axes[own]))
        origin = chain.positions[0, own] + frame @ shift
        first, along = chain.positions[0, before], chain.rotations[0, before] @ robot.chain.axes[before]
        normal = np.cross(axis, along)
        return abs((origin - first) @ normal) / np.linalg.norm(normal)

    still, turned = distance(np.zeros(3), np.zeros(3)), distance(1e-5 * twist.values[:3], 1e-5 * twist.values[3:])
    assert still > 0.05
    assert abs(turned - still) < 1e-9
    (away,) = named["distance a of panda_joint5"].responses
    assert abs(abs(distance(1e-5 * away.values[:3], np.zeros(3)) - still) - 1e-5) < 1e-9


def test_a_frame_that_is_off_is_a_twist_in_its_own_axes(rv_m2):
    campaign = commanded(rv_m2, base_known=True, tool_known=True, target=[0.01, 0.02, 0.1])
    nominal, shift = tool_with(campaign, BaseFrame(), np.zeros(6)), np.array([1e-3, 2e-3, -3e-3])
    moved = tool_with(campaign, BaseFrame(), [*shift, 0, 0, 0]) - nominal
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape), atol=1e-14)
    x, y, z = nominal.T
    turned = np.stack([x * np.cos(0.1) - y * np.sin(0.1), x * np.sin(0.1) + y * np.cos(0.1), z], axis=1)
    np.testing.assert_allclose(tool_with(campaign, BaseFrame(), [0, 0, 0, 0, 0, 0.1]), turned, atol=1e-14)
    axes = tool_poses(rv_m2, campaign.q)[:, :3, :3]
    np.testing.assert_allclose(tool_with(campaign, ToolFrame(), shift) - nominal, axes @ shift, atol=1e-14)


def test_a_frame_is_an_error_only_where_it_is_declared(rv_m2):
    plain = commanded(rv_m2)
    declared = replace(plain, base_known=True, tool_known=True)
    for kind, lacking in ((BaseFrame, 'frames.base = "known"'), (ToolFrame, 'frames.tool = "known"')):
        assert kind().missing(observe(plain)) == (lacking,)
        assert kind().missing(observe(declared)) == ()
    assert ToolFrame().missing(observe(replace(plain, simulated_position=np.zeros((10, 3))))) == ()
    # positions show no turn of the tool, and poses do; a model keeps what it was fitted with, whatever it predicts
    poses = replace(declared, position=np.zeros((10, 3)), orientation=np.tile([1.0, 0, 0, 0], (10, 1)))
    for campaign, count in ((declared, 3), (poses, 6)):
        effect = ToolFrame().variants(observe(campaign))[0]
        assert [len(effect.parameters(observe(asked))) for asked in (declared, poses)] == [count] * 2


TOOL, POSES = {"tool": (0.05, 0.03, 0.1)}, {"measures": "pose", "noise_orientation": 5e-5}
LAST = {"joint_offset": {"joint_5": 3e-3}}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("frame", "at_work", "options"),
    [
        ("base_frame", {"base_frame": {"rotation z": 2e-3}}, {}),
        pytest.param("base_frame", {"joint_offset": {"joint_1": 2e-3}}, {}, marks=pytest.mark.slow),
        ("tool_frame", LAST, TOOL),
        pytest.param(
            "tool_frame", LAST, TOOL | {"measures": "pose", "noise_orientation": 5e-5}, marks=pytest.mark.slow
        ),
    ],
)
def test_a_turn_about_the_axis_of_an_end_is_told_with_that_joints_zero(rv_m2, frame, at_work, options):
    """No measurement of the tool tells which of the two it is, whichever was at work."""
    found = tr.diagnose(tr.simulate(rv_m2, at_work, rows=60, noise=2e-5, seed=1, **options))
    pair = {frame, "joint_offset"}
    assert all({name, *found.finding(name).confounded_with} == pair for name in pair)
    if frame == "base_frame":
        assert len(found.verdict) == 1
        assert min(found.finding(name).probability for name in pair) > 0.01


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_a_scale_error_stretches_what_is_measured_about_the_instruments_origin(arm):
    frames = Frames(exp6([1.0, -2.0, 0.5, 0.4, 1.0, -0.3]), exp6([0.1, 0, 0.05, 0, 0, 0]))
    campaign, effect = commanded(arm), InstrumentScale()
    true = tool_with(campaign, effect, [0.0], frames)
    np.testing.assert_allclose(tool_with(campaign, effect, [2e-4], frames), 1.0002 * true, atol=1e-14)
    seen = observe(campaign, frames)
    name, unit, values = effect.driver(seen, effect.parameters(seen), np.zeros(10))
    assert (name, unit) == ("distance from the instrument", "m")
    np.testing.assert_allclose(values, np.linalg.norm(true, axis=1), rtol=1e-12)
