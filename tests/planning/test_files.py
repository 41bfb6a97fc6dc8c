"""A plan as files: its folder becomes a campaign once it is filled in, and is never written over."""

import csv

import numpy as np
import pytest

from thermal_robot import CampaignError, observe, read_campaign
from thermal_robot.campaign import Units
from thermal_robot.planning import plan, write_plan


def read(file):
    with file.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def filled_in(folder, positions_mm, temperatures):
    rows = read(folder / "measurements.csv")
    for row, place, warm in zip(rows, positions_mm, temperatures, strict=True):
        row |= dict(zip("xyz", place.tolist(), strict=True)) | {"temperature": warm}
    with (folder / "measurements.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def test_a_folder_that_is_filled_in_is_the_campaign_that_was_planned(rv_m2, tmp_path):
    made = plan(rv_m2, 24, repeats=2, target=(0.05, 0.0, 0.1), loads=(1.0,), units=Units("deg", "mm"))
    commands = made.commands
    file = write_plan(made, tmp_path / "cell")
    assert file == tmp_path / "cell" / "campaign.toml"
    with pytest.raises(CampaignError, match=r"row 2.*still to be filled in"):
        read_campaign(file)
    place = observe(commands).predicted_position
    filled_in(tmp_path / "cell", 1e3 * place, commands.covariates["temperature"])
    again = read_campaign(file)
    np.testing.assert_allclose(again.q, commands.q, atol=1e-8)
    np.testing.assert_allclose(again.position, place, atol=1e-12)
    assert again.covariates.keys() == commands.covariates.keys()
    for name, values in commands.covariates.items():
        np.testing.assert_allclose(again.covariates[name], values, rtol=1e-8, err_msg=name)
    assert again.labels["pose"].tolist() == commands.labels["pose"].tolist()
    assert (again.noise_position, again.target.tolist()) == (pytest.approx(20e-6), [0.05, 0.0, 0.1])


def test_what_is_recorded_is_left_empty(rv_m2, tmp_path):
    write_plan(plan(rv_m2, 20, ["joint_gain"], orientation=True), tmp_path)
    asked, planned = read(tmp_path / "measurements.csv"), read(tmp_path / "plan.csv")
    for name in ("x", "y", "z", "qw", "qx", "qy", "qz", "temperature"):
        assert {row[name] for row in asked} == {""}
    assert all(float(row["temperature"]) >= 20.0 for row in planned)
    assert [row["joint_1"] for row in asked] == [row["joint_1"] for row in planned]


def test_a_table_has_the_campaigns_columns(rv_m2, tmp_path):
    made = plan(rv_m2, 20, ["joint_gain"], units=Units("deg", "mm"))
    assert write_plan(made, tmp_path / "table.csv") == tmp_path / "table.csv"
    rows = read(tmp_path / "table.csv")
    assert list(rows[0]) == [*rv_m2.joint_names, "time", "temperature", "x", "y", "z"]
    np.testing.assert_allclose([float(row["joint_2"]) for row in rows], np.degrees(made.commands.q[:, 1]), rtol=1e-8)


def test_a_campaign_is_not_written_over(rv_m2, tmp_path):
    made = plan(rv_m2, 20, ["joint_gain"])
    write_plan(made, tmp_path)
    before = (tmp_path / "measurements.csv").read_bytes()
    with pytest.raises(CampaignError, match="already"):
        write_plan(made, tmp_path)
    assert (tmp_path / "measurements.csv").read_bytes() == before


def test_a_folder_that_cannot_be_made_is_told(rv_m2, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CampaignError, match="cannot be written"):
        write_plan(plan(rv_m2, 20, ["joint_gain"]), tmp_path / "file")
