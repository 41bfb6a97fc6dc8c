"""A twist of a placement is the URDF's origin moved and turned."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from helpers import commanded, tool_at, tool_with
from scipy.spatial.transform import Rotation

from thermal_robot.effects import Geometric
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
