"""A diagnosis as JSON can hold it."""

import json
import math

import numpy as np

from thermal_robot.diagnosis.parts import Gap, gap_as_json, jsonable


def test_numbers_of_numpy_and_what_is_not_finite_become_plain():
    given = {1: (np.float64(0.5), np.int64(3), np.bool_(True)), "none": [math.nan, -math.inf], "text": "µm"}
    found = jsonable(given)
    assert found == {"1": [0.5, 3, True], "none": [None, None], "text": "µm"}
    assert [type(value) for value in found["1"]] == [float, int, bool]
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_a_gap_tells_of_orientation_only_where_it_was_measured(hall):
    gap = hall.gap
    assert isinstance(gap, Gap)
    found = gap_as_json(gap)
    assert found["orientation"] is None
    assert (found["rms_before"], found["noise_floor"]) == (gap.rms_before, gap.noise_floor)
    assert [scheme["name"] for scheme in found["schemes"]] == [scheme.name for scheme in gap.schemes]
