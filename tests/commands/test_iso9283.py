"""`thermal-robot iso9283`: the table, its files, and what it says of a campaign without repeats."""

import json

import numpy as np
import pandas as pd
import pytest
from clouds import ELEVEN, cell
from commanded import refused

from thermal_robot.campaign import write_campaign

OFF = 1e-4 * np.array([[1, 2, 2], [2, 3, 6], [0, 3, 4]])


@pytest.fixture(scope="module")
def repeated(rv_m2, tmp_path_factory):
    """Three poses at rest, 0.3, 0.7 and 0.5 mm off, with RP_l of 0.11 mm; the same as points of a path."""
    number, cycle = np.tile(np.arange(3), 20), np.repeat(np.arange(20), 3) % 10
    path = {"path": np.where(np.arange(60) < 30, "", "seam")}
    campaign = cell(rv_m2, number, OFF[number] + 0.01 * ELEVEN[cycle], labels=path)
    folder = tmp_path_factory.mktemp("repeated")
    write_campaign(campaign, folder)
    return folder


def test_the_table_and_its_files_say_the_same(run, repeated, tmp_path):
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


def test_quiet_tells_the_worst_in_a_line_and_streams_are_served(run, repeated):
    status, out, _ = run("iso9283", "-q", repeated)
    assert (status, out.count("\n")) == (0, 1)
    assert "3 poses of 10 cycles (the standard: 30), and 1 path of 10 cycles (the standard: 10): AP_p 0.700 mm" in out
    status, out, _ = run("iso9283", repeated, "--csv", "-")
    assert (status, out.split(",")[0]) == (0, "label")
    status, out, _ = run("iso9283", repeated, "--json", "-")
    assert json.loads(out)["schema"] == "thermal-robot/iso9283/1"


def test_a_campaign_without_repeats_is_bad_input_that_names_the_column(run, folder, repeated, tmp_path):
    refused(run("iso9283", folder), "column 'pose'", "no pose is repeated", "30 of each")
    refused(run("iso9283", tmp_path / "absent"), "absent")
    refused(run("iso9283", repeated, "--csv", repeated / "measurements.csv"), "would be overwritten")
    refused(run("iso9283", repeated, "--json", tmp_path / "no" / "c.json"), "cannot be written")
