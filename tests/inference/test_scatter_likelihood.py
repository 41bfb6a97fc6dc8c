"""The likelihood of scatter is that of the raw rows, its fit is the maximum, and its screen is what a fit would say."""

import numpy as np
import pytest
from helpers import some
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.stats import multivariate_normal, multivariate_t

from thermal_robot.inference.scatter import Likelihood, independent_rows
from thermal_robot.inference.settings import VARIANCE_GRID

JOINTS = 4
VISIT, POSE = ("visit", 1), ("pose", 2)


def drawn(seed, poses=30, repeats=3, measures=3, noise=1.0, visit=2.0, pose=3.0, common=0.5):
    """IndependentRows in units of the noise: values, columns, pose, each pose with one Jacobian."""
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(poses, measures, JOINTS))
    number = rng.permutation(np.repeat(np.arange(poses), repeats))
    rows = columns[number]
    values = noise * rng.normal(size=rows.shape[:2]) + common * rng.normal(size=(poses, measures))[number]
    values = values + visit * rows[:, :, 1] * rng.normal(size=(len(number), 1))
    values = values + pose * rows[:, :, 2] * rng.normal(size=poses)[number][:, None]
    return values, rows, number


def rows_of(values, columns, number, freedom=0):
    return independent_rows(values, columns, number, freedom)


def raw_density(values, columns, number, lever, logs):
    """Log density of the rows as they were measured: visits of one pose are dependent.

    ``logs`` are those of the instrument's variance, of what visits have in common, of joint 1 anew at each visit and of
    joint 2 once a pose, the joints' in the unit of their columns.
    """
    noise, common, visit, pose = np.exp(logs)
    total = 0.0
    for p in np.unique(number):
        own = number == p
        k, jacobian = int(own.sum()), columns[own][0] / lever
        each = noise * np.eye(3) + visit * np.outer(jacobian[:, 1], jacobian[:, 1])
        shared = common * np.eye(3) + pose * np.outer(jacobian[:, 2], jacobian[:, 2])
        covariance = np.kron(np.eye(k), each) + np.kron(np.ones((k, k)), shared)
        total += multivariate_normal(cov=covariance).logpdf(values[own].ravel())
    return total


@pytest.mark.parametrize("repeats", [2, 5])
def test_the_likelihood_is_the_density_of_the_rows_and_its_fit_where_that_is_largest(repeats):
    """Its slope by central differences vanishes along each variance, and a step either way lowers it."""
    for seed in range(2):
        data = drawn(seed, repeats=repeats)
        rows = rows_of(*data)
        found = Likelihood(rows, (False,)).fit((VISIT, POSE))
        assert found.value == pytest.approx(raw_density(*data, rows.lever, found.logs), rel=1e-9)
        for axis in np.eye(4):
            ahead, behind = (raw_density(*data, rows.lever, found.logs + s * axis) for s in (0.2, -0.2))
            assert max(ahead, behind) < found.value
            near = [raw_density(*data, rows.lever, found.logs + s * axis) for s in (1e-4, -1e-4)]
            # it stops where a step gains less than a thousandth
            assert abs(near[0] - near[1]) / 2e-4 < 0.1


def test_a_variance_that_is_held_stays_and_all_else_is_the_best_beside_it():
    data = drawn(3)
    rows = rows_of(*data)
    likelihood = Likelihood(rows, (False,))
    free = likelihood.fit((VISIT, POSE))
    for place in range(4):
        start = free.logs.copy()
        start[place] += 1.0
        held = likelihood.fit((VISIT, POSE), start, held=place)
        assert held.logs[place] == start[place]
        assert raw_density(*data, rows.lever, start) <= held.value + 1e-6 < free.value


@pytest.mark.parametrize("measures", [3, 6])
def test_variances_are_those_that_were_put_in(measures):
    logs = []
    for seed in range(20):
        values, columns, number = drawn(seed, poses=60, measures=measures)
        rows = rows_of(values, columns, number)
        found = Likelihood(rows, (False,) * (measures // 3)).fit((VISIT, POSE))
        scaled = np.append(np.ones(measures // 3 + 1), rows.lever[[1, 2]])
        logs.append(found.logs - 2.0 * np.log(scaled))
    true = 2.0 * np.log([*[1.0] * (measures // 3), 0.5, 2.0, 3.0])
    spread = np.std(logs, axis=0)
    np.testing.assert_allclose(np.mean(logs, axis=0), true, atol=4.0 * spread.max() / np.sqrt(20) + 0.02)
    # what is said of their error is what they err by
    np.testing.assert_allclose(spread, np.sqrt(np.diag(found.spread)), rtol=0.5)


def test_lever_makes_columns_of_unit_mean_square():
    values, columns, number = drawn(4)
    rows = rows_of(values, columns * [1.0, 1e-3, 1e3, 0.0], number)
    np.testing.assert_allclose((rows.columns[rows.repeats > 0] ** 2).mean(axis=(0, 1)), [1.0, 1.0, 1.0, 0.0], rtol=1e-9)
    assert rows.lever[3] == 0.0


def test_contrasts_hold_nothing_that_visits_have_in_common():
    values, columns, number = drawn(5, repeats=4)
    shift = 100.0 * np.random.default_rng(5).normal(size=(30, 3))
    plain, moved = (rows_of(v, columns, number) for v in (values, values + shift[number]))
    contrast = plain.repeats == 0
    assert contrast.sum() == plain.contrasts == 30 * 3
    np.testing.assert_allclose(moved.values[contrast], plain.values[contrast], atol=1e-10)
    assert np.abs(moved.values[~contrast] - plain.values[~contrast]).min(axis=1).max() > 10.0
    # nothing is lost: they are the rows turned
    assert (plain.values**2).sum() == pytest.approx((values**2).sum(), rel=1e-12)
    # what parameters took, the means are given back: 18 of their 90 components
    fitted = rows_of(values, columns, number, 18)
    np.testing.assert_allclose(fitted.values[~contrast] ** 2, plain.values[~contrast] ** 2 / 0.8)
    np.testing.assert_array_equal(fitted.values[contrast], plain.values[contrast])


@pytest.mark.parametrize("tails", some([4.0, np.inf], 2))
def test_the_screen_is_the_density_with_one_more_component(tails):
    values, columns, number = drawn(6, repeats=2, poses=20)
    rows = rows_of(values, columns, number)
    likelihood = Likelihood(rows, (False,), tails)
    base = likelihood.fit((VISIT,))
    candidates = (("visit", 0), ("pose", 2), ("pose", 3))
    screened = likelihood.screen(base, candidates)
    assert screened.shape == (len(VARIANCE_GRID), 3)

    def density(covariance):
        if np.isinf(tails):
            each = [multivariate_normal(cov=c).logpdf(v) for v, c in zip(rows.values, covariance, strict=True)]
        else:  # of the same covariance
            shape = covariance * (tails - 2.0) / tails
            each = [multivariate_t(shape=c, df=tails).logpdf(v) for v, c in zip(rows.values, shape, strict=True)]
        return float(np.sum(each))

    for c, (kind, joint) in enumerate(candidates):
        column = rows.columns[:, :, joint]
        extra = column[:, :, None] * column[:, None, :] * (rows.repeats[:, None, None] if kind == "pose" else 1.0)
        for g in (2, 11, 18):
            whole = base.covariance + VARIANCE_GRID[g] * extra
            best = minimize_scalar(lambda s, w=whole: -density(np.exp(s) * w), bounds=(-6, 3), method="bounded")
            assert screened[g, c] == pytest.approx(-best.fun, abs=1e-3 if np.isinf(tails) else 0.2)


def test_the_screen_never_promises_more_than_a_full_fit_holds():
    values, columns, number = drawn(7)
    likelihood = Likelihood(rows_of(values, columns, number), (False,))
    base = likelihood.fit((VISIT,))
    promised = likelihood.screen(base, (POSE,)).max()
    full = likelihood.fit((VISIT, POSE)).value
    assert base.value + 10.0 < promised <= full + 1e-3


def test_heavy_tails_fit_heavy_tails_and_hold_the_same_covariance():
    rng = np.random.default_rng(8)
    unit = rng.normal(size=(400, 3)) / np.sqrt(rng.chisquare(4, (400, 1)) / 4.0) / np.sqrt(2.0)
    columns = rng.normal(size=(400, 3, JOINTS))
    own = np.arange(400)
    for values, better in ((unit, 4.0), (rng.normal(size=(400, 3)), np.inf)):
        rows = rows_of(values, columns, own)
        normal, heavy = (Likelihood(rows, (False,), t).fit(()) for t in (np.inf, 4.0))
        assert (heavy.value > normal.value + 3.0) == (better == 4.0)
    # without a component the normal law's variance is the mean square
    assert np.exp(normal.logs[0]) == pytest.approx((values**2).mean(), rel=1e-2)
    assert normal.logs.shape == (1,)  # without repeats nothing is in common


@pytest.mark.parametrize(("rows", "times"), [(12, 1.3), (2000, 2.0)], ids=["few", "many"])
def test_a_stated_noise_is_held_near_where_few_rows_speak_and_given_up_where_many_do(rows, times):
    for seed in range(5):
        rng = np.random.default_rng([seed, 9])
        values = rng.normal(size=(rows, 3))
        values *= times / np.sqrt((values**2).mean())
        data = rows_of(values, rng.normal(size=(rows, 3, JOINTS)), np.arange(rows))
        stated, free = (Likelihood(data, (s,)).fit(()) for s in (True, False))
        assert np.exp(0.5 * free.logs[0]) == pytest.approx(times, rel=1e-2)
        if rows == 12:
            assert 0.0 < stated.logs[0] < 0.9 * free.logs[0]
        else:
            assert stated.logs[0] == pytest.approx(free.logs[0], abs=0.02)
        # to call it wrong costs no more than e⁵
        assert free.value - 5.0 - 1e-3 <= stated.value <= free.value


@pytest.mark.parametrize("size", [0.0, 0.3, 1.0, 5.0])
def test_what_a_variance_costs_is_the_mean_of_its_likelihood_over_the_grid(size):
    """Of a joint that scatters plainly, hardly, and not at all; nothing else is moved, so that the sum is exact."""
    ends = np.log(VARIANCE_GRID[[0, -1]])
    for seed in range(4):
        values, columns, number = drawn(seed, repeats=1, poses=60, visit=0.0, pose=size, common=0.0)
        law = Likelihood(rows_of(values, columns, number), (True,))
        fitted = law.fit((POSE,))
        density = law.density((POSE,))

        def likelihood(log, density=density, fitted=fitted):
            return np.exp(density(np.array([fitted.logs[0], log]))[0] - fitted.value)

        mean = quad(likelihood, *ends, limit=200)[0] / np.ptp(ends)
        assert law.log_widths(fitted) == pytest.approx(np.log(mean), abs=0.35)
