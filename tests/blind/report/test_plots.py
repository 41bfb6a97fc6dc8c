"""What the figures of a blind trial's score show."""

import numpy as np
import pytest
from blind_records import effect, record, said, trial
from matplotlib.patches import Rectangle

from thermal_robot.blind.report.page import calibration_figure, confusion_figure, shrinkage_figure
from thermal_robot.blind.score import score


@pytest.fixture(scope="module")
def plain():
    return score(trial()).to_dict()


@pytest.fixture(scope="module")
def calibrated():
    found = said(effect("drift", 0.64), effect("backlash", 0.21), effect("joint_gain", 0.02), effect("geometric", 0.66))
    return score([record("mixed", found, ["drift"]), record("mixed", found, ["geometric"])]).to_dict()


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


def test_the_reliability_diagram_holds_the_bins(calibrated):
    plain = calibrated
    upper, lower = calibration_figure(plain).axes
    points = next(line for line in upper.lines if line.get_marker() == "o")
    bins = [b for b in plain["calibration"]["all"]["bins"] if b["present"]["trials"]]
    assert points.get_xydata() == pytest.approx(
        np.array([[100 * b["mean"], 100 * b["present"]["value"]] for b in bins]), abs=1e-9
    )
    heights = [p.get_height() for p in lower.patches]
    assert heights == [b["present"]["trials"] for b in plain["calibration"]["all"]["bins"]]
    assert [t.get_text() for t in lower.texts] == [str(int(h)) for h in heights if h]


def test_the_shrinkage_figure_holds_the_pairs(plain):
    axes = shrinkage_figure(plain).axes[0]
    drawn = np.vstack([line.get_xydata() for line in axes.lines if line.get_marker() not in ("None", None)])
    pairs = plain["shrinkage"]["pairs"]
    assert len(pairs) == 11
    wanted = sorted((100 * (1 - p["claimed"]), 100 * (1 - p["real"])) for p in pairs)
    assert np.array(sorted(map(tuple, drawn))) == pytest.approx(np.array(wanted))
    names = [t.get_text() for t in axes.get_legend().get_texts()]
    assert names == ["known effect at work (7)", "cause withheld (3)", "real campaign (1)"]


def test_the_bars_of_the_reliability_diagram_are_the_intervals(calibrated):
    plain = calibrated
    upper, _ = calibration_figure(plain).axes
    bins = [b["present"] for b in plain["calibration"]["all"]["bins"] if b["present"]["trials"]]
    bars = [line.get_ydata() for line in upper.lines if len(set(line.get_xdata())) == 1 and len(line.get_xdata()) == 2]
    assert np.array(bars) == pytest.approx(100.0 * np.array([b["interval"] for b in bins]))
    ideal = next(line for line in upper.lines if line.get_linestyle() == "--")
    assert np.array_equal(ideal.get_xdata(), ideal.get_ydata())
    assert any("calibration error" in t.get_text() for t in upper.texts)


def test_what_vanishes_is_drawn_at_the_edge_and_growth_within_the_frame(plain):
    pairs = [
        {"id": "c1", "kind": "single", "claimed": 1.0, "real": 0.9},
        {"id": "c2", "kind": "single", "claimed": 0.99, "real": -3.0},
    ]
    axes = shrinkage_figure({"shrinkage": {"pairs": pairs, "median_absolute_difference": 0.1}}).axes[0]
    points = np.vstack([line.get_xydata() for line in axes.lines if line.get_marker() == "o"])
    assert points == pytest.approx(np.array([[0.01, 10.0], [1.0, 400.0]]))
    assert axes.get_xlim() == axes.get_ylim()
    assert axes.get_xlim()[0] < 0.01
    assert axes.get_ylim()[1] > 400.0


def test_without_cases_each_figure_says_so():
    plain = score([]).to_dict()
    for figure in (calibration_figure(plain), confusion_figure(plain), shrinkage_figure(plain)):
        (axes,) = figure.axes
        assert not axes.lines
        assert any(t.get_text().startswith("No ") for t in axes.texts)
