"""Rows added a few at a time: the same as all at once, whatever the order and the batches, and few are looked at."""

from dataclasses import replace

import numpy as np
import pytest
from growing_cases import ALL, OLD, far, in_full

from thermal_robot.diagnosis.growing import grown as module
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Judge
from thermal_robot.diagnosis.growing.grown import Grown
from thermal_robot.diagnosis.growing.settled import Begin, Single
from thermal_robot.diagnosis.growing.stream import begun, weighed

PROMISED = 1e-6


def added(start, whole, parts):
    for part in parts:
        start = start.plus(in_full(whole.take(part)))
    return start


@pytest.fixture
def few(monkeypatch):
    """Keep as few rows that most are in the sums."""
    monkeypatch.setattr(settings, "KEPT", 150)


@pytest.fixture(scope="module")
def once(found, whole):
    """All rows fitted together, each looked at."""
    return begun(found.fit).plus(in_full(whole.take(np.arange(OLD, ALL)))).fitted


@pytest.mark.parametrize(("batches", "seed"), [(1, 0), (4, 1), (12, 2)])
def test_batches_and_order_do_not_matter(found, whole, once, few, batches, seed):
    order = OLD + np.random.default_rng(seed).permutation(ALL - OLD)
    start = begun(found.fit)
    assert start.sums.rows > 700
    last = added(start, whole, np.array_split(order, batches)).fitted
    assert far(last, once) < PROMISED
    assert last.noise == pytest.approx(once.noise, rel=PROMISED)
    assert last.squares == pytest.approx(once.squares, rel=PROMISED)
    assert last.count == once.count


def test_it_is_a_fresh_fit_of_the_same_choice(fresh, once):
    assert far(once, begun(fresh.fit).fitted) < PROMISED


def test_old_rows_are_looked_at_only_where_it_says_so(found, whole, few, monkeypatch):
    seen, plain = [], module.settled
    monkeypatch.setattr(
        module, "settled", lambda c, s, rows, b: (seen.append(len(rows.weights)), plain(c, s, rows, b))[1]
    )
    start, looked = begun(found.fit), []
    for k in range(10):
        seen.clear()
        start = start.plus(in_full(whole.take(np.arange(OLD + 20 * k, OLD + 20 * k + 20))))
        looked.append((max(seen), start.anew))
    assert all(rows < 400 for rows, _ in looked)
    assert sum(anew for _, anew in looked) < 5


def test_no_rows_change_nothing(grown, whole):
    assert far(grown.plus(in_full(whole.take([]))).fitted, grown.fitted) < 1e-8


def test_a_jump_of_the_robot_is_followed_by_looking_at_all_rows(found, whole, few):
    """Rows that move the parameters far leave the reach of the sums; the answer is still that of all rows."""
    rows = whole.take(np.arange(OLD, ALL))
    q = rows.q + np.array([0.0, 3e-4, 0.0, 0.0, 0.0])
    moved = in_full(replace(rows, position=rows.position + 1e-3 * np.sin(q[:, 1:4])))
    few_rows = begun(found.fit).plus(moved)
    assert few_rows.anew
    settings.KEPT = 10_000
    assert far(few_rows.fitted, begun(found.fit).plus(moved).fitted) < 1e-5


def with_held_weights(found):
    """The diagnosis as if it had found more than noise: rows keep their weights."""
    e, start = found.fit.explanation, begun(found.fit)
    judge = Judge(start.fitted.point, e.whitening.noise * e.best.noise, found.samples)
    rows = Single(found.fit.campaign, e.whitening.weights, e.outliers)
    return Grown.of(replace(start.choice, judge=judge), (rows,), Begin.about(start.fitted))


@pytest.mark.parametrize("batches", [1, 5])
def test_where_weights_are_held_batches_do_not_matter_either(found, whole, few, batches, monkeypatch):
    start = with_held_weights(found)
    assert start.sums.rows > 300
    for part in np.array_split(np.arange(OLD, ALL), batches):
        start = start.plus(weighed(start.choice, whole.take(part)))
    monkeypatch.setattr(settings, "KEPT", 10_000)
    once = with_held_weights(found)
    once = once.plus(weighed(once.choice, whole.take(np.arange(OLD, ALL)))).fitted
    assert far(start.fitted, once) < 5.0 * PROMISED
    assert start.fitted.noise == pytest.approx(once.noise, rel=PROMISED)
    assert start.fitted.count == once.count
