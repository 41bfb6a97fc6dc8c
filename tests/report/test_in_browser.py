"""The arm on a page in a browser, on a desk, a telephone and paper: it is seen, it turns, nothing is fetched."""

import json
import os
import re
import shutil
import subprocess
import threading
from functools import cache, partial
from html import unescape
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from matplotlib.image import imread

from thermal_robot.report import html

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
OPTIONS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --enable-logging=stderr --virtual-time-budget=3000"
).split()
WRAPPER = """<!DOCTYPE html><body style="margin:0"><iframe src="page.html" width="WIDTH" height="2000" style="border:0"
onload="measure(this)"></iframe><pre id="said"></pre><script>
function measure(frame) {
  const page = frame.contentDocument, root = page.documentElement;
  const width = root.clientWidth;
  const letters = [...page.querySelectorAll("p, td, dd")]
    .filter(e => e.textContent.trim()).map(e => e.getBoundingClientRect().height).filter(h => h > 0);
  const canvas = page.querySelector("#tr-arm canvas"), row = page.querySelector("[data-tr=row]");
  frame.contentWindow.requestAnimationFrame = paint => paint();
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
  document.getElementById("said").textContent = JSON.stringify(
    {seen: width, smallest: Math.min(...letters),
     filled: filled, edges: Math.max(...edges), drawings: new Set([first, turned, moved]).size, told: [told, later],
     screen: screen, paper: paper, without: caption.innerText, controls: shown});
}
</script></body>"""

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no chromium on the PATH")


class Handler(SimpleHTTPRequestHandler):
    """Serves a folder and remembers what was asked for."""

    asked: tuple[str, ...] = ()

    def do_GET(self):
        type(self).asked = (*type(self).asked, self.path)
        super().do_GET()

    def log_message(self, *_):
        """Stay quiet."""


@pytest.fixture(scope="module")
def served(tmp_path_factory, demo):
    folder = tmp_path_factory.mktemp("page")
    (folder / "page.html").write_text(html(demo), encoding="utf-8")
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield folder, f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@pytest.fixture(scope="module")
def seen(served, tmp_path_factory):
    """What the browser measures at a width, and what it complains of: looked at once."""
    return cache(lambda width: looked_at(served, width, tmp_path_factory.mktemp("profile")))


def looked_at(served, width, profile):
    folder, address = served
    (folder / f"at_{width}.html").write_text(WRAPPER.replace("WIDTH", str(width)), encoding="utf-8")
    command = [BROWSER, *OPTIONS, f"--user-data-dir={profile}", "--window-size=1600,2100", "--dump-dom"]
    env = {**os.environ, "HOME": str(profile)}
    done = subprocess.run(
        [*command, f"{address}/at_{width}.html"], capture_output=True, text=True, check=False, timeout=120, env=env
    )
    said = re.search(r'<pre id="said">(.+?)</pre>', done.stdout, flags=re.S)
    assert said, done.stderr[-2000:]
    return json.loads(unescape(said[1])), [line for line in done.stderr.splitlines() if "CONSOLE" in line]


@pytest.mark.parametrize("width", [1400, 400])
def test_the_arm_is_seen_and_turns_and_nothing_complains(seen, width):
    page, complaints = seen(width)
    assert page["seen"] <= width
    assert page["smallest"] >= 8.0, "letters of less than 8 pixels"
    assert 0.05 < page["filled"] < 0.6, "the arm fills a part of its drawing"
    assert page["edges"] < 40, "an arrow leaves the drawing"
    assert page["drawings"] == 3, "it turns, and takes the posture of another row"
    assert page["told"][0] != page["told"][1]
    assert [line for line in complaints if "favicon" not in line] == []


def test_on_paper_the_drawing_says_what_it_shows_and_offers_nothing(seen):
    page, _ = seen(1400)
    words = " ".join(page["paper"].split())
    assert page["told"][1] in words
    assert re.search(r"gap before after arrows [\d ]+ times larger", words)
    assert "Drag to turn" in page["screen"]
    assert "Drag to turn" not in words
    assert page["controls"] == 0
    assert "gap before arrows" in " ".join(page["without"].split()), "arrows that are switched off have no key"


def test_nothing_else_is_fetched(seen):
    seen(400)
    assert {re.sub(r"at_\d+", "at", path) for path in Handler.asked} <= {"/at.html", "/page.html", "/favicon.ico"}


SCROLLED = """<!DOCTYPE html><body style="margin:0"><iframe src="wide.html" width="400" height="600" style="border:0"
onload="this.contentDocument.querySelectorAll('.tr-wide')[1].scrollLeft = 9999"></iframe></body>"""


def test_a_shadow_tells_on_which_side_there_is_more(served, tmp_path):
    """Boxes that are wide, wide and scrolled to their end, and narrow: where pixels are darker than paper."""
    folder, address = served
    boxes = [f'<div class="tr-wide"><div style="width: {px}px; height: 100px"></div></div>' for px in (900, 900, 50)]
    height = 100  # of a box, pixels
    head = (folder / "page.html").read_text(encoding="utf-8").partition("<header>")[0]
    (folder / "wide.html").write_text(f"{head}{''.join(boxes)}</main></body></html>", encoding="utf-8")
    (folder / "scrolled.html").write_text(SCROLLED, encoding="utf-8")
    shot = tmp_path / "shot.png"
    command = [BROWSER, *OPTIONS, "--hide-scrollbars", f"--user-data-dir={tmp_path}", f"--screenshot={shot}"]
    env = {**os.environ, "HOME": str(tmp_path)}
    subprocess.run([*command, f"{address}/scrolled.html"], capture_output=True, check=True, timeout=120, env=env)
    dark = imread(shot)[:, :400, :3].max(axis=2) < 0.9
    top = int(np.flatnonzero(dark.any(axis=1))[0])
    first, second, third = (np.flatnonzero(dark[top + k : top + k + 90].any(axis=0)) for k in (0, height, 2 * height))
    assert first.min() > 300, "more on the right"
    assert second.max() < 100, "more on the left"
    assert not third.size
    assert not dark[top + 2 * height :].any()
