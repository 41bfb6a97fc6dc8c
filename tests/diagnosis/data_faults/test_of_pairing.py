"""What was shifted or interpolated is given back; what lies outside the table is said not to be known."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_tables import joints_read_at, measured_at

from thermal_robot.diagnosis.data_faults.faults import PAIRING_KINDS as KINDS
from thermal_robot.diagnosis.data_faults.faults import Readings

SHIFTED, LATE = KINDS
EVERY = np.ones(20, dtype=bool)


@pytest.fixture(scope="module")
def sound():
    return simulate(load_arm("ur10"), samples=20, seed=1)[0]


@pytest.mark.parametrize("rows", [1, -1, 2])
def test_columns_shifted_by_rows_are_shifted_back(sound, rows):
    spoilt = Readings.of(measured_at(sound, np.roll(np.arange(20), rows)))
    fits = [
        np.array_equal(mended.q[mended.known], np.roll(sound.q, rows, axis=0)[mended.known])
        for p in SHIFTED.proposed(spoilt)
        if (mended := p.repair(spoilt, EVERY)).known.sum() == 20 - abs(rows)
    ]
    assert fits.count(True) == 1


@pytest.mark.parametrize("shift", [-9.0, 9.0])
def test_commands_read_at_another_time_are_unmixed(sound, shift):
    spoilt = Readings.of(joints_read_at(sound, shift))
    mended = [family.of(-shift).repair(spoilt, EVERY) for family in LATE.families(spoilt)]
    # to rounding, times what an inverse of steps of so many parts loses
    exact = [m for m in mended if np.abs(m.q - sound.q)[m.known].max() < 1e-6]
    assert any(m.known.sum() >= 17 for m in exact)


def test_an_offset_is_not_asked_for_without_a_clock(sound):
    timeless = replace(sound, covariates={})
    assert list(LATE.families(Readings.of(timeless))) == []
    assert list(LATE.proposed(Readings.of(sound))) == []


def test_rows_that_were_not_struck_stay(sound):
    plain, struck = Readings.of(sound), np.arange(20) % 3 == 0
    proposals = [*SHIFTED.proposed(plain), *(f.of(n) for f in LATE.families(plain) for n in (-9.0, 9.0))]
    for proposal in proposals:
        changed = proposal.repair(plain, struck)
        np.testing.assert_allclose(changed.q[~struck], sound.q[~struck], atol=1e-12)
        assert np.all(changed.known[~struck])
