"""How far a prediction may be off: against refits with fresh noise, and beyond what was measured."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

import thermal_robot as tr
from thermal_robot import Campaign, CorrectedModel, diagnose
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.columns import block
from thermal_robot.prediction import sensitivity

NOISE = 25e-6


@pytest.fixture(scope="module")
def warm(rv_m2):
    campaign, _, (fresh, _) = simulate(rv_m2, ["thermal_elongation"], seed=3, fresh=200)
    return campaign, diagnose(campaign, only="thermal_elongation"), fresh


def test_a_step_of_frames_and_parameters_moves_the_prediction_as_its_columns_say(warm):
    campaign, found, _ = warm
    ((effect, values),) = found.model.effects
    model = replace(found.model, spread=None)
    moved = sensitivity(found.fit.corrected, [effect])[:, :, -len(values) :]
    for p, size in enumerate(block(found.fit.corrected, effect).sizes):
        step = np.zeros(len(values))
        step[p] = 1e-3 * size
        there, here = (replace(model, effects=((effect, v),)).prediction(campaign)[0] for v in (values + step, values))
        np.testing.assert_allclose((there - here) / step[p], moved[:, :, p], rtol=0, atol=2e-3 * np.abs(moved).max())


@pytest.mark.slow
def test_deviations_are_those_of_refits_with_fresh_noise(warm):
    """The spread of many fits to the same robot, each with noise of its own, is what one of them says of itself."""
    campaign, found, fresh = warm
    rng, exact, predicted = np.random.default_rng(8), found.model.prediction(campaign)[0], []
    for _ in range(12):
        again = replace(campaign, position=exact + rng.normal(scale=NOISE, size=exact.shape))
        predicted.append(diagnose(again, only="thermal_elongation").model.prediction(fresh)[0])
    spread = np.std(predicted, axis=0, ddof=1)
    told = replace(found.model, spread=replace(found.model.spread, beyond=np.zeros(3))).prediction(fresh).std
    assert 0.85 < np.sqrt((spread**2).mean() / (told**2).mean()) < 1.15


def test_noise_is_counted_where_it_is_asked_for(warm):
    _, found, fresh = warm
    spread = found.model.spread
    less, more = (found.model.prediction(fresh, noise=noise).std for noise in (False, True))
    np.testing.assert_allclose(more**2 - less**2, np.broadcast_to(spread.noise**2, less.shape), rtol=1e-9)
    # what neither frames nor effects tell is added, and 120 rows tell that to a tenth of the noise
    assert np.sqrt((spread.noise**2 + spread.beyond**2).mean()) == pytest.approx(NOISE, rel=0.19)


def test_a_row_outside_what_was_measured_is_marked_and_less_sure(warm):
    campaign, found, fresh = warm
    hot = {**fresh.covariates, "temperature": np.full(fresh.samples, campaign.covariates["temperature"].max() + 30.0)}
    q = fresh.q.copy()
    q[:, 1] = campaign.q[:, 1].max() + np.linspace(0.0, 0.5, fresh.samples)
    inside, warmer = found.model.prediction(fresh), found.model.prediction(replace(fresh, covariates=hot))
    farther = found.model.prediction(replace(fresh, q=q))
    assert np.mean([not names for names in inside.outside]) > 0.9
    assert all("temperature" in names for names in warmer.outside)
    assert farther.outside[0] in ((), *inside.outside)
    assert all("joint_2" in names for names in farther.outside[20:])
    assert (warmer.std.mean(axis=1) > 1.5 * inside.std.mean(axis=1)).mean() > 0.95
    # a column that is not read does not mark
    heavy = {**fresh.covariates, "payload": np.full(fresh.samples, 99.0)}
    assert found.model.prediction(replace(fresh, covariates=heavy)).outside == inside.outside
    assert set(found.model.spread.ranges) == {*campaign.robot.joint_names, "temperature"}
    # nor does a held joint that reads a microradian more
    model = found.model
    joint, q = model.robot.joint_names[0], np.zeros((3, model.robot.n))
    q[:, 0] = [0.2, 0.2 + 3e-6, 0.21]
    spread = replace(model.spread, ranges={joint: (0.2, 0.2)})
    assert spread.outside(Campaign("held", model.robot, q)) == ((), (), (joint,))


def test_a_saved_model_is_as_sure(warm):
    _, found, fresh = warm
    again = CorrectedModel.from_dict(found.model.to_dict()).prediction(fresh, noise=True)
    whole = found.model.prediction(fresh, noise=True)
    np.testing.assert_allclose(again.std, whole.std, rtol=1e-9)
    assert again.outside == whole.outside
    # and a command as the prediction at its joint positions
    commands = found.model.corrected_commands(fresh.take([0, 1, 2]))
    there = found.model.prediction(replace(fresh.take([0, 1, 2]), q=commands.q))
    np.testing.assert_allclose(commands.std, there.std, rtol=1e-9)
    assert commands.outside == there.outside
    # who takes effects out is told no deviation
    assert np.isnan(replace(found.model, effects=(), needs=()).prediction(fresh).std).all()
    assert np.isnan(replace(found.model, spread=None).prediction(fresh).std).all()


@pytest.mark.slow
def test_a_session_that_was_not_seen_is_said_and_widens_the_deviation():
    """Of five sessions, in each of which the tool sits a millimetre elsewhere, and of forty other ones."""
    rng, labels = np.random.default_rng(5), ("a", "b", "c", "d", "e")
    levels = {"shape": "levels", "marks": tuple(map(float, range(5))), "span": 4.0, "labels": labels, "turns": False}
    law = Discovered(kind="tool", place="tool", quantity="session", **levels)
    how = {"tool_frame": "tool0", "rows": 100, "conditions": {"session": np.repeat(labels, 20)}}
    places = rng.normal(0.0, 1e-3, (5, 3))
    found = diagnose(
        tr.simulate("builtin:rv_m2", {law: places.ravel()}, noise=20e-6, seed=3, **how), only="joint_offset"
    )
    assert found.verdict == ("discovered.1",)
    others = [
        tr.simulate("builtin:rv_m2", {law: np.tile(place, 5)}, seed=4, **how)
        for place in rng.normal(0.0, 1e-3, (40, 3))
    ]
    rows = replace(others[-1], position=None)
    unseen = replace(rows, labels={"session": np.full(100, "x")})
    new, known = found.model.prediction(unseen), found.model.prediction(rows)
    assert all("session" in names for names in new.outside)
    z2 = ((np.array([there.position for there in others]) - new.position) ** 2 / new.std**2).mean()
    assert 0.3 < z2 < 3.0  # by what five sessions differ by, forty others differ from their mean
    assert not any("session" in names for names in known.outside)
    assert known.std.max() < 0.1 * new.std.min()
    unsaid = found.model.prediction(replace(rows, labels={}))
    assert all("session" in names for names in unsaid.outside)
    np.testing.assert_allclose(unsaid.std, new.std, rtol=1e-12)
    # a saved model knows its sessions
    again = CorrectedModel.from_dict(found.model.to_dict())
    assert again.spread.levels == {"session": labels}
    np.testing.assert_allclose(again.prediction(unseen).std, new.std, rtol=1e-12)
    assert again.prediction(unseen).outside == new.outside
