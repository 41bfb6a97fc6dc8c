"""Rows of section 5: values, and capability, loss and clearance in closed form, in their limits and by simulation."""

from functools import cache

import numpy as np
import pytest
from scipy.stats import norm

from thermal_robot.paper import PaperInputs
from thermal_robot.paper.rows import JOINING, capability_at, warmed

EXACT = {
    "C_p at L = 0.145 mm, row 1": [1.30128, 1.26237, 1.34217],
    "C_p at L = 0.145 mm, row 2": [1.01289, 0.988360, 1.03834],
    "C_p of row 2 below that of row 1": [0.221621, 0.177471, 0.263608],
    "C_p row 1 with ±3 °C": [
        *(147.995e-6, 1.18367, 0.110020, 0.116585),
        *(1.09365, 0.177709, 0.175635, 1.20462, 0.0942697, 0.0945050),
    ],
    "C_p row 2 with ±3 °C": [
        *(187.430e-6, 1.19028, 0.105055, 0.113010),
        *(1.10758, 0.167236, 0.168531, 1.21071, 0.0896882, 0.0915224),
    ],
    "(1.33 − 1.1)/1.33": [0.172932, 0.135338, 0.210526],
    "(1.33 − 1.17)/1.33": [0.120301, 0.116541, 0.124060],
    "(1.33 − 1.00)/1.33": [0.248120, 0.244361, 0.251880],
}
MODELS = ("covariance", "uniform", "mean shift")
SIGMA, SHIFT = (14e-6, 18e-6), (7e-6, 16e-6)


@cache
def default():
    return {entry.quantity: entry for entry in (row(PaperInputs()) for row in JOINING)}


@pytest.mark.parametrize("quantity", EXACT)
def test_computed_value(quantity):
    np.testing.assert_allclose(default()[quantity].values, EXACT[quantity], rtol=1e-5, atol=1e-15)


def test_every_row_is_checked_above():
    assert set(EXACT) == set(default())


def test_capability_of_round_scatter_has_a_closed_form():
    # A round normal error exceeds the radius L/2 with the probability exp(−L²/8σ²).
    for clearance in (20e-6, 145e-6, 400e-6):
        failing = np.exp(-((clearance / 18e-6) ** 2) / 8.0)
        expected = norm.isf(0.5 * failing) / 3.0
        assert capability_at((18e-6) ** 2 * np.eye(2), clearance) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("model", MODELS)
def test_capability_that_is_left_is_that_of_drawn_errors(model):
    # A required capability of 0.5 fails in 13 % of cases, which a simulation can count.
    case, rng, drawn = warmed(SIGMA, SHIFT, 0.5, model), np.random.default_rng(4), 400_000
    error = rng.standard_normal((drawn, 2)) * SIGMA
    if model == "mean shift":
        error += SHIFT
    elif model == "uniform":
        error += rng.uniform(-1.0, 1.0, (drawn, 2)) * SHIFT
    else:
        error += rng.standard_normal((drawn, 2)) * np.array(SHIFT) / np.sqrt(3.0)
    for clearance, capability in ((case.clearance, case.capability), (case.clearance * (1.0 + case.growth), 0.5)):
        failing = 2.0 * norm.sf(3.0 * capability)
        counted = np.mean(np.hypot(*error.T) > clearance / 2.0)
        assert abs(counted - failing) < 5.0 * np.sqrt(failing * (1.0 - failing) / drawn)


@pytest.mark.parametrize("model", MODELS)
def test_without_a_shift_nothing_is_lost(model):
    case = warmed(SIGMA, (0.0, 0.0), 1.33, model)
    np.testing.assert_allclose(case.compared, [1.33, 0.0, 0.0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_unit_of_length_does_not_matter(model):
    one, large = warmed(SIGMA, SHIFT, 1.33, model), warmed((14.0, 18.0), (7.0, 16.0), 1.33, model)
    np.testing.assert_allclose(large.compared, one.compared, rtol=1e-9)
    assert large.clearance == pytest.approx(1e6 * one.clearance, rel=1e-9)


def test_a_shift_that_stands_costs_most_and_one_without_tails_least():
    losses = [warmed(SIGMA, SHIFT, 1.33, model).loss for model in ("uniform", "covariance", "mean shift")]
    assert 0.0 < losses[0] < losses[1] < losses[2]


def test_verdicts_say_that_no_model_gives_both_rows():
    for row in (1, 2):
        entry = default()[f"C_p row {row} with ±3 °C"]
        assert entry.verdict == "not reproducible"
        assert "neither gives both rows" in entry.why
    assert "mean reproduces the printed figures" in default()["C_p row 1 with ±3 °C"].why
    assert "mean does not reproduce the printed figures" in default()["C_p row 2 with ±3 °C"].why
