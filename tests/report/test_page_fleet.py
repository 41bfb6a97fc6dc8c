"""A fleet as a page: all of it, nothing but itself, and names that are no HTML."""

import re

from report.fleets import EMPTY, SUMMARY
from report.looking import outside, overlapping, texts

from thermal_robot.report import fleet_html
from thermal_robot.report.page_campaigns import plot_fleet


def test_it_holds_every_line_and_escapes_names():
    page = fleet_html(SUMMARY, "then")
    for said in ("<h1>30 campaigns of 29 robots", "hall 2", "fore_arm", "arm_07", "arm_19", "&lt;nonsense&gt;", "then"):
        assert said in page
    assert "<nonsense>" not in page
    assert re.findall(r"(?:https?:)?//[\w.]+", page) == []
    assert page.count("<section>") == page.count("</section>") == 8


def test_equal_summaries_give_equal_pages():
    assert fleet_html(SUMMARY) == fleet_html(SUMMARY)


def test_a_fleet_of_failures_has_a_page():
    page = fleet_html(EMPTY)
    assert page.count("<section>") == 1
    assert "<svg" not in page


def test_no_text_of_its_figure_leaves_it_or_meets_another():
    effects = [
        {"effect": f"effect_{k}", "found": 28 - 2 * k, "testable": 28, "places": {}, "parameters": True}
        for k in range(14)
    ]
    figure = plot_fleet({**SUMMARY, "effects": effects})
    said = texts(figure)
    assert len(said) > 10
    assert outside(figure, said) == []
    assert overlapping(said) == []
