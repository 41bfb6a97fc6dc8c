"""A campaign from a data frame is the campaign from files; its arguments are checked as a file is."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from campaign.files import URDF, full, put

from thermal_robot.campaign import campaign_from_table
from thermal_robot.errors import CampaignError
from thermal_robot.robot import Robot, load_robot


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return load_robot(URDF, "tool")


def test_same_as_from_files(tmp_path: Path, robot: Robot) -> None:
    campaign = full(tmp_path / "c")
    frame = pd.read_csv(tmp_path / "c" / "measurements.csv")
    other = campaign_from_table(
        robot,
        frame,
        angle_unit="deg",
        length_unit="mm",
        tool="known",
        target=[1, 2, 80],
        noise_position=0.02,
        noise_orientation=3e-5,
        payload_com=[0, 0, 50],
        reference_temperature=22.5,
        priors={"joint_offset": 1e-3},
        gears={"lift": 101},
        name="c",
    )
    assert other.settings.to_dict() | {"urdf": ""} == campaign.settings.to_dict() | {"urdf": ""}
    assert other.rows.tolist() == [0, 1, 2]
    for name, values in campaign.covariates.items():
        np.testing.assert_allclose(other.covariates[name], values, rtol=1e-15)
    assert other.labels["pose"].tolist() == ["1", "2", "3"]
    np.testing.assert_allclose(other.orientation, campaign.orientation)


def test_rows_are_those_of_the_index(robot: Robot, tmp_path: Path) -> None:
    frame = pd.read_csv(put(tmp_path / "c") / "measurements.csv").iloc[[2, 0, 1]]
    assert campaign_from_table(robot, frame, angle_unit="deg", tool="known").rows.tolist() == [2, 0, 1]
    frame.index = pd.Index(["a", "b", "c"])
    assert campaign_from_table(robot, frame, angle_unit="deg", tool="known").rows.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("arguments", "column", "words"),
    [
        ({"angle_unit": "grad"}, "angle_unit", '"rad" or "deg"'),
        ({"length_unit": "yard"}, "length_unit", '"m" or "mm" or "um"'),
        ({"base": "floor"}, "base", '"known" or "unknown"'),
        ({"noise_position": -1}, "noise_position", "negative"),
        ({"noise_orientation": math.inf}, "noise_orientation", "finite"),
        ({"target": [1, 2]}, "target", "three numbers"),
        ({"priors": {"drift": 0}}, "priors.drift", "positive"),
        ({"gears": {"left": 3}}, "gears.left", "did you mean 'lift'"),
        ({"angle_unit": ["rad"]}, "angle_unit", '"rad" or "deg"'),
        ({"base": np.array(["known", "known"])}, "base", '"known" or "unknown"'),
        ({"tool": pd.NA}, "tool", '"known" or "unknown"'),
        ({"noise_position": "0.02"}, "noise_position", "found '0.02', expected a finite number"),
        ({"noise_position": 1j}, "noise_position", "finite number"),
        ({"target": "abc"}, "target", "three numbers"),
        ({"target": [0, None, 0]}, "target", "three numbers"),
        ({"payload_com": 10**400}, "payload_com", "three numbers"),
        ({"reference_temperature": math.nan}, "reference_temperature", "found NaN, expected a number of °C"),
        ({"reference_temperature": -300}, "reference_temperature", "no temperature is lower"),
        ({"priors": ["drift"]}, "priors", "values by name"),
        ({"gears": {1: 100}}, "gears", "values by name"),
        ({"name": 7}, "name", "expected text"),
        ({"measured": "yes"}, "measured", "true or false"),
    ],
)
def test_arguments_are_checked(robot: Robot, arguments: dict[str, object], column: str, words: str) -> None:
    with pytest.raises(CampaignError, match=words) as caught:
        campaign_from_table(robot, pd.DataFrame(), **arguments)
    assert (caught.value.file, caught.value.column) == ("<table>", column)


def test_cells_are_checked(robot: Robot) -> None:
    frame = pd.DataFrame({"turn": [0.1, None], "lift": 0.1, "slide": 0.1, "roll": 0.1, "x": 1, "y": 1, "z": 1})
    with pytest.raises(CampaignError) as caught:
        campaign_from_table(robot, frame, base="known", tool="known")
    assert (caught.value.row, caught.value.column, caught.value.found) == (1, "turn", "an empty cell")


@pytest.mark.parametrize(
    ("unit", "per_metre"), [("m", 1.0), ("mm", 1e3), ("um", 1e6), ("inch", 1 / 0.0254), ("ft", 1 / 0.3048)]
)
def test_one_campaign_in_any_unit(robot: Robot, unit: str, per_metre: float) -> None:
    rng = np.random.default_rng(1)
    q = pd.DataFrame(rng.uniform(0.1, 0.4, (5, 4)), columns=list(robot.joint_names))
    place = rng.uniform(-1, 1, (5, 3))
    frame = q.assign(slide=q["slide"] * per_metre)
    frame[["x", "y", "z"]] = place * per_metre
    campaign = campaign_from_table(robot, frame, length_unit=unit, noise_position=1e-5 * per_metre)
    np.testing.assert_allclose(campaign.q, q, rtol=1e-14)
    np.testing.assert_allclose(campaign.position, place, rtol=1e-14)
    assert campaign.noise_position == pytest.approx(1e-5)


def test_samples_to_predict_need_no_position(robot: Robot) -> None:
    frame = pd.DataFrame({name: [0.1] for name in robot.joint_names})
    assert campaign_from_table(robot, frame, measured=False).position is None
    with pytest.raises(CampaignError) as caught:
        campaign_from_table(robot, frame)
    assert caught.value.column == "x"


def test_noise_of_zero_is_not_given(robot: Robot) -> None:
    frame = pd.DataFrame({name: [0.1, 0.2, 0.3] for name in (*robot.joint_names, "x", "y", "z")})
    campaign = campaign_from_table(robot, frame, noise_position=0.0, noise_orientation=0.0)
    assert (campaign.noise_position, campaign.noise_orientation) == (None, None)
