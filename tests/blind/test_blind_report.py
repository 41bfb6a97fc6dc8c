"""What text, page and figures of a blind trial's score show."""

import re

import numpy as np
import pytest
from blind_records import trial
from matplotlib.patches import Rectangle

from thermal_robot.blind.report.markdown import blind_markdown
from thermal_robot.blind.report.page import blind_html
from thermal_robot.blind.report.plots import calibration_figure, confusion_figure, shrinkage_figure
from thermal_robot.blind.report.plots_power import power_figure
from thermal_robot.blind.report.text import blind_text
from thermal_robot.blind.score import score


@pytest.fixture(scope="module")
def plain():
    return score(trial()).to_dict()


def test_the_heat_map_holds_the_counts(plain):
    axes = confusion_figure(plain, "single").axes[0]
    rows, columns = ([t.get_text() for t in a.get_ticklabels()] for a in (axes.yaxis, axes.xaxis))
    assert rows == ["backlash", "drift", "nothing", "not in any library"]
    assert columns == ["backlash", "drift", "joint gain", "nothing", "unexplained", "no answer"]
    cells = {t.get_position()[::-1]: int(t.get_text()) for t in axes.texts if t.get_ha() == "center"}
    assert cells == {(0, 4): 1, (0, 5): 1, (1, 0): 1, (1, 1): 1, (2, 2): 1, (2, 3): 1, (3, 4): 1}
    assert [t.get_text() for t in axes.texts if t.get_ha() == "left"] == ["2", "2", "2", "1", "cases"]
    patches = [p for p in axes.patches if isinstance(p, Rectangle)]
    shares = np.array([p.get_facecolor()[3] for p in patches]).reshape(4, 6)
    assert np.all(shares.sum(axis=1) == 1.0)
    framed = [k for k, p in enumerate(patches) if p.get_linewidth() == 1.0]
    assert framed == [0, 7, 15, 22]  # what would have been right
    framed = [p.get_linewidth() for p in confusion_figure(plain, "removed").axes[0].patches]
    assert framed == [0.5, 1.0]
    assert len(confusion_figure(plain, "nowhere").axes[0].patches) == 0


def test_the_reliability_diagram_holds_the_bins(plain):
    upper, lower = calibration_figure(plain).axes
    points = next(line for line in upper.lines if line.get_marker() == "o")
    bins = [b for b in plain["calibration"]["all"]["bins"] if b["present"]["trials"]]
    assert points.get_xydata() == pytest.approx(
        np.array([[100 * b["mean"], 100 * b["present"]["value"]] for b in bins]), abs=1e-9
    )
    heights = [p.get_height() for p in lower.patches]
    assert heights == [b["present"]["trials"] for b in plain["calibration"]["all"]["bins"]]
    assert [t.get_text() for t in lower.texts] == [str(int(h)) for h in heights if h]


def test_the_power_figure_holds_rates_and_curve(plain):
    left, right = power_figure(plain).axes
    for axes, steps in ((left, "ratio"), (right, "samples")):
        rates = [s["found"] for s in plain["detection"][steps] if s["found"]["trials"]]
        points = next(line for line in axes.lines if line.get_marker() == "o")
        assert points.get_ydata() == pytest.approx([100 * r["value"] for r in rates])
        assert [t.get_text() for t in axes.texts if t.get_ha() == "center"] == [str(r["trials"]) for r in rates]
        bars = [tuple(x.get_ydata()) for x in axes.lines if x.get_marker() == "None" and len(x.get_ydata()) == 2]
        bars = [bar for bar in bars if np.ptp(bar)]
        assert np.ravel(bars) == pytest.approx(100 * np.ravel([r["interval"] for r in rates]))
    drawn = [line.get_ydata() for line in left.lines if len(line.get_ydata()) > 10]
    wanted = [100 * np.array(line["chance"]) for line in plain["detection"]["curve"]["over_ratio"]]
    assert np.array(drawn) == pytest.approx(np.array(wanted))


def test_the_shrinkage_figure_holds_the_pairs(plain):
    axes = shrinkage_figure(plain).axes[0]
    drawn = np.vstack([line.get_xydata() for line in axes.lines if line.get_marker() not in ("None", None)])
    pairs = plain["shrinkage"]["pairs"]
    assert len(pairs) == 11
    wanted = sorted((100 * (1 - p["claimed"]), 100 * (1 - p["real"])) for p in pairs)
    assert np.array(sorted(map(tuple, drawn))) == pytest.approx(np.array(wanted))
    names = [t.get_text() for t in axes.get_legend().get_texts()]
    assert names == ["known effect at work (7)", "cause withheld (3)", "real campaign (1)"]


def test_the_page_stands_alone_and_trusts_no_name(plain):
    page = blind_html(plain, "today")
    assert page.count("<svg") == 6
    assert "&lt;geometric&gt;" in page
    assert "<geometric>" not in page
    assert "Blind trial: 6 of 12 cases answered rightly" in page
    assert not re.search(r'(?:href|src)="(?!#)', page)
    assert "http" not in page


def test_text_and_table_say_the_same(plain):
    said_ = blind_text(plain)
    assert "exactly what is at work, nothing else" in said_
    assert re.search(r"one effect, 4 cases, 1 failed\n.*1 of 4 +25\.0 % +4\.6 to 69\.9 %", said_)
    assert "| one effect | 4 | exactly what is at work, nothing else | 1 of 4 | 25.0 % | 4.6 to 69.9 % |" in (
        blind_markdown(plain)
    )
    assert re.search(r"1 backlash +· +· +· +· +1 +1", said_)
    assert re.search(r"a4 +single +ur3 +backlash → the diagnosis failed: late", said_)
