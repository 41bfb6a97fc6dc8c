"""A figure on a page: equal for equal figures, free of clashes, of outside addresses and of fixed colours."""

import re
from xml.etree import ElementTree

import pytest

from thermal_robot.report.drawing import BEFORE, INK, Drawing
from thermal_robot.report.html_parts import _svg


def figure(bend=1.0, width=4.0):
    drawing = Drawing(width, 2.0)
    axes = drawing.subplots()
    axes.plot([0.0, 1.0, 2.0], [0.0, bend, 0.0], color=BEFORE, marker="o")
    axes.set_title("bent", color=INK)
    return drawing


@pytest.fixture(scope="module")
def text():
    return _svg(figure(), 'a bend & "more" <b>')


def identifiers(text):
    return set(re.findall(r'\bid="([^"]+)"', text))


def test_it_is_one_element_that_is_closed(text):
    root = ElementTree.fromstring(text.replace("xlink:href", "href"))
    assert root.tag == "svg"
    assert root.get("aria-label") == 'a bend & "more" <b>'
    assert root.get("role") == "img"


def test_equal_figures_give_equal_text(text):
    assert _svg(figure(), 'a bend & "more" <b>') == text


def test_identifiers_of_two_figures_on_a_page_do_not_clash(text):
    other = _svg(figure(bend=2.0), "another bend")
    assert identifiers(text)
    assert not identifiers(text) & identifiers(other)


def test_what_is_referred_to_is_there(text):
    wanted = set(re.findall(r'href="#([^"]+)"', text)) | set(re.findall(r"url\(#([^)]+)\)", text))
    assert wanted
    assert wanted <= identifiers(text)


def test_it_tells_neither_addresses_nor_dates(text):
    assert "//" not in text
    assert "xmlns" not in text
    assert "metadata" not in text
    assert not re.search(r"\b20\d\d-\d\d-\d\d", text)


def test_colours_are_the_pages_with_their_own_as_a_reserve(text):
    assert f"var(--tr-before,{BEFORE})" in text
    assert re.findall(rf"(?<!,){INK}", text) == []


def test_a_broader_figure_is_shown_broader():
    widths = [int(re.search(r"max-width:(\d+)px", _svg(figure(width=w), ""))[1]) for w in (4.0, 8.0)]
    assert widths[1] == 2 * widths[0]
