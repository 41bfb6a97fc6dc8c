"""The score of a blind trial as text, as Markdown, as a page with figures, and the words that they share."""

import re
from typing import get_args

import numpy as np
import pytest
from blind_records import effect, record, said, trial, trial_of_several
from matplotlib.patches import Rectangle
from report.looking import overlapping, texts
from report.test_page import headings

from thermal_robot.blind.cases import Kind
from thermal_robot.blind.judged import HEADLINE
from thermal_robot.blind.report import text as words
from thermal_robot.blind.report.page import (
    calibration_figure,
    confusion_figure,
    html,
    power_figure,
    shrinkage_figure,
)
from thermal_robot.blind.report.text import effect as called
from thermal_robot.blind.report.text import facts, interval, kind, markdown, miss, needed, question, text
from thermal_robot.blind.score import score


@pytest.fixture(scope="module")
def plain():
    return score(trial())


@pytest.fixture(scope="module")
def page(plain):
    return html(plain, "today")


@pytest.fixture(scope="module")
def several():
    return score([*trial(), *trial_of_several()])


@pytest.fixture(scope="module")
def empty():
    return score([])


# ---- words


def test_every_kind_and_the_question_that_decides_it_have_words():
    for name in get_args(Kind):
        assert kind(name) != name
        said = question(HEADLINE[name], name)
        assert "_" not in said
        assert said != HEADLINE[name]
    assert set(words.KINDS) == set(get_args(Kind))
    # the same question means something else where nothing is at work
    assert question("exact", "null") != question("exact", "single") == question("exact")
    assert (called("tracking_lag"), called("geometric")) == ("tracking lag", "link geometry")
    assert (kind("strange"), question("strange")) == ("strange", "strange")


def test_rates_steps_and_coefficients_are_written():
    rate = {"successes": 20, "trials": 22, "interval": (0.722, 0.975)}
    assert words.count(rate) == "20 of 22"
    assert (interval(rate), interval({**rate, "interval": None})) == ("72.2 to 97.5 %", "")
    assert words.step({"low": 0.5, "high": 0.7}) == "0.5 to 0.7"
    assert words.step({"low": 200, "high": None}) == "200 and more"
    curve = {"intercept": -8.04, "ratio": 3.0, "samples": 2.0, "std": (0.3, 0.12, 0.08)}
    assert words.coefficients(curve) == "logistic(−8 + (3 ± 0.1) ln size + (2 ± 0.08) ln rows)"


@pytest.mark.parametrize(
    ("ratio", "samples", "said"),
    [
        (1.0, 84.3, "an effect of 1 times the noise: about 84 rows"),
        (2.0, 3.0, "an effect of 2 times the noise: fewer than 10 rows, a guess: the cases have 30 to 140"),
        (1.0, 2e5, "an effect of 1 times the noise: over 10000 rows, a guess: the cases have 30 to 140"),
        (0.5, 84.3, "an effect of 0.5 times the noise: about 84 rows, a guess: the cases have 30 to 140"),
        (1.0, None, "an effect of 1 times the noise: these cases do not tell how many rows it takes"),
    ],
)
def test_what_lies_beyond_the_cases_is_called_a_guess(ratio, samples, said):
    curve = {"rows": (30.0, 140.0), "ratios": (0.7, 6.0)}
    assert needed(curve, {"ratio": ratio, "samples": samples}) == said


def test_laws_harm_and_intervals_are_told_with_their_rates(empty):
    rate = {"successes": 19, "trials": 20, "value": 0.95, "interval": (0.764, 0.991)}
    none = empty["worse"]
    coverage = {"parameters": rate, "shrinkage": none, "shares": rate}
    told = dict(facts({**empty, "laws": rate, "coverage": coverage}))
    assert list(told) == ["laws printed at 90 % and more", "95 % intervals of parameters", "95 % intervals of shares"]
    assert told["laws printed at 90 % and more"] == "19 of 20 right: 95.0 %, 95 % interval 76.4 to 99.1 %"
    assert facts(empty) == ()


def test_a_miss_tells_what_was_true_and_what_was_said():
    case = {"truth": ("drift",), "said": ("backlash",), "unexplained": "j1, time", "probability": 0.93, "error": None}
    assert miss(case) == ("drift", "backlash + unexplained (j1, time); 93.0 %")
    nothing = {**case, "truth": (), "said": (), "unexplained": None, "probability": None}
    assert miss(nothing) == ("nothing", "nothing")
    assert miss({**nothing, "unexplained": "j1, time"}) == ("nothing", "unexplained (j1, time)")
    assert miss({**case, "error": "too late"}) == ("drift", "too late")


# ---- text and table

ROW = "| one effect | 4 | exactly what is at work, nothing else | 1 of 4 | 25.0 % | 4.6 to 69.9 % |"


def test_text_and_table_say_the_same(plain, empty):
    told = text(plain)
    assert re.search(r"one effect, 4 cases, 1 failed\n.*1 of 4 +25\.0 % +4\.6 to 69\.9 %", told)
    assert re.search(r"1 backlash +· +· +· +· +1 +1", told)
    assert re.search(r"a4 +single +ur3 +backlash → the diagnosis failed: late", told)
    table, rest = markdown(plain).split("\n\n")
    lines = table.splitlines()
    assert len(lines) == 2 + len(plain["kinds"])
    assert {line.count("|") for line in lines} == {7}
    assert ROW in lines
    assert rest.splitlines()[-1] == "- Diagnoses that failed, and count as wrong: 1"
    assert all(line.startswith("- ") for line in rest.splitlines())
    assert markdown(empty).count("\n") == 1


def test_blocks_without_cases_are_left_out(plain, empty):
    heads = [block.splitlines()[0] for block in text(plain).split("\n\n")]
    assert heads[0] == "Blind trial: 12 cases, 6 answered wrongly; 1 diagnosis failed and counts as wrong."
    assert [h for h in heads if h.startswith("REAL")] == ["REAL CAMPAIGNS"]
    alone = score([record("null", said(), id="n1")])
    assert [re.split(r",|  |\n", b)[0] for b in text(alone).split("\n\n")] == [
        "Blind trial: 1 case", "HOW OFTEN", "BY ROBOT", "NAMED FIRST: one effect", "FIGURES",
    ]  # fmt: skip
    assert text(empty) == "Blind trial: 0 cases, 0 answered wrongly."


def test_columns_of_the_confusion_are_numbered_as_its_rows(plain):
    block = next(b for b in text(plain).split("\n\n") if b.startswith("NAMED FIRST: one effect, nothing"))
    heads, *rows, others = block.splitlines()[1:]
    assert heads.split() == ["1", "2", "3", "n", "u", "f"]
    assert [row.split()[:2] for row in rows[:2]] == [["1", "backlash"], ["2", "drift"]]
    assert others.strip() == "3 joint_gain; n nothing; u unexplained; f failed"
    counts = [[0 if c == "·" else int(c) for c in row.split()[-6:]] for row in rows]
    assert counts == plain["confusion"]["single"]["counts"]


def test_probabilities_and_both_size_and_rows_are_tables():
    cases = [
        record("single", said(effect("drift")) if hit else said(), ["drift"], {"drift": size}, samples=rows)
        for size, rows, hit in ((1.2, 50, False), (1.2, 120, True), (3.5, 50, True), (3.5, 250, True))
    ]
    cases.append(record("mixed", said(effect("drift", 0.64)), ["drift"]))
    told = text(score(cases))
    assert re.search(r"60 to 70 % +1 +64\.0 % +100\.0 %", told)
    assert re.search(r"size over the noise +45–60 +100–150 +200\+ rows\n +1 to 1\.5 +0/1 +1/1 +·", told)
    assert "found in 90 % of cases, by the curve logistic(" in told


def test_a_long_answer_hangs_under_its_head(plain):
    real = {"id": "r1", "robot": "arm", "asked": "word " * 40, "answer": "answer " * 30, "right": False}
    block = next(b for b in text({**plain, "real": [real]}).split("\n\n") if b.startswith("REAL"))
    first, *rest = block.splitlines()[1:]
    assert first.startswith("  WRONG  r1  word word")
    assert all(line.startswith(" " * 11) and len(line) <= 100 for line in rest)
    assert sum(line.count("word") for line in (first, *rest)) == 40


@pytest.mark.slow
def test_several_campaigns_are_told_by_what_changes(plain, several, page):
    told = text(several)
    assert re.search(
        r"two campaigns, one parameter changed, 1 case\n  > what changed is told, and nothing else +1 of 1", told
    )
    assert re.search(r"backlash jumps +1/1 +100\.0 % +1/1 +100\.0 % +1/1 +100\.0 % +1/1 +100\.0 %", told)
    assert re.search(r"joint_offset changes +1/1 +100\.0 % +1/1 +100\.0 % +– +–", told)
    assert re.search(r"k5 +series +ur3 +backlash grows, j1 → backlash, j1: jump after campaign 5", told)
    assert "CAMPAIGNS OF ONE ROBOT" not in text(plain)
    whole = html(several, "today")
    assert headings(whole) == headings(page)
    assert "Campaigns of one robot, by what changes" in whole
    assert "backlash grows, j1" in whole
    assert "by what changes" not in page


# ---- page


def test_the_page_has_a_section_for_each_part_and_trusts_no_name(page, empty):
    assert page.count('role="img"') == 6
    assert "&lt;geometric&gt;" in page
    assert "<geometric>" not in page
    assert "Blind trial: 6 of 12 cases answered rightly" in page
    always = ["How often", "Probabilities", "What it takes to be found", "How far the gap shrinks"]
    last = "What the words mean"
    # what nobody tried is left out, empty axes too
    assert headings(html(empty, "")) == [*always[:2], always[3], last]
    assert headings(page) == [
        always[0], "What was named", "One by one", *always[1:], "Real campaigns", "Misses", last,
    ]  # fmt: skip


# ---- figures


@pytest.fixture(scope="module")
def calibrated():
    found = said(effect("drift", 0.64), effect("backlash", 0.21), effect("joint_gain", 0.02), effect("geometric", 0.66))
    return score([record("mixed", found, ["drift"]), record("mixed", found, ["geometric"])])


def points(axes):
    return np.vstack([line.get_xydata() for line in axes.lines if line.get_marker() not in ("None", None)])


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
    assert [k for k, p in enumerate(patches) if p.get_linewidth() == 1.0] == [0, 7, 15, 22]  # the right answers
    assert [p.get_linewidth() for p in confusion_figure(plain, "removed").axes[0].patches] == [0.5, 1.0]
    assert len(confusion_figure(plain, "nowhere").axes[0].patches) == 0


def test_the_head_of_a_heat_map_s_numbers_covers_nothing(several):
    for name in several["confusion"]:
        assert [pair for pair in overlapping(texts(confusion_figure(several, name))) if "cases" in pair] == []


def test_the_reliability_diagram_holds_the_bins_and_their_intervals(calibrated):
    upper, lower = calibration_figure(calibrated).axes
    every = calibrated["calibration"]["all"]["bins"]
    bins = [b for b in every if b["present"]["trials"]]
    assert points(upper) == pytest.approx(np.array([[100 * b["mean"], 100 * b["present"]["value"]] for b in bins]))
    heights = [p.get_height() for p in lower.patches]
    assert heights == [b["present"]["trials"] for b in every]
    assert [t.get_text() for t in lower.texts] == [str(int(h)) for h in heights if h]
    bars = [line.get_ydata() for line in upper.lines if len(set(line.get_xdata())) == 1 and len(line.get_xdata()) == 2]
    assert np.array(bars) == pytest.approx(100.0 * np.array([b["present"]["interval"] for b in bins]))
    ideal = next(line for line in upper.lines if line.get_linestyle() == "--")
    assert np.array_equal(ideal.get_xdata(), ideal.get_ydata())
    assert any("calibration error" in t.get_text() for t in upper.texts)


def test_the_shrinkage_figure_holds_the_pairs_and_draws_what_vanishes_at_the_edge(plain):
    axes, pairs = shrinkage_figure(plain).axes[0], plain["shrinkage"]["pairs"]
    assert len(pairs) == 11
    wanted = sorted((100 * (1 - p["claimed"]), 100 * (1 - p["real"])) for p in pairs)
    assert np.array(sorted(map(tuple, points(axes)))) == pytest.approx(np.array(wanted))
    names = [t.get_text() for t in axes.get_legend().get_texts()]
    assert names == ["known effect at work (7)", "cause withheld (3)", "real campaign (1)"]
    two = [{"id": "c", "kind": "single", "claimed": c, "real": r} for c, r in ((1.0, 0.9), (0.99, -3.0))]
    axes = shrinkage_figure({"shrinkage": {"pairs": two, "median_absolute_difference": 0.1}}).axes[0]
    assert points(axes) == pytest.approx(np.array([[0.01, 10.0], [1.0, 400.0]]))
    assert axes.get_xlim() == axes.get_ylim()
    assert axes.get_xlim()[0] < 0.01 < 400.0 < axes.get_xlim()[1]


def test_the_power_figure_holds_rates_and_curve(plain):
    figure = power_figure(plain)
    for axes, name in zip(figure.axes, ("ratio", "samples"), strict=True):
        rates = [s["found"] for s in plain["detection"][name] if s["found"]["trials"]]
        assert points(axes)[:, 1] == pytest.approx([100 * r["value"] for r in rates])
        assert [t.get_text() for t in axes.texts if t.get_ha() == "center"] == [str(r["trials"]) for r in rates]
        bars = [tuple(x.get_ydata()) for x in axes.lines if x.get_marker() == "None" and len(x.get_ydata()) == 2]
        bars = [bar for bar in bars if np.ptp(bar)]
        assert np.ravel(bars) == pytest.approx(100 * np.ravel([r["interval"] for r in rates]))
    lines = [line.get_ydata() for line in figure.axes[0].lines if len(line.get_ydata()) > 10]
    wanted = [100 * np.array(line["chance"]) for line in plain["detection"]["curve"]["over_ratio"]]
    assert np.array(lines) == pytest.approx(np.array(wanted))


def test_a_step_without_an_upper_bound_ends_in_the_drawing():
    cases = [
        record("single", said(effect("drift")), ["drift"], {"drift": 50.0}, samples=1000),
        record("single", said(), ["drift"], {"drift": 7.0}, samples=300),
    ]
    for axes, low in zip(power_figure(score(cases)).axes, (6.0, 200.0), strict=True):
        step = next(line for line in axes.lines if len(line.get_xdata()) == 2 and np.ptp(line.get_xdata()))
        assert step.get_xdata()[0] == low
        assert step.get_xdata()[1] < axes.get_xlim()[1] < 2.0 * low
        assert np.array_equal(step.get_ydata(), [50.0, 50.0])


def test_without_cases_each_figure_says_so(empty):
    drawn = [calibration_figure(empty), confusion_figure(empty), shrinkage_figure(empty), power_figure(empty)]
    for axes in (axes for figure in drawn for axes in figure.axes):
        assert not axes.lines
        assert any(t.get_text().startswith("No ") for t in axes.texts)
