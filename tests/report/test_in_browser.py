"""The arm on a page in a browser, on a desk, a telephone and paper: it is seen, it turns, nothing is fetched."""

import re
from functools import cache
from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread
from report.browser import PROGRAM

from thermal_robot.report import html

MEASURED = """(() => {
  const page = document, width = page.documentElement.clientWidth;
  const letters = [...page.querySelectorAll("p, td, dd")]
    .filter(e => e.textContent.trim()).map(e => e.getBoundingClientRect().height).filter(h => h > 0);
  const canvas = page.querySelector("#tr-arm canvas"), row = page.querySelector("[data-tr=row]");
  window.requestAnimationFrame = paint => paint();
  const painted = () => canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data
    .reduce((sum, value, k) => sum + (k % 4 === 3 && value > 0), 0) / (canvas.width * canvas.height);
  /* strongest colour along the edges of the drawing, however it is turned; paper and floor are grey */
  const copy = page.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const pen = copy.getContext("2d", {willReadFrequently: true}), edges = [];
  const inked = () => {
    pen.clearRect(0, 0, copy.width, copy.height);
    pen.drawImage(canvas, 0, 0);
    const strips = [[0, 0, copy.width, 2], [0, copy.height - 2, copy.width, 2], [0, 0, 2, copy.height],
      [copy.width - 2, 0, 2, copy.height]].map(strip => pen.getImageData(...strip).data);
    return Math.max(...strips.map(d => d.reduce(
      (most, v, k) => k % 4 || d[k + 3] < 60 ? most : Math.max(most, Math.abs(v - d[k + 2])), 0)));
  };
  for (const key of ["ArrowUp", "ArrowDown"])
    for (let k = 0; k < 63; k++) {
      canvas.dispatchEvent(new KeyboardEvent("keydown", {key: k < 20 ? key : "ArrowLeft"}));
      edges.push(inked());
    }
  page.querySelector("[data-tr=reset]").click();
  const first = canvas.toDataURL(), told = page.querySelector("[data-tr=told]").textContent, filled = painted();
  canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
  const turned = canvas.toDataURL();
  row.value = 7;
  row.dispatchEvent(new Event("input"));
  const moved = canvas.toDataURL(), later = page.querySelector("[data-tr=told]").textContent;
  const caption = page.querySelector("#tr-arm"), screen = caption.innerText;
  const rules = [...page.styleSheets].flatMap(sheet => [...sheet.cssRules]).filter(r => r.media?.mediaText === "print");
  page.head.append(Object.assign(page.createElement("style"),
    {textContent: rules.flatMap(r => [...r.cssRules]).map(r => r.cssText).join(" ")}));
  const paper = caption.innerText, shown = [...page.querySelectorAll("#tr-arm input, #tr-arm button")]
    .filter(e => e.getBoundingClientRect().width > 0).length;
  page.querySelector("[data-tr=after]").click();
  return {seen: width, smallest: Math.min(...letters),
    filled: filled, edges: Math.max(...edges), drawings: new Set([first, turned, moved]).size, told: [told, later],
    screen: screen, paper: paper, without: caption.innerText, controls: shown};
})()"""

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="no chromium on the PATH")


@pytest.fixture(scope="module")
def file(tmp_path_factory, demo):
    made = tmp_path_factory.mktemp("page") / "page.html"
    made.write_text(html(demo), encoding="utf-8")
    return made


@pytest.fixture(scope="module")
def seen(file, browser):
    """What the browser measures at a width, what it complains of, and what it fetched: looked at once."""

    @cache
    def seen(width):
        browser.open(file, width, 2000)
        return browser.value(MEASURED), browser.complaints, browser.fetched

    return seen


@pytest.mark.parametrize("width", [1400, 400])
def test_the_arm_is_seen_and_turns_and_nothing_complains(seen, width):
    page, complaints, _ = seen(width)
    assert page["seen"] <= width
    assert page["smallest"] >= 8.0, "letters of less than 8 pixels"
    assert 0.05 < page["filled"] < 0.6, "the arm fills a part of its drawing"
    assert page["edges"] < 40, "an arrow leaves the drawing"
    assert page["drawings"] == 3, "it turns, and takes the posture of another row"
    assert page["told"][0] != page["told"][1]
    assert complaints == []


def test_on_paper_the_drawing_says_what_it_shows_and_offers_nothing(seen):
    page, *_ = seen(1400)
    words = " ".join(page["paper"].split())
    assert page["told"][1] in words
    assert re.search(r"gap before after arrows [\d ]+ times larger", words)
    assert "Drag to turn" in page["screen"]
    assert "Drag to turn" not in words
    assert page["controls"] == 0
    assert "gap before arrows" in " ".join(page["without"].split()), "arrows that are switched off have no key"


def test_nothing_else_is_fetched(seen, file):
    assert seen(400)[2] == {file.as_uri()}


def test_a_shadow_tells_on_which_side_there_is_more(file, browser, tmp_path):
    """Boxes that are wide, wide and scrolled to their end, and narrow: where pixels are darker than paper."""
    boxes = [f'<div class="tr-wide"><div style="width: {px}px; height: 100px"></div></div>' for px in (900, 900, 50)]
    height = 100  # of a box, pixels
    head = file.read_text(encoding="utf-8").partition("<header>")[0]
    (tmp_path / "wide.html").write_text(f"{head}{''.join(boxes)}</main></body></html>", encoding="utf-8")
    browser.open(tmp_path / "wide.html", 400, 600)
    browser.value("document.querySelectorAll('.tr-wide')[1].scrollLeft = 9999")
    dark = imread(BytesIO(browser.picture()))[:, :, :3].max(axis=2) < 0.9
    top = int(np.flatnonzero(dark.any(axis=1))[0])
    first, second, third = (np.flatnonzero(dark[top + k : top + k + 90].any(axis=0)) for k in (0, height, 2 * height))
    assert first.min() > 300, "more on the right"
    assert second.max() < 100, "more on the left"
    assert not third.size
    assert not dark[top + 2 * height :].any()
