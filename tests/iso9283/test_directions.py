"""VAP by hand."""

import numpy as np
import pytest
from clouds import cloud

from thermal_robot.iso9283 import variation


def test_the_largest_of_three_distances_counts():
    """Barycentres 7, 5 and √14 mm apart."""
    found = variation([cloud(), cloud([2e-3, 3e-3, 6e-3]), cloud([0, 4e-3, 3e-3])])
    assert found.position == pytest.approx(7e-3)
    assert found.angles is None


def test_scatter_does_not_count_and_each_angle_has_its_own_pair():
    found = variation([cloud(about_z=1.0), cloud(about_z=2.0, mean_turn=4e-3), cloud(about_z=0.5, mean_turn=-1e-3)])
    assert found.position == pytest.approx(0.0, abs=1e-15)
    assert found.angles == pytest.approx((0, 0, 5e-3), abs=1e-9)
    assert np.all(np.array(found.angles) >= 0)
