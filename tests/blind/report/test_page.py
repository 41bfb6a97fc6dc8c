"""The page of a blind trial's score."""

import re
from html.parser import HTMLParser

import pytest
from blind_records import trial, trial_of_several

from thermal_robot.blind.report.page import html
from thermal_robot.blind.score import score


@pytest.fixture(scope="module")
def plain():
    return score(trial()).to_dict()


@pytest.fixture(scope="module")
def page(plain):
    return html(plain, "today")


def test_the_page_stands_alone_and_trusts_no_name(page):
    assert page.count("<svg") == 6
    assert "&lt;geometric&gt;" in page
    assert "<geometric>" not in page
    assert "Blind trial: 6 of 12 cases answered rightly" in page
    assert not re.search(r'(?:href|src)="(?!#)', page)
    assert "//" not in page


VOID = {"meta", "br", "hr", "img", "use", "path", "rect", "image"}


class Balance(HTMLParser):
    """Note what is opened and what is closed."""

    def __init__(self):
        super().__init__()
        self.open, self.wrong, self.headings = [], [], []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID and self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)


def headings(page):
    """Assert that every element is closed; return the sections' headings."""
    found = Balance()
    found.feed(page)
    assert (found.open, found.wrong) == ([], [])
    return found.headings


def test_every_element_is_closed_and_every_section_there(page):
    assert headings(page) == [
        "How often",
        "What was named",
        "One by one",
        "Probabilities",
        "What it takes to be found",
        "How far the gap shrinks",
        "Real campaigns",
        "Misses",
    ]


def test_sections_without_cases_are_left_out():
    assert headings(html(score([]).to_dict(), "")) == [
        "How often",
        "Probabilities",
        "What it takes to be found",
        "How far the gap shrinks",
    ]


def test_equal_scores_give_equal_pages_and_only_the_footer_tells_when(plain, page):
    assert html(plain, "") == page.replace(", today</footer>", "</footer>")
    assert page.count("today") == 1


def test_several_campaigns_have_a_table_by_what_changes(page):
    whole = html(score([*trial(), *trial_of_several()]).to_dict(), "today")
    assert headings(whole) == headings(page)
    assert "Campaigns of one robot, by what changes" in whole
    assert "backlash grows, j1" in whole
    assert "by what changes" not in page
