"""Loading robots, and what a Robot says of itself."""

import dataclasses
import io
import itertools
import pickle
import re
from pathlib import Path

import numpy as np
import pinocchio
import pytest
import yourdfpy
from coupled import coupled
from scipy.spatial.distance import cdist

from thermal_robot import kinematics as kin
from thermal_robot.errors import RobotError
from thermal_robot.robot import WIDE, joint_range, load_robot


def parsed(urdf):
    """The tree as yourdfpy reads it, a second opinion."""
    return yourdfpy.URDF.load(io.BytesIO(urdf.encode()), load_meshes=False, build_scene_graph=False)


def same_robot(one, other, configurations, atol=0.0):
    assert one.joint_names == other.joint_names
    assert one.joint_types == other.joint_types
    assert one.has_masses == other.has_masses
    assert [s.name for s in one.segments] == [s.name for s in other.segments]
    np.testing.assert_array_equal(one.lower, other.lower)
    np.testing.assert_array_equal(one.upper, other.upper)
    np.testing.assert_allclose(one.gravity, other.gravity, rtol=0.0, atol=atol)
    q = configurations(one, 100)
    for function in (kin.tool_poses, kin.gravity_torques):
        np.testing.assert_allclose(function(one, q), function(other, q), rtol=0.0, atol=atol)


def test_an_arm_is_what_its_urdf_says(arm):
    tree = parsed(arm.urdf)
    joints = {joint.name: joint for joint in tree.robot.joints}
    by_child = {joint.child: joint for joint in tree.robot.joints}
    chain, link = [], arm.tool_frame
    while link != arm.root_frame:
        chain.insert(0, by_child[link])
        link = by_child[link].parent
    assert arm.chain.names == tuple(joint.name for joint in chain)
    driven = [joint for joint in chain if joint.type != "fixed" and joint.mimic is None]
    beside = {joint.mimic.joint for joint in chain if joint.mimic is not None} - {joint.name for joint in chain}
    assert tuple(name for name in arm.joint_names if name not in beside) == tuple(joint.name for joint in driven)
    driven = [joints[name] for name in arm.joint_names]
    assert arm.joint_types == tuple(joint.type for joint in driven)
    assert {segment.joint for segment in arm.segments} - {None} == set(arm.joint_names)
    for joint, lower, upper in zip(arm.joint_names, arm.lower, arm.upper, strict=True):
        limit = joints[joint].limit
        if any(other.mimic is not None and other.mimic.joint == joint for other in chain):
            continue  # narrowed by what follows it: see tests/kinematics/test_mimic.py
        if joints[joint].type == "continuous":
            assert (lower, upper) == (-np.inf, np.inf)
        else:
            assert (lower, upper) == (limit.lower or 0.0, limit.upper or 0.0)
    for k, joint in enumerate(chain):
        origin = np.eye(4) if joint.origin is None else joint.origin
        np.testing.assert_allclose(arm.chain.rotations[k], origin[:3, :3], atol=1e-12)
        np.testing.assert_allclose(arm.chain.translations[k], origin[:3, 3], atol=1e-12)
    for segment in arm.segments:
        joint = joints[segment.name]
        length = 0.0 if joint.origin is None else np.linalg.norm(joint.origin[:3, 3])
        assert segment.parent_link == joint.parent
        assert segment.length == pytest.approx(length, abs=1e-12)
        assert segment.movable == (joint.type != "fixed")
        assert np.linalg.norm(segment.direction) == pytest.approx(1.0 if length > 1e-9 else 0.0)
        along = arm.chain.rotations[segment.index] @ segment.direction * segment.length
        np.testing.assert_allclose(along, arm.chain.translations[segment.index], atol=1e-12)
        assert segment.movable == (segment.index in arm.chain.movable)
        assert segment.movable or segment.joint is None
    low, high = joint_range(arm)  # a joint that turns round is kept within reach
    assert np.all((low >= arm.lower) & (high <= arm.upper))
    turning = np.array([kind == "continuous" for kind in arm.joint_types])
    assert np.all(high[turning] == WIDE)
    assert np.all(low[turning] == -WIDE)
    placed = [k for k, joint in enumerate(chain) if joint.type != "fixed" or np.linalg.norm(joint.origin[:3, 3]) > 1e-9]
    assert [segment.index for segment in arm.segments] == placed


def test_a_robot_comes_back_from_a_file_its_text_a_pickle_and_yourdfpy(arm, configurations, tmp_path):
    same_robot(arm, pickle.loads(pickle.dumps(arm)), configurations)
    again = load_robot(parsed(arm.urdf), arm.tool_frame, root_frame=arm.root_frame)
    same_robot(arm, again, configurations, atol=1e-10)
    if arm.name == "rv_m2":
        file = tmp_path / "a robot ü.urdf"
        file.write_text("\ufeff" + arm.urdf, encoding="utf-8")
        # the last two load with Pinocchio, and no strict XML parser takes them
        lenient = [arm.urdf.replace("</robot>", f"{text}\n</robot>") for text in LENIENT]
        for source in (file, str(file), arm.urdf, "\n  " + arm.urdf, *lenient):
            again = load_robot(source, "tool0")
            same_robot(arm, again, configurations)
            assert (again.urdf_links, again.urdf_joints) == (arm.urdf_links, arm.urdf_joints)


LENIENT = ['<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->"]


@pytest.mark.parametrize(("name", "forearm"), [("ur3", 0.21325), ("ur5", 0.39225), ("ur10", 0.5723)])
def test_each_universal_robot_has_its_own_lengths(name, forearm):
    pytest.importorskip("example_robot_data", reason="these arms are in the package example-robot-data-loaders")
    robot = load_robot(f"example-robot-data:{name}", "tool0")
    assert robot.name == name
    assert {s.name: s.length for s in robot.segments}["wrist_1_joint"] == pytest.approx(forearm, abs=1e-12)


def test_a_robot_introduces_itself_and_cannot_be_changed(rv_m2):
    assert repr(rv_m2) == f"Robot('rv_m2', 'base_link' to 'tool0', 5 joints, {len(rv_m2.segments)} segments)"
    assert rv_m2.urdf_links[0] == "base_link"
    assert set(rv_m2.urdf_joints) == {*rv_m2.joint_names, "column_top", "tool_point"}
    shown = rv_m2._repr_html_()
    assert all(f">{joint}<" in shown for joint in rv_m2.joint_names)
    assert f"{np.degrees(rv_m2.upper[0]):.4g}°" in shown
    with pytest.raises(dataclasses.FrozenInstanceError):
        rv_m2.name = "other"
    arrays = [rv_m2.gravity, rv_m2.lower, rv_m2.upper, rv_m2.segments[0].direction]
    arrays += [value for value in vars(rv_m2.chain).values() if isinstance(value, np.ndarray)]
    assert len(arrays) == 14
    assert not any(array.flags.writeable for array in arrays)


def test_loading_prints_nothing(awkward_urdf, capfd):
    load_robot(awkward_urdf, "tip")
    assert capfd.readouterr() == ("", "")


def test_gravity_is_meant_in_the_root_frame(awkward_urdf):
    robot = load_robot(awkward_urdf, "tip", root_frame="base", gravity=(1, 2, 3))
    np.testing.assert_array_equal(robot.gravity, [1.0, 2.0, 3.0])
    base = robot.model.frames[robot.model.getFrameId("base", pinocchio.FrameType.BODY)].placement
    np.testing.assert_allclose(base.rotation.T @ robot.model.gravity.linear, [1.0, 2.0, 3.0], atol=1e-14)


def test_a_limit_without_bounds_is_no_limit():
    urdf = """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">
      <parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
      <limit effort="1" velocity="1"/></joint></robot>"""
    robot = load_robot(urdf, "b")
    assert (robot.lower[0], robot.upper[0]) == (-np.inf, np.inf)


def test_rv_m2_is_as_its_sources_say(rv_m2):
    degrees = np.rad2deg(np.stack([rv_m2.lower, rv_m2.upper], axis=1))
    np.testing.assert_allclose(degrees, [[-150, 150], [-30, 100], [-120, 0], [-110, 110], [-180, 180]], atol=1e-10)
    np.testing.assert_allclose(np.rad2deg(rv_m2.model.velocityLimit), [140, 79, 140, 163, 223], rtol=1e-5)
    assert sum(inertia.mass for inertia in rv_m2.model.inertias) == pytest.approx(28.0)


def test_what_a_newer_yourdfpy_might_write_is_believed(configurations):
    arm = coupled("parallelogram")

    class Writing:
        robot = parsed(arm.urdf.replace('multiplier="-1"', 'multiplier="0.5"')).robot

        def write_xml_string(self):
            return arm.urdf

    same_robot(arm, load_robot(Writing(), "tool"), configurations)


def test_a_segment_knows_the_joint_that_moves_it():
    moved = {segment.name: segment.joint for segment in coupled("coupled").segments}
    assert moved == {
        "mount": None, "early": "swing", "turret": "turret", "swing": "swing", "stage_1": "stage_1",
        "stage_2": "stage_1", "stage_3": "stage_1", "half": "turret", "rack": "turret", "jaw": "finger",
        "tip_joint": None,
    }  # fmt: skip


def test_forward_and_jacobian_are_pinocchios(rv_m2):
    pin, rng = pinocchio, np.random.default_rng(3)
    q = rng.uniform(-1.0, 1.0, (4, rv_m2.n))
    model, data = rv_m2.model, rv_m2.model.createData()
    frame = model.getFrameId(rv_m2.tool_frame, pin.FrameType.BODY)
    poses, jacobians = rv_m2.forward(q), rv_m2.jacobian(q)
    for row, pose, jacobian in zip(q, poses, jacobians, strict=True):
        wanted = pin.computeFrameJacobian(model, data, row, frame, pin.LOCAL_WORLD_ALIGNED)
        pin.framesForwardKinematics(model, data, row)
        np.testing.assert_allclose(pose, data.oMf[frame].homogeneous, atol=1e-12)
        np.testing.assert_allclose(jacobian, wanted, atol=1e-12)
        np.testing.assert_allclose(rv_m2.forward(row), pose, atol=1e-15)
        np.testing.assert_allclose(rv_m2.jacobian(row), jacobian, atol=1e-15)


@pytest.mark.parametrize("q", [[0.0] * 4, [[0.0] * 6], [np.nan] * 5, "home", [[[0.0] * 5]]])
def test_positions_that_are_none_are_refused_in_a_sentence(rv_m2, q):
    for ask in (rv_m2.forward, rv_m2.jacobian):
        with pytest.raises(RobotError, match="joint positions") as refused:
            ask(q)
        assert "\n" not in str(refused.value)


# ---- the RV-M2


POSES = {
    "stretched": np.zeros(5),
    "Table 1, row 1": np.array([0.5235, 0.8726, -1.3962, -1.0471, 0.0]),
    "Table 1, row 2": np.array([1.3963, 0.3839, -1.2217, -0.7330, 0.0]),
}


@pytest.fixture(scope="module")
def tree(rv_m2):
    return yourdfpy.URDF.load(io.BytesIO(rv_m2.urdf.encode()), load_meshes=False)


@pytest.fixture(scope="module")
def readme():
    path = Path(__file__).parents[1] / "robots" / "README.md"
    return path.read_text(encoding="utf-8")


def inside(visual, points):
    """Whether points (N, 3) in the frame of the visual lie in it."""
    if visual.geometry.box is not None:
        return np.all(np.abs(points) < np.asarray(visual.geometry.box.size) / 2 - 1e-9, axis=1)
    cylinder = visual.geometry.cylinder
    across = np.hypot(points[:, 0], points[:, 1]) < cylinder.radius - 1e-9
    return across & (np.abs(points[:, 2]) < cylinder.length / 2 - 1e-9)


def filled(visual, count=12):
    """Points of a grid that fill a visual, skin included, in its own frame."""
    if visual.geometry.box is not None:
        half = np.asarray(visual.geometry.box.size) / 2
    else:
        cylinder = visual.geometry.cylinder
        half = np.array([cylinder.radius, cylinder.radius, cylinder.length / 2])
    grid = np.stack(np.meshgrid(*(np.linspace(-h, h, count) * 0.999 for h in half)), axis=-1).reshape(-1, 3)
    return grid[inside(visual, grid)]


def overlapping(tree, first, second):
    """Whether anything drawn for one link stands in something drawn for the other."""
    for a, b in itertools.product(tree.link_map[first].visuals, tree.link_map[second].visuals):
        to_first, to_second = (tree.get_transform(n) @ v.origin for n, v in ((first, a), (second, b)))
        between = np.linalg.inv(to_second) @ to_first
        forward = filled(a) @ between[:3, :3].T + between[:3, 3]
        back = np.linalg.inv(between)
        backward = filled(b) @ back[:3, :3].T + back[:3, 3]
        if np.any(inside(b, forward)) or np.any(inside(a, backward)):
            return True
    return False


def test_everything_is_drawn_with_boxes_and_cylinders(tree):
    for link in tree.robot.links:
        assert bool(link.visuals) == (link.name != "tool0")
        assert not link.collisions
        for visual in link.visuals:
            assert (visual.geometry.box is None) != (visual.geometry.cylinder is None)
            assert visual.geometry.mesh is None


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
def test_links_that_do_not_meet_do_not_overlap(tree, pose):
    tree.update_cfg(pose)
    joined = {frozenset((joint.parent, joint.child)) for joint in tree.robot.joints}
    drawn = [link.name for link in tree.robot.links if link.visuals]
    apart = [pair for pair in itertools.combinations(drawn, 2) if frozenset(pair) not in joined]
    assert len(apart) == 15
    assert [pair for pair in apart if overlapping(tree, *pair)] == []


@pytest.mark.parametrize(("first", "second", "joint"), [("shoulder", "forearm", 2), ("forearm", "hand", 3)])
def test_links_do_not_fold_into_the_next_but_one(rv_m2, tree, first, second, joint):
    for position in np.linspace(rv_m2.lower[joint], rv_m2.upper[joint], 12):
        for before in (rv_m2.lower[joint - 1], 0.0, rv_m2.upper[joint - 1]) if joint == 2 else (0.0,):
            q = np.zeros(5)
            q[joint], q[joint - 1] = position, before
            tree.update_cfg(q)
            assert not overlapping(tree, first, second)


def test_overlaps_would_be_seen(tree):
    tree.update_cfg(np.zeros(5))
    # Links that share a joint do overlap there; and an elbow folded further than its limit meets the shoulder.
    assert overlapping(tree, "shoulder", "upper_arm")
    tree.update_cfg(np.array([0, 0, np.pi, 0, 0]))
    assert overlapping(tree, "shoulder", "forearm")


def test_the_picture_hangs_together(tree):
    tree.update_cfg(np.zeros(5))

    def drawn(name):
        # Each point is at most 20 mm from the next.
        frames = [(visual, tree.get_transform(name) @ visual.origin) for visual in tree.link_map[name].visuals]
        return np.concatenate([filled(visual, 9) @ at[:3, :3].T + at[:3, 3] for visual, at in frames])

    for joint in tree.robot.joints[:-1]:
        assert cdist(drawn(joint.parent), drawn(joint.child)).min() < 0.02


def test_inertias_are_those_of_the_first_solid(tree):
    for link in tree.robot.links:
        if not link.visuals:
            continue
        solid, mass = link.visuals[0].geometry, link.inertial.mass
        if solid.box is not None:
            x, y, z = np.asarray(solid.box.size)
            own = mass / 12 * np.array([y**2 + z**2, x**2 + z**2, x**2 + y**2])
        else:
            r, h = solid.cylinder.radius, solid.cylinder.length
            across = mass * (3 * r**2 + h**2) / 12
            own = np.array([across, across, mass * r**2 / 2])
        turn = link.visuals[0].origin[:3, :3]
        np.testing.assert_allclose(link.inertial.inertia, turn @ np.diag(own) @ turn.T, atol=1e-6)
        np.testing.assert_allclose(link.inertial.origin[:3, 3], link.visuals[0].origin[:3, 3], atol=1e-12)


def test_every_number_has_its_source_in_the_readme(rv_m2, readme):
    lengths = {s.name: round(1000 * s.length) for s in rv_m2.segments if s.length > 0.0}
    for name, length in lengths.items():
        row = next(line for line in readme.splitlines() if f"(`{name}`)" in line)
        assert f"| {length} mm |" in row
        assert ("**assumed**" in row) == (name == "tool_point")
    masses = next(line for line in readme.splitlines() if line.startswith("| mass of each link"))
    assert "**assumed**" in masses
    written = [float(m) for m in re.findall(r"[a-z] ([0-9.]+)", masses.split("|")[2])]
    assert written == [8, 6, 3, 5, 3.5, 1.5, 1]
    stated = [float(m) for m in re.findall(r'<mass value="([0-9.]+)"/>  <!-- assumed -->', rv_m2.urdf)]
    assert stated == written
    assert sum(written) == 28.0
