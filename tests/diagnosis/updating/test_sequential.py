"""Rows added a few at a time: the same as all at once, whatever the order and the batches, and few are looked at."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import some
from updating_cases import ALL, OLD, far, in_full, measured

import thermal_robot as tr
from thermal_robot.diagnosis import sequential
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.diagnosis.sequential import (
    Guard,
    Judge,
    Point,
    Sequential,
    WeightedRows,
    converged_fit,
    linearised,
    products,
)
from thermal_robot.diagnosis.updated import fixed_point
from thermal_robot.inference.columns import unknown_frames
from thermal_robot.inference.registration import moved

PROMISED = 1e-6


def added(start, whole, parts):
    for part in parts:
        start = start.plus(in_full(whole.take(part)))
    return start


@pytest.fixture
def few(monkeypatch):
    """Keep as few rows that most are in the sums."""
    monkeypatch.setattr(diagnosis_settings, "KEPT", 150)


@pytest.fixture(scope="module")
def once(found, whole):
    """All rows fitted together, each looked at."""
    return fixed_point(found.fit).plus(in_full(whole.take(np.arange(OLD, ALL)))).fitted


@pytest.mark.parametrize(("batches", "seed"), some([(4, 1), (1, 0), (12, 2)], 3))
def test_batches_and_order_do_not_matter(found, whole, once, few, batches, seed):
    order = OLD + np.random.default_rng(seed).permutation(ALL - OLD)
    start = fixed_point(found.fit)
    assert start.sums.counts[0] > 700
    last = added(start, whole, np.array_split(order, batches)).fitted
    assert far(last, once) < PROMISED
    assert last.noise == pytest.approx(once.noise, rel=PROMISED)
    assert last.squares == pytest.approx(once.squares, rel=PROMISED)
    assert last.count == once.count


def test_it_is_a_fresh_fit_of_the_same_choice(fresh, once):
    assert far(once, fixed_point(fresh.fit).fitted) < PROMISED


def test_old_rows_are_looked_at_only_where_it_says_so(found, whole, few, monkeypatch):
    seen, plain = [], sequential.converged_fit
    monkeypatch.setattr(
        sequential, "converged_fit", lambda c, s, begin: (seen.append(len(begin.rows.weights)), plain(c, s, begin))[1]
    )
    start, looked = fixed_point(found.fit), []
    for k in range(10):
        seen.clear()
        start = start.plus(in_full(whole.take(np.arange(OLD + 20 * k, OLD + 20 * k + 20))))
        looked.append((max(seen), start.anew))
    assert all(rows < 400 for rows, _ in looked)
    assert sum(anew for _, anew in looked) < 5


def test_a_jump_of_the_robot_is_followed_by_looking_at_all_rows(found, whole, few):
    """Rows that move the parameters far leave the reach of the sums; the answer is still that of all rows."""
    rows = whole.take(np.arange(OLD, ALL))
    q = rows.q + np.array([0.0, 3e-4, 0.0, 0.0, 0.0])
    moved = in_full(replace(rows, position=rows.position + 1e-3 * np.sin(q[:, 1:4])))
    few_rows = fixed_point(found.fit).plus(moved)
    assert few_rows.anew
    diagnosis_settings.KEPT = 10_000
    assert far(few_rows.fitted, fixed_point(found.fit).plus(moved).fitted) < 1e-5


def with_held_weights(found):
    """The diagnosis as if it had found more than noise: rows keep their weights."""
    e, start = found.fit.explanation, fixed_point(found.fit)
    judge = Judge(start.fitted.point, e.whitening.noise * e.best.noise, found.samples)
    rows = WeightedRows(found.fit.campaign, e.whitening.weights, e.outliers)
    return Sequential.of(replace(start.choice, judge=judge), (rows,), start.fitted)


@pytest.mark.parametrize("batches", [1, 5])
def test_where_weights_are_held_batches_do_not_matter_either(found, whole, few, batches, monkeypatch):
    start = with_held_weights(found)
    assert start.sums.counts[0] > 300
    for part in np.array_split(np.arange(OLD, ALL), batches):
        start = start.plus(WeightedRows.weighed(start.choice, whole.take(part)))
    monkeypatch.setattr(diagnosis_settings, "KEPT", 10_000)
    once = with_held_weights(found)
    once = once.plus(WeightedRows.weighed(once.choice, whole.take(np.arange(OLD, ALL)))).fitted
    assert far(start.fitted, once) < 5.0 * PROMISED
    assert start.fitted.noise == pytest.approx(once.noise, rel=PROMISED)
    assert start.fitted.count == once.count


def test_it_ends_at_the_same_place_wherever_it_begins(whole, grown):
    known = grown.fitted
    begin = replace(known, best=None, leverage=0.0, rows=in_full(whole))
    astray = replace(begin, point=Point(begin.point.frames, 1.3 * known.point.values))
    one, other = (converged_fit(grown.choice, grown.sums, b) for b in (begin, astray))
    assert one.steady
    assert other.steady
    assert far(one, other) < 1e-7


def cost(grown, fitted, point):
    """What the fit makes least, by the exact model: weighed squares in units of the noise, and the priors'."""
    seen = linearised(fitted.rows.campaign, point, grown.choice)[:, :, -1]
    sizes = fitted.expected(grown.choice)
    return (fitted.rows.weights @ (seen / fitted.noise) ** 2).sum() + ((point.values / sizes) ** 2).sum()


def test_no_step_makes_the_cost_less(grown):
    fitted, names = grown.fitted, unknown_frames(grown.fitted.rows.campaign)
    least, rng = cost(grown, fitted, fitted.point), np.random.default_rng(3)
    deviation = np.sqrt(np.diag(np.linalg.inv(fitted.products[:-1, :-1]))) * fitted.best.noise
    for _ in range(20):
        step = 0.1 * deviation * rng.normal(size=len(deviation))
        there = Point(moved(fitted.point.frames, step[: len(names)], names), fitted.point.values + step[len(names) :])
        assert cost(grown, fitted, there) > least


@pytest.mark.slow
def test_a_noise_that_is_not_stated_is_found():
    campaign = replace(measured(200, seed=8), noise_position=None)
    fitted = fixed_point(tr.diagnose(campaign, only=["joint_offset", "backlash"]).fit).fitted
    assert fitted.noise[0] == pytest.approx(2e-5, rel=0.1)


@pytest.mark.parametrize("which", ["found", "fresh"])
def test_a_diagnosis_is_where_its_own_choice_comes_to_rest(which, request):
    """Values within a ten-thousandth of a deviation, noise and remainder within a millionth."""
    diagnosis = request.getfixturevalue(which)
    e, rest = diagnosis.fit.explanation, fixed_point(diagnosis.fit).fitted
    values = np.concatenate([v for _, v in diagnosis.fit.effects])
    deviation = np.concatenate([np.sqrt(np.diag(e.values[b][1])) for b in e.best.blocks])
    assert rest.steady
    assert np.abs((rest.point.values - values) / deviation).max() < 1e-4
    assert np.allclose(rest.deviations, deviation, rtol=1e-4)
    assert np.allclose(rest.noise, e.whitening.noise * e.best.noise, rtol=1e-5)
    assert np.sqrt(rest.squares[0] / rest.count) == pytest.approx(diagnosis.gap.rms_after, rel=1e-7)
    assert rest.count == (~e.outliers).sum()


def test_no_step_within_reach_carries_a_safe_row_into_the_tail_and_hardly_one_across_the_median():
    """400 rows of five columns and a gap, noise of one; beyond its reach the guard promises nothing."""
    rows, rng = np.random.default_rng(0).normal(size=(400, 3, 6)), np.random.default_rng(1)
    flat, median = rows[:, :, :-1].reshape(-1, 5), np.median(np.linalg.norm(rows[:, :, -1], axis=1))
    guard = Guard(flat.T @ flat, 1.0, 0.05, 400**-0.5, np.ones(3), np.array([median]), 3.4, False)
    scores = guard.scores(rows, np.ones(400))
    assert (guard.scores(rows, np.full(400, 0.9)) == -1.0).all()  # rows that count less are never safe
    safe = rows[scores >= guard.reach]
    assert 50 < len(safe) < 400
    below, crossed = np.linalg.norm(safe[:, :, -1], axis=1) < guard.medians, []
    for _ in range(50):
        step = np.linalg.cholesky(np.linalg.inv(guard.metric)) @ rng.normal(size=5)
        step *= guard.reach / np.sqrt(step @ guard.metric @ step)
        after = np.linalg.norm(safe[:, :, -1] - safe[:, :, :-1] @ step, axis=1)
        assert (after < guard.huber_threshold - guard.share * guard.reach).all()
        crossed.append((after < guard.medians) != below)
    assert np.mean(crossed) < 0.01

    def holds(share, median=0.0, huber_threshold=0.0, rms=1.0, guard=guard):
        return guard.holds(
            share * step, guard.sigma, guard.medians + median, guard.huber_threshold + huber_threshold, np.full(1, rms)
        )

    told = [holds(0.99), holds(1.01), holds(0.5, huber_threshold=-0.1), holds(0.5, median=0.5)]
    assert told == [True, False, False, False]
    # where the median bears on nothing it may move, and the mean square may not
    quiet = replace(guard, quiet=True)
    assert [holds(0.0, median=0.5, guard=quiet), holds(0.0, rms=1.5, guard=quiet)] == [True, False]


def test_columns_are_what_a_step_does_to_the_gap_and_noisier_rows_say_less(whole, grown):
    """A turn of the base turns what is left of a row, too, which is small where there is no gross error."""
    choice, point, rows = grown.choice, grown.fitted.point, whole.take(np.flatnonzero(~grown.fitted.rows.aside)[:20])
    here, names = linearised(rows, point, choice), unknown_frames(rows)
    step = 1e-6 * np.random.default_rng(0).normal(size=here.shape[2] - 1)
    flat = len(names)
    there = linearised(rows, Point(moved(point.frames, step[:flat], names), point.values + step[flat:]), choice)
    change = here[:, :, -1] - there[:, :, -1]
    assert np.allclose(change, here[:, :, :-1] @ step, atol=1e-4 * np.abs(change).max())
    noisy = replace(rows, noise_of_rows=2e-5 * (1.0 + 2.0 * (np.arange(20) == 1)), noise_position=2e-5)
    less = linearised(noisy, point, choice)
    assert np.allclose(less[0], here[0])
    assert np.allclose(3.0 * less[1], here[1])
    assert np.allclose(products(less, in_full(noisy).kept), products(here, np.ones(20)))
