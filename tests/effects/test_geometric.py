"""A twist of a placement is the URDF's origin moved and turned."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from conftest import load_arm
from helpers import commanded, tool_at, tool_with
from scipy.spatial.transform import Rotation
from simulate import simulate

from thermal_robot.effects import Geometric, JointOffset
from thermal_robot.inference.columns import frame_columns, moved_by
from thermal_robot.kinematics import exp6
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_a_geometric_error_is_an_edited_urdf(arm):
    campaign = commanded(arm)
    effect = Geometric()
    parameters = effect.parameters(observe(campaign))
    values = np.where([p.unit == "m" for p in parameters], 2e-3, 3e-3) * np.cos(np.arange(len(parameters)))
    tree = ElementTree.fromstring(arm.urdf)
    origins = {j.get("name"): j for j in tree.findall("joint")}
    for k in range(0, len(parameters), 6):
        joint = origins[parameters[k].label.split(" of ")[1]]
        origin = joint.find("origin")
        if origin is None:
            origin = ElementTree.SubElement(joint, "origin")
        place = np.eye(4)
        place[:3, 3] = [float(v) for v in origin.get("xyz", "0 0 0").split()]
        rpy = [float(v) for v in origin.get("rpy", "0 0 0").split()]
        place[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
        place = place @ exp6(values[k : k + 6])
        origin.set("xyz", " ".join(repr(float(v)) for v in place[:3, 3]))
        turned = Rotation.from_matrix(place[:3, :3]).as_euler("xyz")
        origin.set("rpy", " ".join(repr(float(v)) for v in turned))
    edited = load_robot(ElementTree.tostring(tree, encoding="unicode"), arm.tool_frame, root_frame=arm.root_frame)
    expected = tool_at(edited, campaign.q)
    assert np.abs(expected - tool_at(arm, campaign.q)).max() > 1e-3
    np.testing.assert_allclose(tool_with(campaign, effect, values), expected, atol=1e-12)


@pytest.mark.parametrize("arm", ["rv_m2", "panda", "awkward", "coupled"], indirect=True)
def test_it_is_drawn_against_the_position_of_the_joint_whose_placement_it_is(arm):
    observations = observe(commanded(arm))
    moved_by = {s.name: s.joint for s in arm.segments}
    seen = set()
    for parameter in Geometric().parameters(observations):
        name = parameter.label.split(" of ")[1]
        driver = Geometric().driver(observations, [parameter], np.zeros(10))
        joint = moved_by[name]
        if joint is None:
            assert driver is None
            continue
        assert driver[0] == f"position of {joint}"
        np.testing.assert_array_equal(driver[2], observations.q[:, arm.joint_names.index(joint)])
        seen.add(joint)
    assert seen == set(arm.joint_names)


@pytest.mark.parametrize("name", ["ur10", "rv_m2", "panda", "tiago", "awkward", "kinova"])
def test_with_the_zeros_the_parameters_of_axes_do_all_that_geometry_does(name):
    """Four numbers an axis (Denavit and Hartenberg), and whatever base and tool can do."""
    campaign = simulate(load_arm(name), samples=40, seed=3, turning=3e-5)[0]
    seen = observe(campaign)
    effect = Geometric()
    frames = frame_columns(seen)[0]

    def flat(*parts):
        whole = np.concatenate([part.reshape(frames.shape[0] * frames.shape[1], -1) for part in parts], axis=1)
        length = np.linalg.norm(whole, axis=0)
        return np.linalg.matrix_rank(whole[:, length > 1e-9] / length[length > 1e-9], tol=1e-7)

    few = moved_by(seen, (*JointOffset().parameters(seen), *effect.independent(seen)))
    many = moved_by(seen, effect.parameters(seen))
    assert flat(frames, few) == flat(frames, few, many) == flat(frames, many)


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


def test_in_some_places_the_parameters_are_those_there(rv_m2):
    seen = observe(simulate(rv_m2, samples=3, seed=3)[0])
    some = Geometric(places=("upper_arm",)).independent(seen)
    assert {p.place for p in some} == {"upper_arm"}
    assert len(some) < len(Geometric().independent(seen))
