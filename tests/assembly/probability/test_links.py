"""Sums over uniform parts: weights, moments, exactness under the normal part that they are made for."""

import mpmath as mp
import numpy as np
import pytest

from thermal_robot.assembly.probability.joining import generator_lengths, link_nodes, planar_link_nodes

COLUMNS = np.array([[0.5, 0.2, 1.0, -0.3], [0.1, 0.6, 0.2, 0.4]])


@pytest.mark.parametrize("count", [2, 3, 4])
def test_planar_nodes_keep_every_moment_of_the_sum(count):
    columns = COLUMNS[:, :count]
    few, few_weights = planar_link_nodes(np.eye(2), columns)
    all_nodes, all_weights = link_nodes(np.eye(2), columns)
    assert np.sum(few_weights) == pytest.approx(1.0, rel=1e-13)
    for i in range(6):
        for j in range(6):
            powers = [(s[:, 0] ** i * s[:, 1] ** j) @ w for s, w in ((few, few_weights), (all_nodes, all_weights))]
            assert powers[0] == pytest.approx(powers[1], rel=1e-11, abs=1e-13)


@pytest.mark.parametrize("columns", [COLUMNS[:, :1], COLUMNS[:, :2], COLUMNS[:, :3]])
@pytest.mark.parametrize("nodes", [link_nodes, planar_link_nodes])
def test_nodes_have_the_moments_of_the_uniform_parts(nodes, columns):
    shifts, weights = nodes(0.3 * np.eye(2), columns)
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(weights @ shifts, 0.0, atol=1e-13)
    # A generator with u uniform on [−1, 1] has a third of its square as variance; independent ones add.
    np.testing.assert_allclose((shifts.T * weights) @ shifts, columns @ columns.T / 3.0, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("length", [0.1, 3.0, 12.0])
def test_mean_of_a_shifted_tail_is_exact_far_out(length):
    # The mean of Φ(−x + a u) over u has a closed form; mpmath has it in 60 digits.
    shifts, weights = link_nodes(np.eye(1), np.array([[length]]))
    for x in (0.0, 2.0, length + 5.0, length + 20.0):
        with mp.workdps(60):
            far, near = (mp.npdf(e) - e * mp.erfc(e / mp.sqrt(2)) / 2 for e in (mp.mpf(x + length), mp.mpf(x - length)))
            expected = (near - far) / (2 * mp.mpf(length))
            values = [mp.erfc((mp.mpf(x) - mp.mpf(float(s))) / mp.sqrt(2)) / 2 for s in shifts[:, 0]]
            found = mp.fdot(values, [mp.mpf(float(w)) for w in weights])
            assert abs(found / expected - 1) < 1e-12


def test_two_sums_multiply():
    shifts, weights = link_nodes(np.eye(2), np.diag([0.8, 1.7]))
    for a, b in ((0.0, 1.0), (2.0, -0.5), (3.0, 3.0)):
        mean = weights @ np.exp(shifts @ np.array([a, b]))
        expected = np.prod([np.sinh(k) / k if k else 1.0 for k in (0.8 * a, 1.7 * b)])
        assert mean == pytest.approx(expected, rel=1e-12)


def test_lengths_are_counted_in_standard_deviations():
    covariance = np.diag([4.0, 0.25])
    np.testing.assert_allclose(generator_lengths(covariance, np.array([[6.0, 0.0], [0.0, 2.0]])), [3.0, 4.0])
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    turned = generator_lengths(turn @ covariance @ turn.T, turn @ COLUMNS)
    np.testing.assert_allclose(turned, generator_lengths(covariance, COLUMNS), rtol=1e-12)


def test_a_narrower_normal_part_needs_more_nodes_until_it_is_refused():
    counts = [len(link_nodes(s**2 * np.eye(2), COLUMNS[:, :2])[1]) for s in (1.0, 0.3, 0.1)]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


@pytest.mark.parametrize("nodes", [link_nodes, planar_link_nodes])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_vanishing_normal_part_is_refused_at_once(nodes, count):
    # Without a limit that is known beforehand there would be 1e12 nodes: no memory holds them.
    for variance in (1e-8, 1e-10, 0.0):
        with pytest.raises(ValueError, match="so narrow a normal part need too many nodes"):
            nodes(variance * np.eye(2), COLUMNS[:, :count])


def test_number_of_planar_nodes_does_not_grow_with_the_number_of_generators():
    # The same sum of lengths, cut into more and more pieces.
    counts = [len(planar_link_nodes(np.eye(2), np.tile(0.3 * COLUMNS[:, :2] / k, k))[1]) for k in (1, 2, 4)]
    assert counts[1] == counts[2] < 3 * counts[0]
    assert len(link_nodes(np.eye(2), np.tile(0.3 * COLUMNS[:, :2] / 2, 2))[1]) > 10 * counts[1]


def test_parallel_generators_need_a_line_of_nodes_only():
    shifts, weights = planar_link_nodes(np.eye(2), np.array([[0.5, 1.0, -0.2], [0.25, 0.5, -0.1]]))
    np.testing.assert_allclose(shifts @ np.array([1.0, -2.0]), 0.0, atol=1e-14)
    variance = weights @ np.sum(shifts**2, axis=1)
    assert variance == pytest.approx(1.25 * (0.25 + 1.0 + 0.04) / 3.0, rel=1e-12)
