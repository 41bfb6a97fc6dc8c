"""A campaign as a value: frozen, sliced by rows, robbed of a column, pickled."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaign.files import URDF, full

from thermal_robot.campaign import Campaign, Settings, Units
from thermal_robot.campaign.targets import posed
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return load_robot(URDF, "tool")


def test_arrays_are_read_only(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    arrays = [
        campaign.q,
        campaign.position,
        campaign.target,
        campaign.rows,
        *campaign.covariates.values(),
    ]
    for array in [*arrays, *campaign.labels.values(), campaign.take([0]).q]:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_callers_array_stays_writable(robot: Robot) -> None:
    q = np.zeros((2, 4))
    campaign = Campaign("mine", robot, q, np.zeros((2, 3)))
    q[0, 0] = 1.0
    assert campaign.q[0, 0] == 0.0
    assert campaign.rows.tolist() == [2, 3]


def test_shapes_are_checked(robot: Robot) -> None:
    with pytest.raises(CampaignError, match=r"<mine>, column 'position'.*found \(2, 2\), expected \(2, 3\)"):
        Campaign("mine", robot, np.zeros((2, 4)), np.zeros((2, 2)))


@pytest.mark.parametrize("rows", [[2, 0], np.array([True, False, True]), []])
def test_take(tmp_path: Path, rows: object) -> None:
    campaign = full(tmp_path / "c")
    part = campaign.take(rows)
    index = np.arange(3)[np.asarray(rows, dtype=bool if len(rows) == 3 else int)]
    np.testing.assert_array_equal(part.q, campaign.q[index])
    np.testing.assert_array_equal(part.orientation, campaign.orientation[index])
    np.testing.assert_array_equal(part.covariates["temperature"], campaign.covariates["temperature"][index])
    np.testing.assert_array_equal(part.labels["session"], campaign.labels["session"][index])
    np.testing.assert_array_equal(part.rows, campaign.rows[index])
    assert part.samples == len(index)
    assert part.settings == campaign.settings


def test_drop_covariate(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    less = campaign.drop_covariate("humidity").drop_covariate("time").drop_covariate("session")
    assert {"humidity", "time"}.isdisjoint(less.covariates)
    assert less.extra == ()
    assert set(less.labels) == {"pose"}
    assert "time" in campaign.covariates
    with pytest.raises(CampaignError, match="no such covariate"):
        less.drop_covariate("time")


def test_pickles(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    again = pickle.loads(pickle.dumps(campaign))
    np.testing.assert_array_equal(again.q, campaign.q)
    assert again.settings == campaign.settings


def test_repr_is_one_line(tmp_path: Path) -> None:
    assert repr(full(tmp_path / "c")) == "<Campaign 'c': 3 samples of pose, 4 joints, 15 covariates>"


def test_rows_taken_twice_are_the_rows_taken_at_once(tmp_path: Path) -> None:
    campaign = full(tmp_path / "c")
    twice, once = campaign.take([2, 0, 1]).take([0, 1]), campaign.take([2, 0])
    np.testing.assert_array_equal(twice.q, once.q)
    assert twice.rows.tolist() == once.rows.tolist() == [4, 2]
    assert twice.labels["pose"].tolist() == ["3", "1"]


def test_settings_hold_all_that_is_not_in_the_table(tmp_path: Path) -> None:
    settings = full(tmp_path / "c").settings
    assert settings == Settings(
        urdf="robot.urdf",
        tool_frame="tool",
        root_frame="base",
        gravity=(0.0, 0.0, -9.81),
        reference_temperature=22.5,
        units=Units("deg", "mm"),
        base_known=False,
        tool_known=True,
        target=(0.001, 0.002, 0.08),
        noise_position=settings.noise_position,
        noise_orientation=3e-5,
        payload_com=(0.0, 0.0, 0.05),
        priors={"joint_offset": 1e-3},
        gears={"lift": 101.0},
    )
    assert settings.noise_position == pytest.approx(2e-5)


def test_noise_of_rows_is_relative_to_their_root_mean_square(tmp_path: Path) -> None:
    campaign = dataclasses.replace(
        full(tmp_path / "c"), noise_position=None, noise_of_rows=np.array([1e-5, 5e-5, 7e-5])
    )
    assert campaign.noise_position == pytest.approx(5e-5)
    relative = campaign.relative_noise
    assert relative is not None
    np.testing.assert_allclose(relative, [[f] * 3 + [1.0] * 3 for f in (0.2, 1.0, 1.4)])
    part = campaign.take([2, 0])
    assert part.relative_noise is not None
    np.testing.assert_array_equal(part.relative_noise, relative[[2, 0]])
    alike = dataclasses.replace(campaign, noise_position=None, noise_of_rows=np.full(3, 0.1 + 0.2))
    assert alike.noise_position == 0.1 + 0.2
    assert alike.relative_noise is None


@pytest.mark.parametrize(("sigmas", "words"), [([1e-5, 0.0, 1e-5], "index 1"), ([1e-5], "wrong shape")])
def test_a_noise_of_rows_that_is_none_is_refused(tmp_path: Path, sigmas: list[float], words: str) -> None:
    with pytest.raises(CampaignError, match=words) as caught:
        dataclasses.replace(full(tmp_path / "c"), noise_of_rows=np.array(sigmas))
    assert caught.value.column == "noise_of_rows"


@pytest.mark.parametrize("given", ["three", 3])
def test_targets_that_are_none_or_of_other_rows_are_refused(tmp_path: Path, given: Any) -> None:
    campaign = full(tmp_path / "c")
    with pytest.raises(CampaignError, match="wrong kind of value"):
        dataclasses.replace(campaign, targets=given)
    points = np.random.default_rng(0).normal(size=(1, 4, 3)) + np.arange(5.0)[:, None, None]
    told = posed((1, 2, 3, 4), points)
    assert told is not None
    with pytest.raises(CampaignError, match=r"targets.*other rows than the commands, expected 3 rows"):
        dataclasses.replace(campaign, targets=told.targets)
    assert dataclasses.replace(campaign, targets=told.targets.take(np.arange(3))).samples == 3
