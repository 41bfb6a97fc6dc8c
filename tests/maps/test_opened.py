"""A map that was made: its best places, those of the whole map."""

import numpy as np
import pytest

from thermal_robot.errors import CampaignError
from thermal_robot.maps import Joints, Map, settings, workspace_map

pytest.importorskip("pyarrow", reason="the extra parquet is not installed")


@pytest.fixture
def made(rv_m2, tmp_path, monkeypatch):
    monkeypatch.setattr(settings, "CHUNK", 100)
    return workspace_map(rv_m2, Joints(450), tmp_path / "map.parquet")


def test_best_places_are_those_of_all_chunks(made):
    every = made.frame()
    wanted = every[(every.z <= 0.6) & (every.margin >= 0.05)].sort_values("required_warm")
    best = made.best("required_warm", within={"z": (None, 0.6), "margin": (0.05, None)}, count=7)
    np.testing.assert_allclose(best.required_warm, wanted.required_warm[:7])
    largest = made.best("capability_warm", largest=True, count=3)
    np.testing.assert_allclose(largest.capability_warm, np.sort(every.capability_warm)[::-1][:3])
    assert made.best(within={"z": (9.0, None)}).empty


def test_a_place_is_told_once_by_its_best_posture(ur10, tmp_path):
    from thermal_robot.maps import Positions

    found = workspace_map(ur10, Positions((0.4, 0.7, 4), (0.2, 0.2, 1), (0.3, 0.3, 1)), tmp_path / "line.parquet")
    every, best = found.frame(), found.best("required", count=10)
    assert len(every) == 32
    assert best.place.is_unique
    np.testing.assert_allclose(best.required, np.sort(every.groupby("place").required.min()))
    places, values = found.values("required")
    np.testing.assert_allclose(values, every.groupby("place").required.min())
    np.testing.assert_allclose(places[:, 0], [0.4, 0.5, 0.6, 0.7])


def test_a_map_is_opened_by_its_path(made):
    again = Map(made.path)
    assert again.complete
    assert repr(again) == "<Map of 'rv_m2' over joints>"
    assert set(again.frame().columns) == set(again.columns)


def test_what_is_no_map_or_no_column_is_refused(made, tmp_path):
    with pytest.raises(CampaignError, match="there is no map"):
        Map(tmp_path / "none.parquet")
    for ask in (lambda: made.best("requierd"), lambda: made.frame(["x", "w"]), lambda: made.best(within={"w": (0, 1)})):
        with pytest.raises(CampaignError, match="no such column"):
            ask()
