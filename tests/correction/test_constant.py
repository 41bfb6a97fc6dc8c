"""What of a model is constant: found by what effects do; without what no data determine; as zeros for a controller."""

from dataclasses import dataclass, replace
from typing import ClassVar

import denavit
import numpy as np
import pytest
from conftest import load_arm
from helpers import some
from readers import model_of
from simulate import simulate

from thermal_robot import CampaignError, CorrectedModel, diagnose, load_robot
from thermal_robot import simulate as run_of
from thermal_robot.campaign import Units
from thermal_robot.correction import determined, zero_offsets
from thermal_robot.correction.constant import NONE, TOLD, UNSEEN, constant, rows_of_every_kind
from thermal_robot.effects import (
    Backlash,
    Drift,
    Effect,
    Geometric,
    InstrumentScale,
    JointGain,
    JointOffset,
    Parameter,
    ThermalElongation,
    ToolFrame,
    TransmissionError,
    at_instrument,
    at_joint,
    at_segment,
    gate,
)
from thermal_robot.effects.law import Discovered
from thermal_robot.kinematics import exp6, tool_poses
from thermal_robot.observations import Frames
from thermal_robot.prediction import Spread

NOISE = 25e-6


def held(model, **how):
    found = constant(model, **how)
    return {told.parameter for told, own in zip(found.parameters, found.held, strict=True) if own}, found.displacement


def sizes_of(robot, effect, needs=()):
    return np.array([p.size for p in gate.checked(effect, rows_of_every_kind(model_of(robot, needs=needs)))])


def filled(robot, effect, needs=(), **settings):
    """A model of one effect, all its parameters at their expected size."""
    return model_of(robot, (effect, sizes_of(robot, effect, needs)), needs=needs, **settings)


APPROACH = tuple(f"approach.joint_{k}" for k in range(1, 6))
CHANGING = [
    (JointGain(), ()),
    (TransmissionError(), ()),
    (Backlash(), APPROACH),
    (Drift(span=100.0), ("time",)),
    (Drift(span=100.0, time_constant=0.2), ("time",)),
    (InstrumentScale(), ()),
    (Discovered(kind="joint", place="joint_2", quantity="time", shape="ramp"), ("time",)),
    (Discovered(kind="joint", place="joint_2", quantity="joint_3", shape="ramp"), ()),
]


@pytest.mark.parametrize(("effect", "needs"), CHANGING, ids=str)
def test_what_changes_with_pose_or_time_is_not_constant(rv_m2, effect, needs):
    found, moved = held(filled(rv_m2, effect, needs))
    assert found == set()
    assert not any(np.any(part) for part in (moved.joint, moved.segment, moved.base, moved.tool))


def test_zeros_placements_and_frames_are_constant_in_their_channels(rv_m2):
    names, moved = held(filled(rv_m2, JointOffset()))
    assert len(names) == 5
    np.testing.assert_array_equal(moved.joint, 1e-3)
    names, moved = held(filled(rv_m2, Geometric()))
    placed = np.any(moved.segment, axis=1)
    assert len(names) == 6 * placed.sum()
    assert placed[[segment.movable for segment in rv_m2.segments]].all()
    names, moved = held(filled(rv_m2, ToolFrame(turns=True), tool_known=True))
    np.testing.assert_array_equal(moved.tool, 2e-3)
    assert len(names) == 6


@pytest.mark.parametrize(
    ("effect", "needs"),
    [
        (ThermalElongation(), ("temperature",)),
        (ThermalElongation(), ("temperature", "temperature.forearm")),
        (ThermalElongation(common=True), ("temperature",)),
        (ThermalElongation(lag=900.0, times=(0.0, 1e4), temperatures=(15.0, 35.0)), ("temperature", "time")),
    ],
    ids=["each", "sensor", "common", "lag"],
)
def test_lengths_are_constant_once_the_temperature_has_lasted(rv_m2, effect, needs):
    model = filled(rv_m2, effect, needs, reference_temperature=20.0)
    for degrees in (None, 20.0, 35.0, -5.0):
        names, moved = held(model, temperature=degrees)
        assert len(names) == len(model.effects[0][1])
        rise = 0.0 if degrees is None else degrees - 20.0
        grown = np.linalg.norm(np.asarray(moved.segment)[:, :3], axis=1) * np.sign(rise)
        np.testing.assert_allclose(grown, [1.5e-5 * s.length * rise for s in rv_m2.segments], atol=1e-16)
        assert not np.any(np.asarray(moved.segment)[:, 3:])


def test_a_law_of_the_temperature_is_what_it_is_there(rv_m2):
    law = Discovered(kind="joint", place="joint_2", quantity="temperature", shape="ramp", origin=20.0, span=10.0)
    model = filled(rv_m2, law, ("temperature",))
    cold, warm, hot = (held(model, temperature=t)[1].joint[1] for t in (10.0, 20.0, 30.0))
    assert hot - warm == pytest.approx(warm - cold)
    assert abs(hot - warm) > 1e-5
    for degrees in (np.nan, np.inf, -300.0):
        with pytest.raises(CampaignError, match="°C"):
            constant(model, degrees)


@dataclass(frozen=True)
class Mixed(Effect):
    """Somebody's own effect: constants in two places at once, one beside the chain, one that is not constant."""

    name: ClassVar[str] = "mixed"

    def parameters(self, observations):
        rows, one = observations.campaign.samples, at_joint(1, 0.5)
        return (
            Parameter("both", "1", 1.0, "link", "shoulder", (one, at_segment(2, np.arange(6.0)), at_joint(1, 0.25))),
            Parameter("rows", "1", 1.0, "link", "hand", (at_joint(2, np.full(rows, 2.0)),)),
            Parameter("beside", "m", 1.0, "instrument", "instrument", (at_instrument(np.ones((rows, 3))),)),
            Parameter("pose", "1", 1.0, "link", "", (at_joint(2, 1.0), at_joint(3, observations.q[:, 0]))),
        )


def test_an_effect_of_ones_own_is_read_as_any_other(rv_m2):
    names, moved = held(model_of(rv_m2, (Mixed(), [2.0, 3.0, 4.0, 5.0])))
    assert names == {"both, shoulder", "rows, hand"}
    np.testing.assert_allclose(moved.joint, [0.0, 1.5, 6.0, 0.0, 0.0])
    np.testing.assert_allclose(moved.segment[2], 2.0 * np.arange(6.0))


def test_values_and_deviations_are_told_in_the_order_of_the_model(rv_m2):
    found = constant(model_of(rv_m2, (JointOffset(), [1, 2, 3, 4, 5]), (JointGain(), [6, 7, 8, 9, 10])))
    assert [told.value for told in found.parameters] == list(range(1, 11))
    assert found.held.tolist() == [True] * 5 + [False] * 5
    assert all(np.isnan(told.std) for told in found.parameters)
    assert str(found.parameters[1]).startswith("joint_offset: zero offset, joint_2 = 2")


def test_rows_of_every_kind_differ_in_everything(rv_m2):
    model = model_of(rv_m2, needs=("temperature", "payload", "approach.joint_1", "time"))
    rows = rows_of_every_kind(model)
    assert (np.ptp(rows.q, axis=0) > 0.1).all()
    assert all(np.ptp(values) > 0 for values in rows.covariates.values())
    steady = rows_of_every_kind(replace(model, simulated=True), 25.0)
    assert np.ptp(steady.covariates["temperature"]) == 0.0
    assert np.ptp(steady.covariates["payload"]) > 0.0


@pytest.fixture(scope="module", params=[None, 3e-5], ids=["position", "pose"])
def bent(rv_m2, request):
    """A model of geometry, most of whose parameters no data can determine, and fresh rows with the truth."""
    campaign, _, (fresh, place) = simulate(rv_m2, ["geometric"], seed=2, fresh=200, turning=request.param)
    return diagnose(campaign, only=["geometric"]).model, fresh, place


def values(model):
    return np.concatenate([values for _, values in model.effects])


def stds(model):
    return np.sqrt(model.spread.covariance.diagonal()[-len(values(model)) :])


def test_what_is_left_out_costs_less_than_the_noise(bent):
    model, fresh, place = bent

    def off(model):
        return np.sqrt(((model.prediction(fresh)[0] - place) ** 2).mean())

    kept, gone = determined(model, 2.0)
    assert 5 < len(gone) < len(values(model)) - 5
    assert off(kept) < off(model) + 0.3 * NOISE
    # to take them out one by one without a word to the others costs ten times more
    alone = np.where(np.abs(values(model)) < 2.0 * stds(model), 0.0, values(model))
    assert off(replace(model, effects=((model.effects[0][0], alone),))) > off(model) + NOISE


def test_all_that_is_left_is_significant_and_nothing_else_is_said(bent):
    model = bent[0]
    for sigma in (0.0, 1.0, 2.0, 5.0):
        kept, gone = determined(model, sigma)
        left, std = values(kept) != 0.0, stds(kept)
        assert (np.abs(values(kept)[left]) >= sigma * std[left] * (1 - 1e-9)).all()
        assert not std[~left].any()
        assert len(gone) == (~left).sum()
        assert np.linalg.eigvalsh(kept.spread.covariance).min() > -1e-15
    assert not determined(model, 0.0)[1]
    assert not values(determined(model, 1e9)[0]).any()


def test_of_two_that_only_their_sum_is_known_of_one_stays(rv_m2):
    """Two numbers of 0.5 ± 1 each, whose sum is 1 ± 0.1: neither is significant, both together are."""
    covariance = np.diag([1.0, 1.0, 1.0, 1.0, 1e-4])
    covariance[0, 1] = covariance[1, 0] = -0.995
    bare = model_of(rv_m2, (JointOffset(), [0.5, 0.5, 0.3, 0.0, 0.2]), base_known=True, tool_known=True)
    kept, gone = determined(replace(bare, spread=Spread(covariance, np.zeros(3), np.zeros(3))), 2.0)
    offsets = values(kept)
    assert np.count_nonzero(offsets[:2]) == 1
    assert offsets[:2].sum() == pytest.approx(1.0, abs=0.01)
    np.testing.assert_array_equal(offsets[2:], [0.0, 0.0, 0.2])
    assert {told.value for told in gone} == {0.5, 0.3, 0.0}
    # what cannot be judged is refused
    with pytest.raises(CampaignError, match="how sure"):
        determined(bare, 2.0)
    for sigma in (-1.0, np.nan, np.inf):
        with pytest.raises(CampaignError, match="standard deviations"):
            determined(bare, sigma)


ASIDE = Frames(np.eye(4), exp6([0.05, 0.02, 0.1, 0.0, 0.0, 0.0]))
"""A target that stands off the axis of the last joint."""
KNOWN = {"base_known": True, "tool_known": True, "frames": ASIDE}


def test_what_is_added_to_the_commands_brings_the_robot_where_it_was_meant_to_be(rv_m2, configurations):
    offsets = np.array([1e-3, -2e-3, 3e-3, -4e-3, 5e-3])
    table = zero_offsets(model_of(rv_m2, (JointOffset(), offsets), **KNOWN))
    assert set(table["zero"]) == {TOLD}
    q = configurations(rv_m2, 20)
    real = tool_poses(rv_m2, q + table["add_to_command"].to_numpy() + offsets)
    np.testing.assert_allclose(real, tool_poses(rv_m2, q), atol=1e-12)


def wide(model, std, prior=None):
    """The model with such deviations of its zeros."""
    return replace(model, spread=Spread(np.diag(np.square(std)), np.zeros(3), np.zeros(3), prior=prior))


def test_units_and_deviations_are_those_of_the_campaign(awkward):
    n = awkward.n
    model = model_of(awkward, (JointOffset(), np.full(n, 1e-3)), units=Units("deg", "mm"), **KNOWN)
    table = zero_offsets(wide(model, 1e-4 * np.arange(1, n + 1), np.full(n, 0.01)))
    slides = np.array([kind == "prismatic" for kind in awkward.joint_types])
    assert table["unit"].tolist() == np.where(slides, "mm", "deg").tolist()
    scale = np.where(slides, 1e3, np.degrees(1.0))
    np.testing.assert_allclose(table["add_to_command"], -1e-3 * scale, rtol=1e-6)
    np.testing.assert_allclose(table["std"], 1e-4 * np.arange(1, n + 1) * scale, rtol=1e-6)


@pytest.mark.parametrize(
    ("effect", "known", "said"),
    [
        (JointOffset(), {}, [UNSEEN, TOLD, TOLD, TOLD, UNSEEN]),
        (JointOffset(), {"base_known": True}, [TOLD, TOLD, TOLD, TOLD, UNSEEN]),
        (JointOffset(places=("joint_3",)), {}, [UNSEEN, NONE, TOLD, NONE, UNSEEN]),
        (JointGain(), {"base_known": True, "tool_known": True}, [NONE] * 5),
        (None, {"base_known": True, "tool_known": True}, [NONE] * 5),
    ],
)
def test_what_frames_can_take_up_or_the_model_does_not_hold_is_not_told(rv_m2, effect, known, said):
    effects = () if effect is None else ((effect, sizes_of(rv_m2, effect)),)
    table = zero_offsets(model_of(rv_m2, *effects, frames=ASIDE, **known))
    assert table["zero"].tolist() == said
    assert not table["add_to_command"][[word != TOLD for word in said]].any()


@pytest.mark.parametrize("turning", some([None, 3e-5], 2))
def test_zeros_inside_geometry_are_those_of_the_diagnosis(turning):
    """And the true ones, which were put there with the errors of axes beside them."""
    campaign, truth = denavit.off(load_arm("ur10"), 3, turning=turning)
    found = diagnose(campaign, only=["geometric", "joint_offset"])
    assert found.verdict == ("geometric",)
    table = zero_offsets(found.model).set_index("joint")
    known = {p.name.split(", ")[1]: p for p in found.finding("joint_offset").parameters if p.identified}
    assert len(known) >= 4
    for joint, zero in known.items():
        row, true = table.loc[joint], truth[list(campaign.robot.joint_names).index(joint)]
        assert row["zero"] == TOLD
        assert -row["add_to_command"] == pytest.approx(zero.value, abs=0.5 * zero.std)
        assert row["std"] == pytest.approx(zero.std, rel=0.19)
        assert abs(-row["add_to_command"] - true) < 4.0 * row["std"]
    assert table["zero"].iloc[[0, -1]].tolist() == [UNSEEN, UNSEEN]


def test_geometry_that_is_a_zero_is_told_as_one(rv_m2):
    """A placement turned about its joint's own axis, and nothing else."""
    geometry = Geometric()
    listed = gate.checked(geometry, rows_of_every_kind(model_of(rv_m2)))
    segment = next(s for s, one in enumerate(rv_m2.segments) if one.name == "joint_3")
    twist = np.concatenate([np.zeros(3), 2e-3 * rv_m2.chain.axes[rv_m2.segments[segment].index]])
    values = [twist @ p.responses[0].values if p.responses[0].index == segment else 0.0 for p in listed]
    table = zero_offsets(model_of(rv_m2, (geometry, values), **KNOWN))
    np.testing.assert_allclose(table["add_to_command"], [0, 0, -2e-3, 0, 0], atol=1e-12)


def test_a_zero_that_the_data_leave_as_wide_as_it_was_is_not_determined(rv_m2):
    model = model_of(rv_m2, (JointOffset(), np.full(5, 2e-3)), **KNOWN)
    std = np.array([4.9e-4, 5.1e-4, 1e-4, 9e-4, 1e-5])
    table = zero_offsets(wide(model, std, np.full(5, 1e-3)))
    assert table["zero"].tolist() == [TOLD, UNSEEN, TOLD, UNSEEN, TOLD]
    np.testing.assert_allclose(table["add_to_command"], [-2e-3, 0.0, -2e-3, 0.0, -2e-3])
    assert table["std"].isna().tolist() == [False, True, False, True, False]
    assert zero_offsets(wide(model, std, np.full(5, 1e-2)))["zero"].tolist() == [TOLD] * 5
    # a file of an older program: what the effect expects of itself, which is 1 mrad
    assert zero_offsets(wide(model, std))["zero"].tolist() == [TOLD, UNSEEN, TOLD, UNSEEN, TOLD]
    # small zeros are left out on request
    assert not zero_offsets(wide(model, std, np.full(5, 1e-2)), min_sigma=1e3)["add_to_command"].any()


@pytest.mark.slow
@pytest.mark.parametrize("effects", [["joint_offset"], ["geometric", "joint_offset"]])
def test_what_a_diagnosis_does_not_identify_is_not_to_be_entered(effects):
    zeros = {"joint_offset": {"shoulder_lift_joint": 2e-3, "elbow_joint": -1.5e-3}}
    ur5 = load_robot("example-robot-data:ur5", "tool0")
    verdicts = []
    for seed in range(3):
        campaign = run_of(ur5, zeros, rows=40, noise=2e-4, seed=seed, base_known=False)
        found = diagnose(campaign, only=effects)
        model = CorrectedModel.from_dict(found.model.to_dict())
        told = zero_offsets(model).set_index("joint")["zero"] == TOLD
        identified = {p.name.split(", ")[1] for p in found.finding("joint_offset").parameters if p.identified}
        assert set(told.index[told]) == identified
        verdicts += [len(identified) < len(found.finding("joint_offset").parameters)]
    assert any(verdicts)  # and some are not
