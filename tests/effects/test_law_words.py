"""A law has a short name, and what it usually is depends on its place and on the kind of what it follows."""

from dataclasses import replace
from itertools import product

import pytest

from thermal_robot.effects import Backlash, library
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.law_words import TELLS, USUALLY, WHETHER, called, kind_of, usually
from thermal_robot.effects.quantities import GRAVITY, REACH, TURN
from thermal_robot.effects.shapes import SHAPES

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
