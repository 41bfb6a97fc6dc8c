"""What is accepted but doubtful is said in one sentence, and nothing is said of an ordinary campaign."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from campaign.spoilt import ROWS, TOML, read, with_column
from other_robots import base_moved, lengthened, measured, read_with

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.campaign.plausible import another_unit, doubts
from thermal_robot.kinematics import tool_poses
from thermal_robot.robot import Robot

DOUBTFUL = [
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
    (with_column("pose", "a", "b", "a"), ["same pose label", "different joint commands", "'a'"]),
    (
        ROWS.replace("1000,0", "90000000,0"),
        ["extend over", "m and the arm reaches 1.9 m", 'length_unit = "mm"'],
    ),
]


@pytest.mark.parametrize(("table", "words"), DOUBTFUL)
def test_doubtful(tmp_path: Path, table: str, words: list[str]) -> None:
    warnings = read(tmp_path, table=table).warnings
    fitting = [warning for warning in warnings if all(word in warning for word in words)]
    assert len(fitting) == 1, warnings
    assert not any("\n" in warning for warning in warnings)


def test_joints_without_limits_are_told(tmp_path: Path) -> None:
    campaign = read(tmp_path)
    assert not any("limits" in warning for warning in campaign.warnings)
    file = tmp_path / "robot.urdf"
    file.write_text(file.read_text().replace('<limit lower="-3" upper="3" effort="1" velocity="1"/>', ""))
    told = [warning for warning in read_campaign(tmp_path).warnings if "limits" in warning]
    assert told == ["the URDF gives no limits for 'turn': no command is checked against any there"]


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


@pytest.mark.parametrize(("value", "doubted"), [(149.0, False), (151.0, True)])
def test_kelvin_are_told_from_a_hot_robot(tmp_path: Path, value: float, doubted: bool) -> None:
    table = with_column("temperature.beam", *[str(value)] * 3)
    assert any("kelvin" in warning for warning in read(tmp_path, table=table).warnings) == doubted


@pytest.mark.parametrize(("degrees", "doubted"), [(6.2, True), (6.4, False)])
def test_commands_of_a_few_degrees_are_doubted(tmp_path: Path, degrees: float, doubted: bool) -> None:
    table = ROWS.replace("3.5", str(degrees))
    warnings = read(tmp_path, table=table, toml=TOML.replace('"rad"', '"deg"')).warnings
    assert any('angle_unit = "rad" meant' in warning for warning in warnings) == doubted


@pytest.mark.parametrize(("turns", "doubted"), [(1.99, False), (2.01, True)])
def test_more_than_two_turns_are_doubted(tmp_path: Path, turns: float, doubted: bool) -> None:
    table = ROWS.replace("3.5", f"{-2 * math.pi * turns:.6f}")  # of a joint without limits
    warnings = read(tmp_path, table=table).warnings
    assert any("'roll'" in warning and "two turns" in warning for warning in warnings) == doubted
    assert len(warnings) == doubted


@pytest.mark.parametrize(("scale", "doubted"), [(1.0, False), (1e-3, True), (1e3, True)])
def test_measurements_that_are_far_too_small_or_large(rv_m2: Robot, scale: float, doubted: bool) -> None:
    q = np.random.default_rng(2).uniform(rv_m2.lower, rv_m2.upper, (30, 5))
    campaign = Campaign("c", rv_m2, q, scale * tool_poses(rv_m2, q)[:, :3, 3])
    assert any("the measured positions extend over" in sentence for sentence in doubts(campaign)) == doubted


def test_a_target_on_the_axes_of_the_wrist_may_stay_in_place(rv_m2: Robot) -> None:
    q = np.tile([0.1, 0.5, -1.0, 0.0, 0.0], (30, 1))
    q[:, 2:] += np.random.default_rng(2).uniform(-1, 0, (30, 3))
    assert doubts(Campaign("c", rv_m2, q, np.full((30, 3), 0.3))) == []


def test_labels_of_one_pose_may_differ_by_what_a_controller_repeats(tmp_path: Path) -> None:
    same = ROWS.replace("-0.1,0.3,60,3.5", "0.1005,0.2,30,0.4").replace("0.5,-0.4,90,-0.4", "0.4,-0.4,90,-0.4")
    table = "\n".join(f"{line},{label}" for line, label in zip(same.split(), ("pose", "a", "a", "b"), strict=True))
    rows = table + "\n0.9,-0.4,90,-0.4,800,250,520,4,9,c\n"
    assert read(tmp_path, table=rows).warnings == ()
    assert any("'a'" in w for w in read(tmp_path, table=rows.replace("0.1005", "0.102")).warnings)


@pytest.mark.parametrize(
    ("scale", "said"),
    [
        (1000.0, "the URDF stands in mm: its links are a thousand times too long"),
        (100.0, "the URDF stands in cm: its links are a hundred times too long"),
        (1 / 0.0254, "the URDF stands in inch: its links are 39 times too long"),
        (1e-3, "a thousand times too short"),
    ],
)
def test_a_urdf_in_another_unit_is_told(rv_m2: Robot, scale: float, said: str) -> None:
    scaled = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), scale))
    q = np.random.default_rng(2).uniform(rv_m2.lower, rv_m2.upper, (30, 5))
    (told,) = doubts(Campaign("c", scaled, q, tool_poses(rv_m2, q)[:, :3, 3]))
    assert said in told
    assert another_unit(Campaign("c", rv_m2, q, None)) is None


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_points_farther_apart_than_commands_lead_are_told(rv_m2: Robot, factor: float) -> None:
    sister = lengthened(rv_m2, dict.fromkeys((s.name for s in rv_m2.segments), factor))
    campaign = read_with(measured(sister, 1, lever=0.3, joint_offset=0.05), rv_m2)
    told = [sentence for sentence in doubts(campaign) if "no place of base and target mends that" in sentence]
    assert len(told) == (factor > 1.0)


def test_a_base_that_moved_between_sessions_takes_no_points_apart(rv_m2: Robot) -> None:
    campaign = base_moved(measured(rv_m2, 2), 30, seed=1)
    labelled = replace(campaign, labels={"session": np.repeat(["a", "b"], 30)})
    assert any("unless one was moved" in sentence for sentence in doubts(campaign))
    assert not any("unless one was moved" in sentence for sentence in doubts(labelled))
