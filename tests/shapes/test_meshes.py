"""Files of meshes as URDFs name them."""

import pytest

from thermal_robot.shapes.meshes import find_mesh


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
