"""XML that changes where it is asked to, and nowhere else."""

import pytest

from thermal_robot.kinematics.markup import changed, comment, encoded, indent, tags, with_values

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
