"""URDF text: what is in use is read, what is wrong is refused in a sentence with its place, origins are written."""

import os
import re

import numpy as np
import pytest
from coupled import joint, link, urdf
from lxml import etree

from thermal_robot.blind.plan import ARMS
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import exp3, exp6, tool_poses
from thermal_robot.kinematics.urdf import nearest, parse_urdf, read, require_numbers, rewritten
from thermal_robot.robot import load_robot

LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def two(more="", limit=LIMIT):
    return f"""<?xml version="1.0"?>
<robot name="two"><link name="a"/><link name="b"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>{limit}</joint>
{more}</robot>"""


def reason(text, of=lambda text: parse_urdf(text, "arm.urdf")):
    with pytest.raises(RobotError) as caught:
        of(text)
    return str(caught.value)


# Each is in use, and refused by a strict XML parser.
LENIENT = ['<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->", '<gazebo:plugin file="p.so"/>']
HIDDEN = "<![CDATA[ <!-- <link name='c'/> ]]><!-- ]]> <![CDATA[ --><link name='d'/>\n"


@pytest.mark.parametrize("more", ["", *LENIENT, "<!-- was <xacro:arm/> -->"])
def test_a_urdf_in_use_is_parsed(more):
    model = parse_urdf(two(more), "arm.urdf")
    assert (model.name, list(model.names)) == ("two", ["universe", "j"])
    if "xacro" not in more:  # the text with such a joint is wrong whatever stands behind it
        said = "arm.urdf is not a valid URDF: Joint [j] has no known type [wobbly]"
        assert reason(two(more).replace("revolute", "wobbly")) == said


@pytest.mark.parametrize("before", ["", "<!DOCTYPE robot>\n"])
def test_a_default_namespace_and_what_is_long_are_read_and_written_back(before):
    named = two(f"<a b='{'1' * 10_000_001}'/>").replace("<robot", f'{before}<robot xmlns="http://drake.mit.edu"')
    written = rewritten(named, {"j": np.eye(4)}, links={"c": ("b", np.eye(4))})
    assert load_robot(written, "c").urdf_joints == ("j", "c_joint")
    assert len(named) < len(written) < len(named) + 300
    assert f'{before}<robot xmlns="http://drake.mit.edu" name="two">' in written
    assert "xmlns" not in written.partition("drake")[2]
    ends = '<origin .*/><parent link="b"/><child link="c"/>'
    assert re.search(f'<link name="c"/>\n<joint name="c_joint" type="fixed">{ends}</joint>\n</robot>\n$', written)


@pytest.mark.parametrize("limit", ["", "<limit/>", '<limit velocity="1"/>', '<limit effort="2" velocity="1"/>'])
def test_a_joint_without_limits_has_none(limit):
    model = parse_urdf(two("<!-- é -->", limit=limit), "arm.urdf")
    assert model.lowerPositionLimit[0] == model.upperPositionLimit[0] == 0.0
    assert parse_urdf(two(limit='<limit lower="-1" upper="2"/>'), "arm.urdf").upperPositionLimit[0] == 2.0


def test_what_a_library_prints_is_kept_off_the_terminal_and_the_streams_come_back(capfd):
    reason(two().replace("revolute", "wobbly"))
    os.write(1, b"out")
    os.write(2, b"err")
    assert capfd.readouterr() == ("out", "err")


def test_the_most_similar_names_come_first():
    known = ["base_link", "tool0", "Tool_0", "wrist", "elbow", "shoulder", "flange"]
    assert nearest("tool_0", known)[0] == "Tool_0"
    assert nearest("TOOL0", known)[0] == "tool0"
    assert len(nearest("tool0", known)) == 5


def test_comments_and_raw_text_hide_each_other_and_what_they_hold():
    assert [found.get("name") for found in read(two(HIDDEN), "arm.urdf").iterfind("link")] == ["a", "b", "d"]


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8", "utf-8-sig", "utf-16", "shift_jis"])
def test_a_file_in_any_encoding_is_read(tmp_path, encoding):
    name = {"ascii": "arm", "shift_jis": "腕"}.get(encoding, "épaule")
    declared = two().replace('"1.0"', f'"1.0" encoding="{encoding}"').replace('"j"', f'"{name}"')
    (tmp_path / "arm.urdf").write_bytes(declared.encode(encoding))
    robot = load_robot(tmp_path / "arm.urdf", "b")
    assert robot.joint_names == (name,)
    assert load_robot(rewritten(robot.urdf, {name: np.eye(4)}), "b").joint_names == (name,)


def links(kind, count):
    link = "<link name='l{0}'/><joint name='f{0}' type='{1}'><parent link='a'/><child link='l{0}'/></joint>"
    return two("".join(link.format(k, kind) for k in range(count)))


XACRO = "is a xacro file; expand it to URDF first"
LAUGHS = '<!DOCTYPE r [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
HOSTILE = {
    "nothing": ("<!-- to do -->", "arm.urdf is empty"),
    "broken": ("<robot name='r'>\n<!-- two\nlines -->\n<link name='a'>\n</robot>",
               "arm.urdf is not XML: mismatched tag: line 5, column 2"),
    "deep": (two("<a>" * 200_000 + "</a>" * 200_000), "more than 100 elements within each other"),
    "deep and open": ("<robot>" * 100_000, "more than 100 elements within each other"),
    "wide": (two("<a " + " ".join(f"b{k}=''" for k in range(50_000)) + "/>"), "more than 100 attributes"),
    "comments that never end": (two("<!-- x " * 200_000), "is not XML: no element found"),
    "joints that never end": (two('<joint name="a">' * 50_000), "more than 100 elements"),
    "long chain": (links("fixed", 5_000), "more than 1000 joints"),
    "bodies that float": (links("floating", 900), "5401 joints that move"),
    "entities": (LAUGHS + two("&b;")[21:], "declares the XML entity 'a'"),
    "entity of a file": ('<!DOCTYPE r [<!ENTITY a SYSTEM "file:///dev/zero">]>' + two("&a;")[21:], "XML entity 'a'"),
    "two robots": (two() + two(), "is not XML"),
    "an end after the end": (two() + "\0", "is not XML"),
    "a beginning that is none": ("\0" + two(), "is not XML"),
    "a character that is none": (two('<link name="a&#0;b"/>'), "is not XML"),
    "SDF": ("<sdf version='1.9'/>", "is an SDF file but not a URDF"),
    "xacro": (two("<xacro:arm/>", limit="").replace("revolute", "r"), XACRO),
    "declared xacro": (two("<xacro:arm/>").replace("<robot", '<robot xmlns:xacro="http://ros.org/xacro"'), XACRO),
}  # fmt: skip


def checked(text):
    require_numbers(text, "arm.urdf")
    parse_urdf(text, "arm.urdf")


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_text_is_refused(kind):
    text, told = HOSTILE[kind]
    said = reason(text, checked)
    assert told in said
    assert len(said) < 300


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
MASS, AXIS, XYZ, RPY = 'mass value="3.42"', 'axis xyz="0 0 1"', 'xyz="0 0 0.3"', 'rpy="0 +1.57 .5"'
SPOILT = [
    (MASS, 'mass value="3,42"', ": link 'arm': mass is '3,42', expected a number"),
    (MASS, 'mass value=""', ": link 'arm': mass is '', expected a number of kg"),
    (MASS, 'mass value="-3"', "mass is '-3', expected .* that is not negative"),
    (MASS, 'mass value="nan"', "mass is 'nan'"),
    (MASS, 'mass value="1e300"', "mass is '1e300'"),
    (MASS, f'mass value="{"9" * 400}"', "mass is '9{60}…', expected"),
    (MASS, "mass", "its <mass> has no value, expected a number of kg"),
    ('<mass value="3.42"/>', "", "its <inertial> has no <mass>, expected one"),
    ('ixx="1e-3"', 'ixx="1e-3 kg"', ": link 'arm': inertia ixx is '1e-3 kg', expected a number of kg·m²"),
    ('xyz="0 0 0.1"', 'xyz="0 0.1"', ": link 'arm': origin is '0 0.1', expected three numbers, m"),
    (XYZ, 'xyz="0 0 inf"', ": joint 'turn': origin is '0 0 inf'"),
    ("+1.57", "90°", ": joint 'turn': origin is '0 90° .5', expected three numbers, rad"),
    (RPY, 'rpy="0 1.57"', "origin is '0 1.57', expected three numbers, rad"),
    (AXIS, 'axis xyz="0 0 0"', ": joint 'turn': axis is '0 0 0', expected .* not"),
    (AXIS, "axis", ": joint 'turn': its <axis> has no xyz"),
    ('upper="1"', 'upper="-2"', ": joint 'turn': its limits are -1 and -2, expected the lower one"),
    ('upper="1"', 'upper="none"', ": joint 'turn': limit upper is 'none', expected a number"),
    ("<axis", '<mimic joint="k" multiplier="3,42"/><axis', ": joint 'turn': mimic multiplier is '3,42', expected a n"),
    ('name="turn"', 'name=" turn"', ": joint ' turn': expected a name without blanks around it"),
    (XYZ, 'xzy="0 0 0.3"', ": joint 'turn' has xzy='0 0 0.3' in its <origin>, .* is xyz or rpy meant"),
    (XYZ, 'XYZ="0 0 0.3"', "has XYZ='0 0 0.3' in its <origin>, .* is xyz meant"),
    (RPY, 'quat="0 0 0 1"', "has quat='0 0 0 1' in its <origin>, .* is xyz or rpy meant"),
    (AXIS, AXIS + ' zxy="1 0 0"', "has zxy='1 0 0' in its <axis>, .* is xyz meant"),
    ('lower="-1."', 'min="-1."', "has min='-1.' in its <limit>, .* is lower meant"),
    ('upper="1"', 'uper="1"', "has uper='1' in its <limit>, .* is upper meant"),
    ('parent link="base"', 'parent lnk="base"', "has lnk='base' in its <parent>, .* is link meant"),
    ("<axis", '<mimic joint="k" mutliplier="2"/><axis', "mutliplier='2' in its <mimic>, .* is multiplier meant"),
    (MASS, 'mass vaule="3.42"', ": link 'arm' has vaule='3.42' in its <mass>, .* is value meant"),
    ("inertial>", "intertial>", ": link 'arm' has a <intertial>, .* is <inertial> meant"),
    ("<axis", "<origin>0 0 1</origin><axis", "there are two <origin>, expected one"),
    ('<parent link="base"/>', "<parent>base</parent>", "its <parent> holds 'base', expected attributes, as <parent l"),
    ('<parent link="base"/>', "<parent><b/></parent>", "its <parent> holds '<b"),
    ("</robot>", '<Joint name="a" type="fixed"/></robot>', "it has a <Joint>, .* is <joint> meant"),
    *((old, written + more, f"joint 'turn' has a <{name}>, which URDF does not know: is <{meant}> meant\\?$")
      for written, name, meant in (
          ('<pose xyz="0 0 0.3"/>', "pose", "origin"), ('<orgin xyz="0 0 0.3"/>', "orgin", "origin"),
          ('<Origin rpy="0 0 0.3"/>', "Origin", "origin"), ('<placed rpy="0 0 0.3"/>', "placed", "origin"),
          ('<translation x="1"/>', "translation", "origin"), ('<axes xyz="0 1 0"/>', "axes", "axis"),
          ('<limits lower="0"/>', "limits", "limit"), ('<mimick joint="k"/>', "mimick", "mimic"),
          ('<parent_ link="k"/>', "parent_", "parent"))
      for old, more in (('<origin xyz="0 0 0.3" rpy="0 +1.57 .5"/>', ""), ("<axis", "<axis"))),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "told"), SPOILT)
def test_what_is_wrong_is_told_with_its_place(old, new, told):
    assert old in URDF
    with pytest.raises(RobotError, match=f"^the robot description.*{told}"):
        load_robot(URDF.replace(old, new), "arm")


PASSING = [
    "<gazebo><pose>1 2 3</pose></gazebo>",
    '<safety_controller k_velocity="1" soft_lower_limit="-1"/>',
    '<calibration rising="0.1"/>',
    '<dynamics damping="1" mu_coulomb="2"/>',
    "<hardwareInterface>Position</hardwareInterface>",
    '<drake:rotor_inertia value="3"/>',
    '<comment text="the second origin"/>',
    '<!-- <pose xyz="1 2 3"/> mass value="3,42" -- -->',
]


@pytest.mark.parametrize("more", PASSING)
def test_extensions_that_move_nothing_pass(more):
    text = URDF.replace("<axis", more + "<axis").replace('effort="1"', 'effort="1" acceleration="9"')
    plain, robot = load_robot(URDF, "arm"), load_robot(text, "arm")
    assert robot.has_masses
    np.testing.assert_array_equal(robot.forward([0.5]), plain.forward([0.5]))


def test_a_prefix_that_nobody_declared_does_no_harm():
    require_numbers(URDF.replace(' xmlns:xacro="x"', "").replace("<axis", '<xacro:no value="3,42"/><axis'), "it")


@pytest.mark.parametrize("path", sorted(ARMS.glob("*.urdf")), ids=lambda p: p.stem)
def test_sound_robots_pass(path):
    text = path.read_text()
    require_numbers(text, path.name)
    mass = re.search(r'<mass value="([^"]+)"', text)
    with pytest.raises(RobotError, match="expected a number of kg"):
        require_numbers(text.replace(mass[0], f'<mass value="{mass[1].replace(".", ",")},0"'), path.name)


POSE = exp6([0.1, -0.2, 0.3, 0.5, -0.4, 0.3])
TEXT = urdf(link("a"), link("b"), joint("j", "revolute", "a", "b", "1 2 3", limits=(-1, 1))).replace(
    '<origin xyz="1 2 3" rpy="0 0 0"/>', "{}"
)


def end(text, frame="b"):
    return tool_poses(load_robot(text, frame), np.zeros(1))[0]


def without_origins(text):
    root = etree.fromstring(text)
    for origin in root.findall("joint/origin"):
        origin.getparent().remove(origin)
    return etree.tostring(root, method="c14n")


@pytest.mark.parametrize(
    "origin", ["", "<origin/>", '<origin rpy="1 2 3"></origin>', "<!--<origin/>--><origin xyz='1 2 3' />"]
)
def test_an_origin_is_given_whatever_stood_there_and_all_else_stays(origin):
    text = TEXT.format(origin)
    after = rewritten(text, {"j": POSE})
    np.testing.assert_allclose(end(after), POSE, atol=1e-15)
    assert without_origins(after) == without_origins(text)
    assert after.count("<origin") == max(1, text.count("<origin"))


@pytest.mark.parametrize("away", [0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_pitch_of_a_quarter_turn_loses_nothing(away, side):
    for yaw, roll in np.random.default_rng(3).uniform(-3, 3, (8, 2)):
        pose = np.eye(4)
        pose[:3, :3] = exp3([0, 0, yaw]) @ exp3([0, side * (np.pi / 2 - away), 0]) @ exp3([roll, 0, 0])
        np.testing.assert_allclose(end(rewritten(TEXT.format(""), {"j": pose})), pose, atol=2e-15)


def test_a_link_is_added_once_and_then_placed_anew():
    text = TEXT.format("")
    once = rewritten(text, {}, links={"t": ("b", POSE)})
    np.testing.assert_allclose(end(once, "t"), POSE, atol=1e-15)
    twice = rewritten(once, {}, links={"t": ("b", POSE @ POSE)})
    np.testing.assert_allclose(end(twice, "t"), POSE @ POSE, atol=1e-15)
    assert twice.count("<link") == once.count("<link") == 3
    for given, origins, added, told in (
        (text, {}, {"a": ("b", POSE)}, "link 'a' already"),
        (text.replace('"j"', '"t_joint"'), {}, {"t": ("b", POSE)}, "joint 't_joint' already"),
        (text, {"x": POSE}, {}, "no joint 'x'"),
    ):
        with pytest.raises(RobotError, match=told):
            rewritten(given, origins, links=added)
    # names may hold what XML escapes
    name = 'a & <b> "c"'
    after = rewritten(text.replace('"b"', '"a &amp; &lt;b&gt; &quot;c&quot;"'), {}, links={"t": (name, POSE)})
    np.testing.assert_allclose(end(after, "t"), POSE, atol=1e-15)


def test_notes_stand_before_the_robot():
    text = "<?xml version='1.0'?>\n<!-- their -- own -->\n" + TEXT.format("")
    after = rewritten(text, {}, notes=["one -- two", "three-"])
    assert re.match(
        r"<\?xml version='1.0' encoding='utf-8'\?>\s*<!-- their -- own -->\s*<!--\none - - two\nthree\n-->\s*<robot",
        after,
    )
    assert load_robot(after, "b").n == 1
