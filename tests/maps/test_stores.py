"""Maps on disk and drawn: chunks whole or not there, gone on with, never mixed; the best places of the whole map."""

import numpy as np
import pytest

from thermal_robot.errors import CampaignError, RobotError
from thermal_robot.maps import Joints, Map, Positions, Question, plot_map, question, workspace_map
from thermal_robot.maps.stores import store
from thermal_robot.robot import load_robot

pytest.importorskip("pyarrow", reason="the extra parquet is not installed")
PLANE = Positions((-0.5, 0.5, 9), (-0.5, 0.5, 9), (0.2, 0.2, 1))
"""Places that an RV-M2 reaches and such that it does not."""
ASIDE = Question(axis=(0.0, 1.0, 0.0))


@pytest.fixture(params=["parquet", "zarr"])
def end(request):
    pytest.importorskip({"parquet": "pyarrow", "zarr": "zarr"}[request.param], reason="its extra is not installed")
    return request.param


@pytest.fixture(scope="module")
def plane(rv_m2, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(question, "CHUNK", 30)
        return workspace_map(rv_m2, PLANE, tmp_path_factory.mktemp("plane") / "whole.parquet", ASIDE)


@pytest.fixture
def in_chunks(monkeypatch):
    return lambda places: monkeypatch.setattr(question, "CHUNK", places)


@pytest.fixture
def made(rv_m2, tmp_path, in_chunks):
    in_chunks(100)
    return workspace_map(rv_m2, Joints(450), tmp_path / "map.parquet")


def chunk(start, count):
    return {"place": np.arange(start, start + count), "value": np.linspace(0.0, 1.0, count)}


def test_chunks_come_back_as_they_were_and_an_unfinished_one_does_not_count(end, tmp_path):
    kept = store(tmp_path / f"map.{end}")
    assert (kept.notes, kept.done) == ({}, 0)
    kept.begin({"robot": "arm", "parts": 2})
    for part in (chunk(0, 5), chunk(5, 0)):
        kept.add(part)

    class Torn(dict):
        def items(self):
            yield "place", np.arange(5, 9)
            raise TypeError

        __iter__ = None

    with pytest.raises(TypeError):
        kept.add(Torn(chunk(5, 4)))
    assert (kept.notes["robot"], kept.done) == ("arm", 2)
    kept.add(chunk(5, 3))
    parts = list(kept.chunks(["value", "place"]))
    assert [len(part["place"]) for part in kept.chunks()] == [len(part["place"]) for part in parts] == [5, 0, 3]
    np.testing.assert_array_equal(parts[2]["place"], [5, 6, 7])
    np.testing.assert_array_equal(parts[0]["value"], np.linspace(0.0, 1.0, 5))
    kept.begin({"robot": "other"})
    assert (kept.notes, kept.done) == ({"robot": "other"}, 0)


@pytest.mark.parametrize("over", [PLANE, pytest.param(Joints(90), marks=pytest.mark.slow)], ids=["places", "joints"])
def test_a_run_that_was_stopped_is_gone_on_with(rv_m2, plane, tmp_path, in_chunks, over):
    in_chunks(30)
    end = "parquet" if over is PLANE else "zarr"
    pytest.importorskip({"parquet": "pyarrow", "zarr": "zarr"}[end], reason="its extra is not installed")
    path = tmp_path / f"stopped.{end}"

    def stop(_stage, done, _all):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        workspace_map(rv_m2, over, path, ASIDE, progress=stop)
    kind = type(over).__name__.lower()
    assert repr(Map(path)) == f"<Map of 'rv_m2' over {kind}, 2 of 3 chunks>"
    told = []
    again = workspace_map(rv_m2, over, path, ASIDE, progress=lambda *said: told.append(said[1:]))
    assert told == [(2, 3), (3, 3)]
    assert again.complete
    whole = plane if over is PLANE else workspace_map(rv_m2, over, tmp_path / f"whole.{end}", ASIDE)
    assert len(whole.frame())
    np.testing.assert_array_equal(whole.frame().to_numpy(), again.frame().to_numpy())


def test_another_map_is_not_mixed_in(rv_m2, tmp_path):
    path = tmp_path / "map.parquet"
    workspace_map(rv_m2, Joints(40), path)
    with pytest.raises(CampaignError, match="holds another map; found other count, rise"):
        workspace_map(rv_m2, Joints(50), path, Question(rise=9.0))
    anew = workspace_map(rv_m2, Joints(50), path, Question(rise=9.0), replace=True)
    assert len(anew.frame(["place"])) == 50


def test_best_places_are_those_of_all_chunks_whatever_their_size(made, rv_m2, tmp_path, in_chunks):
    every = made.frame()
    wanted = every[(every.z <= 0.6) & (every.margin >= 0.05)].sort_values("required_warm")
    best = made.best("required_warm", within={"z": (None, 0.6), "margin": (0.05, None)}, count=7)
    np.testing.assert_allclose(best.required_warm, wanted.required_warm[:7])
    largest = made.best("capability_warm", largest=True, count=3)
    np.testing.assert_allclose(largest.capability_warm, np.sort(every.capability_warm)[::-1][:3])
    assert made.best(within={"z": (9.0, None)}).empty
    again = Map(made.path)
    assert (again.complete, repr(again)) == (True, "<Map of 'rv_m2' over joints>")
    assert set(every.columns) == set(again.columns)
    in_chunks(4096)
    large = workspace_map(rv_m2, Joints(450), tmp_path / "large.parquet").frame()
    np.testing.assert_allclose(every.to_numpy(), large.to_numpy(), rtol=1e-9, atol=1e-18)


def test_a_place_is_told_once_by_its_best_posture(tmp_path):
    pytest.importorskip("example_robot_data", reason="the extra robots is not installed")
    ur10 = load_robot("example-robot-data:ur10", "tool0")
    found = workspace_map(ur10, Positions((0.4, 0.7, 4), (0.2, 0.2, 1), (0.3, 0.3, 1)), tmp_path / "line.parquet")
    every, best = found.frame(), found.best("required", count=10)
    assert len(every) == 32
    assert best.place.is_unique
    least = every.groupby("place").required.min()
    np.testing.assert_allclose(best.required, np.sort(least))
    places, values = found.values("required")
    np.testing.assert_allclose(values, least)
    np.testing.assert_allclose(places[:, 0], [0.4, 0.5, 0.6, 0.7])


def test_a_plane_is_drawn_as_contours_with_its_best_place(plane, tmp_path):
    figure = plot_map(plane)
    own = figure.axes[0]
    assert (own.get_xlabel(), own.get_ylabel()) == ("x (m)", "y (m)")
    assert "µm" in figure.get_suptitle()
    (star,) = own.lines
    every, (x, y) = plane.frame(), np.array(star.get_data()).ravel()
    value = every.required_warm[np.hypot(every.x - x, every.y - y) < 1e-9].min()
    assert value == pytest.approx(plane.best("required_warm", count=1).required_warm[0])
    figure.savefig(tmp_path / "plane.png")


def test_joint_positions_are_drawn_as_points_in_space(made):
    assert len(plot_map(made, "probability").axes[0].collections[0].get_offsets()) == 450


@pytest.mark.parametrize(("by", "largest"), [("required_warm", False), ("probability", True)])
def test_the_better_value_is_the_brighter_in_a_plane_and_in_space(plane, made, by, largest):
    """One meaning of the colours: brightness, by Rec. 709, falls from the best value to the worst in both."""
    for found in (plane, made):
        drawn = plot_map(found, by).axes[0].collections[0]
        low, high = drawn.get_clim()
        light = drawn.to_rgba(np.array([low, high]))[:, :3] @ [0.2126, 0.7152, 0.0722]
        assert (light[1] > light[0]) == largest


def test_what_is_no_map_no_column_or_no_place_is_refused(rv_m2, made, tmp_path):
    with pytest.raises(CampaignError, match="there is no map"):
        Map(tmp_path / "none.parquet")
    for name in ("map", "map.csv"):
        with pytest.raises(CampaignError, match=r"no kind of map.*expected \.zarr or \.parquet"):
            Map(tmp_path / name)
    asks = (made.best, lambda w: made.frame(["x", w]), lambda w: made.best(within={w: (0, 1)}))
    for ask in (*asks, lambda w: plot_map(made, w)):
        with pytest.raises(CampaignError, match="no such column"):
            ask("requierd")
    with pytest.raises(RobotError, match="nothing to map"):
        workspace_map(rv_m2, Positions((0, 1, 0), (0, 1, 1), (0, 1, 1)), tmp_path / "empty.parquet")
    far = workspace_map(rv_m2, Positions((4, 5, 2), (0, 1, 2), (0, 1, 1)), tmp_path / "far.parquet")
    with pytest.raises(CampaignError, match="reaches no place"):
        plot_map(far)
    with pytest.raises(CampaignError, match="Positions or Joints"):
        workspace_map(rv_m2, 5, tmp_path / "empty.parquet")
