"""What it takes to be found: counts, and the curve."""

import numpy as np
import pytest
from blind_records import effect, record, said, trial

from thermal_robot.blind.score import Rate, detection, logistic


def test_the_curve_of_detection_is_recovered():
    rng = np.random.default_rng(3)
    size, rows = np.exp(rng.uniform(-1.0, 2.0, 6000)), np.exp(rng.uniform(3.0, 5.3, 6000))
    chance = 1.0 / (1.0 + np.exp(-(-8.0 + 3.0 * np.log(size) + 2.0 * np.log(rows))))
    curve = logistic(size, rows, rng.random(6000) < chance)
    fitted = np.array([curve.intercept, curve.ratio, curve.samples])
    assert np.all(np.abs(fitted - [-8.0, 3.0, 2.0]) < 3.0 * np.array(curve.std))
    assert np.array(curve.std) == pytest.approx([0.3, 0.1, 0.08], rel=0.5)
    # 8 + ln 9 = 2 ln n where the effect is as large as the noise
    assert curve.needed[0].samples == pytest.approx(np.exp(5.0986), rel=0.1)
    assert curve.needed[1].samples == pytest.approx(np.exp(5.0986 - 1.5 * np.log(2.0)), rel=0.1)


def test_separable_cases_do_not_diverge():
    size, rows = np.array([0.5, 0.6, 2.0, 3.0]), np.array([40.0, 90.0, 50.0, 80.0])
    curve = logistic(size, rows, size > 1.0)
    assert 0.0 < curve.ratio < 30.0
    assert all(np.isfinite(curve.std))
    assert curve.over_ratio[0].chance[0] < 0.1 < 0.9 < curve.over_ratio[0].chance[-1]


def test_detection_is_counted_by_size_and_by_rows():
    found = detection(trial())
    rates = {s.low: (s.found.successes, s.found.trials) for s in found.ratio}
    # a3 of 0.8; a2 and h1 of 1.2 and 1.4; a1 and the failed a4 of 3
    assert {low: r for low, r in rates.items() if r[1]} == {0.7: (0, 1), 1.0: (2, 2), 3.0: (1, 2)}
    rates = {s.low: (s.found.successes, s.found.trials) for s in found.samples}
    assert {low: r for low, r in rates.items() if r[1]} == {30: (1, 2), 100: (2, 3)}
    assert found.table[3][1] == Rate(1, 1)
    assert sum(r.trials for row in found.table for r in row) == 5
    assert detection([trial()[0]]).curve is None  # all found: nothing to fit


def sized(*sizes_rows_hits):
    """Records of one effect each: its size, the rows of its campaign, whether it is found."""
    return [
        record("single", said(effect("drift")) if hit else said(), ["drift"], {"drift": size}, samples=rows)
        for size, rows, hit in sizes_rows_hits
    ]


def test_the_table_adds_up_to_the_steps():
    rng = np.random.default_rng(2)
    found = detection(
        sized(*zip(rng.uniform(0.3, 8.0, 60), rng.integers(20, 300, 60), rng.random(60) < 0.6, strict=True))
    )
    for k, step in enumerate(found.ratio):
        assert step.found == Rate(sum(r.successes for r in found.table[k]), sum(r.trials for r in found.table[k]))
    for m, step in enumerate(found.samples):
        column = [row[m] for row in found.table]
        assert step.found == Rate(sum(r.successes for r in column), sum(r.trials for r in column))
    assert sum(s.found.trials for s in found.ratio) == sum(s.found.trials for s in found.samples) == 60


def test_a_size_on_an_edge_belongs_to_the_larger_step_and_an_unknown_one_to_none():
    found = detection(sized((1.0, 45, True), (None, 45, True), (100.0, 10_000, True)))
    assert {s.low: s.found.trials for s in found.ratio if s.found.trials} == {1.0: 1, 6.0: 1}
    assert {s.low: s.found.trials for s in found.samples if s.found.trials} == {45: 1, 200: 1}
    assert (found.ratio[-1].high, found.samples[-1].high) == (None, None)


def test_the_curve_does_not_depend_on_the_unit_of_the_size():
    rng = np.random.default_rng(4)
    size, rows = np.exp(rng.uniform(-1.0, 2.0, 400)), np.exp(rng.uniform(3.0, 5.3, 400))
    hit = np.log(size) + 0.5 * np.log(rows) + rng.logistic(0.0, 0.5, 400) > 2.5
    one, other = logistic(size, rows, hit), logistic(10.0 * size, rows, hit)
    assert (other.ratio, other.samples) == pytest.approx((one.ratio, one.samples), rel=1e-4)
    assert other.std[1:] == pytest.approx(one.std[1:], rel=1e-4)
    for a, b in zip(one.over_samples, other.over_samples, strict=True):
        assert b.other == pytest.approx(10.0 * a.other)
        assert b.chance == pytest.approx(a.chance, abs=1e-4)
    # more of either finds more
    assert all(np.all(np.diff(line.chance) > 0.0) for line in (*one.over_ratio, *one.over_samples))


def test_no_number_of_rows_is_told_where_more_rows_find_less():
    rng = np.random.default_rng(5)
    size, rows = np.exp(rng.uniform(-1.0, 2.0, 400)), np.exp(rng.uniform(3.0, 5.3, 400))
    curve = logistic(size, rows, np.log(size) - np.log(rows) + rng.logistic(0.0, 0.5, 400) > -3.5)
    assert curve.samples < 0.0 < curve.ratio
    assert [needed.samples for needed in curve.needed] == [None, None]
