"""Shapiro-Wilk: the critical value against scipy and simulation; the power of the paper's test is in its ledger."""

import numpy as np
import pytest
from scipy import stats

from thermal_robot.assembly.probability import (
    flat_normal,
    normality_power,
    normality_test,
    sample_size_to_see,
    shapiro_wilk_critical,
)
from thermal_robot.errors import EstimationError


@pytest.mark.parametrize("n", [12, 20, 100, 1000, 5000])
def test_critical_value_inverts_scipy_s_p_value(n):
    outcome = stats.shapiro(np.random.default_rng(n).normal(size=n))
    assert shapiro_wilk_critical(n, float(outcome.pvalue)) == pytest.approx(outcome.statistic, abs=1e-10)


def test_level_is_kept_by_simulation():
    power = normality_power(0.0, 100, samples=4000)
    assert abs(power.rejected - 0.05) < 5.0 * np.sqrt(0.05 * 0.95 / 4000)
    assert power.low < power.rejected < power.high < power.low + 0.025


def test_power_grows_with_r_to_that_of_a_uniform_sample():
    shares = [normality_power(r, 100, samples=300).rejected for r in (1.0, 2.0, 4.0, np.inf)]
    assert shares == sorted(shares)
    assert shares[-1] > 0.98


def test_sample_size_that_sees_the_difference():
    size = sample_size_to_see(1.0, 0.8, samples=300)
    assert size is not None
    # Within five standard errors of 80 % in a fresh simulation.
    again = normality_power(1.0, size, samples=600, random_state=1).rejected
    assert abs(again - 0.8) < 5.0 * np.sqrt(0.16 / 300 + 0.16 / 600)
    assert sample_size_to_see(0.5, 0.8, samples=100) is None
    assert sample_size_to_see(np.inf, 0.01, samples=200) == 12


def test_decision_says_what_it_is_worth():
    sample = flat_normal.rvs(1.0, size=100, random_state=3)
    decision = normality_test(sample, alternatives=(1.0,), samples=200)
    assert not decision.rejected
    assert decision.rejected == (decision.p_value < 0.05)
    assert decision.power[0].rejected < 0.15
    assert str(decision).startswith("Normality is not rejected: W = 0.9")
    assert "for r = 1" in str(decision)
    uniform = normality_test(np.linspace(0.0, 1.0, 100), alternatives=())
    assert uniform.rejected
    assert uniform.power == ()


@pytest.mark.parametrize("sample", [[1.0, 2.0], np.ones(50), [np.nan] * 20, np.arange(5001.0)])
def test_samples_that_cannot_be_tested_are_refused(sample):
    with pytest.raises(EstimationError):
        normality_test(sample)


def test_impossible_questions_are_refused():
    for arguments in ((5, 0.05), (6000, 0.05), (100, 0.0), (100, 1.0)):
        with pytest.raises(ValueError, match=r"holds for|between 0 and 1"):
            shapiro_wilk_critical(*arguments)
    with pytest.raises(ValueError, match="negative"):
        normality_power(-1.0, 100)
