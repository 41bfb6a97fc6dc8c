"""The pieces of a page: text is escaped, nothing is drawn of nothing."""

import base64
import hashlib
import re
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest

from thermal_robot.report import html_parts
from thermal_robot.report.drawing import Drawing
from thermal_robot.report.html_parts import bullets, checksums, css, document, figure, paragraph, row, signature, table

UGLY = "<script>&\"'"
SAFE = "&lt;script&gt;&amp;&quot;&#x27;"


def test_text_is_escaped_wherever_it_stands():
    for piece in (paragraph(UGLY), paragraph(UGLY, strong=True), bullets([UGLY]), document(UGLY, "")):
        assert SAFE in piece
        assert "<script" not in piece


def test_a_list_of_nothing_is_nothing():
    assert bullets(()) == ""
    assert bullets(iter(["one", "two"])) == "<ul><li>one</li><li>two</li></ul>"


def test_a_document_holds_its_title_its_style_and_its_body():
    page = document("A title", "<p>text</p>")
    assert page.startswith("<!DOCTYPE html>")
    assert "<title>A title</title>" in page
    assert css("page.css") in page
    assert css("page_whole.css") in page
    assert page.index("</style>") < page.index("<p>text</p>") < page.index("</main>")


def test_a_figure_says_what_it_shows():
    drawn = figure(Drawing(1.0, 1.0), "a bend")
    assert drawn.startswith('<figure><div class="tr-wide" role="region"')
    assert drawn.endswith("</svg></div></figure>")
    assert 'aria-label="a bend"' in drawn


def test_the_signature_names_program_version_and_date():
    assert signature("1 May").startswith("thermal-robot ")
    assert f"numpy {np.__version__}" in signature(None)
    assert signature("1 May") == f"{signature(None)}, 1 May"
    assert signature("") == signature(None)


def test_a_source_tree_that_is_not_installed_signs_without_a_version(monkeypatch):
    def absent(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr(html_parts, "version", absent)
    assert signature("1 May") == "thermal-robot, 1 May"


def test_a_style_sheet_that_does_not_exist_is_an_error():
    with pytest.raises(FileNotFoundError):
        css("nothing.css")


def test_a_document_lets_the_browser_run_its_own_script_alone():
    code = "document.title = '1';"
    page = document("A title", "<p>text</p>", code)
    allowed = base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()
    assert f"script-src 'sha256-{allowed}'" in page
    assert page.count("<script") == 1
    assert "script-src 'none'" in document("A title", "<p>text</p>")


def test_checksums_stand_beside_the_names_of_their_files():
    assert checksums({}) == ""
    assert checksums({"a<b.csv": "0a1b"}).endswith("<li>a&lt;b.csv <code>0a1b</code></li></ul>")


def test_a_table_keeps_its_cells_in_order_and_numbers_to_the_right():
    made = table(("name", "cases"), [row(("one", "1")), row(("two", UGLY))])
    assert re.findall(r"<t[hd](?: [^>]*)?>([^<]*)<", made) == ["name", "cases", "one", "1", "two", SAFE]
    assert made.count("<tr>") == 3
    assert made.count("tr-n") == 3
    assert "tr-n" not in table(("name", "said"), [row(("one", "two"), words=2)], words=2)
    assert row(("1", "2"), words=0).count("tr-n") == 2
    assert SAFE in table((UGLY,), [])
