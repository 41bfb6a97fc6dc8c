"""Settings: to a plain dict and back, and what is refused on the way."""

import json

import pytest
from campaign.files import full

from thermal_robot.campaign import Settings, Units
from thermal_robot.campaign.settings import as_vector
from thermal_robot.errors import CampaignError


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nonsense": 1}, "nonsense: is not known"),
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
