"""Each repair undoes its fault in the rows that were struck, and touches no other row; then frames bring them near."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_tables import joints_read_at

from thermal_robot.diagnosis.data_faults.faults import (
    JOINT_KINDS,
    MEASUREMENT_KINDS,
    PAIRING_KINDS,
    Readings,
    stacked,
)
from thermal_robot.inference import settings
from thermal_robot.kinematics import exp3, quaternion_to_rotation, rotation_to_quaternion

NOISE = 20e-6
SHIFTED, LATE = PAIRING_KINDS
EVERY, TIMED = np.ones(12, dtype=bool), np.ones(20, dtype=bool)


@pytest.fixture(scope="module")
def sound():
    return simulate(load_arm("ur10"), samples=12, seed=1, turning=3e-5)[0]


@pytest.fixture(scope="module")
def timed():
    return simulate(load_arm("ur10"), samples=20, seed=1)[0]


def named(kind):
    return kind.name


@pytest.mark.parametrize("kind", [*JOINT_KINDS, *MEASUREMENT_KINDS], ids=named)
def test_rows_that_were_not_struck_stay(sound, kind):
    plain, struck = Readings.of(sound), np.arange(12) % 3 == 0
    measured = kind in MEASUREMENT_KINDS
    for proposal in kind.proposed(plain):
        changed = proposal.repair(plain, struck)
        assert measured or np.any(changed.q[struck] != sound.q[struck])
        for column in ("q", "position", "orientation"):
            rows = ~struck if measured is (column != "q") else EVERY
            np.testing.assert_array_equal(getattr(changed, column)[rows], getattr(sound, column)[rows])


@pytest.mark.parametrize("shift", [-9.0, 9.0])
def test_commands_read_at_another_time_are_unmixed(timed, shift):
    spoilt = Readings.of(joints_read_at(timed, shift))
    mended = [family.of(-shift).repair(spoilt, TIMED) for family in LATE.families(spoilt)]
    # to rounding, times what an inverse of steps of so many parts loses
    exact = [m for m in mended if np.abs(m.q - timed.q)[m.known].max() < 1e-6]
    assert any(m.known.sum() >= 17 for m in exact)


def test_rows_that_were_not_paired_wrongly_stay(timed):
    plain, struck = Readings.of(timed), np.arange(20) % 3 == 0
    proposals = [*SHIFTED.proposed(plain), *(f.of(n) for f in LATE.families(plain) for n in (-9.0, 9.0))]
    for proposal in proposals:
        changed = proposal.repair(plain, struck)
        np.testing.assert_allclose(changed.q[~struck], timed.q[~struck], atol=1e-12)
        assert np.all(changed.known[~struck])


def test_a_turn_counts_by_what_it_moves_at_a_lever(rv_m2):
    poses = simulate(rv_m2, samples=30, seed=1, noise=NOISE, turning=1e-6)[0]
    readings = Readings.of(poses)
    frames, turn = readings.align(), 0.1
    turned = quaternion_to_rotation(poses.orientation) @ exp3(np.array([[turn, 0.0, 0.0]]))
    away = replace(readings, orientation=rotation_to_quaternion(turned)).distance(frames)
    np.testing.assert_allclose(away, settings.LEVER * turn, rtol=0.05)


def test_readings_side_by_side_are_what_they_are_one_by_one(rv_m2):
    several = [Readings.of(simulate(rv_m2, samples=30, seed=k, noise=NOISE, turning=3e-5)[0]) for k in range(3)]
    side = stacked(several)
    begun = np.zeros((3, 1, 3))
    frames = side.align(begun=begun)
    distance = side.distance(frames)
    left, place = side.relaxed()
    for k, own in enumerate(several):
        alone = own.align(begun=begun[k])
        np.testing.assert_allclose(distance[k], own.distance(alone), atol=1e-9)
        np.testing.assert_allclose(left[k], own.relaxed()[0], atol=1e-9)
        np.testing.assert_allclose(side.still()[k], own.still())
        # the map tells where the target sits as well as rigid frames do
        np.testing.assert_allclose(place[k], alone.tool[:3, 3], atol=5e-3)


def test_a_map_leaves_nothing_whatever_unit_and_axes_the_instrument_has(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=60, seed=1, noise=NOISE, outliers=0.1)[0])
    plain = np.median(readings.relaxed()[0])
    other = replace(readings, position=25.4 * readings.position[:, [1, 0, 2]] * [1.0, 1.0, -1.0])
    assert np.median(other.relaxed()[0]) == pytest.approx(plain, rel=0.1)
    turned = replace(readings, q=readings.q * np.where(np.arange(rv_m2.n) == 2, -1.0, 1.0))
    assert np.median(turned.relaxed()[0]) > 100.0 * plain
