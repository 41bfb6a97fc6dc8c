"""Pictures of maps: a plane as contours, all else as points."""

import numpy as np
import pytest

from thermal_robot.errors import CampaignError
from thermal_robot.maps import Joints, plot_map, workspace_map

pytest.importorskip("pyarrow", reason="the extra parquet is not installed")


def test_a_plane_is_drawn_as_contours_with_its_best_place(rv_m2, plane, question, tmp_path):
    found = workspace_map(rv_m2, plane, tmp_path / "map.parquet", question)
    figure = plot_map(found)
    own = figure.axes[0]
    assert (own.get_xlabel(), own.get_ylabel()) == ("x (m)", "y (m)")
    assert "µm" in figure.get_suptitle()
    best = found.best("required_warm", count=1)
    (star,) = own.lines
    every, (x, y) = found.frame(), np.array(star.get_data()).ravel()
    value = every.required_warm[np.hypot(every.x - x, every.y - y) < 1e-9].min()
    assert value == pytest.approx(best.required_warm[0])
    figure.savefig(tmp_path / "plane.png")


def test_joint_positions_are_points_in_space(rv_m2, tmp_path):
    found = workspace_map(rv_m2, Joints(50), tmp_path / "map.parquet")
    figure = plot_map(found, "probability")
    assert len(figure.axes[0].collections[0].get_offsets()) == 50
    with pytest.raises(CampaignError, match="no such column"):
        plot_map(found, "probabilty")
