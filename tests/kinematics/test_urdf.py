"""URDF text to Pinocchio: what a URDF may contain, why another fails, and that nobody hears of it on the terminal."""

import os

import pytest

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.urdf import nearest, parse_urdf

LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def two_links(more="", limit=LIMIT):
    return f"""<robot name="two"><link name="a"/><link name="b"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>{limit}</joint>
{more}</robot>"""


# Each is in use, and refused by a strict XML parser.
LENIENT = ['<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->", '<gazebo:plugin file="p.so"/>']


def reason(text):
    with pytest.raises(RobotError) as caught:
        parse_urdf(text, "arm.urdf")
    return str(caught.value)


@pytest.mark.parametrize("more", ["", *LENIENT])
def test_a_urdf_in_use_is_parsed(more):
    model = parse_urdf(two_links(more), "arm.urdf")
    assert (model.name, list(model.names)) == ("two", ["universe", "j"])


@pytest.mark.parametrize("more", ["", *LENIENT[1:]])
def test_the_reason_is_what_urdfdom_stumbled_over(more):
    """And not what a strict parser would have: the text with such a joint is wrong whatever stands behind it."""
    assert reason(two_links(more).replace("revolute", "wobbly")) == (
        "arm.urdf is not a valid URDF: Joint [j] has no known type [wobbly]"
    )


@pytest.mark.parametrize("limit", ["", "<limit/>", '<limit velocity="1"/>', '<limit effort="2" velocity="1"/>'])
def test_a_joint_without_limits_has_none(limit):
    model = parse_urdf(two_links("<!-- é -->", limit=limit), "arm.urdf")
    assert model.lowerPositionLimit[0] == model.upperPositionLimit[0] == 0.0
    bounds = '<limit lower="-1" upper="2"/>'
    assert parse_urdf(two_links(limit=bounds), "arm.urdf").upperPositionLimit[0] == 2.0


def test_a_xacro_tag_in_a_comment_makes_no_xacro_file():
    parse_urdf(two_links("<!-- was <xacro:arm/> -->"), "arm.urdf")
    assert "is a xacro file" in reason(two_links("<xacro:arm/>", limit="<limit lower='a'/>"))
    declared = two_links("<xacro:arm/>").replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')
    assert "is a xacro file" in reason(declared)


def test_broken_xml_is_found_in_its_line():
    text = "<robot name='r'>\n<!-- two\nlines -->\n<link name='a'>\n</robot>"
    assert reason(text) == "arm.urdf is not XML: mismatched tag: line 5, column 2"


def test_nothing_but_a_comment_is_empty():
    assert reason("<!-- to do -->") == "arm.urdf is empty"


def test_what_a_library_prints_is_kept_off_the_terminal_and_the_streams_come_back(capfd):
    reason(two_links().replace("revolute", "wobbly"))
    os.write(1, b"out")
    os.write(2, b"err")
    assert capfd.readouterr() == ("out", "err")


def test_the_most_similar_names_come_first():
    known = ["base_link", "tool0", "Tool_0", "wrist", "elbow", "shoulder", "flange"]
    assert nearest("tool_0", known)[0] == "Tool_0"
    assert nearest("TOOL0", known)[0] == "tool0"
    assert len(nearest("tool0", known)) == 5
    assert nearest("tool0", ["a"]) == ("a",)
