"""Several campaigns of one robot: what stays stays, what changes changes as it is told, and no file tells it."""

import csv
import json
from dataclasses import replace
from datetime import date
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import LISTED, Case, Several
from thermal_robot.blind.plan import robots
from thermal_robot.blind.reality import make
from thermal_robot.blind.reality.campaign import _followed, draw_day, draw_habits
from thermal_robot.blind.reality.world import World
from thermal_robot.campaign import read_campaign


@pytest.fixture(scope="module")
def arm():
    return robots([("rv_m2", "builtin:rv_m2", "tool0")])[0]


@pytest.fixture
def case(arm):
    def of(kind, effects, how="", moves="", campaigns=5, change=(4.0, 4.0), seed=42):
        several = Several((campaigns, campaigns), how, moves, change)
        return Case("s0001", seed, kind, arm, effects, samples=(30, 34), several=several)

    return of


def at_work(case):
    """What is at work on each day, and the truth, without files."""
    rng = np.random.default_rng(case.seed)
    world, habits = World(case.robot.urdf, case.robot.tool_frame), draw_habits(rng)
    days = [draw_day(case, world, habits, rng) for _ in range(case.several.campaigns[0])]
    return days, *_followed(case, case.several, days, rng)[1:]


def test_a_series_can_be_read_and_does_not_tell_what_changes(case, tmp_path):
    answers = make(case("series", ("backlash", "thermal_elongation"), "grows", "backlash"), tmp_path)
    with (tmp_path / LISTED).open() as file:
        rows = list(csv.DictReader(file))
    assert [set(row) for row in rows] == [{"campaign", "date"}] * 5
    dates = [date.fromisoformat(row["date"]) for row in rows]
    assert all(20 <= (b - a).days <= 40 for a, b in pairwise(dates))
    campaigns = [read_campaign(tmp_path / row["campaign"]) for row in rows]
    assert sum(campaign.samples for campaign in campaigns) == answers["samples"]
    assert all(campaign.measures == answers["measures"] == "position" for campaign in campaigns)
    assert not np.allclose(campaigns[0].q[0], campaigns[1].q[0])  # other poses each day
    files = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    assert {path.name for path in files} == {LISTED, "campaign.toml", "measurements.csv", "robot.urdf"}
    text = "".join(path.read_text() for path in files if path.suffix != ".urdf")
    assert not any(word in text for word in ("backlash", "grows", "elongation"))
    assert answers["truth"]["campaigns"] == 5
    assert json.loads(json.dumps(answers, allow_nan=False)) == answers


def test_the_same_seed_makes_the_same_files(case, tmp_path):
    asked = case("changed", ("joint_gain",), "changes", "joint_gain", 2)
    first, second = (make(asked, tmp_path / name) for name in "ab")
    assert first == second
    for path in sorted((tmp_path / "a").rglob("*.*")):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()
    assert make(replace(asked, seed=43), tmp_path / "c") != first


@pytest.mark.parametrize(
    ("how", "moves"), [("changes", "joint_offset"), ("jumps", "joint_gain"), ("begins", "backlash")]
)
def test_a_change_is_of_one_number_from_one_day_on(case, how, moves):
    days, faults, truth = at_work(case("series", (moves, "joint_compliance"), how, moves))
    [change] = truth["changes"]
    own = np.array([next(values for fault, values in day if fault.name == moves) for day in faults])
    other = np.array([next(values for fault, values in day if fault.name == "joint_compliance") for day in faults])
    assert (other == other[0]).all()
    assert (own[: change["after"] + 1] == own[0]).all()
    assert (own[change["after"] + 1 :] == own[-1]).all()
    assert np.count_nonzero(own[-1] != own[0]) == 1
    joint = days[0].setting.world.names.index(change["place"]["name"])
    assert own[-1][joint, 0] != own[0][joint, 0]
    assert (own[0][:, 0] == 0.0).all() == (how == "begins")
    assert change["amount"] * (own[-1] - own[0])[joint, 0] > 0.0
    assert change["deviations"] == pytest.approx(4.0)


def test_what_grows_grows_in_a_straight_line_of_the_days_that_pass(case, tmp_path):
    asked = case("series", ("backlash",), "grows", "backlash", change=(8.0, 16.0))
    _, faults, truth = at_work(asked)
    [change] = truth["changes"]
    assert change["after"] is None
    assert 8.0 <= change["deviations"] <= 16.0
    make(asked, tmp_path)
    with (tmp_path / LISTED).open() as file:
        dates = [date.fromisoformat(row["date"]).toordinal() for row in csv.DictReader(file)]
    size = np.array([day[0][1][:, 0].sum() for day in faults])
    np.testing.assert_allclose(np.diff(size) / np.diff(dates), (size[-1] - size[0]) / (dates[-1] - dates[0]))
    assert 2.0 * (size[-1] - size[0]) == pytest.approx(change["amount"])  # wear: more play, half of it on each side


def test_nothing_changes_where_nothing_is_to(case):
    _, faults, truth = at_work(case("steady", ("joint_offset", "link_compliance")))
    assert truth["changes"] == []
    for day in faults:
        assert all((values == first).all() for (_, values), (_, first) in zip(day, faults[0], strict=True))
    # sized at 2 to 6 times the noise on the first day; the last one has other poses
    assert set(truth["parts"]) == {"joint_offset", "link_compliance"}
    assert all(1.0 < part["ratio"] < 12.0 for part in truth["parts"].values())


def test_a_change_that_no_draw_can_show_is_withdrawn_and_says_why(case, tmp_path):
    huge = case("series", ("joint_gain",), "jumps", "joint_gain", change=(4e4, 4e4))
    assert "would have to be large" in make(huge, tmp_path / "x")["withdrawn"]
    assert not (tmp_path / "x").exists()
