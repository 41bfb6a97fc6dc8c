"""Tables with several targets of one pose, taken and refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaign.files import URDF
from campaign.spoilt import TOML, read, refusal

from thermal_robot.campaign import describe, read_campaign, write_campaign
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import exp3

UNKNOWN = TOML.replace('tool = "known"', 'tool = "unknown"')
PLACES = np.array([[100.0, 0.0, 0.0], [-50.0, 80.0, 0.0], [-50.0, -80.0, 20.0], [0.0, 0.0, 120.0]])  # mm


def table(targets: int = 3, rows: int = 6, noise: float = 0.02) -> pd.DataFrame:
    rng = np.random.default_rng(0)
    turn, shift = exp3(rng.normal(size=(rows, 3))), rng.uniform(-500.0, 500.0, (rows, 3))
    points = shift[:, None] + PLACES[:targets] @ turn.transpose(0, 2, 1) + noise * rng.normal(size=(rows, targets, 3))
    columns = {joint: rng.uniform(-1.0, 1.0, rows) for joint in ("turn", "lift", "roll")}
    columns["slide"] = rng.uniform(0.0, 400.0, rows)
    columns |= {f"{axis}.{k + 1}": points[:, k, a] for k in range(targets) for a, axis in enumerate("xyz")}
    return pd.DataFrame(columns)


def text(frame: pd.DataFrame) -> str:
    return str(frame.to_csv(index=False))


def test_the_place_is_that_of_their_middle_and_the_noise_follows(tmp_path: Path) -> None:
    frame = table()
    campaign = read(tmp_path, table=text(frame), toml=UNKNOWN)
    middle = np.column_stack([frame[[f"{axis}.{k}" for k in (1, 2, 3)]].mean(axis=1) for axis in "xyz"])
    np.testing.assert_allclose(campaign.position, middle / 1e3, rtol=1e-9)
    assert campaign.measures == "pose"
    assert campaign.noise_position == pytest.approx(0.02e-3 / np.sqrt(3.0))
    assert campaign.noise_orientation is not None
    assert 1e-4 < campaign.noise_orientation < 4e-4  # 0.02 mm over some 80 mm
    said = describe(campaign)
    assert "6, 3 targets, which tell a pose, in mm" in said
    assert "0.02 mm per axis (one sigma)" in said
    assert "move against each other by" in said


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    frame = table(4)
    frame.loc[2, ["x.1", "y.1", "z.1"]] = np.nan
    frame["noise"] = [0.02, 0.03, 0.02, 0.05, 0.02, 0.02]
    campaign = read(tmp_path, table=text(frame), toml=UNKNOWN)
    again = read_campaign(write_campaign(campaign, tmp_path / "copy"))
    np.testing.assert_allclose(again.position, campaign.position, rtol=1e-12)
    np.testing.assert_allclose(again.orientation, campaign.orientation, atol=1e-12)
    np.testing.assert_allclose(again.relative_noise, campaign.relative_noise, rtol=1e-9)
    assert again.noise_position == pytest.approx(campaign.noise_position, rel=1e-12)
    shown = campaign.to_frame()
    assert shown["x.1"].isna().tolist() == [False, False, True, False, False, False]
    assert not {"x", "y", "z", "qw"} & set(shown.columns)


def test_a_stated_noise_is_that_of_a_target(tmp_path: Path) -> None:
    campaign = read(tmp_path, table=text(table()), toml=UNKNOWN)
    file = write_campaign(campaign, tmp_path / "copy")
    assert "position = 0.02" in file.read_text()
    assert "orientation" not in file.read_text()


def test_rows_of_too_few_targets_are_left_out(tmp_path: Path) -> None:
    frame = table(4, rows=8)
    for row, lost in ((1, "14"), (4, "123"), (6, "2")):
        frame.loc[row, [f"{axis}.{k}" for axis in "xyz" for k in lost]] = np.nan
    campaign = read(tmp_path, table=text(frame), toml=UNKNOWN)
    assert campaign.rows.tolist() == [2, 4, 5, 7, 8, 9]
    assert "2 rows (3, 6) left out: fewer than 3 targets" in " ".join(campaign.warnings)


def test_targets_that_do_not_keep_their_places_are_told(tmp_path: Path) -> None:
    frame = table(4, rows=12)
    one, other = (frame.columns.get_indexer([f"{axis}.{k}" for axis in "xyz"]) for k in (1, 2))
    frame.iloc[5, [*one, *other]] = frame.iloc[5, [*other, *one]].to_numpy()
    said = " ".join(read(tmp_path, table=text(frame), toml=UNKNOWN).warnings)
    assert "do not keep their places on the tool in 1 row (7)" in said
    said = " ".join(read(tmp_path, table=text(table(4, rows=12, noise=0.2)), toml=UNKNOWN).warnings)
    assert "move against each other by 0.2" in said
    assert "stated noise of 0.02 mm" in said
    # places drawn at random follow no command, which is told of two rows; the targets keep theirs
    sound = read(tmp_path, table=text(table(4, rows=12)), toml=UNKNOWN)
    assert not [told for told in sound.warnings if "target" in told and not told.startswith("rows")]


def test_a_tool_that_is_declared_known_counts_as_unknown(tmp_path: Path) -> None:
    known, plain = (read(tmp_path, table=text(table(4, rows=12)), toml=toml) for toml in (TOML, UNKNOWN))
    assert known.warnings == (
        'where several targets sit on the tool is fitted: tool = "known" counts as "unknown"',
        *plain.warnings,
    )
    assert (known.tool_known, known.settings.tool_known) == (False, False)
    np.testing.assert_array_equal(known.position, plain.position)


def changed(**columns: Any) -> pd.DataFrame:
    return table().assign(**columns)


@pytest.mark.parametrize(
    ("frame", "toml", "column", "words"),
    [
        (table(2), UNKNOWN, "x.1", ["too few targets", "at least 3 as x.1 y.1 z.1, x.2 …; or one, as x y z"]),
        (table().drop(columns="y.2"), UNKNOWN, "y.2", ["stand together or not at all", "only 'x.2', 'z.2'"]),
        (changed(x=1.0, y=2.0, z=3.0), UNKNOWN, "x", ["a target without a number stands beside those with one"]),
        (
            changed(**{"sim.x": 1.0, "sim.y": 2.0, "sim.z": 3.0}),
            UNKNOWN,
            "x.1",
            ["sim.x, sim.y, sim.z predict one target", "found 3 targets"],
        ),
        (changed(**{"y.2": [1.0, 2.0, np.nan, 4.0, 5.0, 6.0]}), UNKNOWN, "y.2", ["row 4", "a value is missing"]),
        (
            changed(**{f"{axis}.3": table()[f"{axis}.1"] for axis in "xyz"}),
            UNKNOWN,
            "x.1",
            ["no row tells a pose", "not on a line"],
        ),
    ],
)
def test_refused(tmp_path: Path, frame: pd.DataFrame, toml: str, column: str, words: list[str]) -> None:
    error = refusal(tmp_path, table=text(frame), toml=toml)
    assert error.column == column
    for word in words:
        assert word in str(error)


def test_a_target_that_is_never_seen_beside_the_others_is_refused(tmp_path: Path) -> None:
    frame = table(4)
    frame.loc[1:, [f"{axis}.4" for axis in "xyz"]] = np.nan
    frame.loc[0, [f"{axis}.{k}" for axis in "xyz" for k in (1, 2)]] = np.nan
    error = refusal(tmp_path, table=text(frame), toml=UNKNOWN)
    assert error.column == "x.4"
    assert "never seen together with three others" in str(error)


def test_a_target_that_is_never_seen_is_none(tmp_path: Path) -> None:
    frame = table().assign(**{f"{axis}.9": np.nan for axis in "xyz"})
    campaign = read(tmp_path, table=text(frame), toml=UNKNOWN)
    assert campaign.targets is not None
    assert campaign.targets.numbers == (1, 2, 3)
    assert "target 9 is seen in no row and counts as absent" in campaign.warnings


def test_measured_quaternions_beside_targets_are_left_out(tmp_path: Path) -> None:
    campaign = read(tmp_path, table=text(changed(qw=1.0, qx=0.0, qy=0.0, qz=0.0)), toml=UNKNOWN)
    assert "'qw', 'qx', 'qy', 'qz' are left out: several targets tell the orientation" in " ".join(campaign.warnings)


def test_a_joint_may_not_have_the_name_of_a_target(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    folder.mkdir()
    (folder / "campaign.toml").write_text(UNKNOWN.replace("lift = 101", ""))
    (folder / "measurements.csv").write_text(text(table().rename(columns={"lift": "x.5"})))
    (folder / "robot.urdf").write_text(URDF.replace('"lift"', '"x.5"'))
    with pytest.raises(CampaignError, match="both a joint of the chain and a column that the format defines"):
        read_campaign(folder)
