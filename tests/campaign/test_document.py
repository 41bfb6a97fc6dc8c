"""TOML: syntax, unknown names and wrong kinds of value are refused with their line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from campaign.spoilt import toml_is_refused

from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.document import Document
from thermal_robot.errors import CampaignError, RobotError
from thermal_robot.robot import load_robot

# what is replaced, by what, row, column, found, words of the sentence
REFUSED = [
    ("[gears]", "[gears", 21, None, None, ["not valid TOML"]),
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
    ("1e-3", "0", 19, "priors.joint_offset", "0", ["expected size of an effect must be positive"]),
    ("1e-3", "-1e-3", 19, "priors.joint_offset", "-0.001", ["must be positive", "a number above 0"]),
    ("1e-3", '"small"', 19, "priors.joint_offset", "'small'", ["wrong kind of value", "a number above 0"]),
]


@pytest.mark.parametrize("refused", REFUSED)
def test_refused(tmp_path: Path, refused: tuple[Any, ...]) -> None:
    toml_is_refused(tmp_path, *refused)


def test_campaign_toml_in_another_encoding(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_bytes('tool = "Gerät"'.encode("latin-1"))
    with pytest.raises(CampaignError, match=r"campaign\.toml: is not UTF-8 text"):
        read_campaign(tmp_path)


def document(folder: Path, text: str) -> Document:
    file = folder / "campaign.toml"
    file.write_text(text, encoding="utf-8")
    return Document(file)


def test_lines_are_found_however_a_key_is_written(tmp_path: Path) -> None:
    text = '# robot\n[ robot ]\n"urdf" = "a.urdf"\n  tool_frame="t"\n\n["gears"]\n\'elbow joint\' = 3\nelbow = 4\n'
    found = document(tmp_path, text)
    assert (found.row("robot"), found.row("robot", "urdf"), found.row("robot", "tool_frame")) == (2, 3, 4)
    assert (found.row("gears"), found.row("gears", "elbow joint"), found.row("gears", "elbow")) == (6, 7, 8)
    assert found.row("gears", "urdf") is None
    assert found.row("noise") is None


def test_a_section_in_one_line_is_found(tmp_path: Path) -> None:
    found = document(tmp_path, 'noise = { position = 0.1 }\nrobot.urdf = "a.urdf"\n')
    assert found.row("noise") == 1
    assert found.sections == {"noise": {"position": 0.1}, "robot": {"urdf": "a.urdf"}}


def test_what_must_be_stated_is_told_with_what_it_may_be(tmp_path: Path) -> None:
    found = document(tmp_path, "[robot]\n")
    assert found.sections == {"robot": {}}
    with pytest.raises(
        CampaignError, match=r"is missing, expected the path of the robot's URDF file, .* under \[robot\]"
    ) as lost:
        found.required("robot", "urdf")
    assert (lost.value.row, lost.value.column) == (1, "robot.urdf")
    with pytest.raises(CampaignError, match=r'is missing, expected "rad" or "deg" under \[measurements\]') as lost:
        found.required("measurements", "angle_unit")
    assert lost.value.row is None


def test_numbers_are_floats_and_no_others_pass(tmp_path: Path) -> None:
    found = document(tmp_path, "[robot]\ngravity = [0, 0, -9]\nreference_temperature = 21\n[gears]\na = 100\n").sections
    assert found["robot"]["gravity"] == (0.0, 0.0, -9.0)
    assert type(found["robot"]["reference_temperature"]) is float
    assert found["gears"] == {"a": 100.0}
    for wrong in ("true", "inf", "nan", '"21"'):
        with pytest.raises(CampaignError, match="a number"):
            document(tmp_path, f"[robot]\nreference_temperature = {wrong}\n")


BRACKETS = "[" * 5000 + "]" * 5000


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("9" * 400, "wrong kind of value"),
        ("9" * 5000, "too many digits"),
        ("1e300", "wrong kind of value; found 1e+300, expected a number"),
        ("1e-300", "smaller than any noise"),
        (BRACKETS, "values stand within each other too deep"),
        ('"' + "x" * 100_000 + '"', "is larger than any campaign.toml"),
        ("1\n" + ".".join("a" * 60_000) + " = 1", "is larger than any campaign.toml"),
        ('"' + "x" * 50_000 + '"', "wrong kind of value"),
    ],
    ids=lambda text: text[:12],
)
def test_a_hostile_value_is_refused(tmp_path: Path, value: str, told: str) -> None:
    with pytest.raises(CampaignError) as refused:
        document(tmp_path, f"[noise]\nposition = {value}\n")
    assert told in str(refused.value)
    assert len(str(refused.value)) <= 1000


@pytest.mark.parametrize("path", ["x" * 5000, "x/" * 3000, "a\0b", "", "no such folder/campaign.toml"])
def test_a_path_that_no_file_can_have_is_refused(tmp_path: Path, path: str) -> None:
    with pytest.raises(CampaignError, match=r"there is no such file|the path is empty"):
        read_campaign(path)
    with pytest.raises(RobotError, match=r"does not exist|cannot be read|is empty"):
        load_robot(path, "tool")
