"""The noise of all rows, and each row's beside it."""

import numpy as np
import pytest

from thermal_robot.campaign.targets import of_a_point, posed, relative_sigmas, sigma_of_all, told_by
from thermal_robot.kinematics import exp3

SIGMAS = np.array([1e-5, 5e-5, 7e-5])
PLACES = np.array([[0.1, 0.0, 0.0], [-0.05, 0.08, 0.0], [-0.05, -0.08, 0.02], [0.0, 0.0, 0.12]])


@pytest.fixture
def targets():
    """Three rows, the second without the last target."""
    points = PLACES @ exp3(np.array([[0.1, 0.2, 0.3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])).transpose(0, 2, 1)
    points[1, 3] = np.nan
    return posed((1, 2, 3, 4), points).targets


def test_of_all_rows_it_is_the_root_mean_square_and_of_equal_ones_they_themselves():
    assert sigma_of_all(SIGMAS, None) == (pytest.approx(5e-5), None)
    assert sigma_of_all(np.full(7, 0.1 + 0.2), None) == (0.1 + 0.2, None)


@pytest.mark.parametrize("turned", [False, True])
def test_orientations_have_one_noise_in_all_rows(turned):
    found = relative_sigmas(SIGMAS, 5e-5, None, turned)
    np.testing.assert_allclose(found[:, :3], np.repeat(SIGMAS[:, None] / 5e-5, 3, axis=1))
    np.testing.assert_array_equal(found[:, 3:], np.ones((3, 3 if turned else 0)))
    assert relative_sigmas(np.full(3, 5e-5), 5e-5, None, turned) is None
    assert relative_sigmas(None, 5e-5, None, turned) is None


@pytest.mark.parametrize("sigmas", [None, SIGMAS], ids=["one", "each"])
def test_several_targets_tell_the_noise_of_every_figure(targets, sigmas):
    """That of a point times what the pose makes of it, whatever stands for all rows."""
    place, turn = told_by(4e-5, targets) if sigmas is None else sigma_of_all(sigmas, targets)
    found = relative_sigmas(sigmas, place, targets, True) * np.repeat([place, turn], 3)
    np.testing.assert_allclose(found, targets.spread * np.reshape(4e-5 if sigmas is None else sigmas, (-1, 1)))
    assert of_a_point(told_by(4e-5, targets)[0], targets) == pytest.approx(4e-5)
    # nobody states it: how the figures compare is known all the same
    np.testing.assert_allclose(
        relative_sigmas(None, None, targets, True), targets.spread / np.repeat(targets.typical, 3)
    )
