"""Commands of one campaign: exit status, one line for bad input, files that hold what was asked for, streams."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import jsonschema
import numpy as np
import pandas as pd
import pytest
from clouds import ELEVEN, cell
from commanded import diagnosed_files, refused

from thermal_robot import CorrectedModel, __version__, cli, diagnose, read_campaign
from thermal_robot.campaign import write_campaign
from thermal_robot.datasets import demo_directory
from thermal_robot.effects import RANDOM, library
from thermal_robot.report import schema
from thermal_robot.report.words import NO_BREAK

FEW = ("--only", "thermal_elongation", "drift")


def test_check_describes_a_campaign_and_takes_a_urdf_that_pinocchio_takes(run, folder, tmp_path):
    status, out, err = run("check", folder)
    assert (status, err) == (0, "")
    assert "120" in out
    assert all(joint in out for joint in read_campaign(folder).robot.joint_names)
    assert run("check", folder / "campaign.toml") == (0, out, "")
    assert run("check", folder, "-q") == (0, "", "")
    urdf = (folder / "robot.urdf").read_text(encoding="utf-8")
    for number, text in enumerate(('<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->")):
        copied = tmp_path / f"cell_{number}"
        shutil.copytree(folder, copied)
        (copied / "robot.urdf").write_text(urdf.replace("</robot>", f"{text}\n</robot>"), encoding="utf-8")
        status, described, err = run("check", copied)
        assert (status, err) == (0, "")
        assert described.splitlines()[1:] == out.splitlines()[1:]  # but for the folder's name


def test_check_says_what_a_diagnosis_would(run, folder, tmp_path):
    cell = tmp_path / "cell"
    shutil.copytree(folder, cell)
    table = pd.read_csv(cell / "measurements.csv")
    kept = [name for name in table.columns if not name.startswith("approach.")]
    pd.concat([table, table.iloc[[3, 10]]])[kept].to_csv(cell / "measurements.csv", index=False)
    said = " ".join(run("check", cell)[1].split())
    left = "2 rows (122, 123) repeat another one to the last digit: these copies are left out"
    assert left in said
    assert "rows that count 120 of 122" in said
    assert left in read_and_warned(cell)
    table[[name for name in kept if name not in ("time", "order")]].to_csv(cell / "measurements.csv", index=False)
    said = " ".join(run("check", cell)[1].split())
    assert "not testable backlash: add approach.<joint> or order" in said
    assert "not testable drift: add time or order" in said
    inches = table[kept].assign(**{axis: table[axis] / 25.4 for axis in "xyz"})
    inches.to_csv(cell / "measurements.csv", index=False)
    said = " ".join(run("check", cell)[1].split())
    assert "no effect The table is at fault, not the robot: positions stand in inch, not in mm" in said
    assert "not testable" not in said
    table[kept].head(4).to_csv(cell / "measurements.csv", index=False)
    assert "none is possible 4 different poses are too few" in " ".join(run("check", cell)[1].split())


def read_and_warned(cell):
    return diagnose(cell, only=["thermal_elongation"]).warnings


def test_diagnose_prints_the_verdict_and_writes_what_is_asked_for(run, folder, diagnosed, diagnosed_poses):
    out = diagnosed.text
    assert (diagnosed.status, diagnosed.complaint) == (0, "")
    found = json.loads(diagnosed.json.read_text(encoding="utf-8"))
    jsonschema.validate(found, schema())
    assert found["verdict"]["effects"] == ["thermal_elongation"]
    assert found["verdict"]["unexplained"] is False
    assert found["campaign"]["samples"] == 120
    assert set(found["campaign"]["outliers"]) == set(json.loads((folder / "truth.json").read_text())["outliers"])
    assert "thermal_elongation" in out or "thermal elongation" in out
    html = diagnosed.report.read_text(encoding="utf-8")
    assert html.lstrip().lower().startswith("<!doctype html>")
    assert found["verdict"]["summary"].split(" (")[0] in html.replace(NO_BREAK, " ")
    listed = dict(re.findall(r"<li>(\S+) <code>(\w+)</code></li>", html))
    assert {"campaign.toml", "robot.urdf"} <= set(listed)
    for name, checksum in listed.items():
        assert checksum == hashlib.sha256((folder / name).read_bytes()).hexdigest()
    assert json.loads(diagnosed.model.read_text())["schema"] == "thermal-robot/model/2"
    status, printed, err = run("diagnose", folder, "--json", "-")
    assert (status, printed, err) == (0, diagnosed.json.read_text(encoding="utf-8"), "")
    of_poses = json.loads(diagnosed_poses.json.read_text(encoding="utf-8"))
    jsonschema.validate(of_poses, schema())
    assert of_poses["campaign"]["measures"] == "pose"
    assert of_poses["gap"]["orientation"]["rms_after"] < of_poses["gap"]["orientation"]["rms_before"]


@pytest.mark.slow
def test_only_and_without_choose_among_the_effects(run, folder, tmp_path):
    two = ["thermal_elongation", "joint_gain"]
    asked = ("diagnose", folder, "--json", "-", "--only")
    status, out, _ = run(*asked, *two)
    found = json.loads(out)["effects"]
    assert {e["name"] for e in found if not e["name"].startswith("discovered.")} == set(two)
    assert run(*asked, two[0], "--only", two[1])[:2] == (status, out) == (0, out)
    refused(run(*asked, "thermal_elongatio"), "'thermal_elongatio'", "thermal_elongation")
    refused(run("diagnose", folder, "--without", "drif"), "'drif'", "did you mean 'drift'?")
    # a campaign after the names of effects is still the campaign; what is then unexplained keeps to the schema
    less = ("drift", "thermal_elongation")
    status, out, _ = run("diagnose", "--json", tmp_path / "d.json", "--without", *less, folder)
    assert status == 0
    assert "left out by request (--without drift thermal_elongation): drift" in " ".join(out.split())
    found = json.loads((tmp_path / "d.json").read_text(encoding="utf-8"))
    jsonschema.validate(found, schema())
    assert found["verdict"]["unexplained"] is True
    named = {e["name"] for e in found["effects"] if not e["name"].startswith("discovered.")}
    assert named == {*library(), *RANDOM} - {*less}


def test_a_failure_of_the_program_is_told_as_its_own(run, folder, monkeypatch):
    def fails(_):
        raise ValueError("zero-size\narray")

    def broken(*_):
        raise KeyError("time")

    monkeypatch.setattr("thermal_robot.commands.campaigns.check", fails)
    status, out, err = run("check", folder)
    assert (status, out, err.count("\n")) == (1, "", 1)
    for word in ("zero-size", "test_campaigns.py", __version__, "not of your campaign", "send"):
        assert word in err
    assert "Traceback" not in err
    assert "Traceback" in run("check", folder, "-v")[2]
    # a fault of an effect of the program is no bad input; nor is it hidden by an answer of before
    monkeypatch.setattr("thermal_robot.diagnosing.diagnose", diagnose)
    monkeypatch.setattr(type(library()["joint_offset"]), "parameters", broken)
    status, _, err = run("diagnose", folder, "--only", "joint_offset")
    assert (status, err.count("\n")) == (1, 1)
    assert "not of your campaign" in err


def test_bad_input_is_said_in_one_line(run, folder, tmp_path):
    refused(run("check", tmp_path / "absent"), "absent")
    refused(run("check", tmp_path / "absent", "-q"), "absent")
    refused(run("diagnose", tmp_path), "campaign.toml")
    spoilt = tmp_path / "spoilt"
    shutil.copytree(folder, spoilt)
    lines = (folder / "measurements.csv").read_text().splitlines()
    lines[4] = "wrong," + lines[4].split(",", 1)[1]
    (spoilt / "measurements.csv").write_text("\n".join(lines))
    for command in ("check", "diagnose"):
        refused(run(command, spoilt), "measurements.csv", "row 5", "'joint_1'", "wrong")
    (spoilt / "campaign.toml").write_text((folder / "campaign.toml").read_text().replace('"tool0"', '"tool_0"'))
    refused(run("check", spoilt), "'tool_0'", "tool0")
    for option in ("--json", "--model", "--report"):
        said = run("diagnose", folder, "--only", "drift", option, tmp_path / "no" / "file")
        refused(said, "cannot be written")


def test_what_is_read_is_never_written(run, folder, diagnosed, tmp_path):
    spare, model = tmp_path / "spare", tmp_path / "model.json"
    shutil.copytree(folder, spare)
    model.write_bytes(diagnosed.model.read_bytes())
    before = {f: f.read_bytes() for f in (*spare.iterdir(), model) if f.is_file()}
    for name in ("campaign.toml", "measurements.csv", "robot.urdf"):
        for option, ending in (("--json", ".json"), ("--model", ".json"), ("--report", ".html")):
            refused(run("diagnose", spare, option, spare / name), name, "by its ending")
            link = tmp_path / f"{name}{ending}"
            link.unlink(missing_ok=True)
            link.symlink_to(spare / name)
            refused(run("diagnose", spare, option, link), link.name, "would be overwritten")
    (tmp_path / "link.csv").symlink_to(spare / "fresh.csv")
    (tmp_path / "model.csv").symlink_to(model)
    for target in (spare / "fresh.csv", tmp_path / "model.csv", tmp_path / "link.csv"):
        refused(run("predict", model, spare / "fresh.csv", "-o", target), target.name, "would be overwritten")
    refused(run("diagnose", spare, "--json", tmp_path / "a", "--model", tmp_path / "a"), "two outputs")
    assert before == {f: f.read_bytes() for f in before}


def test_an_output_that_fails_does_not_take_the_others_with_it(run, folder, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("thermal_robot.report.html", full)
    outputs = {option: tmp_path / option.strip("-") for option in ("--json", "--report", "--model")}
    status, out, err = run("diagnose", folder, *FEW, *(word for pair in outputs.items() for word in pair))
    assert (status, out.startswith("The gap of")) == (2, True)
    assert str(outputs["--report"]) in err
    assert "No space left on device" in err
    assert json.loads(outputs["--json"].read_text())["schema"]
    CorrectedModel.load(outputs["--model"])
    assert not outputs["--report"].exists()


@pytest.mark.slow
def test_the_demo_prints_and_draws(run, tmp_path, monkeypatch):
    page = tmp_path / "demo.html"
    status, out, err = run("demo", "--report", page)
    assert (status, err) == (0, "")
    assert str(page) in out
    html = page.read_text(encoding="utf-8")
    for effect in json.loads((demo_directory() / "truth.json").read_text())["effects"]:
        assert effect in out
        assert effect in html
    monkeypatch.chdir(tmp_path)
    status, out, err = run("demo", "-q")
    assert (status, out.count("\n"), err) == (0, 1, "")
    assert out.startswith("The gap of ")


@pytest.mark.slow
def test_the_program_itself_exits_as_it_should(folder, tmp_path):
    def program(*arguments):
        command = [sys.executable, "-m", "thermal_robot.cli", *map(str, arguments)]
        asked = {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
        done = subprocess.run(command, capture_output=True, cwd=tmp_path, env={**os.environ, **asked}, timeout=120)
        return done.returncode, done.stdout.decode(), done.stderr.decode()

    status, out, err = program("check", folder)
    assert (status, err) == (0, "")
    assert "m/s?" in out  # a letter that the terminal lacks is no failure
    refused(program("diagnose", "absent"), "absent")
    assert list(tmp_path.iterdir()) == []


def test_a_table_that_is_at_fault_is_bad_input_and_gives_no_model(run, poses, tmp_path, diagnosed_once):
    campaign = read_campaign(poses)
    spoilt = replace(campaign, q=campaign.q * np.where(np.arange(campaign.robot.n) == 2, -1.0, 1.0))
    write_campaign(spoilt, tmp_path / "cell")
    done = diagnosed_files(tmp_path / "cell", tmp_path, diagnosed_once)
    assert done.status == cli.BAD_INPUT
    assert done.complaint.count("\n") == 1
    assert "joint_3 is reversed" in done.complaint
    assert done.text.startswith("The table is at fault, not the robot: joint_3 is reversed")
    plain = json.loads(done.json.read_text())
    jsonschema.validate(plain, schema())
    assert plain["verdict"]["usable"] is False
    assert (done.report.exists(), done.model.exists()) == (True, False)
    status, out, err = run("diagnose", tmp_path / "cell", "--json", "-")
    assert (status, err.count("\n"), json.loads(out)) == (2, 1, plain)


def test_effects_are_listed_with_what_they_need(run, folder):
    status, listed, err = run("effects")
    assert (status, err) == (0, "")
    told = {line.split()[0]: line for line in listed.splitlines()[1:]}
    assert set(told) == {*library(), *RANDOM}
    assert told["thermal_elongation"].endswith("; needs temperature")
    assert told["tracking_lag"].endswith("; needs velocity.<joint>")
    assert "needs" not in told["geometric"]
    assert run("effects", "-q") == (0, listed, "")  # the list is what was asked for
    assert "needs temperature\n" not in run("effects", folder)[1]  # it was recorded
    refused(run("effects", folder / "absent"), "absent")


def test_any_file_of_a_diagnosis_may_be_printed_instead_of_the_text(run, folder, tmp_path, monkeypatch):
    few = ("diagnose", folder, *FEW)
    assert run(*few, "--model", tmp_path / "m.json")[0] == 0
    assert run(*few, "--model", "-") == (0, (tmp_path / "m.json").read_text(), "")
    status, out, _ = run(*few, "--report", "-", "--json", tmp_path / "d.json", "-v")
    assert status == 0
    assert out.lower().startswith("<!doctype html>")
    assert out.rstrip().endswith("</html>")
    refused(run(*few, "--report", "-", "--json", "-"), "one standard output", "json", "report")
    monkeypatch.chdir(tmp_path)
    assert run(*few, "--json", "./-")[1].startswith("The gap of")
    assert (tmp_path / "-").read_text() == (tmp_path / "d.json").read_text()


def test_quiet_prints_the_result_alone_and_verbose_the_stages(run, folder, tmp_path):
    asked = ("diagnose", folder, *FEW, "--json", tmp_path / "d.json")
    status, out, err = run(*asked, "-q")
    assert (status, err) == (0, "")
    assert out == json.loads((tmp_path / "d.json").read_text())["verdict"]["summary"] + "\n"
    assert run("-q", *asked) == (0, out, "")
    status, out, err = run(*asked, "-v")
    assert (status, out) == run(*asked)[:2]
    stages = [line.split(" s  ")[1] for line in err.splitlines()]
    assert (stages[0], stages[-1]) == ("reading the campaign", "done")
    assert len(stages) > 5


def test_a_campaign_on_standard_input_has_its_paths_in_the_current_folder(run, folder, stdin, monkeypatch):
    monkeypatch.chdir(folder)
    for command in ("check", "effects"):
        stdin(folder / "campaign.toml")
        status, out, err = run(command, "-")
        assert (status, err) == (0, "")
        assert out.splitlines()[1:] == run(command, folder)[1].splitlines()[1:]  # but for its name
    for given in ((*FEW, "-"), ("-", *FEW)):
        stdin(folder / "campaign.toml")
        assert run("diagnose", "-q", *given) == run("diagnose", folder, "-q", *FEW)
    stdin(folder / "campaign.toml")
    refused(run("diagnose", "-", "--json", "robot.urdf"), "robot.urdf", "by its ending")
    stdin((folder / "campaign.toml").read_bytes().replace(b'"tool0"', b'"tool_0"'))
    refused(run("check", "-"), "standard input, [robot]", "'tool_0'", "tool0")
    stdin(folder / "measurements.csv")
    refused(run("check", "-"), "standard input", "TOML")


@pytest.fixture(scope="module")
def repeated(rv_m2, tmp_path_factory):
    """Three poses at rest, 0.3, 0.7 and 0.5 mm off, with RP_l of 0.11 mm; the same as points of a path."""
    off = 1e-4 * np.array([[1, 2, 2], [2, 3, 6], [0, 3, 4]])
    number, cycle = np.tile(np.arange(3), 20), np.repeat(np.arange(20), 3) % 10
    path = {"path": np.where(np.arange(60) < 30, "", "seam")}
    folder = tmp_path_factory.mktemp("repeated")
    write_campaign(cell(rv_m2, number, off[number] + 0.01 * ELEVEN[cycle], labels=path), folder)
    return folder


def test_the_table_of_iso_9283_and_its_files_say_the_same(run, repeated, tmp_path):
    status, out, err = run("iso9283", repeated, "--json", tmp_path / "c.json", "--csv", tmp_path / "c.csv")
    assert (status, err) == (0, "")
    rows = {line.split()[0]: line.split() for line in out.splitlines() if line.startswith("  ") and len(line) > 5}
    assert rows["P2"][3:8] == ["0.700", "0.200", "0.300", "0.600", "0.110"]
    assert rows["seam"][1:] == ["3", "10", "0.700", "0.110"]
    plain = json.loads((tmp_path / "c.json").read_text())
    assert [p["accuracy"]["position"] for p in plain["poses"]] == pytest.approx([3e-4, 7e-4, 5e-4])
    frame = pd.read_csv(tmp_path / "c.csv").set_index(["label", "criterion"])["value"]
    assert frame["P3", "RP_l"] == pytest.approx(1.1e-4)
    assert frame["seam", "AT_p"] == pytest.approx(7e-4)
    status, out, _ = run("iso9283", "-q", repeated)
    assert (status, out.count("\n")) == (0, 1)
    assert "3 poses of 10 cycles (the standard: 30), and 1 path of 10 cycles (the standard: 10): AP_p 0.700 mm" in out
    assert run("iso9283", repeated, "--csv", "-") == (0, (tmp_path / "c.csv").read_text(), "")
    assert run("iso9283", repeated, "--json", "-") == (0, (tmp_path / "c.json").read_text(), "")


def test_a_campaign_without_repeats_is_bad_input_that_names_the_column(run, folder, repeated, tmp_path):
    refused(run("iso9283", folder), "column 'pose'", "no pose is repeated", "30 of each")
    refused(run("iso9283", tmp_path / "absent"), "absent")
    refused(run("iso9283", repeated, "--csv", repeated / "measurements.csv"), "would be overwritten")
    refused(run("iso9283", repeated, "--json", tmp_path / "no" / "c.json"), "cannot be written")
