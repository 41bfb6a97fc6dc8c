"""What cannot be negative is not: the mode keeps the conditions of a minimum, the volume is that of half a prior."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from thermal_robot.errors import EstimationError
from thermal_robot.inference.evidence import Columns, Posterior


def drawn(seed, size=6, noise=1.0, rows=20):
    """Columns of which the first half cannot be negative; true values of either sign."""
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(rows, size)) + rng.normal(size=(rows, 1))
    gap = design @ rng.normal(size=size) + noise * rng.normal(size=rows)
    owner = np.repeat([0, 1], [size // 2, size - size // 2])
    return Columns(design.T @ design, design.T @ gap, owner, owner == 0)


SCALE = np.array([0.7, 2.0])


@pytest.mark.parametrize("size", [2, 6, 16])
def test_the_mode_keeps_its_side_and_nothing_betters_it(size):
    dropped = 0
    for seed in range(60):
        columns = drawn(seed, size)
        found = Posterior.at(columns, SCALE, 0.5)
        slope = columns.vector / 0.5 - (columns.matrix / 0.5 + np.diag(SCALE[columns.owner] ** -2.0)) @ found.values
        assert (found.values[columns.positive] >= 0.0).all()
        np.testing.assert_allclose(slope[found.free], 0.0, atol=1e-8)
        assert (slope[~found.free] <= 1e-9).all()
        assert not found.values[~found.free].any()
        dropped += int((~found.free).sum())
    assert dropped > 20


def test_a_guess_of_what_is_dropped_does_not_change_the_mode():
    for seed in range(20):
        columns = drawn(seed)
        found = Posterior.at(columns, SCALE, 0.5)
        for guess in (np.zeros(6, dtype=bool), np.arange(6) % 2 == 0):
            again = Posterior.at(columns, SCALE, 0.5, guess | ~columns.positive)
            np.testing.assert_allclose(again.values, found.values, atol=1e-12)
            assert again.log_volume == pytest.approx(found.log_volume)


def log_integral(columns, scale, variance):
    """Log of the integral of prior times likelihood over that at the origin, from the normal law's own volume."""
    precision = columns.matrix / variance + np.diag(scale[columns.owner] ** -2.0)
    covariance = np.linalg.inv(precision)
    mean = covariance @ columns.vector / variance
    own = np.flatnonzero(columns.positive)
    inside = multivariate_normal(-mean[own], covariance[np.ix_(own, own)]).cdf(np.zeros(len(own))) if len(own) else 1.0
    whole = 0.5 * columns.vector @ mean / variance - 0.5 * np.linalg.slogdet(precision)[1]
    return whole - np.log(scale[columns.owner]).sum() + np.log(inside) + len(own) * np.log(2.0)


def ours(columns, scale, variance):
    found = Posterior.at(columns, scale, variance)
    return found.log_volume + 0.5 * columns.vector @ found.values / variance


@pytest.mark.parametrize("middle", [-6.0, -1.0, -1e-6, 1e-6, 0.5, 4.0])
def test_one_column_has_the_volume_of_half_a_normal_prior(middle):
    """On both sides of zero, by quadrature."""
    columns = Columns(np.array([[3.0]]), np.array([middle]), np.zeros(1, dtype=int), np.ones(1, dtype=bool))
    scale = np.array([0.8])

    def density(t):
        return 2.0 / (0.8 * np.sqrt(2.0 * np.pi)) * np.exp(-0.5 * (t / 0.8) ** 2 + middle * t - 1.5 * t**2)

    assert ours(columns, scale, 1.0) == pytest.approx(np.log(quad(density, 0.0, 20.0, epsabs=1e-14)[0]), abs=1e-7)


def test_several_columns_have_nearly_the_volume_of_their_orthant():
    errors = []
    for seed in range(40):
        columns = drawn(seed)
        errors.append(ours(columns, SCALE, 4.0) - log_integral(columns, SCALE, 4.0))
    assert np.abs(np.median(errors)) < 0.3
    assert np.quantile(np.abs(errors), 0.9) < 1.5


def test_without_a_side_the_volume_is_that_of_the_normal_law():
    for seed in range(10):
        known = drawn(seed)
        columns = Columns(known.matrix, known.vector, known.owner, np.zeros(6, dtype=bool))
        assert ours(columns, SCALE, 2.0) == pytest.approx(log_integral(columns, SCALE, 2.0), abs=1e-6)


def test_the_slope_by_the_scale_is_that_of_the_volume():
    """The Newton step vanishes where the volume, and what is fitted, change least."""
    for middle in (-4.0, -0.3, 0.3, 4.0):
        columns = Columns(np.array([[3.0]]), np.array([middle]), np.zeros(1, dtype=int), np.ones(1, dtype=bool))
        found = Posterior.at(columns, np.array([0.8]), 1.0)
        up, down = (ours(columns, np.array([0.8 * np.exp(h)]), 1.0) for h in (1e-4, -1e-4))
        assert (found.fitted - found.determined)[0] == pytest.approx((up - down) / 2e-4, abs=1e-6)


def test_what_many_that_point_the_wrong_way_bring_is_nothing():
    """Six columns at minus four deviations each: none is fitted, and all together they speak against the block."""
    design = np.linalg.qr(np.random.default_rng(1).normal(size=(30, 6)))[0] * 10.0
    columns = Columns(
        design.T @ design, design.T @ (design @ np.full(6, -0.4)), np.zeros(6, dtype=int), np.ones(6, bool)
    )
    found = Posterior.at(columns, np.ones(1), 1.0)
    assert not found.values.any()
    assert ours(columns, np.ones(1), 1.0) < -12.0
    assert found.effective.sum() == 0.0


def test_columns_that_are_no_matrix_of_products_are_refused():
    with pytest.raises(EstimationError):
        Posterior.at(Columns(-9.0 * np.eye(2), np.ones(2), np.zeros(2, int), np.zeros(2, bool)), np.ones(1), 1.0)
