"""Intervals held against what is true."""

import numpy as np
import pytest
from blind_records import NOISE, crash, effect, record, said

from thermal_robot.blind.score import coverage


def estimate(value, std, name="scale error, instrument", identified=True):
    return {"name": name, "value": value, "std": std, "unit": "1", "identified": identified}


def case(*estimates, true, **more):
    answer = said(effect("instrument_scale", parameters=list(estimates)))
    return record("single", answer, ["instrument_scale"], parameters={"instrument_scale": true}, **more)


def test_who_states_the_spread_that_he_has_holds_95_percent_and_who_halves_it_does_not():
    rng = np.random.default_rng(1)
    errors = rng.normal(size=4000)
    name = "scale error, instrument"
    honest = coverage([case(estimate(e, 1.0), true={name: 0.0}) for e in errors])
    boast = coverage([case(estimate(e, 0.5), true={name: 0.0}) for e in errors])
    # 4000 draws tell 95 % to 0.35 % (one sigma); half the width holds 67.3 % of a normal law
    assert honest.parameters.value == pytest.approx(0.95, abs=0.015)
    assert boast.parameters.value == pytest.approx(0.673, abs=0.03)


def test_only_what_is_identified_and_known_of_a_right_answer_counts():
    name = "scale error, instrument"
    right = case(estimate(1.0, 1.0), true={name: 0.0})
    assert coverage([right]).parameters.trials == 1
    assert coverage([case(estimate(None, None, identified=False), true={name: 0.0})]).parameters.trials == 0
    assert coverage([case(estimate(1.0, 1.0), true={})]).parameters.trials == 0
    flagged = {**right, "said": {**right["said"], "verdict": {**right["said"]["verdict"], "unexplained": True}}}
    more = {**right, "said": said(effect("instrument_scale", parameters=[estimate(1.0, 1.0)]), effect("drift"))}
    for wrong in (flagged, more, crash("single", "instrument_scale")):
        assert coverage([wrong]).parameters.trials == 0


def test_shrinkage_is_held_against_fresh_rows_with_the_noise_in_it():
    """Gap 10 σ, remainder 1 σ, rms distances; each with 3 σ² of noise: 1 − 4/103."""
    one = record("single", said(effect("drift", shrinkage=0.9)), ["drift"])
    reached = 1.0 - 4.0 / 103.0
    for interval, inside in (((reached - 1e-9, reached + 1e-9), 1), ((0.98, 1.0), 0)):
        held = {**one["said"]["gap"]["held_out"], "shrinkage_ci95": interval}
        told = {**one, "said": {**one["said"], "gap": {"held_out": held}}}
        found = coverage([told]).shrinkage
        assert (found.successes, found.trials) == (inside, 1)
        # a verdict that names nothing claims nothing
        assert coverage([{**told, "said": {**told["said"], **{"verdict": said()["verdict"]}}}]).shrinkage.trials == 0


def test_shares_are_held_against_those_of_fresh_rows():
    answer = said(effect("drift", shrinkage_ci95=[0.5, 0.7]), effect("backlash", shrinkage_ci95=[0.2, 0.3]))
    one = record("pair", answer, ["drift", "backlash"])
    one["fresh"] = {"rms_before": 10 * NOISE, "rms_after": NOISE, "shares": {"drift": 0.6, "backlash": 0.31}}
    found = coverage([one]).shares
    assert (found.successes, found.trials) == (1, 2)
