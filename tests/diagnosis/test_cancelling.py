"""Effects that cancel each other are found."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE
from simulate import simulate

from thermal_robot.diagnosis.credible import cancelling, cancelling_within, credible
from thermal_robot.effects import JointGain, TransmissionError, choose
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import fit
from thermal_robot.observations import Frames, observe

JOINT = 1


def narrow(robot, seed=2):
    """A campaign in which one joint turns by half a radian about where its commands are zero."""
    plain = simulate(robot, seed=seed, noise=NOISE)[0]
    q = plain.q.copy()
    q[:, JOINT] = 0.5 * (q[:, JOINT] - q[:, JOINT].mean()) / np.ptp(q[:, JOINT])
    true = observe(replace(plain, q=q), Frames.declared(plain)).predicted_position
    noise = NOISE * np.random.default_rng(seed).normal(size=true.shape)
    return replace(plain, q=q, position=true + noise, priors={})


@pytest.fixture(scope="module")
def wheels(rv_m2):
    """A sound arm: nothing found."""
    return fit(narrow(rv_m2), choose(("joint_gain", "transmission_error")))


def holding(known, gain, wave):
    """The same fit, said to hold a gain and a wave of the joint."""
    e, joint = known.explanation, known.corrected.robot.joint_names[JOINT]
    effects = (JointGain(places=(joint,)), TransmissionError(places=(joint,)))
    items = tuple(block(known.corrected, effect) for effect in effects)
    values = [
        np.array([gain]),
        np.array([wave if "sine, order 1" in p.name.replace("cosine", "") else 0.0 for p in items[1].parameters]),
    ]
    best = replace(e.best, blocks=(0, 1))
    linear = replace(e.linear, blocks=items)
    said = replace(e, linear=linear, best=best)
    return replace(known, explanation=said, effects=tuple(zip(effects, values, strict=True)))


def test_a_gain_and_a_wave_that_undo_each_other_are_found(wheels):
    """sin q = q − q³/6: within a quarter of a radian the two differ by a hundredth."""
    (pair,) = cancelling(holding(wheels, 0.1, -0.1))
    assert set(pair.effects) == {"joint_gain", "transmission_error"}
    assert pair.sites == (("joint", wheels.corrected.robot.joint_names[JOINT]),) * 2
    assert pair.times > 50.0
    assert pair.words.startswith("joint_gain and transmission_error at joint_2 cancel each other")


@pytest.mark.parametrize("wave", [0.1, 0.0, -0.08])
def test_what_adds_up_or_opposes_by_half_does_not_cancel(wheels, wave):
    assert cancelling(holding(wheels, 0.1, wave)) == ()


def test_it_is_a_matter_of_proportion(wheels):
    (large,), (small,) = (cancelling(holding(wheels, size, -size)) for size in (0.1, 1e-4))
    assert large.times == pytest.approx(small.times, rel=1e-6)


def test_nothing_found_cancels_nothing(wheels):
    assert wheels.effects == ()
    assert cancelling(wheels) == ()
    assert list(cancelling_within(wheels)) == []
    assert credible(wheels, print) == (wheels, {})
