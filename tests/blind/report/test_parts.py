"""The pieces of HTML that only the trial's page has."""

import re
from html import unescape

from thermal_robot.blind.report.page import section

HOSTILE = '<b>&"x"'


def test_text_stays_text():
    made = section(HOSTILE, "content")
    assert "<b>" not in made
    assert HOSTILE in unescape(made)


def test_a_section_holds_its_content_in_order():
    assert re.sub("<[^>]*>", " ", section("Heading", "<p>one</p>", "<p>two</p>")).split() == ["Heading", "one", "two"]
