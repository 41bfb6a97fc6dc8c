"""The file of the RV-M2: what is drawn, and that its sources are written beside it."""

import io
import itertools
import re
from pathlib import Path

import numpy as np
import pytest
import yourdfpy
from scipy.spatial.distance import cdist

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
