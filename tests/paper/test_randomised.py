"""Rows of section 4: values, and the flat-normal law and the test of normality by simulation."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats

from thermal_robot.paper import PaperInputs
from thermal_robot.paper.rows import RANDOMISED

EXACT = {
    "Eq 18, area under the density": [*[1 / np.sqrt(np.pi)] * 3, 1, 1, 1],
    "Eq 19, σ_t²": [256e-12 / 3],
    "r = σ_t/σ_k": [16 / 18 / np.sqrt(3)],
    "Eq 20, total variance": [324e-12 + 256e-12 / 3, 20.2320e-6, 405e-12],
    "Shapiro–Wilk critical W, n = 100, α = 0.05": [0.974577, 0.965435, 0.00783403],
}
# Answers of simulations ten times as large with another seed, and at least four Monte Carlo standard errors.
SIMULATED = {
    "normality at r = 0.5, n = 100 and 5000": ([0.0456, 0.0596, 0.513200], [0.020, 0.024, 1e-6]),
    '"normal enough for r < 1"': ([0.0460, 0.0569, 0.0496, 0.9901], [0.020, 0.024, 0.020, 0.010]),
}


@cache
def computed(inputs):
    return {entry.quantity: entry for entry in (row(inputs) for row in RANDOMISED)}


def default():
    return computed(PaperInputs())


def quick(**changed):
    """Other inputs, and small samples, few of them."""
    return computed(replace(PaperInputs(n_simulated=120, repetitions=60), **changed))


@pytest.mark.parametrize("quantity", EXACT)
def test_computed_value(quantity):
    np.testing.assert_allclose(default()[quantity].values, EXACT[quantity], rtol=1e-5, atol=1e-15)


@pytest.mark.parametrize("quantity", SIMULATED)
def test_simulated_value(quantity):
    expected, tolerance = map(np.array, SIMULATED[quantity])
    np.testing.assert_array_less(np.abs(np.array(default()[quantity].values) - expected), tolerance + 1e-15)


def test_every_row_is_checked_above():
    assert {*EXACT, *SIMULATED} == set(default())


def test_total_variance_is_that_of_drawn_errors():
    inputs, rng, drawn = PaperInputs(), np.random.default_rng(7), 400_000
    thermal = rng.uniform(-inputs.delta_y, inputs.delta_y, drawn)
    total = thermal + rng.normal(0.0, inputs.experimental_sigma[0][1], drawn)
    # The standard error of a variance is at most √(2/N) of it, less for what is flatter than a normal law.
    limit = 5.0 * np.sqrt(2.0 / drawn)
    assert default()["Eq 19, σ_t²"].values[0] == pytest.approx(thermal.var(), rel=limit, abs=0.0)
    assert default()["Eq 20, total variance"].values[0] == pytest.approx(total.var(), rel=limit, abs=0.0)


def test_excess_kurtosis_that_is_told_is_that_of_drawn_errors():
    rng, drawn = np.random.default_rng(8), 1_000_000
    assert "Excess kurtosis −0.048 and −0.30" in default()['"normal enough for r < 1"'].why
    for r, told in ((0.5, -0.048), (1.0, -0.30)):
        sample = rng.standard_normal(drawn) + r * np.sqrt(3.0) * rng.uniform(-1.0, 1.0, drawn)
        assert stats.kurtosis(sample) == pytest.approx(told, abs=5.0 * np.sqrt(24.0 / drawn) + 1e-3)


def test_critical_value_rejects_alpha_of_normal_samples():
    w, one_percent, _ = default()["Shapiro–Wilk critical W, n = 100, α = 0.05"].values
    rng, samples = np.random.default_rng(9), 3000
    drawn = np.array([stats.shapiro(rng.standard_normal(100)).statistic for _ in range(samples)])
    for level, value in ((0.05, w), (0.01, one_percent)):
        assert abs(np.mean(drawn < value) - level) < 5.0 * np.sqrt(level * (1.0 - level) / samples)
    # The printed 0.964 rejects far fewer than the one in twenty that it is meant for.
    assert np.mean(drawn < 0.964) < 0.02


def test_level_of_the_printed_critical_value_does_not_depend_on_the_level_asked_for():
    name = "Shapiro–Wilk critical W, n = 100, α = 0.05"
    levels = [quick(alpha=alpha)[name].values for alpha in (0.05, 0.2)]
    assert levels[0][2] == levels[1][2]
    assert levels[0][0] < levels[1][0]


def test_claim_holds_where_no_sample_is_large_enough_to_see_the_difference():
    assert default()['"normal enough for r < 1"'].verdict == "agrees in part"
    assert quick()['"normal enough for r < 1"'].verdict == "agrees"


def test_rejections_are_held_against_the_level_that_was_asked_for():
    # A test at 30 % rejects three normal samples in ten, which says nothing against the law.
    entry = quick(alpha=0.3, repetitions=300)["normality at r = 0.5, n = 100 and 5000"]
    assert min(entry.values[:2]) > 0.2
    assert entry.verdict == "agrees"


def test_a_thermal_error_far_above_the_scatter_is_not_normal():
    assert default()["normality at r = 0.5, n = 100 and 5000"].verdict == "agrees"
    wide = quick(delta_y=400e-6)
    assert wide["normality at r = 0.5, n = 100 and 5000"].verdict == "not reproducible"
    assert wide["r = σ_t/σ_k"].verdict == "erratum"
    assert wide["r = σ_t/σ_k"].values[0] == pytest.approx(25.0 * default()["r = σ_t/σ_k"].values[0], rel=1e-13)
