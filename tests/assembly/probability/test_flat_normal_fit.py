"""The fit of a flat-normal law: what it finds, what it holds, how it moves with the sample, what it refuses."""

import numpy as np
import pytest
from scipy import stats

from thermal_robot.assembly.probability import FlatNormal, flat_normal
from thermal_robot.assembly.probability.flat_normal import fit_maximum_likelihood, fit_moments, log_likelihood
from thermal_robot.errors import EstimationError


def test_fit_finds_the_parts_of_a_large_sample():
    truth = FlatNormal(1.0, 3.0, 2.0)
    found = FlatNormal.fitted(truth.rvs(size=5000, random_state=1))
    # Standard errors by the curvature of the likelihood are 0.03, 0.03 and 0.03.
    assert float(found.sigma) == pytest.approx(1.0, abs=0.15)
    assert float(found.half_width) == pytest.approx(3.0, abs=0.15)
    assert found.mean() == pytest.approx(2.0, abs=0.15)


def test_fit_reaches_a_likelihood_no_smaller_than_the_truth_and_the_limits():
    for seed, truth in enumerate(
        (FlatNormal(1.0, 0.0), FlatNormal(1.0, 2.0), FlatNormal(0.05, 1.0), FlatNormal(0.0, 1.0))
    ):
        sample = truth.rvs(size=300, random_state=seed)
        best = float(np.sum(flat_normal.logpdf(sample, *flat_normal.fit(sample))))
        assert best >= float(np.sum(truth.logpdf(sample))) - 1e-9
        assert best >= float(np.sum(stats.norm(sample.mean(), sample.std()).logpdf(sample))) - 1e-9
        assert best >= -300.0 * np.log(np.ptp(sample)) - 1e-6


def test_fit_of_a_peaked_sample_is_the_normal_limit():
    sample = np.random.default_rng(0).standard_t(4, size=500)
    r, loc, scale = flat_normal.fit(sample)
    assert r == 0.0
    assert (loc, scale) == pytest.approx((sample.mean(), sample.std()), rel=1e-12)
    assert flat_normal.fit(sample, method="MM")[0] == 0.0


def test_fit_holds_what_it_is_told():
    sample = FlatNormal(1.0, 3.0, 2.0).rvs(size=200, random_state=1)
    assert flat_normal.fit(sample, fr=1.0, floc=2.0)[:2] == pytest.approx((1.0, 2.0), rel=1e-12)
    assert flat_normal.fit(sample, fscale=1.9)[2] == pytest.approx(1.9, rel=1e-12)


@pytest.mark.parametrize("sample", [[1.0, 2.0, 3.0], [1.0] * 9, [1.0, 2.0, np.nan, 3.0, 4.0]])
def test_fit_refuses_what_determines_nothing(sample):
    with pytest.raises(EstimationError):
        flat_normal.fit(sample)


@pytest.mark.parametrize("r", [0.0, 0.7, 2.0, np.inf])
def test_moments_of_a_law_give_its_ratio_back(r):
    # Quantiles at even shares stand for the law itself: a sample without chance.
    law = flat_normal(r, 5.0, 3.0)
    sample = law.ppf((np.arange(40_000) + 0.5) / 40_000)
    found, mean, scale = fit_moments(sample)
    assert (mean, scale) == pytest.approx((5.0, 3.0), rel=1e-3)
    # The share of the uniform variance; its slope against the kurtosis is infinite at r = 0.
    share, expected = (1.0 if np.isinf(x) else x**2 / (1.0 + x**2) for x in (found, r))
    assert share == pytest.approx(expected, abs=0.05 if r == 0.0 else 5e-3)


@pytest.mark.parametrize("fit", [fit_moments, fit_maximum_likelihood])
def test_fit_moves_with_the_sample(fit):
    sample = FlatNormal(1.0, 3.0).rvs(size=150, random_state=3)
    r, mean, scale = fit(sample)
    moved = fit(40.0 - 1e-5 * sample)
    assert moved[0] == pytest.approx(r, rel=1e-4)
    assert moved[1] == pytest.approx(40.0 - 1e-5 * mean, abs=1e-10)
    assert moved[2] == pytest.approx(1e-5 * scale, rel=1e-5)


def test_log_likelihood_is_that_of_the_law_and_has_both_limits():
    sample = np.array([-0.9, -0.2, 0.1, 0.4, 1.1])
    assert log_likelihood(sample, 0.0, 0.1, 2.0) == pytest.approx(stats.norm(0.1, 2.0).logpdf(sample).sum(), rel=1e-12)
    flat = stats.uniform(0.1 - 2.0 * np.sqrt(3.0), 4.0 * np.sqrt(3.0))
    assert log_likelihood(sample, np.inf, 0.1, 2.0) == pytest.approx(flat.logpdf(sample).sum(), rel=1e-12)
    assert log_likelihood(sample, np.inf, 0.0, 0.5) == -np.inf
    law = FlatNormal(1.0, np.sqrt(3.0) * 1.5)
    scale = np.sqrt(1.0 + 1.5**2)
    assert log_likelihood(sample, 1.5, 0.0, scale) == pytest.approx(law.logpdf(sample).sum(), rel=1e-12)


def test_no_neighbour_is_likelier():
    sample = FlatNormal(1.0, 2.5).rvs(size=400, random_state=5)
    best = fit_maximum_likelihood(sample)
    assert 0.0 < best[0] < np.inf
    top = log_likelihood(sample, *best)
    for k in range(3):
        for step in (-1e-2, -1e-3, 1e-3, 1e-2):
            near = list(best)
            near[k] += step
            assert log_likelihood(sample, *near) < top


def test_everything_held_is_handed_back():
    sample = FlatNormal(1.0, 2.5).rvs(size=50, random_state=6)
    for ratio in (0.0, 1.0, np.inf):
        found = fit_maximum_likelihood(sample, ratio=ratio, loc=0.5, scale=2.0)
        assert found == pytest.approx((ratio, 0.5, 2.0), rel=1e-12)
