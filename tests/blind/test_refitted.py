"""Every subset of a model fitted alone: the whole is the model, none is the frames."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.blind.examinee import refitted
from thermal_robot.blind.score import shares
from thermal_robot.inference.registration import register
from thermal_robot.observations import observe
from thermal_robot.robot import load_robot

NOISE = 25e-6


@pytest.fixture(scope="module")
def case():
    robot = load_robot("builtin:rv_m2", "tool0")
    asked = ("drift", "joint_gain")
    campaign, _, (samples, position) = simulate(robot, asked, seed=4, samples=80, fresh=200)
    found = diagnose(campaign, only=asked)
    assert set(found.verdict) == set(asked)
    return found, campaign, samples, position, refitted(found, campaign, samples)


def rms(difference):
    return float(np.sqrt((difference**2).sum(axis=1).mean()))


def test_all_effects_together_predict_what_the_model_does(case):
    found, _, samples, _, predicted = case
    names = "+".join(effect.name for effect, _ in found.model.effects)
    assert rms(predicted[names] - found.model.predict(samples)[0]) < 0.3 * NOISE


def test_without_effects_the_frames_are_those_of_least_squares(case):
    """No rigid alignment leaves less of the rows that were given, the robust one of the program neither."""
    found, campaign, _, _, _ = case
    alone = refitted(found, campaign, campaign)[""]
    robust = observe(campaign, register(campaign)).predicted_position
    assert rms(alone - campaign.position) < (1.0 + 1e-4) * rms(robust - campaign.position)
    assert rms(alone - campaign.position) > 0.8 * rms(robust - campaign.position)


def test_every_subset_is_there_and_more_effects_err_less(case):
    _, _, _, position, predicted = case
    assert sorted(map(len, (name.split("+") for name in predicted if name))) == [1, 1, 2]
    left = {name: rms(rows - position) for name, rows in predicted.items()}
    both = max(left, key=len)
    assert all(left[""] > left[name] > left[both] for name in left if name not in ("", both))
    found = shares(predicted, position, NOISE)
    whole = (left[""] ** 2 - left[both] ** 2) / (left[""] ** 2 + 3 * NOISE**2)
    assert sum(found.values()) == pytest.approx(whole)


def test_a_model_without_effects_has_no_parts(case):
    found, campaign, samples, _, _ = case
    bare = replace(found, model=replace(found.model, effects=()))
    assert refitted(bare, campaign, samples) == {}


def test_known_frames_are_not_fitted(case):
    """Without effects and without unknown frames nothing is fitted: the nominal robot predicts."""
    _, campaign, samples, _, _ = case
    frames = register(campaign)
    inside = (campaign.position - frames.base[:3, 3]) @ frames.base[:3, :3]
    declared = {"base_known": True, "tool_known": True, "target": frames.tool[:3, 3]}
    known = replace(campaign, position=inside, **declared)
    asked = replace(samples, **declared)
    found = diagnose(known, only=("drift", "joint_gain"))
    assert found.model.effects
    predicted = refitted(found, known, asked)[""]
    np.testing.assert_allclose(predicted, observe(asked).predicted_position, atol=1e-12)
