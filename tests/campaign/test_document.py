"""campaign.toml: what it must declare, in which words and units, and its defaults; YAML of plain values alone."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from campaign.files import PLAIN_TOML, refusal, says

from thermal_robot.campaign import Settings, Units, read_campaign
from thermal_robot.campaign.document import Declaration, Document, read_declaration, read_yaml
from thermal_robot.errors import CampaignError, RobotError
from thermal_robot.robot import load_robot

# what is replaced, by what, row, column, found, what is said
REFUSED = [
    ('[robot]\nurdf = "robot.urdf"\ntool_frame = "tool"\n', "", None, "robot.urdf", None, "under [robot]"),
    ('urdf = "robot.urdf"\n', "", 1, "robot.urdf", None, "is missing … path of the robot's URDF file"),
    ('tool_frame = "tool"\n', "", 1, "robot.tool_frame", None, "is missing … link that carries the target"),
    ('file = "measurements.csv"\n', "", 5, "measurements.file", None, "is missing … path of the table"),
    ('angle_unit = "rad"\n', "", 5, "measurements.angle_unit", None, 'is missing … "rad" or "deg"'),
    ('length_unit = "mm"\n', "", 5, "measurements.length_unit", None, 'is missing … "m" or "mm" or "um"'),
    ('"mm"', '"yard"', 8, "measurements.length_unit", "'yard'", 'unknown unit … "m" or "mm" or "um"'),
    ('"rad"', "1", 7, "measurements.angle_unit", "1", 'unknown unit … "rad" or "deg"'),
    ('base = "unknown"', 'base = "floor"', 11, "frames.base", "'floor'", 'unknown word … "unknown" or "known"'),
    ("0.02", "-0.02", 16, "noise.position", "-0.02", "cannot be negative"),
    ("0.02", "0.02\norientation = -1", 17, "noise.orientation", "-1", "cannot be negative"),
    ("101", "0", 22, "gears.lift", "0", "transmission ratio must be positive"),
    ("lift =", "left =", 22, "gears.left", None, "no such joint … did you mean 'lift' … 'turn', 'lift', 'slide'"),
    ("[gears]", "[gears", 21, None, None, "not valid TOML"),
    ("base =", "bse =", 11, "frames.bse", None, "unknown key … did you mean 'base' … base, tool, target"),
    ("[noise]", "[noises]", 15, "noises", None, "unknown section … did you mean 'noise'"),
    ("[robot]", 'title = "x"\n[robot]', 1, "title", None, "unknown section or key … sections robot"),
    ("[robot]", "payload = 5\n[robot]", 1, "payload", "5", "wrong kind of value … a section [payload]"),
    ('"tool"', "6", 3, "robot.tool_frame", "6", "wrong kind of value … as text in quotes"),
    ("80.0]", "80.0, 1]", 13, "frames.target", "[0.0, 0.0, 80.0, 1]", "three numbers in brackets"),
    ("[0.0, 0.0, 80.0]", '"80"', 13, "frames.target", "'80'", "three numbers in brackets"),
    ("80.0]", "nan]", 13, "frames.target", "[0.0, 0.0, nan]", "three numbers in brackets"),
    ("0.02", '"0.02"', 16, "noise.position", "'0.02'", "wrong kind of value … a finite number"),
    ("1e-3", "0", 19, "priors.joint_offset", "0", "expected size of an effect must be positive"),
    ("1e-3", '"small"', 19, "priors.joint_offset", "'small'", "wrong kind of value … a number above 0"),
]


@pytest.mark.parametrize(("old", "new", "row", "column", "found", "said"), REFUSED)
def test_a_wrong_word_is_refused_with_its_line(tmp_path, old, new, row, column, found, said):
    error = refusal(tmp_path, toml=PLAIN_TOML.replace(old, new, 1))
    assert (error.file, error.row, error.column) == (str(tmp_path / "campaign.toml"), row, column)
    assert error.found == found
    assert says(error, said)


def test_no_campaign_is_told_with_those_beside_it(tmp_path: Path) -> None:
    folder, file = "this folder has no campaign.toml", "there is no such file"
    expected = "expected campaign.toml, or the folder that holds it"
    (tmp_path / "tools.toml").write_text("[tool]\n")
    (tmp_path / "empty").mkdir()
    missing = (tmp_path / "nowhere" / "campaign.toml", file)
    asked = [(tmp_path, folder), (tmp_path / "campaign.toml", file)]
    for path, problem in (*asked, missing):
        with pytest.raises(CampaignError) as caught:
            read_campaign(path)
        assert caught.value.file == str(path)
        assert str(caught.value).endswith(f"{problem}, {expected}")
    (tmp_path / "warm.toml").write_text('[measurements]\nfile = "warm.csv"\n')
    (tmp_path / "cell_2").mkdir()
    (tmp_path / "cell_2" / "campaign.toml").touch()
    for path, problem in asked:
        with pytest.raises(CampaignError) as caught:
            read_declaration(path)
        assert str(caught.value).endswith(f"{problem}; campaigns there: 'warm.toml', 'cell_2', {expected}")


BARE = """[robot]
urdf = "{urdf}"
tool_frame = "tool"
[measurements]
file = "t.csv"
angle_unit = "deg"
length_unit = "{unit}"
"""


def declared(folder: Path, text: str) -> Declaration:
    (folder / "campaign.toml").write_text(text)
    return read_declaration(folder)


def test_defaults_of_a_bare_declaration(tmp_path: Path) -> None:
    settings = declared(tmp_path, BARE.format(urdf="r.urdf", unit="mm")).settings
    assert settings == Settings("r.urdf", "tool", units=Units("deg", "mm"), moves="")
    assert (settings.base_known, settings.tool_known, settings.reference_temperature) == (False, False, 20.0)


def test_a_known_robot_is_no_path_and_paths_start_from_the_file_or_from_a_folder(tmp_path: Path) -> None:
    for reference in ("builtin:rv_m2", "example-robot-data:ur10"):
        assert declared(tmp_path, BARE.format(urdf=reference, unit="mm")).robot == reference
    found = declared(tmp_path, BARE.format(urdf="../arm.urdf", unit="mm"))
    assert (found.robot, found.table) == (tmp_path / ".." / "arm.urdf", tmp_path / "t.csv")
    found = read_declaration(tmp_path / "campaign.toml", tmp_path / "other")
    assert (found.robot, found.table) == (tmp_path / "other" / ".." / "arm.urdf", tmp_path / "other" / "t.csv")


METRES = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "inch": 0.0254, "in": 0.0254, "ft": 0.3048}


@pytest.mark.parametrize(("unit", "metres"), METRES.items())
def test_every_length_is_in_the_declared_unit(tmp_path: Path, unit: str, metres: float) -> None:
    more = "[frames]\ntarget = [1, 2, 3]\n[noise]\nposition = 4\norientation = 5\n[payload]\ncom = [6, 7, 8]\n"
    settings = declared(tmp_path, BARE.format(urdf="r.urdf", unit=unit) + more).settings
    assert settings.target == pytest.approx([metres, 2 * metres, 3 * metres], rel=1e-15)
    assert settings.payload_com == pytest.approx([6 * metres, 7 * metres, 8 * metres], rel=1e-15)
    assert (settings.noise_position, settings.noise_orientation) == (pytest.approx(4 * metres), 5.0)


def document(folder: Path, text: str) -> Document:
    file = folder / "campaign.toml"
    file.write_text(text, encoding="utf-8")
    return Document(file)


def test_lines_are_found_however_a_key_is_written(tmp_path: Path) -> None:
    text = '# robot\n[ robot ]\n"urdf" = "a.urdf"\n  tool_frame="t"\n\n["gears"]\n\'elbow joint\' = 3\nelbow = 4\n'
    found = document(tmp_path, text)
    assert (found.row("robot"), found.row("robot", "urdf"), found.row("robot", "tool_frame")) == (2, 3, 4)
    assert (found.row("gears"), found.row("gears", "elbow joint"), found.row("gears", "elbow")) == (6, 7, 8)
    assert (found.row("gears", "urdf"), found.row("noise")) == (None, None)
    found = document(tmp_path, 'noise = { position = 0.1 }\nrobot.urdf = "a.urdf"\n')
    assert found.row("noise") == 1
    assert found.sections == {"noise": {"position": 0.1}, "robot": {"urdf": "a.urdf"}}


def test_numbers_are_floats(tmp_path: Path) -> None:
    found = document(tmp_path, "[robot]\ngravity = [0, 0, -9]\nreference_temperature = 21\n[gears]\na = 100\n").sections
    assert found["robot"]["gravity"] == (0.0, 0.0, -9.0)
    assert type(found["robot"]["reference_temperature"]) is float
    assert found["gears"] == {"a": 100.0}


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("9" * 400, "wrong kind of value"),
        ("9" * 5000, "too many digits"),
        ("1e300", "wrong kind of value; found 1e+300, expected a finite number"),
        ("1e-300", "smaller than any noise"),
        ("[" * 5000 + "]" * 5000, "values stand within each other too deep"),
        ('"' + "x" * 100_000 + '"', "is larger than any campaign.toml"),
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
def test_a_path_that_no_file_can_have_is_refused(path: str) -> None:
    with pytest.raises(CampaignError, match=r"there is no such file|the path is empty"):
        read_campaign(path)
    with pytest.raises(RobotError, match=r"does not exist|cannot be read|is empty"):
        load_robot(path, "tool")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a: \xff\xfe", "is not UTF-8 text"),
        (b"a: !!python/object:os.system {}", "not valid YAML"),
        (b"a: [\n", "row 2: not valid YAML"),
    ],
)
def test_yaml_of_plain_values_alone(tmp_path, monkeypatch, content, words):
    (tmp_path / "a.YML").write_text("a: [1, 2.5, x]\n---\n---\n- b\n")
    assert read_yaml(tmp_path / "a.YML") == [{"a": [1, 2.5, "x"]}, ["b"]]
    (tmp_path / "a.yaml").write_bytes(content)
    told = {tmp_path / "a.yaml": words, tmp_path / "b.yaml": "there is no such file", tmp_path: "is a directory"}
    for path, said in told.items():
        with pytest.raises(CampaignError, match=said):
            read_yaml(path)
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(CampaignError, match=r'need PyYAML, .* expected pip install "thermal-robot'):
        read_yaml(tmp_path / "a.yaml")
