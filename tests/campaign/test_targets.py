"""Several targets of one pose: their places, the pose that they tell, and how sure it is; tables that have them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaign.files import PLAIN_TOML, read, refusal, says

from thermal_robot.campaign import describe, read_campaign, write_campaign
from thermal_robot.campaign.targets import of_a_point, posed, propagated_sigma, relative_sigmas, sigma_of_all
from thermal_robot.kinematics import exp3, log3, quaternion_to_rotation

PLACES = np.array([[0.1, 0.0, 0.0], [-0.05, 0.08, 0.0], [-0.05, -0.08, 0.02], [0.0, 0.0, 0.12], [0.03, 0.1, -0.1]])
NUMBERS = (1, 2, 3, 4, 7)


def seen(rng, rows=40, targets=5, noise=0.0):
    """Points of targets in rows, and how they were moved."""
    turn, shift = exp3(rng.normal(size=(rows, 3))), rng.normal(size=(rows, 3))
    points = shift[:, None] + PLACES[:targets] @ turn.transpose(0, 2, 1)
    return points + noise * rng.normal(size=points.shape), turn, shift


def without(points, rng, share=0.25):
    """The points of which some were not seen, three at least in each row."""
    points = points.copy()
    for row in points:
        lost = rng.permutation(len(row))[: int(rng.integers(0, len(row) - 2))]
        row[lost[rng.uniform(size=len(lost)) < 4 * share]] = np.nan
    return points


@pytest.mark.parametrize("gaps", [False, True], ids=["all", "some"])
def test_exact_points_tell_places_and_poses(gaps):
    """Up to the one motion that nobody knows: of the common frame on the tool."""
    rng = np.random.default_rng(0)
    points, turn, shift = seen(rng)
    if gaps:
        points = without(points, rng)
    found = posed(NUMBERS, points)
    own = quaternion_to_rotation(found.orientation)
    on_tool = turn.transpose(0, 2, 1) @ own
    np.testing.assert_allclose(on_tool, np.broadcast_to(on_tool[0], on_tool.shape), atol=1e-9)
    at = np.einsum("nba,nb->na", turn, found.position - shift)
    np.testing.assert_allclose(at, np.broadcast_to(PLACES.mean(axis=0), at.shape), atol=1e-10)
    np.testing.assert_allclose(PLACES.mean(axis=0) + found.targets.places @ on_tool[0].T, PLACES, atol=1e-10)
    assert found.deviation.max() < 1e-10


def test_the_common_frame_has_the_principal_axes_and_is_right_handed():
    found = posed(NUMBERS, seen(np.random.default_rng(1))[0])
    places = found.targets.places
    np.testing.assert_allclose(places.mean(axis=0), 0.0, atol=1e-12)
    moments = places.T @ places
    np.testing.assert_allclose(moments - np.diag(np.diag(moments)), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(quaternion_to_rotation(found.orientation)), 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("targets", "missing"), [(3, ()), (5, ()), (5, (0, 3))], ids=["three", "five", "three of five"]
)
def test_a_pose_is_off_by_what_is_said_of_it(targets, missing):
    """Each figure, the turn about the frame's own axes."""
    rng, noise, rows = np.random.default_rng(2), 1e-5, 4000
    points, turn, shift = seen(rng, rows, targets, noise)
    points[rows // 2 :, list(missing)] = np.nan
    found = posed(NUMBERS[:targets], points)
    exact = posed(NUMBERS[:targets], shift[:, None] + PLACES[:targets] @ turn.transpose(0, 2, 1))
    turns = [quaternion_to_rotation(each.orientation) for each in (exact, found)]
    # the axes of nearly the same places may be reversed, which is a turn on the tool in common
    common = turns[1][0].T @ turns[0][0]
    common = np.sign(np.round(common))
    off = np.hstack([found.position - exact.position, log3((turns[0] @ common.T).transpose(0, 2, 1) @ turns[1])])
    half = np.s_[rows // 2 :]
    off = off[half] - off.mean(axis=0)
    said = noise * found.targets.spread[half]
    np.testing.assert_allclose(np.sqrt((off[:, :3] ** 2).mean()), said[0, 0], rtol=0.03)
    np.testing.assert_allclose(np.sqrt((off[:, 3:] ** 2).mean(axis=0)), said[0, 3:], rtol=0.06)
    assert found.targets.sigma == pytest.approx(noise, rel=0.05)


def test_the_common_frame_does_not_depend_on_the_order_of_the_rows():
    rng = np.random.default_rng(8)
    points = without(seen(rng, noise=1e-5)[0], rng)
    order = rng.permutation(len(points))
    one, other = posed(NUMBERS, points), posed(NUMBERS, points[order])
    np.testing.assert_allclose(other.targets.places, one.targets.places, atol=1e-10)
    turns = [quaternion_to_rotation(each.orientation) for each in (one, other)]
    np.testing.assert_allclose(turns[1], turns[0][order], atol=1e-9)


def test_a_target_that_is_wrong_in_a_few_rows_keeps_its_place():
    rng = np.random.default_rng(3)
    points, _, _ = seen(rng, 60, 5, 1e-5)
    sound = posed(NUMBERS, points)
    points[:6, 2] += 0.05
    found = posed(NUMBERS, points)
    apart = [np.linalg.norm(each.targets.places[:, None] - each.targets.places, axis=2) for each in (sound, found)]
    np.testing.assert_allclose(apart[1], apart[0], atol=5e-5)
    assert np.flatnonzero(found.deviation > 1e-3).tolist() == [0, 1, 2, 3, 4, 5]


def test_targets_are_placed_one_beside_the_others_where_they_meet():
    """Of three in some rows and three others in the rest one is in common; then no row shows all five."""
    points = seen(np.random.default_rng(4), 10)[0]
    points[:5, 3:] = np.nan
    points[5:, :2] = np.nan
    assert posed(NUMBERS, points) is None
    points = seen(np.random.default_rng(5), 30)[0]
    points[:5, :2] = points[5:15, 4] = points[15:, 0] = np.nan
    found = posed(NUMBERS, points)
    apart = np.linalg.norm(found.targets.places[:, None] - found.targets.places, axis=2)
    np.testing.assert_allclose(apart, np.linalg.norm(PLACES[:, None] - PLACES, axis=2), atol=1e-9)


def test_rows_are_taken_with_what_is_typical_of_all():
    found = posed(NUMBERS, without(seen(np.random.default_rng(6))[0], np.random.default_rng(7))).targets
    part = found.take(np.array([3, 1]))
    np.testing.assert_array_equal(part.points, found.points[[3, 1]])
    np.testing.assert_array_equal(part.typical, found.typical)
    np.testing.assert_allclose(
        found.typical, [np.sqrt((found.spread[:, :3] ** 2).mean()), np.sqrt((found.spread[:, 3:] ** 2).mean())]
    )


SIGMAS = np.array([1e-5, 5e-5, 7e-5])


@pytest.mark.parametrize("sigmas", [None, SIGMAS], ids=["one", "each"])
def test_several_targets_tell_the_noise_of_every_figure(sigmas):
    """That of a point times what the pose makes of it, whatever stands for all rows."""
    points = seen(np.random.default_rng(9), 3, 4)[0]
    points[1, 3] = np.nan
    targets = posed((1, 2, 3, 4), points).targets
    place, turn = propagated_sigma(4e-5, targets) if sigmas is None else sigma_of_all(sigmas, targets)
    found = relative_sigmas(sigmas, place, targets, True) * np.repeat([place, turn], 3)
    np.testing.assert_allclose(found, targets.spread * np.reshape(4e-5 if sigmas is None else sigmas, (-1, 1)))
    assert of_a_point(propagated_sigma(4e-5, targets)[0], targets) == pytest.approx(4e-5)
    # nobody states it: how the figures compare is known all the same
    typical = np.repeat(targets.typical, 3)
    np.testing.assert_allclose(relative_sigmas(None, None, targets, True), targets.spread / typical)


UNKNOWN = PLAIN_TOML.replace('tool = "known"', 'tool = "unknown"')
ON_TOOL = np.array([[100.0, 0.0, 0.0], [-50.0, 80.0, 0.0], [-50.0, -80.0, 20.0], [0.0, 0.0, 120.0]])  # mm


def table(targets: int = 3, rows: int = 6, noise: float = 0.02, **more: Any) -> pd.DataFrame:
    rng = np.random.default_rng(0)
    turn, shift = exp3(rng.normal(size=(rows, 3))), rng.uniform(-500.0, 500.0, (rows, 3))
    points = shift[:, None] + ON_TOOL[:targets] @ turn.transpose(0, 2, 1) + noise * rng.normal(size=(rows, targets, 3))
    columns = {joint: rng.uniform(-1.0, 1.0, rows) for joint in ("turn", "lift", "roll")}
    columns["slide"] = rng.uniform(0.0, 400.0, rows)
    columns |= {f"{axis}.{k + 1}": points[:, k, a] for k in range(targets) for a, axis in enumerate("xyz")}
    return pd.DataFrame(columns).assign(**more)


def of(*targets: int) -> list[str]:
    return [f"{axis}.{k}" for axis in "xyz" for k in targets]


def taken(folder: Path, frame: pd.DataFrame, toml: str = UNKNOWN) -> Any:
    return read(folder, table=str(frame.to_csv(index=False)), toml=toml)


def test_the_place_is_that_of_their_middle_and_the_noise_follows(tmp_path):
    frame = table()
    campaign = taken(tmp_path, frame)
    middle = np.column_stack([frame[[f"{axis}.{k}" for k in (1, 2, 3)]].mean(axis=1) for axis in "xyz"])
    np.testing.assert_allclose(campaign.position, middle / 1e3, rtol=1e-9)
    assert campaign.measures == "pose"
    assert campaign.noise_position == pytest.approx(0.02e-3 / np.sqrt(3.0))
    assert 1e-4 < campaign.noise_orientation < 4e-4  # 0.02 mm over some 80 mm
    for said in (
        "6, 3 targets, which tell a pose, in mm",
        "0.02 mm per axis (one sigma)",
        "move against each other by",
    ):
        assert said in describe(campaign)
    text = write_campaign(campaign, tmp_path / "copy").read_text()
    assert "position = 0.02" in text  # a stated noise is that of a target
    assert "orientation" not in text


def test_what_is_written_is_read_again(tmp_path):
    frame = table(4, noise=0.02).assign(noise=[0.02, 0.03, 0.02, 0.05, 0.02, 0.02])
    frame.loc[2, of(1)] = np.nan
    campaign = taken(tmp_path, frame)
    again = read_campaign(write_campaign(campaign, tmp_path / "copy"))
    np.testing.assert_allclose(again.position, campaign.position, rtol=1e-12)
    np.testing.assert_allclose(again.orientation, campaign.orientation, atol=1e-12)
    np.testing.assert_allclose(again.relative_noise, campaign.relative_noise, rtol=1e-9)
    assert again.noise_position == pytest.approx(campaign.noise_position, rel=1e-12)
    shown = campaign.to_frame()
    assert shown["x.1"].isna().tolist() == [False, False, True, False, False, False]
    assert not {"x", "y", "z", "qw"} & set(shown.columns)


def test_rows_of_too_few_targets_are_left_out(tmp_path):
    frame = table(4, rows=8)
    for row, lost in ((1, (1, 4)), (4, (1, 2, 3)), (6, (2,))):
        frame.loc[row, of(*lost)] = np.nan
    campaign = taken(tmp_path, frame)
    assert campaign.rows.tolist() == [2, 4, 5, 7, 8, 9]
    assert "2 rows (3, 6) left out: fewer than 3 targets" in " ".join(campaign.warnings)


def test_targets_that_do_not_keep_their_places_are_told(tmp_path):
    frame = table(4, rows=12)
    frame.loc[5, [*of(1), *of(2)]] = frame.loc[5, [*of(2), *of(1)]].to_numpy()
    said = " ".join(taken(tmp_path, frame).warnings)
    assert "do not keep their places on the tool in 1 row (7)" in said
    said = " ".join(taken(tmp_path, table(4, rows=12, noise=0.2)).warnings)
    assert says(said, "move against each other by 0.2 … stated noise of 0.02 mm")
    # places drawn at random follow no command, which is told of two rows; the targets keep theirs
    sound = taken(tmp_path, table(4, rows=12))
    assert not [told for told in sound.warnings if "target" in told and not told.startswith("rows")]
    # a tool that is declared known counts as unknown
    known = taken(tmp_path, table(4, rows=12), PLAIN_TOML)
    fitted = 'where several targets sit on the tool is fitted: tool = "known" counts as "unknown"'
    assert known.warnings == (fitted, *sound.warnings)
    assert (known.tool_known, known.settings.tool_known) == (False, False)
    np.testing.assert_array_equal(known.position, sound.position)


def seldom() -> pd.DataFrame:
    frame = table(4)
    frame.loc[1:, of(4)] = np.nan
    frame.loc[0, of(1, 2)] = np.nan
    return frame


SIMULATED = {"sim.x": 1.0, "sim.y": 2.0, "sim.z": 3.0}


@pytest.mark.parametrize(
    ("frame", "column", "said"),
    [
        (table(2), "x.1", "too few targets … at least 3 as x.1 y.1 z.1, x.2 …; or one, as x y z"),
        (table().drop(columns="y.2"), "y.2", "stand together or not at all … only 'x.2', 'z.2'"),
        (table(x=1.0, y=2.0, z=3.0), "x", "a target without a number stands beside those with one"),
        (table(**SIMULATED), "x.1", "sim.x, sim.y, sim.z predict one target … found 3 targets"),
        (table(**{"y.2": [1.0, 2.0, np.nan, 4.0, 5.0, 6.0]}), "y.2", "row 4 … a value is missing"),
        (table(**{f"{a}.3": table()[f"{a}.1"] for a in "xyz"}), "x.1", "no row tells a pose … not on a line"),
        (seldom(), "x.4", "never seen together with three others"),
    ],
)
def test_what_tells_no_pose_is_refused(tmp_path, frame, column, said):
    error = refusal(tmp_path, table=str(frame.to_csv(index=False)), toml=UNKNOWN)
    assert error.column == column
    assert says(error, said)


def test_a_target_that_is_never_seen_and_quaternions_beside_targets_are_left_out(tmp_path):
    beside = dict.fromkeys(of(9), np.nan) | {"qw": 1.0, "qx": 0.0, "qy": 0.0, "qz": 0.0}
    campaign = taken(tmp_path, table(**beside))
    assert campaign.targets.numbers == (1, 2, 3)
    assert "target 9 is seen in no row and counts as absent" in campaign.warnings
    assert "'qw', 'qx', 'qy', 'qz' are left out: several targets tell the orientation" in " ".join(campaign.warnings)
