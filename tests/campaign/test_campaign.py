"""A campaign as a value, its journey from and to files, and its description."""

from __future__ import annotations

import json
import math
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from thermal_robot.campaign import (
    Campaign,
    Settings,
    Units,
    campaign_from_table,
    describe,
    read_campaign,
    read_samples,
    write_campaign,
    write_predictions,
    write_table,
)
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot

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

TOML = """
[robot]
urdf = "robot.urdf"
tool_frame = "tool"
reference_temperature = 22.5
[measurements]
file = "measurements.csv"
angle_unit = "{angle}"
length_unit = "{length}"
[frames]
base = "unknown"
tool = "known"
target = [1.0, 2, 80.0]
[noise]
position = 0.02
orientation = 3e-5
[payload]
com = [0.0, 0.0, 50.0]
[priors]
joint_offset = 1e-3
[gears]
lift = 101
"""

ROWS = """turn,lift,slide,roll,x,y,z
10,20,30,40,1000,0,500
-10,15,60,400,900,100,510
50,-45,90,-40,800,200,520
"""


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return load_robot(URDF, "tool")


def put(folder: Path, table: str | bytes = ROWS, *, angle: str = "deg", length: str = "mm") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "robot.urdf").write_text(URDF)
    (folder / "campaign.toml").write_text(TOML.format(angle=angle, length=length))
    (folder / "measurements.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    return folder


def add(table: str, **columns: str) -> str:
    """Append columns, their cells separated by blanks, '_' for an empty one and '.' in a name for '__'."""
    lines = table.strip().splitlines()
    for name, cells in columns.items():
        parts = [name.replace("__", "."), *("" if cell == "_" else cell for cell in cells.split())]
        lines = [f"{line},{part}" for line, part in zip(lines, parts, strict=True)]
    return "\n".join(lines) + "\n"


def full(folder: Path) -> Campaign:
    """A campaign that has every kind of column."""
    table = add(
        ROWS,
        qw="1 0 0.6",
        qx="0 -1 0",
        qy="0 0 0.8",
        qz="0 0 0",
        time="0 1.5 3",
        temperature="20.1 20.7 21.3",
        temperature__beam="20 21 22",
        payload="0 5 5",
        approach__lift="1 -1 0",
        approach__slide="1 1 -1",
        velocity__lift="10 20 30",
        velocity__slide="10 20 30",
        acceleration__roll="1 2 3",
        torque__lift="1.5 2.5 3.5",
        encoder__lift="20.1 15.1 -44.9",
        encoder__slide="30.1 60.1 90.1",
        speed="0.1 0.5 1",
        order="3 1 2",
        humidity="40 41 43",
        session="a a b",
        pose="1 2 3",
        sim__x="1000 900 800",
        sim__y="0 100 200",
        sim__z="500 510 520",
        sim__qw="1 1 1",
        sim__qx="0 0 0",
        sim__qy="0 0 0",
        sim__qz="0 0 0",
    )
    return read_campaign(put(folder, table))


class TestReading:
    def test_units_become_si_once(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "hall_3")
        degree = math.pi / 180
        np.testing.assert_allclose(campaign.q[0], [10 * degree, 20 * degree, 0.030, 40 * degree], rtol=1e-15)
        np.testing.assert_allclose(campaign.position[1], [0.9, 0.1, 0.51])
        np.testing.assert_allclose(campaign.simulated_position[2], [0.8, 0.2, 0.52])
        np.testing.assert_allclose(campaign.target, [1e-3, 2e-3, 80e-3])
        np.testing.assert_allclose(campaign.payload_com, [0, 0, 0.05])
        assert campaign.noise_position == pytest.approx(2e-5)
        assert campaign.noise_orientation == 3e-5
        expected = {
            "time": [0, 1.5, 3],
            "temperature": [20.1, 20.7, 21.3],
            "temperature.beam": [20, 21, 22],
            "payload": [0, 5, 5],
            "approach.lift": [1, -1, 0],
            "approach.slide": [1, 1, -1],
            "velocity.lift": [10 * degree, 20 * degree, 30 * degree],
            "velocity.slide": [0.01, 0.02, 0.03],
            "acceleration.roll": [degree, 2 * degree, 3 * degree],
            "torque.lift": [1.5, 2.5, 3.5],
            "encoder.lift": [20.1 * degree, 15.1 * degree, -44.9 * degree],
            "encoder.slide": [0.0301, 0.0601, 0.0901],
            "speed": [0.1, 0.5, 1],
            "order": [3, 1, 2],
            "humidity": [40, 41, 43],
        }
        assert set(campaign.covariates) == set(expected)
        for name, values in expected.items():
            np.testing.assert_allclose(campaign.covariates[name], values, err_msg=name)

    def test_everything_else(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "hall_3")
        assert campaign.name == "hall_3"
        assert (campaign.samples, campaign.measures) == (3, "pose")
        assert (campaign.base_known, campaign.tool_known) == (False, True)
        assert campaign.reference_temperature == 22.5
        assert campaign.priors == {"joint_offset": 1e-3}
        assert campaign.gears == {"lift": 101.0}
        assert campaign.extra == ("humidity",)
        assert campaign.labels["session"].tolist() == ["a", "a", "b"]
        assert campaign.labels["pose"].tolist() == ["1", "2", "3"]
        assert campaign.rows.tolist() == [2, 3, 4]
        assert campaign.units == Units("deg", "mm")
        assert campaign.urdf == "robot.urdf"
        np.testing.assert_allclose(campaign.orientation[2], [0.6, 0, 0.8, 0])
        np.testing.assert_allclose(campaign.simulated_orientation, [[1, 0, 0, 0]] * 3)
        assert campaign.warnings == ()

    def test_path_of_file_or_directory_gives_the_same(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        folder = put(tmp_path / "cell")
        by_file, by_folder = read_campaign(folder / "campaign.toml"), read_campaign(str(folder))
        monkeypatch.chdir(folder)
        here = read_campaign(".")
        assert by_file.name == by_folder.name == here.name == "cell"
        np.testing.assert_array_equal(by_file.q, here.q)

    def test_a_file_of_another_name_names_the_campaign(self, tmp_path: Path) -> None:
        folder = put(tmp_path / "cell")
        (folder / "campaign.toml").rename(folder / "monday.toml")
        assert read_campaign(folder / "monday.toml").name == "monday"

    def test_quaternions_are_normalised(self, tmp_path: Path) -> None:
        table = add(ROWS, qw="1.05 0 0", qx="0 0.95 0", qy="0 0 -1", qz="0 0 0")
        campaign = read_campaign(put(tmp_path / "c", table))
        np.testing.assert_allclose(np.linalg.norm(campaign.orientation, axis=1), 1, rtol=1e-15)

    def test_noise_of_zero_is_not_given(self, tmp_path: Path) -> None:
        folder = put(tmp_path / "c")
        file = folder / "campaign.toml"
        file.write_text(file.read_text().replace("0.02", "0").replace("3e-5", "0.0"))
        campaign = read_campaign(folder)
        assert campaign.noise_position is None
        assert campaign.noise_orientation is None

    def test_a_builtin_robot_is_not_a_path(self, tmp_path: Path) -> None:
        builtin = load_robot("builtin:rv_m2", _last_link("builtin:rv_m2"))
        table = pd.DataFrame(np.random.default_rng(0).uniform(-0.5, 0.5, (9, builtin.n)), columns=builtin.joint_names)
        table[["x", "y", "z"]] = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 3))
        table.to_csv(tmp_path / "t.csv", index=False)
        (tmp_path / "campaign.toml").write_text(
            f'[robot]\nurdf = "builtin:rv_m2"\ntool_frame = "{builtin.tool_frame}"\n'
            '[measurements]\nfile = "t.csv"\nangle_unit = "rad"\nlength_unit = "m"\n'
        )
        assert read_campaign(tmp_path).robot.joint_names == builtin.joint_names

    def test_pandas_is_not_loaded_for_csv(self, tmp_path: Path) -> None:
        folder = put(tmp_path / "c")
        code = (
            "import sys; from thermal_robot.campaign import read_campaign; "
            "read_campaign(sys.argv[1]); print('pandas' in sys.modules)"
        )
        command = [sys.executable, "-c", code, str(folder)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "False"


def _last_link(urdf: str) -> str:
    from thermal_robot.errors import RobotError

    with pytest.raises(RobotError) as caught:
        load_robot(urdf, "")
    return caught.value.candidates[-1]


SEMICOLONS = ROWS.replace(",", ";").replace("1000", "1000,25")


class TestDialects:
    @pytest.mark.parametrize(
        "data",
        [
            pytest.param(b"\xef\xbb\xbf" + ROWS.encode(), id="byte-order mark"),
            pytest.param(ROWS.replace("\n", "\r\n").encode(), id="Windows line ends"),
            pytest.param(ROWS.replace("\n", "\r").encode(), id="old Mac line ends"),
            pytest.param(ROWS.replace(",", "\t").encode(), id="tabs"),
            pytest.param(ROWS.replace(",", ";").encode(), id="semicolons"),
            pytest.param(ROWS.replace(",", " , ").encode(), id="blanks around everything"),
            pytest.param(ROWS.replace("\n", ",\n").encode(), id="separator at the end of each line"),
            pytest.param((ROWS + "\n,,,,,,\n\n").encode(), id="empty lines at the end"),
            pytest.param(ROWS.replace("x", '"x"').encode(), id="quotes"),
            pytest.param(ROWS.replace("-", "−").encode(), id="typographic minus"),
            pytest.param(ROWS.encode("utf-16"), id="UTF-16"),
        ],
    )
    def test_same_numbers(self, tmp_path: Path, data: bytes) -> None:
        plain, other = read_campaign(put(tmp_path / "a")), read_campaign(put(tmp_path / "b", data))
        np.testing.assert_array_equal(plain.q, other.q)
        np.testing.assert_array_equal(plain.position, other.position)
        assert other.warnings == ()

    @pytest.mark.parametrize("separator", [";", "\t"])
    def test_decimal_commas(self, tmp_path: Path, separator: str) -> None:
        campaign = read_campaign(put(tmp_path / "c", SEMICOLONS.replace(";", separator)))
        assert campaign.position[0, 0] == pytest.approx(1.00025)

    def test_labels_keep_their_commas(self, tmp_path: Path) -> None:
        table = ROWS.replace(",", ";").replace("z", "z;session", 1)
        table = table.replace("500\n", "500.5;1,5\n").replace("510\n", "510;b\n").replace("520\n", "520;\n")
        campaign = read_campaign(put(tmp_path / "c", table))
        assert campaign.labels["session"].tolist() == ["1,5", "b", ""]
        assert campaign.position[0, 2] == pytest.approx(0.5005)

    def test_rows_are_counted_as_an_editor_does(self, tmp_path: Path) -> None:
        assert read_campaign(put(tmp_path / "c", ROWS.replace("\n-10", "\n\n-10"))).rows.tolist() == [2, 4, 5]

    def test_a_label_over_two_lines_does_not_shift_the_count(self, tmp_path: Path) -> None:
        table = ROWS.replace("z\n", "z,session\n").replace("500\n", '500,"two\nlines"\n')
        table = table.replace("510\n", "510,b\n").replace("520\n", "520,c\n")
        assert read_campaign(put(tmp_path / "c", table)).rows.tolist() == [2, 4, 5]

    def test_windows_code_page_is_accepted_with_a_warning(self, tmp_path: Path) -> None:
        campaign = read_campaign(put(tmp_path / "c", add(ROWS, session="früh spät spät").encode("cp1252")))
        assert campaign.labels["session"].tolist() == ["früh", "spät", "spät"]
        assert "Windows-1252" in campaign.warnings[0]

    @pytest.mark.parametrize("ending", ["parquet", "pq"])
    def test_parquet(self, tmp_path: Path, ending: str) -> None:
        pytest.importorskip("pyarrow")
        folder = put(tmp_path / "c")
        plain = read_campaign(folder)
        frame = pd.read_csv(folder / "measurements.csv").set_index("turn")
        frame.to_parquet(folder / f"measurements.{ending}")
        file = folder / "campaign.toml"
        file.write_text(file.read_text().replace("measurements.csv", f"measurements.{ending}"))
        campaign = read_campaign(folder)
        np.testing.assert_array_equal(plain.q, campaign.q)
        assert campaign.rows.tolist() == [2, 3, 4]


class TestGaps:
    @pytest.mark.parametrize(
        ("name", "cells", "filled", "words"),
        [
            ("approach__lift", "1 _ -1 _", [1, 0, -1, 0], "taken as 0"),
            ("velocity__slide", "_ 1000 1000 1000", [0, 1, 1, 1], "taken as 0"),
            ("acceleration__slide", "2000 _ 1000 1000", [2, 0, 1, 1], "taken as 0"),
            ("payload", "_ 5 _ 3", [5, 5, 5, 3], "previous row's value held"),
            ("speed", "0.5 _ _ 1", [0.5, 0.5, 0.5, 1], "previous row's value held"),
            ("time", "0 _ _ 30", [0, 10, 20, 30], "interpolated between rows"),
            ("order", "_ 1 2 3", [1, 1, 2, 3], "interpolated between rows"),
            ("temperature", "20 _ 22 _", [20, 21, 22, 22], "interpolated between rows"),
            ("temperature__beam", "20 nan 22 NA", [20, 21, 22, 22], "interpolated between rows"),
            ("torque__lift", "_ 4 _ 8", [4, 4, 6, 8], "interpolated between rows"),
            ("encoder__slide", "1000 _ 3000 null", [1, 2, 3, 3], "interpolated between rows"),
            ("humidity", "40 _ 44 44", [40, 42, 44, 44], "interpolated between rows"),
        ],
    )
    def test_filled_once_and_said(self, tmp_path: Path, name: str, cells: str, filled: list[float], words: str) -> None:
        campaign = read_campaign(put(tmp_path / "c", add(ROWS + "20,20,30,40,990,0,500\n", **{name: cells})))
        column = name.replace("__", ".")
        np.testing.assert_allclose(campaign.covariates[column], filled)
        count = sum(cell in ("_", "nan", "NA", "null") for cell in cells.split())
        assert campaign.missing[column].sum() == count
        assert campaign.warnings == (f"column {column!r} is empty in {count} of 4 rows: " + _how(words),)

    def test_an_empty_column_counts_as_absent(self, tmp_path: Path) -> None:
        campaign = read_campaign(put(tmp_path / "c", add(ROWS, temperature="_ _ nan", payload="1 1 1")))
        assert set(campaign.covariates) == {"payload"}
        assert campaign.warnings == ("column 'temperature' is empty and counts as absent",)

    def test_empty_labels(self, tmp_path: Path) -> None:
        campaign = read_campaign(put(tmp_path / "c", add(ROWS, session="a _ b")))
        assert campaign.labels["session"].tolist() == ["a", "", "b"]


def _how(words: str) -> str:
    return f"the {words}" if words.startswith("previous") else words


class TestSamples:
    def test_measured_columns_need_not_be_there(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        (tmp_path / "fresh.csv").write_text("lift,turn,roll,slide,temperature\n20,10,40,30,25\n")
        samples = read_samples(tmp_path / "fresh.csv", campaign)
        assert samples.name == "fresh"
        assert samples.position is None
        assert samples.orientation is None
        np.testing.assert_allclose(samples.q, campaign.q[:1])
        assert samples.covariates["temperature"].tolist() == [25.0]
        assert samples.target.tolist() == campaign.target.tolist()

    def test_measured_columns_are_ignored(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        (tmp_path / "fresh.csv").write_text("lift,turn,roll,slide,x,qw\n20,10,40,30,far away,0\n")
        assert read_samples(tmp_path / "fresh.csv", campaign).position is None

    def test_settings_do_as_well(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        stored = json.loads(json.dumps(campaign.settings.to_dict()))
        settings = Settings.from_dict(stored)
        assert settings == campaign.settings
        samples = read_samples(tmp_path / "c" / "measurements.csv", settings, campaign.robot)
        np.testing.assert_array_equal(samples.q, campaign.q)
        with pytest.raises(TypeError, match="robot"):
            read_samples(tmp_path / "c" / "measurements.csv", settings)

    def test_a_joint_is_still_needed(self, tmp_path: Path) -> None:
        (tmp_path / "fresh.csv").write_text("turn,roll,slide\n10,40,30\n")
        with pytest.raises(CampaignError) as caught:
            read_samples(tmp_path / "fresh.csv", full(tmp_path / "c"))
        assert (caught.value.row, caught.value.column) == (1, "lift")


class TestFromTable:
    def test_same_as_from_files(self, tmp_path: Path, robot: Robot) -> None:
        campaign = full(tmp_path / "c")
        frame = pd.read_csv(tmp_path / "c" / "measurements.csv")
        other = campaign_from_table(
            robot,
            frame,
            angle_unit="deg",
            length_unit="mm",
            tool="known",
            target=[1, 2, 80],
            noise_position=0.02,
            noise_orientation=3e-5,
            payload_com=[0, 0, 50],
            reference_temperature=22.5,
            priors={"joint_offset": 1e-3},
            gears={"lift": 101},
            name="c",
        )
        assert other.settings.to_dict() | {"urdf": ""} == campaign.settings.to_dict() | {"urdf": ""}
        assert other.rows.tolist() == [0, 1, 2]
        for name, values in campaign.covariates.items():
            np.testing.assert_allclose(other.covariates[name], values, rtol=1e-15)
        assert other.labels["pose"].tolist() == ["1", "2", "3"]
        np.testing.assert_allclose(other.orientation, campaign.orientation)

    def test_rows_are_those_of_the_index(self, robot: Robot, tmp_path: Path) -> None:
        frame = pd.read_csv(put(tmp_path / "c") / "measurements.csv").iloc[[2, 0, 1]]
        assert campaign_from_table(robot, frame, angle_unit="deg", tool="known").rows.tolist() == [2, 0, 1]
        frame.index = pd.Index(["a", "b", "c"])
        assert campaign_from_table(robot, frame, angle_unit="deg", tool="known").rows.tolist() == [0, 1, 2]

    @pytest.mark.parametrize(
        ("arguments", "column", "words"),
        [
            ({"angle_unit": "grad"}, "angle_unit", '"rad" or "deg"'),
            ({"length_unit": "inch"}, "length_unit", '"m" or "mm" or "um"'),
            ({"base": "floor"}, "base", '"known" or "unknown"'),
            ({"noise_position": -1}, "noise_position", "negative"),
            ({"noise_orientation": math.inf}, "noise_orientation", "finite"),
            ({"target": [1, 2]}, "target", "three numbers"),
            ({"priors": {"drift": 0}}, "priors.drift", "positive"),
            ({"gears": {"left": 3}}, "gears.left", "did you mean 'lift'"),
        ],
    )
    def test_arguments_are_checked(self, robot: Robot, arguments: dict[str, object], column: str, words: str) -> None:
        with pytest.raises(CampaignError, match=words) as caught:
            campaign_from_table(robot, pd.DataFrame(), **arguments)
        assert (caught.value.file, caught.value.column) == ("<table>", column)

    def test_cells_are_checked(self, robot: Robot) -> None:
        frame = pd.DataFrame({"turn": [0.1, None], "lift": 0.1, "slide": 0.1, "roll": 0.1, "x": 1, "y": 1, "z": 1})
        with pytest.raises(CampaignError) as caught:
            campaign_from_table(robot, frame, base="known", tool="known")
        assert (caught.value.row, caught.value.column, caught.value.found) == (1, "turn", "an empty cell")


class TestValue:
    def test_arrays_are_read_only(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        arrays = [
            campaign.q,
            campaign.position,
            campaign.target,
            campaign.rows,
            *campaign.covariates.values(),
        ]
        for array in [*arrays, *campaign.labels.values(), campaign.take([0]).q]:
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0

    def test_the_callers_array_stays_writable(self, robot: Robot) -> None:
        q = np.zeros((2, 4))
        campaign = Campaign("mine", robot, q, np.zeros((2, 3)))
        q[0, 0] = 1.0
        assert campaign.q[0, 0] == 0.0
        assert campaign.rows.tolist() == [2, 3]

    def test_shapes_are_checked(self, robot: Robot) -> None:
        with pytest.raises(CampaignError, match=r"<mine>, column 'position'.*found \(2, 2\), expected \(2, 3\)"):
            Campaign("mine", robot, np.zeros((2, 4)), np.zeros((2, 2)))

    @pytest.mark.parametrize("rows", [[2, 0], np.array([True, False, True]), []])
    def test_take(self, tmp_path: Path, rows: object) -> None:
        campaign = full(tmp_path / "c")
        part = campaign.take(rows)
        index = np.arange(3)[np.asarray(rows, dtype=bool if len(rows) == 3 else int)]
        np.testing.assert_array_equal(part.q, campaign.q[index])
        np.testing.assert_array_equal(part.orientation, campaign.orientation[index])
        np.testing.assert_array_equal(part.covariates["temperature"], campaign.covariates["temperature"][index])
        np.testing.assert_array_equal(part.labels["session"], campaign.labels["session"][index])
        np.testing.assert_array_equal(part.rows, campaign.rows[index])
        assert part.samples == len(index)
        assert part.settings == campaign.settings

    def test_drop_covariate(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        less = campaign.drop_covariate("humidity").drop_covariate("time").drop_covariate("session")
        assert {"humidity", "time"}.isdisjoint(less.covariates)
        assert less.extra == ()
        assert set(less.labels) == {"pose"}
        assert "time" in campaign.covariates
        with pytest.raises(CampaignError, match="no such covariate"):
            less.drop_covariate("time")

    def test_pickles(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        again = pickle.loads(pickle.dumps(campaign))
        np.testing.assert_array_equal(again.q, campaign.q)
        assert again.settings == campaign.settings

    def test_repr_is_one_line(self, tmp_path: Path) -> None:
        assert repr(full(tmp_path / "c")) == "<Campaign 'c': 3 samples of pose, 4 joints, 15 covariates>"

    @pytest.mark.parametrize("change", [{"tool_frame": None}, {"nonsense": 1}])
    def test_settings_refuse_other_keys(self, tmp_path: Path, change: dict[str, object]) -> None:
        data = full(tmp_path / "c").settings.to_dict() | change
        if None in change.values():
            del data["tool_frame"]
        with pytest.raises(CampaignError) as caught:
            Settings.from_dict(data, "model.json")
        assert (caught.value.file, caught.value.column) == ("model.json", next(iter(change)))

    def test_settings_refuse_other_values(self, tmp_path: Path) -> None:
        data = full(tmp_path / "c").settings.to_dict() | {"target": [1.0, 2.0]}
        with pytest.raises(CampaignError, match=r"model\.json: settings cannot be read"):
            Settings.from_dict(data, "model.json")


class TestWriting:
    @pytest.mark.parametrize(("angle", "length"), [("deg", "mm"), ("rad", "m"), ("deg", "um")])
    def test_reading_again_gives_the_same(self, tmp_path: Path, angle: str, length: str) -> None:
        import dataclasses

        campaign = dataclasses.replace(full(tmp_path / "c"), units=Units(angle, length), name="copy")
        again = read_campaign(write_campaign(campaign, tmp_path / "copy"))
        for name in ("q", "position", "orientation", "simulated_position", "simulated_orientation", "target"):
            np.testing.assert_allclose(getattr(again, name), getattr(campaign, name), rtol=1e-12, err_msg=name)
        assert list(again.covariates) == list(campaign.covariates)
        for name, values in campaign.covariates.items():
            np.testing.assert_allclose(again.covariates[name], values, rtol=1e-12, err_msg=name)
        for name, labels in campaign.labels.items():
            assert again.labels[name].tolist() == labels.tolist()
        assert again.extra == campaign.extra
        assert again.name == "copy"
        assert again.robot.joint_names == campaign.robot.joint_names
        for name, value in campaign.settings.to_dict().items():
            assert again.settings.to_dict()[name] == (
                pytest.approx(value, rel=1e-12) if isinstance(value, (float, list)) else value
            )

    def test_samples_are_no_campaign_but_have_a_table(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        samples = read_samples(tmp_path / "c" / "measurements.csv", campaign)
        with pytest.raises(CampaignError, match="without measured positions"):
            write_campaign(samples, tmp_path / "copy")
        write_table(samples, tmp_path / "fresh.csv")
        again = read_samples(tmp_path / "fresh.csv", campaign)
        np.testing.assert_allclose(again.q, samples.q, rtol=1e-12)

    def test_predictions(self, tmp_path: Path) -> None:
        file = tmp_path / "predicted.csv"
        write_predictions(file, [[1.0, 0.1, -0.25], [0, 0, 1]], None, Units("rad", "mm"))
        frame = pd.read_csv(file)
        assert list(frame.columns) == ["x", "y", "z"]
        np.testing.assert_allclose(frame, [[1000, 100, -250], [0, 0, 1000]], rtol=1e-15)
        write_predictions(file, [[1.0, 0.1, -0.25]], [[1, 0, 0, 0]], Units("rad", "um"))
        frame = pd.read_csv(file)
        assert list(frame.columns) == ["x", "y", "z", "qw", "qx", "qy", "qz"]
        np.testing.assert_allclose(frame, [[1e6, 1e5, -2.5e5, 1, 0, 0, 0]], rtol=1e-15)

    def test_a_place_that_cannot_be_written(self, tmp_path: Path) -> None:
        with pytest.raises(CampaignError, match="cannot be written: No such file or directory"):
            write_predictions(tmp_path / "nowhere" / "p.csv", [[0, 0, 0]], None, Units())
        (tmp_path / "taken").write_text("")
        with pytest.raises(CampaignError, match="cannot be written"):
            write_campaign(full(tmp_path / "c"), tmp_path / "taken")


class TestDescription:
    def test_says_what_a_metrologist_asks(self, tmp_path: Path) -> None:
        text = _squeezed(describe(full(tmp_path / "hall_3")))
        for line in (
            "Campaign hall_3",
            "robot                  arm, chain from base to tool, 4 movable joints",
            "lengths hold at        22.5 °C",
            "measurements           3, position and orientation, in mm",
            "base frame unknown: measured in the instrument's own frame, place and direction are fitted",
            "target                 known: (1, 2, 80) mm on tool",
            "noise of position      0.02 mm per axis (one sigma)",
            "noise of orientation   3e-05 rad per axis (one sigma)",
            "slide   prismatic    30 .. 90     0 .. 500",
            "roll    continuous   -40 .. 400   none",
            "temperature        20.1 .. 21.3",
            "humidity           not defined by the format   40 .. 43",
            "sessions             2: a (2 rows), b (1 row)",
            "Warnings\n  none",
        ):
            assert _squeezed(line) in text, f"{line!r} is not in\n{text}"

    def test_bare_campaign(self, tmp_path: Path) -> None:
        folder = put(tmp_path / "c", ROWS + ROWS.splitlines()[1] + "\n")
        file = folder / "campaign.toml"
        file.write_text(file.read_text().split("[noise]")[0].replace('tool = "known"', 'tool = "unknown"'))
        text = _squeezed(describe(read_campaign(folder)))
        assert "noise of position not given: estimated from the data" in text
        assert "target unknown: fitted, starting from (1, 2, 80) mm on tool" in text
        assert "Conditions recorded\n none\n not recorded: time, order, temperature, payload" in text
        assert "identical commands 1 pose repeated, 2 rows in all" in text
        assert "no label: taken as one run" in text

    def test_gaps_and_warnings(self, tmp_path: Path) -> None:
        table = add(ROWS, payload="1 _ 1", temperature="290 291 292")
        text = _squeezed(describe(read_campaign(put(tmp_path / "c", table))))
        assert "payload 1, does not vary kg 1 filled" in text
        assert " - column 'payload' is empty in 1 of 3 rows: the previous row's value held" in text
        assert "are these kelvin?" in text

    def test_samples(self, tmp_path: Path) -> None:
        campaign = full(tmp_path / "c")
        text = _squeezed(describe(read_samples(tmp_path / "c" / "measurements.csv", campaign)))
        assert "samples 3, to be predicted" in text

    def test_columns_are_aligned(self, tmp_path: Path) -> None:
        lines = describe(full(tmp_path / "c")).split("Joints\n")[1].split("\n\n")[0].splitlines()
        assert len({line.index(cell) for line, cell in zip(lines[1:], ("rev", "rev", "pri", "con"), strict=True)}) == 1


def _squeezed(text: str) -> str:
    return re.sub(" +", " ", text)
