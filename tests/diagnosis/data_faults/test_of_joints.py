"""Each repair of joints undoes its fault in the rows that were struck, and touches no other row."""

import numpy as np
import pytest
from conftest import load_arm
from simulate import simulate
from spoilt_tables import SPOILT

from thermal_robot.diagnosis.data_faults.faults import JOINT_KINDS as KINDS
from thermal_robot.diagnosis.data_faults.faults import Readings


@pytest.fixture(scope="module")
def sound():
    return simulate(load_arm("ur10"), samples=12, seed=1)[0]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_one_proposal_gives_the_commands_back(sound, kind):
    spoilt = Readings.of(SPOILT[kind.name](sound))
    every = np.ones(12, dtype=bool)
    away = [p.repair(spoilt, every).q - sound.q for p in kind.proposed(spoilt)]
    left = [np.abs(np.exp(1j * a) - 1.0).max() for a in away]  # whole turns apart is the same command
    assert sorted(left)[0] < 1e-12 < sorted(left)[1]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_rows_that_were_not_struck_stay(sound, kind):
    plain, struck = Readings.of(sound), np.arange(12) % 3 == 0
    for proposal in kind.proposed(plain):
        changed = proposal.repair(plain, struck)
        np.testing.assert_array_equal(changed.q[~struck], sound.q[~struck])
        assert np.any(changed.q[struck] != sound.q[struck])
        np.testing.assert_array_equal(changed.position, sound.position)
