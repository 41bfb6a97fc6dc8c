"""What commands share: how loud they are, and where the paths of a campaign start."""

import hashlib
import json
import re

from commanded import refused


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


def test_a_report_names_its_files_with_their_checksums(run, folder, tmp_path):
    page = tmp_path / "page.html"
    assert run("diagnose", folder, "--only", "thermal_elongation", "drift", "--report", page)[0] == 0
    told = page.read_text(encoding="utf-8")
    listed = dict(re.findall(r"<li>(\S+) <code>(\w+)</code></li>", told))
    assert {"campaign.toml", "robot.urdf"} <= set(listed)
    for name, checksum in listed.items():
        assert checksum == hashlib.sha256((folder / name).read_bytes()).hexdigest()
