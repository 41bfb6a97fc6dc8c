"""Files that are written give back what was written, in any unit."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from campaign.files import full

from thermal_robot.campaign import (
    Units,
    read_campaign,
    read_samples,
    with_prediction,
    write_campaign,
    write_predictions,
    write_table,
)
from thermal_robot.campaign.settings import Settings
from thermal_robot.errors import CampaignError
from thermal_robot.robot import load_robot


@pytest.mark.parametrize(
    ("angle", "length"), [("deg", "mm"), ("rad", "m"), ("deg", "um"), ("deg", "inch"), ("rad", "in"), ("rad", "ft")]
)
def test_reading_again_gives_the_same(tmp_path: Path, angle: str, length: str) -> None:

    campaign = dataclasses.replace(full(), units=Units(angle, length), name="copy")
    again = read_campaign(write_campaign(campaign, tmp_path / "copy"))
    for name in ("q", "position", "orientation", "simulated_position", "simulated_orientation", "target"):
        np.testing.assert_allclose(getattr(again, name), getattr(campaign, name), rtol=1e-12, err_msg=name)
    assert list(again.covariates) == list(campaign.covariates)
    for name, values in campaign.covariates.items():
        np.testing.assert_allclose(again.covariates[name], values, rtol=1e-12, err_msg=name)
    for name, labels in campaign.labels.items():
        assert again.labels[name].tolist() == labels.tolist()
    assert again.extra == campaign.extra
    assert again.name == "copy"
    assert again.robot.joint_names == campaign.robot.joint_names
    for name, value in campaign.settings.to_dict().items():
        assert again.settings.to_dict()[name] == (
            pytest.approx(value, rel=1e-12) if isinstance(value, (float, list)) else value
        )


def test_samples_are_no_campaign_but_have_a_table(tmp_path: Path) -> None:
    campaign, samples = full(), dataclasses.replace(full(), position=None, orientation=None)
    with pytest.raises(CampaignError, match="without measured positions"):
        write_campaign(samples, tmp_path / "copy")
    write_table(samples, tmp_path / "fresh.csv")
    again = read_samples(tmp_path / "fresh.csv", campaign)
    np.testing.assert_allclose(again.q, samples.q, rtol=1e-12)


def predicted(positions, orientations=None, units=None, outside=(), samples=None):
    rows = len(positions)
    frame = pd.DataFrame({"joint_1": np.arange(rows)}) if samples is None else samples
    robot, std = load_robot("builtin:rv_m2", "tool0"), np.full((rows, 3), 1e-5)
    return with_prediction(frame, robot, positions, orientations, std, outside or [()] * rows, units or Units())


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_predictions(tmp_path: Path, ending: str) -> None:
    file, read = tmp_path / f"predicted.{ending}", pd.read_csv if ending == "csv" else pd.read_parquet
    samples = pd.DataFrame({"joint_1": ["0.10", "0.2"], "x": [9.0, 9.0], "note": ["a", "b, c"], " qw ": [1, 1]})
    samples["Y [mm]"] = 9.0  # measured, too, by its header
    outside = [(), ("joint_1", "payload")]
    write_predictions(file, predicted([[1.0, 0.1, -0.25], [0, 0, 1]], None, Units("rad", "mm"), outside, samples))
    frame = read(file)
    assert list(frame.columns) == ["joint_1", "note", "x", "y", "z", "std.x", "std.y", "std.z", "outside"]
    np.testing.assert_allclose(frame[["x", "y", "z"]], [[1000, 100, -250], [0, 0, 1000]], rtol=1e-15)
    np.testing.assert_allclose(frame[["std.x", "std.y", "std.z"]], 0.01, rtol=1e-15)
    assert frame["note"].tolist() == ["a", "b, c"]
    assert frame["outside"].fillna("").tolist() == ["", "joint_1 payload"]
    write_predictions(file, predicted([[1.0, 0.1, -0.25]], [[1, 0, 0, 0]], Units("rad", "um")))
    frame = read(file)
    assert list(frame.columns)[1:8] == ["x", "y", "z", "qw", "qx", "qy", "qz"]
    np.testing.assert_allclose(frame.iloc[:, 1:8], [[1e6, 1e5, -2.5e5, 1, 0, 0, 0]], rtol=1e-15)


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="cannot be written; found No such file or directory"):
        write_predictions(tmp_path / "nowhere" / "p.csv", predicted([[0, 0, 0]]))
    (tmp_path / "taken").write_text("")
    with pytest.raises(CampaignError, match="cannot be written"):
        write_campaign(full(), tmp_path / "taken")


def test_a_second_copy_is_the_first_to_the_last_letter(tmp_path: Path) -> None:
    first = write_campaign(full(), tmp_path / "first").parent
    second = write_campaign(read_campaign(first), tmp_path / "second").parent
    for name in ("campaign.toml", "robot.urdf"):
        assert (first / name).read_text() == (second / name).read_text()
    one, two = (pd.read_csv(folder / "measurements.csv") for folder in (first, second))
    assert list(one.columns) == list(two.columns)
    numbers = one.select_dtypes("number").columns
    np.testing.assert_allclose(two[numbers], one[numbers], rtol=1e-13)


def test_predictions_keep_every_digit(tmp_path: Path) -> None:
    positions = np.random.default_rng(4).normal(size=(50, 3))
    write_predictions(tmp_path / "p.csv", predicted(positions))
    again = pd.read_csv(tmp_path / "p.csv", dtype=str).astype(float)
    np.testing.assert_array_equal(again[["x", "y", "z"]], positions)


def test_the_noise_of_each_row_is_written_and_read_again(tmp_path: Path) -> None:
    whole = full()
    sigmas = np.array([2e-5, 7e-5, 3e-5])
    campaign = dataclasses.replace(whole, noise_position=None, noise_of_rows=sigmas)
    file = write_campaign(campaign, tmp_path / "copy")
    again = read_campaign(file)
    np.testing.assert_allclose(again.noise_of_rows, sigmas, rtol=1e-12)
    assert again.noise_position == pytest.approx(campaign.noise_position, rel=1e-12)
    np.testing.assert_allclose(campaign.to_frame()["noise"], sigmas / campaign.units.length_scale, rtol=1e-12)
    assert "position =" not in file.read_text()


def test_what_a_campaign_says_of_itself_is_kept_as_text(tmp_path: Path) -> None:
    file = write_campaign(full(), tmp_path / "copy")
    text = file.read_text(encoding="utf-8")
    file.write_text(f'{text}\n[about]\nrobot_serial = 20185\ndate = 2026-11-26\noperator = "A. Novák"\n', "utf-8")
    stated = {"robot_serial": "20185", "date": "2026-11-26", "operator": "A. Novák"}
    campaign = read_campaign(file)
    assert campaign.about == stated
    assert Settings.from_dict(campaign.settings.to_dict()).about == stated
    assert read_campaign(write_campaign(campaign, tmp_path / "again")).about == stated
    assert "about" not in full().settings.to_dict()
    file.write_text(f"{text}\n[about]\noperator = true\n", "utf-8")
    with pytest.raises(CampaignError, match=r"about\.operator.*found true, expected text in quotes"):
        read_campaign(file)
