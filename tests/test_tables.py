"""How results are put into words: shares in per cent, tables, and who tells."""

from html.parser import HTMLParser

import pytest

from thermal_robot import teller
from thermal_robot.percents import percent
from thermal_robot.tables import aligned, html_table


@pytest.mark.parametrize(
    ("share", "decimals", "told"),
    [
        (0.5, 1, "50.0 %"),
        (0.126, 0, "13 %"),
        (-0.031, 1, "−3.1 %"),
        (-0.0003, 1, "0.0 %"),
        (-0.004, 0, "0 %"),
        (0.9996, 1, "99.96 %"),
        (0.996, 0, "99.6 %"),
        (0.99999999, 0, "> 99.9999 %"),
        (1.0 - 1e-14, 1, "100.0 %"),
        (1.0, 0, "100 %"),
        (float("nan"), 1, "–"),
        (None, 1, "–"),
    ],
)
def test_a_share_is_written(share, decimals, told):
    assert percent(share, decimals) == told


class Cells(HTMLParser):
    """Collects the text of every cell, row by row."""

    def __init__(self):
        super().__init__()
        self.rows, self.tags = [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.rows:
            self.rows[-1][-1] += data


def read(html):
    cells = Cells()
    cells.feed(html)
    return cells


def test_cells_are_read_back_as_they_were_and_shorter_rows_filled_up():
    rows = [("a", "1 < 2 & 3"), ("<script>alert(1)</script>", '"quoted"')]
    shown = read(html_table(rows, head=("name", "value")))
    assert shown.rows == [["name", "value"], *map(list, rows)]
    assert "script" not in shown.tags
    assert [len(row) for row in read(html_table([("a",), ("b", "c", "d")])).rows] == [3, 3]


def test_columns_of_plain_text_stand_below_each_other():
    rows = [("name", "mm", "why"), ("a", "0.1", ""), ("longer", "12.5", "x")]
    assert aligned(rows, left=(0, 2)) == ["name      mm  why", "a        0.1", "longer  12.5  x"]


def test_the_last_one_registered_counts(monkeypatch):
    monkeypatch.setattr(teller, "_tellers", [])
    with pytest.raises(RuntimeError, match="import thermal_robot, or call told_by"):
        teller.registered()
    first, last = object(), object()
    teller.told_by(first)
    assert teller.registered() is first
    teller.told_by(last)
    assert teller.registered() is last
