"""What steps of encoders say counts against an effect that hides them, and against nothing else."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.diagnosis import beside as module
from thermal_robot.diagnosis.beside import beside_steps
from thermal_robot.effects import choose
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.inference.random_gap import random_gap
from thermal_robot.robot import load_robot

NAME, JOINT = "transmission_error", "joint_2"


@pytest.fixture(scope="module")
def doubtful(rv_m2):
    """A fit that holds an effect, from one seed after another until its odds lie between 9 and e⁸."""
    for seed in range(40):
        known = fit(simulate(rv_m2, [NAME], seed=seed, samples=70, ratio=(0.4, 0.6))[0], choose([NAME], (), ()))
        if known.names_of(known.explanation.best) == {NAME} and np.log(9.0) < log_odds(known) < 8.0:
            return known
    raise AssertionError("no seed makes such a campaign")


def log_odds(known):
    return np.log(known.probability_of_just({NAME}) / known.probability_of_just(frozenset()))


def told(monkeypatch, known, factor, seen_without):
    """What becomes of a fit in which steps show with one Bayes factor, and with another once an effect is out."""
    joint = (*known.effects[0][0].places, JOINT)[0]  # one in which the effect acts
    with_it = SimpleNamespace(steps={joint: factor}, seen=factor)
    without = SimpleNamespace(steps={joint: seen_without}, seen=seen_without)
    monkeypatch.setattr(module, "random_gap", lambda other: with_it if other.effects else without)
    return beside_steps(known, with_it, {}, lambda _: None)


def test_an_effect_goes_where_steps_say_more_than_its_odds(monkeypatch, doubtful):
    odds = log_odds(doubtful)
    for excess in (0.5, 3.0):
        left, chance, refused = told(monkeypatch, doubtful, -1.0, odds - 1.0 + excess)
        assert left.effects == ()
        assert chance.seen == odds - 1.0 + excess
        # the odds that are left, as a probability
        assert refused[NAME].probability / (1.0 - refused[NAME].probability) == pytest.approx(np.exp(-excess))


def test_it_stays_where_its_odds_outweigh_them_or_steps_are_seen_beside_it(monkeypatch, doubtful):
    for factor, without in ((-1.0, log_odds(doubtful) - 1.5), (2.0, 50.0)):
        left, chance, refused = told(monkeypatch, doubtful, factor, without)
        assert left is doubtful
        assert (chance.seen, refused) == (factor, {})


def test_an_effect_that_is_sure_is_not_tried_without(monkeypatch, rv_m2):
    known = fit(simulate(rv_m2, [NAME], seed=1, samples=70, ratio=(4.0, 4.1))[0], choose([NAME], (), ()))
    assert log_odds(known) > settings.STEPS_REACH
    assert told(monkeypatch, known, -1.0, 100.0)[0] is known


def test_an_effect_elsewhere_is_not_tried_without(monkeypatch, doubtful):
    """Steps of a joint that the effect has no part in are hidden by something else."""
    chance = SimpleNamespace(steps={"joint_9": -1.0}, seen=-1.0)
    monkeypatch.setattr(module, "random_gap", lambda _: SimpleNamespace(steps={}, seen=100.0))
    assert beside_steps(doubtful, chance, {}, lambda _: None)[0] is doubtful


def test_without_scatter_nothing_changes(doubtful):
    chance = random_gap(doubtful)
    assert not chance.steps
    refused = {"drift": object()}
    assert beside_steps(doubtful, chance, refused, lambda _: None) == (doubtful, chance, refused)


@pytest.mark.slow
def test_steps_of_two_joints_are_the_whole_verdict():
    """Twenty-six poses, each visited three times."""
    from thermal_robot import diagnose
    from thermal_robot.kinematics import Displacement
    from thermal_robot.observations import Frames, observe

    robot, verdicts = load_robot("example-robot-data:ur10", "tool0"), []
    for seed in range(8):
        once = simulate(robot, samples=26, seed=seed, noise=25e-6)[0]
        plain = replace(once.take(np.tile(np.arange(26), 3)), rows=np.arange(2, 80), noise_position=25e-6)
        error = np.zeros_like(plain.q)
        for joint, step in ((0, 4e-4), (3, 1.5e-3)):
            error[:, joint] = np.round(plain.q[:, joint] / step) * step - plain.q[:, joint]
        moved = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
        noise = 25e-6 * np.random.default_rng(seed).normal(size=moved.shape)
        verdicts.append(diagnose(replace(plain, position=moved + noise)).verdict)
    assert verdicts.count(("encoder_resolution",)) >= 7, verdicts
