"""Laws in words and in size: names, descriptions, what they usually are, events by their rows, how much they change."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot.effects import Backlash, Geometric, TransmissionError, library
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.law_words import (
    TELLS,
    USUALLY,
    WHETHER,
    Size,
    called,
    event,
    in_joints,
    is_event,
    kind_of,
    sizes,
    usually,
)
from thermal_robot.effects.quantities import GRAVITY, REACH, TURN
from thermal_robot.effects.shapes import SHAPES
from thermal_robot.observations import observe

JOINTS = ("shoulder", "elbow")
KINDS = {
    "own position": ("elbow", "encoder.elbow"),
    "position": ("shoulder", "encoder.shoulder", *GRAVITY, *REACH),
    "time": ("time", "order"),
    "session": ("session",),
    "temperature": ("temperature", "temperature.arm"),
    "load": ("torque.shoulder", "payload", "tilt.x"),
    "motion": ("velocity.elbow", "acceleration.elbow", "speed"),
    "approach": ("approach.elbow",),
    "memory": (TURN + "elbow",),
    "nothing": ("none",),
    "": ("humidity", "time.start"),
}


def test_a_quantity_has_a_kind_as_seen_from_a_joint_and_the_tables_know_all_kinds():
    found = {kind: tuple(n for n in names if kind_of(n, "elbow", JOINTS) == kind) for kind, names in KINDS.items()}
    assert found == KINDS
    kinds = set(KINDS) - {""}
    assert set(TELLS) == {kind for _, kind in USUALLY} == kinds
    assert {place for place, _ in USUALLY} <= {"joint", "link", "base", "tool", ""}
    assert {column for columns in TELLS.values() for column in columns} == set(WHETHER)


TIMED = Discovered(kind="base", place="base", quantity="time", shape="step", marks=(390.0,), span=540.0, unit="s")


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (Discovered(place="elbow", quantity="elbow"), "gears or an encoder"),
        (Discovered(place="elbow", quantity="time"), "warming, or something that slips"),
        (Discovered(kind="base", place="base", quantity="time"), "warming, or something that slips"),
        (Discovered(kind="tool", place="tool", quantity="session"), "a tool or a target that was mounted anew"),
        (Discovered(kind="base", place="base", quantity="session"), "a base or an instrument that was set up anew"),
        (Discovered(kind="link", place="elbow", quantity="payload"), "something that yields to load"),
        (Discovered(kind="tool", place="tool", quantity="humidity"), ""),
        # of two quantities the first that says something counts
        (Discovered(place="elbow", quantity="humidity", by="payload"), "something that yields to load"),
        # an event is usually something set up anew
        (TIMED, "a base or an instrument that was set up anew"),
        (replace(TIMED, kind="joint", place="elbow"), "a joint that was referenced anew"),
    ],
)
def test_what_a_law_usually_is(law, words):
    assert usually(law, JOINTS) == words


PLACES = (("joint", "elbow"), ("link", "elbow"), ("base", "base"), ("tool", "tool"))


def test_the_name_of_a_law_is_short_and_both_words_tell_place_and_quantity():
    names = [name for names in KINDS.values() for name in names]
    for (kind, place), quantity, shape in product(PLACES, names, SHAPES):
        if quantity.startswith(TURN) and kind != "joint":
            continue  # only a joint turns back
        law = Discovered(kind=kind, place=place, quantity=quantity, shape=shape, marks=(-350.0, 20.0), unit="s")
        name, words = called(law), law.describe()
        assert len(name.split()) <= 7
        assert place in name
        assert place in words
        told = quantity, "its position", "it turned", "it last turned"
        assert shape == "constant" or (any(t in name for t in told) and any(t in words for t in told))
        assert ("−350 s" in words) == bool(SHAPES[shape].mark)
        assert "{" not in name + words


STEP = Discovered(kind="joint", place="joint_3", quantity="time", shape="step", marks=(350.0,), span=800.0, unit="s")
ELBOW = replace(STEP, place="elbow")
TOOL = Discovered(kind="tool", place="tool", quantity="session", shape="levels", labels=("s1", "s2"))
BETWEEN = replace(STEP, kind="tool", place="tool", marks=(3.0,), runs=("s1", "s2"))
ONE = replace(TOOL, shape="apart", marks=(1.0,))
WAVE = replace(STEP, quantity="joint_3", shape="harmonic", marks=(101.0,))
CHANGING = replace(ELBOW, shape="ramp", quantity="payload", of="backlash")
PERIODIC = replace(ELBOW, shape="ramp", of="transmission_error")
PRODUCT = replace(TOOL, quantity="time", labels=(), shape="ramp", by="payload")
TURNED = replace(STEP, quantity="since_turn.joint_3", shape="hysteresis", marks=(0.25,), unit="rad")
SETTLING = replace(STEP, shape="relaxing each", marks=(90.0,), runs=("a", "b"))


WORDS = {
    "the zero of joint_3 jumped at time 350 s": STEP,
    "the zero of joint_3 jumped at time −12346 s": replace(STEP, marks=(-12345.6,)),
    "the zero of joint elbow jumped at order 57": replace(ELBOW, quantity="order", marks=(57.0,), unit=""),
    "the zero of joint elbow jumped at time 350 s, between session a and b": replace(ELBOW, runs=("a", "b")),
    "an error at joint_3 that follows joint_2 (a step at 350 rad)": replace(STEP, quantity="joint_2", unit="rad"),
    "an error at the base that follows time (a step at 350 s)": replace(STEP, kind="base"),
    "an error at the base that follows time (in proportion)": replace(STEP, kind="base", shape="ramp"),
    "a constant error at joint elbow": replace(ELBOW, shape="constant"),
    "a constant error at the placement of joint_3": replace(STEP, kind="link", shape="constant"),
    "an error at joint_3 that follows its position (harmonic of order 101)": WAVE,
    "an error at joint_3 that follows its position (a wave of 0.06221 m)": replace(WAVE, unit="m"),
    "lost motion in joint elbow that changes with payload (in proportion)": CHANGING,
    "a periodic transmission error in joint elbow that changes with time (in proportion)": PERIODIC,
    "an error at the tool that follows time times payload (in proportion)": PRODUCT,
    "an error at joint_3 that follows how far it has gone since it last turned round (springs that slip)": TURNED,
    "an error at joint_3 that follows time (it settles within 90 s of each start)": SETTLING,
    "the tool stands elsewhere from session s2 on": BETWEEN,
    "the tool stands elsewhere in session s2 than in s1": TOOL,
    "the tool stands elsewhere in each session": replace(TOOL, labels=("s1", "s2", "s3")),
    "the tool stands elsewhere in session s2": ONE,
    "the zero of joint elbow is another in session s2": replace(ONE, kind="joint", place="elbow"),
}
NAMES = {
    "a step at joint_3 over time": STEP,
    "a step at joint_3 over joint_2": replace(STEP, quantity="joint_2"),
    "a step at elbow between sessions": replace(ELBOW, runs=("a", "b")),
    "a step at the tool between sessions": BETWEEN,
    "a constant error at elbow": replace(ELBOW, shape="constant"),
    "a wave at joint_3 over its position": WAVE,
    f"{library()['backlash'].singular} in elbow over payload": CHANGING,
    "a periodic transmission error in elbow over time": PERIODIC,
    "an error at the tool over time times payload": PRODUCT,
    "an error at joint_3 since it turned": TURNED,
    "the tool standing elsewhere in session s2": ONE,
}


def test_a_law_in_words_and_by_its_name():
    assert {words: law.describe() for words, law in WORDS.items()} == {words: words for words in WORDS}
    assert {name: called(law) for name, law in NAMES.items()} == {name: name for name in NAMES}


def clocked(robot, order=range(SAMPLES), **labels):
    campaign = commanded(robot, {"time": 60.0 * np.array(order, dtype=float)}, labels=labels)
    return observe(replace(campaign, rows=np.arange(SAMPLES) + 2))


FAR = (Size("step", 1.2e-3, 1e-5, "m"), Size("step", 3e-4, 1e-5, "rad"))
RUN = replace(TIMED, kind="tool", place="tool", shape="run", marks=(150.0, 390.0))
APART = replace(
    TIMED, kind="joint", place="joint_3", quantity="session", shape="apart", marks=(1.0,), labels=("a", "b")
)


@pytest.mark.parametrize(
    ("law", "far", "short", "whole"),
    [
        (
            TIMED,
            FAR,
            "the base 1.2 mm off from row 9 on",
            "from row 9 on (time 420 s) the base or the instrument stands 1.2 mm and 0.3 mrad elsewhere",
        ),
        # what is seldom is told: of a step the shorter side
        (
            replace(TIMED, marks=(150.0,)),
            [Size("step", 5e-5, 1e-4, "m")],
            "the base a little off in rows 2–4",
            "in rows 2 to 4 (time 0 to 120 s) the base or the instrument stands a little elsewhere",
        ),
        (
            RUN,
            [Size("step", 5e-5, 1e-6, "m"), Size("step", 0.2, 1e-5, "rad")],
            "the target 50 µm off in rows 5–8",
            "in rows 5 to 8 (time 180 to 360 s) the target sits 50 µm and 0.2 rad elsewhere on the tool",
        ),
        (
            APART,
            [Size("difference", 1.1e-3, 1e-5, "rad")],
            "joint_3 1.1 mrad off in rows 6–8",
            "in session b (rows 6 to 8) joint_3 counts from a zero 1.1 mrad off",
        ),
        # rows of the other session do not follow each other: the session says it
        (replace(APART, marks=(0.0,)), FAR, "", ""),
        (replace(TIMED, quantity="temperature"), FAR, "", ""),
        (replace(TIMED, shape="ramp", marks=()), FAR, "", ""),
    ],
)
def test_an_event_is_told_by_the_rows_of_the_file_in_which_it_shows(rv_m2, law, far, short, whole):
    seen = clocked(rv_m2, session=np.array(["a"] * 4 + ["b"] * 3 + ["a"] * 3))
    assert event(law, seen, far) == (short, whole)
    assert is_event(law) or not short
    # of rows that are not side by side in the file none tells when it was
    assert event(TIMED, clocked(rv_m2, [9, 0, 8, 1, 7, 2, 6, 3, 5, 4]), far) == ("", "")


TIME = np.array([0.0, 40.0, 100.0, 180.0, 300.0, 420.0, 500.0, 610.0, 700.0, 800.0])


@pytest.fixture(scope="module")
def observations(rv_m2):
    labels = {"session": np.array(list("aabbbccaca"))}
    recorded = {"time": TIME, **{f"approach.{j}": np.tile([-1.0, 1.0], 5) for j in rv_m2.joint_names}}
    return observe(replace(commanded(rv_m2, recorded), labels=labels))


def test_a_step_is_as_high_as_it_steps_whatever_constant_goes_with_it(observations):
    known = np.diag([9e-12, 16e-12])
    for own, spread, rel in (([2e-4, -1e-4], known, 1e-6), ([1.0002, 0.9999], known + 1e2 * np.ones((2, 2)), 1e-2)):
        (size,) = sizes(STEP, observations, np.array(own), spread)
        assert (size.what, size.unit) == ("step", "rad")
        assert size.value == pytest.approx(3e-4)
        assert size.std == pytest.approx(5e-6, rel=rel)
    (size,) = sizes(replace(STEP, of=Backlash.name), observations, np.array([1e-4, 3e-4]), 1e-12 * np.eye(2))
    assert (size.value, size.unit) == (pytest.approx(2e-4), "rad")
    assert sizes(replace(STEP, quantity="humidity"), observations, np.zeros(2), np.eye(2)) == ()
    assert {shape.size for shape in SHAPES.values()} == {"range", "step", "bump", "peak to peak", "difference"}


@pytest.mark.parametrize("kind", ["base", "tool"])
def test_elsewhere_than_in_a_joint_it_is_a_shift_and_a_turn(observations, kind):
    law, own = replace(STEP, kind=kind, place=kind), np.zeros(12)
    own[[6, 8, 10]] = 3e-4, -4e-4, 2e-4
    shift, turn = sizes(law, observations, own, 1e-12 * np.eye(12))
    assert [(s.unit, s.value) for s in (shift, turn)] == [("m", pytest.approx(5e-4)), ("rad", pytest.approx(2e-4))]
    assert shift.std == pytest.approx(np.sqrt(2.0) * 1e-6)
    # sessions differ by the two that differ most
    law = replace(law, quantity="session", shape="levels", marks=(0.0, 1.0, 2.0), labels=("a", "b", "c"))
    own = np.zeros((3, 6))
    own[1, 0], own[2, 0] = 1e-4, -3e-4
    shift, turn = sizes(law, observations, own.ravel(), np.zeros((18, 18)))
    assert (shift.what, shift.value, turn.value) == ("difference", pytest.approx(4e-4), 0.0)


def test_waves_that_do_the_same_are_well_known_together(rv_m2):
    """What is known of their sum is told, however little is known of each."""
    here = observe(commanded(rv_m2))
    parameters = [p for p in TransmissionError().parameters(here) if p.place in ("joint_2", "joint_4")]
    own, spread = np.zeros(8), np.zeros((8, 8))
    own[0], own[7], spread[0, 0], spread[7, 7] = 1e-3, 3e-3, 4e-10, 9e-10
    large, small = in_joints(parameters, own, spread)
    told = [(s.what, s.place, s.unit) for s in (large, small)]
    assert told == [("peak to peak", "joint_4", "rad"), ("peak to peak", "joint_2", "rad")]
    assert large.value == pytest.approx(3e-3 * np.ptp(np.cos(2 * here.q[:, 3])))
    assert large.std == pytest.approx(large.value / 3e-3 * 3e-5)
    assert small.value == pytest.approx(1e-3 * np.ptp(np.sin(here.q[:, 1])))
    assert small.std == pytest.approx(small.value / 1e-3 * 2e-5)
    alike = 1e-6 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    (sum_of,) = in_joints([parameters[0]] * 2, np.array([3e-3, -2e-3]), alike)
    assert sum_of.value == pytest.approx(small.value)
    assert sum_of.std == pytest.approx(0.0, abs=1e-12)
    # a twist is no change of a joint
    assert in_joints(Geometric().parameters(here)[:6], np.ones(6), np.eye(6)) == ()
