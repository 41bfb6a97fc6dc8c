"""Files of meshes as URDFs name them."""

import pytest

import thermal_robot as tr
from thermal_robot.shapes.visuals import find_mesh, parsed, visuals


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
def test_a_mesh_is_found_as_it_is_named(package, named):
    found = find_mesh(named.format(package), package / "urdf")
    assert found is not None
    assert found.samefile(package / "meshes" / "link 1.stl")


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


@pytest.mark.parametrize(
    "named", ["package://arm/meshes/no.stl", "http://example.org/link.stl", "no.stl", "../meshes", ""]
)
def test_what_is_no_file_here_is_not_found(package, named):
    assert find_mesh(named, package / "urdf") is None


def test_meshes_of_a_robot_of_example_robot_data_are_found_from_the_folder_of_a_campaign(tmp_path):
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    measured = tr.simulate("example-robot-data:ur5", tool_frame="tool0", rows=5)
    file = tr.write_campaign(measured, tmp_path / "hall_3")
    robot = tr.read_campaign(file).robot
    shapes, missing = visuals(parsed(robot.urdf), robot.folder)
    assert not missing
    assert sum(map(len, shapes.values())) >= robot.n
