"""Texts that urdfdom would take for hours, with all memory, or without a word, are refused in one sentence."""

import pytest

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.elements import read_elements, without_comments
from thermal_robot.robot import load_robot

URDF = """<?xml version="1.0"?>
<robot name="two"><link name="a"/><link name="b"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
</robot>"""
LAUGHS = '<!DOCTYPE r [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'


def more(text):
    return URDF.replace("</robot>", f"{text}</robot>")


def links(count):
    link = "<link name='l{0}'/><joint name='f{0}' type='{1}'><parent link='a'/><child link='l{0}'/></joint>"
    return lambda kind: more("".join(link.format(k, kind) for k in range(count)))


HOSTILE = {
    "deep": (more("<a>" * 200_000 + "</a>" * 200_000), "more than 100 elements within each other"),
    "deep and open": ("<robot>" * 100_000, "more than 100 elements within each other"),
    "wide": (more("<a " + " ".join(f"b{k}=''" for k in range(50_000)) + "/>"), "more than 100 attributes"),
    "comments that never end": (more("<!-- x " * 200_000), "is not XML: no element found"),
    "joints that never end": (more('<joint name="a">' * 50_000), "more than 100 elements"),
    "long chain": (links(5_000)("fixed"), "more than 1000 joints"),
    "bodies that float": (links(900)("floating"), "5401 joints that move"),
    "entities": (LAUGHS + more("&b;"), "declares the XML entity 'a'"),
    "entity of a file": ('<!DOCTYPE r [<!ENTITY a SYSTEM "file:///dev/zero">]>' + more("&a;"), "XML entity 'a'"),
    "two robots": (URDF + URDF, "is not XML"),
    "an end after the end": (URDF + "\0", "is not XML"),
    "a character that is none": (more('<link name="a&#0;b"/>'), "is not XML"),
    "SDF": ("<sdf version='1.9'/>", "is an SDF file but not a URDF"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_text_is_refused(kind):
    text, told = HOSTILE[kind]
    with pytest.raises(RobotError, match=told) as refused:
        load_robot(text, "b")
    assert len(str(refused.value)) < 300


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8", "utf-8-sig", "utf-16", "shift_jis"])
def test_a_file_in_any_encoding_is_read(tmp_path, encoding):
    name = {"ascii": "arm", "shift_jis": "腕"}.get(encoding, "épaule")
    declared = URDF.replace('"1.0"', f'"1.0" encoding="{encoding}"').replace('"j"', f'"{name}"')
    (tmp_path / "arm.urdf").write_bytes(declared.encode(encoding))
    assert load_robot(tmp_path / "arm.urdf", "b").joint_names == (name,)


def test_comments_and_raw_text_hide_each_other_and_what_they_hold():
    hidden = "<![CDATA[ <!-- <link name='c'/> ]]><!-- ]]> <![CDATA[ --><link name='d'/>\n"
    found = read_elements(without_comments(more(hidden)), "the robot")
    assert [e.attributes["name"] for e in found if e.path == ("link",)] == ["a", "b", "d"]
    assert without_comments(hidden).count("\n") == 1


def test_an_element_knows_its_place_and_its_owner():
    text = more("<link name='é'><inertial><mass value='2'/></inertial></link>")
    mass = next(e for e in read_elements(text, "the robot") if e.path == ("link", "inertial", "mass"))
    assert (mass.attributes, mass.owner) == ({"value": "2"}, {"name": "é"})
    assert text.encode()[mass.start :].startswith(b"<mass value='2'/>")
