"""Combinations that came near, weighed again: by old rows as the diagnosis did, by new ones as these speak."""

from dataclasses import replace

import numpy as np
import pytest
from growing_cases import EFFECTS, in_full, measured

import thermal_robot as tr
from thermal_robot.diagnosis.growing.stream import ahead, begun, runners


@pytest.fixture(scope="module")
def little():
    """A diagnosis of few rows: play of a joint is too small to be named by them."""
    small = {"joint_offset": EFFECTS["joint_offset"], "backlash": {"joint_2": 2e-5}}
    return measured(400, seed=12, effects=small), tr.diagnose


@pytest.fixture(scope="module")
def known(little):
    return tr.diagnose(little[0].take(np.arange(60)), only=["joint_offset", "backlash"])


def test_by_the_rows_of_the_diagnosis_the_order_is_its_own(found, grown):
    """Log odds against the chosen one are those of the diagnosis, to what its rounding of scales leaves."""
    e, listed = found.fit.explanation, runners(found.fit)
    chance = {c.blocks: 0.0 for c in e.combinations}
    for combination, probability in zip(e.combinations, e.probabilities, strict=True):
        chance[combination.blocks] += probability
    further = sorted({b for c in e.combinations for b in c.blocks} - {*e.best.blocks})
    assert further
    gain = ahead(grown, listed)
    told = [np.log(p / chance[e.best.blocks]) for p in sorted(chance.values(), reverse=True)[1:4]]
    assert np.allclose(np.sort(gain)[::-1][:3], told, atol=0.05)


def test_rows_that_show_more_bring_a_runner_forward(known, little):
    listed = runners(known.fit)
    with_play = [k for k, runner in enumerate(listed) if "backlash" in runner.names]
    assert known.verdict == ("joint_offset",)
    assert with_play
    before = ahead(begun(known.fit), listed)[with_play].max()
    after = ahead(begun(known.fit).plus(in_full(little[0].take(np.arange(60, 400)))), listed)[with_play].max()
    assert before < 0.0 < after


def test_prior_odds_count(found, grown):
    listed = runners(found.fit)[:1]
    likelier = [replace(listed[0], log_prior=listed[0].log_prior + 2.0)]
    assert ahead(grown, likelier)[0] - ahead(grown, listed)[0] == pytest.approx(2.0)
