"""From files and data frames to a campaign and to samples: SI units, gaps filled, what cannot be refused by its row."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from campaign.files import FULL, PLAIN, PLAIN_TOML, ROWS, TOML, URDF, add, full, put, read, refusal, says, with_column

from thermal_robot.campaign import Settings, Units, campaign_from_table, describe, read_campaign, read_samples
from thermal_robot.campaign.read import fill
from thermal_robot.errors import CampaignError, RobotError
from thermal_robot.robot import Robot, load_robot

DEGREE = math.pi / 180
SI = {
    "time": [0, 1.5, 3],
    "temperature": [20.1, 20.7, 21.3],
    "temperature.beam": [20, 21, 22],
    "payload": [0, 5, 5],
    "approach.lift": [1, -1, 0],
    "approach.slide": [1, 1, -1],
    "velocity.lift": [10 * DEGREE, 20 * DEGREE, 30 * DEGREE],
    "velocity.slide": [0.01, 0.02, 0.03],
    "acceleration.roll": [DEGREE, 2 * DEGREE, 3 * DEGREE],
    "torque.lift": [1.5, 2.5, 3.5],
    "encoder.lift": [20.1 * DEGREE, 15.1 * DEGREE, -44.9 * DEGREE],
    "encoder.slide": [0.0301, 0.0601, 0.0901],
    "speed": [0.1, 0.5, 1],
    "order": [3, 1, 2],
    "humidity": [40, 41, 43],
}


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(URDF, "tool")


def test_units_become_si_once() -> None:
    campaign = full()
    np.testing.assert_allclose(campaign.q[0], [10 * DEGREE, 20 * DEGREE, 0.030, 40 * DEGREE], rtol=1e-15)
    np.testing.assert_allclose(campaign.position[1], [0.9, 0.1, 0.51])
    np.testing.assert_allclose(campaign.orientation[2], [0.6, 0, 0.8, 0])
    np.testing.assert_allclose(campaign.simulated_position[2], [0.8, 0.2, 0.52])
    np.testing.assert_allclose(campaign.simulated_orientation, [[1, 0, 0, 0]] * 3)
    assert set(campaign.covariates) == set(SI)
    for name, values in SI.items():
        np.testing.assert_allclose(campaign.covariates[name], values, err_msg=name)
    settings = campaign.settings
    assert settings.noise_position == pytest.approx(2e-5)
    assert settings == Settings(
        "robot.urdf", "tool", "base", (0.0, 0.0, -9.81), reference_temperature=22.5, units=Units("deg", "mm"),
        tool_known=True, target=(0.001, 0.002, 0.08), noise_position=settings.noise_position, noise_orientation=3e-5,
        payload_com=(0.0, 0.0, 0.05), priors={"joint_offset": 1e-3}, gears={"lift": 101.0},
    )  # fmt: skip
    assert (campaign.name, campaign.samples, campaign.measures, campaign.extra) == ("hall_3", 3, "pose", ("humidity",))
    assert campaign.labels["session"].tolist() == ["a", "a", "b"]
    assert campaign.labels["pose"].tolist() == ["1", "2", "3"]
    assert (campaign.rows.tolist(), campaign.warnings) == ([2, 3, 4], ())


def test_path_of_file_or_directory_gives_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = put(tmp_path / "cell")
    by_file, by_folder = read_campaign(folder / "campaign.toml"), read_campaign(str(folder))
    monkeypatch.chdir(folder)
    here = read_campaign(".")
    assert by_file.name == by_folder.name == here.name == "cell"
    np.testing.assert_array_equal(by_file.q, here.q)
    (folder / "campaign.toml").rename(folder / "monday.toml")
    assert read_campaign(folder / "monday.toml").name == "monday"


def test_robot_errors_name_the_campaign(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"campaign\.toml, \[robot\]: .*'tol'") as caught:
        read(tmp_path, toml=PLAIN_TOML.replace('"tool"', '"tol"'))
    assert "tool" in caught.value.candidates
    with pytest.raises(RobotError, match=r"campaign\.toml, \[robot\]: .*arm\.urdf"):
        read(tmp_path, toml=PLAIN_TOML.replace("robot.urdf", "arm.urdf"))


def test_samples_need_commands_alone(tmp_path: Path) -> None:
    campaign, file = full(), tmp_path / "fresh.csv"
    file.write_text("lift,turn,roll,slide,temperature,x,qw,noise\n20,10,40,30,25,far away,0,unknown\n")
    samples = read_samples(file, campaign)
    assert (samples.name, samples.position, samples.orientation, samples.noise_of_rows) == ("fresh", None, None, None)
    np.testing.assert_allclose(samples.q, campaign.q[:1])
    assert {name: values.tolist() for name, values in samples.covariates.items()} == {"temperature": [25.0]}
    assert samples.target.tolist() == campaign.target.tolist()
    settings = Settings.from_dict(json.loads(json.dumps(campaign.settings.to_dict())))
    np.testing.assert_array_equal(read_samples(file, settings, campaign.robot).q, samples.q)
    with pytest.raises(TypeError, match="robot"):
        read_samples(file, settings)
    file.write_text("turn,roll,slide\n10,40,30\n")
    with pytest.raises(CampaignError, match="row 1, column 'lift'"):
        read_samples(file, campaign)


QUATERNION = "qw,qx,qy,qz"
# table, row, column, found, what is said
REFUSED = [
    (with_column(QUATERNION, "1,0,0,0", "0,0,0,0", "1,0,0,0"), 3, "qw", "(0, 0, 0, 0) of length 0", "length is not 1"),
    (with_column("approach.lift", "1", "0", "0.5"), 4, "approach.lift", "0.5", "impossible … -1, 0 or 1"),
    (with_column("payload", "0", "-2", "3"), 3, "payload", "-2", "impossible value … not negative"),
    (with_column("temperature", "20", "20", "-300"), 4, "temperature", "-300", "impossible value … °C"),
    (with_column("noise", "0.02", "0", "0.02"), 3, "noise", "'0'", "no standard deviation … one sigma above 0"),
    (PLAIN.replace("0.5,-0.4", "2e6,-0.4"), 4, "turn", "'2e6'", "no joint goes so far … at most 1e+06 rad or m"),
]


@pytest.mark.parametrize(("table", "row", "column", "found", "said"), REFUSED)
def test_an_impossible_value_is_refused(tmp_path, table, row, column, found, said):
    error = refusal(tmp_path, table=table)
    assert (error.row, error.column, error.found) == (row, column, found)
    assert says(error, said)


@pytest.mark.parametrize(
    ("column", "cells"),
    [
        ("approach.lift", ("-1", "0", "1")),
        ("payload", ("0", "0", "3")),
        ("temperature", ("-273.15", "0", "30")),
        ("temperature.beam", ("-5", "", "30")),
    ],
)
def test_values_at_the_border_are_possible(tmp_path, column, cells):
    assert column in read(tmp_path, table=with_column(column, *cells)).covariates


def test_orientations_are_normalised_and_keep_their_direction(tmp_path: Path) -> None:
    written = np.array([[0.95, 0.0, 0.0, 0.0], [0.5, 0.5, -0.5, 0.5], [0.0, 0.63, 0.84, 0.0]])
    found = read(tmp_path, table=with_column(QUATERNION, *(",".join(map(str, row)) for row in written))).orientation
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, rtol=1e-15)
    np.testing.assert_allclose(np.sum(found * written, axis=1), np.linalg.norm(written, axis=1), rtol=1e-14)


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
def test_too_few_rows(tmp_path, base, tool, pose, needed):
    toml = PLAIN_TOML.replace('base = "unknown"', f'base = "{base}"').replace('tool = "known"', f'tool = "{tool}"')
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


def test_rows_that_differ_by_rounding_are_one_configuration(tmp_path: Path) -> None:
    rows = ["0.1,0.1,30,0.4,1000,0,500", "0.1000000000001,0.1,30,0.4,1000,0,500", "0.2,0.1,30,0.4,1000,0,500"]
    found = read(tmp_path, table="\n".join(["turn,lift,slide,roll,x,y,z", *rows]) + "\n")
    assert any("3 rows with 2 different joint configurations" in said for said in found.warnings)


def test_warnings_come_in_the_order_of_the_work(tmp_path: Path) -> None:
    table = with_column("temprature,payload", "1,1", "1,", "1,1").replace("0.5,-0.4", "0.5,-2.1")
    told = ("temprature", "payload", "limits")
    assert [word for said in read(tmp_path, table=table).warnings for word in told if word in said] == [*told]


def test_approach_follows_from_the_order_where_it_was_not_recorded(tmp_path: Path) -> None:
    ordered = add(ROWS, order="1 2 3")
    told = read_campaign(put(tmp_path / "direct", ordered))
    assert told.derived == tuple(f"approach.{joint}" for joint in told.robot.joint_names)
    assert told.covariates["approach.lift"].tolist() == [0.0, -1.0, -1.0]
    assert told.covariates["approach.slide"].tolist() == [0.0, 1.0, 1.0]
    # what comes after is known of the whole campaign, not of the rows that are left
    assert told.take([0, 2]).covariates["approach.lift"].tolist() == [0.0, -1.0]
    assert "from the order of rows" in describe(told)
    recorded = read_campaign(put(tmp_path / "recorded", add(ordered, approach__lift="1 1 1")))
    assert (recorded.derived, "approach.slide" in recorded.covariates) == ((), False)
    assert read_campaign(put(tmp_path / "no order")).derived == ()
    file = put(tmp_path / "unknown", ordered) / "campaign.toml"
    file.write_text(file.read_text().replace("[robot]", '[robot]\nmoves = "unknown"'))
    unknown = read_campaign(file)
    assert not any(name.startswith("approach.") for name in unknown.covariates)
    assert (unknown.derived, unknown.settings.moves) == ((), "unknown")


@pytest.mark.parametrize(
    ("cells", "read_as"), [("0 1 0 1", [0, 1, 2, 3]), ("2 3 0 1", [2, 3, 0, 1]), ("7 7 8 8", [7, 7, 8, 8])]
)
def test_an_order_that_starts_anew_is_no_clock(tmp_path, cells, read_as):
    campaign = read_campaign(put(tmp_path / "c", add(ROWS + "20,20,30,40,990,0,500\n", order=cells)))
    assert campaign.covariates["order"].tolist() == read_as
    assert any("starts anew" in warning for warning in campaign.warnings) == (cells == "0 1 0 1")


def test_the_noise_of_each_row_takes_the_place_of_that_of_all(tmp_path: Path) -> None:
    campaign = read(tmp_path, table=with_column("noise", "0.03", "0.04", "0.05"))
    np.testing.assert_allclose(campaign.noise_of_rows, [3e-5, 4e-5, 5e-5], rtol=1e-12)
    assert campaign.noise_position == pytest.approx(np.sqrt(50.0 / 3.0) * 1e-5)
    assert "noise" not in campaign.covariates
    table, stated = with_column("noise", "0.03", "", "0.05"), "position = 0.02"
    np.testing.assert_allclose(read(tmp_path, table=table).noise_of_rows, [3e-5, 2e-5, 5e-5], rtol=1e-12)
    error = refusal(tmp_path, table=table, toml=PLAIN_TOML.replace(stated, ""))
    assert (error.row, error.column, error.found) == (3, "noise", "an empty cell")
    assert "[noise] position for the rows without one" in str(error)
    empty = read(tmp_path, table=with_column("noise", "", "", ""))
    assert (empty.noise_of_rows, empty.noise_position) == (None, pytest.approx(2e-5))
    assert "column 'noise' is empty and counts as absent" in " ".join(empty.warnings)


HELD, LINE = "the previous row's value held", "interpolated between rows"


@pytest.mark.parametrize(
    ("name", "cells", "filled", "words"),
    [
        ("approach__lift", "1 _ -1 _", [1, 0, -1, 0], "taken as 0"),
        ("velocity__slide", "_ 1000 1000 1000", [0, 1, 1, 1], "taken as 0"),
        ("acceleration__slide", "2000 _ 1000 1000", [2, 0, 1, 1], "taken as 0"),
        ("payload", "_ 5 _ 3", [5, 5, 5, 3], HELD),
        ("speed", "0.5 _ _ 1", [0.5, 0.5, 0.5, 1], HELD),
        ("time", "0 _ _ 30", [0, 10, 20, 30], LINE),
        ("order", "_ 1 2 3", [1, 1, 2, 3], LINE),
        ("temperature", "20 _ 22 _", [20, 21, 22, 22], LINE),
        ("temperature__beam", "20 nan 22 NA", [20, 21, 22, 22], LINE),
        ("torque__lift", "_ 4 _ 8", [4, 4, 6, 8], LINE),
        ("encoder__slide", "1000 _ 3000 null", [1, 2, 3, 3], LINE),
        ("humidity", "40 _ 44 44", [40, 42, 44, 44], LINE),
    ],
)
def test_gaps_are_filled_once_and_said(tmp_path, name, cells, filled, words):
    campaign = read_campaign(put(tmp_path / "c", add(ROWS + "20,20,30,40,990,0,500\n", **{name: cells})))
    column = name.replace("__", ".")
    np.testing.assert_allclose(campaign.covariates[column], filled)
    count = sum(cell in ("_", "nan", "NA", "null") for cell in cells.split())
    assert list(campaign.missing) == [column]
    assert campaign.missing[column].sum() == count
    assert campaign.warnings == (f"column {column!r} is empty in {count} of 4 rows: {words}",)


@pytest.mark.parametrize("column", ["approach.lift", "velocity.lift", "payload", "speed", "temperature", "torque.lift"])
def test_what_is_there_stays_and_gaps_are_filled_in_the_sequence_of_measurement(column):
    rng = np.random.default_rng(5)
    clock, values = np.sort(rng.uniform(0, 100, 30)), rng.uniform(1, 2, 30)
    values[[0, 3, 4, 5, 17, 29]] = np.nan
    there, shuffled = ~np.isnan(values), rng.permutation(30)
    filled, how = fill(column, values, clock)
    np.testing.assert_array_equal(fill(column, values[shuffled], clock[shuffled])[0], filled[shuffled])
    np.testing.assert_array_equal(filled[there], values[there])
    np.testing.assert_array_equal(fill(column, filled)[0], filled)
    inside = filled[~there]
    assert np.all((inside == 0) | ((inside >= values[there].min()) & (inside <= values[there].max())))
    assert "row" not in how
    between, _ = fill("temperature", np.array([20.0, np.nan, 30.0]), np.array([0.0, 9.0, 10.0]))
    assert between[1] == pytest.approx(29.0)


def test_a_campaign_from_a_frame_is_that_from_files(robot: Robot) -> None:
    from io import StringIO

    frame, campaign = pd.read_csv(StringIO(FULL)), full()
    other = campaign_from_table(
        robot, frame, angle_unit="deg", length_unit="mm", tool="known", target=[1, 2, 80], noise_position=0.02,
        noise_orientation=3e-5, payload_com=[0, 0, 50], reference_temperature=22.5, priors={"joint_offset": 1e-3},
        gears={"lift": 101}, name="c",
    )  # fmt: skip
    assert other.settings.to_dict() | {"urdf": ""} == campaign.settings.to_dict() | {"urdf": ""}
    for name, values in campaign.covariates.items():
        np.testing.assert_allclose(other.covariates[name], values, rtol=1e-15)
    assert other.labels["pose"].tolist() == ["1", "2", "3"]
    np.testing.assert_allclose(other.orientation, campaign.orientation)
    assert other.rows.tolist() == [0, 1, 2]
    none = campaign_from_table(robot, frame, angle_unit="deg", tool="known", noise_position=0.0, noise_orientation=0.0)
    assert (none.noise_position, none.noise_orientation) == (None, None)
    frame = frame.iloc[[2, 0, 1]]
    assert campaign_from_table(robot, frame, angle_unit="deg", tool="known").rows.tolist() == [2, 0, 1]
    frame.index = pd.Index(["a", "b", "c"])
    assert campaign_from_table(robot, frame, angle_unit="deg", tool="known").rows.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("arguments", "column", "words"),
    [
        ({"angle_unit": "grad"}, "angle_unit", '"rad" or "deg"'),
        ({"base": "floor"}, "base", '"unknown" or "known"'),
        ({"gears": {"left": 3}}, "gears.left", "did you mean 'lift'"),
        ({"base": np.array(["known", "known"])}, "base", '"unknown" or "known"'),
        ({"tool": pd.NA}, "tool", '"unknown" or "known"'),
        ({"noise_position": 1j}, "noise_position", "finite number"),
        ({"target": [0, None, 0]}, "target", "three numbers"),
        ({"reference_temperature": math.nan}, "reference_temperature", "found NaN, expected a number of °C"),
        ({"priors": ["drift"]}, "priors", "values by name"),
        ({"name": 7}, "name", "expected text"),
        ({"measured": "yes"}, "measured", "true or false"),
    ],
)
def test_arguments_are_checked(robot: Robot, arguments: dict[str, object], column: str, words: str) -> None:
    with pytest.raises(CampaignError, match=words) as caught:
        campaign_from_table(robot, pd.DataFrame(), **arguments)
    assert (caught.value.file, caught.value.column) == ("<table>", column)


def test_cells_of_a_frame_are_checked_and_samples_need_no_position(robot: Robot) -> None:
    frame = pd.DataFrame({"turn": [0.1, None], "lift": 0.1, "slide": 0.1, "roll": 0.1})
    with pytest.raises(CampaignError, match="row 1, column 'turn': a value is missing; found an empty cell"):
        campaign_from_table(robot, frame.assign(x=1, y=1, z=1), base="known", tool="known")
    assert campaign_from_table(robot, frame.iloc[:1], measured=False).position is None
    with pytest.raises(CampaignError, match="column 'x'"):
        campaign_from_table(robot, frame.iloc[:1])


# ---- what check prints


BARE = TOML.split("[noise]")[0].replace('tool = "known"', 'tool = "unknown"') + '[about]\nrobot_serial = "7"\n'
SESSIONS = "".join(f"{i},20,30,40,{1000 + i},0,500,day {i:02d}\n" for i in range(12))
# table, campaign.toml, what is changed, and what is said, however many blanks stand between the words
DESCRIBED = {
    "all": (FULL, TOML, {}, """Campaign hall_3
        robot                  arm, chain from base to tool, 4 movable joints
        lengths hold at        22.5 °C
        measurements           3, position and orientation, in mm
        base frame unknown: measured in the instrument's own frame, place and direction are fitted
        target                 known: (1, 2, 80) mm on tool
        noise of position      0.02 mm per axis (one sigma)
        noise of orientation   3e-05 rad per axis (one sigma)
        time                                           0 .. 3          s          none
        temperature                                    20.1 .. 21.3    °C         none
        temperature.beam                               20 .. 22        °C         none
        payload                                        0 .. 5          kg         none
        velocity           lift                        10 .. 30        deg/s      none
        velocity           slide                       10 .. 30        mm/s       none
        acceleration       roll                        1 .. 3          deg/s²     none
        torque             lift                        1.5 .. 3.5      N·m        none
        encoder            slide                       30.1 .. 90.1    mm         none
        speed                                          0.1 .. 1        0..1       none
        humidity           not defined by the format   40 .. 43        as given   none
        sessions             2: a (2 rows), b (1 row)
        Warnings none"""),
    "little": (ROWS + ROWS.splitlines()[1] + "\n", BARE, {}, """noise of position not given: estimated from the data
        target unknown: fitted, starting from (1, 2, 80) mm on tool
        about robot serial 7
        Conditions recorded none not recorded: time, order, temperature, payload
        identical commands 1 pose repeated, 2 rows in all
        no label: taken as one run"""),
    "gaps": (add(ROWS, payload="1 _ 1", temperature="290 291 292"), TOML, {}, """payload 1, does not vary kg 1 filled
        - column 'payload' is empty in 1 of 3 rows: the previous row's value held
        are these kelvin?"""),
    "samples": (FULL, TOML, {"position": None, "orientation": None}, "samples 3, to be predicted"),
    "other units": (FULL, TOML, {"units": Units("rad", "um")}, """slide prismatic 30000 .. 90000 0 .. 500000 um 12 %
        lift revolute -0.785398 .. 0.349066 -2 .. 2 rad 28 %"""),
    "sessions": (f"{ROWS.splitlines()[0]},session\n{SESSIONS}", TOML, {}, """12: day 00 (1 row)
        day 07 (1 row) and 4 more"""),
    "noise of rows": (add(ROWS, noise="0.02 0.5 0.03"), TOML, {},
                      "noise of position 0.02 .. 0.5 mm per axis (one sigma), of each row"),
}  # fmt: skip


@pytest.mark.parametrize("case", DESCRIBED)
def test_a_description_says_what_a_metrologist_asks(tmp_path: Path, case: str) -> None:
    table, toml, changes, lines = DESCRIBED[case]
    campaign = dataclasses.replace(read_campaign(put(tmp_path / "hall_3", table, toml)), **changes)
    text = " ".join(describe(campaign).split())
    for line in lines.splitlines():
        assert " ".join(line.split()) in text, f"{line!r} is not in\n{text}"


def test_columns_of_a_description_are_aligned() -> None:
    lines = describe(full()).split("Joints\n")[1].splitlines()
    assert lines[2] == "  lift    revolute     -45 .. 20    -114.592 .. 114.592   deg    28 %"
    assert lines[4] == "  roll    continuous   -40 .. 400   none                  deg"
