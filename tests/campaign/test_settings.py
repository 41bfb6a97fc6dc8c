"""Settings: to a plain dict and back, and what is refused on the way."""

from __future__ import annotations

import json

import pytest
from campaign.files import URDF, full

from thermal_robot.campaign import Settings, Units, unit_of
from thermal_robot.campaign.names import did_you_mean, listed, nearest
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nonsense": 1}, "nonsense: is not known"),
        ({"target": [1.0, 2.0]}, r"target: is \[1\.0, 2\.0\], expected three numbers"),
        ({"gravity": [0, 0, -9810]}, r"gravity\[2\]: is -9810, expected a number of m/s"),
        ({"units": {"angle": "deg", "length": "yard"}}, r'units\.length: unknown unit, expected "m" or "mm" or "um"'),
        ({"units": {"angle": "deg"}}, r"units\.length: is missing"),
        ({"base_known": 1}, "base_known: is 1, expected true or false"),
        ({"priors": [1.0]}, r"priors: is \[1\.0\], expected values by name"),
    ],
)
def test_settings_refuse_other_keys_and_values(change, said):
    with pytest.raises(CampaignError, match=rf"^model\.json, {said}"):
        Settings.from_dict(full().settings.to_dict() | change, "model.json")


def test_a_journey_through_json_changes_nothing():
    settings, bare = full().settings, Settings("robot.urdf", "tool")
    for own in (settings, bare):
        assert Settings.from_dict(json.loads(json.dumps(own.to_dict()))) == own
    assert (settings.units, settings.target) == (Units("deg", "mm"), (0.001, 0.002, 0.08))
    assert (bare.gravity, bare.noise_position, bare.noise_orientation) == (None, None, None)
    data = bare.to_dict()
    assert (Settings.from_dict(data).moves, Settings.from_dict(data).turned) == ("direct", ())
    assert "turned" not in data
    del data["moves"]  # of before moves were derived, which were fitted to what was recorded
    assert Settings.from_dict(data).moves == "unknown"
    del data["tool_frame"]
    with pytest.raises(CampaignError, match="tool_frame: is missing"):
        Settings.from_dict(data)


# ---- units and names of columns


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(URDF, "tool")


UNIT = {
    **dict.fromkeys(("turn", "roll", "tilt.x", "tilt.beam.y", "tilt.left.arm.x", "encoder.turn"), ("rad", "deg")),
    **dict.fromkeys(("slide", "x", "y.2", "sim.z", "noise", "encoder.slide"), ("m", "mm")),
    **dict.fromkeys(("temperature", "temperature.beam", "temperature.left.arm"), ("°C", "°C")),
    "time": ("s", "s"),
    "payload": ("kg", "kg"),
    "velocity.lift": ("rad/s", "deg/s"),
    "velocity.slide": ("m/s", "mm/s"),
    "acceleration.roll": ("rad/s²", "deg/s²"),
    "acceleration.slide": ("m/s²", "mm/s²"),
    "torque.lift": ("N·m", "N·m"),
    "torque.slide": ("N", "N"),
    **dict.fromkeys(("qw", "sim.qw", "order", "speed", "approach.lift", "approach.slide"), ("", "")),
    # not defined by the format: nobody knows
    **dict.fromkeys(("humidity", "velocity", "velocity.grip", "torque.", "grip", "time.start"), ("", "")),
    **dict.fromkeys(("tilt.beam", "tilt.beam.z"), ("", "")),
}
"""Units of columns, in SI and in a file of degrees and millimetres."""


@pytest.mark.parametrize("column", UNIT)
def test_every_column_has_its_unit(robot: Robot, column: str) -> None:
    assert (unit_of(column, robot), unit_of(column, robot, Units("deg", "mm"))) == UNIT[column]


@pytest.mark.parametrize(
    ("arguments", "column", "found"),
    [(("grad", "m"), "angle_unit", "'grad'"), (("rad", "yard"), "length_unit", "'yard'")],
)
def test_other_words_are_refused(arguments: tuple[str, str], column: str, found: str) -> None:
    with pytest.raises(CampaignError, match="unknown unit") as caught:
        Units(*arguments)
    assert (caught.value.column, caught.value.found) == (column, found)


def test_the_nearest_come_first_whatever_their_case_and_only_where_there_are_any() -> None:
    candidates = ["Shoulder_Lift_Joint", "shoulder_pan_joint", "elbow_joint", "x"]
    assert nearest("shoulder_lift_joint", candidates)[0] == "Shoulder_Lift_Joint"
    assert nearest("shoulder_lift_joint", candidates, count=1) == ["Shoulder_Lift_Joint"]
    assert "x" not in nearest("shoulder_lift_joint", candidates)
    assert nearest("elbow", []) == []
    assert did_you_mean("elbow_jiont", ["elbow_joint", "wrist"]) == "; did you mean 'elbow_joint'?"
    assert did_you_mean("humidity", ["elbow_joint", "wrist"]) == ""
    assert did_you_mean("elbow", ["elbow_joint"]) != ""
    assert did_you_mean("elbow", ["elbow_joint"], cutoff=0.85) == ""


def test_a_long_list_is_cut_off_and_counted() -> None:
    assert listed(["a", "b"]) == "'a', 'b'"
    assert listed(["a", "b", "c", "d"], limit=2) == "'a', 'b' and 2 more"
    assert listed([]) == ""
