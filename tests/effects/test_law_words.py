"""A law has a short name, and what it usually is depends on its place and on the kind of what it follows."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from helpers import SAMPLES, commanded

from thermal_robot.effects import Backlash, library
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.law_words import TELLS, USUALLY, WHETHER, Size, called, event, is_event, kind_of, usually
from thermal_robot.effects.quantities import GRAVITY, REACH, TURN
from thermal_robot.effects.shapes import SHAPES
from thermal_robot.observations import observe

JOINTS = ("shoulder", "elbow")
NAMES = (
    *("time", "order", "session", "temperature", "temperature.arm", "payload", "torque.elbow", "velocity.elbow"),
    *("acceleration.elbow", "speed", "approach.elbow", "encoder.elbow", "none", "humidity"),
    *(*JOINTS, *GRAVITY, *REACH, TURN + "elbow"),
)


@pytest.mark.parametrize(
    ("quantity", "kind"),
    [
        ("elbow", "own position"),
        ("encoder.elbow", "own position"),
        ("shoulder", "position"),
        ("encoder.shoulder", "position"),
        ("gravity.z", "position"),
        ("reach.x", "position"),
        ("order", "time"),
        ("session", "session"),
        ("temperature.arm", "temperature"),
        ("torque.shoulder", "load"),
        ("payload", "load"),
        ("velocity.elbow", "motion"),
        ("approach.elbow", "approach"),
        (TURN + "elbow", "memory"),
        ("none", "nothing"),
        ("humidity", ""),
    ],
)
def test_a_quantity_has_a_kind_as_seen_from_a_joint(quantity, kind):
    assert kind_of(quantity, "elbow", JOINTS) == kind


def test_the_tables_know_all_kinds_and_no_others():
    kinds = {kind_of(name, "elbow", JOINTS) for name in NAMES} - {""}
    assert set(TELLS) == kinds
    assert {kind for _, kind in USUALLY} == kinds
    assert {place for place, _ in USUALLY} <= {"joint", "link", "base", "tool", ""}
    assert {column for columns in TELLS.values() for column in columns} == set(WHETHER)


@pytest.mark.parametrize(
    ("kind", "place", "quantity", "words"),
    [
        ("joint", "elbow", "elbow", "gears or an encoder"),
        ("joint", "elbow", "time", "warming, or something that slips"),
        ("base", "base", "time", "warming, or something that slips"),
        ("tool", "tool", "session", "a tool or a target that was mounted anew"),
        ("base", "base", "session", "a base or an instrument that was set up anew"),
        ("link", "elbow", "payload", "something that yields to load"),
        ("tool", "tool", "humidity", ""),
    ],
)
def test_what_a_law_usually_is(kind, place, quantity, words):
    assert usually(Discovered(kind=kind, place=place, quantity=quantity), JOINTS) == words


def test_of_two_quantities_the_first_that_says_something_counts():
    law = Discovered(place="elbow", quantity="humidity", by="payload")
    assert usually(law, JOINTS) == usually(replace(law, quantity="payload", by=""), JOINTS) != ""


def test_the_name_of_a_law_is_short_and_tells_place_and_quantity():
    for (kind, place), quantity, shape in product(
        (("joint", "elbow"), ("link", "elbow"), ("base", "base"), ("tool", "tool")), NAMES, SHAPES
    ):
        if quantity.startswith(TURN) and kind != "joint":
            continue  # only a joint turns back
        name = called(Discovered(kind=kind, place=place, quantity=quantity, shape=shape, by=""))
        assert len(name.split()) <= 7
        assert place in name
        assert shape == "constant" or quantity in name or "its position" in name or "it turned" in name


def test_an_effect_that_changes_is_called_by_its_name():
    law = Discovered(place="elbow", quantity="temperature", shape="ramp", of=Backlash.name)
    assert called(law) == f"{library()[Backlash.name].singular} in elbow over temperature"


def test_a_step_between_sessions_says_so():
    law = Discovered(kind="tool", place="tool", quantity="time", shape="step", marks=(3.0,), runs=("s1", "s2"))
    assert called(law) == "a step at the tool between sessions"
    assert law.describe() == "the tool stands elsewhere from session s2 on"
    two = Discovered(kind="tool", place="tool", quantity="session", shape="levels", labels=("s1", "s2"))
    assert two.describe() == "the tool stands elsewhere in session s2 than in s1"
    three = replace(two, labels=("s1", "s2", "s3"))
    assert three.describe() == "the tool stands elsewhere in each session"
    apart = replace(three, shape="apart", marks=(1.0,))
    assert apart.describe() == "the tool stands elsewhere in session s2"
    assert called(apart) == "the tool standing elsewhere in session s2"
    joint = replace(apart, kind="joint", place="elbow")
    assert joint.describe() == "the zero of joint elbow is another in session s2"


def clocked(robot, order=range(SAMPLES), **labels):
    campaign = commanded(robot, {"time": 60.0 * np.array(order, dtype=float)}, labels=labels)
    return observe(replace(campaign, rows=np.arange(SAMPLES) + 2))


BASE = Discovered(kind="base", place="base", quantity="time", shape="step", marks=(390.0,), span=540.0, unit="s")
FAR = (Size("step", 1.2e-3, 1e-5, "m"), Size("step", 3e-4, 1e-5, "rad"))


@pytest.mark.parametrize(
    ("law", "short", "whole"),
    [
        (
            BASE,
            "the base 1.2 mm off from row 9 on",
            "from row 9 on (time 420 s) the base or the instrument stands 1.2 mm",
        ),
        (replace(BASE, marks=(150.0,)), "the base 1.2 mm off in rows 2–4", "in rows 2 to 4 (time 0 to 120 s) the base"),
        (
            replace(BASE, kind="tool", place="tool", shape="run", marks=(150.0, 390.0)),
            "the target 1.2 mm off in rows 5–8",
            "in rows 5 to 8 (time 180 to 360 s) the target sits 1.2 mm and 0.3 mrad elsewhere on the tool",
        ),
    ],
)
def test_an_event_is_told_by_the_rows_of_the_file_in_which_it_shows(rv_m2, law, short, whole):
    """What is seldom is told: of a step the shorter side."""
    told = event(law, clocked(rv_m2), FAR)
    assert told[0] == short
    assert told[1].startswith(whole)


def test_an_event_of_a_joint_and_of_a_session_is_told_as_such(rv_m2):
    seen = clocked(rv_m2, session=np.array(["a"] * 4 + ["b"] * 3 + ["a"] * 3))
    there = replace(BASE, kind="joint", place="joint_3", quantity="session", shape="apart", marks=(1.0,), span=1.0)
    there = replace(there, labels=("a", "b"))
    short, whole = event(there, seen, [Size("difference", 1.1e-3, 1e-5, "rad")])
    assert short == "joint_3 1.1 mrad off in rows 6–8"
    assert whole == "in session b (rows 6 to 8) joint_3 counts from a zero 1.1 mrad off"
    # rows of the other session do not follow each other: the session says it
    assert event(replace(there, marks=(0.0,)), seen, FAR) == ("", "")


def test_rows_that_are_not_side_by_side_in_the_file_and_other_laws_are_not_told_by_rows(rv_m2):
    assert event(BASE, clocked(rv_m2, [9, 0, 8, 1, 7, 2, 6, 3, 5, 4]), FAR) == ("", "")
    for law in (replace(BASE, quantity="temperature"), replace(BASE, shape="ramp", marks=())):
        assert not is_event(law)
        assert event(law, clocked(rv_m2), FAR) == ("", "")


def test_an_event_is_usually_something_set_up_anew():
    assert usually(BASE, JOINTS) == "a base or an instrument that was set up anew"
    assert usually(replace(BASE, kind="joint", place="elbow"), JOINTS) == "a joint that was referenced anew"
