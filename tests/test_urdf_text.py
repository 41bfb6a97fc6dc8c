"""Where the text of a robot comes from, and what is said of a robot that cannot be used."""

import os
import re
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from coupled import PARALLELOGRAM, joint, link

from thermal_robot import CampaignError, CorrectedModel
from thermal_robot import urdf_text as module
from thermal_robot.errors import RobotError
from thermal_robot.robot import load_robot
from thermal_robot.urdf_text import DESCRIPTION, urdf_text

AXIS = '<axis xyz="0 0 1"/>'
examples = pytest.mark.skipif(find_spec("example_robot_data") is None, reason="robots of another package")


def refusal(*args, **kwargs):
    with pytest.raises(RobotError) as refused:
        load_robot(*args, **kwargs)
    assert "\n" not in str(refused.value)
    return refused.value


def two_links(kind, more=""):
    return f"""<robot name="two"><link name="a"/><link name="b"/>
<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>{more}</joint></robot>"""


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
    assert urdf_text(rv_m2.urdf) == (rv_m2.urdf, DESCRIPTION, None)
    text, source, folder = urdf_text(file)
    assert (text, folder) == (rv_m2.urdf, file.resolve().parent)
    assert str(file) in source


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


KINDS = "only revolute, continuous, prismatic and fixed joints are supported"
WORLD = two_links("continuous", AXIS).replace('"j"', '"universe"')
BENT = PARALLELOGRAM.replace(
    "</robot>",
    f"{link('thumb')}{joint('bend', 'continuous', 'hand', 'thumb', mimic='joint=' + repr('no such joint'))}</robot>",
)
REFUSED = {
    "no such file": (
        "no/such/arm.urdf",
        "tool0",
        "the robot file 'no/such/arm.urdf' does not exist$",
        "no/such/arm.urdf",
    ),
    "a folder": (os.curdir, "tool0", "is a folder, not a URDF file$", None),
    "a name that no file can have": ("a\0b", "tool0", "does not exist$", None),
    "no robot at all": (3, "tool0", "^a robot is a path, URDF text or a yourdfpy.URDF, not int$", None),
    "a tool that is misspelt": (
        "builtin:rv_m2",
        "Tool_0",
        "^tool frame 'Tool_0' is not a link of robot 'rv_m2'; nearest: tool0, ",
        "Tool_0",
    ),
    "a tool that is a joint": ("builtin:rv_m2", "joint_4", "'joint_4' is not a link", "joint_4"),
    "two freedoms": (two_links("planar", AXIS), "b", f"^joint 'j' of the chain is planar; {KINDS}$", "j"),
    "six freedoms": (two_links("floating", AXIS), "b", f"^joint 'j' of the chain is floating; {KINDS}$", "j"),
    "a mimic of nothing": (
        two_links("continuous", f'{AXIS}<mimic joint="k"/>'),
        "b",
        "^joint 'j' mimics 'k', which is not a joint of the robot; nearest: j$",
        "j",
    ),
    "a mimic of itself": (
        two_links("continuous", f'{AXIS}<mimic joint="j"/>'),
        "b",
        "^joints mimic each other in a circle: 'j' mimics 'j'$",
        "j",
    ),
    **{
        f"a spoilt tag {k}": (
            two_links("continuous", f"{AXIS}<mimic{tag}/>"),
            "b",
            "joint 'j': mimic .* expected a number|is not a valid URDF: ",
            None,
        )
        for k, tag in enumerate((' joint="j" multiplier="3,4"', ' joint="j" offset=""', ""))
    },
    "limits that never meet": (
        PARALLELOGRAM.replace('offset="0.3"', 'offset="5"'),
        "tool",
        "^joint 'upright' mimics 'reach', but the two are never both within their limits$",
        "upright",
    ),
    "a finger that mimics nothing": (BENT, "thumb", "", "bend"),
    "an axis without direction": (two_links("continuous", '<axis xyz="0 0 0"/>'), "b", "", "j"),
    "a joint named like the world": (WORLD, "b", "", "universe"),
    "nothing that moves": (
        two_links("fixed"),
        "b",
        "^the chain has no movable joint between its root frame and its tool frame$",
        None,
    ),
    "no chain": ("builtin:rv_m2", "base_link", "no movable joint", None),
    "an unknown robot": ("builtin:rv_m1", "tool0", "^there is no built-in robot 'rv_m1'; nearest: rv_m2$", "rv_m1"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_robot_that_cannot_be_used_is_refused_in_a_sentence(case):
    source, tool, words, name = REFUSED[case]
    error = refusal(source, tool)
    assert re.search(words, str(error))
    assert name in (None, error.name)


def test_the_nearest_names_are_candidates(awkward_urdf):
    assert refusal("builtin:rv_m2", "Tool_0").candidates[0] == "tool0"
    error = refusal("builtin:rv_m2", "tool0", root_frame="base")
    assert str(error).startswith("root frame 'base' is not a link of robot 'rv_m2'; nearest: base_link")
    assert error.candidates[0] == "base_link"
    for tool in ("", None):
        error = refusal(awkward_urdf, tool)
        assert error.candidates == ("branch", "tip")
        assert str(error) == "no tool frame is given; the links at the ends of this robot are branch, tip"
    for tool, root in (("base_link", "tool0"), ("column", "upper_arm")):
        told = str(refusal("builtin:rv_m2", tool, root_frame=root))
        assert told == f"tool frame {tool!r} is not below root frame {root!r}"
    assert "is not below" in str(refusal(awkward_urdf, "tip", root_frame="branch"))


def test_what_is_beside_the_chain_or_in_a_comment_does_not_matter():
    assert load_robot(two_links("continuous", f'{AXIS}<!-- <mimic joint="k"/> -->'), "b").n == 1
    assert load_robot(BENT, "tool").n == 4


@pytest.mark.parametrize("gravity", [[0, 0], [0, 0, float("nan")], "down", [[0, 0, -9.81]], -9.81, [0, 0, None]])
def test_gravity_is_three_finite_numbers(gravity):
    assert str(refusal("builtin:rv_m2", "tool0", gravity=gravity)).startswith("gravity must be three finite numbers")
    told = str(refusal("builtin:rv_m2", "tool0", gravity=[0, 0, -9810]))  # in mm/s²
    assert told == "gravity must be at most 100 m/s² along each axis, got [0, 0, -9810]"


@examples
def test_robots_of_another_package_are_found_by_their_name(monkeypatch):
    error = refusal("example-robot-data:ur1O", "tool0")
    assert "ur10" in error.candidates
    assert str(error).startswith("there is no robot of example-robot-data 'ur1O'; nearest: ur1")
    told = str(refusal("example-robot-data:cassie", "pelvis"))
    assert told == "robot 'cassie' of example-robot-data has no URDF file"
    # a mimic finger is driven by the other one beside the chain
    assert load_robot("example-robot-data:panda", "panda_hand").n == 7
    finger = load_robot("example-robot-data:panda", "panda_rightfinger")
    assert finger.joint_names == (*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1")
    one, other = finger.forward([0.1] * 7 + [0.0]), finger.forward([0.1] * 7 + [0.03])
    np.testing.assert_allclose(np.linalg.norm(other[:3, 3] - one[:3, 3]), 0.03, atol=1e-12)
    for package in ("example_robot_data", "example_robot_data.robots_loader"):
        monkeypatch.setitem(sys.modules, package, None)
    error = refusal("example-robot-data:ur10", "tool0")
    assert 'pip install "thermal-robot[robots]"' in str(error)
    assert error.name == "ur10"
    assert list(module.shipped()) == ["builtin:rv_m2"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="has no pipes as files")
def test_what_is_no_file_is_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.urdf")
    with (tmp_path / "large.urdf").open("wb") as file:
        file.truncate(65 << 20)
    (tmp_path / "garbage.urdf").write_bytes(bytes(range(256)))
    for path, words in (
        (tmp_path / "pipe.urdf", "' is a pipe or a device"),
        ("/dev/zero", "is a pipe or a device"),
        (tmp_path / "large.urdf", "larger than any URDF"),
        (tmp_path / "garbage.urdf", "garbage.urdf' is not XML"),
        (tmp_path, "is a folder, not a URDF file"),
    ):
        assert words in str(refusal(path, "tool0"))
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
