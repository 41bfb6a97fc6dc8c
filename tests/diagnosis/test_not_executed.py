"""Rows in which another command's pose was measured are named and left out; nothing else is taken for them."""

from dataclasses import replace

import numpy as np
import pytest

import thermal_robot as tr
from thermal_robot.diagnosis.data_checks import not_executed

ROWS = 80


@pytest.fixture(scope="module")
def sound():
    lost = {"joint_offset": 2e-3, "backlash": 2e-4}
    return tr.simulate("builtin:rv_m2", lost, tool_frame="tool0", rows=ROWS, noise=20e-6, base=np.eye(4), seed=2)


def with_places(campaign, rows, places):
    position = campaign.position.copy()
    position[rows] = places
    return replace(campaign, position=position)


def test_a_robot_that_stood_still_is_told_by_its_rows_and_they_are_left_out(sound):
    noise = 20e-6 * np.random.default_rng(1).normal(size=(7, 3))
    left, (said,) = not_executed(with_places(sound, slice(50, 57), sound.position[49] + noise))
    assert said.startswith("rows 52 to 58 were not executed as written: the robot stood still in the pose of row 51")
    assert left.rows.tolist() == [r for r in range(2, ROWS + 2) if not 52 <= r <= 58]
    np.testing.assert_array_equal(left.position, np.delete(sound.position, np.arange(50, 57), axis=0))


def test_it_stood_still_somewhere_else(sound):
    _, (said,) = not_executed(with_places(sound, slice(20, 25), sound.position[70] + 0.11))
    assert said.startswith("rows 22 to 26 were not executed as written: one place was measured in all")


@pytest.mark.parametrize(("by", "says"), [(-1, "1 row before"), (2, "2 rows later")])
def test_a_few_rows_behind_or_ahead_are_told(sound, by, says):
    rows = np.arange(60, 64)
    left, (said,) = not_executed(with_places(sound, rows, sound.position[rows + by]))
    assert said.startswith("rows 62 to 65 were not executed as written")
    assert says in said
    assert left.samples == ROWS - 4


def test_rows_are_followed_in_the_order_of_measurement(sound):
    shuffled = np.random.default_rng(3).permutation(ROWS)
    still = with_places(sound, slice(50, 57), sound.position[49])
    left, (said,) = not_executed(still.take(shuffled))
    assert left.samples == ROWS - 7
    assert "stood still in the pose of row 51" in said


def test_sound_rows_repeated_commands_and_gross_errors_stay(sound):
    rng = np.random.default_rng(5)
    assert not_executed(sound) == (sound, ())
    again = sound.take(np.repeat(np.arange(ROWS), 2))
    assert not_executed(again) == (again, ())
    for _ in range(20):
        rows = rng.choice(ROWS, 4, replace=False)
        spoilt = with_places(sound, rows, sound.position[rows] + rng.normal(size=(4, 3)) * 0.05)
        assert not_executed(spoilt) == (spoilt, ())


def test_the_diagnosis_says_so_and_names_no_bump(sound):
    told = tr.diagnose(with_places(sound, slice(50, 57), sound.position[49]), only=["joint_offset", "backlash"])
    # one place to the last digit is told first: of the robot, or of an instrument that repeats its last reading
    assert any("8 rows (51, 52, 53, 54, 55 …)" in warning and "stood still" in warning for warning in told.warnings)
    assert set(told.verdict) == {"joint_offset", "backlash"}
    assert not told.outliers
