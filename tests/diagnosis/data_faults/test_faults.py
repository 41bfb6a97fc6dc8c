"""Each repair undoes its fault in the rows that were struck, and touches no other row; then frames bring them near."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_tables import SPOILT, joints_read_at, measured_at

from thermal_robot.diagnosis.data_faults.faults import (
    JOINT_KINDS,
    MEASUREMENT_KINDS,
    PAIRING_KINDS,
    Kind,
    Readings,
    stacked,
)
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import rms
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


def test_every_number_of_a_family_gives_its_own_proposal():
    kind = Kind("late", "late by {}", "pair anew", offsets=lambda _: [((1.0, 2.0), lambda by: (f"{by:g} s", by))])
    (family,) = kind.families(None)
    proposals = [family.of(number) for number in family.tried]
    assert [(p.kind, p.place, p.repair) for p in proposals] == [(kind, "1 s", 1.0), (kind, "2 s", 2.0)]
    assert list(kind.proposed(None)) == []


def test_a_kind_proposes_each_of_its_places():
    kind = Kind("reversed", "{} is reversed", "turn it", lambda names: [(name, np.negative) for name in names])
    assert [p.kind.says.format(p.place) for p in kind.proposed(["a", "b"])] == ["a is reversed", "b is reversed"]


@pytest.mark.parametrize("kind", JOINT_KINDS, ids=named)
def test_one_proposal_gives_the_commands_back(sound, kind):
    spoilt = Readings.of(SPOILT[kind.name](sound))
    away = [p.repair(spoilt, EVERY).q - sound.q for p in kind.proposed(spoilt)]
    left = [np.abs(np.exp(1j * a) - 1.0).max() for a in away]  # whole turns apart is the same command
    assert sorted(left)[0] < 1e-12 < sorted(left)[1]


@pytest.mark.parametrize("kind", MEASUREMENT_KINDS, ids=named)
def test_one_proposal_gives_the_measurements_back(sound, kind):
    spoilt = Readings.of(SPOILT[kind.name](sound))
    mended = [p.repair(spoilt, EVERY) for p in kind.proposed(spoilt)]
    assert any(
        np.allclose(m.position, sound.position, rtol=1e-12) and np.allclose(m.orientation, sound.orientation)
        for m in mended
    )


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


def test_a_table_without_orientations_has_no_faults_of_them(rv_m2):
    plain = Readings.of(simulate(rv_m2, samples=12, seed=1)[0])
    assert not [p for kind in MEASUREMENT_KINDS if "quaternion" in kind.name for p in kind.proposed(plain)]


@pytest.mark.parametrize("rows", [1, -1, 2])
def test_columns_shifted_by_rows_are_shifted_back(timed, rows):
    spoilt = Readings.of(measured_at(timed, np.roll(np.arange(20), rows)))
    fits = [
        np.array_equal(mended.q[mended.known], np.roll(timed.q, rows, axis=0)[mended.known])
        for p in SHIFTED.proposed(spoilt)
        if (mended := p.repair(spoilt, TIMED)).known.sum() == 20 - abs(rows)
    ]
    assert fits.count(True) == 1


@pytest.mark.parametrize("shift", [-9.0, 9.0])
def test_commands_read_at_another_time_are_unmixed(timed, shift):
    spoilt = Readings.of(joints_read_at(timed, shift))
    mended = [family.of(-shift).repair(spoilt, TIMED) for family in LATE.families(spoilt)]
    # to rounding, times what an inverse of steps of so many parts loses
    exact = [m for m in mended if np.abs(m.q - timed.q)[m.known].max() < 1e-6]
    assert any(m.known.sum() >= 17 for m in exact)


def test_an_offset_is_not_asked_for_without_a_clock(timed):
    timeless = replace(timed, covariates={})
    assert list(LATE.families(Readings.of(timeless))) == []
    assert list(LATE.proposed(Readings.of(timed))) == []


def test_rows_that_were_not_paired_wrongly_stay(timed):
    plain, struck = Readings.of(timed), np.arange(20) % 3 == 0
    proposals = [*SHIFTED.proposed(plain), *(f.of(n) for f in LATE.families(plain) for n in (-9.0, 9.0))]
    for proposal in proposals:
        changed = proposal.repair(plain, struck)
        np.testing.assert_allclose(changed.q[~struck], timed.q[~struck], atol=1e-12)
        assert np.all(changed.known[~struck])


def test_what_fits_is_left_with_its_noise(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=60, seed=1, noise=NOISE, outliers=0.1)[0])
    distance = readings.distance(readings.align())
    # the median distance of three normal components
    assert np.median(distance) == pytest.approx(1.54 * NOISE, rel=0.25)


def test_a_turn_counts_by_what_it_moves_at_a_lever(rv_m2):
    poses = simulate(rv_m2, samples=30, seed=1, noise=NOISE, turning=1e-6)[0]
    readings = Readings.of(poses)
    frames, turn = readings.align(), 0.1
    turned = quaternion_to_rotation(poses.orientation) @ exp3(np.array([[turn, 0.0, 0.0]]))
    away = replace(readings, orientation=rotation_to_quaternion(turned)).distance(frames)
    np.testing.assert_allclose(away, settings.LEVER * turn, rtol=0.05)


def test_rows_are_taken_from_every_column(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=30, seed=1, turning=3e-5)[0])
    some = readings.take(np.array([4, 2]))
    for name in ("q", "position", "orientation", "clock"):
        np.testing.assert_array_equal(getattr(some, name), getattr(readings, name)[[4, 2]])


def test_the_root_mean_square_of_a_right_triangle():
    assert rms(np.array([[3.0], [4.0]])) == pytest.approx(np.sqrt(12.5))


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


def test_a_robot_at_rest_leaves_the_extent_of_the_points(rv_m2):
    readings = Readings.of(simulate(rv_m2, samples=60, seed=1)[0])
    rest = replace(readings, q=np.repeat(readings.q[:1], 60, axis=0))
    assert np.median(rest.distance(rest.align())) == pytest.approx(readings.still(), rel=0.2)
