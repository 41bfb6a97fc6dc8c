"""The pieces of HTML that only the trial's page has."""

import re
from html import unescape

import pytest

from thermal_robot.blind.report.parts import row, section, table

HOSTILE = '<b>&"x"'


@pytest.mark.parametrize("made", [section(HOSTILE, "content"), row(["first", HOSTILE]), table(["", HOSTILE], [])])
def test_text_stays_text(made):
    assert "<b>" not in made
    assert HOSTILE in unescape(made)


def test_a_table_keeps_its_cells_in_order():
    made = table(("name", "cases"), [row(("one", "1")), row(("two", "2"))])
    assert re.findall(r"<t[hd](?: [^>]*)?>([^<]*)<", made) == ["name", "cases", "one", "1", "two", "2"]
    assert made.count("<tr>") == 3


def test_heads_stand_over_numbers_unless_they_stand_over_words():
    assert table(("name", "cases"), []).count("tr-n") == 1
    assert "tr-n" not in table(("name", "said"), [], numbers=False)


def test_a_section_holds_its_content_in_order():
    assert re.sub("<[^>]*>", " ", section("Heading", "<p>one</p>", "<p>two</p>")).split() == ["Heading", "one", "two"]
