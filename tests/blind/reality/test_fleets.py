"""A small fleet: who shares what, who has what alone."""

import csv

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import LISTED, Case, Several
from thermal_robot.blind.plan import robots
from thermal_robot.blind.reality import make
from thermal_robot.blind.reality.campaign import draw_day, draw_fleet, draw_habits
from thermal_robot.blind.reality.world import World
from thermal_robot.campaign import read_campaign

ALONE = ("joint_gain", "backlash", "backlash")


@pytest.fixture(scope="module")
def arm():
    return robots([("rv_m2", "builtin:rv_m2", "tool0")])[0]


def fleet(arm, how, moves, seed=3, count=9):
    """Labels, what is at work in each robot, the truth; and the days."""
    several = Several((count, count), how, moves, apart=ALONE)
    case = Case("s1", seed, "fleet", arm, (moves,) if moves else (), samples=(30, 34), several=several)
    rng = np.random.default_rng(seed)
    habits, world = draw_habits(rng), World(arm.urdf, "tool0")
    days = [draw_day(case, world, habits, rng) for _ in range(count)]
    return case, days, *draw_fleet(case, several, days, rng)


@pytest.mark.parametrize("how", ["all", "hall"])
def test_a_shared_fault_is_at_one_place_and_alike_in_all_who_share_it(arm, how):
    _, _, labels, faults, truth = fleet(arm, how, "joint_offset")
    [shared] = truth["shared"]
    sizes = [sum(values[:, 0] for fault, values in own if fault.name == "joint_offset") for own in faults]
    members = [k for k, hall in enumerate(labels["hall"]) if shared["group"] in (None, hall)]
    assert len(members) == (9 if how == "all" else labels["hall"].count(shared["group"]))
    assert [k for k, size in enumerate(sizes) if np.any(size)] == members
    found = np.array([sizes[k] for k in members])
    [place] = np.flatnonzero(found.any(axis=0))
    assert shared["place"]["name"] == f"joint_{place + 1}"
    # a scatter of a tenth: 5 of 9 or more apart, none by half
    assert np.ptp(found[:, place]) > 0.0
    assert np.abs(found[:, place] / np.median(found[:, place]) - 1.0).max() < 0.5


def test_what_one_robot_has_no_other_has(arm):
    _, _, labels, faults, truth = fleet(arm, "", "")
    assert truth["shared"] == []
    assert sorted(own["effect"] for own in truth["own"]) == sorted(ALONE)
    assert len({own["robot"] for own in truth["own"]}) == len(ALONE)
    assert len({(own["effect"], own["place"]["name"]) for own in truth["own"]}) == len(ALONE)
    told = {own["robot"]: own for own in truth["own"]}
    for robot, own in zip(labels["robot"], faults, strict=True):
        if robot not in told:
            assert own == []
            continue
        [(fault, values)] = own
        assert fault.name == told[robot]["effect"]
        assert np.count_nonzero(values[:, 0]) == 1


def test_halls_are_of_equal_size_and_own_faults_as_large_as_asked(arm):
    _, days, labels, faults, _ = fleet(arm, "", "")
    assert sorted(labels["hall"].count(hall) for hall in set(labels["hall"])) == [4, 5]
    for day, own in zip(days, faults, strict=True):
        for fault, values in own:
            left = day.gauge.rms(day.gauge.left(day.gauge.moved(fault, values))) / day.instrument.noise
            assert 1.95 < left < 6.1


def test_the_list_names_robots_and_halls_and_no_fault(arm, tmp_path):
    case, *_ = fleet(arm, "hall", "backlash", count=4)
    answers = make(case, tmp_path)
    with (tmp_path / LISTED).open() as file:
        rows = list(csv.DictReader(file))
    assert [row["robot"] for row in rows] == ["r01", "r02", "r03", "r04"]
    assert {row["hall"] for row in rows} == {"hall 1", "hall 2"}
    assert sum(read_campaign(tmp_path / row["campaign"]).samples for row in rows) == answers["samples"]
    assert "backlash" not in "".join(path.read_text() for path in tmp_path.rglob("*.*") if path.is_file())
    assert answers["truth"]["effects"] == ["backlash", "joint_gain"]
