"""`thermal-robot plan`: a folder to be measured, a table, JSON, and errors of one line."""

import argparse
import inspect
import json

import pytest

from thermal_robot.commands.plan import add_arguments
from thermal_robot.planning import plan

ROBOT = ("plan", "builtin:rv_m2", "--tool", "tool0", "--rows", "20", "--effects", "joint_gain", "backlash")


def test_a_folder_is_written_and_the_expectation_printed(run, tmp_path):
    status, out, err = run(*ROBOT, "--repeats", "2", "--target", "50", "0", "100", "-o", tmp_path / "cell")
    assert (status, err) == (0, "")
    assert "20 rows: 10 poses, each 2 times" in out
    assert {f.name for f in (tmp_path / "cell").iterdir()} == {
        "campaign.toml", "measurements.csv", "plan.csv", "robot.urdf",
    }  # fmt: skip
    toml = (tmp_path / "cell" / "campaign.toml").read_text(encoding="utf-8")
    assert "position = 0.02" in toml
    status, _, err = run("check", tmp_path / "cell")
    assert (status, err.count("\n")) == (2, 1)


def test_json_holds_the_plan(run, tmp_path):
    status, out, _ = run(*ROBOT, "--json", "-", "-o", tmp_path / "table.csv")
    found = json.loads(out)
    assert status == 0
    assert [effect["name"] for effect in found["effects"]] == ["joint_gain", "backlash"]
    assert {len(values) for values in found["joints"].values()} == {20}
    assert (tmp_path / "table.csv").exists()


def test_less_noise_is_expected_to_tell_more(run):
    sigmas = []
    for noise in ("0.02", "0.1"):
        found = json.loads(run(*ROBOT, "--noise", noise, "--json", "-")[1])
        sigmas.append(found["effects"][0]["parameters"][0]["sigma"])
    assert sigmas[1] > 3.0 * sigmas[0]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("builtin:rv_m2",), "tool0"),
        (("nowhere.urdf", "--tool", "tool0"), "nowhere.urdf"),
        (("builtin:rv_m2", "--tool", "tool0", "--rows", "3"), "rows"),
        (("builtin:rv_m2", "--tool", "tool0", "--repeats", "7"), "repeats"),
        (("builtin:rv_m2", "--tool", "tool0", "--effects", "backlsh"), "backlash"),
    ],
)
def test_bad_input_is_one_line(run, arguments, named):
    status, out, err = run("plan", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert named in err


def test_what_is_left_out_is_what_the_function_leaves_out():
    """The command is loaded without the planner: its defaults are written down twice, and held together here."""
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    told = vars(parser.parse_args(["robot.urdf"]))
    meant = {name: p.default for name, p in inspect.signature(plan).parameters.items()}
    for option in ("rows", "repeats", "orientation", "seed"):
        assert told[option] == meant[option], option
    assert 1e-3 * told["noise"] == pytest.approx(meant["noise"])
    assert told["warming"] == meant["rise"]
    assert (told["loads"], told["target"]) == (list(meant["loads"]), list(meant["target"]))
