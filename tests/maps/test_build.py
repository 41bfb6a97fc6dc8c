"""A map that is stopped and gone on with is the map; two maps are never mixed."""

import numpy as np
import pytest

from thermal_robot.errors import CampaignError, RobotError
from thermal_robot.maps import Joints, Positions, Question, settings, workspace_map

pytest.importorskip("pyarrow", reason="the extra parquet is not installed")


class Stop(Exception):
    """Stands for the keyboard's."""


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(settings, "CHUNK", 30)


@pytest.mark.parametrize("end", ["parquet", "zarr"])
def test_a_run_that_was_stopped_is_gone_on_with(rv_m2, plane, question, tmp_path, end):
    pytest.importorskip({"parquet": "pyarrow", "zarr": "zarr"}[end], reason="its extra is not installed")
    whole = workspace_map(rv_m2, plane, tmp_path / f"whole.{end}", question)
    path = tmp_path / f"stopped.{end}"

    def stop(_stage, done, _all):
        if done == 2:
            raise Stop

    with pytest.raises(Stop):
        workspace_map(rv_m2, plane, path, question, progress=stop)
    told = []
    again = workspace_map(rv_m2, plane, path, question, progress=lambda *said: told.append(said[1:]))
    assert told == [(2, 3), (3, 3)]
    assert again.complete
    one, other = whole.frame(), again.frame()
    assert len(one)
    np.testing.assert_array_equal(one.to_numpy(), other.to_numpy())


def test_another_map_is_not_mixed_in(rv_m2, tmp_path):
    path = tmp_path / "map.parquet"
    workspace_map(rv_m2, Joints(40), path)
    with pytest.raises(CampaignError, match="holds another map; found other count, rise"):
        workspace_map(rv_m2, Joints(50), path, Question(rise=9.0))
    anew = workspace_map(rv_m2, Joints(50), path, Question(rise=9.0), replace=True)
    assert len(anew.frame(["place"])) == 50


def test_the_size_of_a_chunk_does_not_show_in_joint_positions(rv_m2, tmp_path, monkeypatch):
    small = workspace_map(rv_m2, Joints(70), tmp_path / "small.parquet").frame()
    monkeypatch.setattr(settings, "CHUNK", 4096)
    large = workspace_map(rv_m2, Joints(70), tmp_path / "large.parquet").frame()
    np.testing.assert_allclose(small.to_numpy(), large.to_numpy(), rtol=1e-9, atol=1e-18)


def test_nothing_to_map_is_refused(rv_m2, tmp_path):
    with pytest.raises(RobotError, match="nothing to map"):
        workspace_map(rv_m2, Positions((0, 1, 0), (0, 1, 1), (0, 1, 1)), tmp_path / "map.parquet")
    with pytest.raises(CampaignError, match="Positions or Joints"):
        workspace_map(rv_m2, 5, tmp_path / "map.parquet")
