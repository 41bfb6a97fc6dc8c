"""What links look like: the shapes of the URDF in the frames of their links, their hulls, and sticks without any."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from conftest import load_arm

import thermal_robot as tr
from thermal_robot.errors import Note, RobotError
from thermal_robot.kinematics import link_poses
from thermal_robot.shapes import arm as drawn_arm
from thermal_robot.shapes import find_mesh, hull, hulls, parsed, visuals
from thermal_robot.viewer.window import solids

TURN = """<joint name="turn" type="revolute"><parent link="ground"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>"""
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


def one(geometry, origin="0 0 0"):
    """A URDF of one arm with one shape."""
    visual = f'<visual><origin xyz="{origin}" rpy="0 0 0"/><geometry>{geometry}</geometry></visual>'
    return f'<robot name="one"><link name="ground"/><link name="arm">{visual}</link>{TURN}</robot>'


@pytest.fixture
def package(tmp_path):
    """A package of ROS as it is installed: share/arm/{urdf,meshes}."""
    folder = tmp_path / "share" / "arm"
    for name in ("urdf", "meshes"):
        (folder / name).mkdir(parents=True)
    (folder / "meshes" / "link 1.stl").write_bytes(b"solid")
    return folder


@pytest.mark.parametrize(
    "named",
    [
        "package://arm/meshes/link 1.stl",
        "../meshes/link 1.stl",
        "file://{}/meshes/link 1.stl",
        "file://{}/meshes/link%201.stl",
        "{}/meshes/link 1.stl",
    ],
)
def test_a_mesh_is_found_as_it_is_named_and_what_is_no_file_here_is_not(package, named):
    found = find_mesh(named.format(package), package / "urdf")
    assert found is not None
    assert found.samefile(package / "meshes" / "link 1.stl")
    for absent in ("package://arm/meshes/no.stl", "http://example.org/link.stl", "no.stl", "../meshes", ""):
        assert find_mesh(absent, package / "urdf") is None


@pytest.mark.parametrize("variable", ["ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"])
@pytest.mark.parametrize("listed", ["share", "", "share/arm"])
def test_a_package_is_found_where_ros_says(package, tmp_path, monkeypatch, variable, listed):
    elsewhere = tmp_path / "campaign"
    elsewhere.mkdir()
    assert find_mesh("package://arm/meshes/link 1.stl", elsewhere / "deep") is None
    monkeypatch.setenv(variable, f"/nowhere:{tmp_path / listed}")
    found = find_mesh("package://arm/meshes/link 1.stl", elsewhere / "deep")
    assert found is not None
    assert found.samefile(package / "meshes" / "link 1.stl")
    own = elsewhere / "meshes" / "link 1.stl"  # of a URDF that was moved with its meshes: before all others
    own.parent.mkdir()
    own.touch()
    assert find_mesh("package://arm/meshes/link 1.stl", elsewhere) == own


@pytest.mark.parametrize(
    ("geometry", "volume", "within"),
    [
        ('<box size="0.1 0.2 0.3"/>', 0.006, 1e-9),
        ('<cylinder radius="0.1" length="0.5"/>', np.pi * 0.1**2 * 0.5, 0.03),
        ('<sphere radius="0.2"/>', 4.0 / 3.0 * np.pi * 0.2**3, 0.15),
    ],
)
def test_a_hull_has_nearly_the_volume_of_its_shape_and_never_more_and_stands_at_its_origin(geometry, volume, within):
    ((link, shape),) = hulls(tr.load_robot(one(geometry, "1 2 3"), "arm"))
    assert link == "arm"
    assert volume * (1.0 - within) <= shape.volume <= volume * (1.0 + 1e-9)  # faces outward, or it were negative
    np.testing.assert_allclose(shape.bounds.mean(axis=0), [1.0, 2.0, 3.0], atol=0.1 * within + 1e-9)


def test_a_mesh_is_found_beside_the_file_and_scaled_and_one_that_is_not_there_is_no_error(tmp_path):
    def shaped(geometry):
        (tmp_path / "one.urdf").write_text(one(geometry), encoding="utf-8")
        return hulls(tr.load_robot(tmp_path / "one.urdf", "arm"))

    trimesh.creation.box((1.0, 1.0, 2.0)).export(tmp_path / "part.obj")
    ((_, shape),) = shaped('<mesh filename="part.obj" scale="0.1 0.1 0.1"/>')
    assert shape.volume == pytest.approx(0.1 * 0.1 * 0.2)
    np.testing.assert_allclose(shape.bounds[1], [0.05, 0.05, 0.1])
    (tmp_path / "part.stl").write_bytes(b"this is no mesh")
    for absent in ("package://nowhere/no.stl", "part.stl", "https://example.invalid/part.stl"):
        assert shaped(f'<mesh filename="{absent}"/>') == []
    assert hulls(tr.load_robot(one('<sphere radius="0.1"/>').replace("0.1", "big"), "arm")) == []


def test_a_hull_keeps_a_large_cloud_inside_but_for_a_little_and_what_is_flat_has_none():
    cloud = np.random.default_rng(2).normal(size=(5000, 3))
    shape = hull(cloud / np.linalg.norm(cloud, axis=1, keepdims=True))
    assert len(shape.vertices) <= 80
    assert set(shape.faces.ravel()) == set(range(len(shape.vertices)))
    assert 0.85 < shape.volume / (4.0 / 3.0 * np.pi) < 1.0
    assert hull(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])) is None
    assert hull(np.zeros((2, 3))) is None


def test_every_link_of_the_reference_robot_has_a_shape_and_meshes_of_an_example_robot_are_read(rv_m2):
    assert {link for link, _ in hulls(rv_m2)} == set(rv_m2.chain.parent_links)
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    shown = dict(hulls(tr.load_robot("example-robot-data:ur10", "tool0")))
    assert {"base_link", "shoulder_link", "upper_arm_link", "forearm_link"} <= set(shown)
    # the upper arm is 612 mm between its joints, and has a housing around each
    assert 0.612 < shown["upper_arm_link"].extents.max() < 0.9


def test_meshes_of_a_robot_of_example_robot_data_are_found_from_the_folder_of_a_campaign(tmp_path):
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    measured = tr.simulate("example-robot-data:ur5", tool_frame="tool0", rows=5)
    robot = tr.read_campaign(tr.write_campaign(measured, tmp_path / "hall_3")).robot
    shapes, missing = visuals(parsed(robot.urdf), robot.folder)
    assert not missing
    assert sum(map(len, shapes.values())) >= robot.n


@pytest.mark.parametrize("lost", ["lost.stl", "broken.stl", "package://nowhere/lost.dae"])
def test_shapes_are_where_and_as_large_as_the_urdf_says_and_sticks_stand_for_lost_ones(tmp_path, lost):
    trimesh.creation.box((100.0, 200.0, 300.0)).export(tmp_path / "wedge.stl")
    (tmp_path / "broken.stl").write_bytes(b"\x00no mesh\xff")
    with pytest.warns(Note, match=lost):
        found = solids(SHAPES.format(lost=lost), tmp_path, 1.0)
    assert list(found) == ["box", "mesh", "lost"]  # a link that has no shape on purpose has none here
    np.testing.assert_allclose(found["box"].bounds, [[-0.5, -0.5, -0.5], [1.1, 0.5, 0.5]], atol=1e-9)
    np.testing.assert_allclose(found["mesh"].bounds, [[-0.05, -0.1, -0.3], [0.05, 0.1, 0.3]], atol=1e-7)
    low, high = found["lost"].bounds[:, 2]
    assert 0.69 < high < 0.72  # the stick reaches the next joint
    assert -0.05 < low < 0.0


def test_a_robot_without_shapes_is_sticks_that_meet(configurations):
    """Each stick's end is the origin of the next joint, in every pose."""
    robot = load_arm("awkward")
    with pytest.warns(Note, match=r"no\.stl"):
        found = solids(robot.urdf, Path(), 1.0)
    assert set(found) == set(robot.urdf_links)
    for poses in link_poses(robot, configurations(robot, 4)):
        placed = dict(zip(robot.urdf_links, poses, strict=True))
        for k, parent in enumerate(robot.chain.parent_links):
            turn, origin = placed[parent][:3, :3], placed[parent][:3, 3]
            cloud = found[parent].vertices @ turn.T + origin
            # the rod of the parent ends there, as thick as it is
            assert np.linalg.norm(cloud - turn @ robot.chain.translations[k] - origin, axis=1).min() < 0.03


def test_the_rail_of_a_slide_reaches_its_joint_at_every_position():
    text = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="prismatic"><parent link="a"/>
      <child link="b"/><axis xyz="0 2 0"/><limit lower="-0.2" upper="0.5" effort="1" velocity="1"/></joint></robot>"""
    np.testing.assert_allclose(solids(text, Path(), 1.0)["b"].bounds[:, 1], [-0.5, 0.2], atol=1e-9)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-16"])
def test_what_the_text_says_of_its_encoding_does_not_matter(encoding):
    text = one('<sphere radius="0.2"/>').replace('"arm"', '"Träger"')
    assert list(solids(f'<?xml version="1.0" encoding="{encoding}"?>\n{text}', Path(), 1.0)) == ["Träger"]


def test_shapes_that_cannot_be_read_are_said_so():
    with pytest.raises(RobotError, match=r"<visual> elements, cannot be read.*big"):
        solids(one('<sphere radius="big"/>'), Path(), 1.0)


@pytest.mark.parametrize("name", ["ur10", "panda", "kinova", "rv_m2"])
def test_real_robots_are_drawn_without_a_word(name):
    robot = load_arm(name)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Note)
        found = solids(robot.urdf, robot.folder or Path(), 1.0)
    if name == "rv_m2":
        assert {"column", "shoulder", "upper_arm", "forearm", "hand"} <= set(found)
        return
    assert len(found) >= 7
    assert sum(len(mesh.faces) for mesh in found.values()) > 10_000
    # metres: no link of these arms is larger than the arm
    assert max(mesh.extents.max() for mesh in found.values()) < 1.0


def test_the_arm_stands_where_the_robot_says_and_each_place_has_its_share(arm, configurations):
    q = configurations(arm, 5)
    joint, link = arm.joint_names[1], arm.chain.parent_links[1]
    shown = drawn_arm(arm, q, {("joint", joint): 0.4, ("link", link): 0.3, ("base", "base"): 0.2})
    np.testing.assert_allclose(shown.poses[:, -1], arm.forward(q), atol=1e-12)
    np.testing.assert_allclose(shown.poses[:, 0], np.broadcast_to(np.eye(4), (5, 4, 4)), atol=1e-12)
    assert dict(zip(shown.joints, shown.joint_shares, strict=True))[joint] == shown.joint_shares.sum() == 0.4
    assert dict(zip(shown.links, shown.link_shares, strict=True))[link] == shown.link_shares.sum() == 0.3
    assert (shown.base_share, shown.tool_share, shown.instrument_share) == (0.2, 0.0, 0.0)
    assert shown.links[-1] == arm.tool_frame
    # what a joint moves is the child of its placement
    moved = [arm.chain.parent_links[k - 1] for k in shown.moves]
    assert moved == [arm.chain.parent_links[k] for k in arm.chain.movable]
