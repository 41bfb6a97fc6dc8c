"""Whether probabilities hold, from cases whose answer is known."""

import numpy as np
import pytest
from blind_records import J1, L2, crash, effect, record, said

from thermal_robot.blind.score import calibration, reliability


def test_calibration_is_as_computed_by_hand():
    p = np.array([0.02, 0.04, 0.62, 0.68, 0.64, 1.0])
    found = reliability(p, np.array([False, False, True, False, True, True]))
    # bin 0: mean .03, 0 of 2; bin 6: mean .6467, 2 of 3; bin 9: mean 1, 1 of 1
    assert [b.present.trials for b in found.bins] == [2, 0, 0, 0, 0, 0, 3, 0, 0, 1]
    assert found.bins[6].mean == pytest.approx(1.94 / 3)
    assert found.error == pytest.approx((2 * 0.03 + abs(1.94 - 2.0) + 0.0) / 6)


def test_calibration_counts_what_is_clearly_there_or_clearly_not():
    effects = [effect("drift", 0.6), effect("backlash", 0.2), effect("joint_gain", 0.4), effect("geometric", 0.7)]
    effects += [effect("joint_offset", 0.03), effect("tracking_lag", None, "not_testable")]
    parts = {"joint_gain": 0.3, "geometric": 0.6, "joint_offset": 0.05}
    cases = [record("mixed", said(*effects), ["drift"], parts), record("removed", said(effect("drift", 0.5)))]
    cases.append(record("hard", said(effect("backlash", 0.5), effect("drift", 0.5)), ["drift"], {"backlash": 0.15}))
    cases.append(record("single", said(effect("drift", 0.5)), ["drift"]))
    found = calibration([*cases, crash("mixed", "drift")])
    # joint_gain is neither; the removed, the hard, the single and the failed case say nothing
    assert found.all.trials == 4
    assert found.doubtful.trials == 3
    assert found.doubtful.error == pytest.approx((0.4 + 0.2 + 0.3) / 3)
    assert found.all.error == pytest.approx((0.4 + 0.2 + 0.3 + 0.03) / 4)


def test_a_law_counts_as_right_where_place_or_neighbour_and_quantity_are():
    true = {"unlisted": "cable", "places": [J1], "near": [J1, L2], "quantities": ["time"]}
    laws = [effect("discovered.1", 0.8, places=[L2], quantity="time"), effect("discovered.2", 0.6, quantity="payload")]
    found = calibration([record("mixed", said(*laws, flagged=True), **true)])
    assert (found.all.bins[8].present.successes, found.all.bins[8].present.trials) == (1, 1)
    assert (found.all.bins[6].present.successes, found.all.bins[6].present.trials) == (0, 1)
    # without a cause no law is right
    assert calibration([record("mixed", said(laws[0], flagged=True))]).all.bins[8].present.successes == 0


def test_who_says_what_is_so_has_no_error_and_who_boasts_has_his_boast():
    rng = np.random.default_rng(0)
    p = rng.random(20000)
    there = rng.random(20000) < p
    honest = reliability(p, there)
    # ten bins of 2000: what is left is their counting error, 1 % and less
    assert honest.error < 0.015
    assert sum(b.present.trials for b in honest.bins) == honest.trials == 20000
    assert all(b.low <= b.mean <= b.high for b in honest.bins)
    boast = reliability(np.full(20000, 0.95), rng.random(20000) < 0.5)
    assert boast.error == pytest.approx(0.45, abs=0.02)
    assert boast.bins[-1].present.trials == 20000


def test_the_order_of_the_cases_tells_nothing():
    rng = np.random.default_rng(1)
    p, there = rng.random(300), rng.random(300) < 0.4
    mixed = rng.permutation(300)
    one, other = reliability(p, there), reliability(p[mixed], there[mixed])
    assert [b.present for b in one.bins] == [b.present for b in other.bins]
    assert one.error == pytest.approx(other.error, abs=1e-12)


def test_without_probabilities_there_is_no_error():
    assert calibration([]).all.error is None
    assert calibration([record("null", said())]).all.trials == 0
