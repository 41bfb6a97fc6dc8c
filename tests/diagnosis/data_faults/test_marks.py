"""Marks of a lost beam are told with their rows and value, and no fault of a unit is made of them."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.diagnosis.data_faults import data_fault
from thermal_robot.diagnosis.data_faults.marks import marks_of_missing
from thermal_robot.diagnosis.data_faults.readings import Readings


@pytest.fixture(scope="module")
def sound(rv_m2):
    return simulate(rv_m2, ["joint_offset"], samples=60, seed=3)[0]


def marked(campaign, value, axes, every, first=1):
    position = np.array(campaign.position)
    rows = np.arange(first, campaign.samples, every)
    position[np.ix_(rows, axes)] = value * campaign.units.length_scale
    return replace(campaign, position=position), rows


@pytest.mark.parametrize(
    ("value", "axes", "said"),
    [
        (-9999.0, [0], "x is −9999 in"),
        (99999.0, [2], "z is 99999 in"),
        (-1e5, [0, 1, 2], "x is −100000 in"),
        (0.0, [0, 1, 2], "x, y and z are 0 in"),
    ],
)
@pytest.mark.parametrize("every", [3, 7, 15])
def test_marks_are_told_with_their_rows(sound, value, axes, said, every):
    spoilt, rows = marked(sound, value, axes, every)
    found = data_fault(spoilt)
    assert found.kinds == ("missing value",)
    assert f"{said} {len(rows)} rows" in found.what
    assert found.rows == tuple(int(r) for r in sound.rows[rows])
    assert found.rms_after < 1e-3 < 0.01 * found.rms_before


def test_they_end_the_diagnosis_in_a_sentence(sound):
    found = diagnose(marked(sound, -9999.0, [0], 7)[0])
    assert not found.usable
    assert "unit" not in found.reason
    assert "a mark of a missing value" in found.reason


def test_values_that_only_happen_to_be_alike_are_no_marks(sound):
    assert marks_of_missing(sound, Readings.of(sound)) is None
    # to a tenth of a metre many values are alike
    rounded = replace(sound, position=np.round(sound.position, 1))
    assert marks_of_missing(rounded, Readings.of(rounded)) is None
    # measurements of one pose may well be alike to the last digit
    again = sound.take(np.repeat(np.arange(12), 5))
    assert marks_of_missing(again, Readings.of(again)) is None
    # and the target may be where the instrument's origin is
    near = replace(sound, position=sound.position - sound.position[0])
    assert marks_of_missing(near, Readings.of(near)) is None
