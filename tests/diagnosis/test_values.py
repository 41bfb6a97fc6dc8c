"""Plain values: places in words, frames told from other effects, what JSON can hold."""

import json
import math
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest

from thermal_robot.diagnosis import values
from thermal_robot.diagnosis.values import Finding, Location, Place, is_frame, jsonable


@pytest.mark.parametrize(
    ("kind", "name", "words"),
    [("joint", "shoulder", "joint shoulder"), ("joint", "joint_3", "joint_3"), ("base", "base", "base")],
)
def test_a_place_says_its_kind_once(kind, name, words):
    assert Location(kind, name, 0.5).words.removeprefix("the ") == words


def test_a_frame_is_what_needs_a_known_frame():
    found = [
        Finding("base_frame", "not_testable", needs=("frames.base",)),
        Finding("drift", "not_testable", needs=("time",)),
        Finding("geometric", "found", 1.0),
    ]
    assert is_frame(found, "base_frame")
    assert not is_frame(found, "drift")
    assert not is_frame(found, "geometric")


def test_what_was_not_a_candidate_can_only_be_a_frame():
    """Effects are confounded with candidates, and with frames that nobody asked for."""
    assert is_frame([], "tool_frame")


def test_an_effect_that_is_not_testable_has_no_figures():
    finding = Finding("drift", "not_testable", needs=("time",))
    assert (finding.probability, finding.shrinkage, finding.shrinkage_ci95) == (None, None, None)


def test_values_are_frozen():
    kinds = [v for v in vars(values).values() if isinstance(v, type) and v.__module__ == values.__name__]
    assert len(kinds) > 10
    for kind in kinds:
        value = object.__new__(kind)
        with pytest.raises(FrozenInstanceError):
            setattr(value, fields(kind)[0].name, None)


NONE = np.zeros(0)


def place(kind, name):
    return Place(kind, name, 1.0, "time", "s", NONE, False, "rad", NONE, NONE, NONE, np.zeros((2, 0)))


@pytest.mark.parametrize(("kind", "name"), [("joint", "shoulder"), ("joint", "joint_3"), ("base", "base")])
def test_a_place_says_its_kind_as_a_location_does(kind, name):
    assert place(kind, name).words == Location(kind, name, 0.5).words


def test_numbers_of_numpy_and_what_is_not_finite_become_plain():
    given = {1: (np.float64(0.5), np.int64(3), np.bool_(True)), "none": [math.nan, -math.inf], "text": "µm"}
    found = jsonable(given)
    assert found == {"1": [0.5, 3, True], "none": [None, None], "text": "µm"}
    assert [type(value) for value in found["1"]] == [float, int, bool]
    assert json.loads(json.dumps(found, allow_nan=False)) == found
