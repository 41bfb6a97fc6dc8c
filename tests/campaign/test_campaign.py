"""A campaign as a value: frozen, sliced, robbed of a column, appended, turned round, shown; of figures that can be."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from campaign.files import full
from updating_cases import measured

import thermal_robot as tr
from thermal_robot.campaign import Campaign, Settings
from thermal_robot.campaign.campaign import appended, read_alike, turned_round
from thermal_robot.campaign.checked import checked_array
from thermal_robot.campaign.read import more_rows
from thermal_robot.campaign.targets import posed
from thermal_robot.errors import CampaignError


@pytest.fixture(scope="module")
def demo() -> Campaign:
    return tr.demo_campaign()


def test_arrays_are_read_only_and_the_callers_stay_writable() -> None:
    campaign = full()
    arrays = [campaign.q, campaign.position, campaign.target, campaign.rows, campaign.take([0]).q]
    for array in [*arrays, *campaign.covariates.values(), *campaign.labels.values()]:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    q = np.zeros((2, 4))
    mine = Campaign("mine", campaign.robot, q, np.zeros((2, 3)))
    q[0, 0] = 1.0
    assert mine.q[0, 0] == 0.0
    assert mine.rows.tolist() == [2, 3]
    own = np.ones(3)
    held = checked_array("<c>", "target", own, (3,), np.float64)
    assert (own.flags.writeable, held.flags.writeable) == (True, False)
    assert checked_array("<c>", "target", held, (3,), np.float64) is held
    with pytest.raises(CampaignError, match=r"<mine>, column 'position'.*found \(2, 2\), expected \(2, 3\)"):
        Campaign("mine", campaign.robot, np.zeros((2, 4)), np.zeros((2, 2)))


@pytest.mark.parametrize("rows", [[2, 0], np.array([True, False, True]), [], [2, 0, 1]])
def test_take(rows: Any) -> None:
    campaign = full()
    part = campaign.take(rows)
    index = np.arange(3)[np.asarray(rows, dtype=np.asarray(rows).dtype if len(rows) else int)]
    for key in ("q", "orientation", "rows"):
        np.testing.assert_array_equal(getattr(part, key), getattr(campaign, key)[index])
    np.testing.assert_array_equal(part.covariates["temperature"], campaign.covariates["temperature"][index])
    np.testing.assert_array_equal(part.labels["session"], campaign.labels["session"][index])
    assert (part.samples, part.settings) == (len(index), campaign.settings)
    if len(index):
        np.testing.assert_array_equal(part.take([0]).q, campaign.q[index[:1]])
    with pytest.raises(CampaignError, match=r"has no such rows.*expected row numbers from 0 to 2, or 3 booleans"):
        campaign.take([3])


def test_drop_covariate() -> None:
    campaign = full()
    less = campaign.drop_covariate("humidity").drop_covariate("time").drop_covariate("session")
    assert {"humidity", "time"}.isdisjoint(less.covariates)
    assert (less.extra, set(less.labels)) == ((), {"pose"})
    assert "time" in campaign.covariates
    with pytest.raises(CampaignError, match="no such covariate"):
        less.drop_covariate("time")


def test_it_pickles_and_is_one_line() -> None:
    again = pickle.loads(pickle.dumps(full()))
    np.testing.assert_array_equal(again.q, full().q)
    assert again.settings == full().settings
    assert repr(full()) == "<Campaign 'hall_3': 3 samples of pose, 4 joints, 15 covariates>"


def test_noise_of_rows_is_relative_to_their_root_mean_square() -> None:
    campaign = replace(full(), noise_position=None, noise_of_rows=np.array([1e-5, 5e-5, 7e-5]))
    assert campaign.noise_position == pytest.approx(5e-5)
    relative = campaign.relative_noise
    np.testing.assert_allclose(relative, [[f] * 3 + [1.0] * 3 for f in (0.2, 1.0, 1.4)])
    np.testing.assert_array_equal(campaign.take([2, 0]).relative_noise, relative[[2, 0]])
    np.testing.assert_array_equal(replace(campaign, orientation=None).relative_noise, relative[:, :3])
    alike = replace(campaign, noise_position=None, noise_of_rows=np.full(3, 0.1 + 0.2))
    assert (alike.noise_position, alike.relative_noise) == (0.1 + 0.2, None)


WRONG: dict[str, Any] = {
    "q": [None, "abc", 1.0, {}, [[1, 2], [3]], *(np.full((6, 5), wrong) for wrong in (np.nan, np.inf, -1e300))],
    "position": ["a", np.zeros((2, 3)), np.full((6, 3), np.nan), np.ones((6, 3)) + 1j],
    "orientation": [np.full((6, 4), np.inf), np.zeros((6, 3)), np.zeros((6, 4)), np.full((6, 4), 0.3)],
    "target": [None, [0, 0], [0, 0, np.nan], "abc"],
    "rows": [["a"] * 6, np.full(6, np.nan), None],
    "covariates": [None, [1], {1: np.ones(6)}, {"time": ["a"] * 6}, {"time": np.full(6, np.nan)}, {"time": None}],
    "labels": [None, {"pose": ["a"]}],
    "noise_position": [np.nan, 1j],
    "noise_of_rows": [[1e-5]],
    "priors": [None, {"joint_offset": np.nan}],
    "gears": [{"joint_1": -1.0}],
    "robot": [None, "builtin:rv_m2"],
    "units": [None, "mm"],
    "targets": ["three", 3],
    "moves": [None, "sideways", ["direct"]],
    "warnings": [None, "text", [1]],
    "base_known": ["unknown"],
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in WRONG.items() for value in values])
def test_what_is_wrong_is_refused_by_its_name(demo: Campaign, key: str, value: Any) -> None:
    named = key if key not in ("covariates", "labels") else "time|pose|covariates|labels"
    with pytest.raises(CampaignError, match=named):
        replace(demo.take(np.arange(6)), **{key: value})


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"orientation": np.array([[1.0, 0, 0, 0], [0.0, 0, 0, 0], [0.5, 0, 0, 0]])}, r"'orientation'.* at index 1"),
        ({"covariates": {"payload": np.array([1.0, 2.0, -3.0])}}, r"'payload': impossible value; found -3 at index 2"),
        ({"covariates": {"temperature": np.full(3, -300.0)}}, "'temperature': impossible value"),
        ({"covariates": {"approach.joint_1": np.array([1.0, 0.5, 1.0])}}, "found 0.5 at index 1, expected -1, 0 or 1"),
        ({"gears": {"joint_22": 100.0}}, r"gears\.joint_22.*did you mean 'joint_2'"),
        ({"noise_of_rows": np.array([1e-5, 0.0, 1e-5])}, "'noise_of_rows': no standard deviation; found 0 at index 1"),
        ({"position": np.ma.masked_equal([[1.0, 2, 3], [4, 5, 6], [7, 8, 9]], 6)}, r"position.*at index 1"),
    ],
)
def test_what_no_table_may_hold_no_campaign_made_by_hand_holds(demo, changed, told):
    with pytest.raises(CampaignError, match=told):
        replace(demo.take(np.arange(3)), **changed)


def test_lists_other_kinds_of_number_and_quaternions_of_few_digits_are_taken(demo: Campaign) -> None:
    plain = demo.take(np.arange(3))
    rounded = np.round(np.full((3, 4), [0.924, 0.383, 0.0, 0.0]), 2)
    changes = {"noise_position": np.float32(0.5), "noise_orientation": 0, "orientation": rounded}
    changes |= {"extra": ["a\0b"], "warnings": ("\ud800",)}  # whatever a table's header or cell held
    again = replace(plain, q=plain.q.tolist(), rows=np.array([4.0, 5.0, 6.0]), **changes)
    np.testing.assert_array_equal(again.q, plain.q)
    np.testing.assert_array_equal(again.orientation, rounded)
    assert (again.noise_position, again.noise_orientation, again.rows.tolist()) == (0.5, None, [4, 5, 6])


def test_nothing_measured_is_not_diagnosed(demo: Campaign) -> None:
    for nothing in (replace(demo, position=None, orientation=None), demo.take([])):
        with pytest.raises(CampaignError, match="nothing was measured"):
            tr.diagnose(nothing)


def test_targets_of_other_rows_are_refused() -> None:
    points = np.random.default_rng(0).normal(size=(1, 4, 3)) + np.arange(5.0)[:, None, None]
    told = posed((1, 2, 3, 4), points)
    assert told is not None
    with pytest.raises(CampaignError, match=r"targets.*other rows than the commands, expected 3 rows"):
        replace(full(), targets=told.targets)
    assert replace(full(), targets=told.targets.take(np.arange(3))).samples == 3


def test_what_was_taken_apart_is_the_same_again(demo: Campaign) -> None:
    again = appended([demo.take(np.arange(40)), demo.take(np.arange(40, 41)), demo.take(np.arange(41, 120))])
    assert again.to_frame().equals(demo.to_frame())
    assert again.since_turn.keys() == demo.since_turn.keys()
    assert all((again.since_turn[name] == demo.since_turn[name]).all() for name in demo.since_turn)
    assert appended([demo]) is demo


def test_appended_rows_keep_what_all_have(demo: Campaign) -> None:
    both = appended([demo, demo.drop_covariate("temperature")])
    assert "temperature" in demo.covariates
    assert "temperature" not in both.covariates
    assert both.samples == 2 * demo.samples
    both = appended([demo, replace(demo, missing={"temperature": np.arange(120) < 7})])
    assert both.missing["temperature"].nonzero()[0].tolist() == [*range(120, 127)]
    with pytest.raises(CampaignError, match="differs in orientation"):
        appended([demo, replace(demo, orientation=np.tile([1.0, 0.0, 0.0, 0.0], (120, 1)))])


@pytest.mark.parametrize("quantity", ["approach", "temperature", "torque", "gravity"])
def test_a_quantity_turned_round_twice_is_as_it_was(demo: Campaign, quantity: str) -> None:
    once = turned_round(demo, quantity)
    again = turned_round(once, quantity)
    assert again.turned == ()
    np.testing.assert_array_equal(again.robot.gravity, demo.robot.gravity)
    assert (once.robot.gravity != demo.robot.gravity).any() == (quantity == "gravity")
    for name, values in demo.covariates.items():
        np.testing.assert_allclose(again.covariates[name], values, atol=1e-12)
        changed = (once.covariates[name] != values).any()
        assert changed == (name.startswith(quantity) and (values != 0.0).any())


def test_rows_are_read_as_those_of_another_campaign_and_settings_keep_it(demo: Campaign) -> None:
    other = turned_round(turned_round(demo, "approach"), "gravity")
    read = read_alike(demo, other.robot, other.turned)
    assert (read.turned, read.robot) == (other.turned, other.robot)
    assert read_alike(read, other.robot, other.turned) is read
    for name, values in other.covariates.items():
        np.testing.assert_array_equal(read.covariates[name], values)
    assert Settings.from_dict(other.settings.to_dict()) == other.settings


def test_the_frame_read_again_gives_the_same_arrays(demo: Campaign) -> None:
    table = demo.to_frame().assign(session=["a"] * 60 + ["b"] * 60)
    again = tr.campaign_from_table(demo.robot, table)  # it carries its units
    np.testing.assert_allclose(again.q, demo.q, atol=1e-15)
    np.testing.assert_allclose(again.position, demo.position, atol=1e-15)
    assert set(again.covariates) == set(demo.covariates)
    for name, values in demo.covariates.items():
        np.testing.assert_allclose(again.covariates[name], values, rtol=1e-15, err_msg=name)
    assert again.to_frame()["session"].tolist() == ["a"] * 60 + ["b"] * 60
    # who says otherwise has changed the table
    table[["x", "y", "z"]] *= 1e-3
    again = tr.campaign_from_table(demo.robot, table, length_unit="m")
    np.testing.assert_allclose(again.position, demo.position, atol=1e-12)
    part = demo.take([5, 2]).to_frame()
    assert (part.index.name, part.index.tolist()) == ("row", [7, 4])


def test_a_notebook_shows_joints_and_warnings(demo: Campaign) -> None:
    shown = replace(demo, warnings=("is this so?",))._repr_html_()
    assert all(text in shown for text in (*demo.robot.joint_names, demo.name, "is this so?"))
    assert shown.count("<table>") == shown.count("</table>") == 4


# ---- new rows


@pytest.fixture(scope="module")
def whole():
    return measured(100, seed=3)


@pytest.fixture
def new(whole):
    return whole.take(np.arange(60, 100))


def test_a_table_is_read_as_the_campaign_was(whole, new):
    rows = more_rows(whole, new.to_frame(), ())
    assert np.allclose(rows.q, new.q)
    assert np.allclose(rows.position, new.position)
    assert (rows.covariates["approach.joint_2"] == new.covariates["approach.joint_2"]).all()


OTHERS = {
    "another tool frame": lambda whole, new: replace(new, tool_known=True),
    "another noise of positions": lambda whole, new: replace(new, noise_position=1e-4),
    "another reference temperature": lambda whole, new: replace(new, reference_temperature=25.0),
    "another kind of measurement": lambda whole, new: replace(new, orientation=np.tile([1.0, 0.0, 0.0, 0.0], (40, 1))),
    "another robot, by its joints": lambda whole, new: tr.simulate(
        "example-robot-data:ur5", tool_frame="tool0", rows=5, base=np.eye(4), tool=np.eye(4)
    ),
    "another nominal model": lambda whole, new: replace(
        new, robot=tr.load_robot(whole.robot.urdf.replace('xyz="0 0 ', 'xyz="0.001 0 '), whole.robot.tool_frame)
    ),
    "lacks what the chosen effects read": lambda whole, new: new.drop_covariate("temperature"),
    "pandas DataFrame": lambda whole, new: [1.0, 2.0],
}
"""Rows that cannot be added to a campaign, by what is said of them."""


@pytest.mark.parametrize("said", OTHERS)
def test_rows_that_are_not_alike_are_refused(whole, new, said):
    with pytest.raises(CampaignError, match=said):
        more_rows(whole, OTHERS[said](whole, new), ("temperature",))
