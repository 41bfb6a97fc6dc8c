"""What links look like: hulls that hold the shapes of the URDF, in the frames of their links."""

import numpy as np
import pytest

from thermal_robot import load_robot
from thermal_robot.shapes.visuals import hull, hulls

ONE = """<robot name="one"><link name="ground"/><link name="arm">{visual}</link>
<joint name="turn" type="revolute"><parent link="ground"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def volume(corners, faces):
    """Of a closed body with outward faces: the divergence theorem."""
    a, b, c = (corners[faces[:, k]] for k in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)


def shaped(geometry, origin="0 0 0", tmp_path=None):
    visual = f'<visual><origin xyz="{origin}" rpy="0 0 0"/><geometry>{geometry}</geometry></visual>'
    text = ONE.format(visual=visual)
    if tmp_path is None:
        return hulls(load_robot(text, "arm"))
    file = tmp_path / "one.urdf"
    file.write_text(text, encoding="utf-8")
    return hulls(load_robot(file, "arm"))


@pytest.mark.parametrize(
    ("geometry", "expected", "within"),
    [
        ('<box size="0.1 0.2 0.3"/>', 0.006, 1e-9),
        ('<cylinder radius="0.1" length="0.5"/>', np.pi * 0.1**2 * 0.5, 0.03),
        ('<sphere radius="0.2"/>', 4.0 / 3.0 * np.pi * 0.2**3, 0.15),
    ],
)
def test_a_shape_has_nearly_its_volume_and_never_more(geometry, expected, within):
    (solid,) = shaped(geometry)
    assert solid.link == "arm"
    assert expected * (1.0 - within) <= volume(solid.corners, solid.faces) <= expected * (1.0 + 1e-9)


def test_its_origin_moves_a_shape():
    (there,) = shaped('<box size="0.1 0.2 0.3"/>', "1 2 3")
    np.testing.assert_allclose((there.corners.min(axis=0) + there.corners.max(axis=0)) / 2.0, [1.0, 2.0, 3.0])


def test_a_mesh_is_found_beside_the_file_and_scaled(tmp_path):
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 2)]
    hold, faces = hull(np.array(corners, dtype=float))
    lines = [f"v {x} {y} {z}" for x, y, z in hold] + ["f " + " ".join(str(k + 1) for k in face) for face in faces]
    (tmp_path / "part.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (solid,) = shaped('<mesh filename="part.obj" scale="0.1 0.1 0.1"/>', tmp_path=tmp_path)
    assert volume(solid.corners, solid.faces) == pytest.approx(0.1 * 0.1 * 0.2)
    np.testing.assert_allclose(solid.corners.max(axis=0), [0.1, 0.1, 0.2])


def test_a_mesh_that_is_not_there_is_no_error(tmp_path):
    assert shaped('<mesh filename="package://nowhere/no.stl"/>', tmp_path=tmp_path) == ()
    (tmp_path / "part.stl").write_bytes(b"this is no mesh")
    assert shaped('<mesh filename="part.stl"/>', tmp_path=tmp_path) == ()
    assert shaped('<mesh filename="https://example.invalid/part.stl"/>', tmp_path=tmp_path) == ()


def test_a_hull_keeps_a_large_cloud_inside_but_for_a_little():
    cloud = np.random.default_rng(2).normal(size=(5000, 3))
    cloud /= np.linalg.norm(cloud, axis=1, keepdims=True)
    corners, faces = hull(cloud)
    assert len(corners) <= 80
    assert set(faces.ravel()) == set(range(len(corners)))
    whole = 4.0 / 3.0 * np.pi
    assert 0.85 * whole < volume(corners, faces) < whole


def test_what_is_flat_has_no_hull():
    assert hull(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])) is None
    assert hull(np.zeros((2, 3))) is None


def test_every_link_of_the_reference_robot_has_a_shape(rv_m2):
    assert {s.link for s in hulls(rv_m2)} == set(rv_m2.chain.parent_links)


def test_the_meshes_of_an_example_robot_are_read():
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    robot = load_robot("example-robot-data:ur10", "tool0")
    shown = {s.link: s for s in hulls(robot)}
    assert {"base_link", "shoulder_link", "upper_arm_link", "forearm_link"} <= set(shown)
    # the upper arm is 612 mm between its joints, and has a housing around each
    assert 0.612 < np.ptp(shown["upper_arm_link"].corners, axis=0).max() < 0.9
