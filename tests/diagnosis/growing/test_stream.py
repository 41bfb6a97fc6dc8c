"""What makes a choice fall, said in plain words; and what does not."""

from dataclasses import replace

import numpy as np
import pytest
from growing_cases import EFFECTS, measured

import thermal_robot as tr
from thermal_robot.diagnosis.growing.stream import Stream, _beyond, expected_sizes
from thermal_robot.errors import EstimationError

ASKED = ["joint_offset", "backlash"]


@pytest.fixture(scope="module")
def known():
    return tr.diagnose(measured(200, seed=50), only=ASKED)


@pytest.fixture(scope="module")
def stream(known):
    return Stream.of(known.fit)


def after(stream, known, rows):
    return stream.plus(rows, known.model.spread)


def test_more_of_the_same_lets_the_choice_stand(stream, known):
    for seed in range(5):
        assert after(stream, known, measured(40, seed=60 + seed)).fallen == ()


def test_play_that_begins_makes_it_fall_and_it_stays_so(stream, known):
    worn = {**EFFECTS, "backlash": {**EFFECTS["backlash"], "joint_4": 3e-4}}
    fallen = after(stream, known, measured(60, seed=7, effects=worn))
    assert any("backlash" in reason and "joint_4" in reason for reason in fallen.fallen)
    assert after(fallen, known, measured(40, seed=61)).fallen[: len(fallen.fallen)] == fallen.fallen


def test_more_noise_makes_it_fall(stream, known):
    rows = measured(60, seed=8)
    louder = replace(rows, position=rows.position + 2e-5 * np.random.default_rng(0).normal(size=(60, 3)))
    assert any("times the mean square" in reason for reason in after(stream, known, louder).fallen)


def test_rows_elsewhere_make_it_fall(known, stream):
    rows = measured(40, seed=9)
    narrow = {name: (-0.5, 0.5) for name in known.model.spread.ranges if name == "joint_1"}
    said = stream.plus(rows, replace(known.model.spread, ranges=narrow)).fallen
    assert any("outside of what was measured, in joint_1" in reason for reason in said)


def test_an_effect_that_can_be_tested_now_makes_it_fall():
    campaign = measured(240, seed=51)
    hall = replace(
        campaign, covariates={**campaign.covariates, "temperature": np.where(np.arange(240) < 200, 22.0, 30.0)}
    )
    known = tr.diagnose(hall.take(np.arange(200)), only=[*ASKED, "thermal_elongation"])
    assert known.finding("thermal_elongation").status == "not_testable"
    said = Stream.of(known.fit).plus(hall.take(np.arange(200, 240)), None).fallen
    assert any("thermal_elongation could not be tested" in reason for reason in said)


def test_no_rows_say_nothing(stream, known):
    assert after(stream, known, measured(40).take([])).fallen == ()


def test_what_is_drawn_anew_in_every_pose_is_left_to_a_fresh_diagnosis(known):
    fit = known.fit
    e = replace(fit.explanation, whitening=replace(fit.explanation.whitening, smooth=object()))
    with pytest.raises(EstimationError, match="diagnose old and new rows together"):
        Stream.of(replace(fit, explanation=e))


def test_expected_sizes_are_those_of_the_priors(stream, known):
    e = known.fit.explanation
    told = np.concatenate([e.linear.blocks[b].sizes * e.best.scales[b] for b in e.best.blocks])
    assert np.allclose(expected_sizes(stream), told, rtol=0.02)


def test_rows_are_outside_by_chance_as_often_as_is_stated(stream, known):
    """Outermost rows are new ones now and then; many of them hardly ever."""
    rng, said, spread = np.random.default_rng(0), 0, known.model.spread
    rows = measured(400, seed=70)
    for _ in range(200):
        order = rng.permutation(400)
        old, new = rows.q[order[:60]], rows.take(order[60:90])
        ends = zip(rows.robot.joint_names, old.min(axis=0), old.max(axis=0), strict=True)
        said += bool(list(_beyond(replace(spread, ranges={n: (a, b) for n, a, b in ends}), new, 60)))
    assert said <= 2


def test_a_combination_that_is_ahead_makes_it_fall_as_long_as_it_is(stream):
    ahead = replace(stream, rival=("joint_gain",), lead=1.5)
    assert any("speak for joint_gain, rather than joint_offset and backlash (odds 4.5 : 1)" in r for r in ahead.reasons)
    assert replace(ahead, lead=-0.1).reasons == ()
