"""A case becomes folders that can be read, with answers that stay outside them: one campaign, several, a fleet."""

import csv
import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from datetime import date
from functools import partial
from itertools import pairwise
from multiprocessing import get_context

import numpy as np
import pytest
from blind_fakes import AtOnce
from helpers import some

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import LISTED, Case, Several
from thermal_robot.blind.plan import ROBOTS, robots
from thermal_robot.blind.reality import World, make
from thermal_robot.blind.reality.campaign import _followed, draw_days, draw_fleet
from thermal_robot.campaign import read_campaign


@pytest.fixture(scope="module")
def arms():
    return {arm.name: arm for arm in robots([robot for robot in ROBOTS if robot[0] in ("ur10", "rv_m2")])}


@pytest.fixture
def case(arms):
    def of(kind="single", arm="rv_m2", **asked):
        return Case("c0001", 42, kind, arms[arm], **asked)

    return of


def listed(folder):
    with (folder / LISTED).open() as file:
        return list(csv.DictReader(file))


def words(folder):
    """All that a folder's files say, but robots."""
    return "".join(path.read_text() for path in sorted(folder.rglob("*.*")) if path.suffix in (".toml", ".csv"))


def test_a_campaign_can_be_read_and_holds_what_was_asked(case, tmp_path):
    answers = make(case("pair", "ur10", effects=("drift", "backlash")), tmp_path)
    assert read_campaign(tmp_path).samples == answers["samples"]
    made = ["campaign.toml", "fresh.csv", "measurements.csv", "robot.urdf"]
    assert sorted(file.name for file in tmp_path.iterdir()) == made
    assert set(answers["truth"]["effects"]) == {"drift", "backlash"}
    assert all(2.0 <= part["ratio"] <= 6.0 for part in answers["truth"]["parts"].values())
    assert np.shape(answers["fresh_position"]) == (1000, 3)
    assert not any(word in words(tmp_path) for word in ("drift", "backlash"))
    assert json.loads(json.dumps(answers, allow_nan=False)) == answers


APART = partial(ProcessPoolExecutor, 1, get_context("spawn"))  # where sets of words have another order


@pytest.mark.parametrize(
    ("pool", "asked"),
    some(
        [
            (AtOnce, {"effects": ("joint_gain",)}),
            (APART, {"effects": ("thermal_elongation", "joint_compliance")}),
            (
                APART,
                {"kind": "changed", "effects": ("joint_gain",), "several": Several((2, 2), "changes", "joint_gain")},
            ),
        ],
        3,
    ),
)
def test_the_same_seed_makes_the_same_files(case, tmp_path, pool, asked):
    asked = case(samples=(30, 34), **asked)
    first, other = (make(c, tmp_path / n) for n, c in (("a", asked), ("c", replace(asked, seed=2**61 + 1))))
    with pool() as elsewhere:
        second = elsewhere.submit(make, asked, tmp_path / "b").result()
    assert json.dumps(first) == json.dumps(second) != json.dumps(other)
    files = sorted((tmp_path / "a").rglob("*.*"))
    assert files
    for path in files:
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()


def test_without_a_fault_only_noise_is_left(case, tmp_path):
    answers = make(case("null", "ur10"), tmp_path)
    left = np.array(answers["fresh_position"]) - np.array(answers["fresh_before"])
    # nine parameters of the frames from some hundred rows: sqrt(9 / 3N)
    assert np.sqrt((left**2).mean()) < 3.0 * np.sqrt(9.0 / (3 * answers["samples"])) * answers["noise"]
    assert np.isfinite(read_campaign(tmp_path).position).all()
    assert answers["truth"]["parts"] == {}


def test_a_hidden_column_is_in_neither_table(case, tmp_path):
    asked = case("hidden", effects=("thermal_elongation",), hidden=("temperature",), samples=(40, 50))
    assert make(asked, tmp_path)["truth"]["needs"] == ["temperature"]
    for name in ("measurements.csv", "fresh.csv"):
        stems = {column.split(".")[0] for column in (tmp_path / name).read_text().splitlines()[0].split(",")}
        assert "temperature" not in stems
        assert {"time", "payload", "approach"} <= stems


def test_the_background_is_there_and_far_below_the_noise(case, tmp_path):
    asked = {"ratio": (0.7, 1.5), "samples": (30, 60), "background": 0.15, "heavy": True}
    truth = make(case("hard", effects=("geometric",), **asked), tmp_path)["truth"]
    quiet = {name: part["ratio"] for name, part in truth["parts"].items() if not part["main"]}
    assert {"joint_offset", "drift", "backlash", "transmission_error"} <= set(quiet)
    assert all(0.1 < ratio < 0.2 for ratio in quiet.values())
    assert 0.7 <= truth["parts"]["geometric"]["ratio"] <= 1.5


def test_an_unlisted_cause_comes_with_its_places_and_quantities(case, tmp_path):
    truth = make(case("unlisted", unlisted="slip", samples=(40, 50)), tmp_path)["truth"]
    assert (truth["unlisted"], truth["quantities"]) == ("slip", ["time", "order"])
    [place] = truth["places"]
    assert place["kind"] == "joint"
    assert truth["parts"]["slip"]["main"]
    assert truth["parts"]["slip"]["places"] == [place]


@pytest.mark.slow
def test_motors_wheels_come_with_the_ratio_that_shows_them(case, tmp_path):
    """A draw with a disc on the motor's side states its ratio; one on the joint's side states none."""
    stated = set()
    for seed in range(40):  # one draw in five is on the motor's side: 1e-4 that none of forty is
        asked = replace(case(effects=("transmission_error",), samples=(30, 32)), seed=seed)
        make(asked, tmp_path / str(seed))
        stated.add(tuple(set(read_campaign(tmp_path / str(seed)).gears.values())))
        if len(stated) > 1:
            break
    assert () in stated
    [(ratio,)] = stated - {()}
    assert 30.0 <= ratio <= 160.0


# ---- several campaigns of one robot


@pytest.fixture
def several(case):
    def of(kind, effects, how="", moves="", change=(4.0, 4.0)):
        return case(kind, effects=effects, samples=(30, 34), several=Several((5, 5), how, moves, change))

    return of


def at_work(case):
    """Days, what is at work on each, and the truth, without files."""
    rng = np.random.default_rng(case.seed)
    days = draw_days(case, World(case.robot.urdf, "tool0"), case.several.campaigns[0], rng)
    return days, *_followed(case, case.several, days, rng)[1:]


def test_days_differ_in_all_but_the_instruments_noise_and_what_is_recorded(several):
    days, _, _ = at_work(several("steady", ("joint_offset",)))
    for same in (lambda d: d.instrument.noise, lambda d: d.instrument.stated, lambda d: d.setting.sensor):
        assert len({same(day) for day in days}) == 1
    for other in (lambda d: d.instrument.pose[0, 3], lambda d: d.instrument.target[0], lambda d: d.setting.q[0, 0]):
        assert len({other(day) for day in days}) == 5
    for day in days:
        assert day.setting.given.all()
        assert (day.instrument.base_known, day.instrument.tool_known, day.instrument.turning) == (False, False, None)


def test_a_series_can_be_read_and_does_not_tell_what_changes(several, tmp_path):
    answers = make(several("series", ("backlash", "thermal_elongation"), "grows", "backlash"), tmp_path)
    rows = listed(tmp_path)
    assert [set(row) for row in rows] == [{"campaign", "date"}] * 5
    dates = [date.fromisoformat(row["date"]) for row in rows]
    assert all(20 <= (b - a).days <= 40 for a, b in pairwise(dates))
    campaigns = [read_campaign(tmp_path / row["campaign"]) for row in rows]
    assert sum(campaign.samples for campaign in campaigns) == answers["samples"]
    assert all(campaign.measures == answers["measures"] == "position" for campaign in campaigns)
    files = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert files == {LISTED, "campaign.toml", "measurements.csv", "robot.urdf"}
    assert not any(word in words(tmp_path) for word in ("backlash", "grows", "elongation"))
    assert answers["truth"]["campaigns"] == 5
    assert json.loads(json.dumps(answers, allow_nan=False)) == answers


@pytest.mark.parametrize(
    ("how", "moves"), [("changes", "joint_offset"), ("jumps", "joint_gain"), ("begins", "backlash")]
)
def test_a_change_is_of_one_number_from_one_day_on(several, how, moves):
    days, faults, truth = at_work(several("series", (moves, "joint_compliance"), how, moves))
    [change] = truth["changes"]
    own, other = (
        np.array([next(values for fault, values in day if fault.name == name) for day in faults])
        for name in (moves, "joint_compliance")
    )
    assert (other == other[0]).all()
    assert (own[: change["after"] + 1] == own[0]).all()
    assert (own[change["after"] + 1 :] == own[-1]).all()
    assert np.count_nonzero(own[-1] != own[0]) == 1
    joint = days[0].setting.world.names.index(change["place"]["name"])
    assert change["amount"] * (own[-1] - own[0])[joint, 0] > 0.0
    assert (own[0][:, 0] == 0.0).all() == (how == "begins")
    assert change["deviations"] == pytest.approx(4.0)


def test_what_grows_grows_in_a_straight_line_of_the_days_that_pass(several, tmp_path):
    asked = several("series", ("backlash",), "grows", "backlash", change=(8.0, 16.0))
    _, faults, truth = at_work(asked)
    [change] = truth["changes"]
    assert change["after"] is None
    assert 8.0 <= change["deviations"] <= 16.0
    make(asked, tmp_path)
    dates = [date.fromisoformat(row["date"]).toordinal() for row in listed(tmp_path)]
    size = np.array([day[0][1][:, 0].sum() for day in faults])
    np.testing.assert_allclose(np.diff(size) / np.diff(dates), (size[-1] - size[0]) / (dates[-1] - dates[0]))
    assert 2.0 * (size[-1] - size[0]) == pytest.approx(change["amount"])  # wear: more play, half of it on each side


def test_nothing_changes_where_nothing_is_to(several):
    _, faults, truth = at_work(several("steady", ("joint_offset", "link_compliance")))
    assert truth["changes"] == []
    for day in faults:
        assert all((values == first).all() for (_, values), (_, first) in zip(day, faults[0], strict=True))
    # sized at 2 to 6 times the noise on the first day; the last one has other poses
    assert set(truth["parts"]) == {"joint_offset", "link_compliance"}
    assert all(1.0 < part["ratio"] < 12.0 for part in truth["parts"].values())


@pytest.mark.slow
def test_a_change_that_no_draw_can_show_is_withdrawn_and_says_why(several, tmp_path):
    huge = several("series", ("joint_gain",), "jumps", "joint_gain", change=(4e4, 4e4))
    assert "would have to be large" in make(huge, tmp_path / "x")["withdrawn"]
    assert not (tmp_path / "x").exists()


# ---- a fleet

ALONE = ("joint_gain", "backlash", "backlash")


@pytest.fixture
def fleet(case):
    """The case, days, labels, what is at work in each robot, the truth."""

    def of(how, moves, count=9):
        several = Several((count, count), how, moves, apart=ALONE)
        asked = case("fleet", effects=(moves,) if moves else (), samples=(30, 34), several=several)
        rng = np.random.default_rng(3)
        days = draw_days(asked, World(asked.robot.urdf, "tool0"), count, rng)
        return asked, days, *draw_fleet(asked, several, days, rng)

    return of


@pytest.mark.parametrize("how", ["all", "hall"])
def test_a_shared_fault_is_at_one_place_and_alike_in_all_who_share_it(fleet, how):
    _, _, labels, faults, truth = fleet(how, "joint_offset")
    [shared] = truth["shared"]
    sizes = [sum(values[:, 0] for fault, values in own if fault.name == "joint_offset") for own in faults]
    members = [k for k, hall in enumerate(labels["hall"]) if shared["group"] in (None, hall)]
    assert len(members) == (9 if how == "all" else labels["hall"].count(shared["group"]))
    assert [k for k, size in enumerate(sizes) if np.any(size)] == members
    found = np.array([sizes[k] for k in members])
    [place] = np.flatnonzero(found.any(axis=0))
    assert shared["place"]["name"] == f"joint_{place + 1}"
    # of a scatter of a tenth, of the logarithm, 1e-5 are beyond 4.5 sigma: half as large again
    assert np.ptp(found[:, place]) > 0.0
    assert np.abs(found[:, place] / np.median(found[:, place]) - 1.0).max() < 0.5


def test_what_one_robot_has_no_other_has_and_is_as_large_as_asked(fleet):
    _, days, labels, faults, truth = fleet("", "")
    assert truth["shared"] == []
    assert sorted(own["effect"] for own in truth["own"]) == sorted(ALONE)
    assert len({(own["effect"], own["place"]["name"]) for own in truth["own"]}) == len(ALONE)
    told = {own["robot"]: own["effect"] for own in truth["own"]}
    assert len(told) == len(ALONE)
    assert {r: own[0][0].name for r, own in zip(labels["robot"], faults, strict=True) if own} == told
    for day, own in zip(days, faults, strict=True):
        for fault, values in own:
            assert np.count_nonzero(values[:, 0]) == 1
            assert 1.95 < day.gauge.leaves(fault, values) / day.instrument.noise < 6.1
    assert sorted(labels["hall"].count(hall) for hall in set(labels["hall"])) == [4, 5]


def test_the_list_names_robots_and_halls_and_no_fault(fleet, tmp_path):
    answers = make(fleet("hall", "backlash", count=4)[0], tmp_path)
    rows = listed(tmp_path)
    assert [row["robot"] for row in rows] == ["r01", "r02", "r03", "r04"]
    assert {row["hall"] for row in rows} == {"hall 1", "hall 2"}
    assert sum(read_campaign(tmp_path / row["campaign"]).samples for row in rows) == answers["samples"]
    assert "backlash" not in words(tmp_path)
    assert answers["truth"]["effects"] == ["backlash", "joint_gain"]
