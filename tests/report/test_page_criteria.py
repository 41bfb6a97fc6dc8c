"""The page's section on ISO 9283: a heading of its own, and the figures of the printed tables in styled ones."""

import re
from dataclasses import replace
from html import unescape

from thermal_robot.report import html, html_parts
from thermal_robot.report.page import criteria_section


def tables(page):
    """Tables of a page: rows of cells as plain text."""
    return [
        [
            [unescape(re.sub(r"<[^>]+>", "", cell)) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)]
            for row in table.split("<tr")[1:]
        ]
        for table in re.findall(r"<table>(.*?)</table>", page)
    ]


def test_the_tables_are_those_that_are_printed(case):
    found = case("repeated").performance
    page = "".join(criteria_section(case("repeated")))
    printed = [line.split() for line in str(found).splitlines()]
    shown = tables(page)
    assert [t[0][0] for t in shown] == ["pose", "pose", "pose", "pose", "path", "path"]
    assert all(row in printed for table in shown for row in table)
    assert ["P1", "30", "3", "0.701", "0.040"] == shown[0][1][:5]
    assert "<pre" not in page
    assert "Fewer cycles than the standard" in page


def test_the_section_has_a_heading_and_stands_with_repeats_alone(case, monkeypatch):
    monkeypatch.setattr(html_parts, "_svg", lambda drawn, label: "<svg></svg>")
    assert "<h2>ISO 9283</h2>" in html(case("repeated"))
    assert "ISO 9283" not in html(case("found"))
    assert list(criteria_section(case("found"))) == []


def test_no_label_gets_out_of_its_cell_and_the_rest_is_counted(case):
    base = case("repeated")
    many = tuple(replace(base.performance.poses[1], pose=f"<b>{k}") for k in range(45))
    page = "".join(criteria_section(replace(base, performance=replace(base.performance, poses=many, paths=()))))
    assert "<b>" not in page
    assert "<td>&lt;b&gt;39</td>" in page
    assert page.count("and 5 more, in the JSON and the CSV.") == 1
