"""The corrected model: near the truth where nothing was measured, saved without loss, exact in what it needs."""

from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest
from conftest import load_arm
from helpers import some
from readers import model_of
from simulate import simulate

from thermal_robot import CampaignError, CorrectedModel, diagnose, read_samples
from thermal_robot.campaign.write import write_table
from thermal_robot.effects import Drift, ThermalElongation
from thermal_robot.kinematics import exp3, log3, quaternion_to_rotation

NOISE, TURNING = 25e-6, 3e-5
MIXTURES = {
    "nothing": [],
    "geometric": ["geometric"],
    "hall": ["thermal_elongation", "backlash"],
    "hand": ["joint_compliance", "instrument_scale"],
    "morning": ["drift", "transmission_error"],
}


def corrected(robot, effects, seed=1, turning=None, only=None):
    campaign, _, (fresh, place) = simulate(robot, effects, seed=seed, turning=turning, fresh=100)
    return campaign, diagnose(campaign, only=only).model, fresh, place


@pytest.fixture(scope="module")
def hall(rv_m2):
    """A model that needs temperature and directions of approach."""
    return corrected(rv_m2, MIXTURES["hall"], only=MIXTURES["hall"])


@pytest.mark.parametrize(
    ("arm", "effects"), some(product(("ur10", "panda"), (MIXTURES["hand"], *MIXTURES.values())), 12), indirect=["arm"]
)
def test_predictions_are_within_half_a_noise_of_the_truth(arm, effects):
    _, model, fresh, place = corrected(arm, effects)
    predicted, orientation = model.prediction(fresh)[:2]
    assert orientation is None
    assert np.sqrt(((predicted - place) ** 2).mean()) < 0.5 * NOISE


@pytest.mark.parametrize(
    ("effect", "needs"),
    [
        ("backlash", None),
        *(
            pytest.param(name, needs, marks=pytest.mark.slow)
            for name, needs in (
                ("geometric", set()),
                ("thermal_elongation", {"temperature"}),
                ("drift", {"time"}),
                ("joint_compliance", {"payload"}),
            )
        ),
    ],
)
def test_a_model_needs_what_its_effects_read_and_nothing_more(rv_m2, effect, needs):
    campaign, truth, (fresh, _) = simulate(rv_m2, [effect], seed=4, fresh=100)
    model = diagnose(campaign, only=[effect]).model
    assert [e.name for e, _ in model.effects] == [effect]
    needs = {f"approach.{v.split()[-1]}" for v in truth["parts"][effect]["values"]} if needs is None else needs
    assert set(model.needs) == needs
    bare = replace(fresh, covariates={k: v for k, v in fresh.covariates.items() if k in needs})
    np.testing.assert_array_equal(model.prediction(bare)[0], model.prediction(fresh)[0])


def test_one_sample_is_predicted_as_among_many_and_wherever_the_base_stands(hall):
    _, model, fresh, _ = hall
    together, _ = model.prediction(fresh)[:2]
    for rows in ([0], [42], [99], np.arange(100)[::-1]):
        np.testing.assert_allclose(model.prediction(fresh.take(rows))[0], together[rows], rtol=0, atol=1e-13)
    # the base carries the whole prediction: turned base, turned prediction
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = exp3([0.4, -1.0, 2.0]), [1.0, 2.0, 3.0]
    there = replace(model, frames=replace(model.frames, base=turn @ model.frames.base))
    expected = together @ turn[:3, :3].T + turn[:3, 3]
    np.testing.assert_allclose(there.prediction(fresh)[0], expected, rtol=0, atol=1e-12)


def test_what_is_lacking_is_named(hall, rv_m2, tmp_path):
    _, model, fresh, _ = hall
    for column, effect in (("temperature", "thermal_elongation"), ("approach.joint_2", "backlash")):
        with pytest.raises(CampaignError) as refused:
            model.predict(fresh.drop_covariate(column))
        assert (refused.value.column, refused.value.row) == (column, None)
        assert f"the model ({effect}) needs this column" in str(refused.value)
    # an empty cell with its row
    write_table(fresh, tmp_path / "fresh.csv")
    frame = pd.read_csv(tmp_path / "fresh.csv")
    frame.loc[6, "temperature"] = np.nan
    frame.to_csv(tmp_path / "gap.csv", index=False)
    with pytest.raises(CampaignError, match="an empty cell") as refused:
        model.predict(model.samples(tmp_path / "gap.csv"))
    assert (refused.value.column, refused.value.row) == ("temperature", 8)
    whole = model.prediction(read_samples(tmp_path / "fresh.csv", model.settings, model.robot))[0]
    np.testing.assert_allclose(whole, model.prediction(fresh)[0], rtol=0, atol=1e-9)
    # in which nobody reads it does not matter
    gaps = replace(fresh, missing={"payload": np.arange(100) == 3})
    np.testing.assert_array_equal(model.prediction(gaps)[0], model.prediction(fresh)[0])
    both = model_of(rv_m2, (Drift(), np.ones(6)), (ThermalElongation(), np.ones(5)), needs=("temperature", "time"))
    with pytest.raises(CampaignError, match=r"column 'time': the model \(drift\) needs this column.*no such column"):
        both.predict(fresh.drop_covariate("time"))
    # a row that leads nowhere
    large = replace(model, effects=tuple((e, np.full_like(v, 1e308)) for e, v in model.effects))
    with (
        np.errstate(all="ignore"),
        pytest.raises(CampaignError, match=r"row \d+: the values of this row lead to no finite"),
    ):
        large.predict(replace(fresh, rows=np.arange(2, 102)))


@pytest.mark.parametrize(
    ("name", "meant"),
    [("temprature", "temperature"), ("aproach.joint_3", "approach.joint_3"), ("approach.joint_9", "approach.joint_")],
)
def test_a_condition_that_nothing_has_is_refused_with_the_one_that_was_meant(rv_m2, name, meant):
    model = model_of(rv_m2, needs=("temperature",))
    with pytest.raises(CampaignError, match=rf"column '{name}': nothing has this name; did you mean '{meant}.*tempera"):
        model.samples_at(np.zeros(5), {name: 1.0})


def test_samples_are_made_of_arrays_and_conditions(rv_m2):
    model = model_of(rv_m2)
    found = model.samples_at(np.zeros((3, 5)), {"temperature": 24, "payload": [0.0, 1.0, 2.0]})
    assert found.q.shape == (3, 5)
    np.testing.assert_array_equal(found.covariates["temperature"], [24.0] * 3)
    np.testing.assert_array_equal(found.covariates["payload"], [0.0, 1.0, 2.0])
    assert model.samples_at(np.zeros(5)).samples == 1
    # any column of a campaign and any that the model needs is known
    link = rv_m2.urdf_links[2]
    known = ["order", "tilt.x", f"tilt.{link}.y", f"temperature.{link}", "torque.joint_2", "humidity"]
    humid = model_of(rv_m2, needs=("humidity",))
    assert set(humid.samples_at(np.zeros(5), dict.fromkeys(known, 1.0)).covariates) == set(known)
    for conditions, said in (
        ({"humidity": 1.0}, r"'humidity': nothing has this name.*needs no condition"),
        ({"temperature": [1.0, 2.0]}, r"no rows of numbers.*an array \(N, 5\)"),
    ):
        with pytest.raises(CampaignError, match=said):
            model.samples_at(np.zeros((3, 5)), conditions)


@pytest.mark.slow
def test_an_order_is_taken_at_its_word_unless_it_starts_again(rv_m2):
    """Of a campaign that drifts with the order of measurement, which starts at 0."""

    def by_order(rows, order):
        rest = {k: v for k, v in rows.covariates.items() if k != "time"}
        return replace(rows, covariates={**rest, "order": np.asarray(order, dtype=float)})

    campaign, _, (fresh, place) = simulate(rv_m2, ["drift"], seed=3, fresh=100)
    model = diagnose(by_order(campaign, campaign.covariates["time"])).model
    assert model.needs == ("order",)
    within = model.prediction(by_order(fresh, fresh.covariates["time"]))[0]
    assert np.sqrt(((within - place) ** 2).mean()) < 0.5 * NOISE

    rank = np.argsort(np.argsort(campaign.covariates["time"])).astype(float)
    model = diagnose(by_order(campaign, rank)).model
    few = campaign.take(np.arange(20))

    def at(order):
        return model.prediction(by_order(few, order))[0]

    settled = at(np.full(20, rank.max()))
    np.testing.assert_array_equal(at(np.arange(20)), settled)
    assert np.abs(at(np.arange(20) + 50) - settled).max() > NOISE / 10  # said to be in the middle: taken so
    assert np.abs(at(np.zeros(20)) - settled).max() > NOISE
    assert model.counts_anew(by_order(few, np.arange(20)))
    assert not replace(model, last_order=None).counts_anew(by_order(few, np.arange(20)))
    again = CorrectedModel.from_dict(model.to_dict())
    assert again.last_order == model.last_order == (0.0, 119.0)


@pytest.mark.slow
@pytest.mark.parametrize("arm", ["ur10", "panda"], indirect=True)
def test_orientation_is_predicted_where_it_was_measured(arm):
    """A campaign of poses is corrected in both: the target's direction within half a noise of the truth."""
    campaign, _, _ = simulate(arm, ["geometric"], seed=4, turning=TURNING, ratio=(4.0, 6.0), samples=220)
    train, rest = campaign.take(np.arange(0, 220, 2)), campaign.take(np.arange(1, 220, 2))
    found = diagnose(train)
    assert found.measures == "pose"
    position, orientation = found.model.prediction(replace(rest, position=None, orientation=None))[:2]
    np.testing.assert_allclose(np.linalg.norm(orientation, axis=1), 1.0, atol=1e-12)
    apart = quaternion_to_rotation(rest.orientation).transpose(0, 2, 1) @ quaternion_to_rotation(orientation)
    turned = np.sqrt((log3(apart) ** 2).mean()) / TURNING
    moved = np.sqrt(((position - rest.position) ** 2).mean()) / NOISE
    assert 0.9 < turned < np.sqrt(1.25)  # noise and half of it
    assert 0.9 < moved < np.sqrt(1.25)
    assert found.gap.orientation_after < 0.7 * found.gap.orientation_before


@pytest.mark.slow
def test_orientation_does_not_depend_on_the_sign_of_quaternions(rv_m2):
    campaign, _, _ = simulate(rv_m2, ["joint_offset"], seed=5, turning=TURNING)
    flipped = replace(campaign, orientation=campaign.orientation * np.where(np.arange(120) % 2, 1.0, -1.0)[:, None])
    one, other = diagnose(campaign).model, diagnose(flipped).model
    np.testing.assert_allclose(other.prediction(campaign)[0], one.prediction(campaign)[0], rtol=0, atol=1e-12)


@pytest.mark.slow
def test_a_simulators_prediction_is_corrected_and_needed(rv_m2):
    """The user's simulator has the robot's true lengths, the URDF has not; both have the wrong zeros."""
    campaign, _, (fresh, place) = simulate(rv_m2, ["joint_offset"], seed=6, fresh=100)
    model = diagnose(campaign).model
    root = np.linalg.inv(model.frames.base)
    nominal = replace(model, effects=(), needs=())
    both = {}
    for name, rows in (("campaign", campaign), ("fresh", fresh)):
        both[name] = replace(rows, simulated_position=nominal.prediction(rows)[0] @ root[:3, :3].T + root[:3, 3])
    found = diagnose(both["campaign"])
    assert found.verdict == ("joint_offset",)
    assert found.model.simulated
    assert np.sqrt(((found.model.prediction(both["fresh"])[0] - place) ** 2).mean()) < 0.5 * NOISE
    with pytest.raises(CampaignError, match=r"column 'sim\.x': the model corrects the prediction of your simulator"):
        found.model.predict(fresh)


@pytest.mark.slow
def test_more_columns_than_the_campaign_had_change_no_prediction():
    campaign, _, (fresh, _) = simulate(load_arm("ur10"), ["backlash"], samples=100, seed=5, fresh=20)
    first = f"approach.{campaign.robot.joint_names[0]}"
    model = diagnose(campaign.drop_covariate(first)).model
    np.testing.assert_array_equal(model.prediction(fresh)[0], model.prediction(fresh.drop_covariate(first))[0])


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
    np.testing.assert_array_equal(model.prediction(tmp_path / "fresh.csv")[0], of_file.position)
    # whatever the samples are, one kind of answer
    at = ["x", "y", "z", "std.x", "std.y", "std.z", "outside"]
    conditions = {name: fresh.covariates[name] for name in model.needs}
    for answer in (model.predict(fresh), model.predict(tmp_path / "fresh.csv"), model.predict(fresh.q, conditions)):
        pd.testing.assert_frame_equal(answer[at].reset_index(drop=True), of_table[at].reset_index(drop=True))
    with pytest.raises(CampaignError, match="of use with an array only"):
        model.predict(frame, conditions)
    # and it shows itself in one line
    assert repr(model) == "CorrectedModel('rv_m2': backlash, thermal_elongation)"
    assert repr(replace(model, effects=())) == "CorrectedModel('rv_m2': no effect)"
