"""Plain values: places in words, frames told from other effects, what JSON can hold."""

import json
import math
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest

from thermal_robot.diagnosis import values
from thermal_robot.diagnosis.values import AnotherModel, Finding, Location, Place, is_frame, jsonable

NONE = np.zeros(0)


@pytest.mark.parametrize(
    ("kind", "name", "words"),
    [("joint", "shoulder", "joint shoulder"), ("joint", "joint_3", "joint_3"), ("base", "base", "base")],
)
def test_a_place_says_its_kind_once(kind, name, words):
    own = Location(kind, name, 0.5)
    assert own.words.removeprefix("the ") == words
    place = Place(kind, name, 1.0, "time", "s", NONE, False, "rad", NONE, NONE, NONE, np.zeros((2, 0)))
    assert place.words == own.words


def test_a_frame_is_what_needs_a_known_frame():
    found = [
        Finding("base_frame", "not_testable", needs=("frames.base",)),
        Finding("drift", "not_testable", needs=("time",)),
        Finding("geometric", "found", 1.0),
    ]
    assert is_frame(found, "base_frame")
    assert not is_frame(found, "drift")
    assert not is_frame(found, "geometric")
    # effects are confounded with candidates, and with frames that nobody asked for
    assert is_frame([], "tool_frame")
    assert (found[1].probability, found[1].shrinkage, found[1].shrinkage_ci95) == (None, None, None)


def test_values_are_frozen():
    kinds = [v for v in vars(values).values() if isinstance(v, type) and v.__module__ == values.__name__]
    assert len(kinds) > 10
    for kind in kinds:
        value = object.__new__(kind)
        with pytest.raises(FrozenInstanceError):
            setattr(value, fields(kind)[0].name, None)


def test_numbers_of_numpy_and_what_is_not_finite_become_plain():
    given = {1: (np.float64(0.5), np.int64(3), np.bool_(True)), "none": [math.nan, -math.inf], "text": "µm"}
    found = jsonable(given)
    assert found == {"1": [0.5, 3, True], "none": [None, None], "text": "µm"}
    assert [type(value) for value in found["1"]] == [float, int, bool]
    assert json.loads(json.dumps(found, allow_nan=False)) == found


@pytest.mark.parametrize(
    ("factor", "told"), [(None, False), (0.5, False), (25.4, False), (0.01, True), (1e3, True), (1e-3, True)]
)
def test_a_unit_is_told_from_a_sister(factor, told):
    model = AnotherModel(factor, joint="joint_3", off=0.2)
    assert model.in_another_unit is told
    assert bool(model.unit) is told
