"""Settings: to a plain dict and back, and what is refused on the way."""

from __future__ import annotations

from pathlib import Path

import pytest
from campaign.files import full

from thermal_robot.campaign import Settings
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
