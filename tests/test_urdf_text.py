"""Where the text of a robot comes from: the package, a file, text, and what is said where there is none."""

import pytest

from thermal_robot import urdf_text as module
from thermal_robot.errors import RobotError
from thermal_robot.urdf_text import DESCRIPTION, urdf_file, urdf_text


def test_builtin_robots_are_found_inside_the_package_and_beside_it(rv_m2, tmp_path, monkeypatch):
    package = tmp_path / "thermal_robot"
    monkeypatch.setattr(module, "__file__", str(package / "urdf_text.py"))
    for folder in (package / "robots", tmp_path / "robots"):
        folder.mkdir(parents=True)
        (folder / "rv_m2.urdf").write_text(rv_m2.urdf, encoding="utf-8")
        assert urdf_text("builtin:rv_m2")[0] == rv_m2.urdf
        (folder / "rv_m2.urdf").unlink()
        folder.rmdir()


def test_text_is_taken_as_it_is_and_a_file_tells_its_name(rv_m2, tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(rv_m2.urdf, encoding="utf-8")
    assert urdf_text(rv_m2.urdf) == (rv_m2.urdf, DESCRIPTION)
    text, source = urdf_text(file)
    assert text == rv_m2.urdf
    assert str(file) in source


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_a_file_is_read_in_its_own_encoding(encoding, rv_m2, tmp_path):
    declared = rv_m2.urdf.split("?>", 1)[-1]
    head = '<?xml version="1.0" encoding="latin-1"?>' if encoding == "latin-1" else ""
    file = tmp_path / "arm.urdf"
    file.write_bytes((head + declared.lstrip()).encode(encoding))
    assert "<robot" in urdf_text(file)[0]


@pytest.mark.parametrize(
    ("source", "said"),
    [("builtin:rv_m3", "rv_m2"), ("example-robot-data:ur11", "nearest: ur1"), (3, "URDF text or a yourdfpy.URDF")],
)
def test_a_name_that_does_not_exist_is_answered_with_those_that_do(source, said):
    if str(source).startswith("example"):
        pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    with pytest.raises(RobotError, match=said) as refused:
        urdf_text(source)
    assert "\n" not in str(refused.value)


def test_the_file_of_a_robot_is_where_its_text_comes_from(rv_m2, tmp_path):
    assert urdf_file("builtin:rv_m2").read_text(encoding="utf-8").strip() == rv_m2.urdf.strip()
    for named in (tmp_path / "arm.urdf", str(tmp_path / "arm.urdf")):
        assert urdf_file(named) == tmp_path / "arm.urdf"
    with pytest.raises(RobotError, match="rv_m2"):
        urdf_file("builtin:rv_m3")
