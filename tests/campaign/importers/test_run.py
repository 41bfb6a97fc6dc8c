"""What an import writes, and what it never overwrites; the registry of formats, and the page that tells of it."""

import inspect
import os
from pathlib import Path

import numpy as np
import pytest
from campaign.importers.written import COMMANDS, put

from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.importers.plan import planned
from thermal_robot.campaign.importers.run import FORMATS, import_files
from thermal_robot.campaign.importers.table import commands, joined
from thermal_robot.campaign.read import read_samples
from thermal_robot.campaign.table import Table
from thermal_robot.errors import CampaignError


def sources(tmp_path):
    """A folder with a table to import, and how."""
    header, *rows = COMMANDS.split()
    lines = [f"{header},x,y,z", *(f"{row},{k},1,2" for k, row in enumerate(rows))]
    folder = put(tmp_path, measurements__csv="\n".join(lines))
    plan = planned({
        "robot": {"urdf": str(folder / "robot.urdf"), "tool_frame": "tool"},
        "measurements": {"angle_unit": "rad", "length_unit": "mm"},
    })  # fmt: skip
    return folder, plan


def test_a_campaign_that_is_read_from_is_not_overwritten(tmp_path):
    folder, plan = sources(tmp_path)
    with pytest.raises(CampaignError, match="is read from, and would be overwritten"):
        import_files("table", [folder / "measurements.csv"], folder, plan)
    done = import_files("table", [folder / "measurements.csv"], folder / "new", plan)
    assert sorted(file.name for file in (folder / "new").iterdir()) == [
        "campaign.toml",
        "measurements.csv",
        "robot.urdf",
    ]
    assert done.file == folder / "new" / "campaign.toml"
    assert done.campaign.name == "new"
    assert done.notes == ("3 rows read, 3 taken",)


def test_a_campaign_that_was_not_imported_is_not_replaced(tmp_path):
    folder, plan = sources(tmp_path)
    again = folder / "again"
    file = import_files("table", [folder / "measurements.csv"], again, plan).file
    first = file.read_text(encoding="utf-8")
    import_files("table", [folder / "measurements.csv"], again, plan)
    assert file.read_text(encoding="utf-8") == first
    own = first.partition("\n")[2]
    file.write_text(own, encoding="utf-8")
    with pytest.raises(CampaignError, match="there is a campaign already"):
        import_files("table", [folder / "measurements.csv"], again, plan)
    assert file.read_text(encoding="utf-8") == own


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_says_what_it_reads_and_cites_its_source(name):
    format = FORMATS[name]
    assert format.does
    assert format.files
    assert 1 <= format.least <= format.most
    assert format.most <= 3 or "FOLDERS" in format.files  # as many as the stand had places
    told = inspect.getmodule(getattr(format.read, "func", format.read)).__doc__
    assert name == "table" or "Source" in told or "ros_csv" in told


def test_the_page_has_every_format():
    page = (Path(__file__).parents[3] / "docs" / "importers.md").read_text(encoding="utf-8")
    assert [name for name in FORMATS if f"| `{name}` |" not in page] == []


# ---- two tables that become one


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


# ---- published data


DATA = os.environ.get("THERMAL_ROBOT_DATA")
pytestmark = pytest.mark.skipif(
    not DATA or not (Path(DATA) / "original").is_dir(),
    reason="THERMAL_ROBOT_DATA names no folder that has the original files",
)
FOLDER = Path(DATA or ".")
JACOBI = {"ur5_jacobi": "UR5/3D_UR5_uncalibrated", "wam_jacobi": "WAM/3D_WAM_uncalibrated"}
IPA = {"ipa_ur10_a": "Series_A/measurements_grid", "ipa_ur10_b": "Series_B/measurements_joint_configurations"}


def taken(format, file, known, directory):
    """Import a file with the robot of a campaign that is known; give both, as they are read."""
    robot = {"urdf": str(FOLDER / known / "robot.urdf"), "tool_frame": read_campaign(FOLDER / known).robot.tool_frame}
    import_files(format, [FOLDER / "original" / file], directory, planned({"robot": robot}))
    return read_campaign(directory), read_campaign(FOLDER / known)


@pytest.mark.parametrize("name", JACOBI)
def test_jacobi(name, tmp_path):
    ours, known = taken("jacobi", f"jacobi/{JACOBI[name]}_grid_cleaned.csv", name, tmp_path / "c")
    np.testing.assert_allclose(ours.q, known.q, atol=6e-10)  # written with nine decimals there
    np.testing.assert_allclose(ours.position, known.position, atol=6e-10)
    np.testing.assert_array_equal(ours.covariates["order"], known.covariates["order"])
    ours, _ = taken("jacobi", f"jacobi/{JACOBI[name]}_random_cleaned.csv", name, tmp_path / "t")
    test = read_samples(FOLDER / name / "test.csv", known)
    np.testing.assert_allclose(ours.q, test.q, atol=6e-10)


@pytest.mark.slow
@pytest.mark.parametrize("name", IPA)
def test_ipa(name, tmp_path):
    ours, known = taken("ipa_ur10", f"ipa_ur10/{IPA[name]}.csv", name, tmp_path / "c")
    np.testing.assert_allclose(ours.q, known.q, atol=6e-10)
    np.testing.assert_allclose(ours.position, known.position, atol=6e-10)
    sign = np.sign(np.sum(ours.orientation * known.orientation, axis=1))[:, None]
    np.testing.assert_allclose(sign * ours.orientation, known.orientation, atol=2e-9)
    np.testing.assert_allclose(ours.covariates["temperature"], known.covariates["temperature"], atol=6e-4)
    clock = "time" if name == "ipa_ur10_a" else "order"
    np.testing.assert_array_equal(ours.covariates[clock], known.covariates[clock])
    np.testing.assert_allclose(ours.target, known.target)
