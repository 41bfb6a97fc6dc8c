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
    assert (caught.value.file, caught.value.column) == ("model.json", next(iter(change)))


def test_settings_refuse_other_values(tmp_path: Path) -> None:
    data = full(tmp_path / "c").settings.to_dict() | {"target": [1.0, 2.0]}
    with pytest.raises(CampaignError, match=r"model\.json: settings cannot be read"):
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
