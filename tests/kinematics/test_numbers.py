"""A figure of a URDF that is no number is refused with its place, whatever the parser makes of it."""

import re

import numpy as np
import pytest

from thermal_robot.blind.plan import ARMS
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.urdf import require_numbers
from thermal_robot.robot import load_robot

URDF = """<robot name="r" xmlns:xacro="x">
  <link name="base"/>
  <link name="arm"><inertial>
    <origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="3.42"/>
    <inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="-5e-20"/></inertial>
    <visual><origin xyz="not asked"/><geometry><box size="1 1 1"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0 0 0.3" rpy="0 +1.57 .5"/><axis xyz="0 0 1"/>
    <limit lower="-1." upper="1" effort="1" velocity="1"/></joint>
</robot>"""
SPOILT = {
    "a decimal comma": (
        'mass value="3.42"',
        'mass value="3,42"',
        "link 'arm': mass is '3,42', expected a number",
    ),
    "an empty mass": ('mass value="3.42"', 'mass value=""', "link 'arm': mass is '', expected a number of kg"),
    "a negative mass": ('mass value="3.42"', 'mass value="-3"', "mass is '-3', expected .* that is not negative"),
    "no number": ('mass value="3.42"', 'mass value="nan"', "mass is 'nan'"),
    "more than any robot": ('mass value="3.42"', 'mass value="1e300"', "mass is '1e300'"),
    "too many digits": ('mass value="3.42"', f'mass value="{"9" * 400}"', "mass is '9{60}…', expected"),
    "a unit": ('ixx="1e-3"', 'ixx="1e-3 kg"', "link 'arm': inertia ixx is '1e-3 kg', expected a number of kg·m²"),
    "two numbers": ('xyz="0 0 0.1"', 'xyz="0 0.1"', "link 'arm': origin is '0 0.1', expected three numbers, m"),
    "an infinite origin": ('xyz="0 0 0.3"', 'xyz="0 0 inf"', "joint 'turn': origin is '0 0 inf'"),
    "an angle with a degree": ("+1.57", "90°", "joint 'turn': origin is '0 90° .5', expected three numbers, rad"),
    "an axis of nothing": (
        'axis xyz="0 0 1"',
        'axis xyz="0 0 0"',
        "joint 'turn': axis is '0 0 0', expected .* not",
    ),
    "limits exchanged": ('upper="1"', 'upper="-2"', "joint 'turn': its limits are -1 and -2, expected the lower one"),
    "a multiplier with a comma": (
        "<axis",
        '<mimic joint="k" multiplier="3,42"/><axis',
        "joint 'turn': mimic multiplier is '3,42', expected a number",
    ),
    "an axis without figures": ('axis xyz="0 0 1"', "axis", "joint 'turn': its <axis> has no xyz"),
    "too few angles": ('rpy="0 +1.57 .5"', 'rpy="0 1.57"', "origin is '0 1.57', expected three numbers, rad"),
    "a limit of words": ('upper="1"', 'upper="none"', "joint 'turn': limit upper is 'none', expected a number"),
}


UNKNOWN = {
    '<pose xyz="0 0 0.3"/>': "<pose>, which URDF does not know: is <origin> meant?",
    '<orgin xyz="0 0 0.3"/>': "<orgin>, which URDF does not know: is <origin> meant?",
    '<Origin rpy="0 0 0.3"/>': "<Origin>, which URDF does not know: is <origin> meant?",
    '<placed rpy="0 0 0.3"/>': "<placed>, which URDF does not know: is <origin> meant?",
    '<translation x="1"/>': "<translation>, which URDF does not know: is <origin> meant?",
    '<axes xyz="0 1 0"/>': "<axes>, which URDF does not know: is <axis> meant?",
    '<limits lower="0"/>': "<limits>, which URDF does not know: is <limit> meant?",
    '<mimick joint="k"/>': "<mimick>, which URDF does not know: is <mimic> meant?",
    '<parent_ link="k"/>': "<parent_>, which URDF does not know: is <parent> meant?",
}


@pytest.mark.parametrize("written", UNKNOWN)
def test_an_element_that_urdf_does_not_know_is_told_with_what_is_meant(written):
    instead = URDF.replace('<origin xyz="0 0 0.3" rpy="0 +1.57 .5"/>', written)
    for text in (instead, URDF.replace("<axis", written + "<axis")):
        with pytest.raises(RobotError) as refused:
            load_robot(text, "arm")
        assert str(refused.value).endswith(f"joint 'turn' has a {UNKNOWN[written]}")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('xyz="0 0 0.3"', 'xzy="0 0 0.3"', "joint 'turn' has xzy='0 0 0.3' in its <origin>, .* is xyz or rpy meant"),
        ('xyz="0 0 0.3"', 'XYZ="0 0 0.3"', "has XYZ='0 0 0.3' in its <origin>, .* is xyz meant"),
        ('rpy="0 +1.57 .5"', 'quat="0 0 0 1"', "has quat='0 0 0 1' in its <origin>, .* is xyz or rpy meant"),
        ('axis xyz="0 0 1"', 'axis xyz="0 0 1" zxy="1 0 0"', "has zxy='1 0 0' in its <axis>, .* is xyz meant"),
        ('lower="-1."', 'min="-1."', "has min='-1.' in its <limit>, .* is lower meant"),
        ('upper="1"', 'uper="1"', "has uper='1' in its <limit>, .* is upper meant"),
        ('parent link="base"', 'parent lnk="base"', "has lnk='base' in its <parent>, .* is link meant"),
        ("<axis", '<mimic joint="k" mutliplier="2"/><axis', "mutliplier='2' in its <mimic>, .* is multiplier meant"),
        ('mass value="3.42"', 'mass vaule="3.42"', "link 'arm' has vaule='3.42' in its <mass>, .* is value meant"),
        ("inertial>", "intertial>", "link 'arm' has a <intertial>, .* is <inertial> meant"),
        ("<axis", "<origin>0 0 1</origin><axis", "there are two <origin>, expected one"),
        (
            '<parent link="base"/>',
            "<parent>base</parent>",
            "its <parent> holds 'base', expected attributes, as <parent l",
        ),
        ("</robot>", '<Joint name="a" type="fixed"/></robot>', "it has a <Joint>, .* is <joint> meant"),
    ],
)
def test_a_word_that_urdf_does_not_know_is_told(old, new, told):
    assert old in URDF
    with pytest.raises(RobotError, match=told):
        load_robot(URDF.replace(old, new), "arm")


@pytest.mark.parametrize(
    "more",
    [
        "<gazebo><pose>1 2 3</pose></gazebo>",
        '<safety_controller k_velocity="1" soft_lower_limit="-1"/>',
        '<calibration rising="0.1"/>',
        '<dynamics damping="1" mu_coulomb="2"/>',
        "<hardwareInterface>Position</hardwareInterface>",
        '<drake:rotor_inertia value="3"/>',
        '<comment text="the second origin"/>',
        '<!-- <pose xyz="1 2 3"/> -->',
    ],
)
def test_extensions_that_move_nothing_pass(more):
    plain = load_robot(URDF, "arm")
    robot = load_robot(
        URDF.replace("<axis", more + "<axis").replace('effort="1"', 'effort="1" acceleration="9"'), "arm"
    )
    np.testing.assert_array_equal(robot.forward([0.5]), plain.forward([0.5]))


def test_what_is_right_passes():
    require_numbers(URDF, "the robot")
    assert load_robot(URDF, "arm").has_masses


@pytest.mark.parametrize("kind", SPOILT)
def test_what_is_no_number_is_told_with_its_place(kind):
    old, new, told = SPOILT[kind]
    assert old in URDF
    with pytest.raises(RobotError, match=f"^the robot: .*{told}"):
        require_numbers(URDF.replace(old, new), "the robot")


@pytest.mark.parametrize("kind", ["a decimal comma", "an empty mass", "a negative mass"])
def test_a_robot_with_wrong_masses_is_not_loaded(kind):
    old, new, told = SPOILT[kind]
    with pytest.raises(RobotError, match=told):
        load_robot(URDF.replace(old, new), "arm")


def test_a_comment_and_a_prefix_that_nobody_declared_do_no_harm():
    odd = URDF.replace(' xmlns:xacro="x"', "").replace("<link name=", '<!-- mass value="3,42" -- -->\n<link name=', 1)
    require_numbers(odd.replace("<axis", '<xacro:no value="3,42"/><axis'), "the robot")


@pytest.mark.parametrize("path", sorted(ARMS.glob("*.urdf")), ids=lambda p: p.stem)
def test_sound_robots_pass(path):
    text = path.read_text()
    require_numbers(text, path.name)
    mass = re.search(r'<mass value="([^"]+)"', text)
    with pytest.raises(RobotError, match="expected a number of kg"):
        require_numbers(text.replace(mass[0], f'<mass value="{mass[1].replace(".", ",")},0"'), path.name)
