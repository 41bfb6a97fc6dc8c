"""The command line: exit status, one line for bad input, files that hold what was asked for."""

import csv
import io
import json
import os
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from types import SimpleNamespace

import jsonschema
import numpy as np
import pandas as pd
import pytest
from simulate import simulate

from thermal_robot import CorrectedModel, __version__, cli, read_campaign
from thermal_robot.campaign import write_campaign
from thermal_robot.campaign.write import write_table
from thermal_robot.datasets import demo_directory
from thermal_robot.effects import RANDOM, library
from thermal_robot.report import schema

NOISE = 25e-6
PLACE, STD = ["x", "y", "z"], ["std.x", "std.y", "std.z"]


@pytest.fixture(scope="module")
def folder(rv_m2, tmp_path_factory):
    """A campaign in files, with further samples and their true places in millimetres."""
    directory = tmp_path_factory.mktemp("cell")
    campaign, truth, (fresh, place) = simulate(rv_m2, ["thermal_elongation"], seed=0, outliers=0.03, fresh=30)
    write_campaign(campaign, directory)
    write_table(fresh, directory / "fresh.csv")
    np.savetxt(directory / "fresh_truth_mm.txt", 1e3 * place)
    (directory / "truth.json").write_text(json.dumps(truth))
    return directory


@pytest.fixture(scope="module")
def poses(rv_m2, tmp_path_factory):
    """The same with orientations."""
    directory = tmp_path_factory.mktemp("poses")
    campaign, _, (fresh, _) = simulate(rv_m2, ["joint_offset"], seed=1, samples=60, turning=3e-5, fresh=30)
    write_campaign(campaign, directory)
    write_table(fresh, directory / "fresh.csv")
    return directory


def diagnosed_once(folder, out):
    """Run `diagnose` with every file that it can write; give status, text, complaint and the files' paths."""
    files = {"json": out / "d.json", "report": out / "r.html", "model": out / "m.json"}
    wanted = [word for kind, path in files.items() for word in (f"--{kind}", str(path))]
    text, complaint = io.StringIO(), io.StringIO()
    with redirect_stdout(text), redirect_stderr(complaint):
        status = cli.main(["diagnose", str(folder), *wanted])
    return SimpleNamespace(status=status, text=text.getvalue(), complaint=complaint.getvalue(), **files)


@pytest.fixture(scope="module")
def diagnosed(folder, tmp_path_factory):
    return diagnosed_once(folder, tmp_path_factory.mktemp("diagnosed"))


@pytest.fixture(scope="module")
def diagnosed_poses(poses, tmp_path_factory):
    return diagnosed_once(poses, tmp_path_factory.mktemp("diagnosed"))


@pytest.fixture
def run(capsys):
    """Run a command; give its status, what it printed, and its complaint."""

    def run(*arguments):
        status = cli.main([str(a) for a in arguments])
        return status, *capsys.readouterr()

    return run


def refused(result, *words):
    """Assert that a command said in one plain line what is wrong with its input."""
    status, out, err = result
    assert status == 2
    assert out == ""
    assert err.startswith("thermal-robot: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    for word in words:
        assert str(word) in err, f"{word} is not in: {err}"


def test_check_describes_a_campaign(run, folder):
    status, out, err = run("check", folder)
    assert (status, err) == (0, "")
    assert "120" in out
    assert all(joint in out for joint in read_campaign(folder).robot.joint_names)
    assert run("check", folder / "campaign.toml") == (0, out, "")


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


def table(path):
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=float)


def test_predict_writes_the_same_rows_in_order_and_nothing_else(run, folder, diagnosed, tmp_path):
    model, out = diagnosed.model, tmp_path / "p.csv"
    assert run("predict", model, folder / "fresh.csv", "-o", out) == (0, "", "")
    own, written = (pd.read_csv(file, dtype=str) for file in (folder / "fresh.csv", out))
    kept = [name for name in own.columns if name not in PLACE]
    assert list(written.columns) == [*kept, *PLACE, *STD, "outside"]
    pd.testing.assert_frame_equal(written[kept], own[kept])  # as they stand, to the last digit
    predicted, std = (written[columns].to_numpy(float) for columns in (PLACE, STD))
    truth = np.loadtxt(folder / "fresh_truth_mm.txt")
    assert predicted.shape == truth.shape == (30, 3)
    assert np.sqrt(((predicted - truth) ** 2).mean()) < 0.5e3 * NOISE
    assert (np.abs(predicted - truth) < 1.96 * std).mean() > 0.85
    assert run("predict", "--noise", model, folder / "fresh.csv", "-o", out) == (0, "", "")
    assert (pd.read_csv(out)[STD].to_numpy() > std).all()
    # the campaign's own table, measured columns and all, is as good a table of samples
    assert run("predict", model, folder / "measurements.csv", "--output", out)[0] == 0
    again = pd.read_csv(out)
    assert [list(again.columns).count(name) for name in (*PLACE, *STD)] == [1] * 6
    assert len(again) == 120


def test_predict_writes_quaternions_for_poses(run, poses, diagnosed_poses, tmp_path):
    model, out = diagnosed_poses.model, tmp_path / "p.csv"
    assert run("predict", model, poses / "fresh.csv", "-o", out) == (0, "", "")
    predicted = pd.read_csv(out)
    assert len(predicted) == 30
    np.testing.assert_allclose(np.linalg.norm(predicted[["qw", "qx", "qy", "qz"]], axis=1), 1.0, atol=1e-12)


def test_units_of_the_campaign_are_units_of_its_prediction(run, folder, diagnosed, tmp_path):
    campaign = read_campaign(folder)
    other = replace(campaign, units=type(campaign.units)("deg", "um"))
    write_campaign(other, tmp_path / "um")
    header, degrees = table(tmp_path / "um" / "measurements.csv")
    assert np.abs(degrees[:, header.index("joint_1")]).max() > 10.0
    assert run("diagnose", tmp_path / "um", "--model", tmp_path / "m.json")[0] == 0
    places = []
    for where, model in ((folder, diagnosed.model), (tmp_path / "um", tmp_path / "m.json")):
        assert run("predict", model, where / "measurements.csv", "-o", tmp_path / "p.csv")[0] == 0
        places.append(pd.read_csv(tmp_path / "p.csv")[[*PLACE, *STD]].to_numpy())
    np.testing.assert_allclose(places[1], 1e3 * places[0], rtol=0, atol=1e-2)


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


def test_predict_says_what_it_misses(run, folder, diagnosed, tmp_path):
    model = diagnosed.model
    header, *rows = (folder / "fresh.csv").read_text().splitlines()
    at = header.split(",").index("temperature")
    less = [",".join(c for k, c in enumerate(line.split(",")) if k != at) for line in (header, *rows)]
    (tmp_path / "less.csv").write_text("\n".join(less))
    refused(run("predict", model, tmp_path / "less.csv", "-o", tmp_path / "p.csv"), "less", "'temperature'")
    assert not (tmp_path / "p.csv").exists()
    refused(run("predict", folder / "truth.json", folder / "fresh.csv", "-o", tmp_path / "p.csv"), "truth.json")
    refused(run("predict", model, tmp_path / "absent.csv", "-o", tmp_path / "p.csv"), "absent.csv")
    refused(run("predict", model, folder / "fresh.csv", "-o", tmp_path / "no" / "p.csv"), "p.csv", "cannot be written")


def test_predict_names_the_file_that_misses_a_column(run, folder, diagnosed, tmp_path):
    model, samples = diagnosed.model, tmp_path / "less.csv"
    lines = (folder / "fresh.csv").read_text().splitlines()
    joints = len(read_campaign(folder).robot.joint_names)
    samples.write_text("\n".join(",".join(line.split(",")[:joints]) for line in lines))
    refused(run("predict", model, samples, "-o", tmp_path / "p.csv"), samples, "'temperature'")


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

    monkeypatch.setattr("thermal_robot.cli._page", full)
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


def test_predict_writes_parquet_where_the_name_says_so(run, folder, diagnosed, tmp_path):
    for out in (tmp_path / "p.csv", tmp_path / "p.parquet"):
        assert run("predict", diagnosed.model, folder / "fresh.csv", "-o", out) == (0, "", "")
    written = pd.read_csv(tmp_path / "p.csv")
    frame = pd.read_parquet(tmp_path / "p.parquet")
    written["outside"] = written["outside"].fillna("").astype(frame["outside"].dtype)
    pd.testing.assert_frame_equal(frame, written, check_dtype=False)


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


@pytest.mark.parametrize("text", ['<xacro:leftover name="x"/>', "<!-- lengths -- from the data sheet -->"])
def test_check_takes_a_urdf_that_pinocchio_takes(run, folder, tmp_path, text):
    copied = tmp_path / "cell"
    shutil.copytree(folder, copied)
    urdf = (folder / "robot.urdf").read_text(encoding="utf-8")
    (copied / "robot.urdf").write_text(urdf.replace("</robot>", f"{text}\n</robot>"), encoding="utf-8")
    status, out, err = run("check", copied)
    assert (status, err) == (0, "")
    assert out.splitlines()[1:] == run("check", folder)[1].splitlines()[1:]  # but for the folder's name


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


@pytest.fixture
def stdin(monkeypatch):
    def stdin(file):
        content = file.read_bytes() if hasattr(file, "read_bytes") else file
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))

    return stdin


def test_quiet_prints_the_result_alone(run, folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ("diagnose", folder, "--only", "thermal_elongation", "drift", "--json", tmp_path / "d.json")
    status, out, err = run(*asked, "-q")
    assert (status, err) == (0, "")
    assert out == json.loads((tmp_path / "d.json").read_text())["verdict"]["summary"] + "\n"
    assert run("-q", *asked) == (0, out, "")
    assert run("check", folder, "-q") == (0, "", "")
    assert run("effects", "-q") == run("effects")  # the list is what was asked for
    refused(run("check", tmp_path / "absent", "-q"), "absent")
    status, out, err = run("demo", "-q")
    assert (status, out.count("\n"), err) == (0, 1, "")
    assert out.startswith("The gap of ")


def test_verbose_tells_the_stages_and_changes_no_result(run, folder):
    asked = ("diagnose", folder, "--only", "thermal_elongation", "drift")
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
    few = ("--only", "thermal_elongation", "drift")
    for given in ((*few, "-"), ("-", *few)):
        stdin(folder / "campaign.toml")
        status, out, err = run("diagnose", "-q", *given)
        assert (status, out, err) == run("diagnose", folder, "-q", *few)
    stdin(folder / "campaign.toml")
    refused(run("diagnose", "-", "--json", "robot.urdf"), "robot.urdf", "would be overwritten")
    stdin((folder / "campaign.toml").read_bytes().replace(b'"tool0"', b'"tool_0"'))
    refused(run("check", "-"), "standard input, [robot]", "'tool_0'", "tool0")
    stdin(folder / "measurements.csv")
    refused(run("check", "-"), "standard input", "TOML")


def test_predict_reads_and_writes_streams(run, folder, diagnosed, stdin, tmp_path):
    model, samples, out = diagnosed.model, folder / "fresh.csv", tmp_path / "p.csv"
    assert run("predict", model, samples, "-o", out) == (0, "", "")
    stdin(samples)
    assert run("predict", model, "-", "-o", "-") == (0, out.read_text(), "")
    stdin(model)
    assert run("predict", "-", samples, "-o", tmp_path / "again.csv") == (0, "", "")
    assert (tmp_path / "again.csv").read_text() == out.read_text()
    refused(run("predict", "-", "-", "-o", out), "one standard input", "model", "samples")
    lines = samples.read_text().splitlines()
    stdin("\n".join([*lines[:3], "wrong," + lines[3].split(",", 1)[1]]).encode())
    refused(run("predict", model, "-", "-o", "-"), "standard input, row 4", "wrong")


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
