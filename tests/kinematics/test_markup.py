"""XML that changes where it is asked to, and nowhere else; hostile texts are refused in one sentence."""

import pytest

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.urdf import bare, changed, comment, encoded, indent, tags, with_values
from thermal_robot.robot import load_robot

TEXT = """<?xml version="1.0"?>
<!-- a -- comment with <tags/> and ümlauts -->
<robot   name = 'r'>
  <joint name="a>b" type="fixed" ><origin  rpy='0 0 1'
     xyz="1 2 3"  /><!-- <origin xyz="9 9 9"/> --></joint>
  <link name="é"/>
</robot>
"""


def test_tags_are_found_where_they_stand():
    content = encoded(TEXT)
    found = tags(content)
    assert [t.path[-1] for t in found] == ["robot", "joint", "origin", "link"]
    assert [t.parent for t in found] == [-1, 0, 1, 0]
    assert [t.empty for t in found] == [False, False, True, True]
    starts = [content[t.start : t.stop] for t in found]
    assert starts[0] == b"<robot   name = 'r'>"
    assert starts[1] == b'<joint name="a>b" type="fixed" >'
    assert starts[2].startswith(b"<origin")
    assert starts[2].endswith(b"/>")
    assert content[found[0].close :] == b"</robot>\n"
    assert content[found[1].close :].startswith(b"</joint>")
    assert found[1].attributes["name"] == "a>b"


def test_attributes_change_and_all_else_stays():
    content = encoded(TEXT)
    origin = tags(content)[2]
    after = changed(content, [with_values(content, origin, {"xyz": "4 5 6", "rpy": None, "more": "x"})])
    assert after == TEXT.replace("""<origin  rpy='0 0 1'\n     xyz="1 2 3"  />""", '<origin xyz="4 5 6" more="x"  />')
    assert changed(content, []) == TEXT


def test_insertions_stand_in_their_order_before_what_is_there():
    content = encoded(TEXT)
    at = tags(content)[0].close
    assert changed(content, [(at, at, "<a/>"), (at, at, "<b/>")]) == TEXT.replace("</robot>", "<a/><b/></robot>")
    assert indent(content, tags(content)[1].start) == "\n  "
    assert indent(content, tags(content)[2].start) == ""


def test_a_comment_can_be_read_whatever_it_says():
    text = comment(["a -- b ---", "<x> & y"]) + "<robot/>"
    assert [t.path for t in tags(encoded(text))] == [("robot",)]
    inside = text[len("<!--") : text.index("-->")]
    assert "--" not in inside
    assert not inside.endswith("-")


@pytest.mark.parametrize("quote", ["'", '"'])
def test_the_declared_encoding_is_that_of_the_bytes(quote):
    text = f"<?xml version='1.0' encoding={quote}ISO-8859-1{quote}?><robot name='é'/>"
    content = encoded(text)
    assert b'encoding="utf-8"' in content
    assert tags(content)[0].attributes["name"] == "é"


ROBOT = """<?xml version="1.0"?>
<robot name="two"><link name="a"/><link name="b"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
</robot>"""
LAUGHS = '<!DOCTYPE r [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'


def more(text):
    return ROBOT.replace("</robot>", f"{text}</robot>")


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
    "two robots": (ROBOT + ROBOT, "is not XML"),
    "an end after the end": (ROBOT + "\0", "is not XML"),
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
    declared = ROBOT.replace('"1.0"', f'"1.0" encoding="{encoding}"').replace('"j"', f'"{name}"')
    (tmp_path / "arm.urdf").write_bytes(declared.encode(encoding))
    assert load_robot(tmp_path / "arm.urdf", "b").joint_names == (name,)


def test_comments_and_raw_text_hide_each_other_and_what_they_hold():
    hidden = "<![CDATA[ <!-- <link name='c'/> ]]><!-- ]]> <![CDATA[ --><link name='d'/>\n"
    found = tags(encoded(more(hidden)), "the robot")
    assert [t.attributes["name"] for t in found if t.path == ("robot", "link")] == ["a", "b", "d"]
    assert bare(hidden.encode()).count(b"\n") == 1
    assert len(bare(hidden.encode())) == len(hidden)
