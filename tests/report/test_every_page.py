"""Every kind of page on a desk, on a telephone and on paper: nothing is cut, nothing complains, nothing is heavy."""

import io
import re
import shutil
import subprocess
import unicodedata
from collections import Counter
from html import unescape

import numpy as np
import pytest
from motion.found import found
from report.browser import PROGRAM
from report.cases import CASES
from report.every_page import EVERY, FEW, page
from report.looking import texts
from wear_cases import by_hand

from thermal_robot import report
from thermal_robot.report import html, plots
from thermal_robot.report.page import svg
from thermal_robot.report.pdf import write_page

HEAVIEST = 3e6  # Bytes
SMALLEST = 7.0  # pixels of a letter of 8 points in a figure on a telephone
CUT = """(() => {
  const root = document.documentElement, found = [], small = innerWidth < 600;
  const seen = e => e.checkVisibility() && e.getBoundingClientRect().width > 0;
  const name = e => `${e.tagName}.${e.getAttribute("class")} ${e.textContent.trim().slice(0, 40)}`;
  if (root.scrollWidth > root.clientWidth) found.push("the page scrolls sideways");
  for (const e of document.querySelectorAll("main *")) {
    if (e.closest("svg, canvas, option") || !seen(e)) continue;
    const box = e.getBoundingClientRect(), scroller = e.closest(".tr-wide");
    if (scroller && scroller !== e) continue;
    if (box.right > root.clientWidth + 1 || box.left < -1) found.push(`outside: ${name(e)}`);
    if (e.clientWidth && e.scrollWidth > e.clientWidth + 1 && !(small && scroller)) found.push(`cut: ${name(e)}`);
  }
  for (const e of document.querySelectorAll("main code"))
    if (!e.closest("footer") && e.getClientRects().length > 1) found.push(`broken: ${name(e)}`);
  for (const figure of document.querySelectorAll("svg.tr-figure")) {
    if (!seen(figure)) continue;
    const box = figure.getBoundingClientRect();
    if (small && !figure.closest(".tr-wide") && 8 * box.width / figure.viewBox.baseVal.width < SMALLEST)
      found.push(`small letters: ${figure.ariaLabel}`);
    const out = [...figure.querySelectorAll("g[transform*=scale] > use")].map(e => e.getBoundingClientRect())
      .filter(r => r.right > box.right + 1 || r.left < box.left - 1 || r.bottom > box.bottom + 1)
      .length;
    if (out) found.push(`letters leave the figure: ${figure.ariaLabel}`);
  }
  return found;
})()""".replace("SMALLEST", str(SMALLEST))
TEXTS = """(() => {
  const walk = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT), found = [];
  while (walk.nextNode()) {
    const e = walk.currentNode.parentElement;
    if (!e.closest("svg, script, style") && e.checkVisibility() && walk.currentNode.data.trim())
      found.push(walk.currentNode.data);
  }
  return found;
})()"""
KINDS = [pytest.param(kind, marks=[pytest.mark.slow] * (kind not in FEW)) for kind in EVERY]


def views_of(figure):
    """Left, top, width and height of each view of a figure, inches."""
    return [
        [float(side) / 72.0 for side in view.split()]
        for view in re.findall(r'tr-part"[^>]*viewBox="([^"]+)"', str(svg(figure, "a figure")))
    ]


LONG = 60  # letters: what is longer may stand on two sheets

needs_browser = pytest.mark.skipif(PROGRAM is None, reason="no chromium on the PATH")
needs_reader = pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no pdftotext on the PATH")


def bare(text):
    """A text without blanks, as letters that a reader of PDF gives back."""
    return "".join(unicodedata.normalize("NFKC", text).replace("\u2060", "").split()).casefold()


def missing(texts, pdf):
    """Those of the texts that a PDF has not, or not as often."""
    done = subprocess.run(["pdftotext", "-raw", "-", "-"], input=pdf, capture_output=True, check=True)
    told, counts = bare(done.stdout.decode()), Counter(map(bare, texts))
    lost = [text for text, count in counts.items() if len(text) <= LONG and told.count(text) < count]
    words = {bare(word) for text in texts if len(bare(text)) > LONG for word in text.split()}
    return lost + [word for word in words if len(word) < LONG and word not in told]


def empty(pdf, least=0.6):
    """Sheets before the last that are used to less than a share of their height, between margins of 15 mm.

    By default two fifths may be blank: a figure that does not fit, with its heading, is no higher.
    """
    sheets, found = list(drawn(pdf)), []
    for number, sheet in enumerate(sheets[:-1], 1):
        edge = round(len(sheet) * 15 / 297)
        used = np.flatnonzero((sheet[edge:-edge] < 250).any(axis=1)).max(initial=0) / (len(sheet) - 2 * edge)
        if used < least:
            found.append(f"sheet {number} of {len(sheets)} is used to {100 * used:.0f} %")
    return found


def drawn(pdf):
    """Sheets of a PDF in grey, 30 pixels an inch."""
    done = subprocess.run(["pdftoppm", "-gray", "-r", "30", "-"], input=pdf, capture_output=True, check=True)
    stream = io.BytesIO(done.stdout)
    while stream.readline():
        wide, high = map(int, stream.readline().split())
        stream.readline()
        yield np.frombuffer(stream.read(wide * high), np.uint8).reshape(high, wide)


def looked_at(browser, shown, tmp_path):
    """What is wrong with a page at each width and on paper."""
    file, wrong = tmp_path / "page.html", {}
    file.write_text(shown, encoding="utf-8")
    for width in (1400, 400):
        browser.open(file, width)
        wrong[width] = browser.value(CUT), browser.complaints
    browser.open(file, 1400)
    browser.call("Emulation.setEmulatedMedia", media="print")
    paper = browser.pdf()
    wrong["A4"] = [*missing(browser.value(TEXTS), paper), *empty(paper)] if shutil.which("pdftotext") else [], []
    return {where: found for where, found in wrong.items() if any(found)}


@pytest.mark.slow
def test_a_telephone_sees_every_text_of_a_figure_in_columns():
    """Each text of it stands whole in one of the views that a telephone is shown."""
    d = CASES["repeated"]()
    for figure in (plots.plot_where(d), plots.plot_map(d), plots.plot_wear(by_hand()), plots.plot_motions(found())):
        views, high = views_of(figure), figure.get_figheight()
        assert len(views) > 1
        for text, box in texts(figure):
            left, bottom, right, top = (side / figure.dpi for side in box.extents)
            shown = any(
                x - 0.01 <= left and right <= x + w + 0.01 and y - 0.01 <= high - top and high - bottom <= y + h + 0.01
                for x, y, w, h in views
            )
            assert shown, text


def test_every_function_that_writes_a_page_is_looked_at():
    written = {name for name in report.__all__ if name.endswith("html")}
    assert {write.__name__ for write, _ in EVERY.values()} >= written


@needs_browser
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_cut_at_any_width_and_nothing_complains(browser, kind, tmp_path):
    shown = page(kind)
    assert len(shown.encode()) <= HEAVIEST
    assert looked_at(browser, shown, tmp_path) == {}


@needs_browser
@needs_reader
def test_nothing_is_cut_of_a_page_with_the_arm(browser, demo, tmp_path):
    assert looked_at(browser, html(demo), tmp_path) == {}
    assert empty(browser.pdf(), least=2 / 3) == []


@needs_browser
@needs_reader
def test_what_is_cut_is_noticed(browser, tmp_path):
    """A line too long for its box, a box too broad, a column beyond the sheet, an option that breaks, an error."""
    spoilt = {
        '<p style="width: 5rem; overflow: hidden; white-space: nowrap">a line that is far too long</p>': {
            1400,
            400,
            "A4",
        },
        '<div style="width: 3000px">broad<b style="float: right">gone_from_paper</b></div>': {1400, 400, "A4"},
        '<img src="http://127.0.0.1:9/none.png" alt="">': {1400, 400},
        '<p style="font-family: monospace; width: 8ch"><code style="white-space: normal">--without</code></p>': {
            1400,
            400,
        },
    }
    shown = page("misfit")
    for wrong, where in spoilt.items():
        assert set(looked_at(browser, shown.replace("</header>", f"{wrong}</header>"), tmp_path)) == where


@needs_reader
@pytest.mark.parametrize("kind", ["misfit", *(pytest.param(k, marks=pytest.mark.slow) for k in EVERY if k != "misfit")])
def test_a_pdf_holds_every_cell(kind, tmp_path):
    pytest.importorskip("weasyprint", exc_type=(ImportError, OSError))
    shown = page(kind)
    write_page(tmp_path / "r.pdf", shown)
    body = re.sub(r"(?s)<(svg|script|style).*?</\1>", "", shown[shown.index("<main") :])
    told = [unescape(text) for text in re.findall(r">([^<>]+)<", body) if text.strip()]
    assert missing(told, (tmp_path / "r.pdf").read_bytes()) == []
