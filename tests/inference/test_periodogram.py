"""Waves of any order: the periodogram is a least-squares fit of each order, and its peak is the order put in."""

import numpy as np
import pytest

from thermal_robot.inference.screening import Target, independent, orders, peak, periodogram

ROWS = 90


def drawn(seed, reach=3.0, order=None, size=0.0):
    """Positions of a joint, its moves, what a design leaves of a wave and noise, and that seen from the joint."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-reach / 2, reach / 2, ROWS)
    moves, design = rng.normal(size=(ROWS, 3, 1)), rng.normal(size=(ROWS, 3, 5))
    gap = 1e-5 * rng.normal(size=(ROWS, 3))
    if order is not None:
        gap = gap + size * np.cos(order * q + rng.uniform(0.0, 6.0))[:, None] * moves[:, :, 0]
    target = Target.of(gap, design)
    return q, moves, target, target.statistics(moves)


@pytest.mark.parametrize("jitter", [0.0, 1e-9, 1e-6, 1e-5])
def test_a_joint_that_is_held_has_no_orders(jitter):
    noise = np.random.default_rng(3).uniform(-jitter, jitter, ROWS)
    assert len(orders(0.7 + noise)) == 0


def test_orders_end_where_a_joint_creeps_or_a_screw_begins():
    # a joint that creeps has orders though no two positions are far apart
    assert len(orders(np.linspace(0.2, 0.25, 2000))) > 0
    # a slide is searched down to the lead of a screw
    rng = np.random.default_rng(3)
    for period in (0.005, 0.02, 0.11):
        q, _, _, statistics = drawn(int(1e4 * period), reach=0.8, order=2.0 * np.pi / period, size=2e-4)
        found = peak(statistics, q, orders(q, slides=True))
        assert 2.0 * np.pi / found == pytest.approx(period, rel=1e-3)
    assert len(orders(np.zeros(ROWS))) == 0
    assert independent(orders(np.zeros(ROWS))) == 0.0
    # twice as far, twice as many orders can be told apart
    near, far = (independent(orders(r * rng.uniform(0.0, 1.0, 4000))) for r in (1.5, 3.0))
    assert far == pytest.approx(2.0 * near, rel=0.02)


@pytest.mark.parametrize("jitter", [0.0, 1e-6, 1e-5])
def test_positions_on_a_lattice_know_no_order_above_its_own_whatever_the_encoder_reads(jitter):
    rng = np.random.default_rng(4)
    q = 0.05 * rng.integers(0, 60, 400) + rng.uniform(-jitter, jitter, 400)
    assert 0.98 * np.pi / 0.05 < orders(q)[-1] <= 1.001 * np.pi / 0.05
    free = rng.uniform(0.0, 3.0, 400)
    assert orders(free)[-1] > 150.0


def wave(q, order):
    return np.column_stack([np.ones_like(q), np.sin(order * q), np.cos(order * q)])


def test_each_order_gains_what_its_fit_gains():
    q, moves, target, statistics = drawn(0)
    grid = orders(q)
    gains = periodogram(statistics, q, grid)
    for k in range(0, len(grid), 37):
        alone = target.score(moves * wave(q, grid[k])[:, None, :]).gain
        assert gains[k] == pytest.approx(alone, rel=1e-6, abs=1e-6)


def test_what_the_design_can_do_is_no_wave():
    q, moves, target, _ = drawn(1)
    order = 7.3
    whole = Target.of(target.white.reshape(ROWS, 3), moves * wave(q, order)[:, None, 1:])
    assert periodogram(whole.statistics(moves), q, np.array([order]))[0] == -np.inf
    assert np.isfinite(periodogram(whole.statistics(moves), q, np.array([order + 2.0]))[0])


@pytest.mark.parametrize("seed", range(8))
def test_the_peak_is_the_order_that_was_put_in(seed):
    order = float(np.random.default_rng([seed, 1]).uniform(1.0, 199.0))
    q, moves, target, statistics = drawn(seed, order=order, size=2e-4)
    found = peak(statistics, q, orders(q))
    assert abs(found - order) < 0.02
    assert target.score(moves * wave(q, found)[:, None, :]).gain >= (
        target.score(moves * wave(q, order)[:, None, :]).gain - 1e-3
    )


def test_in_noise_the_choice_of_an_order_is_paid_for():
    """Of sixty periodograms of noise not one gains more than its share of the orders allows."""
    worths = []
    for seed in range(60):
        q, moves, target, statistics = drawn(100 + seed)
        grid = orders(q)
        best = target.score(moves * wave(q, peak(statistics, q, grid))[:, None, :]).gain
        worths.append(best - np.log(independent(grid)))
    assert max(worths) < 2.0
    assert np.median(worths) < -2.0


@pytest.mark.parametrize("reach", [6.3, 1e3, 1e9, 1e15])
def test_a_joint_of_any_range_has_few_orders(reach):
    """An angle in a wrong unit, or an encoder that never turned back: the orders fit into memory all the same."""
    grid = orders(np.random.default_rng(0).uniform(0.0, reach, ROWS))
    assert 100 < len(grid) <= 100_001
    assert grid[0] < grid[-1] or reach > 1e14
