"""What the figure of detection shows."""

import numpy as np
import pytest
from blind_records import effect, record, said, trial

from thermal_robot.blind.report.page import power_figure
from thermal_robot.blind.score import score


@pytest.fixture(scope="module")
def plain():
    return score(trial()).to_dict()


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


def test_a_step_without_an_upper_bound_ends_in_the_drawing():
    cases = [
        record("single", said(effect("drift")), ["drift"], {"drift": 50.0}, samples=1000),
        record("single", said(), ["drift"], {"drift": 7.0}, samples=300),
    ]
    for axes, low in zip(power_figure(score(cases).to_dict()).axes, (6.0, 200.0), strict=True):
        step = next(line for line in axes.lines if len(line.get_xdata()) == 2 and np.ptp(line.get_xdata()))
        assert step.get_xdata()[0] == low
        assert step.get_xdata()[1] < axes.get_xlim()[1] < 2.0 * low
        assert np.array_equal(step.get_ydata(), [50.0, 50.0])


def test_without_cases_it_says_so():
    left, right = power_figure(score([]).to_dict()).axes
    for axes in (left, right):
        assert [t.get_text() for t in axes.texts] == ["No case with one effect of known size."]
        assert not axes.lines
