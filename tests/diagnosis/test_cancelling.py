"""Effects that cancel each other: found, one of them kept, and both only where rows held out need both."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE
from simulate import simulate

from thermal_robot.diagnosis import cancelling as room
from thermal_robot.diagnosis.cancelling import Cancelling, cancelling, cancelling_within, goes_astray, one_of_each
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
    assert pair.places == (wheels.corrected.robot.joint_names[JOINT],) * 2
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
    assert one_of_each(wheels, print) == (wheels, {})


def test_rows_set_aside_count_where_a_model_goes_astray(rv_m2):
    campaign = simulate(rv_m2, ["joint_gain"], seed=4, noise=NOISE)[0]
    known = fit(campaign, choose(("joint_gain",)))
    assert known.effects
    assert goes_astray(known) == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.15)
    off = campaign.position.copy()
    off[7] += 0.01
    spoilt = fit(replace(campaign, position=off), choose(("joint_gain",)))
    assert spoilt.explanation.outliers.sum() == 1
    assert goes_astray(spoilt) == pytest.approx(0.01 * np.sqrt(3.0 / campaign.samples), rel=0.1)


@pytest.fixture(scope="module")
def both(rv_m2):
    """Gains and lost motion at work, neither of which stands for the other."""
    campaign = simulate(rv_m2, ["joint_gain", "backlash"], seed=4, noise=NOISE, ratio=(5.0, 6.0))[0]
    known = fit(campaign, choose(("joint_gain", "backlash")))
    assert {effect.name for effect, _ in known.effects} == {"joint_gain", "backlash"}
    return known


def paired(monkeypatch, known):
    """Say of a fit that two effects cancel as long as it holds both."""
    pair = Cancelling(("joint_gain", "backlash"), ("joint_2", "joint_2"), 12.0)
    monkeypatch.setattr(room, "cancelling", lambda fit: (pair,) if len(fit.effects) > 1 else ())
    return one_of_each(known, lambda _: None)


def test_two_that_rows_held_out_need_both_stay(both, monkeypatch):
    kept, refused = paired(monkeypatch, both)
    assert kept is both
    assert refused == {}


def test_the_one_without_which_rows_held_out_are_predicted_better_stays(both, monkeypatch):
    monkeypatch.setattr(room, "goes_astray", lambda fit: 1.0 if fit.blocks_of("backlash") else 1.01)
    kept, refused = paired(monkeypatch, both)
    assert [effect.name for effect, _ in kept.effects] == ["backlash"]
    (why,) = refused.values()
    assert set(refused) == {"joint_gain"}
    assert 0.0 <= why.probability <= 1.0
    assert why.reason.endswith("joint_gain is left out")
