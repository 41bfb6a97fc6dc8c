"""Which column is what: groups and joints that lack a column, names with two meanings, columns left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from campaign.files import ROWS as WHOLE
from campaign.files import URDF, add, full, put
from campaign.spoilt import read, renamed, table_is_refused, with_column

from thermal_robot.campaign import campaign_from_table, read_campaign
from thermal_robot.campaign.recognise import recognise
from thermal_robot.campaign.table import read_table
from thermal_robot.errors import CampaignError
from thermal_robot.robot import load_robot

# table, row, column, found, words of the sentence
REFUSED = [
    (
        renamed(lift="elevation"),
        1,
        "lift",
        None,
        ["no such column", "every movable joint of the chain from 'base'"],
    ),
    (
        renamed(lift="lifts"),
        1,
        "lift",
        "the nearest names 'lifts'",
        ["expected 'turn', 'lift', 'slide', 'roll'"],
    ),
    (renamed(y="yy"), 1, "y", "the nearest names 'yy'", ["a measured position needs x, y and z"]),
    (with_column("qw", "1", "1", "1"), 1, "qx", "only 'qw'", ["together or not at all"]),
    (with_column("sim.y", "1", "1", "1"), 1, "sim.x", "only 'sim.y'", ["together or not at all"]),
    (
        with_column("sim.qw,sim.qx,sim.qy,sim.qz", *["1,0,0,0"] * 3),
        1,
        "sim.x",
        None,
        ["needs a simulated position"],
    ),
]


@pytest.mark.parametrize("refused", REFUSED)
def test_refused(tmp_path: Path, refused: tuple[Any, ...]) -> None:
    table_is_refused(tmp_path, *refused)


@pytest.mark.parametrize("name", ["x", "time", "sim.x", "approach.lift"])
def test_a_joint_with_the_name_of_a_column(tmp_path: Path, name: str) -> None:
    robot = load_robot(URDF.replace('joint name="slide"', f'joint name="{name}"'), "tool")
    columns = {*robot.joint_names, "x", "y", "z"}
    with pytest.raises(CampaignError, match="both a joint of the chain and a column") as caught:
        campaign_from_table(robot, pd.DataFrame(dict.fromkeys(columns, [0.0] * 5)))
    assert (caught.value.column, caught.value.row) == (name, None)


DOUBTFUL = [
    (
        with_column("temperature.bean", "20", "20", "21"),
        ["'temperature.bean' is ignored", "did you mean 'beam'"],
    ),
    (with_column("temperature.finger", "20", "20", "21"), ["'temperature.finger'", "no length of the chain"]),
    (with_column("approach.lit", "1", "1", "1"), ["'approach.lit' is ignored", "did you mean 'lift'"]),
    (
        with_column("torque.grip", "1", "1", "1"),
        ["'torque.grip' is ignored", "the chain has no joint 'grip'"],
    ),
    (with_column("grip", "1", "1", "1"), ["'grip' is a joint outside the chain", "extra covariate"]),
    (with_column("temprature", "1", "1", "1"), ["'temprature' is not defined", "did you mean 'temperature'"]),
    (with_column("torque", "1", "1", "1"), ["'torque' names no joint", "did you mean 'torque.<joint>'"]),
    (with_column("operator", "1", "Ann", "1"), ["'operator' is not numeric", "row 3", "'Ann'", "ignored"]),
]


@pytest.mark.parametrize(("table", "words"), DOUBTFUL)
def test_doubtful(tmp_path: Path, table: str, words: list[str]) -> None:
    warnings = read(tmp_path, table=table).warnings
    fitting = [warning for warning in warnings if all(word in warning for word in words)]
    assert len(fitting) == 1, warnings
    assert not any("\n" in warning for warning in warnings)


@pytest.mark.parametrize("name", ["temperature.bean", "approach.lit", "torque.grip", "operator"])
def test_what_is_ignored_is_no_covariate(tmp_path: Path, name: str) -> None:
    campaign = read(tmp_path, table=with_column(name, "1", "1", "Ann" if name == "operator" else "0"))
    assert name not in campaign.covariates
    assert name not in campaign.extra


def test_the_tilt_of_a_link_is_a_covariate_in_rad(tmp_path: Path) -> None:
    campaign = read(tmp_path, table=with_column("tilt.beam.x,tilt.bean.y", "1,1", "2,1", "3,1"))
    scale = campaign.units.angle_scale
    assert campaign.covariates["tilt.beam.x"].tolist() == pytest.approx([scale, 2.0 * scale, 3.0 * scale])
    assert not any(name.startswith("tilt.bean") for name in (*campaign.covariates, *campaign.extra))
    (said,) = (warning for warning in campaign.warnings if "tilt" in warning)
    assert "the robot has no link 'bean'; did you mean 'beam'?" in said


def test_an_empty_column_counts_as_absent(tmp_path: Path) -> None:
    campaign = read_campaign(put(tmp_path / "c", add(WHOLE, temperature="_ _ nan", payload="1 1 1")))
    assert set(campaign.covariates) == {"payload"}
    assert campaign.warnings == ("column 'temperature' is empty and counts as absent",)


# Both load with Pinocchio; neither passes a strict XML parser.
LENIENT = ['<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->"]


@pytest.mark.parametrize("text", LENIENT)
def test_a_urdf_that_is_not_strict_xml_is_recognised(tmp_path: Path, text: str) -> None:
    read(tmp_path, table=with_column("temperature.finger,grip", "20,0", "20,0", "21,0"))
    (tmp_path / "robot.urdf").write_text(URDF.replace("</robot>", f"{text}\n</robot>"))
    campaign = read_campaign(tmp_path)
    assert "temperature.finger" in campaign.covariates
    assert any("'temperature.finger': no length of the chain" in warning for warning in campaign.warnings)
    assert any("'grip' is a joint outside the chain" in warning for warning in campaign.warnings)


def test_every_column_has_one_part(tmp_path: Path) -> None:
    full(tmp_path / "c")
    table = read_table(tmp_path / "c" / "measurements.csv")
    robot = load_robot(URDF, "tool")
    columns = recognise(table, robot, measured=True)
    assert len(columns.groups) == 3
    posed = {*"xyz", "qw", "qx", "qy", "qz", *(f"sim.{axis}" for axis in (*"xyz", "qw", "qx", "qy", "qz"))}
    parts = [*robot.joint_names, *posed, *columns.covariates, *columns.extra, *columns.labels]
    assert sorted(parts) == sorted(table.columns)


def test_samples_ask_for_no_measured_column(tmp_path: Path) -> None:
    full(tmp_path / "c")
    table = read_table(tmp_path / "c" / "measurements.csv")
    assert ("qw", "qx", "qy", "qz") not in recognise(table, load_robot(URDF, "tool"), measured=False).groups


def test_a_column_of_ones_own_is_no_typing_error(tmp_path: Path) -> None:
    table = with_column("pressure,humidity,coolant,shift", "1,1,1,1", "2,2,2,2", "3,3,3,3")
    campaign = read(tmp_path, table=table)
    assert campaign.extra == ("note", "pressure", "humidity", "coolant", "shift")
    assert campaign.warnings == ()


@pytest.mark.parametrize("meant", ["Noise", "nois"])
def test_a_noise_that_is_written_otherwise_is_asked_about(tmp_path: Path, meant: str) -> None:
    campaign = read(tmp_path, table=with_column(meant, "1", "2", "3"))
    assert campaign.noise_of_rows is None
    assert "did you mean 'noise'" in " ".join(campaign.warnings)
