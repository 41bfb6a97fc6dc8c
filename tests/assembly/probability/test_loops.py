"""Compiled loops of the probability of a disc: against the other engine, another law, and exact fractions."""

from fractions import Fraction

import numpy as np
import pytest
from assembly.drawn import both, drawn, needs_loops
from scipy.stats import ncx2

from thermal_robot.assembly.probability import joining_probability

pytestmark = needs_loops
CASES = 3000


@pytest.mark.parametrize("ratio", [1.0, 3.0, 100.0, 1e4])
@pytest.mark.parametrize("reach", [0.01, 1.0, 3.0, 12.0], ids="{}_deviations".format)
@pytest.mark.parametrize("shifted", [False, True], ids=["central", "shifted"])
def test_they_agree_with_the_other_engine(monkeypatch, ratio, reach, shifted):
    rng = np.random.default_rng(int(ratio + reach))
    mean = 1e-5 * rng.normal(size=(CASES, 2)) if shifted else 0.0
    radius = 1e-5 * reach * rng.uniform(0.5, 2.0, CASES)
    (inside, outside), (expected, missed) = both(monkeypatch, drawn(rng, ratio, CASES), 2.0 * radius, mean)
    np.testing.assert_allclose(inside, expected, rtol=0.0, atol=4e-15)
    np.testing.assert_allclose(outside, missed, rtol=1e-10, atol=0.0)
    assert ((inside >= 0.0) & (inside <= 1.0)).all()


def test_round_deviations_have_the_law_of_a_non_central_square(always):
    rng = np.random.default_rng(2)
    mean, radius = rng.normal(size=(CASES, 2)), rng.uniform(0.1, 4.0, CASES)
    found = joining_probability(np.eye(2), 2.0 * radius, mean)
    np.testing.assert_allclose(found, ncx2.cdf(radius**2, 2, (mean**2).sum(axis=1)), rtol=0.0, atol=1e-12)


def test_the_smaller_variance_keeps_its_digits():
    """Beside one that is 10¹⁶ times as large; the product of both is the determinant, without rounding."""
    from thermal_robot.assembly.probability.loops import variances

    rng = np.random.default_rng(7)
    for _ in range(200):
        slope, rest = rng.normal(), 10.0 ** -rng.uniform(0.0, 16.0)
        a, b, c = 1.0, slope, slope**2 + rest
        large, small = variances(a, b, c)
        exact = Fraction(a) * Fraction(c) - Fraction(b) ** 2
        if exact > 0:
            assert abs(Fraction(large) * Fraction(small) / exact - 1) < Fraction(1, 10**14)
            assert abs(Fraction(large) + Fraction(small) - Fraction(a) - Fraction(c)) < Fraction(1, 10**15) * Fraction(
                large
            )
