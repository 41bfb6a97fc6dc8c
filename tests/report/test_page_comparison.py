"""A comparison as a page: whole, self-contained, and safe whatever a name holds."""

import re

import pytest
from compared import diagnosed, moved

import thermal_robot as tr
from thermal_robot.report import comparison_fragment, comparison_html
from thermal_robot.report.page_campaigns import plot_differences


@pytest.fixture(scope="module")
def plain():
    names = ["before", "<script>alert(1)</script>"]
    return tr.compare(diagnosed(1), diagnosed(3, moved(4e-4)), names=names).to_dict()


def test_the_page_is_whole_and_fetches_nothing(plain):
    page = comparison_html(plain, "2026-01-01 00:00", {"a.csv": "0" * 64})
    assert page.startswith("<!DOCTYPE html>")
    assert "<script" not in page
    assert not re.search(r"(?:src|href)=\"https?:", page)
    for told in ("zero offset, joint_3", "2026-01-01 00:00", "a.csv", "What changed", "Predictions"):
        assert told in page
    assert page == comparison_html(plain, "2026-01-01 00:00", {"a.csv": "0" * 64})


def test_the_fragment_is_one_piece(plain):
    piece = comparison_fragment(plain)
    assert piece.startswith('<div class="thermal-robot">')
    assert piece.count("<div") == piece.count("</div>")


def test_the_largest_difference_is_drawn_first(plain):
    axes = plot_differences(plain).axes[0]
    assert axes.get_yticklabels()[0].get_text().startswith("zero offset, joint_3")
    assert abs(axes.patches[0].get_width()) > 5.0
