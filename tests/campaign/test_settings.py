"""Settings: to a plain dict and back, and what is refused on the way."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from campaign.files import URDF, full

from thermal_robot.campaign import Settings, Units, names, unit_of
from thermal_robot.campaign.names import did_you_mean, listed, nearest, split_name
from thermal_robot.campaign.settings import as_vector
from thermal_robot.campaign.units import scale_of
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nonsense": 1}, "nonsense: is not known"),
        ({"target": [1.0, 2.0]}, r"target: is \[1\.0, 2\.0\], expected three numbers"),
        ({"target": [1.0, float("nan"), 0.0]}, r"target: is \[1\.0, nan, 0\.0\], expected three numbers"),
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


@pytest.mark.parametrize("wrong", [[1, 2], [1, 2, 3, 4], ["x", 1, 2]])
def test_a_vector_is_three_floats(wrong):
    assert [type(value) for value in as_vector([1, 2, 3])] == [float] * 3
    with pytest.raises(ValueError, match=r"."):
        as_vector(wrong)


# ---- units and names of columns


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(URDF, "tool")


UNIT = {
    **dict.fromkeys(("turn", "roll", "tilt.x", "tilt.beam.y", "encoder.turn"), ("rad", "deg")),
    **dict.fromkeys(("slide", "x", "y.2", "sim.z", "noise", "encoder.slide"), ("m", "mm")),
    **dict.fromkeys(("temperature", "temperature.beam"), ("°C", "°C")),
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
    **dict.fromkeys(("humidity", "velocity", "velocity.grip", "grip", "time.start"), ("", "")),
    **dict.fromkeys(("tilt.beam", "tilt.beam.z"), ("", "")),
}
"""Units of columns, in SI and in a file of degrees and millimetres."""


@pytest.mark.parametrize("column", UNIT)
def test_every_column_has_its_unit(robot: Robot, column: str) -> None:
    assert (unit_of(column, robot), unit_of(column, robot, Units("deg", "mm"))) == UNIT[column]


FACTORS = {"deg": math.pi / 180, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "inch": 0.0254, "in": 0.0254, "ft": 0.3048}


@pytest.mark.parametrize(
    "units", [Units("deg", "mm"), Units("rad", "um"), Units("deg", "inch"), Units("rad", "ft"), Units()]
)
def test_the_scale_is_the_ratio_of_the_two_units(robot: Robot, units: Units) -> None:
    for column in full().covariates:
        word = unit_of(column, robot, units).partition("/")[0]
        assert scale_of(column, robot, units) == pytest.approx(FACTORS.get(word, 1.0), rel=1e-15)


def test_a_joints_scale_is_that_of_its_kind() -> None:
    units = Units("deg", "um")
    assert np.rad2deg(units.joint_scale("revolute")) == pytest.approx(1.0)
    assert units.joint_scale("continuous") == units.joint_scale("revolute") == units.angle_scale
    assert units.joint_scale("prismatic") == units.length_scale == 1e-6
    assert [units.joint_unit(kind) for kind in ("revolute", "continuous", "prismatic")] == ["deg", "deg", "um"]


@pytest.mark.parametrize(
    ("arguments", "column", "found"),
    [(("grad", "m"), "angle_unit", "'grad'"), (("rad", "yard"), "length_unit", "'yard'")],
)
def test_other_words_are_refused(arguments: tuple[str, str], column: str, found: str) -> None:
    with pytest.raises(CampaignError, match="unknown unit") as caught:
        Units(*arguments)
    assert (caught.value.column, caught.value.found) == (column, found)


@pytest.mark.parametrize(
    ("column", "parts"),
    [
        ("approach.elbow_joint", ("approach", "elbow_joint")),
        ("temperature.left.arm", ("temperature", "left.arm")),
        ("time", ("time", "")),
        ("torque.", ("torque", "")),
    ],
)
def test_a_name_is_a_quantity_and_a_place(column: str, parts: tuple[str, str]) -> None:
    assert split_name(column) == parts
    assert len(set(names.RESERVED)) == len(names.RESERVED)
    assert {*"xyz", "qw", "sim.x", "sim.qz", "session", "pose", "path", "time", "speed"} <= set(names.RESERVED)


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
