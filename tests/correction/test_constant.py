"""What is constant is found by what effects do, not by their names."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from readers import model_of

from thermal_robot import CampaignError
from thermal_robot.correction.constant import constant, rows_of_every_kind
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
from thermal_robot.kinematics import tool_poses


def held(model, **how):
    found = constant(model, **how)
    return {told.parameter for told, own in zip(found.parameters, found.held, strict=True) if own}, found.displacement


def filled(robot, effect, needs=(), **settings):
    """A model of one effect, all its parameters at their expected size."""
    sizes = [p.size for p in gate.checked(effect, rows_of_every_kind(model_of(robot, needs=needs)))]
    return model_of(robot, (effect, sizes), needs=needs, **settings)


APPROACH = tuple(f"approach.joint_{k}" for k in range(1, 6))


@pytest.mark.parametrize(
    ("effect", "needs"),
    [
        (JointGain(), ()),
        (TransmissionError(), ()),
        (Backlash(), APPROACH),
        (Drift(span=100.0), ("time",)),
        (Drift(span=100.0, time_constant=0.2), ("time",)),
        (InstrumentScale(), ()),
        (Discovered(kind="joint", place="joint_2", quantity="time", shape="ramp"), ("time",)),
        (Discovered(kind="joint", place="joint_2", quantity="joint_3", shape="ramp"), ()),
    ],
    ids=str,
)
def test_what_changes_with_pose_or_time_is_not_constant(rv_m2, effect, needs):
    found, moved = held(filled(rv_m2, effect, needs))
    assert found == set()
    assert not any(np.any(part) for part in (moved.joint, moved.segment, moved.base, moved.tool))


def test_zeros_placements_and_frames_are_constant_in_their_channels(rv_m2):
    names, moved = held(filled(rv_m2, JointOffset()))
    assert len(names) == 5
    np.testing.assert_array_equal(moved.joint, 1e-3)
    names, moved = held(filled(rv_m2, Geometric()))
    movable = [segment.movable for segment in rv_m2.segments]
    assert len(names) == 6 * np.any(moved.segment, axis=1).sum()
    assert np.any(moved.segment, axis=1)[movable].all()
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
    model = model_of(rv_m2, (Mixed(), [2.0, 3.0, 4.0, 5.0]))
    names, moved = held(model)
    assert names == {"both, shoulder", "rows, hand"}
    np.testing.assert_allclose(moved.joint, [0.0, 1.5, 6.0, 0.0, 0.0])
    np.testing.assert_allclose(moved.segment[2], 2.0 * np.arange(6.0))


def test_values_and_deviations_are_told_in_the_order_of_the_model(rv_m2):
    model = model_of(rv_m2, (JointOffset(), [1, 2, 3, 4, 5]), (JointGain(), [6, 7, 8, 9, 10]))
    found = constant(model)
    assert [told.value for told in found.parameters] == list(range(1, 11))
    assert found.held.tolist() == [True] * 5 + [False] * 5
    assert all(np.isnan(told.std) for told in found.parameters)
    assert str(found.parameters[1]).startswith("joint_offset: zero offset, joint_2 = 2")


@pytest.mark.parametrize("degrees", [np.nan, np.inf, -300.0])
def test_a_temperature_that_is_none_is_refused(rv_m2, degrees):
    with pytest.raises(CampaignError, match="°C"):
        constant(model_of(rv_m2), degrees)


def test_rows_of_every_kind_differ_in_everything(rv_m2):
    model = model_of(rv_m2, needs=("temperature", "payload", "approach.joint_1", "time"))
    rows = rows_of_every_kind(model)
    assert (np.ptp(rows.q, axis=0) > 0.1).all()
    assert all(np.ptp(values) > 0 for values in rows.covariates.values())
    assert np.isfinite(tool_poses(rv_m2, rows.q)).all()
    steady = rows_of_every_kind(replace(model, simulated=True), 25.0)
    assert np.ptp(steady.covariates["temperature"]) == 0.0
    assert np.ptp(steady.covariates["payload"]) > 0.0
