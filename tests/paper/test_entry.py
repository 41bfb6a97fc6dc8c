"""The verdict follows from what is printed and what is computed."""

import numpy as np
import pytest

from thermal_robot.paper.entry import VERDICTS, Printed, floats, judge, numbers, rounds_to, truncates_to

FIGURE = Printed("1.33", (1.33,), 0.01)
MINUS = Printed("−0.4", (-0.4,), 0.1)


@pytest.mark.parametrize(
    ("figure", "computed", "rounded", "cut"),
    [
        (FIGURE, 1.33, True, True),
        (FIGURE, 1.3349, True, True),
        (FIGURE, 1.3351, False, True),
        (FIGURE, 1.3399, False, True),
        (FIGURE, 1.3401, False, False),
        (FIGURE, 1.3251, True, False),
        (FIGURE, 1.3249, False, False),
        (FIGURE, 1.325, True, False),
        (FIGURE, -1.33, False, False),
        (MINUS, -0.44, True, True),
        (MINUS, -0.49, False, True),
        (MINUS, -0.36, True, False),
        (MINUS, 0.4, False, False),
    ],
)
def test_rounding_and_truncation(figure, computed, rounded, cut):
    assert rounds_to(figure, computed) is rounded
    assert truncates_to(figure, computed) is cut
    expected = "agrees" if rounded else "agrees when truncated" if cut else "erratum"
    assert judge(figure, computed, otherwise="erratum") == expected


def test_all_figures_count_together():
    pair = Printed("8 14", (8e-6, 14e-6), 1e-6)
    assert judge(pair, [8.4e-6, 14.3e-6], otherwise="erratum") == "agrees"
    assert judge(pair, [8.4e-6, 14.7e-6], otherwise="erratum") == "agrees when truncated"
    # One rounded up, the other cut off: neither habit gives both.
    assert judge(pair, [7.6e-6, 14.7e-6], otherwise="erratum") == "erratum"


def test_the_rounding_of_the_inputs_leaves_a_range():
    assert judge(FIGURE, 1.30, low=1.26, high=1.34, otherwise="not reproducible") == "agrees"
    assert judge(FIGURE, 1.30, low=1.28, high=1.32, otherwise="not reproducible") == "not reproducible"
    mixed = Printed("1.1; 17.8 %", (1.1, 0.178), (0.1, 0.001))
    assert rounds_to(mixed, [1.07, 0.16], [1.11, 0.19])
    assert not rounds_to(mixed, [1.07, 0.16], [1.11, 0.17])


def test_numbers_are_written_with_a_true_minus():
    assert numbers([[1e-6, -2e-6], [0.0, 3e-6]], 1, factor=1e6) == "1.0 −2.0 / 0.0 3.0"
    assert numbers(-0.5, 2) == "−0.50"


def test_half_of_a_last_digit_counts_as_rounding_on_either_side():
    # 0.145 and 1.005 have no exact binary fraction; decimal arithmetic rounds them either way.
    for shown, computed in ((0.14, 0.145), (0.15, 0.145), (1.0, 1.005), (1.01, 1.005)):
        assert rounds_to(Printed("", (shown,), 0.01), computed)


def test_verdicts_are_those_that_are_explained():
    for computed in (1.33, 1.338, 1.5):
        assert judge(FIGURE, computed, otherwise="not reproducible") in VERDICTS


def test_numbers_of_any_shape_become_one_tuple():
    assert floats(1, [2.5, 3], np.array([[4, 5], [6, np.inf]])) == (1.0, 2.5, 3.0, 4.0, 5.0, 6.0, np.inf)
    assert floats() == ()
