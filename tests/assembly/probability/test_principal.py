"""Principal axes of planar covariances: the small variance keeps its digits."""

import mpmath as mp
import numpy as np
import pytest

from thermal_robot.assembly.probability.planar import Principal


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e8, 1e12])
def test_the_smaller_variance_is_that_of_the_matrix_as_it_is_stored(ratio):
    axis = np.array([np.cos(0.7), np.sin(0.7)])
    matrix = np.outer(axis, axis) + (np.eye(2) - np.outer(axis, axis)) / ratio
    matrix = 0.5 * (matrix + matrix.T)
    found = Principal.of(matrix)
    with mp.workdps(50):
        a, b, d = (mp.mpf(float(matrix[i])) for i in ((0, 0), (0, 1), (1, 1)))
        middle, half = (a + d) / 2, mp.sqrt((a - d) ** 2 / 4 + b * b)
        large, small = float(middle + half), float(middle - half)
    assert float(found.large) == pytest.approx(large, rel=1e-15)
    assert float(found.small) == pytest.approx(small, rel=1e-14)


def test_coordinates_along_the_axes_rebuild_vector_and_matrix():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(20, 2, 2))
    matrices, vectors = root @ np.swapaxes(root, 1, 2), rng.normal(size=(20, 2))
    found = Principal.of(matrices)
    first = found.direction
    second = np.stack([-first[:, 1], first[:, 0]], axis=1)
    turned = found.turned(vectors)
    np.testing.assert_allclose(turned[:, :1] * first + turned[:, 1:] * second, vectors, atol=1e-14)
    outer = [v[:, :, None] * v[:, None] for v in (first, second)]
    rebuilt = found.large[:, None, None] * outer[0] + found.small[:, None, None] * outer[1]
    np.testing.assert_allclose(rebuilt, matrices, atol=1e-13)
    np.testing.assert_array_equal(found.rows(np.array([3])).large, found.large[[3]])
