"""How large a fitted law is: a length between two rows, whatever constant goes with it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import commanded

from thermal_robot.effects import Backlash, Geometric, TransmissionError
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.law_words import in_joints, sizes
from thermal_robot.effects.shapes import SHAPES
from thermal_robot.observations import observe

TIME = np.array([0.0, 40.0, 100.0, 180.0, 300.0, 420.0, 500.0, 610.0, 700.0, 800.0])
STEP = Discovered(kind="joint", place="joint_3", quantity="time", shape="step", marks=(350.0,), span=800.0, unit="s")


@pytest.fixture(scope="module")
def observations(rv_m2):
    labels = {"session": np.array(list("aabbbccaca"))}
    recorded = {"time": TIME, **{f"approach.{j}": np.tile([-1.0, 1.0], 5) for j in rv_m2.joint_names}}
    return observe(replace(commanded(rv_m2, recorded), labels=labels))


def test_a_step_is_as_high_as_it_steps(observations):
    (size,) = sizes(STEP, observations, np.array([2e-4, -1e-4]), np.diag([9e-12, 16e-12]))
    assert (size.what, size.unit) == ("step", "rad")
    assert size.value == pytest.approx(3e-4)
    assert size.std == pytest.approx(5e-6)


def test_a_constant_that_nothing_determines_has_no_part_in_it(observations):
    known = np.diag([9e-12, 16e-12])
    (plain,) = sizes(STEP, observations, np.array([2e-4, -1e-4]), known)
    (shifted,) = sizes(STEP, observations, np.array([1.0002, 0.9999]), known + 1e2 * np.ones((2, 2)))
    assert shifted.value == pytest.approx(plain.value)
    assert shifted.std == pytest.approx(plain.std, rel=1e-2)


@pytest.mark.parametrize("kind", ["base", "tool"])
def test_elsewhere_than_in_a_joint_it_is_a_shift_and_a_turn(observations, kind):
    law = replace(STEP, kind=kind, place=kind)
    before, after = np.zeros(6), np.array([3e-4, 0.0, -4e-4, 0.0, 2e-4, 0.0])
    shift, turn = sizes(law, observations, np.concatenate([before, after]), 1e-12 * np.eye(12))
    assert (shift.unit, turn.unit) == ("m", "rad")
    assert (shift.value, turn.value) == (pytest.approx(5e-4), pytest.approx(2e-4))
    assert shift.std == pytest.approx(np.sqrt(2.0) * 1e-6)


def test_sessions_differ_by_the_two_that_differ_most(observations):
    law = Discovered(
        kind="tool", place="tool", quantity="session", shape="levels", marks=(0.0, 1.0, 2.0), labels=("a", "b", "c")
    )
    values = np.zeros((3, 6))
    values[1, 0], values[2, 0] = 1e-4, -3e-4
    shift, turn = sizes(law, observations, values.ravel(), np.zeros((18, 18)))
    assert (shift.what, shift.value, turn.value) == ("difference", pytest.approx(4e-4), 0.0)


def test_a_law_that_is_the_size_of_an_effect_is_in_that_effects_unit(observations):
    law = replace(STEP, of=Backlash.name)
    (size,) = sizes(law, observations, np.array([1e-4, 3e-4]), 1e-12 * np.eye(2))
    assert (size.value, size.unit) == (pytest.approx(2e-4), "rad")


def test_what_the_campaign_cannot_tell_has_no_size(observations):
    assert sizes(replace(STEP, quantity="humidity"), observations, np.zeros(2), np.eye(2)) == ()


def test_every_shape_says_what_its_size_is():
    assert {shape.size for shape in SHAPES.values()} == {"range", "step", "bump", "peak to peak", "difference"}


def test_waves_that_do_the_same_are_well_known_together(rv_m2):
    """What is known of their sum is told, however little is known of each."""
    here = observe(commanded(rv_m2))
    parameters = [p for p in TransmissionError().parameters(here) if p.place in ("joint_2", "joint_4")]
    values = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3e-3])
    alike = np.zeros((8, 8))
    alike[0, 0], alike[7, 7] = 4e-10, 9e-10
    large, small = in_joints("peak to peak", parameters, values, alike)
    q = {j: here.q[:, rv_m2.joint_names.index(j)] for j in ("joint_2", "joint_4")}
    assert [(s.what, s.place, s.unit) for s in (large, small)] == [
        ("peak to peak", "joint_4", "rad"),
        ("peak to peak", "joint_2", "rad"),
    ]
    assert large.value == pytest.approx(3e-3 * np.ptp(np.cos(2 * q["joint_4"])))
    assert large.std == pytest.approx(large.value / 3e-3 * 3e-5)
    assert small.value == pytest.approx(1e-3 * np.ptp(np.sin(q["joint_2"])))
    assert small.std == pytest.approx(small.value / 1e-3 * 2e-5)
    twice = [parameters[0]] * 2
    (sum_of,) = in_joints("peak to peak", twice, np.array([3e-3, -2e-3]), 1e-6 * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    assert sum_of.value == pytest.approx(small.value)
    assert sum_of.std == pytest.approx(0.0, abs=1e-12)
    # a twist is no change of a joint
    assert in_joints("size", Geometric().parameters(here)[:6], np.ones(6), np.eye(6)) == ()
