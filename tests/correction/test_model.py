"""The corrected model: near the truth where nothing was measured, saved without loss, exact in what it needs."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from conftest import load_arm
from simulate import simulate

from thermal_robot import CampaignError, CorrectedModel, EffectError, diagnose, read_samples
from thermal_robot.campaign import write_campaign
from thermal_robot.campaign.write import write_table
from thermal_robot.kinematics import exp3, log3, quaternion_to_rotation

NOISE, TURNING = 25e-6, 3e-5
MIXTURES = {
    "nothing": [],
    "geometric": ["geometric"],
    "hall": ["thermal_elongation", "backlash"],
    "hand": ["joint_compliance", "instrument_scale"],
    "morning": ["drift", "transmission_error"],
}
on_arms = pytest.mark.parametrize("arm", ["ur10", pytest.param("panda", marks=pytest.mark.slow)], indirect=True)


def corrected(robot, effects, seed=1, turning=None, only=None):
    campaign, _, (fresh, place) = simulate(robot, effects, seed=seed, turning=turning, fresh=100)
    return campaign, diagnose(campaign, only=only).model, fresh, place


@pytest.fixture(scope="module")
def hall(rv_m2):
    """A model that needs temperature and directions of approach."""
    return corrected(rv_m2, MIXTURES["hall"])


@on_arms
def test_predictions_are_within_half_a_noise_of_the_truth(arm):
    misses = {}
    for name, effects in MIXTURES.items():
        _, model, fresh, place = corrected(arm, effects)
        predicted, orientation = model.predict(fresh)
        assert orientation is None
        misses[name] = np.sqrt(((predicted - place) ** 2).mean()) / NOISE
    assert max(misses.values()) < 0.5, misses


@pytest.mark.parametrize(
    ("mixture", "turning"),
    [("nothing", None), ("hall", None), ("hand", None), ("geometric", TURNING), ("morning", TURNING)],
)
def test_a_saved_model_predicts_the_same(rv_m2, tmp_path, mixture, turning):
    _, model, fresh, _ = corrected(rv_m2, MIXTURES[mixture], turning=turning)
    model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    (position, orientation), (place, direction) = again.predict(fresh), model.predict(fresh)
    np.testing.assert_allclose(position, place, rtol=0, atol=1e-12)
    assert (orientation is None) == (direction is None) == (turning is None)
    if turning is not None:
        np.testing.assert_allclose(orientation, direction, rtol=0, atol=1e-12)
    assert again.to_dict() == model.to_dict()
    assert again.needs == model.needs
    assert [e for e, _ in again.effects] == [e for e, _ in model.effects]


def test_a_model_needs_what_its_effects_read_and_nothing_more(rv_m2):
    for effects, needs in (
        (["geometric"], set()),
        (["thermal_elongation"], {"temperature"}),
        (["drift"], {"time"}),
        (["backlash"], None),
        (["joint_compliance"], {"payload"}),
    ):
        campaign, truth, (fresh, _) = simulate(rv_m2, effects, seed=4, fresh=100)
        model = diagnose(campaign, only=effects).model
        assert [e.name for e, _ in model.effects] == effects
        needs = {f"approach.{v.split()[-1]}" for v in truth["parts"]["backlash"]["values"]} if needs is None else needs
        assert set(model.needs) == needs
        bare = replace(fresh, covariates={k: v for k, v in fresh.covariates.items() if k in needs})
        np.testing.assert_array_equal(model.predict(bare)[0], model.predict(fresh)[0])


def test_one_sample_is_predicted_as_among_many(hall):
    _, model, fresh, _ = hall
    together, _ = model.predict(fresh)
    for row in (0, 42, 99):
        np.testing.assert_allclose(model.predict(fresh.take([row]))[0][0], together[row], rtol=0, atol=1e-13)
    back = model.predict(fresh.take(np.arange(100)[::-1]))[0]
    np.testing.assert_allclose(back[::-1], together, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("column", "effect"), [("temperature", "thermal_elongation"), ("approach.joint_2", "backlash")]
)
def test_a_missing_column_is_named(hall, column, effect):
    _, model, fresh, _ = hall
    assert column in model.needs
    with pytest.raises(CampaignError) as refused:
        model.predict(fresh.drop_covariate(column))
    assert refused.value.column == column
    assert refused.value.row is None
    assert f"the model ({effect}) needs this column" in str(refused.value)


def test_an_empty_cell_is_named_with_its_row(hall, tmp_path):
    _, model, fresh, _ = hall
    write_table(fresh, tmp_path / "fresh.csv")
    lines = (tmp_path / "fresh.csv").read_text().splitlines()
    at = lines[0].split(",").index("temperature")
    cells = lines[7].split(",")
    lines[7] = ",".join([*cells[:at], "", *cells[at + 1 :]])
    (tmp_path / "gap.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(CampaignError) as refused:
        model.predict(model.samples(tmp_path / "gap.csv"))
    assert (refused.value.column, refused.value.row) == ("temperature", 8)
    whole = model.predict(read_samples(tmp_path / "fresh.csv", model.settings, model.robot))[0]
    np.testing.assert_allclose(whole, model.predict(fresh)[0], rtol=0, atol=1e-9)


def ordered(robot):
    """A campaign that drifts with the order of measurement, which starts at 0; further samples in the same order."""
    campaign, _, (fresh, place) = simulate(robot, ["drift"], seed=3, fresh=100)

    def by_order(rows):
        rest = {k: v for k, v in rows.covariates.items() if k != "time"}
        return replace(rows, covariates={**rest, "order": rows.covariates["time"]})

    return by_order(campaign), by_order(fresh), place


def test_an_order_within_the_campaigns_is_taken_at_its_word(rv_m2):
    campaign, fresh, place = ordered(rv_m2)
    model = diagnose(campaign).model
    assert model.needs == ("order",)
    assert np.sqrt(((model.predict(fresh)[0] - place) ** 2).mean()) < 0.5 * NOISE


def test_an_order_that_starts_again_is_after_the_campaign(rv_m2, tmp_path):
    campaign = ordered(rv_m2)[0]
    rank = np.argsort(np.argsort(campaign.covariates["order"])).astype(float)
    campaign = replace(campaign, covariates={**campaign.covariates, "order": rank})
    model = diagnose(campaign).model
    assert model.needs == ("order",)
    few = campaign.take(np.arange(20))

    def at(order):
        return model.predict(replace(few, covariates={**few.covariates, "order": np.asarray(order, dtype=float)}))[0]

    settled = at(np.full(20, rank.max()))
    np.testing.assert_array_equal(at(np.arange(20)), settled)
    assert np.abs(at(np.arange(20) + 50) - settled).max() > NOISE / 10  # said to be in the middle: taken so
    assert np.abs(at(np.zeros(20)) - settled).max() > NOISE
    model.save(tmp_path / "model.json")
    again = CorrectedModel.load(tmp_path / "model.json")
    assert again.last_order == model.last_order == (0.0, 119.0)


@on_arms
def test_orientation_is_predicted_where_it_was_measured(arm):
    """A campaign of poses is corrected in both: the target's direction within half a noise of the truth."""
    campaign, _, _ = simulate(arm, ["geometric"], seed=4, turning=TURNING, ratio=(4.0, 6.0), samples=220)
    train, rest = campaign.take(np.arange(0, 220, 2)), campaign.take(np.arange(1, 220, 2))
    found = diagnose(train)
    assert found.measures == "pose"
    position, orientation = found.model.predict(replace(rest, position=None, orientation=None))
    np.testing.assert_allclose(np.linalg.norm(orientation, axis=1), 1.0, atol=1e-12)
    apart = quaternion_to_rotation(rest.orientation).transpose(0, 2, 1) @ quaternion_to_rotation(orientation)
    turned = np.sqrt((log3(apart) ** 2).mean()) / TURNING
    moved = np.sqrt(((position - rest.position) ** 2).mean()) / NOISE
    assert 0.9 < turned < np.sqrt(1.25)  # noise and half of it
    assert 0.9 < moved < np.sqrt(1.25)
    assert found.gap.orientation_after < 0.7 * found.gap.orientation_before


def test_orientation_does_not_depend_on_the_sign_of_quaternions(rv_m2):
    campaign, _, _ = simulate(rv_m2, ["joint_offset"], seed=5, turning=TURNING)
    flipped = replace(campaign, orientation=campaign.orientation * np.where(np.arange(120) % 2, 1.0, -1.0)[:, None])
    one, other = diagnose(campaign).model, diagnose(flipped).model
    np.testing.assert_allclose(other.predict(campaign)[0], one.predict(campaign)[0], rtol=0, atol=1e-12)


def test_a_simulators_prediction_is_corrected_and_needed(rv_m2):
    """The user's simulator has the robot's true lengths, the URDF has not; both have the wrong zeros."""
    campaign, _, (fresh, place) = simulate(rv_m2, ["joint_offset"], seed=6, fresh=100)
    model = diagnose(campaign).model
    root = np.linalg.inv(model.frames.base)
    nominal = replace(model, effects=(), needs=())
    both = {}
    for name, rows in (("campaign", campaign), ("fresh", fresh)):
        both[name] = replace(rows, simulated_position=nominal.predict(rows)[0] @ root[:3, :3].T + root[:3, 3])
    found = diagnose(both["campaign"])
    assert found.verdict == ("joint_offset",)
    assert found.model.simulated
    assert np.sqrt(((found.model.predict(both["fresh"])[0] - place) ** 2).mean()) < 0.5 * NOISE
    with pytest.raises(CampaignError) as refused:
        found.model.predict(fresh)
    assert refused.value.column == "sim.x"


def test_a_campaign_that_is_written_and_read_gives_the_same_model(hall, tmp_path):
    campaign, model, fresh, _ = hall
    again = diagnose(write_campaign(campaign, tmp_path)).model
    np.testing.assert_allclose(again.predict(fresh)[0], model.predict(fresh)[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", '{"schema": "other"}', "\x00"])
def test_what_is_no_model_is_refused(tmp_path, text):
    (tmp_path / "no.json").write_text(text)
    with pytest.raises(CampaignError, match="not a model"):
        CorrectedModel.load(tmp_path / "no.json")
    with pytest.raises(CampaignError, match="no such file"):
        CorrectedModel.load(tmp_path / "absent.json")


def test_an_effect_that_is_not_installed_is_named(hall, tmp_path):
    plain = hall[1].to_dict()
    plain["effects"][0]["name"] = "their_effect"
    (tmp_path / "model.json").write_text(json.dumps(plain))
    with pytest.raises(EffectError, match="'their_effect'"):
        CorrectedModel.load(tmp_path / "model.json")


def test_a_tracker_elsewhere_sees_the_same_model_elsewhere(hall):
    """The base carries the whole prediction: turned base, turned prediction."""
    _, model, fresh, _ = hall
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = exp3([0.4, -1.0, 2.0]), [1.0, 2.0, 3.0]
    there = replace(model, frames=replace(model.frames, base=turn @ model.frames.base))
    expected = model.predict(fresh)[0] @ turn[:3, :3].T + turn[:3, 3]
    np.testing.assert_allclose(there.predict(fresh)[0], expected, rtol=0, atol=1e-12)


def test_more_columns_than_the_campaign_had_change_no_prediction():
    campaign, _, (fresh, _) = simulate(load_arm("ur10"), ["backlash"], samples=100, seed=5, fresh=20)
    first = f"approach.{campaign.robot.joint_names[0]}"
    kept = {name: values for name, values in campaign.covariates.items() if name != first}
    model = diagnose(replace(campaign, covariates=kept)).model
    less = {name: values for name, values in fresh.covariates.items() if name != first}
    with_more, with_less = (model.predict(f)[0] for f in (fresh, replace(fresh, covariates=less)))
    np.testing.assert_allclose(with_more, with_less, atol=0.0)


def test_a_table_is_predicted_as_its_file_is(hall, tmp_path):
    _, model, fresh, _ = hall
    write_table(fresh, tmp_path / "fresh.csv")
    of_file, of_rows = (model.prediction(rows) for rows in (tmp_path / "fresh.csv", fresh))
    frame = pd.read_csv(tmp_path / "fresh.csv", index_col=None)
    frame.index = np.arange(7, 7 + len(frame))
    of_table = model.predict(frame)
    scale = model.settings.units.length_scale
    np.testing.assert_allclose(of_file.position, of_rows.position, atol=1e-12)
    np.testing.assert_array_equal(of_table[["x", "y", "z"]], of_file.position / scale)
    np.testing.assert_array_equal(of_table[["std.x", "std.y", "std.z"]], of_file.std / scale)
    kept = [name for name in frame.columns if name not in ("x", "y", "z")]
    assert list(of_table.columns) == [*kept, "x", "y", "z", "std.x", "std.y", "std.z", "outside"]
    pd.testing.assert_frame_equal(of_table[kept], frame[kept])
    np.testing.assert_array_equal(model.predict(tmp_path / "fresh.csv")[0], of_file.position)


def test_it_shows_itself_in_one_line(hall):
    model = hall[1]
    assert repr(model) == "CorrectedModel('rv_m2': backlash, thermal_elongation)"
    assert repr(replace(model, effects=())) == "CorrectedModel('rv_m2': no effect)"
