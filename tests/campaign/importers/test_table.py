"""Any table by a mapping: names and numbers of columns, units, signs, sums, instants, orientations, skipped lines."""

import re
from pathlib import Path

import numpy as np
import pytest
from campaign.importers.written import COMMANDS, complaint, imported, put, rotations

from thermal_robot.campaign.importers.plan import planned
from thermal_robot.campaign.importers.table import commands, joined
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError

MAPPING = """
[robot]
urdf = "robot.urdf"
tool_frame = "tool"
[measurements]
angle_unit = "deg"
length_unit = "mm"
[frames]
target = [0.0, 0.0, 80.0]
[noise]
position = 0.02
[table]
separator = "semicolon"
skip = 2
comment = "#"
[columns]
joints = ["J1", "J2", {column = "J3", scale = 1000.0}, {column = "J4", scale = -1.0, offset = 90.0}]
x = "X"
y = 6
z = {sum = ["Z", "dZ"]}
time = {column = "at", time = "%d.%m.%Y %H:%M:%S"}
payload = {value = 5.0}
session = "run"
humidity = "RH"
"""
TABLE = """Log of cell 7
made by hand
J1;J2;J3;J4;X;Y;Z;dZ;at;run;RH;who
# a comment; of any length
10;20;0,03;40;1000,5;0;500;0,25;14.07.2020 16:39:04;a;40;me
-10;15;0,06;400;900;100;510;0;14.07.2020 16:40:04;a;41;me
5;5;0,06;40;;;;;14.07.2020 16:41:04;a;41;me
50;-45;0,09;-40;800;200;520;-1;15.07.2020 16:39:04;b;42;me
"""


def test_a_mapping_says_what_the_columns_are(tmp_path, capsys):
    folder = put(tmp_path, log__csv=TABLE, m__toml=MAPPING)
    campaign, out = imported(capsys, folder, "table", "log.csv", "--mapping", str(folder / "m.toml"), robot=False)
    degrees = np.rad2deg(campaign.q)
    np.testing.assert_allclose(degrees[:, [0, 1, 3]], [[10, 20, 50], [-10, 15, -310], [50, -45, 130]])
    np.testing.assert_allclose(campaign.q[:, 2], [0.03, 0.06, 0.09])
    np.testing.assert_allclose(1e3 * campaign.position, [[1000.5, 0, 500.25], [900, 100, 510], [800, 200, 519]])
    np.testing.assert_allclose(campaign.covariates["time"], [0, 60, 86400])
    np.testing.assert_allclose(campaign.covariates["payload"], 5.0)
    np.testing.assert_allclose(campaign.covariates["humidity"], [40, 41, 42])
    assert campaign.labels["session"].tolist() == ["a", "a", "b"]
    assert campaign.settings.noise_position == pytest.approx(2e-5)
    np.testing.assert_allclose(campaign.target, [0, 0, 0.08])
    assert "4 rows read, 3 taken; 1 row (7) left out, without a measured position; columns left out: 'who'" in out
    assert (folder / "made" / "campaign.toml").read_text().startswith("# Imported by `thermal-robot import table` from")


def test_a_list_without_header_is_known_by_numbers(tmp_path, capsys):
    mapping = '[table]\nheader = false\nseparator = "space"\n[columns]\njoints = [1, 2, 3, 4]\nx = 5\ny = 6\nz = 7\n'
    rows = "0.1  0.2 0.03   0.4 1 2\t3\n-0.1 0.3 0.06 3.5 4 5 6\n0.5 -0.4 0.09 -0.4 7 8 9\n"
    folder = put(tmp_path, log__txt=rows, m__toml=mapping)
    units = ("--angle-unit", "rad", "--length-unit", "m")
    campaign, _ = imported(capsys, folder, "table", "log.txt", "--mapping", str(folder / "m.toml"), *units)
    np.testing.assert_allclose(campaign.position, [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
    np.testing.assert_allclose(campaign.q[1], [-0.1, 0.3, 0.06, 3.5])


def test_commands_and_measurements_in_two_tables(tmp_path, capsys):
    commands = COMMANDS.replace("roll", "roll,name").replace("0.4\n", "0.4,P1\n").replace("3.5\n", "3.5,P2\n")
    commands = commands.replace("-0.4,P1", "-0.4,P3")
    measured = "point,x,y,z\nP3,7,8,9\nP1,1,2,3\nP9,0,0,0\nP2,4,5,6\nP1,1,2,3.5\n"
    folder = put(tmp_path, c__csv=commands, p__csv=measured, m__toml='[table]\nkey = "point"\n')
    units = ("--angle-unit", "rad", "--length-unit", "m", "--mapping", str(folder / "m.toml"))
    campaign, out = imported(capsys, folder, "table", "p.csv", "c.csv", *units)
    np.testing.assert_allclose(campaign.position[:, 2], [9, 3, 6, 3.5])
    np.testing.assert_allclose(campaign.q[:, 3], [-0.4, 0.4, 3.5, 0.4])
    assert "1 points left out, not commanded: 'P9'" in out


def test_two_lists_without_headers_are_described_once(tmp_path, capsys):
    mapping = "[table]\nheader = false\n[columns]\njoints = [4, 5, 6, 7]\nx = 1\ny = 2\nz = 3\n"
    rows = "\n".join(COMMANDS.split()[1:]).replace(",", " ")
    folder = put(tmp_path, p__txt="1 2 3\n4 5 6\n7 8 9.5\n", j__txt=rows, m__toml=mapping, n__toml=mapping[23:])
    units = ("--angle-unit", "rad", "--length-unit", "m")
    campaign, out = imported(capsys, folder, "table", "p.txt", "j.txt", "--mapping", str(folder / "m.toml"), *units)
    np.testing.assert_allclose(campaign.position[2], [7, 8, 9.5])
    np.testing.assert_allclose(campaign.q[2], [0.5, -0.4, 0.09, -0.4])
    assert "3 rows read, 3 taken" in out
    (folder / "made").rename(folder / "first")
    said = complaint(capsys, folder, "table", "p.txt", "j.txt", "--mapping", str(folder / "n.toml"), *units)
    assert "the first line of p.txt is numbers alone and was taken for a header" in said
    assert "`header = false`" in said
    assert "found 2 and 3 rows, without that line" in said


def test_headers_tell_names_and_units(tmp_path, capsys):
    table = "J1 [deg];J2 [deg];J3 [mm];J4 (rad);X [m];Y (mm);z\n10;20;30;0,4;1,5;20;500\n11;21;60;0,5;1,6;21;510\n"
    folder = put(tmp_path, log__csv=table + "12;-22;90;0,6;1,7;22;520\n", m__toml='[columns]\nx = "X"\nj = "J1"\n')
    campaign, _ = imported(capsys, folder, "table", "log.csv")
    np.testing.assert_allclose(campaign.q[0], [np.deg2rad(10), np.deg2rad(20), 0.03, 0.4])
    np.testing.assert_allclose(campaign.position[0], [1.5, 0.02, 0.5 if campaign.units.length == "mm" else 500])
    (folder / "made").rename(folder / "first")
    units = ("--angle-unit", "rad", "--length-unit", "um", "--mapping", str(folder / "m.toml"))
    campaign, _ = imported(capsys, folder, "table", "log.csv", *units)
    np.testing.assert_allclose(campaign.position[0], [1.5, 0.02, 500e-6])


@pytest.mark.parametrize(
    ("was", "becomes", "words"),
    [
        ('x = "X"', 'x = "XX"', "log.csv, row 3, column 'XX': there is no such column; did you mean 'X'?"),
        ('x = "X"', "x = 40", "log.csv, row 3, column '40': there is no such column"),
        ('"J1", ', "", "m.toml, column 'columns.joints': another number of joints than the chain has; found 3"),
        ("%d.%m.%Y", "%d/%m/%Y", "row 5, column 'at': no instant of this pattern; found '14.07.2020 16:39:04'"),
        ("{value = 5.0}", "{value = 5.0, count = true}", "row 22, column 'columns.payload': wrong kind"),
        ("[columns]", "[colums]", "m.toml, row 16, column 'colums': unknown section or key; did you mean"),
        ("skip = 2", "skip = -1", "m.toml, row 14, column 'table.skip': wrong kind of value; found -1"),
        ('"semicolon"', '";"', "found ';', expected \"comma\" or \"semicolon\" or \"tab\" or \"space\""),
        ('length_unit = "mm"', "", "m.toml: no length_unit is stated, expected [measurements] length_unit"),
        ('urdf = "robot.urdf"', "", "m.toml: no robot is named, expected --robot URDF"),
    ],
)  # fmt: skip
def test_mistakes_are_told_by_file_row_and_column(tmp_path, capsys, was, becomes, words):
    folder = put(tmp_path, log__csv=TABLE, m__toml=MAPPING.replace(was, becomes))
    said = complaint(capsys, folder, "table", "log.csv", "--mapping", str(folder / "m.toml"), robot=False)
    assert words in said


@pytest.mark.parametrize(
    ("was", "becomes", "words"),
    [
        ("1000,5;0;", "1000,5;;", "log.csv, row 5, column '6': a value is missing, for the column 'y' of the campaign"),
        (";40;1000", ";forty;1000", "log.csv, row 5, column 'J4': text where a number should be; found 'forty'"),
        (";who", ";", "log.csv, row 3: a column has no name"),
    ],
)
def test_a_spoilt_table_is_told_by_its_own_rows_and_columns(tmp_path, capsys, was, becomes, words):
    folder = put(tmp_path, log__csv=TABLE.replace(was, becomes), m__toml=MAPPING)
    assert words in complaint(capsys, folder, "table", "log.csv", "--mapping", str(folder / "m.toml"), robot=False)


def test_the_example_of_the_page_is_imported(tmp_path, capsys):
    page = (Path(__file__).parents[3] / "docs" / "importers.md").read_text(encoding="utf-8")
    files = {kind: re.search(rf"^```{kind}\n(.*?)^```", page, flags=re.M | re.S)[1] for kind in ("csv", "toml")}
    folder = put(tmp_path, log__csv=files["csv"], m__toml=files["toml"])
    campaign, out = imported(capsys, folder, "table", "log.csv", "--mapping", str(folder / "m.toml"), robot=False)
    assert "5 rows read, 4 taken; 1 row (5) left out" in out
    np.testing.assert_allclose(np.rad2deg(campaign.q[0]), [-7.45, 60.52, -82.20, 63.23, -87.60])
    np.testing.assert_allclose(1e3 * campaign.position[1], [-1151.046, -458.460, -1125.218])
    np.testing.assert_allclose(campaign.covariates["time"], [0, 47, 147, 196])
    np.testing.assert_allclose(campaign.covariates["payload"], [0, 0, 3, 3])
    assert campaign.measures == "pose"


MEASURED = Table("m.csv", {"n": ["b", "a", "b"], "x": ["1,5", "2", "3"]}, np.array([2, 3, 4]), 1, decimal_comma=True)
COMMANDED = Table("c.csv", {"q": ["0.25", "0.5"], "point": ["a", "b"], "mark": ["u", "v"]}, np.array([2, 3]), 1)


def test_by_name_with_repeats_and_each_with_its_decimals():
    table, notes = joined(MEASURED, COMMANDED, "n")
    assert notes == ()
    np.testing.assert_array_equal(table.numbers("x"), [1.5, 2, 3])
    np.testing.assert_array_equal(table.numbers("q"), [0.5, 0.25, 0.5])
    assert table.text("mark") == ["v", "u", "v"]
    assert list(table.columns) == ["n", "x", "q", "mark"]
    assert table.file == "m.csv with c.csv"


def test_in_order():
    table, notes = joined(MEASURED.take(np.array([True, True, False])), COMMANDED)
    np.testing.assert_array_equal(table.numbers("q"), [0.25, 0.5])
    assert notes == ("rows of m.csv and c.csv joined in their order",)
    with pytest.raises(CampaignError, match="found 3 and 2 rows"):
        joined(MEASURED, COMMANDED)


def test_a_column_in_both_tables_is_refused():
    twice = Table("c.csv", {**COMMANDED.columns, "x": ["1", "2"]}, COMMANDED.rows, 1)
    with pytest.raises(CampaignError, match=r"c\.csv, row 1, column 'x': has a column that m\.csv has, too"):
        joined(MEASURED, twice, "n")


PAIRS = [[0.5, 20.0], [0.75, 21.0]]
POINTS = {
    "header = false": (False, {}),
    "a header": (True, {}),
    "skip": (False, {"skip": 1}),
    "comment": (True, {"comment": "#"}),
}
"""How the first table is laid out: whether it has a header, and what [table] says of it."""


def lined(names, separator, comma, above=""):
    lines = [separator.join(f"{v:g}" for v in row) for row in PAIRS]
    lines = [line.replace(".", ",") for line in lines] if comma else lines
    return above + "\n".join([separator.join(names), *lines] if names else lines) + "\n"


@pytest.mark.parametrize(("separator", "comma"), [(",", 0), (";", 0), (";", 1), ("\t", 1), (" ", 0), ("  ", 1)])
@pytest.mark.parametrize("headed", [False, True])
@pytest.mark.parametrize("how", POINTS)
def test_the_second_table_is_read_as_the_first_or_as_it_stands(tmp_path, how, headed, separator, comma):
    header, layout = POINTS[how]
    above = {"skip": "Log of cell 7\n", "comment": "# by hand\n"}.get(how, "")
    (tmp_path / "j.txt").write_text(lined(["q", "T"] if headed else [], separator, comma, above))
    plan = planned({"table": {"header": header, **layout}})
    table = commands(tmp_path / "j.txt", plan)
    assert [table.numbers(name).tolist() for name in table.columns] == np.transpose(PAIRS).tolist()
    assert list(table.columns) == (["q", "T"] if headed else ["1", "2"])
    (tmp_path / "j.txt").write_text(lined(["q", "T"] if headed else [], separator, comma))
    plain = commands(tmp_path / "j.txt", planned({"table": {"header": header}, "commands": {"header": headed}}))
    assert list(plain.columns) == list(table.columns)


def test_numbers_of_columns_go_on_in_the_second_table():
    bare = Table("c", {"1": ["0.25", "0.5"], "2": ["a", "b"]}, np.array([1, 2]))
    table, _ = joined(MEASURED, bare, "n")
    assert list(table.columns) == ["n", "x", "3"]
    np.testing.assert_array_equal(table.numbers("3"), [0.5, 0.25, 0.5])


GRID = """step_order,x_t,y_t,z_t,x_dif,y_dif,z_dif,joint_1,joint_2,joint_3,joint_4
0,100.0,200.0,300.0,0.5,-0.5,0.25,10,20,30,40
1,110.0,200.0,300.0,0.5,-0.5,0.25,11,22,33,44
2,120.0,210.0,300.0,0.5,-0.5,0.25,12,24,36,48
"""


def test_targets_and_differences_are_added(tmp_path, capsys):
    folder = put(tmp_path, grid__csv=GRID)
    campaign, _ = imported(capsys, folder, "jacobi", "grid.csv")
    np.testing.assert_allclose(1e3 * campaign.position[0], [100.5, 199.5, 300.25])
    np.testing.assert_allclose(np.rad2deg(campaign.q[:, 0]), [10, 11, 12])
    assert campaign.covariates["order"].tolist() == [0, 1, 2]


HEADER = "Timestamp;turn;lift;slide;roll;measurement_temperature;measurement_x;measurement_y;measurement_z;"
HEADER += "measurement_rx;measurement_ry;measurement_rz\n"
SERIES = """{};0,1;0,2;0,03;0,4;23,5;1000,5;0;500;90,0;0;90,0
{};-0,1;0,3;0,06;3,5;23,6;900;100;510;0;0;0
{};0,5;-0,4;0,09;-0,4;23,7;800;200;520;0;30,0;0
"""
STAMPS = ("20200714163904", "20200714163924", "20200715163904")


@pytest.mark.parametrize(
    ("stamps", "clock", "seen"), [(STAMPS, "time", [0, 20, 86400]), (["2,02011E+13"] * 3, "order", [0, 1, 2])]
)
def test_stamps_or_the_order(tmp_path, capsys, stamps, clock, seen):
    folder = put(tmp_path, series__csv=HEADER + SERIES.format(*stamps))
    campaign, out = imported(capsys, folder, "ipa_ur10", "series.csv")
    assert campaign.covariates[clock].tolist() == seen
    assert ("the time stamps are no instants" in out) == (clock == "order")
    np.testing.assert_allclose(1e3 * campaign.position[0], [1000.5, 0, 500])
    np.testing.assert_allclose(campaign.covariates["temperature"], [23.5, 23.6, 23.7])
    # about x by 90°, then about the new z by 90°
    np.testing.assert_allclose(rotations(campaign)[0], [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-12)
