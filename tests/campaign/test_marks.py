"""Marks of a lost beam and copies of rows are told with their rows, and nothing is said of sound campaigns."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate

from thermal_robot import campaign_from_table, demo_campaign
from thermal_robot.campaign.plausible import copies, doubled, doubts, marks

NAMES = ("rv_m2", "ur5", "panda")
NO_CLOCK = {"covariates": {}}


arm = cache(load_arm)


def measured(robot, seed, samples=60, noise=2e-5, repeats=1, step=0.0):
    """A campaign whose instrument stands somewhere, its figures rounded to ``step`` m."""
    rng = np.random.default_rng(seed)
    found = simulate(robot, [], samples=samples, seed=seed, noise=noise)[0]
    pose = np.repeat(np.arange(samples // repeats), repeats)
    place = found.position[pose] + rng.uniform(-2, 2, 3) + (repeats > 1) * rng.normal(0.0, noise, (len(pose), 3))
    return replace(
        found.take(np.arange(len(pose))),
        q=found.q[pose],
        position=place.round(6) if not step else step * np.round(place / step),
    )


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("unit", ["m", "mm", "inch"])
@pytest.mark.parametrize(
    ("figures", "said"),
    [
        ((-9999.0, None, None), "x is −9999 in 7 rows ({} …): a mark of a missing value?"),
        ((None, None, 99999.5), "z is 99999.5 in 7 rows ({} …): a mark of a missing value?"),
        ((0.0, 0.0, 0.0), "x = y = z = 0 in 7 rows ({} …): was the beam lost?"),
        ((-999.0, -999.0, -999.0), "x = y = z = −999 in 7 rows ({} …): was the beam lost?"),
    ],
)
def test_a_figure_that_does_not_follow_the_robot_is_told(name, unit, figures, said):
    seed = len(name) + len(unit)
    sound = measured(arm(name), seed)
    sound = replace(sound, units=replace(sound.units, length=unit))
    struck = np.sort(np.random.default_rng(seed).choice(60, 7, replace=False))
    place = np.array(sound.position)
    for k, value in enumerate(figures):
        if value is not None:
            place[struck, k] = value * sound.units.length_scale
    spoilt = replace(sound, position=place)
    rows, sentences = marks(spoilt)
    assert np.flatnonzero(rows).tolist() == struck.tolist()
    assert sentences == [said.format(", ".join(str(row) for row in sound.rows[struck][:5]))]
    # what else is said is said of the other rows: the extent of the figures is no other unit
    assert doubts(spoilt) == [*sentences, *doubts(sound)]


def test_an_old_reading_is_told(rv_m2):
    sound = measured(rv_m2, 3)
    place = np.array(sound.position)
    place[11:15] = place[10]
    rows, (said,) = marks(replace(sound, position=place))
    assert np.flatnonzero(rows).tolist() == [10, 11, 12, 13, 14]
    assert said.startswith("(x, y, z) = (")
    assert said.endswith("in 5 rows (12, 13, 14, 15, 16): was the beam lost?")


def test_two_marks_are_told_apart(rv_m2):
    place = np.array(measured(rv_m2, 4).position)
    place[5:9, 1], place[20:29, 1] = 9.999, -9.999
    rows, sentences = marks(replace(measured(rv_m2, 4), position=place))
    assert rows.sum() == 13
    assert [said[:11] for said in sentences] == ["y is −9999 ", "y is 9999 i"]


@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_said_of_sound_rounded_tables(name, step):
    for seed, (samples, repeats) in enumerate([(15, 1), (60, 1), (300, 1), (240, 30), (60, 4)]):
        for more in ({}, NO_CLOCK):
            sound = replace(measured(arm(name), seed, samples, repeats=repeats, step=step), **more)
            assert marks(sound)[1] == []
            assert list(doubled(sound)) == []


def test_a_coordinate_that_stays_by_design_is_no_mark(rv_m2):
    """A row of poses in the plane y = 0, and in one height, exact as a simulator writes them."""
    sound = simulate(rv_m2, [], samples=60, seed=2, noise=0.0)[0]
    q = np.array(sound.q)
    q[::3, [0, 3, 4]] = 0.0
    place = rv_m2.forward(q)[:, :3, 3]
    place[::3, 1] = 0.0
    assert marks(replace(sound, q=q, position=place))[1] == []


@pytest.mark.parametrize("sockets", [1, 2, 3])
def test_a_ball_in_sockets_is_no_mark(rv_m2, sockets):
    sound = measured(rv_m2, 5)
    places = np.random.default_rng(1).uniform(-0.5, 0.5, (sockets, 3))
    assert marks(replace(sound, position=places[np.arange(60) % sockets]))[1] == []


def test_a_mark_of_one_of_several_targets_is_told_by_its_columns():
    robot = arm("rv_m2")
    sound = simulate(robot, [], samples=40, seed=6, turning=1e-5)[0]
    frame = sound.to_frame().drop(columns=["x", "y", "z", "qw", "qx", "qy", "qz"])
    pose = robot.forward(sound.q)
    for k, offset in enumerate([[0.0, 0.0, 0.1], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.1]], start=1):
        place = pose[:, :3, 3] + pose[:, :3, :3] @ np.array(offset)
        if k == 2:
            place[[4, 9, 30]] = 0.0
        frame[[f"x.{k}", f"y.{k}", f"z.{k}"]] = place
    found = campaign_from_table(robot, frame, length_unit="m", angle_unit="rad")
    assert any(w.startswith("x.2 = y.2 = z.2 = 0 in 3 rows (6, 11, 32): was") for w in found.warnings)


def test_a_copy_is_told_with_the_row_that_it_copies(rv_m2):
    once = measured(rv_m2, 7)
    one = replace(once.take(np.array([*range(60), 10])), rows=np.arange(2, 63))
    assert list(doubled(one)) == ["rows 12 and 62 are the same in every column: a copy, no repeat"]
    assert np.flatnonzero(copies(one)).tolist() == [60]
    three = replace(once.take(np.array([*range(60), 10, 10, 5])), rows=np.arange(2, 65))
    (said,) = doubled(three)
    assert said == "3 rows (62, 63, 64) are the same in every column as 2 rows (7, 12): copies, no repeats"
    # another second, another session, another turn of the tool: no copy
    later = np.arange(61.0)
    assert not copies(replace(one, covariates={**one.covariates, "time": later})).any()
    assert not copies(replace(one, labels={"session": np.array(["a"] * 60 + ["b"])})).any()


def test_repeats_that_coarse_figures_cannot_tell_are_no_copies(rv_m2):
    coarse = replace(measured(rv_m2, 8, 60, repeats=30, step=1e-4), **NO_CLOCK)
    assert len(np.unique(coarse.position, axis=0)) < 60
    assert not copies(coarse).any()
    fine = replace(measured(rv_m2, 8, 60, repeats=30), **NO_CLOCK)
    twice = replace(fine.take(np.repeat(np.arange(60), 2)), rows=np.arange(2, 122))
    assert copies(twice).sum() == 60


def test_the_demo_has_neither():
    assert marks(demo_campaign())[1] == []
    assert not copies(demo_campaign()).any()
