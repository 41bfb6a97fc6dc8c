"""Which laws are tried: their places, quantities, knots and shapes."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference.columns import block
from thermal_robot.inference.screening import harmonics, laws, of_quantity, shapes, smooth_columns
from thermal_robot.observations import Frames, observe


def observed(robot, **changes):
    campaign = replace(simulate(robot, samples=40, seed=2)[0], **changes)
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


@pytest.mark.parametrize("arm", ["rv_m2", "panda"], indirect=True)
def test_every_law_that_is_tried_has_columns(arm):
    here = observed(arm)
    for law in laws(here, ("joint", "base", "tool", "link"), ["time", "payload", arm.joint_names[0]]):
        own = block(here, law).columns
        assert own.shape[2] >= 1
        assert np.isfinite(own).all()
        assert np.abs(own).max() > 0.0


def test_labels_are_levels_with_their_names(rv_m2):
    session = np.array(["monday", "tuesday", "friday"])[np.arange(40) % 3]
    here = observed(rv_m2, labels={"session": session})
    (law,) = laws(here, ("base",), ["session"])
    assert (law.shape, law.labels) == ("levels", ("friday", "monday", "tuesday"))
    assert law.functions(law.values(here))[1] == ("at friday", "at monday", "at tuesday")


def test_a_stated_gear_adds_the_orders_of_the_motor(rv_m2):
    here = observed(rv_m2, gears={"joint_2": 101.0})
    assert harmonics(here, "joint_1") == (1.0, 2.0, 3.0)
    assert harmonics(here, "joint_2") == (1.0, 2.0, 3.0, 101.0, 202.0)
    tried = {law.marks for law in laws(here, ("joint",), ["joint_2"]) if law.shape == "harmonic"}
    assert tried == {(1.0,), (2.0,), (3.0,), (101.0,), (202.0,)}


def test_knots_stand_apart_where_most_values_lie_in_one_spot():
    rng = np.random.default_rng(0)
    values = np.concatenate([1.0 - 1e-6 * rng.random(500), rng.uniform(0.7, 1.0, 20)])
    marks = np.array(of_quantity(Discovered(), values).marks)
    assert np.diff(marks).min() > 0.2 * np.ptp(values) / len(marks)
    spread = rng.uniform(-1.0, 1.0, 500)
    np.testing.assert_allclose(
        of_quantity(Discovered(), spread).marks, np.quantile(spread, np.linspace(0.02, 0.98, 5)), rtol=1e-12
    )


def test_few_values_are_levels_and_many_a_smooth_law():
    few = of_quantity(Discovered(), np.array([3.0, 1.0, 2.0, 1.0, 3.0]))
    assert (few.shape, few.marks, few.origin, few.span) == ("levels", (1.0, 2.0, 3.0), 1.0, 2.0)
    assert of_quantity(Discovered(), np.arange(6.0)).shape == "levels"
    many = of_quantity(Discovered(), np.arange(7.0))
    assert (many.shape, len(many.marks), many.origin, many.span) == ("smooth", 5, 0.0, 6.0)
    assert len(of_quantity(Discovered(), np.arange(20.0), knots=9).marks) == 9


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


def test_every_shape_holds_the_constant_and_marks_lie_within_the_range():
    """An error that is the same throughout must not look like a law; beyond the outer marks no row would speak."""
    values = np.random.default_rng(2).uniform(-1.0, 1.0, 200)
    law = of_quantity(Discovered(quantity="velocity.joint_1", place="velocity.joint_1"), values)
    for shape in shapes(law, values):
        functions = shape.functions(values)[0]
        ones = np.ones(200)
        fitted = functions @ np.linalg.lstsq(functions, ones, rcond=None)[0]
        np.testing.assert_allclose(fitted, ones, atol=1e-9, err_msg=shape.shape)
        if shape.shape in ("step", "slide", "hinge", "bump"):
            assert np.mean(values < shape.marks[0]) > 0.05
            assert np.mean(values > shape.marks[0]) > 0.05


@pytest.mark.parametrize("unit", [(1.0, 0.0), (1e-3, 273.15), (-40.0, 7.0)], ids=["as it is", "scaled", "reversed"])
def test_smooth_columns_are_uncorrelated_and_do_not_depend_on_units(unit):
    rng = np.random.default_rng(3)
    for values in (rng.uniform(-1.0, 1.0, 300), rng.choice([0.0, 1.0, 4.0], 300)):
        own = smooth_columns(unit[0] * values + unit[1])
        k = own.shape[1]
        assert k == (4 if len(set(values)) > 6 else 2)
        np.testing.assert_allclose(own.mean(axis=0), 0.0, atol=1e-9)
        np.testing.assert_allclose(own.T @ own / 300, np.eye(k), atol=1e-9)
        plain = smooth_columns(values)
        np.testing.assert_allclose(own @ own.T, plain @ plain.T, atol=1e-6)
        # a straight line is one of their sums
        line = values - values.mean()
        np.testing.assert_allclose(own @ (own.T @ line) / 300, line, atol=1e-6)


def test_a_quantity_that_does_not_vary_has_no_columns():
    assert smooth_columns(np.full(20, 3.0)).shape == (20, 0)
