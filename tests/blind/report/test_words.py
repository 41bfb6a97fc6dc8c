"""The words that text, table and page share."""

from typing import get_args

import pytest

from thermal_robot.blind.cases import Kind
from thermal_robot.blind.judged import HEADLINE
from thermal_robot.blind.report import text as words
from thermal_robot.blind.report.text import coefficients, count, effect, facts, interval, kind, miss, needed, question
from thermal_robot.blind.score import score

CURVE = {"rows": (30.0, 140.0), "ratios": (0.7, 6.0)}


def test_every_kind_and_the_question_that_decides_it_have_words():
    for name in get_args(Kind):
        assert kind(name) != name
        said = question(HEADLINE[name], name)
        assert "_" not in said
        assert said != HEADLINE[name]
    assert set(words.KINDS) == set(get_args(Kind))
    # the same question means something else where nothing is at work
    assert question("exact", "null") != question("exact", "single") == question("exact")


def test_what_has_no_words_of_its_own_is_said_without_its_underscores():
    assert effect("tracking_lag") == "tracking lag"
    assert effect("geometric") == "link geometry"
    assert (kind("strange"), question("strange")) == ("strange", "strange")


def test_rates_are_written_with_their_interval():
    rate = {"successes": 20, "trials": 22, "interval": (0.722, 0.975)}
    assert count(rate) == "20 of 22"
    assert interval(rate) == "72.2 to 97.5 %"
    assert interval({**rate, "interval": None}) == ""


@pytest.mark.parametrize(
    ("bounds", "said"),
    [({"low": 0.5, "high": 0.7}, "0.5 to 0.7"), ({"low": 200, "high": None}, "200 and more")],
)
def test_a_step_is_written_with_its_bounds(bounds, said):
    assert words.step(bounds) == said


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
    assert needed(CURVE, {"ratio": ratio, "samples": samples}) == said


def test_coefficients_are_written_with_their_standard_deviations():
    curve = {"intercept": -8.04, "ratio": 3.0, "samples": 2.0, "std": (0.3, 0.12, 0.08)}
    assert coefficients(curve) == "logistic(−8 + (3 ± 0.1) ln size + (2 ± 0.08) ln rows)"


def test_figures_without_cases_are_not_told():
    assert facts(score([]).to_dict()) == ()


def test_laws_harm_and_intervals_are_told_with_their_rates():
    rate = {"successes": 19, "trials": 20, "value": 0.95, "interval": (0.764, 0.991)}
    none = {"successes": 0, "trials": 0, "value": None, "interval": None}
    plain = score([]).to_dict()
    plain |= {"laws": rate, "worse": none, "coverage": {"parameters": rate, "shrinkage": none, "shares": rate}}
    said = dict(facts(plain))
    assert list(said) == ["laws printed at 90 % and more", "95 % intervals of parameters", "95 % intervals of shares"]
    assert said["laws printed at 90 % and more"] == "19 of 20 right: 95.0 %, 95 % interval 76.4 to 99.1 %"


def test_a_miss_tells_what_was_true_and_what_was_said():
    case = {"truth": ("drift",), "said": ("backlash",), "unexplained": "j1, time", "probability": 0.93, "error": None}
    assert miss(case) == ("drift", "backlash + unexplained (j1, time); 93.0 %")
    nothing = {**case, "truth": (), "said": (), "unexplained": None, "probability": None}
    assert miss(nothing) == ("nothing", "nothing")
    assert miss({**nothing, "unexplained": "j1, time"}) == ("nothing", "unexplained (j1, time)")
    assert miss({**case, "error": "too late"}) == ("drift", "too late")
