"""A figure of a URDF that is no number is refused with its place, whatever the parser makes of it."""

import re

import pytest

from thermal_robot.blind.plan import ARMS
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.numbers import require_numbers
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
    "a limit of words": ('upper="1"', 'upper="none"', "joint 'turn': limit upper is 'none', expected a number"),
}


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
