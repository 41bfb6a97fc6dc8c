"""Which column is what: names of other programs and units in headers, groups and joints that lack a column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from campaign.files import FULL, ROWS, URDF, add, put, read, refusal, renamed, says, with_column

from thermal_robot.campaign import Units, campaign_from_table, read_campaign, with_commands
from thermal_robot.campaign.recognise import bare, headings, joint_columns, recognise
from thermal_robot.campaign.table import read_table
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot

CHAIN = "no such column … every movable joint of the chain from 'base'"
TOGETHER = "together or not at all"
# table, column, found, what is said
REFUSED = [
    (renamed(lift="elevation"), "lift", None, CHAIN),
    (renamed(lift="lifts"), "lift", "the nearest names 'lifts'", "expected 'turn', 'lift', 'slide', 'roll'"),
    (renamed(y="yy"), "y", "the nearest names 'yy'", "a measured position needs x, y and z"),
    (with_column("qw", "1", "1", "1"), "qx", "only 'qw'", TOGETHER),
    (with_column("sim.y", "1", "1", "1"), "sim.x", "only 'sim.y'", TOGETHER),
    (with_column("sim.qw,sim.qx,sim.qy,sim.qz", *["1,0,0,0"] * 3), "sim.x", None, "needs a simulated position"),
]


@pytest.mark.parametrize(("table", "column", "found", "said"), REFUSED)
def test_a_column_that_lacks_is_refused(tmp_path, table, column, found, said):
    error = refusal(tmp_path, table=table)
    assert (error.row, error.column) == (1, column)
    assert found in (None, error.found)
    assert says(error, said)


@pytest.mark.parametrize("name", ["x", "time", "sim.x", "approach.lift", "x.5"])
def test_a_joint_with_the_name_of_a_column(name: str) -> None:
    robot = load_robot(URDF.replace('joint name="slide"', f'joint name="{name}"'), "tool")
    columns = {*robot.joint_names, "x", "y", "z"}
    with pytest.raises(CampaignError, match="both a joint of the chain and a column") as caught:
        campaign_from_table(robot, pd.DataFrame(dict.fromkeys(columns, [0.0] * 5)))
    assert (caught.value.column, caught.value.row) == (name, None)


# column, its cells, what is said, and whether it is a covariate of the format or an extra one
DOUBTFUL = [
    ("temperature.bean", "20 20 21", "'temperature.bean' is ignored … did you mean 'beam'", (False, False)),
    ("temperature.finger", "20 20 21", "'temperature.finger' … no length of the chain", (True, False)),
    ("tilt.bean.y", "1 1 1", "the robot has no link 'bean'; did you mean 'beam'?", (False, False)),
    ("approach.lit", "1 1 1", "'approach.lit' is ignored … did you mean 'lift'", (False, False)),
    ("grip", "1 1 1", "'grip' is a joint outside the chain … extra covariate", (True, True)),
    ("temprature", "1 1 1", "'temprature' is not defined … did you mean 'temperature'", (True, True)),
    ("torque", "1 1 1", "'torque' names no joint … did you mean 'torque.<joint>'", (True, True)),
    ("operator", "1 Ann 1", "'operator' is not numeric … row 3 … 'Ann' … ignored", (False, False)),
    ("Noise", "1 2 3", "did you mean 'noise'", (True, True)),
]


@pytest.mark.parametrize(("column", "cells", "said", "taken"), DOUBTFUL)
def test_a_doubtful_column_is_told_and_ignored_or_kept(tmp_path, column, cells, said, taken):
    campaign = read(tmp_path, table=with_column(column, *cells.split()))
    assert len([warning for warning in campaign.warnings if says(warning, said)]) == 1
    assert not any("\n" in warning for warning in campaign.warnings)
    assert (column in campaign.covariates, column in campaign.extra) == taken
    assert campaign.noise_of_rows is None


def test_an_empty_column_counts_as_absent(tmp_path: Path) -> None:
    campaign = read_campaign(put(tmp_path / "c", add(ROWS, temperature="_ _ nan", payload="1 1 1", session="a _ b")))
    assert set(campaign.covariates) == {"payload"}
    assert campaign.warnings == ("column 'temperature' is empty and counts as absent",)
    assert campaign.labels["session"].tolist() == ["a", "", "b"]


# Both load with Pinocchio; neither passes a strict XML parser.
@pytest.mark.parametrize("text", ['<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->"])
def test_a_urdf_that_is_not_strict_xml_is_recognised(tmp_path: Path, text: str) -> None:
    read(tmp_path, table=with_column("temperature.finger,grip", "20,0", "20,0", "21,0"))
    (tmp_path / "robot.urdf").write_text(URDF.replace("</robot>", f"{text}\n</robot>"))
    campaign = read_campaign(tmp_path)
    assert "temperature.finger" in campaign.covariates
    for said in ("'temperature.finger': no length of the chain", "'grip' is a joint outside the chain"):
        assert any(said in warning for warning in campaign.warnings)


def test_every_column_has_one_part(tmp_path: Path) -> None:
    table = read_table(put(tmp_path / "c", FULL) / "measurements.csv")
    robot = load_robot(URDF, "tool")
    columns = recognise(table, robot, measured=True)
    posed = [name for group in columns.groups for name in group]
    parts = [*robot.joint_names, *posed, *columns.covariates, *columns.extra, *columns.labels]
    assert sorted(parts) == sorted(table.columns)
    assert ("qw", "qx", "qy", "qz") in columns.groups
    assert ("qw", "qx", "qy", "qz") not in recognise(table, robot, measured=False).groups


def test_a_column_of_ones_own_is_no_typing_error(tmp_path: Path) -> None:
    table = with_column("pressure,humidity,coolant,shift", "1,1,1,1", "2,2,2,2", "3,3,3,3")
    campaign = read(tmp_path, table=table)
    assert campaign.extra == ("note", "pressure", "humidity", "coolant", "shift")
    assert campaign.warnings == ()


ARMS = {
    5: ("builtin:rv_m2", "tool0"),
    6: ("example-robot-data:ur5", "tool0"),
    7: ("example-robot-data:panda", "panda_link8"),
}
"""Robots by their number of joints."""


def arm(n: int = 6) -> Robot:
    if n > 5:
        pytest.importorskip("example_robot_data")
    return load_robot(*ARMS[n])


@pytest.mark.parametrize(
    ("column", "name", "unit"),
    [
        ("X [mm]", "X", "mm"),
        ("X (mm)", "X", "mm"),
        ("x_mm", "x", "mm"),
        ("x_m", "x_m", None),
        ("A1 [°]", "A1", "deg"),
        ("A1[Degrees]", "A1", "deg"),
        ("velocity.a (rad/s)", "velocity.a", "rad/s"),
        ("acceleration.a [deg/s^2]", "acceleration.a", "deg/s²"),
        ("temperature [°C]", "temperature", "°C"),
        ("torque.a [Nm]", "torque.a", "N·m"),
        ("z [µm]", "z", "um"),
        ("actual_q[0]", "actual_q[0]", None),
        ("X [measured]", "X [measured]", None),
    ],
)
def test_a_header_and_its_unit(column: str, name: str, unit: str | None) -> None:
    assert (bare(column).column, bare(column).unit) == (name, unit)


SPELLED = ["A{1} [deg]", "J{1}", "Joint {1} (rad)", "axis_{1}/position", "actual_q_{0}", "actual_q{0}", "q[{0}]"]


@pytest.mark.parametrize("n", ARMS)
@pytest.mark.parametrize("spelled", [*SPELLED, "theta{1}_deg", "target_q_{0}"])
def test_numbered_columns_are_the_joints_in_order(n: int, spelled: str) -> None:
    robot = arm(n)
    columns = [spelled.format(k, k + 1) for k in range(n)]
    known = headings([*columns, "other"], robot)
    assert [known[joint].column for joint in robot.joint_names] == columns
    assert not headings(columns[:-1], robot), "one joint is lacking: nobody knows which"
    taken = headings([*columns, *robot.joint_names], robot)
    assert not set(taken) & set(robot.joint_names), "a joint's own name counts first"


def test_joints_by_name_and_commands_before_what_encoders_said() -> None:
    known = headings([f"{what}_q_{k}" for what in ("actual", "target") for k in range(6)], arm())
    assert (known["elbow_joint"].column, known["encoder.elbow_joint"].column) == ("target_q_2", "actual_q_2")
    columns = ["a/velocity", "a/position", "/states/b/position", "c", "/c/position"]
    assert joint_columns(columns, "abcd") == {"a": "a/position", "b": "/states/b/position", "c": "c"}
    assert joint_columns(["/one/a/position", "/two/a/position"], "a") == {}, "either may be meant"


@pytest.mark.parametrize("n", ARMS)
@pytest.mark.parametrize(("angle", "length"), [("rad", "m"), ("deg", "um")])
def test_a_unit_in_the_header_counts_whatever_is_declared(n: int, angle: str, length: str) -> None:
    robot, rng = arm(n), np.random.default_rng(5)
    q = rng.uniform(-1, 1, (8, n))
    table = pd.DataFrame(q, columns=list(robot.joint_names))
    table[["x", "y", "z"]] = robot.forward(q)[:, :3, 3]
    table["temperature"] = rng.uniform(20, 25, 8)
    header = [*(f"A{k + 1} [deg]" for k in range(n)), "X [mm]", "Y (mm)", "z_mm", "Temperature [°C]"]
    spelled = (table * np.array([180 / np.pi] * n + [1e3] * 3 + [1.0])).set_axis(header, axis=1)
    plain = campaign_from_table(robot, table)
    campaign = campaign_from_table(robot, spelled, angle_unit=angle, length_unit=length)
    np.testing.assert_allclose(campaign.q, plain.q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(campaign.position, plain.position, rtol=0, atol=1e-12)
    np.testing.assert_allclose(campaign.covariates["temperature"], plain.covariates["temperature"])
    told = [warning for warning in campaign.warnings if "as headers say" in warning]
    assert [warning.count("read in mm") for warning in told if "'X [mm]', 'Y (mm)', 'z_mm'" in warning] == [1]
    assert len([warning for warning in told if "read in deg" in warning]) == (angle == "rad")


def test_columns_of_the_users_own_stay() -> None:
    robot = arm()
    extra = ["Speed [mm/s]", "temperature_min", "RH [%]", "X [deg]", "Noise"]
    assert headings([*robot.joint_names, "x", "y", "z", *extra], robot) == {}
    assert headings(["X [mm]", "X (m)"], robot) == {}, "either may be meant"


def test_corrected_commands_stand_under_their_header_and_in_its_unit() -> None:
    samples = pd.DataFrame([[10.0] * 6 + [1.0]], columns=[*(f"A{k} [deg]" for k in range(1, 7)), "X [mm]"])
    given = with_commands(samples, arm(), [[0.1] * 6], [[0.0] * 3], [[]], [0.0], Units("rad", "m"))
    np.testing.assert_allclose(given[samples.columns[:6]].to_numpy(), np.rad2deg(0.1))
    assert "X [mm]" not in given  # what was measured belongs to the old commands
