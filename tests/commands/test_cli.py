"""The command line: exit status, one line for bad input, files that hold what was asked for."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from commanded import diagnosed_once, refused

from thermal_robot import CorrectedModel, __version__, cli, read_campaign
from thermal_robot.campaign import write_campaign
from thermal_robot.datasets import demo_directory
from thermal_robot.effects import RANDOM, library
from thermal_robot.report import schema


def test_diagnose_prints_the_verdict_and_writes_what_is_asked_for(folder, diagnosed):
    out = diagnosed.text
    assert (diagnosed.status, diagnosed.complaint) == (0, "")
    found = json.loads(diagnosed.json.read_text(encoding="utf-8"))
    jsonschema.validate(found, schema())
    assert found["schema"] == "thermal-robot/diagnosis/2"
    assert found["verdict"]["effects"] == ["thermal_elongation"]
    assert found["verdict"]["unexplained"] is False
    assert found["campaign"]["samples"] == 120
    assert set(found["campaign"]["outliers"]) == set(json.loads((folder / "truth.json").read_text())["outliers"])
    assert "thermal_elongation" in out or "thermal elongation" in out
    html = diagnosed.report.read_text(encoding="utf-8")
    assert html.lstrip().lower().startswith("<!doctype html>")
    assert found["verdict"]["summary"].split(" (")[0] in html
    assert json.loads(diagnosed.model.read_text())["schema"] == "thermal-robot/model/2"


def test_json_to_the_terminal_is_nothing_but_json(run, folder):
    status, out, err = run("diagnose", folder, "--json", "-")
    assert (status, err) == (0, "")
    found = json.loads(out)
    jsonschema.validate(found, schema())
    assert found["verdict"]["effects"] == ["thermal_elongation"]


def test_json_of_poses_and_of_the_unexplained_keeps_to_its_schema(run, folder, diagnosed_poses):
    found = json.loads(diagnosed_poses.json.read_text(encoding="utf-8"))
    jsonschema.validate(found, schema())
    assert found["campaign"]["measures"] == "pose"
    assert found["gap"]["orientation"]["rms_after"] < found["gap"]["orientation"]["rms_before"]
    _, out, _ = run("diagnose", folder, "--json", "-", "--without", "thermal_elongation")
    found = json.loads(out)
    jsonschema.validate(found, schema())
    assert found["verdict"]["unexplained"] is True
    assert found["unexplained"]["rms"] > 0.0
    assert found["unexplained"]["locations"]


def test_the_schema_is_strict_enough_to_find_a_mistake(diagnosed):
    found = json.loads(diagnosed.json.read_text(encoding="utf-8"))
    for change in (
        {"schema": "thermal-robot/diagnosis/0"},
        {"verdict": {"effects": "thermal_elongation"}},
        {"gap": None},
        {"effects": [{"name": "drift", "status": "perhaps"}]},
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**found, **change}, schema())


def test_only_and_without_choose_among_the_effects(run, folder):
    def candidates(*options):
        found = json.loads(run("diagnose", folder, "--json", "-", *options)[1])["effects"]
        return {e["name"] for e in found if not e["name"].startswith("discovered.")}

    # with the one that is at work among them, nothing unlisted is looked for: it is quick
    two = {"thermal_elongation", "joint_gain"}
    assert candidates("--only", *two) == two
    assert candidates("--only", "thermal_elongation", "--only", "joint_gain") == two
    assert candidates("--without", "drift", "joint_gain") == {*library(), *RANDOM} - {"drift", "joint_gain"}
    refused(run("diagnose", folder, "--only", "thermal_elongatio"), "'thermal_elongatio'", "thermal_elongation")
    refused(run("diagnose", folder, "--without", "drif"), "'drif'", "did you mean 'drift'?")


def test_a_failure_of_the_program_is_told_as_its_own(run, folder, monkeypatch):
    def fails(_):
        raise ValueError("zero-size\narray")

    monkeypatch.setattr("thermal_robot.commands.check.run", fails)
    status, out, err = run("check", folder)
    assert (status, out, err.count("\n")) == (1, "", 1)
    for word in ("zero-size", "test_cli.py", __version__, "not of your campaign", "send"):
        assert word in err
    assert "Traceback" not in err
    assert "Traceback" in run("check", folder, "-v")[2]


def test_a_fault_of_an_effect_of_the_program_is_no_bad_input(run, folder, monkeypatch):
    def broken(*_):
        raise KeyError("time")

    monkeypatch.setattr(type(library()["joint_offset"]), "parameters", broken)
    status, _, err = run("diagnose", folder, "--only", "joint_offset")
    assert (status, err.count("\n")) == (1, 1)
    assert "not of your campaign" in err


def test_bad_input_is_said_in_one_line(run, folder, tmp_path):
    refused(run("check", tmp_path / "absent"), "absent")
    refused(run("diagnose", tmp_path), "campaign.toml")
    spoilt = tmp_path / "spoilt"
    spoilt.mkdir()
    for name in ("campaign.toml", "robot.urdf", "measurements.csv"):
        (spoilt / name).write_text((folder / name).read_text())
    lines = (folder / "measurements.csv").read_text().splitlines()
    lines[4] = "wrong," + lines[4].split(",", 1)[1]
    (spoilt / "measurements.csv").write_text("\n".join(lines))
    for command in ("check", "diagnose"):
        refused(run(command, spoilt), "measurements.csv", "row 5", "'joint_1'", "wrong")
    (spoilt / "campaign.toml").write_text((folder / "campaign.toml").read_text().replace('"tool0"', '"tool_0"'))
    refused(run("check", spoilt), "'tool_0'", "tool0")


@pytest.mark.parametrize("option", ["--json", "--model", "--report"])
def test_a_file_that_cannot_be_written_is_bad_input(run, folder, tmp_path, option):
    status, _, err = run("diagnose", folder, "--only", "drift", option, tmp_path / "no" / "file")
    assert status == 2
    assert "cannot be written" in err
    assert err.count("\n") == 1


def test_what_is_read_is_never_written(run, folder, diagnosed, tmp_path):
    spare = tmp_path / "spare"
    shutil.copytree(folder, spare)
    model = tmp_path / "model.json"
    model.write_bytes(diagnosed.model.read_bytes())
    before = {f: f.read_bytes() for f in (*spare.iterdir(), model) if f.is_file()}
    for name in ("campaign.toml", "measurements.csv", "robot.urdf"):
        for option in ("--json", "--model", "--report"):
            refused(run("diagnose", spare, option, spare / name), name, "would be overwritten")
    (tmp_path / "link.csv").symlink_to(spare / "fresh.csv")
    for target in (spare / "fresh.csv", model, tmp_path / "link.csv"):
        refused(run("predict", model, spare / "fresh.csv", "-o", target), target.name, "would be overwritten")
    refused(run("diagnose", spare, "--json", tmp_path / "a", "--model", tmp_path / "a"), "two outputs")
    assert before == {f: f.read_bytes() for f in before}


def test_an_output_that_fails_does_not_take_the_others_with_it(folder, tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("thermal_robot.commands.diagnose.page", full)
    outputs = {option: tmp_path / option.strip("-") for option in ("--json", "--report", "--model")}
    status = cli.main(["diagnose", str(folder), "--only", "drift", *(str(x) for pair in outputs.items() for x in pair)])
    said = capsys.readouterr()
    assert status == 2
    assert "verdict" in said.out
    assert str(outputs["--report"]) in said.err
    assert "No space left on device" in said.err
    assert json.loads(outputs["--json"].read_text())["schema"]
    CorrectedModel.load(outputs["--model"])
    assert not outputs["--report"].exists()


@pytest.mark.parametrize("arguments", [["diagnos"], ["diagnose"], ["predict", "m", "s"], ["check", "a", "b"]])
def test_a_command_line_that_is_none_exits_with_two(arguments, capsys):
    try:
        status = cli.main(arguments)
    except SystemExit as stopped:
        status = stopped.code
    complaint = capsys.readouterr().err
    assert status == 2
    assert complaint.startswith("thermal-robot")
    assert complaint.count("\n") == 1


def test_a_campaign_after_the_names_of_effects_is_still_the_campaign(run, folder):
    status, out, _ = run("diagnose", "--without", "drift", folder)
    assert status == 0
    assert "left out by request (--without drift): drift" in " ".join(out.split())


def test_the_version_is_told(capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(["--version"])
    assert stopped.value.code == 0
    assert capsys.readouterr().out == f"thermal-robot {__version__}\n"


def test_the_demo_prints_and_draws(run, tmp_path):
    page = tmp_path / "demo.html"
    status, out, err = run("demo", "--report", page)
    assert (status, err) == (0, "")
    assert str(page) in out
    truth = json.loads((demo_directory() / "truth.json").read_text())
    html = page.read_text(encoding="utf-8")
    for effect in truth["effects"]:
        assert effect in out
        assert effect in html


def program(*arguments, cwd):
    command = [sys.executable, "-m", "thermal_robot.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False, timeout=120)


def test_the_program_itself_exits_as_it_should(folder, tmp_path):
    good = program("diagnose", folder, "--json", "-", "--only", "thermal_elongation", "drift", cwd=tmp_path)
    assert (good.returncode, good.stderr) == (0, "")
    assert json.loads(good.stdout)["verdict"]["effects"] == ["thermal_elongation"]
    bad = program("diagnose", "absent", cwd=tmp_path)
    refused((bad.returncode, bad.stdout, bad.stderr), "absent")
    assert list(tmp_path.iterdir()) == []


def test_a_table_that_is_at_fault_is_bad_input_and_gives_no_model(poses, tmp_path):
    campaign = read_campaign(poses)
    spoilt = replace(campaign, q=campaign.q * np.where(np.arange(campaign.robot.n) == 2, -1.0, 1.0))
    (tmp_path / "cell").mkdir()
    write_campaign(spoilt, tmp_path / "cell")
    done = diagnosed_once(tmp_path / "cell", tmp_path)
    assert done.status == cli.BAD_INPUT
    assert done.complaint.count("\n") == 1
    assert "joint_3 is reversed" in done.complaint
    assert done.text.startswith("The table is at fault, not the robot: joint_3 is reversed")
    plain = json.loads(done.json.read_text())
    jsonschema.validate(plain, schema())
    assert plain["verdict"]["usable"] is False
    assert done.report.exists()
    assert not done.model.exists()


def test_effects_are_listed_with_what_they_need(run, folder):
    status, listed, err = run("effects")
    assert (status, err) == (0, "")
    told = {line.split()[0]: line for line in listed.splitlines()[1:]}
    assert set(told) == {*library(), *RANDOM}
    assert told["thermal_elongation"].endswith("; needs temperature")
    assert told["tracking_lag"].endswith("; needs velocity.<joint>")
    assert "needs" not in told["geometric"]
    of_campaign = run("effects", folder)[1]
    assert "needs temperature\n" not in of_campaign  # it was recorded
    refused(run("effects", folder / "absent"), "absent")


def test_any_file_of_a_diagnosis_may_be_printed_instead_of_the_text(run, folder, diagnosed, tmp_path, monkeypatch):
    few = ("diagnose", folder, "--only", "thermal_elongation", "drift")
    assert run(*few, "--model", tmp_path / "m.json")[0] == 0
    status, out, err = run(*few, "--model", "-")
    assert (status, out, err) == (0, (tmp_path / "m.json").read_text(), "")
    status, out, err = run(*few, "--report", "-", "--json", tmp_path / "d.json", "-v")
    assert status == 0
    assert out.lower().startswith("<!doctype html>")
    assert out.rstrip().endswith("</html>")
    assert json.loads((tmp_path / "d.json").read_text())["schema"]
    refused(run(*few, "--report", "-", "--json", "-"), "one standard output", "json", "report")
    monkeypatch.chdir(tmp_path)
    assert run(*few, "--json", "./-")[1].startswith("The gap of")
    assert (tmp_path / "-").read_text() == (tmp_path / "d.json").read_text()


def test_a_table_that_is_at_fault_is_printed_as_json_all_the_same(run, poses, tmp_path):
    campaign = read_campaign(poses)
    write_campaign(replace(campaign, q=-campaign.q), tmp_path)
    status, out, err = run("diagnose", tmp_path, "--json", "-")
    assert status == 2
    assert err.count("\n") == 1
    assert json.loads(out)["verdict"]["usable"] is False


def test_a_letter_that_the_terminal_lacks_is_no_failure(folder):
    command = [sys.executable, "-m", "thermal_robot", "check", str(folder)]
    asked = {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = subprocess.run(command, capture_output=True, env={**os.environ, **asked}, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"m/s?" in done.stdout


def test_a_line_break_in_an_argument_makes_no_second_line(capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(["check", "campaign.toml", "a\nb"])
    assert end.value.code == cli.BAD_INPUT
    assert capsys.readouterr().err.count("\n") == 1
