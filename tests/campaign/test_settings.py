"""Settings: to a plain dict and back, and what is refused on the way."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from campaign.files import full

from thermal_robot.campaign import Settings, Units
from thermal_robot.campaign.settings import STANDARD_TEMPERATURE, as_vector
from thermal_robot.errors import CampaignError


@pytest.mark.parametrize("change", [{"tool_frame": None}, {"nonsense": 1}])
def test_settings_refuse_other_keys(tmp_path: Path, change: dict[str, object]) -> None:
    data = full(tmp_path / "c").settings.to_dict() | change
    if None in change.values():
        del data["tool_frame"]
    with pytest.raises(CampaignError) as caught:
        Settings.from_dict(data, "model.json")
    assert (caught.value.file, caught.value.key) == ("model.json", next(iter(change)))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"target": [1.0, 2.0]}, r"target: is \[1\.0, 2\.0\], expected three numbers"),
        ({"target": [1.0, float("nan"), 0.0]}, r"target\[1\]: is NaN, expected a finite number"),
        ({"noise_position": -1e-5}, "noise_position: a standard deviation cannot be negative"),
        ({"reference_temperature": -300}, "reference_temperature: no temperature is lower"),
        ({"gravity": [0, 0, -9810]}, r"gravity\[2\]: is -9810, expected a number of m/s"),
        ({"units": {"angle": "deg", "length": "yard"}}, r'units\.length: unknown unit, expected "m" or "mm" or "um"'),
        ({"units": {"angle": "deg"}}, r"units\.length: is missing"),
        ({"base_known": 1}, "base_known: is 1, expected true or false"),
        ({"gears": {"lift": 0}}, r"gears\.lift: a transmission ratio must be positive"),
        ({"priors": [1.0]}, r"priors: is \[1\.0\], expected values by name"),
        ({"moves": "straight"}, "moves: unknown word"),
    ],
)
def test_settings_refuse_other_values(tmp_path: Path, change: dict[str, object], said: str) -> None:
    data = full(tmp_path / "c").settings.to_dict() | change
    with pytest.raises(CampaignError, match=rf"^model\.json, {said}"):
        Settings.from_dict(data, "model.json")


def test_a_journey_through_json_changes_nothing(tmp_path: Path) -> None:
    settings = full(tmp_path / "c").settings
    again = Settings.from_dict(json.loads(json.dumps(settings.to_dict())))
    assert again == settings
    assert again.units == Units("deg", "mm")
    assert again.target == (0.001, 0.002, 0.08)


def test_absent_gravity_and_noise_stay_absent() -> None:
    settings = Settings("robot.urdf", "tool")
    again = Settings.from_dict(json.loads(json.dumps(settings.to_dict())))
    assert (again.gravity, again.noise_position, again.noise_orientation) == (None, None, None)
    assert again.reference_temperature == STANDARD_TEMPERATURE == 20.0


def test_settings_from_before_moves_were_derived_do_not_derive_them() -> None:
    data = Settings("robot.urdf", "tool").to_dict()
    assert Settings.from_dict(data).moves == "direct"
    del data["moves"]
    assert Settings.from_dict(data).moves == "unknown"


def test_a_vector_is_three_floats() -> None:
    assert as_vector(np.array([1, 2, 3])) == (1.0, 2.0, 3.0)
    assert all(type(value) is float for value in as_vector(np.arange(3)))
    for wrong in ([1, 2], [1, 2, 3, 4], ["x", 1, 2]):
        with pytest.raises(ValueError, match=r"."):
            as_vector(wrong)
