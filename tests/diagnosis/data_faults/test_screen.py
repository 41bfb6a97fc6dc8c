"""Among thousands of candidates the true one is looked at, whatever else is wrong on the other side."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_tables import SPOILT

from thermal_robot.diagnosis.data_faults.faults import Readings
from thermal_robot.diagnosis.data_faults.find import Screen, Struck


@pytest.fixture(scope="module")
def sound():
    return simulate(load_arm("ur10"), ["joint_offset"], samples=60, seed=4, turning=3e-5)[0]


def screened(*spoil, campaign):
    for one in spoil:
        campaign = SPOILT[one](campaign)
    return Screen(Struck.whole(Readings.of(campaign)))


def best(tried, faults):
    own = min((t for t in tried if len(t.fault) == faults), key=lambda t: t.typical)
    return {p.kind.name for p in own.fault}, own


@pytest.mark.parametrize("joints", ["reversed joints", "exchanged joints", "rad read as degrees"])
@pytest.mark.parametrize("measured", ["inch", "mirrored axis", "quaternion order", "angles of orientations"])
def test_a_fault_on_each_side_is_found(sound, joints, measured):
    screen = screened(joints, measured, campaign=sound)
    kinds, own = best(screen.both_sides(), 2)
    assert kinds == {joints, measured}
    assert own.typical < 2e-3
    assert screen.asked > 100


def test_two_faults_of_the_joints_are_found(sound):
    screen = screened("coupled joints", "reversed joints", campaign=sound)
    kinds, own = best(screen.two_of_joints(), 2)
    assert kinds == {"coupled joints", "reversed joints"}
    assert own.typical < 2e-3


def test_of_faults_that_differ_by_a_number_the_best_is_asked(sound):
    screen = screened("clock offset", campaign=sound)
    kinds, own = best(screen.both_sides(), 1)
    assert kinds == {"clock offset"}
    assert own.typical < 2e-3


def test_known_frames_are_not_fitted(sound):
    readings = Readings.of(SPOILT["reversed joint"](sound))
    rows = np.ones(sound.samples, dtype=bool)
    frames = Readings.of(sound).align()
    screen = Screen(Struck(readings, rows, readings.distance(frames), frames))
    kinds, own = best(screen.singly(), 1)
    assert kinds == {"reversed joint"}
    assert own.typical < 2e-3


def test_where_not_even_a_map_leaves_little_nothing_is_looked_at(sound):
    """A joint that does something else than its column says: neither units nor axes nor two faults mend it."""
    q = np.array(sound.q)
    q[:, 1] = np.sin(2.0 * q[:, 1]) + 0.3 * q[:, 2]
    screen = Screen(Struck.whole(Readings.of(replace(sound, q=q, orientation=None, noise_orientation=None))))
    assert [t for t in screen.both_sides() if len(t.fault) == 2] == []
    assert screen.two_of_joints() == []
    assert screen.asked > 10_000  # they count as tried all the same
