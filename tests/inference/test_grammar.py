"""Which richer laws are tried: effects that change, products, memory; and that each has columns of its own."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import commanded
from simulate import simulate

from thermal_robot.effects import Effect, JointOffset, Parameter, TransmissionError, at_joint, gate, library
from thermal_robot.inference.columns import block
from thermal_robot.inference.screening import conditions, memory, modulated, products
from thermal_robot.observations import Frames, observe


def observed(robot, **changes):
    campaign = replace(simulate(robot, samples=40, seed=2, moving=True)[0], **changes)
    return observe(campaign, Frames.declared(campaign))


@pytest.fixture(scope="module")
def here(rv_m2):
    return observed(rv_m2)


def test_conditions_are_what_is_recorded_and_of_joints_their_own(here):
    assert set(conditions(here)) == {"time", "temperature", "payload"}
    own = {"approach.joint_2", "velocity.joint_2", "acceleration.joint_2"}
    assert set(conditions(here, "joint_2")) == set(conditions(here)) | own


def test_every_effect_that_varies_in_a_joint_may_change_there(here):
    found = modulated(here)
    pairs = {(law.of, law.place) for law in found}
    varying = {"joint_gain", "transmission_error", "backlash", "joint_compliance", "tracking_lag"}
    # joint 1 carries nothing: it has no torque to yield to
    joints = here.robot.joint_names
    assert pairs == {(of, j) for of in varying for j in joints} - {("joint_compliance", "joint_1")}
    assert {law.quantity for law in found if law.place == "joint_3"} == {*conditions(here, "joint_3"), "joint_3"}
    # lost motion times the direction of approach is a zero that is off
    follows = {law.quantity for law in found if (law.of, law.place) == ("backlash", "joint_3")}
    assert follows == {*conditions(here, "joint_3"), "joint_3"} - {"approach.joint_3"}
    assert len(found) == len(set(found))
    for law in found:
        assert (law.kind, law.shape) == ("joint", "ramp")
        assert np.abs(block(here, law).columns).max() > 0.0


def test_an_effect_keeps_the_setting_that_it_is_offered_in(here):
    offered = TransmissionError((1, 3), places=("joint_2",))
    found = modulated(here, [offered])
    assert {law.place for law in found} == {"joint_2"}
    single = gate.at(TransmissionError((1, 3)), "joint_2", here)
    assert {law.modulated for law in found} == {single}


class Sag(Effect):
    """An effect of somebody's own, which no package offers."""

    name = "sag"

    def parameters(self, observations):
        q = observations.q
        return tuple(
            Parameter("sag", "rad", 1e-3, "joint", joint, (at_joint(j, q[:, j]),))
            for j, joint in enumerate(observations.robot.joint_names)
        )


def test_what_a_saved_law_could_not_name_is_left_out_and_so_is_what_stands_still(here):
    assert modulated(here, [Sag(), JointOffset()]) == []
    assert modulated(observed(here.robot, covariates={}), [library()["backlash"]]) == []


def test_a_session_is_a_value_each_for_an_effect_and_no_factor(rv_m2):
    labels = {"session": np.array(["am", "pm", "am", "noon"] * 10)}
    here = observed(rv_m2, labels=labels)
    found = [law for law in modulated(here) if law.quantity == "session"]
    assert {(law.shape, law.labels) for law in found} == {("levels", ("am", "noon", "pm"))}
    assert not any("session" in (law.quantity, law.by) for law in products(here, ("joint", "base", "tool")))


def test_a_product_holds_a_condition_or_the_joints_own_position(here):
    found = products(here, ("joint", "base", "tool"))
    pairs = [(law.kind, law.place, frozenset((law.quantity, law.by))) for law in found]
    assert len(set(pairs)) == len(pairs)
    assert all(len(both) == 2 for *_, both in pairs)
    for kind, place, both in pairs:
        own = {*conditions(here, place), place} if kind == "joint" else set(conditions(here))
        assert both & own
    assert ("tool", "tool", frozenset(("payload", "gravity.x"))) in pairs
    assert ("joint", "joint_2", frozenset(("joint_2", "joint_3"))) in pairs
    for law in found[::11]:
        columns = block(here, law).columns
        assert columns.shape[2] == 4 * {"joint": 1, "base": 6, "tool": 3}[law.kind]
        functions = law.at_rows(here)[0]
        # each quantity runs over its range
        assert functions.min() >= 0.0
        assert functions.max() == pytest.approx(1.0)


def test_a_joint_relaxes_after_each_start_by_as_much_or_by_its_own(rv_m2):
    labels = {"session": np.repeat(["am", "pm"], 20)}
    there = observed(rv_m2, labels=labels)
    time = there.covariates["time"]
    found = [law for law in memory(there) if law.quantity == "time" and law.place == "joint_2"]
    assert {law.shape for law in found} == {"relaxing", "relaxing each"}
    assert all((law.runs, law.starts) == (("am", "pm"), (time[:20].min(), time[20:].min())) for law in found)
    for law in found:
        functions, names = law.at_rows(there)
        assert len(names) == functions.shape[1] == (2 if law.shape == "relaxing" else 3)
        left = functions[:, 1:].sum(axis=1)
        expected = np.exp(-(time - np.repeat([time[0], time[20]], 20)) / law.marks[0])
        np.testing.assert_allclose(left, expected, rtol=1e-9)


def test_each_joint_remembers_its_own_turns_if_rows_are_in_an_order(here):
    every = memory(here)
    found = [law for law in every if law.quantity != "time"]
    assert {law.quantity for law in found} == {f"since_turn.{joint}" for joint in here.robot.joint_names}
    assert all(law.quantity == f"since_turn.{law.place}" and law.unit == "rad" for law in found)
    assert {law.shape for law in found} == {"smooth", "hysteresis"}
    for law in found:
        # what shows between lost motion and a spring that never slips
        longest = np.abs(here.campaign.since_turn[law.place]).max()
        assert law.shape == "smooth" or (0.03 * longest <= min(law.marks) and max(law.marks) <= longest)
    # each joint its start, too: here that of the campaign
    started = [law for law in every if law.quantity == "time"]
    assert {law.place for law in started} == set(here.robot.joint_names)
    assert {(law.shape, law.starts) for law in started} == {("relaxing", (here.covariates["time"].min(),))}
    assert memory(observed(here.robot, covariates={})) == []
    assert memory(observe(commanded(here.robot))) == []


def test_a_wave_does_not_change_with_its_own_position(rv_m2):
    """It would be any law of that position, of many functions that cancel."""
    found = modulated(observed(rv_m2), [library()["transmission_error"], library()["joint_gain"]])
    assert not any(law.quantity == law.place for law in found)
