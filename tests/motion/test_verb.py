"""The one verb reads campaigns and logs in one place, and the command does the same."""

import json
import re
from dataclasses import replace

import pytest
from motion.found import found, simulated, table_of

import thermal_robot as tr
from thermal_robot import cli, diagnosing
from thermal_robot.campaign import write_campaign
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.motion.read import declares_motion, files_of

TOML = '[robot]\nurdf = "builtin:rv_m2"\ntool_frame = "tool0"\n[motion]\nlog = "log.csv"\nangle_unit = "rad"\n'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "motion.toml").write_text(TOML)
    table_of(simulated()).to_csv(tmp_path / "log.csv", index=False)
    return tmp_path


@pytest.fixture
def asked(monkeypatch):
    """What the engine is asked; it answers with what is known beforehand."""
    calls = []

    def answer(log, *, only, without, progress):
        progress("plain servos")
        calls.append((log, only, without))
        return replace(found(), log=log, summary="", advice="")

    monkeypatch.setattr(diagnosing, "diagnose_motion", answer)
    return calls


def test_a_log_a_file_and_its_folder_are_diagnosed_alike(folder, asked):
    log = tr.read_motion(folder)
    for given in (log, folder, folder / "motion.toml", str(folder)):
        d = tr.diagnose(given, only="lag", without=["gain"])
        assert isinstance(d, tr.MotionDiagnosis)
        assert d.summary.startswith("The joints miss the command by")
    assert [call[1:] for call in asked] == [(("lag",), ("gain",))] * 4
    assert {call[0].joints for call in asked} == {log.joints}


def test_the_stages_are_told(folder, asked):
    stages = []
    tr.diagnose(folder, progress=stages.append)
    assert stages == ["reading the log", "plain servos"]


def test_a_campaign_is_read_as_before(tmp_path):
    write_campaign(tr.demo_campaign(), tmp_path / "cell")
    assert not declares_motion(tmp_path / "cell")
    assert isinstance(diagnosing.read(tmp_path / "cell"), tr.Campaign)


def test_what_makes_no_sense_for_motion_is_refused(folder, asked):
    with pytest.raises(EffectError, match="of poses"):
        tr.diagnose(folder, effects=[object()])
    with pytest.raises(CampaignError, match="names no effect"):
        tr.diagnose(folder, only=[])
    assert asked == []


def test_the_command_prints_and_writes(folder, asked, capsys):
    status = cli.main(["diagnose", str(folder), "--json", str(folder / "d.json"), "--report", str(folder / "r.html"),
                       "--without", "gain"])  # fmt: skip
    out = capsys.readouterr().out
    assert status == 0
    assert asked[0][2] == ("gain",)
    assert "HOW FAR" in out
    assert json.loads((folder / "d.json").read_text(encoding="utf-8"))["campaign"]["measures"] == "motion"
    page = (folder / "r.html").read_text(encoding="utf-8")
    assert dict(re.findall(r"<li>(\S+) <code>(\w{64})</code></li>", page)).keys() == {"motion.toml", "log.csv"}
    assert files_of(folder) == [folder / "motion.toml", folder / "log.csv"]


def test_bad_input_is_said_in_one_line(folder, capsys):
    for arguments, said in (
        (["diagnose", str(folder), "--model", "m.json"], "no model"),
        (["diagnose", str(folder), "--json", str(folder / "log.csv")], "is no JSON file by its ending"),
        (["compare", str(folder), str(folder), "--report", "c.html"], "no page"),
    ):
        assert cli.main(arguments) == 2
        complaint = capsys.readouterr().err
        assert said in complaint
        assert complaint.count("\n") == 1


def test_the_command_compares_two_logs(folder, asked, capsys):
    assert cli.main(["compare", str(folder), str(folder), "--json", str(folder / "c.json")]) == 0
    assert "Nothing changed between" in capsys.readouterr().out
    assert json.loads((folder / "c.json").read_text(encoding="utf-8"))["parameters"]
