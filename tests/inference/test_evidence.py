"""The evidence is the density it claims to be, also where parameters cannot be negative."""

from dataclasses import replace
from itertools import combinations, product

import mpmath
import numpy as np
import pytest
from inference.densities import alike, direct, seen_of, volume
from inference.problems import columns_of, small_problem
from scipy.integrate import quad
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.evidence import Columns, Posterior, conditional_scales, evidence
from thermal_robot.inference.problem import gram
from thermal_robot.inference.search import Search


def integrated(linear, whitening, found):
    """Logarithm of the density integrated over κ and over all scales given it, over that at its peak.

    The noise is held. The grids reach five standard deviations of the prior at least; finer, they give the same.
    """
    gap, columns = seen_of(linear, whitening, found.blocks, found.noise)
    spread = np.array([linear.blocks[b].spread for b in found.blocks])
    # what no column reaches does not depend on the scales
    basis = np.linalg.qr(np.hstack(columns))[0]
    gap, columns = basis.T @ gap, [basis.T @ own for own in columns]
    logs = np.linspace(-9.0, 9.0, 121 if len(columns) == 1 else 61)
    coarse = settings.COARSENESS * np.linspace(-6.0, 6.0, 41)
    prior = norm.pdf(coarse, scale=settings.COARSENESS) * (coarse[1] - coarse[0])
    own = [norm.pdf(logs[:, None], coarse, s) * (logs[1] - logs[0]) for s in spread]
    weight = np.log(np.einsum("ik,k->i" if len(own) == 1 else "ik,jk,k->ij", *own, prior))
    outer = [own @ own.T for own in columns]

    def density(move):
        covariance = np.eye(len(gap)) + np.tensordot(np.exp(2.0 * move), outer, 1)
        solved = np.linalg.solve(covariance, np.broadcast_to(gap, move.shape[:-1] + gap.shape)[..., None])[..., 0]
        return -0.5 * (np.linalg.slogdet(covariance)[1] + solved @ gap)

    grid = np.stack(np.meshgrid(*[logs] * len(columns), indexing="ij"), axis=-1)
    total = logsumexp([logsumexp(density(line) + prior) for line, prior in zip(grid, weight, strict=True)])
    peak = np.log([found.scales[b] for b in found.blocks])
    return total - density(peak) + 0.5 * peak @ np.linalg.solve(alike(linear, found), peak)


PRIOR = (-1.0, -2.0, -0.5)


def all_combinations(linear, whitening):
    problem = gram(linear, whitening)
    search = Search(problem, PRIOR)
    chosen = [c for size in range(4) for c in combinations(range(3), size)]
    return problem, search, [search.evaluate(c) for c in chosen]


LARGE = (1.5, 1.5, 1.5)


@pytest.mark.parametrize(
    ("present", "held", "spreads", "larger"),
    [
        ((0, 2), 20.0, LARGE, 1.0),
        ((0, 2), 0.0, (0.5, 1.5, 1.0), 1.0),
        *(pytest.param(*own, LARGE, 1.0, marks=pytest.mark.slow) for own in product(((), (1,), (0, 2)), (0.0, 20.0))),
        pytest.param((), 20.0, (0.5, 1.5, 1.0), 1.0, marks=pytest.mark.slow),
        pytest.param((0, 2), 20.0, LARGE, 30.0, marks=pytest.mark.slow),  # effects much larger than expected
    ],
)
def test_evidence_is_the_density_of_the_gap(present, held, spreads, larger):
    for seed in range(1):
        linear, whitening = small_problem(seed, present=present, held=held)
        blocks = zip(linear.blocks, spreads, strict=True)
        linear = replace(linear, blocks=tuple(replace(b, spread=s, sizes=b.sizes / larger) for b, s in blocks))
        _, _, found = all_combinations(linear, whitening)
        ours = np.array([c.log_evidence for c in found])
        theirs = np.array([direct(linear, whitening, c, PRIOR) + volume(linear, whitening, c) for c in found])
        # in a valley between a small and a large size the search for the peak may end on its brim
        peaked = np.isfinite(theirs)
        assert peaked.sum() >= (8 if larger == 1.0 else 6)
        off = ((ours - ours[0]) - (theirs - theirs[0]))[peaked]
        np.testing.assert_allclose(off, 0.0, atol=1e-6 if larger == 1.0 else 1e-3)


@pytest.mark.slow
def test_evidence_is_the_integral_over_the_sizes_of_effects():
    """Blocks of 1, 2 and 3 columns and pairs of them, there or not, seen ten times as well or as badly as the noise.

    What is left is the skewness of the peak: most where a block is hardly seen.
    """
    errors = {}
    for seed in range(4):
        for present in ((), (0, 1, 2)):
            for noise in (0.2, 2.0, 20.0):
                linear, whitening = small_problem(seed, rows=30, present=present, noise=noise)
                search = Search(gram(linear, whitening), (0.0,) * 3)
                for blocks in ((0,), (1,), (2,), (0, 2), (1, 2)):
                    found = search.evaluate(blocks)
                    ours = found.log_evidence - direct(linear, whitening, found, (0, 0, 0))
                    constant = search.evaluate(()).log_evidence - direct(linear, whitening, search.evaluate(()), (0,))
                    error = ours - constant - integrated(linear, whitening, found)
                    how = "there" if present and noise < 1.0 else "hardly"
                    errors.setdefault((how, len(blocks)), []).append(error)
    assert np.abs(errors["there", 1]).max() < 0.15
    assert np.abs(errors["there", 2]).max() < 0.15
    assert np.abs(errors["hardly", 1]).max() < 0.4
    assert np.abs(errors["hardly", 2]).max() < 0.7
    assert np.abs(np.mean(errors["hardly", 1])) < 0.15


@pytest.mark.parametrize("present", [(0, 2), *(pytest.param(own, marks=pytest.mark.slow) for own in ((), (1,)))])
def test_scales_and_noise_are_the_most_probable_ones(present):
    """No other noise or scale, two per cent away, gives the gap a higher density."""
    for seed in range(5):
        linear, whitening = small_problem(seed, present=present, rows=30)
        _, _, found = all_combinations(linear, whitening)
        for c in (c for c in found if c.exact):
            best = direct(linear, whitening, c, (0, 0, 0))
            for factor in (0.98, 1.02):
                assert direct(linear, whitening, c, (0, 0, 0), noise=factor * c.noise) < best
                for b in c.blocks:
                    other = {**c.scales, b: factor * c.scales[b]}
                    assert direct(linear, whitening, c, (0, 0, 0), scales=other) < best


def test_what_is_left_on_the_way_is_far_below():
    left = 0
    for seed in range(5):
        linear, whitening = small_problem(seed, present=(0, 1, 2), rows=60, noise=0.3)
        sums = gram(linear, whitening)
        search = Search(sums, (0.0,) * 3)
        chosen = [c for size in (3, 2, 1, 0) for c in combinations(range(3), size)]
        found = [search.evaluate(c) for c in chosen]
        most = max(c.log_evidence for c in found)
        for c in (c for c in found if not c.exact):
            whole = evidence(sums, c.blocks, 0.0, None)
            assert whole.exact
            assert max(c.log_evidence, whole.log_evidence) < most - settings.DETOUR_FROM
            # what was still to be gained is foretold
            assert abs(c.log_evidence - whole.log_evidence) < 0.1 * (most - whole.log_evidence)
            left += 1
    assert left >= 5


def test_a_column_of_noise_lowers_the_evidence_on_average():
    bic_gain = []
    for seed in range(40):
        linear, whitening = small_problem(seed, rows=30, present=(1,))
        search = Search(gram(linear, whitening), (0.0,) * 3)
        bic_gain += [search.evaluate((1, b)).log_evidence - search.evaluate((1,)).log_evidence for b in (0, 2)]
    assert np.mean(bic_gain) < -1.0
    assert np.mean(np.array(bic_gain) > 0.0) < 0.15


@pytest.mark.parametrize("present", [(), (1,)])
def test_a_block_of_which_the_data_see_nothing_changes_nothing_but_the_odds(present):
    """An effect that the unknown frames take up whole, alone and beside others."""
    linear, whitening = small_problem(5, present=present)
    alias = columns_of(linear.frames @ [[1.0, 2.0], [-3.0, 0.5]])
    linear = replace(linear, blocks=(*linear.blocks, alias, alias))
    search = Search(gram(linear, whitening), (-1.0, -2.0, -0.5, -0.7, -0.7))
    for others in ((), (1,), (0, 2)):
        plain = search.evaluate(others)
        for more, odds in (((3,), -0.7), ((3, 4), -1.4)):
            found = search.evaluate((*others, *more), search.evaluate((1,)))
            assert found.log_evidence == pytest.approx(plain.log_evidence + odds, abs=settings.EVIDENCE_SETTLED)
            assert found.noise == pytest.approx(plain.noise, rel=1e-3)
            np.testing.assert_allclose(*(search.gram.posterior(c)[0] for c in (found, plain)), rtol=1e-2)
    assert set(search.run().blocks) <= {0, 1, 2}


def test_a_block_grows_no_further_than_it_may():
    """What no robot reaches is as improbable as at the largest size, and no less by a size that grows with it."""
    linear, whitening = small_problem(3, present=(1,), held=1e6)
    large = replace(linear, gap=linear.gap + 1e3 * linear.blocks[1].columns.sum(axis=2))
    free = evidence(gram(large, whitening), (1,), 0.0, None)
    blocks = tuple(replace(item, largest_scale=30.0) for item in linear.blocks)
    bounded = evidence(gram(replace(large, blocks=blocks), whitening), (1,), 0.0, None)
    assert free.scales[1] > 100.0
    assert bounded.scales[1] == pytest.approx(30.0)
    assert bounded.log_evidence < free.log_evidence - 100.0
    small = evidence(gram(replace(linear, blocks=blocks), whitening), (1,), 0.0, None)
    assert small.log_evidence == pytest.approx(evidence(gram(linear, whitening), (1,), 0.0, None).log_evidence)


@pytest.mark.parametrize("known", [(), (0,), (0, 2), (0, 1, 2)], ids=str)
def test_a_further_scale_is_expected_as_known_ones_and_their_common_factor_say(known):
    """The joint normal law of all logarithms of scales, conditioned on those that are known."""
    rng = np.random.default_rng(len(known))
    spread, own = rng.uniform(0.3, 1.5, 3), rng.uniform(0.3, 1.5, 4)
    held, log_scale = spread[list(known)], rng.normal(size=len(known))
    mean, deviation = conditional_scales(held, log_scale, own)
    for further, found in zip(own, deviation, strict=True):
        whole = np.diag([*held, further]) ** 2 + settings.COARSENESS**2
        gain = np.linalg.solve(whole[:-1, :-1], whole[:-1, -1])
        assert mean == pytest.approx(gain @ log_scale, abs=1e-12)
        assert found**2 == pytest.approx(whole[-1, -1] - gain @ whole[:-1, -1], rel=1e-12)


def test_of_a_robot_that_is_coarse_in_one_respect_others_are_expected_coarse():
    """Two effects twenty times as large as expected cost less together than each by itself."""
    linear, whitening = small_problem(7, rows=60, present=(0, 2), noise=0.1)
    coarse = replace(linear, blocks=tuple(replace(b, sizes=b.sizes / 20.0) for b in linear.blocks))
    lost = {}
    for blocks in ((), (0,), (2,), (0, 2)):
        one, other = (evidence(gram(p, whitening), blocks, 0.0, None).log_evidence for p in (linear, coarse))
        lost[blocks] = one - other
    assert lost[()] == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < lost[0, 2] < lost[0,] + lost[2,] - 0.3


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
        # nor does it matter which were dropped before
        again = Posterior.at(columns, SCALE, 0.5, (np.arange(size) % 2 == 0) | ~columns.positive)
        np.testing.assert_allclose(again.values, found.values, atol=1e-12)
        assert again.log_volume == pytest.approx(found.log_volume)
    assert dropped > 20


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


def test_several_columns_have_nearly_the_volume_of_their_orthant_and_without_a_side_exactly_the_normal_laws():
    errors = []
    for seed in range(40):
        columns = drawn(seed)
        errors.append(ours(columns, SCALE, 4.0) - log_integral(columns, SCALE, 4.0))
        free = Columns(columns.matrix, columns.vector, columns.owner, np.zeros(6, dtype=bool))
        assert ours(free, SCALE, 2.0) == pytest.approx(log_integral(free, SCALE, 2.0), abs=1e-6)
    assert np.abs(np.median(errors)) < 0.3
    assert np.quantile(np.abs(errors), 0.9) < 1.5


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


def test_a_value_of_many_times_its_deviation_keeps_its_digits():
    rng = np.random.default_rng(4)
    design = 1e5 * rng.normal(size=(60, 8)) @ np.diag(np.logspace(-4, 0, 8)) @ rng.normal(size=(8, 8))
    matrix, vector = design.T @ design, design.T @ (design @ np.full(8, 50.0))
    columns = Columns(matrix, vector, np.zeros(8, dtype=int), np.zeros(8, dtype=bool))
    with mpmath.workdps(40):
        exact = mpmath.lu_solve(mpmath.matrix(matrix) + mpmath.eye(8) / 25, mpmath.matrix(vector))
    found = Posterior.at(columns, np.array([5.0]), 1.0)
    away = found.values - np.array(exact, dtype=float).ravel()
    assert away @ matrix @ away < 1e-6  # of the squares of what is left, in units of the noise
