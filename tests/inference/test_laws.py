"""Which laws are tried: places, quantities, knots and shapes; effects that change, interactions, memory."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import commanded
from simulate import simulate

from thermal_robot.effects import Effect, JointOffset, Parameter, TransmissionError, at_joint, gate, library
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference.columns import block
from thermal_robot.inference.screening import (
    conditions,
    harmonics,
    interactions,
    laws,
    memory,
    modulated,
    of_quantity,
    shapes,
    smooth_columns,
)
from thermal_robot.observations import Frames, observe


def observed(robot, **changes):
    campaign = replace(simulate(robot, samples=40, seed=2, moving=True)[0], **changes)
    return observe(campaign, Frames.declared(campaign))


@pytest.fixture(scope="module")
def here(rv_m2):
    return observed(rv_m2)


def test_every_quantity_is_tried_at_every_place(here):
    known, robot = set(quantities(here)), here.robot
    found = laws(here, ("joint", "base", "tool"))
    smooth = {(law.kind, law.place, law.quantity) for law in found if law.shape != "harmonic"}
    places = [*(("joint", j) for j in robot.joint_names), ("base", "base"), ("tool", "tool")]
    assert smooth == {(*place, name) for place in places for name in known}
    assert len(found) == len(set(found))
    # waves of a joint's own position, and of nothing else
    waves = [law for law in found if law.shape == "harmonic"]
    assert len(waves) == 3 * robot.n
    assert all(law.quantity == law.place for law in waves)
    # at a segment a constant law as well: its geometry may be wrong
    links = laws(here, ("link",), ["time"])
    segments = [s.name for s in robot.segments[1:] if s.movable]
    assert {(law.place, law.shape) for law in links} == {(s, k) for s in segments for k in ("smooth", "constant")}


def test_a_stated_gear_adds_the_orders_of_the_motor(rv_m2):
    here = observed(rv_m2, gears={"joint_2": 101.0})
    tried = {law.marks for law in laws(here, ("joint",), ["joint_2"]) if law.shape == "harmonic"}
    assert tried == {(1.0,), (2.0,), (3.0,), (101.0,), (202.0,)}
    assert harmonics(here, "joint_1") == (1.0, 2.0, 3.0)


def test_quantities_are_levels_or_smooth_with_knots_apart():
    # knots stand apart where most values lie in one spot
    rng = np.random.default_rng(0)
    values = np.concatenate([1.0 - 1e-6 * rng.random(500), rng.uniform(0.7, 1.0, 20)])
    marks = np.array(of_quantity(Discovered(), values).marks)
    assert np.diff(marks).min() > 0.2 * np.ptp(values) / len(marks)
    spread = rng.uniform(-1.0, 1.0, 500)
    np.testing.assert_allclose(
        of_quantity(Discovered(), spread).marks, np.quantile(spread, np.linspace(0.02, 0.98, 5)), rtol=1e-12
    )
    # few values are levels and many a smooth law
    few = of_quantity(Discovered(), np.array([3.0, 1.0, 2.0, 1.0, 3.0]))
    assert (few.shape, few.marks, few.origin, few.span) == ("levels", (1.0, 2.0, 3.0), 1.0, 2.0)
    assert of_quantity(Discovered(), np.arange(6.0)).shape == "levels"
    many = of_quantity(Discovered(), np.arange(7.0))
    assert (many.shape, len(many.marks), many.origin, many.span) == ("smooth", 5, 0.0, 6.0)


def names(found):
    return {law.shape for law in found}


def test_shapes_are_those_that_the_quantity_may_have():
    values = np.random.default_rng(1).uniform(-1.0, 1.0, 200)
    plain = of_quantity(Discovered(quantity="temperature", place="joint_1"), values)
    gentle = {"smooth", "ramp", "quadratic", "hinge"}
    sudden = {"step", "slide", "bump"}
    assert names(shapes(plain, values, jumps=False)) == gentle
    assert names(shapes(plain, values)) == gentle | sudden
    assert names(shapes(replace(plain, quantity="velocity.joint_1"), values)) == gentle | sudden | {"drag"}
    own = replace(plain, quantity="joint_1")
    assert names(shapes(own, values)) == gentle | sudden | {"harmonic"}
    assert names(shapes(replace(own, kind="base"), values)) == gentle | sudden
    orders = [law.marks for law in shapes(own, values, orders=(1.0, 50.0)) if law.shape == "harmonic"]
    assert orders == [(1.0,), (50.0,)]
    # a law without a quantity has one shape; of levels a line is simpler where there are more than two
    constant = Discovered(shape="constant", quantity="none")
    assert shapes(constant, values) == [constant]
    for levels, more in ((2, set()), (3, {"ramp"})):
        count = np.arange(30.0) % levels
        assert names(shapes(of_quantity(plain, count), count)) == {"levels"} | more


@pytest.mark.parametrize("unit", [(1.0, 0.0), (1e-3, 273.15), (-40.0, 7.0)], ids=["as it is", "scaled", "reversed"])
def test_smooth_columns_are_uncorrelated_and_do_not_depend_on_units(unit):
    rng = np.random.default_rng(3)
    for values in (rng.uniform(-1.0, 1.0, 300), rng.choice([0.0, 1.0, 4.0], 300)):
        own = smooth_columns(unit[0] * values + unit[1])
        k = own.shape[1]
        assert k == (4 if len(set(values)) > 6 else 2)
        np.testing.assert_allclose(own.mean(axis=0), 0.0, atol=1e-9)
        np.testing.assert_allclose(own.T @ own / 300, np.eye(k), atol=1e-9)
        assert smooth_columns(np.full(20, 3.0)).shape == (20, 0)
        plain = smooth_columns(values)
        np.testing.assert_allclose(own @ own.T, plain @ plain.T, atol=1e-6)
        # a straight line is one of their sums
        line = values - values.mean()
        np.testing.assert_allclose(own @ (own.T @ line) / 300, line, atol=1e-6)


def test_every_effect_that_varies_in_a_joint_may_change_there(here):
    own = {"approach.joint_2", "velocity.joint_2", "acceleration.joint_2"}
    assert set(conditions(here)) == {"time", "temperature", "payload"}
    assert set(conditions(here, "joint_2")) == set(conditions(here)) | own
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


class Sag(Effect):
    """An effect of somebody's own, which no package offers."""

    name = "sag"

    def parameters(self, observations):
        return tuple(
            Parameter("sag", "rad", 1e-3, "joint", joint, (at_joint(j, observations.q[:, j]),))
            for j, joint in enumerate(observations.robot.joint_names)
        )


def test_an_effect_changes_in_the_setting_it_is_offered_in_and_never_with_what_it_is_made_of(here):
    offered = TransmissionError((1, 3), places=("joint_2",))
    found = modulated(here, [offered])
    assert {law.place for law in found} == {"joint_2"}
    assert {law.modulated for law in found} == {gate.at(TransmissionError((1, 3)), "joint_2", here)}
    # a wave that changed with its own position would be any law of that position
    found = modulated(here, [library()["transmission_error"], library()["joint_gain"]])
    assert not any(law.quantity == law.place for law in found)
    # what a saved law could not name is left out, and so is what stands still
    assert modulated(here, [Sag(), JointOffset()]) == []
    assert modulated(observed(here.robot, covariates={}), [library()["backlash"]]) == []


def test_a_session_is_a_value_each_and_no_factor(rv_m2):
    here = observed(rv_m2, labels={"session": np.array(["am", "pm", "am", "noon"] * 10)})
    (law,) = laws(here, ("base",), ["session"])
    assert law.functions(law.values(here))[1] == ("at am", "at noon", "at pm")
    found = [law, *(law for law in modulated(here) if law.quantity == "session")]
    assert {(law.shape, law.labels) for law in found} == {("levels", ("am", "noon", "pm"))}
    assert len(found) > 1
    assert not any("session" in (law.quantity, law.by) for law in interactions(here, ("joint", "base", "tool")))


def test_a_product_holds_a_condition_or_the_joints_own_position(here):
    found = interactions(here, ("joint", "base", "tool"))
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
