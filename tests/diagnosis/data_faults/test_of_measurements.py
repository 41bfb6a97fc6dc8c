"""Each repair of measurements undoes its fault in the rows that were struck, and touches no other row."""

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_tables import SPOILT

from thermal_robot.diagnosis.data_faults.faults import MEASUREMENT_KINDS as KINDS
from thermal_robot.diagnosis.data_faults.faults import Readings


@pytest.fixture(scope="module")
def sound():
    return simulate(load_arm("ur10"), samples=12, seed=1, turning=3e-5)[0]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_one_proposal_gives_the_measurements_back(sound, kind):
    spoilt = Readings.of(SPOILT[kind.name](sound))
    every = np.ones(12, dtype=bool)
    mended = [p.repair(spoilt, every) for p in kind.proposed(spoilt)]
    assert any(
        np.allclose(m.position, sound.position, rtol=1e-12) and np.allclose(m.orientation, sound.orientation)
        for m in mended
    )


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_rows_that_were_not_struck_stay(sound, kind):
    plain, struck = Readings.of(sound), np.arange(12) % 3 == 0
    for proposal in kind.proposed(plain):
        changed = proposal.repair(plain, struck)
        np.testing.assert_array_equal(changed.position[~struck], sound.position[~struck])
        np.testing.assert_array_equal(changed.orientation[~struck], sound.orientation[~struck])
        np.testing.assert_array_equal(changed.q, sound.q)


def test_a_table_without_orientations_has_no_faults_of_them(rv_m2):
    plain = Readings.of(simulate(rv_m2, samples=12, seed=1)[0])
    assert not [p for kind in KINDS if "quaternion" in kind.name for p in kind.proposed(plain)]
