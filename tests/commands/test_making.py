"""Commands that start without a campaign: `plan`, `import` and `paper`."""

import argparse
import inspect
import json

import pytest
from campaign.importers.written import put
from commanded import refused

from thermal_robot import cli
from thermal_robot.campaign import read_campaign
from thermal_robot.campaign.importers.run import FORMATS
from thermal_robot.commands.table import COMMANDS
from thermal_robot.planning import plan

ROBOT = ("plan", "builtin:rv_m2", "--tool", "tool0", "--rows", "20", "--effects", "joint_gain", "backlash")


def test_a_folder_is_written_and_the_expectation_printed(run, tmp_path):
    status, out, err = run(*ROBOT, "--repeats", "2", "--target", "50", "0", "100", "-o", tmp_path / "cell")
    assert (status, err) == (0, "")
    assert "20 rows: 10 poses, each 2 times" in out
    written = {"campaign.toml", "measurements.csv", "plan.csv", "robot.urdf"}
    assert {f.name for f in (tmp_path / "cell").iterdir()} == written
    assert "position = 0.02" in (tmp_path / "cell" / "campaign.toml").read_text(encoding="utf-8")
    refused(run("check", tmp_path / "cell"), "still to be filled in")


def test_json_holds_the_plan_and_less_noise_is_expected_to_tell_more(run, tmp_path):
    sigmas = []
    for noise in ("0.02", "0.1"):
        status, out, _ = run(*ROBOT, "--noise", noise, "--json", "-", "-o", tmp_path / f"{noise}.csv")
        found = json.loads(out)
        assert status == 0
        assert [effect["name"] for effect in found["effects"]] == ["joint_gain", "backlash"]
        assert {len(values) for values in found["joints"].values()} == {20}
        assert (tmp_path / f"{noise}.csv").exists()
        sigmas.append(found["effects"][0]["parameters"][0]["sigma"])
    assert sigmas[1] > 3.0 * sigmas[0]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("builtin:rv_m2",), "tool0"),
        (("nowhere.urdf", "--tool", "tool0"), "nowhere.urdf"),
        (("builtin:rv_m2", "--tool", "tool0", "--rows", "3"), "rows"),
        (("builtin:rv_m2", "--tool", "tool0", "--effects", "backlsh"), "backlash"),
    ],
)
def test_what_cannot_be_planned_is_one_line(run, arguments, named):
    refused(run("plan", *arguments), named)


def test_what_is_left_out_is_what_the_function_leaves_out():
    """The table of commands is light: it writes the planner's defaults down once more, held together here."""
    parser = argparse.ArgumentParser()
    COMMANDS["plan"].add_arguments(parser)
    told = vars(parser.parse_args(["robot.urdf"]))
    meant = {name: p.default for name, p in inspect.signature(plan).parameters.items()}
    assert told["rows"] is None  # the planner's own, or those after a crash
    for option in ("repeats", "orientation", "seed"):
        assert told[option] == meant[option], option
    assert 1e-3 * told["noise"] == pytest.approx(meant["noise"])
    assert told["warming"] == meant["rise"]
    assert (told["loads"], told["target"]) == (list(meant["loads"]), list(meant["target"]))


def test_after_a_crash_forty_poses_are_planned_for_zeros_and_placements(run, tmp_path):
    out = tmp_path / "after.csv"
    words = ("plan", "builtin:rv_m2", "--tool", "tool0", "--after-crash", "-o", out)
    status, said, _ = run(*words)
    assert status == 0
    assert {line.split()[0] for line in said.splitlines()[3:] if line.strip()} >= {"joint_offset", "geometric"}
    assert "backlash" not in said
    planned = out.read_text().splitlines()
    assert len(planned) == 41
    assert "temperature" not in planned[0]
    assert run(*words[:5], "--rows", "12", "-o", tmp_path / "few.csv")[1].startswith("12 rows")


TABLE = "turn,lift,slide,roll,x,y,z\n0.1,0.2,0.03,0.4,1,2,3\n-0.1,0.3,0.06,3.5,4,5,6\n0.5,-0.4,0.09,-0.4,7,8,9\n"
MAPPING = '[robot]\nurdf = "robot.urdf"\ntool_frame = "hand"\n[measurements]\nangle_unit = "deg"\nlength_unit = "mm"\n'


def test_the_help_has_every_format(capsys):
    with pytest.raises(SystemExit):
        cli.main(["import", "--help"])
    text = capsys.readouterr().out
    for name, format in FORMATS.items():
        assert f"{name} " in text
        assert format.does in text
        assert format.files in text


def test_options_count_for_more_than_the_mapping(run, tmp_path):
    folder = put(tmp_path, t__csv=TABLE, m__toml=MAPPING)
    mapping = ("--mapping", folder / "m.toml")
    status, out, err = run("import", "table", folder / "t.csv", *mapping, "--length-unit", "m", "-o", folder / "c")
    assert (status, err) == (0, "")
    assert out == f"table: 3 rows read, 3 taken; written to {folder / 'c' / 'campaign.toml'}\n"
    campaign = read_campaign(folder / "c")
    assert campaign.position[0, 0] == 1.0
    assert campaign.units.angle == "deg"
    assert campaign.robot.tool_frame == "hand"
    assert run("import", "-q", "table", folder / "t.csv", *mapping, "--tool", "tool", "-o", folder / "d") == (0, "", "")
    assert read_campaign(folder / "d").robot.tool_frame == "tool"


def test_what_cannot_be_imported_is_one_line(run, tmp_path):
    folder = put(tmp_path, t__csv=TABLE, m__toml=MAPPING)
    mapping = ("--mapping", folder / "m.toml")
    refused(run("import", "table", folder / "absent.csv", *mapping, "-o", folder / "c"), "absent.csv: there is no such")
    refused(run("import", "table", folder / "t.csv", "-o", folder / "c"), "no robot is named")
    robot = ("--robot", folder / "robot.urdf")
    refused(run("import", "table", folder / "t.csv", *robot, "-o", folder / "c"), "no tool frame is given")
    with pytest.raises(SystemExit):
        run("import", "tabel", folder / "t.csv", *robot, "-o", folder / "c")
