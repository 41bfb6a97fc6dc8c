"""A fold predicts its rows from the others alone, and the jackknife repeats the walk without a block."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import WIDTHS, drawn, explained

from thermal_robot.diagnosis.cross_validation import Model, Walk, jackknife, share
from thermal_robot.inference.discrepancy import Form, Smooth, Spectrum
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.rows import each

ROWS = 60


def model(seed=1, rows=ROWS, scale=1e4):
    """A model of three blocks without priors worth the name, in twenty blocks of rows."""
    linear, _, _ = drawn(np.random.default_rng(seed), rows)
    found = Model.of(explained(linear), np.arange(rows) * 20 // rows)
    linear = replace(linear, blocks=linear.blocks[2:5])
    return replace(found, linear=linear, scales=(scale,) * 3, kept=np.ones(rows, dtype=bool))


def fitted(linear, blocks, weights, rows):
    """What a least-squares fit to some rows leaves of all, by the textbook."""
    columns = np.concatenate([linear.frames, *(linear.blocks[b].columns for b in blocks)], axis=2)
    root = np.sqrt(weights[rows])[:, None]
    design = (columns[rows] * root[:, :, None]).reshape(-1, columns.shape[2])
    solution = np.linalg.lstsq(design, (linear.gap[rows] * root).ravel())[0]
    return linear.gap - columns @ solution


def test_rows_held_out_are_predicted_by_a_fit_to_the_others():
    known = model()
    walk = Walk.over(known, each(known.block))
    for chosen in ((), (1,), (0, 1, 2)):
        left = walk.residuals(chosen)
        for test in each(known.block):
            right = fitted(known.linear, chosen, known.whitening.weights, ~test)[test]
            np.testing.assert_allclose(left[test[walk.numbers]], right, atol=1e-6)
        assert walk.squares(chosen)[0] == pytest.approx((left**2).sum(), rel=1e-9)


def test_a_row_has_no_part_in_its_own_prediction():
    known = model()
    test = known.block == 7
    moved = np.where(test[:, None], 40.0, 0.0)
    other = replace(known, linear=replace(known.linear, gap=known.linear.gap + moved))
    left = [Walk.over(m, [test]).residuals((0, 2)) for m in (known, other)]
    np.testing.assert_allclose(left[1] - left[0], 40.0, atol=1e-6)


@pytest.mark.parametrize("tests", ["blocks", "regions"])
def test_the_walk_without_a_block_is_that_of_a_campaign_without_it(tests):
    known = model(rows=120)
    folds = each(known.block) if tests == "blocks" else each(np.random.default_rng(0).integers(0, 4, 120))
    chosen = (0, 1, 2)
    found = Walk.over(known, folds).squares(chosen)
    literal = []
    for b in range(20):
        rows = known.block != b
        some = Linear(
            known.linear.gap[rows],
            known.linear.frames[rows],
            tuple(replace(c, source=c.columns[rows]) for c in known.linear.blocks),
        )
        whitening = replace(known.whitening, weights=known.whitening.weights[rows])
        less = replace(known, linear=some, whitening=whitening, kept=known.kept[rows], block=np.arange(rows.sum()))
        own = [fold[rows] for fold in folds if fold[rows].any()]
        literal.append(sum((Walk.over(less, [f]).residuals(chosen) ** 2).sum() for f in own))
    # to first order: a twentieth of the rows is left out twice
    np.testing.assert_allclose(found[1:], literal, rtol=0.02)
    assert np.sqrt(jackknife(found[1:])) == pytest.approx(np.sqrt(jackknife(np.array(literal))), rel=0.15)


def test_rows_that_are_alike_count_by_their_own_covariance():
    """Generalised least squares on some rows: their covariance is that part of the whole one."""
    known = model()
    rng = np.random.default_rng(2)
    form = Form("some", rng.normal(size=(ROWS, 4)), rng.normal(size=(3, 2)))
    weights, noise = np.where(np.arange(ROWS) == 5, 0.0, 1.0), np.full(3, 2.0)
    smooth = Smooth(Spectrum.of(form, weights, noise), 3.0)
    alike = replace(known, whitening=replace(known.whitening, weights=weights, noise=noise, smooth=smooth))
    # K of mean one on the diagonal, in units of the noise
    likeness = np.kron(form.functions @ form.functions.T, form.moves @ form.moves.T)
    covariance = np.eye(3 * ROWS) + 3.0**2 * likeness / np.diag(likeness).mean()
    for rows in (known.block != 3, known.block < 10, np.ones(ROWS, dtype=bool)):
        own = np.repeat(rows & (weights > 0), 3)
        columns = known.linear.stack.reshape(3 * ROWS, -1)[own] / 2.0
        right = columns.T @ np.linalg.inv(covariance[np.ix_(own, own)]) @ columns
        np.testing.assert_allclose(alike.products(rows)[0], right, rtol=1e-6, atol=1e-6 * np.abs(right).max())


def test_a_fold_that_leaves_the_frames_open_is_left_out():
    known = model()
    alone = known.linear.frames.copy()
    alone[known.block != 4, :, 0] = 0.0
    short = replace(known, linear=replace(known.linear, frames=alone))
    walk = Walk.over(short, each(short.block))
    assert len(walk.tests) == 19
    assert not (walk.numbers == np.flatnonzero(short.block == 4)[0]).any()
    assert list(walk.counts) == [ROWS - 3, *(ROWS - 3 if b == 4 else ROWS - 6 for b in range(20))]


def test_rows_set_aside_do_not_judge():
    known = model()
    kept = np.arange(ROWS) % 10 != 0
    walk = Walk.over(replace(known, kept=kept), each(known.block))
    assert walk.counts[0] == kept.sum()
    left = walk.residuals((0,))[kept[walk.numbers]]
    assert walk.squares((0,))[0] == pytest.approx((left**2).sum(), rel=1e-9)


def test_what_a_model_leaves_out_counts_as_noise_against_priors():
    """A column of one millionth is not stretched to stand in for what nothing in the model explains."""
    known = model(scale=1.0)
    far = replace(known.linear, gap=known.linear.gap + 1e4 * np.random.default_rng(3).normal(size=(ROWS, 3)))
    fit = replace(known, linear=far).fits([np.ones(ROWS, dtype=bool)], (0,))[0]
    free = model(scale=1e9)
    loose = replace(free, linear=far).fits([np.ones(ROWS, dtype=bool)], (0,))[0]
    width = WIDTHS[2]
    assert np.abs(fit[-1 - width : -1]).max() < 0.01 * np.abs(loose[-1 - width : -1]).max()


def squares(total, spread, seed=0):
    without = total * (0.95 + spread * np.random.default_rng(seed).normal(size=20))
    return np.append(total, without)


def test_a_share_lies_within_its_interval_and_nothing_is_known_exactly():
    whole = squares(50.0, 0.004)
    for part in (0.999 * whole, 0.3 * whole, -0.2 * whole, squares(10.0, 0.01, 1), 1.7 * whole, squares(60.0, 0.1, 2)):
        value, (low, high) = share(part, whole)
        assert low <= value <= high
        assert value == pytest.approx(part[0] / whole[0])
    assert share(0.0 * whole, whole) == (0.0, (0.0, 0.0))
    assert share(whole, 0.0 * whole) == (0.0, (0.0, 0.0))
    wide = [np.ptp(share(squares(25.0, spread, 1), squares(50.0, 0.0))[1]) for spread in (0.002, 0.02)]
    assert wide[1] > 5.0 * wide[0]


def test_one_block_tells_no_interval():
    assert share(np.array([1.0, 1.0]), np.array([2.0, 1.0]))[1] == (-np.inf, 1.0)


def test_an_interval_is_wider_where_one_block_makes_up_the_spread():
    """The jackknife's variance is then told by one value: less is known of it than of one that twenty tell."""
    even = np.tile([-1.0, 1.0], 10)
    single = np.where(np.arange(20) == 0, 1.0, 0.0)
    wide = []
    for moved in (even, single):
        moved = moved - moved.mean()
        moved *= 0.01 / np.sqrt((moved**2).sum())
        value, (low, high) = share(0.5 + np.append(0.0, moved), np.ones(21))
        assert low < value < high
        wide.append(high - low)
    assert wide[1] > 1.5 * wide[0]
