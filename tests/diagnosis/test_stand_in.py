"""Effects that stand in for something else, and how far the others are believed beside an unlisted cause."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE
from simulate import simulate

from thermal_robot.diagnosis.stand_in import StandIn, stand_ins, trust
from thermal_robot.effects import choose
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe


def test_an_effect_is_believed_by_its_size_beside_what_is_not_listed():
    shares = {"geometric": 0.9, "drift": 0.05, "discovered.1": 0.1}
    believed = trust(shares, {}, unlisted=0.0)
    assert believed == {"geometric": pytest.approx(0.9), "drift": 0.85}
    assert trust(shares, {}, unlisted=0.04)["geometric"] == pytest.approx(0.9 / 1.04)
    assert trust({"geometric": 0.6}, {}, unlisted=0.0) == {"geometric": 1.0}
    changing = trust({"geometric": 0.6}, {"geometric": StandIn(0.0, "time")}, unlisted=0.0)
    assert changing == {"geometric": 0.85}
    assert trust({"geometric": -0.1}, {}, unlisted=0.0) == {"geometric": 1.0}


def test_belief_and_unlisted_causes_bear_on_it_as_they_should():
    """The more is believed the more it is trusted, the more is unlisted the less; never below the floor."""
    beliefs, unlisted = np.linspace(0.0, 1.0, 11), np.linspace(0.0, 3.0, 11)
    by_belief = [trust({"drift": 0.8}, {"drift": StandIn(b, "time")}, 0.0)["drift"] for b in beliefs]
    by_rest = [trust({"drift": 0.8}, {}, u)["drift"] for u in unlisted]
    assert by_belief == sorted(by_belief)
    assert by_rest == sorted(by_rest, reverse=True)
    for found in (by_belief, by_rest):
        assert (min(found), max(found)) == (settings.BESIDE_UNLISTED, 1.0)


def with_gain(robot, size, seed=3):
    """Gain errors of four joints whose size changes in time from ``size[0]`` to ``size[1]``."""
    plain = simulate(robot, seed=seed, noise=NOISE)[0]
    clock = plain.covariates["time"]
    late = (clock - clock.min()) / np.ptp(clock)
    share = np.array([0.0, 1.0, -0.8, 1.2, 0.9])
    error = (size[0] + (size[1] - size[0]) * late)[:, None] * share * plain.q
    true = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
    noise = NOISE * np.random.default_rng(seed).normal(size=true.shape)
    kept = {name: plain.covariates[name] for name in ("time", "payload")}
    data = replace(plain, position=true + noise, covariates=kept, priors={})
    return fit(data, choose(("joint_gain",), (), ()))


def test_an_effect_that_grows_in_time_is_not_believed(rv_m2):
    doubt = stand_ins(with_gain(rv_m2, (0.0, 2e-3)))["joint_gain"]
    assert doubt.quantity == "time"
    assert doubt.belief < 1e-3


def test_an_effect_that_stays_as_it_is_is_believed(rv_m2):
    doubts = stand_ins(with_gain(rv_m2, (1e-3, 1e-3)))
    assert all(doubt.belief > 0.5 for doubt in doubts.values())


def test_without_effects_nothing_is_doubted(rv_m2):
    assert stand_ins(fit(simulate(rv_m2, seed=3)[0], ())) == {}
