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
    write_campaign,
    write_predictions,
    write_table,
)
from thermal_robot.errors import CampaignError


@pytest.mark.parametrize(("angle", "length"), [("deg", "mm"), ("rad", "m"), ("deg", "um")])
def test_reading_again_gives_the_same(tmp_path: Path, angle: str, length: str) -> None:

    campaign = dataclasses.replace(full(tmp_path / "c"), units=Units(angle, length), name="copy")
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
    campaign = full(tmp_path / "c")
    samples = read_samples(tmp_path / "c" / "measurements.csv", campaign)
    with pytest.raises(CampaignError, match="without measured positions"):
        write_campaign(samples, tmp_path / "copy")
    write_table(samples, tmp_path / "fresh.csv")
    again = read_samples(tmp_path / "fresh.csv", campaign)
    np.testing.assert_allclose(again.q, samples.q, rtol=1e-12)


def test_predictions(tmp_path: Path) -> None:
    file = tmp_path / "predicted.csv"
    write_predictions(file, [[1.0, 0.1, -0.25], [0, 0, 1]], None, Units("rad", "mm"))
    frame = pd.read_csv(file)
    assert list(frame.columns) == ["x", "y", "z"]
    np.testing.assert_allclose(frame, [[1000, 100, -250], [0, 0, 1000]], rtol=1e-15)
    write_predictions(file, [[1.0, 0.1, -0.25]], [[1, 0, 0, 0]], Units("rad", "um"))
    frame = pd.read_csv(file)
    assert list(frame.columns) == ["x", "y", "z", "qw", "qx", "qy", "qz"]
    np.testing.assert_allclose(frame, [[1e6, 1e5, -2.5e5, 1, 0, 0, 0]], rtol=1e-15)


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="cannot be written: No such file or directory"):
        write_predictions(tmp_path / "nowhere" / "p.csv", [[0, 0, 0]], None, Units())
    (tmp_path / "taken").write_text("")
    with pytest.raises(CampaignError, match="cannot be written"):
        write_campaign(full(tmp_path / "c"), tmp_path / "taken")


def test_a_second_copy_is_the_first_to_the_last_letter(tmp_path: Path) -> None:
    first = write_campaign(full(tmp_path / "c"), tmp_path / "first").parent
    second = write_campaign(read_campaign(first), tmp_path / "second").parent
    for name in ("campaign.toml", "robot.urdf"):
        assert (first / name).read_text() == (second / name).read_text()
    one, two = (pd.read_csv(folder / "measurements.csv") for folder in (first, second))
    assert list(one.columns) == list(two.columns)
    numbers = one.select_dtypes("number").columns
    np.testing.assert_allclose(two[numbers], one[numbers], rtol=1e-13)


def test_predictions_keep_every_digit(tmp_path: Path) -> None:
    positions = np.random.default_rng(4).normal(size=(50, 3))
    write_predictions(tmp_path / "p.csv", positions, None, Units())
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "p.csv", delimiter=",", skiprows=1), positions)
