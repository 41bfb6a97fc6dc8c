"""Values that cannot be, orientations that are none, and too few rows for what is unknown."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaign.files import ROWS as WHOLE
from campaign.files import add, put
from campaign.spoilt import TOML, read, refusal, table_is_refused, with_column

from thermal_robot.campaign import describe, read_campaign

# table, row, column, found, words of the sentence
REFUSED = [
    (
        with_column("qw,qx,qy,qz", "1,0,0,0", "0,0,0,0", "1,0,0,0"),
        3,
        "qw",
        "(0, 0, 0, 0) of length 0",
        ["the quaternion's length is not 1"],
    ),
    (
        with_column("qw,qx,qy,qz", "1,0,0,0", "1,0,0,0", "0,0,1.2,0"),
        4,
        "qw",
        "(0, 0, 1.2, 0) of length 1.2",
        ["qw, qx, qy, qz of length 1"],
    ),
    (with_column("approach.lift", "1", "0", "0.5"), 4, "approach.lift", "0.5", ["impossible", "-1, 0 or 1"]),
    (with_column("payload", "0", "-2", "3"), 3, "payload", "-2", ["impossible value", "not negative"]),
    (with_column("temperature", "20", "20", "-300"), 4, "temperature", "-300", ["impossible value", "°C"]),
    (with_column("noise", "0.02", "0", "0.02"), 3, "noise", "0", ["no standard deviation", "one sigma above 0"]),
    (with_column("noise", "0.02", "0.02", "-1"), 4, "noise", "-1", ["no standard deviation", "one sigma above 0"]),
    (with_column("noise", "0.02", "inf", "1"), 3, "noise", "'inf'", ["not a finite number"]),
    (with_column("noise", "0.02", "good", "1"), 3, "noise", "'good'", ["text where a number should be"]),
]


@pytest.mark.parametrize("refused", REFUSED)
def test_refused(tmp_path: Path, refused: tuple[Any, ...]) -> None:
    table_is_refused(tmp_path, *refused)


def test_quaternions_are_normalised(tmp_path: Path) -> None:
    table = add(WHOLE, qw="1.05 0 0", qx="0 0.95 0", qy="0 0 -1", qz="0 0 0")
    campaign = read_campaign(put(tmp_path / "c", table))
    np.testing.assert_allclose(np.linalg.norm(campaign.orientation, axis=1), 1, rtol=1e-15)


def distinct(count: int, repeats: int = 1, *, pose: bool = False) -> str:
    """A table of so many configurations, each measured so often."""
    header = "turn,lift,slide,roll,x,y,z" + (",qw,qx,qy,qz" if pose else "")
    end = ",1,0,0,0" if pose else ""
    lines = [f"0.{i},0.1,30,0.4,{1000 + i},{i},500{end}" for i in range(count) for _ in range(repeats)]
    return "\n".join([header, *lines]) + "\n"


@pytest.mark.parametrize(
    ("base", "tool", "pose", "needed"),
    [
        ("unknown", "unknown", False, 3),
        ("unknown", "known", False, 3),
        ("unknown", "unknown", True, 3),
        ("known", "unknown", False, 1),
        ("known", "known", False, 1),
    ],
)
def test_too_few_rows(tmp_path: Path, base: str, tool: str, pose: bool, needed: int) -> None:
    toml = TOML.replace('base = "unknown"', f'base = "{base}"').replace('tool = "known"', f'tool = "{tool}"')
    assert read(tmp_path, table=distinct(needed, pose=pose), toml=toml).samples == needed
    if needed > 1:
        error = refusal(tmp_path, table=distinct(needed - 1, pose=pose), toml=toml)
        assert error.file == str(tmp_path / "measurements.csv")
        assert error.found == "2 rows with 2 different joint configurations"
        assert error.expected == "at least 3 different configurations"
        assert "too few measurements to find the unknown base" in str(error)
        # repeats tell repeatability, which needs no frames
        repeated = read(tmp_path, table=distinct(needed - 1, 4, pose=pose), toml=toml)
        (said,) = (w for w in repeated.warnings if "too few" in w)
        assert said.endswith("expected at least 3 different configurations; they tell repeatability alone")


@pytest.mark.parametrize(
    ("column", "cells"),
    [
        ("approach.lift", ("-1", "0", "1")),
        ("payload", ("0", "0", "3")),
        ("temperature", ("-273.15", "0", "30")),
        ("temperature.beam", ("-5", "", "30")),
    ],
)
def test_values_at_the_border_are_possible(tmp_path: Path, column: str, cells: tuple[str, str, str]) -> None:
    assert column in read(tmp_path, table=with_column(column, *cells)).covariates


def test_orientations_keep_their_direction(tmp_path: Path) -> None:
    written = np.array([[0.95, 0.0, 0.0, 0.0], [0.5, 0.5, -0.5, 0.5], [0.0, 0.6, 0.8, 0.0]])
    table = with_column("qw,qx,qy,qz", *(",".join(map(str, row)) for row in written))
    found = read(tmp_path, table=table).orientation
    np.testing.assert_allclose(np.sum(found * written, axis=1), np.linalg.norm(written, axis=1), rtol=1e-14)


def test_gaps_and_their_warnings_stand_together(tmp_path: Path) -> None:
    campaign = read(tmp_path, table=with_column("temperature,payload", "20,1", ",1", "22,1"))
    assert list(campaign.missing) == ["temperature"]
    assert campaign.missing["temperature"].tolist() == [False, True, False]
    assert campaign.warnings == ("column 'temperature' is empty in 1 of 3 rows: interpolated in time",)


def test_warnings_come_in_the_order_of_the_work(tmp_path: Path) -> None:
    table = with_column("temprature,payload", "1,1", "1,", "1,1").replace("0.5,-0.4", "0.5,-2.1").encode("utf-8")
    warnings = read(tmp_path, table=table).warnings
    assert [word for warning in warnings for word in ("temprature", "payload", "limits") if word in warning] == [
        "temprature",
        "payload",
        "limits",
    ]


def test_rows_that_differ_by_rounding_are_one_configuration(tmp_path: Path) -> None:
    rows = ["0.1,0.1,30,0.4,1000,0,500", "0.1000000000001,0.1,30,0.4,1000,0,500", "0.2,0.1,30,0.4,1000,0,500"]
    found = read(tmp_path, table="\n".join(["turn,lift,slide,roll,x,y,z", *rows]) + "\n")
    assert any("3 rows with 2 different joint configurations" in said for said in found.warnings)


def test_approach_follows_from_the_order_where_it_was_not_recorded(tmp_path: Path) -> None:
    ordered = add(WHOLE, order="1 2 3")
    told = read_campaign(put(tmp_path / "direct", ordered))
    assert told.derived == tuple(f"approach.{joint}" for joint in told.robot.joint_names)
    assert told.covariates["approach.lift"].tolist() == [0.0, -1.0, -1.0]
    assert told.covariates["approach.slide"].tolist() == [0.0, 1.0, 1.0]
    # what comes after is known of the whole campaign, not of the rows that are left
    assert told.take([0, 2]).covariates["approach.lift"].tolist() == [0.0, -1.0]
    assert "from the order of rows" in describe(told)


def test_recorded_or_unknown_moves_are_not_guessed(tmp_path: Path) -> None:
    ordered = add(WHOLE, order="1 2 3")
    recorded = read_campaign(put(tmp_path / "recorded", add(ordered, approach__lift="1 1 1")))
    assert recorded.derived == ()
    assert "approach.slide" not in recorded.covariates
    assert read_campaign(put(tmp_path / "no order")).derived == ()
    folder = put(tmp_path / "unknown", ordered)
    text = (folder / "campaign.toml").read_text().replace("[robot]", '[robot]\nmoves = "unknown"')
    (folder / "campaign.toml").write_text(text)
    unknown = read_campaign(folder)
    assert unknown.derived == ()
    assert not any(name.startswith("approach.") for name in unknown.covariates)
    assert unknown.settings.moves == "unknown"


def test_the_noise_of_each_row_takes_the_place_of_that_of_all(tmp_path: Path) -> None:
    campaign = read(tmp_path, table=with_column("noise", "0.03", "0.04", "0.05"))
    each = campaign.noise_of_rows
    assert each is not None
    np.testing.assert_allclose(each, [3e-5, 4e-5, 5e-5], rtol=1e-12)
    assert campaign.noise_position == pytest.approx(np.sqrt(50.0 / 3.0) * 1e-5)
    assert "noise" not in campaign.covariates


def test_a_row_without_a_noise_of_its_own_has_that_of_all_or_is_refused(tmp_path: Path) -> None:
    table, stated = with_column("noise", "0.03", "", "0.05"), "position = 0.02"
    assert stated in TOML
    each = read(tmp_path, table=table).noise_of_rows
    assert each is not None
    np.testing.assert_allclose(each, [3e-5, 2e-5, 5e-5], rtol=1e-12)
    error = refusal(tmp_path, table=table, toml=TOML.replace(stated, ""))
    assert (error.row, error.column, error.found) == (3, "noise", "an empty cell")
    assert "[noise] position for the rows without one" in str(error)


def test_an_empty_column_of_noise_is_none(tmp_path: Path) -> None:
    campaign = read(tmp_path, table=with_column("noise", "", "", ""))
    assert campaign.noise_of_rows is None
    assert campaign.noise_position == pytest.approx(2e-5)
    assert "column 'noise' is empty and counts as absent" in " ".join(campaign.warnings)
