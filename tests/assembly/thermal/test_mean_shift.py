"""The test of Eq 13: the paper's U, its size and power by simulation, and sample sizes."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from thermal_robot.assembly.thermal import mean_shift_test
from thermal_robot.errors import EstimationError

# mm, Tables 1 and 2 as printed: measured means, static displacements, experimental σ.
MEANS = np.array([[0.007, 0.016, 0.011], [0.020, 0.003, 0.006]])
STATIC = np.array([[0.008, 0.014, 0.009], [0.017, 0.003, 0.004]])
SIGMA = np.array([[0.014, 0.018, 0.017], [0.023, 0.016, 0.018]])


def test_the_papers_u():
    found = mean_shift_test(MEANS, STATIC, SIGMA, n=100)
    np.testing.assert_allclose(found.u, [[-0.71, 1.11, 1.18], [1.30, 0.00, 1.11]], atol=0.005)
    assert found.critical == pytest.approx(1.960, abs=5e-4)
    assert found.accepted.all()
    np.testing.assert_allclose(found.p_value, 2 * stats.norm.sf(np.abs(found.u)), rtol=1e-12)
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.n = 5


def test_a_sample_is_its_mean():
    drawn = np.random.default_rng(0).normal(0.009, 0.014, (100, 3))
    whole, mean = (
        mean_shift_test(drawn, STATIC[0], SIGMA[0]),
        mean_shift_test(drawn.mean(axis=0), STATIC[0], SIGMA[0], n=100),
    )
    np.testing.assert_array_equal(whole.u, mean.u)
    assert whole.n == 100
    own = mean_shift_test(drawn, STATIC[0])
    expected = stats.ttest_1samp(drawn, STATIC[0]).statistic
    np.testing.assert_allclose(own.u, expected, rtol=1e-12)


@pytest.mark.parametrize("alpha", [0.05, 0.01])
def test_it_rejects_as_often_as_it_says(alpha):
    rng, sigma, shift, n = np.random.default_rng(1), 0.016, 0.005, 40
    right = mean_shift_test(rng.normal(0.0, sigma / np.sqrt(n), 40_000), 0.0, sigma, n=n, alpha=alpha)
    assert np.mean(~right.accepted) == pytest.approx(alpha, abs=4 * np.sqrt(alpha / 40_000))
    wrong = mean_shift_test(rng.normal(shift, sigma / np.sqrt(n), 40_000), 0.0, sigma, n=n, alpha=alpha)
    assert np.mean(~wrong.accepted) == pytest.approx(float(wrong.power(shift)), abs=0.01)
    assert float(wrong.power(0.0)) == pytest.approx(alpha, rel=1e-12)
    np.testing.assert_array_equal(np.asarray(wrong.p_value) >= alpha, wrong.accepted)


@pytest.mark.parametrize("power", [0.06, 0.5, 0.9, 0.999])
def test_required_size_is_the_smallest(power):
    shifts = np.array([1e-4, 0.003, 0.008, 0.014, 0.1])
    sizes = mean_shift_test(0.0, 0.0, 0.014, n=100).required_n(shifts, power)
    for shift, size in zip(shifts, sizes.tolist(), strict=True):
        assert mean_shift_test(0.0, 0.0, 0.014, n=size).power(shift) >= power
        if size > 1:
            assert mean_shift_test(0.0, 0.0, 0.014, n=size - 1).power(shift) < power


def test_the_paper_could_have_missed_a_third_of_a_sigma():
    # At n = 100 a shift of σ/3 is seen with 91 %, one of σ/10 with 17 %: "accepted" means no more than this.
    test = mean_shift_test(MEANS[0], STATIC[0], SIGMA[0], n=100)
    np.testing.assert_allclose(test.power(SIGMA[0] / 3), 0.915, atol=0.001)
    np.testing.assert_allclose(test.power(SIGMA[0] / 10), 0.170, atol=0.001)
    np.testing.assert_array_equal(test.required_n(SIGMA[0] / 10, 0.9), 1051)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: mean_shift_test(1.0, 0.0, 1.0), "give n if this is their mean"),
        (lambda: mean_shift_test(1.0, 0.0, n=9), "give sigma"),
        (lambda: mean_shift_test(1.0, 0.0, 0.0, n=9), "σ > 0"),
        (lambda: mean_shift_test(1.0, 0.0, 1.0, n=0), "n ≥ 1"),
        (lambda: mean_shift_test(1.0, 0.0, 1.0, n=9, alpha=1.0), "α < 1"),
        (lambda: mean_shift_test(1.0, 0.0, 1.0, n=9).required_n(0.0), "a shift of zero"),
        (lambda: mean_shift_test(1.0, 0.0, 1.0, n=9).required_n(1.0, 0.01), "the power must lie between"),
    ],
)
def test_what_makes_no_sense_is_said(call, words):
    with pytest.raises(EstimationError, match=words):
        call()
