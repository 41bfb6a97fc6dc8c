"""How far the gap shrinks: claimed, and reached."""

import numpy as np
import pytest
from blind_records import NOISE, crash, effect, record, said

from thermal_robot.blind.score import fresh_ratio, shrinkage, spread, worse


def test_claims_are_compared_with_the_noise_taken_off():
    case = record("single", said(effect("drift")), ["drift"])
    found = shrinkage([case])
    assert found.pairs[0].claimed == pytest.approx(1 - (4 - 3) / (100 - 3))
    assert found.pairs[0].real == pytest.approx(0.99)
    assert found.median_absolute_difference == pytest.approx(1 / 97 - 0.01)
    # real campaigns hold the noise in both
    assert shrinkage([{**case, "kind": "real"}]).pairs[0].claimed == pytest.approx(0.96)
    case["said"]["gap"]["held_out"] = {"rms_before": 10 * NOISE, "rms_after": NOISE}
    assert shrinkage([case]).pairs[0].claimed == 1.0
    # 3 σ² + 3 (σ/2)²: below that there is no gap to shrink
    case["said"]["gap"]["held_out"]["rms_before"] = np.sqrt(3.74) * NOISE
    assert shrinkage([case]).pairs == ()


def test_a_model_that_is_right_leaves_nothing_and_one_that_is_off_by_the_noise_leaves_one():
    case = record("single", said(effect("drift")), ["drift"])
    for rms, ratio in ((0.0, 0.0), (NOISE * 3.0**0.5, 1.0), (NOISE, 3.0**-0.5)):
        assert fresh_ratio({**case, "fresh": {"rms_before": 1.0, "rms_after": rms}}) == pytest.approx(ratio)
    assert fresh_ratio({**case, "fresh": None}) is fresh_ratio(crash("single", "drift")) is None


def test_a_case_without_a_gap_or_without_an_answer_makes_no_pair():
    case = record("single", said(effect("drift")), ["drift"])
    flat = {**case, "fresh": {"rms_before": 0.0, "rms_after": 0.0}}
    found = shrinkage([flat, crash("single", "drift"), {**case, "fresh": None}])
    assert (found.pairs, found.median_absolute_difference) == ((), None)


def test_a_model_is_worse_than_none_where_it_names_something_and_errs_more():
    good = record("single", said(effect("drift", shrinkage=0.9)), ["drift"])
    bad = {**good, "fresh": {"rms_before": NOISE, "rms_after": 1.1 * NOISE}}
    silent = {**bad, "said": said()}  # names nothing: it is the frames alone
    scattering = {**bad, "said": said(effect("encoder_resolution", shrinkage=0.0))}
    found = worse([good, bad, silent, scattering, crash("single", "drift"), {**good, "fresh": None}])
    assert (found.successes, found.trials) == (1, 4)


def test_the_spread_of_nothing_is_nothing():
    assert (spread([]).count, spread([]).median, spread([]).q90) == (0, None, None)
    found = spread(range(101))
    assert (found.count, found.median, found.q90) == (101, 50.0, 90.0)
