"""Which rows are in question: those that stray from the others are told from them, half of all at most."""

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_tables import with_joints

from thermal_robot.diagnosis.data_faults.faults import Readings
from thermal_robot.diagnosis.data_faults.find import KINDS, Struck, consensus, mixture, part_of, spread, window


@pytest.fixture(scope="module")
def sound():
    return simulate(load_arm("ur10"), ["joint_offset"], samples=60, seed=4)[0]


def spoilt(campaign, share):
    struck = np.random.default_rng(1).random(campaign.samples) < share
    return Readings.of(with_joints(campaign, lambda q: np.where(struck[:, None], -q, q), 2)), struck


@pytest.mark.parametrize("share", [0.15, 0.3, 0.45])
def test_few_rows_drawn_at_random_bring_the_sound_ones_near(sound, share):
    readings, struck = spoilt(sound, share)
    distance = readings.distance(consensus(readings))
    assert distance[~struck].max() < readings.tolerance < np.median(distance[struck])
    part = part_of(readings, consensus(readings))
    # a joint that is near zero counts alike both ways
    assert (part.rows != struck).mean() < 0.05
    assert part.median == pytest.approx(np.median(distance[struck]), rel=0.3)


def test_nobody_strays_from_a_sound_table(sound):
    readings = Readings.of(sound)
    assert part_of(readings, readings.align()) is None


@pytest.mark.parametrize("share", [0.55, 0.65])
def test_rows_that_choose_between_two_tables_are_told_apart(sound, share):
    readings, struck = spoilt(sound, share)
    found = mixture(Struck.whole(readings))
    assert (found.rows != struck).mean() < 0.05
    assert mixture(Struck.whole(Readings.of(sound))) is None


def test_a_sketch_has_so_many_rows_and_is_none_where_most_are_not_determined(sound):
    struck = Struck.whole(Readings.of(sound))
    assert len(struck.sketch((), 7).q) == 7
    assert len(struck.sketch((), 700).q) == sound.samples
    shift = next(p for kind in KINDS if kind.name == "shifted rows" for p in kind.proposed(struck.readings))
    assert len(struck.sketch((shift,), 700).q) == sound.samples
    assert Struck.whole(struck.readings.take(np.arange(3))).sketch((shift,), 7) is None


def test_rows_are_spread_over_the_campaign_and_a_window_is_its_middle(sound):
    assert spread(np.arange(5), 9).tolist() == [0, 1, 2, 3, 4]
    assert spread(np.arange(101), 3).tolist() == [0, 50, 100]
    long = simulate(load_arm("ur10"), samples=300, seed=2)[0]
    seen = window(Readings.of(long)).clock
    assert len(seen) < 300
    ordered = np.sort(long.covariates["time"])
    assert np.array_equal(np.sort(seen), ordered[(ordered >= seen.min()) & (ordered <= seen.max())])
