"""Products that are kept make the same normal equations as all columns at once, and go with their blocks."""

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.effects import choose
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.problem import Linear, Products, Whitening, gram
from thermal_robot.inference.registration import register
from thermal_robot.observations import observe

NAMES = ("joint_offset", "joint_gain", "backlash", "drift")


@pytest.fixture(scope="module")
def seen(rv_m2):
    data = simulate(rv_m2, ["joint_offset", "drift"], samples=50, seed=4)[0]
    return observe(data, register(data))


@pytest.fixture(scope="module")
def whitening(seen):
    weights = np.random.default_rng(0).uniform(0.0, 1.0, len(seen.gap)).round(1)  # some rows are not used
    assert (weights == 0.0).any()
    return Whitening(weights, np.array([2e-5, 3e-5, 4e-5]), 5.0)


def test_every_selection_in_any_order_is_as_if_formed_anew(seen, whitening):
    blocks = [block(seen, effect) for effect in choose(NAMES)]
    whole = Linear(seen.gap, frame_columns(seen)[0], ())
    kept = Products(whole, whitening)
    for which in ([0], [0, 1], [1, 0], [3, 2, 1], [0, 1, 2, 3], [2], []):
        some = [blocks[k] for k in which]
        linear, found = kept.problem(some)
        assert linear.blocks == tuple(some)
        expected = gram(Linear(whole.gap, whole.frames, tuple(some)), whitening)
        assert (found.slices, found.equations, found.ranks) == (expected.slices, expected.equations, expected.ranks)
        assert found.total == pytest.approx(expected.total, rel=1e-10)
        # the reduction of a block is free up to turns: what is seen of the parameters is not
        for a, b, basis, other in zip(found.slices, expected.slices, found.bases, expected.bases, strict=True):
            mine, theirs = basis @ found.vector[a], other @ expected.vector[b]
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max(initial=0.0))
            mine = basis @ found.matrix[a, a] @ basis.T
            theirs = other @ expected.matrix[b, b] @ other.T
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max(initial=0.0))
