"""The law of an error: what may stand in it, and how its leading axes broadcast."""

import numpy as np
import pytest

from thermal_robot.assembly.probability import UniformSpread, joining_probability
from thermal_robot.assembly.probability.joining import Law, check_covariance


def test_leading_axes_broadcast():
    law = Law.of(np.tile(np.eye(2), (3, 1, 1, 1)), np.zeros((4, 2)), segments=[1.0, 0.0])
    assert law.leading == (3, 4)
    flat = law.flat(law.leading)
    assert flat.matrices.shape == (12, 2, 2)
    assert flat.rows(np.arange(5)).segments.shape == (5, 2)


def test_a_shift_and_a_normal_part_stand_in_mean_and_covariance():
    spread = UniformSpread.segment([3.0, 0.0], start=[1.0, 0.0])
    law = Law.of(np.eye(2), 0.0, spread, "normal")
    np.testing.assert_allclose(law.means, [2.0, 0.0])
    np.testing.assert_allclose(law.matrices, np.diag([1.0 + 1.0 / 3.0, 1.0]))
    np.testing.assert_allclose(Law.of(np.eye(2), [1.0, 2.0], [[3.0, 4.0], [5.0, 6.0]]).means, [[4, 6], [6, 8]])


def test_a_segment_of_each_is_the_spread_of_all_where_they_are_alike():
    matrices = np.array([np.diag([1.0, 2.0]), [[3.0, 1.0], [1.0, 0.5]]])
    spread = joining_probability(matrices, 4.0, [0.3, 0.1], thermal=UniformSpread.segment([2.0, 1.0]))
    each = joining_probability(matrices, 4.0, [0.3, 0.1], segments=[[2.0, 1.0], [-2.0, -1.0]])
    np.testing.assert_allclose(each, spread, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mean": [1.0]}, "mean must be finite with shape"),
        ({"thermal": [np.nan, 0.0]}, "a thermal shift must be finite"),
        ({"segments": [1.0, 2.0, 3.0]}, "segments must be finite"),
        ({"segments": [1.0, 0.0], "thermal": UniformSpread.segment([1.0, 0.0])}, "not both"),
        ({"thermal": UniformSpread.segment([1.0, 0.0, 0.0])}, "must be planar"),
        ({"thermal": UniformSpread.segment([1.0, 0.0]), "randomised": "so"}, "randomised must be"),
    ],
)
def test_what_is_no_law_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        Law.of(np.eye(2), **given)


@pytest.mark.parametrize(
    "matrix", [np.eye(3), [[1.0, 2.0], [0.0, 1.0]], [[1.0, 2.0], [2.0, 1.0]], [[np.nan, 0], [0, 1]]]
)
def test_what_is_no_covariance_is_refused(matrix):
    with pytest.raises(ValueError, match="covariance must be"):
        check_covariance(matrix)
