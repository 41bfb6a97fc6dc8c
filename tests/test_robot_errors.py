"""What is said of a robot that cannot be used."""

import os
import re
import sys

import numpy as np
import pytest
from coupled import PARALLELOGRAM, joint, link

from thermal_robot import CampaignError, CorrectedModel
from thermal_robot.errors import RobotError
from thermal_robot.robot import load_robot

TWO_LINKS = """<robot name="two"><link name="a"/><link name="b"/>
<joint name="j" type="{type}"><parent link="a"/><child link="b"/>{more}</joint></robot>"""


def refusal(*args, **kwargs):
    with pytest.raises(RobotError) as refused:
        load_robot(*args, **kwargs)
    assert "\n" not in str(refused.value)
    return refused.value


def two_links(kind, more=""):
    return TWO_LINKS.format(type=kind, more=more)


def test_no_such_file():
    error = refusal("no/such/arm.urdf", "tool0")
    assert str(error) == "the robot file 'no/such/arm.urdf' does not exist"
    assert error.name == "no/such/arm.urdf"


def test_a_folder(tmp_path):
    assert str(refusal(tmp_path, "tool0")).endswith("is a folder, not a URDF file")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("  \n", "is empty"),
        ("<html><body/></html>", r"is XML but not a URDF: its root element is <html>, expected <robot>"),
        ("<robot name='r'>", "is not XML: no element found"),
        ("<robot name='r'/>", "is not a valid URDF: No link elements found"),
        ("<robot name='r'><xacro:arm/></robot>", "is a xacro file; expand it"),
        ("<sdf version='1.9'/>", r"is an SDF file but not a URDF"),
        ("<mujoco/>", r"is an MJCF file \(MuJoCo\) but not a URDF"),
        (two_links("wobbly"), r"is not a valid URDF: Joint \[j\] has no known type"),
        (
            two_links("fixed").replace("<link name", "<link name='c'/><link name", 1),
            "is not a valid URDF: Failed to find root link: Two root links found",
        ),
    ],
)
def test_not_a_urdf(text, words, capfd, tmp_path):
    assert re.match(f"the robot description {words}", str(refusal(text, "b")))
    file = tmp_path / "arm.urdf"
    file.write_text(text)
    assert re.search(rf"arm.urdf' {words}", str(refusal(file, "b")))
    assert capfd.readouterr() == ("", "")


def test_garbage_in_a_file(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_bytes(bytes(range(256)))
    assert "arm.urdf' is not XML" in str(refusal(file, "tool0"))


def test_not_a_robot_at_all():
    assert str(refusal(3, "tool0")) == "a robot is a path, URDF text or a yourdfpy.URDF, not int"


def test_unknown_tool_frame_names_the_nearest():
    error = refusal("builtin:rv_m2", "Tool_0")
    assert str(error).startswith("tool frame 'Tool_0' is not a link of robot 'rv_m2'; nearest: tool0, ")
    assert error.name == "Tool_0"
    assert error.candidates[0] == "tool0"


def test_a_joint_is_not_a_tool_frame():
    assert refusal("builtin:rv_m2", "joint_4").name == "joint_4"


def test_unknown_root_frame_names_the_nearest():
    error = refusal("builtin:rv_m2", "tool0", root_frame="base")
    assert str(error).startswith("root frame 'base' is not a link of robot 'rv_m2'; nearest: base_link")
    assert error.candidates[0] == "base_link"


@pytest.mark.parametrize("tool", ["", None])
def test_no_tool_frame_names_the_ends(tool, awkward_urdf):
    error = refusal(awkward_urdf, tool)
    assert error.candidates == ("branch", "tip")
    assert str(error) == "no tool frame is given; the links at the ends of this robot are branch, tip"


@pytest.mark.parametrize(("tool", "root"), [("base_link", "tool0"), ("column", "upper_arm")])
def test_tool_not_below_root(tool, root):
    assert str(refusal("builtin:rv_m2", tool, root_frame=root)) == (
        f"tool frame {tool!r} is not below root frame {root!r}"
    )


def test_tool_on_another_branch(awkward_urdf):
    assert "is not below" in str(refusal(awkward_urdf, "tip", root_frame="branch"))


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_joints_with_more_freedoms_are_named(kind):
    error = refusal(two_links(kind, '<axis xyz="0 0 1"/>'), "b")
    assert error.name == "j"
    assert str(error) == (
        f"joint 'j' of the chain is {kind}; only revolute, continuous, prismatic and fixed joints are supported"
    )


def test_mimics_of_nothing_and_of_themselves_are_named():
    error = refusal(two_links("continuous", '<axis xyz="0 0 1"/><mimic joint="k"/>'), "b")
    assert str(error) == "joint 'j' mimics 'k', which is not a joint of the robot; nearest: j"
    assert error.name == "j"
    error = refusal(two_links("continuous", '<axis xyz="0 0 1"/><mimic joint="j"/>'), "b")
    assert str(error) == "joints mimic each other in a circle: 'j' mimics 'j'"
    assert error.name == "j"


@pytest.mark.parametrize("tag", ['<mimic joint="j" multiplier="3,4"/>', '<mimic joint="j" offset=""/>', "<mimic/>"])
def test_a_spoilt_mimic_tag_is_said(tag):
    told = str(refusal(two_links("continuous", f'<axis xyz="0 0 1"/>{tag}'), "b"))
    assert re.search("joint 'j': mimic .* expected a number|is not a valid URDF: ", told)


def test_limits_that_never_meet_are_named():
    text = PARALLELOGRAM.replace('offset="0.3"', 'offset="5"')
    error = refusal(text, "tool")
    assert str(error) == "joint 'upright' mimics 'reach', but the two are never both within their limits"
    assert error.name == "upright"


def test_a_mimic_tag_in_a_comment_is_none():
    assert load_robot(two_links("continuous", '<axis xyz="0 0 1"/><!-- <mimic joint="k"/> -->'), "b").n == 1


def test_fingers_that_mimic_nothing_beyond_the_tool_do_not_matter():
    hand = link("thumb") + joint("bend", "continuous", "hand", "thumb", mimic='joint="no such joint"')
    text = PARALLELOGRAM.replace("</robot>", hand + "</robot>")
    assert load_robot(text, "tool").n == 4
    assert refusal(text, "thumb").name == "bend"


def test_a_mimic_finger_is_driven_by_the_other_one_beside_the_chain():
    pytest.importorskip("example_robot_data", reason="the arm is in the package example-robot-data-loaders")
    assert load_robot("example-robot-data:panda", "panda_hand").n == 7
    finger = load_robot("example-robot-data:panda", "panda_rightfinger")
    assert finger.joint_names == (*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1")
    one, other = finger.forward([0.1] * 7 + [0.0]), finger.forward([0.1] * 7 + [0.03])
    np.testing.assert_allclose(np.linalg.norm(other[:3, 3] - one[:3, 3]), 0.03, atol=1e-12)


def test_an_axis_without_direction_is_named():
    assert refusal(two_links("continuous", '<axis xyz="0 0 0"/>'), "b").name == "j"


def test_a_joint_with_the_name_of_the_world():
    urdf = two_links("continuous", '<axis xyz="0 0 1"/>').replace('"j"', '"universe"')
    assert refusal(urdf, "b").name == "universe"


def test_nothing_that_moves():
    assert str(refusal(two_links("fixed"), "b")) == (
        "the chain has no movable joint between its root frame and its tool frame"
    )
    assert "no movable joint" in str(refusal("builtin:rv_m2", "base_link"))


@pytest.mark.parametrize("gravity", [[0, 0], [0, 0, float("nan")], "down", [[0, 0, -9.81]], -9.81, [0, 0, None]])
def test_gravity_is_three_finite_numbers(gravity):
    assert str(refusal("builtin:rv_m2", "tool0", gravity=gravity)).startswith("gravity must be three finite numbers")


def test_gravity_in_millimetres_is_no_gravity():
    told = str(refusal("builtin:rv_m2", "tool0", gravity=[0, 0, -9810]))
    assert told == "gravity must be at most 100 m/s² along each axis, got [0, 0, -9810]"


def test_unknown_builtin_robot():
    error = refusal("builtin:rv_m1", "tool0")
    assert str(error) == "there is no built-in robot 'rv_m1'; nearest: rv_m2"
    assert error.candidates == ("rv_m2",)


def test_unknown_example_robot():
    pytest.importorskip("example_robot_data", reason="names of the package example-robot-data-loaders")
    error = refusal("example-robot-data:ur1O", "tool0")
    assert "ur10" in error.candidates
    assert str(error).startswith("there is no robot of example-robot-data 'ur1O'; nearest: ")


def test_example_robot_without_urdf():
    pytest.importorskip("example_robot_data", reason="names of the package example-robot-data-loaders")
    assert (
        str(refusal("example-robot-data:cassie", "pelvis")) == "robot 'cassie' of example-robot-data has no URDF file"
    )


def test_package_of_example_robots_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "example_robot_data", None)
    error = refusal("example-robot-data:ur10", "tool0")
    assert 'pip install "thermal-robot[robots]"' in str(error)
    assert error.name == "ur10"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="has no pipes as files")
def test_what_is_no_file_is_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.urdf")
    with pytest.raises(RobotError, match="' is a pipe or a device"):
        load_robot(tmp_path / "pipe.urdf", "tool0")
    with pytest.raises(RobotError, match="is a pipe or a device"):
        load_robot("/dev/zero", "tool0")
    with (tmp_path / "large.urdf").open("wb") as file:
        file.truncate(65 << 20)
    with pytest.raises(RobotError, match="larger than any URDF"):
        load_robot(tmp_path / "large.urdf", "tool0")
    with pytest.raises(CampaignError, match="expected a model file"):
        CorrectedModel.load(tmp_path / "pipe.urdf")


def test_hundreds_of_joints_are_refused_at_once():
    """Pinocchio takes 11 GB for 500, and ends the process at 1000."""
    links = "".join(f"<link name='l{k}'/>" for k in range(901))
    joint = "<joint name='j{0}' type='continuous'><parent link='l{0}'/><child link='l{1}'/></joint>"
    joints = "".join(joint.format(k, k + 1) for k in range(900))
    for tool in ("l900", ""):
        told = str(refusal(f"<robot name='r'>{links}{joints}</robot>", tool))
        assert "has 900 joints that move, expected at most 150" in told
