"""Noise, gross errors, and rows that are alike."""

from dataclasses import replace

import numpy as np
import pytest
from inference.problems import columns_of, problem_of, small_problem

from thermal_robot.effects import choose
from thermal_robot.inference.problem import Whitening, gram
from thermal_robot.inference.robust import (
    Noise,
    design_effect,
    distance_limit,
    first_whitening,
    reweigh,
    robust_noise,
    settled_noise,
)

SIGMA = np.repeat([2e-5, 3e-5], 3)  # m, rad
STATED = Noise(2e-5, 3e-5)
measured = pytest.mark.parametrize("measures", [3, 6], ids=["positions", "poses"])


def noise_of(rng, rows, measures=3):
    """Rows that hold nothing but the instrument's noise."""
    return SIGMA[:measures] * rng.normal(size=(rows, measures))


@measured
@pytest.mark.parametrize("rows", [20, 500])
def test_noise_alone_sets_a_row_aside_in_hardly_any_campaign(measures, rows):
    """Without the slack for heavier tails in one of a hundred, as the level says; with it more rarely."""
    rng = np.random.default_rng(0)
    farthest = rng.chisquare(measures, (4000, rows)).max(axis=1)
    limit = distance_limit(measures, rows)
    assert np.mean(farthest > limit / 1.5) == pytest.approx(0.01, abs=0.006)
    assert np.mean(farthest > limit) < 0.002
    assert distance_limit(measures, 2 * rows) > limit


@measured
def test_noise_is_read_off_normal_rows_and_hardly_off_gross_ones(measures):
    rng = np.random.default_rng(1)
    rows = noise_of(rng, 40_000, measures)
    sound = robust_noise(rows)
    np.testing.assert_allclose(sound, SIGMA[:measures:3], rtol=0.01)
    for gross in (0.1, 10.0):  # however large they are
        spoilt = rows.copy()
        spoilt[::4] += gross
        # the median of all is the 2/3 quantile of the sound: a fifth more than their own
        np.testing.assert_allclose(robust_noise(spoilt), 1.2 * sound, rtol=0.02)
    spoilt[::2] += 10.0
    assert (robust_noise(spoilt) > 10.0 * sound).all()


def test_what_was_fitted_is_given_back_to_the_noise():
    rng = np.random.default_rng(2)
    ratios = []
    for _ in range(60):
        rows = noise_of(rng, 200)
        design = rng.normal(size=(600, 240))
        left = rows.ravel() - design @ np.linalg.lstsq(design, rows.ravel(), rcond=None)[0]
        ratios.append(robust_noise(left.reshape(200, 3), leverage=0.4)[0] / SIGMA[0])
    assert np.mean(ratios) == pytest.approx(1.0, abs=4.0 * np.std(ratios) / np.sqrt(60))


def test_a_remainder_of_nothing_has_the_noise_of_rounding():
    assert (robust_noise(np.zeros((20, 6))) > 0.0).all()


def test_a_stated_noise_is_trusted_unless_the_remainder_is_well_above_it():
    position, orientation = 2e-5, 3e-5
    same, held = settled_noise(np.array([2.2e-5, 1e-5]), STATED, 6)
    np.testing.assert_array_equal(same, SIGMA)
    assert held > 0.0
    larger, loose = settled_noise(np.array([5e-5, 3e-5]), STATED, 6)
    np.testing.assert_array_equal(larger, np.repeat([5e-5, orientation], 3))
    assert loose == 0.0
    own, free = settled_noise(np.array([1e-5]), Noise(), 3)
    np.testing.assert_array_equal(own, [1e-5] * 3)
    assert free == 0.0
    assert STATED.parts(3) == (position,)
    assert STATED.parts(6) == (position, orientation)


def test_rows_that_are_not_used_have_no_weight_at_first():
    linear, _ = small_problem(0)
    use = np.arange(12) > 3
    linear.gap[~use] = 1e9
    whitening = first_whitening(linear, Noise(), use)
    np.testing.assert_array_equal(whitening.weights, use)
    assert whitening.noise.max() < 1e3


@measured
def test_gross_errors_are_set_aside_and_sound_rows_weigh_fully(measures):
    rng = np.random.default_rng(3)
    rows = noise_of(rng, 5000, measures)
    gross = np.arange(5000) % 10 == 0
    rows[gross] += 50.0 * SIGMA[:measures]
    # rows that are not used are neither weighed nor set aside
    use = np.arange(5000) % 7 > 0
    whitening, aside = reweigh(rows, STATED, use, 0.0, measures)
    np.testing.assert_array_equal(aside, gross & use)
    np.testing.assert_array_equal(whitening.weights > 0.0, use & ~gross)
    sound = whitening.weights[use & ~gross]
    assert sound.max() == 1.0
    assert np.mean(sound < 1.0) == pytest.approx(0.01, abs=0.005)
    # the further out, the less: past the bend the pull of a row no longer grows
    distance = np.linalg.norm(rows[use & ~gross] / SIGMA[:measures], axis=1)
    bent = sound < 1.0
    np.testing.assert_allclose(np.ptp((sound * distance)[bent]), 0.0, atol=1e-9)
    assert distance[bent].min() > distance[~bent].max()


def test_no_more_than_a_quarter_is_set_aside_and_these_are_the_worst():
    rng = np.random.default_rng(4)
    rows = noise_of(rng, 100)
    rows[:40] += np.arange(100.0, 140.0)[:, None] * SIGMA[:3]
    whitening, aside = reweigh(rows, STATED, np.ones(100, dtype=bool), 0.0, 3)
    np.testing.assert_array_equal(aside, np.isin(np.arange(100), np.arange(15, 40)))
    assert 0.0 < whitening.weights[:15].max() < whitening.weights[40:].min()


def test_a_close_fit_is_judged_by_the_equations_that_it_leaves():
    """What is left where two thirds of the equations were taken up is smaller: as much is then less likely noise."""
    rng = np.random.default_rng(5)
    rows, use = noise_of(rng, 300) / np.sqrt(3.0), np.ones(300, dtype=bool)
    rows[0] = 3.0 * SIGMA[:3]
    assert not reweigh(rows, STATED, use, 0.0, 3)[1].any()
    np.testing.assert_array_equal(np.flatnonzero(reweigh(rows, STATED, use, 2.0 / 3.0, 3)[1]), [0])


@pytest.mark.parametrize("repeats", [2, 5])
def test_rows_that_are_copies_of_each_other_are_worth_one(repeats):
    linear, _ = small_problem(6, rows=60, present=())
    linear = replace(linear, frames=linear.frames[:, :, :0])
    copied = replace(
        linear,
        gap=np.repeat(linear.gap, repeats, axis=0),
        frames=np.repeat(linear.frames, repeats, axis=0),
        blocks=tuple(replace(b, columns=np.repeat(b.columns, repeats, axis=0)) for b in linear.blocks),
    )
    whitening = Whitening(np.ones(60 * repeats), np.ones(3), 0.0)
    label = np.repeat(np.arange(60), repeats)
    seen = gram(copied, whitening)
    gap = np.repeat(np.random.default_rng(6).normal(size=(60, 3)), repeats, axis=0)
    assert design_effect(copied, seen, gap, whitening, (label,)) == pytest.approx(repeats, rel=1e-9)
    # the largest of several groupings counts; without one each row is worth one
    apart = np.arange(60 * repeats)
    assert design_effect(copied, seen, gap, whitening, (apart, label)) == pytest.approx(repeats, rel=1e-9)
    assert design_effect(copied, seen, gap, whitening, (apart,)) == 1.0
    assert design_effect(copied, seen, gap, whitening, ()) == 1.0
    nothing = replace(copied, blocks=(columns_of(np.zeros((60 * repeats, 3, 2))),))
    assert design_effect(nothing, gram(nothing, whitening), gap, whitening, (label,)) == 1.0


def test_rows_are_worth_one_each_unless_their_remainders_are_alike(rv_m2):
    linear, seen = problem_of(rv_m2, choose(["joint_offset", "joint_gain"]))
    whitening = Whitening(np.ones(120), np.full(3, 25e-6), 20.0)
    groups = (np.arange(120) // 10,)
    independent = []
    for seed in range(10):
        noise = 25e-6 * np.random.default_rng(seed).normal(size=(120, 3))
        independent.append(design_effect(linear, seen, noise, whitening, groups))
    assert np.median(independent) == 1.0
    assert max(independent) < 2.0
    # columns and remainders that are the same throughout each group of ten: ten rows are worth one
    rng = np.random.default_rng(10)
    constant = replace(linear, blocks=(columns_of(np.repeat(rng.normal(size=(12, 3, 2)), 10, axis=0)),))
    steady = gram(replace(constant, frames=linear.frames[:, :, :0]), whitening)
    shared = 25e-6 * np.repeat(rng.normal(size=(12, 3)), 10, axis=0)
    apart = (np.tile(np.arange(10), 12),)
    flat = replace(constant, frames=linear.frames[:, :, :0])
    assert design_effect(flat, steady, shared, whitening, groups) == pytest.approx(10.0, rel=1e-9)
    assert design_effect(flat, steady, shared, whitening, apart) == 1.0
    tempered = steady.tempered(10.0)
    assert tempered.equations == steady.equations / 10.0
    np.testing.assert_allclose(tempered.matrix, steady.matrix / 10.0)
