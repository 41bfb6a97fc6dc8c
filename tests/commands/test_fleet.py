"""`thermal-robot fleet`: a table, a page and a summary of many campaigns; errors of one line."""

import json
import sys

import pandas as pd
import pytest
from fleet.robots import ONLY, write_fleet

pytestmark = pytest.mark.filterwarnings("default")


def test_a_fleet_is_diagnosed_printed_and_written(run, rv_m2, tmp_path):
    root, out = write_fleet(rv_m2, tmp_path / "all", 3), tmp_path / "out"
    command = ("fleet", root, "--out", out, "--labels", "hall", "robot", "--workers", "2", "--only", *ONLY)
    status, printed, err = run(*command)
    assert status == 0
    assert printed.startswith("3 campaigns of 3 robots: 3 diagnosed.\n")
    assert "campaigns: 3 of 3" in err
    assert {file.name for file in out.iterdir()} == {"done.sqlite", "fleet.html", "fleet.json", "fleet.parquet"}
    assert json.loads((out / "fleet.json").read_text())["campaigns"] == 3
    assert "3 campaigns of 3 robots" in (out / "fleet.html").read_text()
    assert set(pd.read_parquet(out / "fleet.parquet")["hall"]) == {"hall_0", "hall_1"}
    assert run("-q", *command) == (0, "3 campaigns of 3 robots: 3 diagnosed.\n", "")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("empty",), "no campaign.toml lies below this folder"),
        (("nowhere",), "no such folder or list"),
        (("all", "--workers", "0"), "at least 1"),
        (("all", "--only", "backlsh"), "backlash"),
        (("all", "--scheduler", "nonsense://x"), "scheduler nonsense://x"),
    ],
)
def test_bad_input_is_one_line(run, rv_m2, tmp_path, arguments, named):
    write_fleet(rv_m2, tmp_path / "all", 1)
    (tmp_path / "empty").mkdir()
    status, out, err = run("fleet", tmp_path / arguments[0], "--out", tmp_path / "out", *arguments[1:])
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert named in err


def test_without_its_extra_it_says_what_to_install(run, rv_m2, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    root = write_fleet(rv_m2, tmp_path / "all", 1)
    status, _, err = run("fleet", root, "--out", tmp_path / "out")
    assert (status, err.count("\n")) == (2, 1)
    assert "pip install 'thermal-robot[fleet]'" in err
