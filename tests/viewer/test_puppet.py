"""The robot in the scene: nodes that take the poses of a row, in the colours of the places."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scene_nodes import Nodes

from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.viewer import window as panel
from thermal_robot.viewer.settings import NO_SHARE, colours
from thermal_robot.viewer.window import Puppet, solids


@pytest.fixture
def nodes():
    return Nodes()


@pytest.fixture
def puppet(nodes, scene):
    return Puppet(nodes, scene, solids(scene.robot.urdf, Path(), scene.size))


def test_links_and_joints_take_the_pose_of_a_row(puppet, nodes, scene):
    for row in (0, 31):
        puppet.pose(row)
        for k, pose in enumerate(scene.links(row)):
            node = nodes.added[f"/links/{k}"]
            np.testing.assert_allclose(node.position, pose[:3, 3], atol=1e-12)
            np.testing.assert_allclose(quaternion_to_rotation(node.wxyz), pose[:3, :3], atol=1e-9)
        for j, (origin, axis) in enumerate(zip(*scene.joints(row), strict=True)):
            node = nodes.added[f"/joints/{j}"]
            np.testing.assert_allclose(node.position, origin, atol=1e-12)
            np.testing.assert_allclose(quaternion_to_rotation(node.wxyz)[:, 2], axis, atol=1e-9)


def test_places_have_the_colours_of_their_shares(puppet, nodes, scene):
    coloured = colours(scene.shares)
    for k, link in enumerate(scene.robot.urdf_links):
        if f"/links/{k}/shape" in nodes.added:
            assert nodes.added[f"/links/{k}/shape"].color == coloured.get(("link", link), NO_SHARE)
    for j, joint in enumerate(scene.robot.joint_names):
        assert nodes.added[f"/joints/{j}/ring"].color == coloured.get(("joint", joint), NO_SHARE)


def test_names_are_at_their_places_and_can_be_hidden(puppet, nodes, scene):
    labels = {name: node for name, node in nodes.added.items() if hasattr(node, "text")}
    assert sorted(label.text for label in labels.values()) == sorted(panel.names_of_places(scene).values())
    joint = next(name for kind, name in scene.shares if kind == "joint")
    assert labels[f"/joints/{scene.robot.joint_names.index(joint)}/name_joint"].text.startswith(joint)
    for shown in (False, True):
        puppet.name(shown)
        assert {label.visible for label in labels.values()} == {shown}


def test_the_line_to_the_measured_point_ends_there(puppet, nodes, scene):
    tool = scene.robot.urdf_links.index(scene.robot.tool_frame)
    puppet.pose(5)
    vertices = nodes.added[f"/links/{tool}/pointer"].vertices
    pose = scene.links(5)[tool]
    ends = vertices @ pose[:3, :3].T + pose[:3, 3]
    assert np.linalg.norm(ends - scene.predicted[5], axis=1).min() < 0.005 * scene.size


@pytest.mark.parametrize("kind", ["tool", "base", "instrument"])
def test_a_place_beside_joints_and_links_is_named_too(nodes, scene, kind):
    Puppet(nodes, replace(scene, shares={(kind, kind): 0.3}), ())
    assert [node.text for node in nodes.added.values() if hasattr(node, "text")] == [f"{kind} 30.0 %"]


def test_the_foot_has_the_colour_of_the_base(nodes, scene):
    shares = {("base", "base"): 0.5, ("joint", "joint_2"): 0.1}
    Puppet(nodes, replace(scene, shares=shares), solids(scene.robot.urdf, Path(), scene.size))
    found = {link: nodes.added.get(f"/links/{k}/shape") for k, link in enumerate(scene.robot.urdf_links)}
    coloured = {link for link, node in found.items() if node is not None and node.color != NO_SHARE}
    assert coloured == {"base_link"}
    assert found["base_link"].color == colours(shares)["base", "base"]
