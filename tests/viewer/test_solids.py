"""Shapes of links: drawn, from meshes, or sticks where a URDF draws nothing."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from conftest import load_arm

from thermal_robot.errors import Note, RobotError
from thermal_robot.kinematics import link_poses
from thermal_robot.viewer.window import ring, rod, solids

SHAPES = """<robot name="shapes">
  <link name="box"><visual><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>
    <geometry><box size="0.1 0.2 0.3"/></geometry></visual>
    <visual><geometry><sphere radius="0.5"/></geometry></visual></link>
  <link name="mesh"><visual><geometry><mesh filename="wedge.stl" scale="0.001 0.001 0.002"/></geometry></visual></link>
  <link name="bare"/>
  <link name="lost"><visual><geometry><mesh filename="{lost}"/></geometry></visual></link>
  <link name="end"/>
  <joint name="a" type="fixed"><parent link="box"/><child link="mesh"/></joint>
  <joint name="b" type="fixed"><parent link="mesh"/><child link="bare"/></joint>
  <joint name="c" type="fixed"><parent link="bare"/><child link="lost"/></joint>
  <joint name="d" type="fixed"><parent link="lost"/><child link="end"/><origin xyz="0 0 0.7"/></joint>
</robot>"""


def bounds(solid):
    assert solid.faces.max() < len(solid.corners)
    return np.array([solid.corners.min(axis=0), solid.corners.max(axis=0)])


@pytest.fixture
def folder(tmp_path):
    trimesh.creation.box((100.0, 200.0, 300.0)).export(tmp_path / "wedge.stl")
    (tmp_path / "broken.stl").write_bytes(b"\x00no mesh\xff")
    return tmp_path


@pytest.mark.parametrize("lost", ["lost.stl", "broken.stl", "package://nowhere/lost.dae"])
def test_shapes_are_where_and_as_large_as_the_urdf_says(folder, lost):
    with pytest.warns(Note, match=lost):
        found = {s.link: s for s in solids(SHAPES.format(lost=lost), folder, 1.0)}
    assert list(found) == ["box", "mesh", "lost"]  # a link that has no shape on purpose has none here
    np.testing.assert_allclose(bounds(found["box"]), [[-0.5, -0.5, -0.5], [1.1, 0.5, 0.5]], atol=1e-9)
    np.testing.assert_allclose(bounds(found["mesh"]), [[-0.05, -0.1, -0.3], [0.05, 0.1, 0.3]], atol=1e-7)
    assert 0.69 < bounds(found["lost"])[1, 2] < 0.72  # the stick reaches the next joint
    assert -0.05 < bounds(found["lost"])[0, 2] < 0.0


def test_a_robot_without_shapes_is_sticks_that_meet(configurations):
    """Each stick's end is the origin of the next joint, in every pose."""
    robot = load_arm("awkward")
    with pytest.warns(Note, match=r"no\.stl"):
        found = {s.link: s for s in solids(robot.urdf, Path(), 1.0)}
    assert set(found) == set(robot.urdf_links)
    for poses in link_poses(robot, configurations(robot, 4)):
        placed = dict(zip(robot.urdf_links, poses, strict=True))
        clouds = {k: s.corners @ placed[k][:3, :3].T + placed[k][:3, 3] for k, s in found.items()}
        for k, parent in enumerate(robot.chain.parent_links):
            joint = placed[parent][:3, :3] @ robot.chain.translations[k] + placed[parent][:3, 3]
            # the rod of the parent ends there, as thick as it is
            assert np.linalg.norm(clouds[parent] - joint, axis=1).min() < 0.03


def test_the_rail_of_a_slide_reaches_its_joint_at_every_position():
    text = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="prismatic"><parent link="a"/>
      <child link="b"/><axis xyz="0 2 0"/><limit lower="-0.2" upper="0.5" effort="1" velocity="1"/></joint></robot>"""
    rail = {s.link: s for s in solids(text, Path(), 1.0)}["b"]
    np.testing.assert_allclose(bounds(rail)[:, 1], [-0.5, 0.2], atol=1e-9)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-16"])
def test_what_the_text_says_of_its_encoding_does_not_matter(encoding):
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n<robot name="r"><link name="Träger"><visual><geometry>'
    text += '<sphere radius="0.2"/></geometry></visual></link></robot>'
    assert [solid.link for solid in solids(text, Path(), 1.0)] == ["Träger"]


def test_shapes_that_cannot_be_read_are_said_so():
    text = '<robot name="r"><link name="a"><visual><geometry><sphere radius="big"/></geometry></visual></link></robot>'
    with pytest.raises(RobotError, match=r"<visual> elements, cannot be read.*big"):
        solids(text, Path(), 1.0)


@pytest.mark.parametrize("name", ["ur10", "panda", "kinova"])
def test_meshes_of_real_robots_are_read_without_a_word(name):
    robot = load_arm(name)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Note)
        found = solids(robot.urdf, robot.folder, 1.0)
    assert len(found) >= 7
    assert sum(len(s.faces) for s in found) > 10_000
    # metres: no link of these arms is larger than the arm
    assert max(np.ptp(bounds(s), axis=0).max() for s in found) < 1.0


def test_the_built_in_robot_is_drawn():
    robot = load_arm("rv_m2")
    found = solids(robot.urdf, robot.folder, 1.0)
    assert {"column", "shoulder", "upper_arm", "forearm", "hand"} <= {s.link for s in found}


def test_rods_and_rings():
    along = rod(np.zeros(3), np.array([0.3, 0.0, 0.4]), 0.01)
    assert along.volume == pytest.approx(np.pi * 0.01**2 * 0.5, rel=0.03)
    np.testing.assert_allclose(along.center_mass, [0.15, 0.0, 0.2], atol=1e-9)
    np.testing.assert_allclose(ring(0.1, 0.01).bounds[1], [0.11, 0.11, 0.01], atol=1e-3)
