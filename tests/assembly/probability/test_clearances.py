"""Clearances of many joints at once: where each fails as often as is asked."""

import numpy as np
import pytest
from assembly.probability.test_discs import cases

from thermal_robot.assembly.probability import failing_probability, required_clearance
from thermal_robot.assembly.probability.planar import disc_clearances


@pytest.mark.parametrize("segments", [False, True])
@pytest.mark.parametrize("failing", [0.7, 6.6e-5])
@pytest.mark.parametrize("ratio", [3.0, 1e4])
def test_each_fails_as_often_as_is_asked(ratio, failing, segments):
    matrices, means, _, ends = cases(6, ratio, segments, count=60)
    found = disc_clearances(matrices, means, np.log(failing), ends)
    told = np.isfinite(found)
    heated = {} if ends is None else {"segments": ends[told]}
    fails = failing_probability(matrices[told], found[told], means[told], **heated)
    np.testing.assert_allclose(fails, failing, rtol=1e-9)
    assert told.all() or segments


def test_equal_axes_have_the_closed_form():
    sizes = np.array([1e-6, 0.3, 40.0])
    matrices = sizes[:, None, None] ** 2 * np.eye(2)
    found = disc_clearances(matrices, np.zeros((3, 2)), np.log(1e-3))
    np.testing.assert_allclose(found, 2.0 * sizes * np.sqrt(-2.0 * np.log(1e-3)), rtol=1e-13)


def test_what_is_too_rare_for_the_cheap_integrals_is_left_to_others():
    matrix, mean = np.diag([4.0, 1e-6])[None], np.array([[1.0, 0.3]])
    assert np.isnan(disc_clearances(matrix, mean, -200.0)).all()
    needed = required_clearance(matrix, failing=np.exp(-200.0), mean=mean)
    assert float(np.log(failing_probability(matrix, needed, mean)[0])) == pytest.approx(-200.0, rel=1e-9)


def test_many_are_as_one_after_the_other():
    matrices, means, _, ends = cases(7, 50.0, True, count=12)
    many = required_clearance(matrices, capability=1.33, mean=means, segments=ends)
    each = [required_clearance(matrices[k], capability=1.33, mean=means[k], segments=ends[k]) for k in range(12)]
    assert many.shape == (12,)
    np.testing.assert_allclose(many, each, rtol=1e-12)
    assert isinstance(each[0], float)
