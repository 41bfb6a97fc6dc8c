"""campaign.toml: what it must declare, in which words and units, and its defaults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from campaign.files import put
from campaign.spoilt import toml_is_refused

from thermal_robot.campaign import Settings, Units, read_campaign
from thermal_robot.campaign.checked import check_joints
from thermal_robot.campaign.document import Declaration, read_declaration
from thermal_robot.errors import CampaignError

# what is replaced, by what, row, column, found, words of the sentence
REFUSED = [
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
    ('"mm"', '"yard"', 8, "measurements.length_unit", "'yard'", ["unknown unit", '"m" or "mm" or "um"']),
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
    ("0.02", "-0.02", 16, "noise.position", "-0.02", ["cannot be negative"]),
    ("0.02", "0.02\norientation = -1", 17, "noise.orientation", "-1", ["cannot be negative"]),
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


@pytest.mark.parametrize("refused", REFUSED)
def test_refused(tmp_path: Path, refused: tuple[Any, ...]) -> None:
    toml_is_refused(tmp_path, *refused)


def test_no_campaign(tmp_path: Path) -> None:
    problems = {tmp_path: "this folder has no campaign.toml", tmp_path / "campaign.toml": "there is no such file"}
    for path, problem in problems.items():
        with pytest.raises(CampaignError) as caught:
            read_campaign(path)
        assert caught.value.file == str(path)
        assert str(caught.value).endswith(f"{problem}, expected campaign.toml, or the folder that holds it")


def test_noise_of_zero_is_not_given(tmp_path: Path) -> None:
    folder = put(tmp_path / "c")
    file = folder / "campaign.toml"
    file.write_text(file.read_text().replace("0.02", "0").replace("3e-5", "0.0"))
    campaign = read_campaign(folder)
    assert campaign.noise_position is None
    assert campaign.noise_orientation is None


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
    assert settings == Settings("r.urdf", "tool", units=Units("deg", "mm"))
    assert not settings.base_known
    assert not settings.tool_known
    assert settings.reference_temperature == 20.0


@pytest.mark.parametrize("reference", ["builtin:rv_m2", "example-robot-data:ur10"])
def test_a_known_robot_is_no_path_and_a_path_is_beside_the_file(tmp_path: Path, reference: str) -> None:
    assert declared(tmp_path, BARE.format(urdf=reference, unit="mm")).robot == reference
    found = declared(tmp_path, BARE.format(urdf="../arm.urdf", unit="mm"))
    assert found.robot == tmp_path / ".." / "arm.urdf"
    assert found.table == tmp_path / "t.csv"


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("inch", 0.0254)])
def test_every_length_is_in_the_declared_unit(tmp_path: Path, unit: str, metres: float) -> None:
    more = "[frames]\ntarget = [1, 2, 3]\n[noise]\nposition = 4\norientation = 5\n[payload]\ncom = [6, 7, 8]\n"
    settings = declared(tmp_path, BARE.format(urdf="r.urdf", unit=unit) + more).settings
    assert settings.target == pytest.approx([metres, 2 * metres, 3 * metres], rel=1e-15)
    assert settings.payload_com == pytest.approx([6 * metres, 7 * metres, 8 * metres], rel=1e-15)
    assert settings.noise_position == pytest.approx(4 * metres)
    assert settings.noise_orientation == 5.0


def test_gears_are_of_joints_of_the_chain(tmp_path: Path) -> None:
    found = declared(tmp_path, BARE.format(urdf="r.urdf", unit="mm") + "[gears]\nlift = 101\nshoulder = 50\n")
    told = (str(found.file), "gears", found.settings.gears)
    check_joints(*told, ("lift", "shoulder"), found.gear_rows)
    with pytest.raises(CampaignError, match="no such joint") as caught:
        check_joints(*told, ("lift", "elbow"), found.gear_rows)
    assert (caught.value.row, caught.value.column) == (10, "gears.shoulder")


def test_what_is_missing_is_answered_with_the_campaigns_beside_it(tmp_path: Path) -> None:
    (tmp_path / "tools.toml").write_text("[tool]\n")
    (tmp_path / "empty").mkdir()
    with pytest.raises(CampaignError) as refused:
        read_declaration(tmp_path)
    assert "this folder has no campaign.toml, expected" in str(refused.value)
    (tmp_path / "warm.toml").write_text('[measurements]\nfile = "warm.csv"\n')
    (tmp_path / "cell_2").mkdir()
    (tmp_path / "cell_2" / "campaign.toml").touch()
    for asked, problem in ((tmp_path, "this folder has no campaign.toml"), (tmp_path / "warn.toml", "no such file")):
        with pytest.raises(CampaignError) as refused:
            read_declaration(asked)
        assert f"{problem}; campaigns there: 'warm.toml', 'cell_2', expected" in str(refused.value)
    with pytest.raises(CampaignError, match="no such file, expected"):
        read_declaration(tmp_path / "nowhere" / "campaign.toml")


def test_paths_start_from_the_folder_that_is_named(tmp_path: Path) -> None:
    (tmp_path / "piped").mkdir()
    text = '[robot]\nurdf = "r.urdf"\ntool_frame = "t"\n' + '[measurements]\nfile = "m.csv"\n'
    (tmp_path / "piped" / "c.toml").write_text(text + 'angle_unit = "deg"\nlength_unit = "mm"\n')
    found = read_declaration(tmp_path / "piped" / "c.toml", tmp_path)
    assert (found.robot, found.table) == (tmp_path / "r.urdf", tmp_path / "m.csv")
    assert read_declaration(tmp_path / "piped" / "c.toml").table == tmp_path / "piped" / "m.csv"
