"""Tables of a notebook: every cell is shown as the text that it is."""

from html.parser import HTMLParser

from thermal_robot.tables import html_table


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


def test_cells_are_read_back_as_they_were():
    rows = [("a", "1 < 2 & 3"), ("<script>alert(1)</script>", '"quoted"')]
    shown = read(html_table(rows, head=("name", "value")))
    assert shown.rows == [["name", "value"], *map(list, rows)]
    assert "script" not in shown.tags


def test_shorter_rows_are_filled_up():
    assert [len(row) for row in read(html_table([("a",), ("b", "c", "d")])).rows] == [3, 3]
