"""Commands of several campaigns: compare, wear and fleet; what is printed, written and refused."""

import json
import sys

import pandas as pd
import pytest
from compared import ONLY, campaign, moved
from fleet.robots import ONLY as FLEET_ONLY
from fleet.robots import write_fleet

import thermal_robot as tr
from thermal_robot.campaign import write_campaign

DATES = ("2026-01-01", "2026-02-01", "2026-03-01")


def told(result, *words):
    """Assert that bad input is told in one line, and nothing is printed."""
    status, out, err = result
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert all(word in err for word in words), err


@pytest.fixture(scope="module")
def days(tmp_path_factory):
    root = tmp_path_factory.mktemp("days")
    write_campaign(campaign(1), root / "before")
    write_campaign(campaign(3, moved(4e-4)), root / "after")
    arm = tr.load_robot("example-robot-data:ur5", "tool0")
    write_campaign(tr.simulate(arm, rows=40, noise=3e-5), root / "other")
    return root


def test_compare_prints_the_text_and_writes_json_and_page(run, days, tmp_path):
    files = ("--json", tmp_path / "c.json", "--report", tmp_path / "c.html")
    status, out, err = run("compare", days / "before", days / "after", *files, "--only", *ONLY)
    assert status == 0, err
    plain = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    assert plain["summary"].startswith(out.splitlines()[0])
    assert [(c["effect"], c["place"], c["since"]) for c in plain["changes"]] == [("joint_offset", "joint_3", "after")]
    assert "zero offset, joint_3" in (tmp_path / "c.html").read_text(encoding="utf-8")
    status, out, _ = run("compare", "-q", "--only", *ONLY, days / "before", days / "before")
    assert (status, out.count("\n")) == (0, 1)
    assert out.startswith("Nothing changed")


def test_one_campaign_and_another_robot_are_bad_input(run, days, tmp_path):
    told(run("compare", days / "before"), "two campaigns or more")
    asked = ("--only", "joint_offset", "--json", tmp_path / "c.json")
    told(run("compare", days / "before", days / "other", *asked), "joints differ")
    assert not (tmp_path / "c.json").exists()
    assert run("compare", days / "before", days / "none")[0] == 2


@pytest.mark.slow
def test_a_model_file_stands_for_its_campaign(run, days, tmp_path):
    model, page = tmp_path / "before.model.json", tmp_path / "c.html"
    assert run("diagnose", days / "before", "--only", *ONLY, "--model", model)[0] == 0
    status, out, _ = run("compare", model, days / "after", "--only", *ONLY, "--report", page)
    assert status == 0
    assert "joint_3 changed since after" in " ".join(out.split())
    assert "before.model.json: A model file" in out
    assert "before.model.json" in page.read_text(encoding="utf-8")  # with its checksum
    model.write_text(model.read_text().replace("joint_offset", "joint_offsat"))
    told(run("compare", model, days / "after"), "joint_offsat")


@pytest.fixture(scope="module")
def worn(rv_m2, tmp_path_factory):
    made = []
    for k, zero in enumerate((1e-3, 1e-3, 1.5e-3)):
        known = dict(rows=40, noise=2e-5, seed=k, base_known=True, tool_known=True)
        folder = tmp_path_factory.mktemp(f"run_{k}")
        write_campaign(tr.simulate(rv_m2, {"joint_offset": {"joint_3": zero}}, **known), folder)
        made.append(folder)
    return made


def test_wear_is_told_as_text_json_and_page(run, worn, tmp_path):
    asked = ("wear", *worn, "--dates", *DATES, "--only", "joint_offset", "--limit", "joint_offset=0.002")
    status, out, err = run(*asked, "--json", tmp_path / "wear.json", "--report", tmp_path / "wear.html")
    assert (status, err) == (0, "")
    assert "zero offset, joint_3 jumped by" in out
    found = json.loads((tmp_path / "wear.json").read_text(encoding="utf-8"))
    assert found["parameters"][0]["alarm"]
    assert found["parameters"][0]["crossing"]["limit"] == 0.002
    assert "<svg" in (tmp_path / "wear.html").read_text(encoding="utf-8")
    status, out, _ = run("wear", *worn, "--only", "joint_offset", "--false-alarm", "0.05", "--json", "-")
    assert (status, json.loads(out)["false_alarm"]) == (0, 0.05)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--limit", "backlash"), "EFFECT=VALUE"),
        (("--dates", "2026-01-01"), "1 dates for 3 campaigns"),
        (("--limit", "backlsh=1"), "did you mean 'backlash'"),
    ],
)
def test_what_wear_cannot_follow_is_one_line(run, worn, more, said):
    told(run("wear", *worn, *more), said)


@pytest.mark.filterwarnings("default")
def test_a_fleet_is_diagnosed_printed_and_written(run, rv_m2, tmp_path):
    root, out = write_fleet(rv_m2, tmp_path / "all", 3), tmp_path / "out"
    command = ("fleet", root, "--out", out, "--labels", "hall", "robot", "--workers", "1", "--only", *FLEET_ONLY)
    status, printed, err = run(*command)
    assert status == 0
    assert printed.startswith("3 campaigns of 3 robots: 3 diagnosed.\n")
    assert "campaigns: 3 of 3" in err
    assert {file.name for file in out.iterdir()} == {"done.sqlite", "fleet.html", "fleet.json", "fleet.parquet"}
    assert json.loads((out / "fleet.json").read_text())["campaigns"] == 3
    assert "3 campaigns of 3 robots" in (out / "fleet.html").read_text()
    assert set(pd.read_parquet(out / "fleet.parquet")["hall"]) == {"hall_0", "hall_1"}
    assert run("-q", *command) == (0, "3 campaigns of 3 robots: 3 diagnosed.\n", "")


@pytest.mark.filterwarnings("default")
def test_a_fleet_that_cannot_be_diagnosed_is_one_line(run, rv_m2, tmp_path, monkeypatch):
    write_fleet(rv_m2, tmp_path / "all", 1)
    for source, more, said in (
        ("nowhere", (), "no such folder or list"),
        ("all", ("--workers", "0"), "at least 1"),
        ("all", ("--scheduler", "nonsense://x"), "scheduler nonsense://x"),
    ):
        told(run("fleet", tmp_path / source, "--out", tmp_path / "out", *more), said)
    monkeypatch.setitem(sys.modules, "distributed", None)
    told(run("fleet", tmp_path / "all", "--out", tmp_path / "out"), "pip install 'thermal-robot[fleet]'")
