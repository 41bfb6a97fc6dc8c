"""The pieces of HTML of the trial's page."""

import re
from html import unescape

import pytest
from matplotlib.figure import Figure

from thermal_robot.blind.report.parts import bullets, document, drawn, paragraph, row, section, signature, table

HOSTILE = '<b>&"x"'


@pytest.mark.parametrize(
    "made",
    [
        paragraph(HOSTILE),
        bullets([HOSTILE, "plain"]),
        section(HOSTILE, "content"),
        row(["first", HOSTILE]),
        table(["", HOSTILE], []),
        document(HOSTILE, ""),
    ],
)
def test_text_stays_text(made):
    assert "<b>" not in made
    assert HOSTILE in unescape(made)


def test_a_table_keeps_its_cells_in_order():
    made = table(("name", "cases"), [row(("one", "1")), row(("two", "2"))])
    assert re.findall(r"<t[hd](?: [^>]*)?>([^<]*)<", made) == ["name", "cases", "one", "1", "two", "2"]
    assert made.count("<tr>") == 3
    assert "tr-n" not in table(("name", "cases"), [], numbers=False)


def test_a_document_needs_nothing_beside_itself():
    page = document("Trial", paragraph("word"))
    assert page.startswith("<!DOCTYPE html>")
    assert page.count("<p>word</p>") == 1
    # the style of the report is in it, and asks for nothing from elsewhere
    assert ".thermal-robot table" in page
    assert "url(" not in page
    assert "@import" not in page


def test_a_figure_is_drawn_into_the_page_and_told_to_who_does_not_see_it():
    made = drawn(Figure(figsize=(1, 1)), "what it shows")
    assert made.count("<svg") == 1
    assert "what it shows" in made


def test_the_signature_tells_when_only_where_it_is_told():
    assert signature("today") == f"{signature('')}, today"
    assert signature("").startswith("thermal-robot")
