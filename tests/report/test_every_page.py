"""Every kind of page on a desk, on a telephone and on paper: nothing is cut, nothing complains, nothing is heavy."""

import shutil
import subprocess
import unicodedata
from collections import Counter

import pytest
from report import every_page
from report.browser import PROGRAM, Browser
from report.every_page import ALIKE, EVERY, page

from thermal_robot import report
from thermal_robot.report import html

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
KINDS = [pytest.param(kind, marks=[pytest.mark.slow] * (kind in ALIKE)) for kind in EVERY]
LONG = 60  # letters: what is longer may stand on two sheets

needs_browser = pytest.mark.skipif(PROGRAM is None, reason="no chromium on the PATH")
needs_reader = pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no pdftotext on the PATH")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    made = Browser(tmp_path_factory.mktemp("profile"))
    yield made
    made.close()


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


def looked_at(browser, shown, tmp_path):
    """What is wrong with a page at each width and on paper."""
    file, wrong = tmp_path / "page.html", {}
    file.write_text(shown, encoding="utf-8")
    for width in (1400, 400):
        browser.open(file, width)
        wrong[width] = browser.value(CUT), browser.complaints
    browser.open(file, 1400)
    browser.call("Emulation.setEmulatedMedia", media="print")
    wrong["A4"] = missing(browser.value(TEXTS), browser.pdf()) if shutil.which("pdftotext") else [], []
    return {where: found for where, found in wrong.items() if any(found)}


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
def test_nothing_is_cut_of_a_page_with_the_arm(browser, demo, tmp_path):
    assert looked_at(browser, html(demo), tmp_path) == {}


@needs_browser
@needs_reader
def test_what_is_cut_is_noticed(browser, tmp_path):
    """A line that is too long for its box, a box that is too broad, a column beyond the sheet, an error."""
    spoilt = {
        '<p style="width: 5rem; overflow: hidden; white-space: nowrap">a line that is far too long</p>': {1400, 400},
        '<div style="width: 3000px">broad<b style="float: right">gone_from_paper</b></div>': {1400, 400, "A4"},
        '<img src="http://127.0.0.1:9/none.png" alt="">': {1400, 400},
    }
    shown = page("misfit")
    for wrong, where in spoilt.items():
        assert set(looked_at(browser, shown.replace("</header>", f"{wrong}</header>"), tmp_path)) == where


def test_the_first_page_says_whose_robot_it_is():
    shown = page("found")
    head = shown[shown.index("<header>") : shown.index("</header>")]
    for name, said in (("Robot serial", "20185500123"), ("Operator", "A. Novak"), ("Date", "2026-11-26")):
        assert f"<dt>{name}</dt><dd>{said}</dd>" in head
    assert "about      robot serial 20185500123" in report.text(every_page.EVERY["found"][1]())
