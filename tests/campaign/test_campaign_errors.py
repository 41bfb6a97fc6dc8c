"""Every kind of bad input: where it is, what was found, what was expected; and what is only warned of."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from thermal_robot.campaign import Campaign, campaign_from_table, read_campaign
from thermal_robot.errors import CampaignError, RobotError
from thermal_robot.robot import load_robot

URDF = """<robot name="arm">
  <link name="base"/><link name="column"/><link name="beam"/><link name="carriage"/><link name="hand"/>
  <link name="tool"/><link name="finger"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="column"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="lift" type="revolute"><parent link="column"/><child link="beam"/><origin xyz="0.1 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="beam"/><child link="carriage"/><origin xyz="0.5 0 0"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.5" effort="1" velocity="1"/></joint>
  <joint name="roll" type="continuous"><parent link="carriage"/><child link="hand"/><origin xyz="0.3 0 0"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="mount" type="fixed"><parent link="hand"/><child link="tool"/><origin xyz="0.1 0 0"/></joint>
  <joint name="grip" type="revolute"><parent link="hand"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>"""

TOML = """[robot]
urdf = "robot.urdf"
tool_frame = "tool"

[measurements]
file = "measurements.csv"
angle_unit = "rad"
length_unit = "mm"

[frames]
base = "unknown"
tool = "known"
target = [0.0, 0.0, 80.0]

[noise]
position = 0.02

[priors]
joint_offset = 1e-3

[gears]
lift = 101
"""

ROWS = """turn,lift,slide,roll,x,y,z,time,note
0.1,0.2,30,0.4,1000,0,500,1,7
-0.1,0.3,60,3.5,900,100,510,2,8
0.5,-0.4,90,-0.4,800,200,520,3,9
"""


def read(folder: Path, *, table: str | bytes = ROWS, toml: str = TOML) -> Campaign:
    (folder / "robot.urdf").write_text(URDF)
    (folder / "campaign.toml").write_text(toml)
    (folder / "measurements.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    return read_campaign(folder)


def refusal(folder: Path, *, table: str | bytes = ROWS, toml: str = TOML) -> CampaignError:
    with pytest.raises(CampaignError) as caught:
        read(folder, table=table, toml=toml)
    error = caught.value
    assert "\n" not in str(error)
    return error


def renamed(**names: str) -> str:
    """The table with other column names."""
    header, rest = ROWS.split("\n", 1)
    return ",".join(names.get(name, name) for name in header.split(",")) + "\n" + rest


def with_column(name: str, *cells: str) -> str:
    """The table with one more column."""
    return "\n".join(f"{line},{cell}" for line, cell in zip(ROWS.split(), (name, *cells), strict=True)) + "\n"


def test_the_example_is_good(tmp_path: Path) -> None:
    assert read(tmp_path).warnings == ()


TOML_CASES = [
    # what is replaced, by what, row, column, found, words of the sentence
    ("[gears]", "[gears", 21, None, None, ["not valid TOML"]),
    ('[robot]\nurdf = "robot.urdf"\ntool_frame = "tool"\n', "", None, "robot.urdf", None, ["under [robot]"]),
    ('urdf = "robot.urdf"\n', "", 1, "robot.urdf", None, ["is missing", "path of the robot's URDF file"]),
    (
        'tool_frame = "tool"\n',
        "",
        1,
        "robot.tool_frame",
        None,
        ["is missing", "link that carries the target"],
    ),
    ('file = "measurements.csv"\n', "", 5, "measurements.file", None, ["is missing", "path of the table"]),
    ('angle_unit = "rad"\n', "", 5, "measurements.angle_unit", None, ["is missing", '"rad" or "deg"']),
    ('length_unit = "mm"\n', "", 5, "measurements.length_unit", None, ["is missing", '"m" or "mm" or "um"']),
    ('"mm"', '"inch"', 8, "measurements.length_unit", "'inch'", ["unknown unit", '"m" or "mm" or "um"']),
    ('"rad"', '"radian"', 7, "measurements.angle_unit", "'radian'", ["unknown unit", '"rad" or "deg"']),
    ('"rad"', "1", 7, "measurements.angle_unit", "1", ["unknown unit", '"rad" or "deg"']),
    (
        'base = "unknown"',
        'base = "floor"',
        11,
        "frames.base",
        "'floor'",
        ["unknown word", '"unknown" or "known"'],
    ),
    ("base =", "bse =", 11, "frames.bse", None, ["unknown key", "did you mean 'base'", "base, tool, target"]),
    ("tool_frame", "toolframe", 3, "robot.toolframe", None, ["unknown key", "did you mean 'tool_frame'"]),
    ("position =", "positon =", 16, "noise.positon", None, ["did you mean 'position'"]),
    ("[noise]", "[noises]", 15, "noises", None, ["unknown section", "did you mean 'noise'"]),
    ("[robot]", 'title = "x"\n[robot]', 1, "title", None, ["unknown section or key", "sections robot"]),
    ("[robot]", "payload = 5\n[robot]", 1, "payload", "5", ["wrong kind of value", "a section [payload]"]),
    ('"tool"', "6", 3, "robot.tool_frame", "6", ["wrong kind of value", "as text in quotes"]),
    ('"tool"', '" "', 3, "robot.tool_frame", "' '", ["as text in quotes"]),
    ("80.0]", "80.0, 1]", 13, "frames.target", "[0.0, 0.0, 80.0, 1]", ["three numbers in brackets"]),
    ("[0.0, 0.0, 80.0]", '"80"', 13, "frames.target", "'80'", ["three numbers in brackets"]),
    ("80.0]", "nan]", 13, "frames.target", "[0.0, 0.0, nan]", ["three numbers in brackets"]),
    ("80.0]", "true]", 13, "frames.target", "[0.0, 0.0, True]", ["three numbers in brackets"]),
    ("0.02", '"0.02"', 16, "noise.position", "'0.02'", ["wrong kind of value", "a number"]),
    ("0.02", "-0.02", 16, "noise.position", "-0.02", ["cannot be negative"]),
    ("0.02", "0.02\norientation = -1", 17, "noise.orientation", "-1.0", ["cannot be negative"]),
    ("1e-3", "0", 19, "priors.joint_offset", "0", ["expected size of an effect must be positive"]),
    ("1e-3", "-1e-3", 19, "priors.joint_offset", "-0.001", ["must be positive", "a number above 0"]),
    ("1e-3", '"small"', 19, "priors.joint_offset", "'small'", ["wrong kind of value", "a number above 0"]),
    ("101", "0", 22, "gears.lift", "0", ["transmission ratio must be positive"]),
    (
        "lift =",
        "left =",
        22,
        "gears.left",
        None,
        ["no such joint", "did you mean 'lift'", "'turn', 'lift', 'slide'"],
    ),
]


@pytest.mark.parametrize(("old", "new", "row", "column", "found", "words"), TOML_CASES)
def test_campaign_toml(
    tmp_path: Path,
    old: str,
    new: str,
    row: int | None,
    column: str | None,
    found: str | None,
    words: list[str],
) -> None:
    assert TOML.count(old) >= 1
    toml = TOML.replace(old, new, 1)
    error = refusal(tmp_path, toml=toml)
    assert error.file == str(tmp_path / "campaign.toml")
    assert (error.row, error.column, error.found) == (row, column, found)
    for word in words:
        assert word in str(error)


def test_no_campaign(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "campaign.toml"):
        with pytest.raises(CampaignError) as caught:
            read_campaign(path)
        assert caught.value.file == str(tmp_path / "campaign.toml")
        assert str(caught.value).endswith(
            "there is no such file, expected campaign.toml, or the directory that holds it"
        )


def test_campaign_toml_in_another_encoding(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_bytes('tool = "Gerät"'.encode("latin-1"))
    with pytest.raises(CampaignError, match=r"campaign\.toml: is not UTF-8 text"):
        read_campaign(tmp_path)


def test_robot_errors_name_the_campaign(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"campaign\.toml, \[robot\]: .*'tol'") as caught:
        read(tmp_path, toml=TOML.replace('"tool"', '"tol"'))
    assert "tool" in caught.value.candidates
    with pytest.raises(RobotError, match=r"campaign\.toml, \[robot\]: .*arm\.urdf"):
        read(tmp_path, toml=TOML.replace("robot.urdf", "arm.urdf"))


TABLE_CASES = [
    # table, row, column, found, words of the sentence
    ("", None, None, None, ["is empty"]),
    ("\n \n", None, None, None, ["is empty"]),
    (ROWS.split("\n")[0], None, None, None, ["has a header but no rows", "one row per measurement"]),
    (
        renamed(lift="elevation"),
        1,
        "lift",
        None,
        ["no such column", "every movable joint of the chain from 'base'"],
    ),
    (
        renamed(lift="Lift"),
        1,
        "lift",
        "the nearest names 'Lift'",
        ["expected 'turn', 'lift', 'slide', 'roll'"],
    ),
    (renamed(y="Y"), 1, "y", "the nearest names 'Y'", ["a measured position needs x, y and z"]),
    (renamed(note="x"), 1, "x", "it 2 times", ["duplicate column", "every column once"]),
    (renamed(note=""), 1, None, "column 9 without one", ["a column has no name"]),
    (ROWS.replace("900", "12.3a"), 3, "x", "'12.3a'", ["text where a number should be", "expected a number"]),
    (ROWS.replace("0.3", "0_3"), 3, "lift", "'0_3'", ["text where a number should be"]),
    (ROWS.replace("900", ""), 3, "x", "an empty cell", ["a value is missing"]),
    (ROWS.replace("520", "nan"), 4, "z", "'nan'", ["a value is missing"]),
    (ROWS.replace("900", "inf"), 3, "x", "'inf'", ["not a finite number"]),
    (ROWS.replace("0.3", ""), 3, "lift", "an empty cell", ["a value is missing"]),
    (ROWS.replace("0.3", "-inf"), 3, "lift", "'-inf'", ["not a finite number"]),
    (ROWS.replace(",2,8", ",inf,8"), 3, "time", "'inf'", ["not a finite number"]),
    (ROWS.replace(",2,8", ",two,8"), 3, "time", "'two'", ["text where a number should be"]),
    (ROWS.replace(",2,8", ",2"), 3, None, "8", ["wrong number of fields", "9 as in the header"]),
    (ROWS.replace(",2,8", ",2,8,9"), 3, None, "10", ["wrong number of fields", "9 as in the header"]),
    (ROWS.replace(",2,8", ',"2,8'), 3, None, "8", ["wrong number of fields"]),
    (with_column("qw", "1", "1", "1"), 1, "qx", "only 'qw'", ["together or not at all"]),
    (with_column("sim.y", "1", "1", "1"), 1, "sim.x", "only 'sim.y'", ["together or not at all"]),
    (
        with_column("sim.qw,sim.qx,sim.qy,sim.qz", *["1,0,0,0"] * 3),
        1,
        "sim.x",
        None,
        ["needs a simulated position"],
    ),
    (with_column("sim.x,sim.y,sim.z", "1,2,3", "1,,3", "1,2,3"), 3, "sim.y", "an empty cell", ["missing"]),
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
    (
        with_column("qw,qx,qy,qz", "1,0,0,0", "1,,0,0", "1,0,0,0"),
        3,
        "qx",
        "an empty cell",
        ["a value is missing"],
    ),
    (with_column("approach.lift", "1", "0", "0.5"), 4, "approach.lift", "0.5", ["impossible", "-1, 0 or 1"]),
    (with_column("payload", "0", "-2", "3"), 3, "payload", "-2", ["impossible value", "not negative"]),
    (with_column("temperature", "20", "20", "-300"), 4, "temperature", "-300", ["impossible value", "°C"]),
    (b"PK\x03\x04...", None, None, None, ["is a workbook", "saved as CSV or Parquet"]),
    (b"PAR1...", None, None, None, ["Parquet file by its contents", "ends in .parquet"]),
    (
        ROWS.replace("900", "9" * 200_000),
        3,
        None,
        None,
        ["cannot be read as CSV", "field larger than field limit"],
    ),
]


@pytest.mark.parametrize(("table", "row", "column", "found", "words"), TABLE_CASES)
def test_table(
    tmp_path: Path,
    table: str | bytes,
    row: int | None,
    column: str | None,
    found: str | None,
    words: list[str],
) -> None:
    error = refusal(tmp_path, table=table)
    assert error.file == str(tmp_path / "measurements.csv")
    assert (error.row, error.column) == (row, column)
    if found is not None:
        assert error.found == found
    for word in words:
        assert word in str(error)


def test_the_whole_sentence(tmp_path: Path) -> None:
    table = ROWS.replace(",", ";").replace(".", ",").replace("900", "12,3a")
    error = refusal(tmp_path, table=table)
    assert str(error) == (
        f"{tmp_path / 'measurements.csv'}, row 3, column 'x': text where a number should be; "
        "found '12,3a', expected a number"
    )


def test_decimal_point_among_decimal_commas(tmp_path: Path) -> None:
    table = "turn;lift;slide;roll;x;y;z\n0,1;0,2;30;0,4;1.000;0;500\n"
    error = refusal(tmp_path, table=table)
    assert (error.row, error.column, error.found) == (2, "x", "'1.000'")
    assert error.expected == "a number with a decimal comma, as elsewhere in this file"
    assert refusal(tmp_path, table=table.replace("1.000", "1.000,5")).found == "'1.000,5'"


def test_no_table(tmp_path: Path) -> None:
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "monday.csv"))
    assert error.file == str(tmp_path / "monday.csv")
    assert "there is no such file" in str(error)
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "."))
    assert "is a directory" in str(error)


def test_parquet_without_pyarrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "t.parquet").write_bytes(b"PAR1")

    def missing(*_: object, **__: object) -> None:
        raise ImportError("pyarrow")

    monkeypatch.setattr(pd, "read_parquet", missing)
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "t.parquet"))
    assert error.file == str(tmp_path / "t.parquet")
    assert 'pip install "thermal-robot[parquet]"' in str(error)


def test_broken_parquet(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    (tmp_path / "t.parquet").write_bytes(b"PAR1")
    error = refusal(tmp_path, toml=TOML.replace("measurements.csv", "t.parquet"))
    assert "cannot be read as a Parquet file" in str(error)


@pytest.mark.parametrize("name", ["x", "time", "sim.x", "approach.lift"])
def test_a_joint_with_the_name_of_a_column(tmp_path: Path, name: str) -> None:
    robot = load_robot(URDF.replace('joint name="slide"', f'joint name="{name}"'), "tool")
    columns = {*robot.joint_names, "x", "y", "z"}
    with pytest.raises(CampaignError, match="both a joint of the chain and a column") as caught:
        campaign_from_table(robot, pd.DataFrame(dict.fromkeys(columns, [0.0] * 5)))
    assert (caught.value.column, caught.value.row) == (name, None)


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
        error = refusal(tmp_path, table=distinct(needed - 1, 4, pose=pose), toml=toml)
        assert error.file == str(tmp_path / "measurements.csv")
        assert error.found == "8 rows with 2 different joint configurations"
        assert error.expected == "at least 3 different configurations"
        assert "too few measurements to find the unknown base" in str(error)


WARNINGS = [
    (ROWS.replace("0.5,-0.4", "0.5,-2.1"), ["'lift'", "1 row", "row 4", "-2.1 rad", "limit -2 rad"]),
    (
        ROWS.replace(",60,", ",600,").replace(",90,", ",700,"),
        ["'slide'", "2 rows", "row 3", "600 mm", "limit 500 mm"],
    ),
    (ROWS.replace("0.1,0.2,", "45,0.2,"), ["'turn'", "45 rad", "row 2", "two turns", 'angle_unit = "deg"']),
    (ROWS.replace(",2,8", ",0.5,8"), ["'time' runs backwards 1 time", "row 3", "0.5 s after 1 s"]),
    (
        with_column("speed", "0.5", "50", "100"),
        ["'speed' is outside 0..1 in 2 rows", "row 3", "50", "fraction"],
    ),
    (with_column("temperature", "293", "294", "295"), ["'temperature'", "294 °C", "kelvin"]),
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
    (with_column("pose", "a", "b", "a"), ["same pose label", "different joint commands", "'a'"]),
    (
        ROWS.replace("1000,0", "90000000,0"),
        ["extend over", "m and the arm reaches 1.9 m", 'length_unit = "mm"'],
    ),
]


@pytest.mark.parametrize(("table", "words"), WARNINGS)
def test_warning(tmp_path: Path, table: str, words: list[str]) -> None:
    warnings = read(tmp_path, table=table).warnings
    fitting = [warning for warning in warnings if all(word in warning for word in words)]
    assert len(fitting) == 1, warnings
    assert not any("\n" in warning for warning in warnings)


@pytest.mark.parametrize("name", ["temperature.bean", "approach.lit", "torque.grip", "operator"])
def test_what_is_ignored_is_no_covariate(tmp_path: Path, name: str) -> None:
    campaign = read(tmp_path, table=with_column(name, "1", "1", "Ann" if name == "operator" else "0"))
    assert name not in campaign.covariates
    assert name not in campaign.extra


def test_radians_called_degrees(tmp_path: Path) -> None:
    warnings = read(tmp_path, toml=TOML.replace('"rad"', '"deg"')).warnings
    assert any('no joint leaves ±3.5 degrees: is angle_unit = "rad" meant?' in warning for warning in warnings)


@pytest.mark.parametrize(("old", "new", "words"), [("80.0]", "80000.0]", "target lies 80 m"), ("0.02", "20", "noise")])
def test_lengths_in_another_unit(tmp_path: Path, old: str, new: str, words: str) -> None:
    (warning,) = read(tmp_path, toml=TOML.replace(old, new)).warnings
    assert words in warning
    assert 'is length_unit = "mm" right?' in warning


def test_the_last_digit_is_no_violation(tmp_path: Path) -> None:
    assert read(tmp_path, table=ROWS.replace("0.5,-0.4", "0.5,-2.0000005")).warnings == ()
