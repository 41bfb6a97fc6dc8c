"""A campaign put together by hand holds figures that can be computed with, or is refused by the name of its part."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from thermal_robot import diagnose
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.checked import checked_array
from thermal_robot.datasets import demo_campaign
from thermal_robot.errors import CampaignError


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return demo_campaign().take(np.arange(6))


def spoilt(values: Any, figure: float) -> np.ndarray[Any, Any]:
    array = np.array(values)
    array.flat[5] = figure
    return array


WRONG: dict[str, Any] = {
    "q": [None, "abc", 1.0, {}, [[1, 2], [3]]],
    "position": ["a", np.zeros((2, 3)), np.full((6, 3), np.nan), np.ones((6, 3)) + 1j],
    "orientation": [np.full((6, 4), np.inf), np.zeros((6, 3))],
    "target": [None, [0, 0], [0, 0, np.nan], "abc"],
    "rows": [["a"] * 6, np.full(6, np.nan), None],
    "covariates": [None, [1], {1: np.ones(6)}, {"time": ["a"] * 6}, {"time": np.full(6, np.nan)}, {"time": None}],
    "labels": [None, {"pose": ["a"]}],
    "noise_position": [np.nan, -1.0, "a", [1.0], 1j, 1e-300],
    "reference_temperature": [np.nan, None, "a", 1e300],
    "priors": [None, [1], {"joint_offset": np.nan}, {"joint_offset": 0.0}, {"joint_offset": "a"}],
    "gears": [{"joint_1": -1.0}],
    "robot": [None, "builtin:rv_m2"],
    "units": [None, "mm"],
    "moves": [None, "sideways", ["direct"]],
    "warnings": [None, "text"],
    "base_known": ["unknown"],
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in WRONG.items() for value in values])
def test_what_is_wrong_is_refused_by_its_name(campaign: Campaign, key: str, value: Any) -> None:
    named = key if key not in ("covariates", "labels") else "time|pose|covariates|labels"
    with pytest.raises(CampaignError, match=named):
        replace(campaign, **{key: value})


@pytest.mark.parametrize("figure", [np.nan, np.inf, -1e300])
@pytest.mark.parametrize("key", ["q", "position"])
def test_one_wrong_figure_is_found(campaign: Campaign, key: str, figure: float) -> None:
    with pytest.raises(CampaignError, match=f"{key}.*at index 1"):
        replace(campaign, **{key: spoilt(getattr(campaign, key), figure)})


def test_a_masked_value_is_not_taken_for_a_measured_one(campaign: Campaign) -> None:
    position = np.ma.masked_equal(np.array(campaign.position), campaign.position[2, 0])
    with pytest.raises(CampaignError, match=r"position.*at index 2"):
        replace(campaign, position=position)


def test_lists_and_other_kinds_of_number_are_taken(campaign: Campaign) -> None:
    again = replace(campaign, q=campaign.q.tolist(), noise_position=np.float32(0.5), noise_orientation=0)
    np.testing.assert_array_equal(again.q, campaign.q)
    assert (again.noise_position, again.noise_orientation) == (0.5, None)


def test_the_callers_array_stays_writable() -> None:
    own = np.ones(3)
    held = checked_array("<c>", "target", own, (3,), np.float64)
    assert own.flags.writeable
    assert not held.flags.writeable
    assert checked_array("<c>", "target", held, (3,), np.float64) is held


def test_nothing_measured_is_not_diagnosed(campaign: Campaign) -> None:
    for nothing in (replace(campaign, position=None, orientation=None), campaign.take([])):
        with pytest.raises(CampaignError, match="nothing was measured"):
            diagnose(nothing)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"orientation": np.array([[1.0, 0, 0, 0], [0.0, 0, 0, 0], [0.5, 0, 0, 0]])}, r"'orientation'.* at index 1"),
        ({"covariates": {"payload": np.array([1.0, 2.0, -3.0])}}, r"'payload': impossible value; found -3 at index 2"),
        ({"covariates": {"temperature": np.full(3, -300.0)}}, "'temperature': impossible value"),
        ({"covariates": {"approach.joint_1": np.array([1.0, 0.5, 1.0])}}, "found 0.5 at index 1, expected -1, 0 or 1"),
        ({"gears": {"joint_22": 100.0}}, r"gears\.joint_22.*did you mean 'joint_2'"),
    ],
)
def test_what_no_table_may_hold_no_campaign_made_by_hand_holds(
    campaign: Campaign, changed: dict[str, Any], told: str
) -> None:
    plain = campaign.take(np.arange(3))
    with pytest.raises(CampaignError, match=told):
        replace(plain, **changed)


def test_quaternions_of_few_digits_are_orientations(campaign: Campaign) -> None:
    rounded = np.round(np.full((3, 4), [0.924, 0.383, 0.0, 0.0]), 2)
    np.testing.assert_array_equal(replace(campaign.take(np.arange(3)), orientation=rounded).orientation, rounded)
