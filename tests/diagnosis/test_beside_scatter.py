"""Effects that a scatter feigned are not chosen beside it; those at work stay."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.prune import beside_scatter
from thermal_robot.diagnosis.values import Refused
from thermal_robot.effects import choose
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit
from thermal_robot.inference.registration import register
from thermal_robot.inference.scatter import random_gap
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import load_robot

NOISE, SIGMA = 20e-6, 4e-4  # m, rad


@pytest.mark.slow
def test_steps_of_an_encoder_feign_no_systematic_effect(rv_m2):
    step, names = 1.5e-3, []
    for seed in range(12):
        plain = simulate(rv_m2, samples=130, seed=seed, noise=20e-6)[0]
        error = np.zeros_like(plain.q)
        error[:, 1] = np.round(plain.q[:, 1] / step) * step - plain.q[:, 1]
        true = observe(plain, Frames.declared(plain), displacement=Displacement(joint=error)).predicted_position
        noise = 20e-6 * np.random.default_rng(seed).normal(size=true.shape)
        found = diagnose(replace(plain, position=true + noise, noise_position=None))
        assert found.gap.noise_source == "scatter"
        names.append(found.verdict)
    assert names.count(("encoder_resolution",)) >= 11, names


@pytest.mark.slow
def test_steps_of_two_joints_are_the_whole_verdict():
    """Twenty-six poses, each visited three times."""
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


def scattering(robot, effects=()):
    """A campaign with repeats in which joint 2 comes to rest elsewhere at each visit; effects may be at work beside."""
    rng = np.random.default_rng(4)
    once = simulate(robot, list(effects), samples=60, seed=4, noise=1e-9, ratio=(4e5, 4.2e5))[
        0
    ]  # exact; an effect of 0.7 mm
    rows = np.tile(np.arange(60), 3)
    plain = replace(once.take(rows), rows=np.arange(2, 182), noise_position=NOISE)
    error = np.zeros_like(plain.q)
    error[:, 1] = SIGMA * rng.normal(size=180)
    here = observe(plain, register(plain))
    shift = observe(plain, here.frames, displacement=Displacement(joint=error)).predicted_position
    noise = NOISE * rng.normal(size=shift.shape)
    return replace(plain, position=plain.position + shift - here.predicted_position + noise)


def concluded(campaign, names, refused=None):
    known = fit(campaign, choose(names, (), ()))
    chance = random_gap(known)
    assert chance.explains_size
    heard = []
    return beside_scatter(known, chance, refused or {}, heard.append), known


def test_scatter_explains_what_it_is_and_leaves_nothing(rv_m2):
    campaign = scattering(rv_m2)
    last, known = concluded(campaign, ("joint_offset", "backlash"))
    assert last.fit.effects == ()
    assert last.laws == ()
    assert not last.left.unexplained.flagged
    assert last.left.source == "scatter"
    assert [k.component.joint for k in last.chance.kept] == [1]
    # one sigma per axis of noise and scatter together
    lever = known.corrected.joint_sensitivity[:, :3, 1]
    expected = np.sqrt(NOISE**2 + SIGMA**2 * (lever**2).sum(axis=1).mean() / 3.0)
    assert last.left.floor == pytest.approx(expected, rel=0.15)


def test_an_effect_that_is_there_stays_beside_the_scatter(rv_m2):
    last, _ = concluded(scattering(rv_m2, ["joint_offset"]), ("joint_offset", "backlash"))
    assert [effect.name for effect, _ in last.fit.effects] == ["joint_offset"]
    assert [k.component.joint for k in last.chance.kept] == [1]


def test_what_rows_held_out_refused_is_handed_on(rv_m2):
    last, _ = concluded(scattering(rv_m2), ("joint_offset", "backlash"), {"joint_gain": Refused(0.02, -0.01)})
    assert last.refused["joint_gain"] == Refused(0.02, -0.01)
    # never offered beside the scatter: nothing else can be said of it
    assert "joint_gain" not in last.fit.families


def test_what_the_scatter_feigned_has_a_probability_below_its_prior(rv_m2):
    """The effects were chosen with the instrument's noise alone, of which the scatter is twenty times."""
    last, known = concluded(scattering(rv_m2), ("joint_offset", "backlash", "joint_gain", "transmission_error"))
    feigned = [effect.name for effect, _ in known.effects]
    assert set(feigned) <= set(last.refused)
    assert set(last.refused) == {"joint_offset", "backlash", "joint_gain", "transmission_error"}
    assert all(0.0 <= p < settings.PRIOR_PROBABILITY for p in (r.probability for r in last.refused.values()))
    assert not set(last.refused) & {effect.name for effect, _ in last.fit.effects}


def test_of_what_stays_beside_the_scatter_nothing_is_refused(rv_m2):
    last, _ = concluded(scattering(rv_m2, ["joint_offset"]), ("joint_offset", "backlash"))
    assert "joint_offset" not in last.refused
    assert last.refused["backlash"].probability < settings.PRIOR_PROBABILITY
