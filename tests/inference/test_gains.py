"""What a further block would bring, to first order, held against the exact evidence with and without it."""

from dataclasses import replace

import numpy as np
import pytest
from inference.problems import small_problem

from thermal_robot.effects import Parameter
from thermal_robot.inference.problem import Linear, gram
from thermal_robot.inference.search import Search, gains


def gains_of(linear, whitening, beside):
    """What each further block gains beside some: to first order, and computed exactly."""
    search = Search(gram(linear, whitening), (0.0,) * len(linear.blocks))
    base = search.evaluate(beside)
    others = [b for b in range(len(linear.blocks)) if b not in beside]
    first = {b: gain for b, gain, _ in gains(search.gram, base, others)}
    return [(first[b], search.evaluate((*beside, b)).log_evidence - base.log_evidence) for b in others]


@pytest.mark.parametrize("beside", [(), (1,)], ids=["alone", "beside another"])
def test_a_gain_to_first_order_is_the_exact_one_where_a_block_explains_little(beside):
    """Blocks that do nothing: the integral over their size is within what the exact one's parabola misses."""
    errors = []
    for seed in range(20):
        linear, whitening = small_problem(seed, rows=40, present=beside)
        errors += np.subtract(*np.transpose(gains_of(linear, whitening, beside))).tolist()
    assert np.abs(errors).max() < 0.3
    assert abs(np.mean(errors)) < 0.15


def test_a_gain_to_first_order_is_near_the_exact_one_where_a_block_explains_all():
    """So large ones come first: they are within a tenth, or two nats, of what they gain."""
    for seed in range(10):
        linear, whitening = small_problem(seed, rows=40, present=(2,), noise=0.3)
        (_, _), (_, _), (first, exact) = gains_of(linear, whitening, ())
        assert exact > 20.0
        assert abs(first - exact) < max(0.1 * exact, 2.0)


def test_the_scale_of_a_gain_is_that_of_the_grid_nearest_the_best():
    for seed in range(6):
        linear, whitening = small_problem(seed, rows=40, present=(2,), noise=0.3)
        search = Search(gram(linear, whitening), (0.0,) * 3)
        ((_, _, scale),) = gains(search.gram, search.evaluate(()), [2])
        # half a unit of ln λ between places of the grid
        assert abs(np.log(scale / search.evaluate((2,)).scales[2])) < 0.5


def sided(seed, push):
    """Three blocks of one parameter that cannot be negative; the data push each by so many of its sizes."""
    linear, whitening = small_problem(seed, rows=40, present=(), noise=0.3)
    one = (Parameter("size", "m", 2.0, "joint", "joint", (), positive=True),)
    blocks = tuple(replace(b, bare=one, source=b.columns[:, :, :1], sizes=b.sizes[:1]) for b in linear.blocks)
    gap = linear.gap + sum(own * b.columns[:, :, 0] * 2.0 for own, b in zip(push, blocks, strict=True))
    return Linear(gap, linear.frames, blocks), whitening


@pytest.mark.parametrize("pushed", [-1.0, -0.05, 0.0])
def test_a_block_that_is_pushed_below_zero_costs_what_the_exact_one_costs(pushed):
    """It stays at zero: what it could explain with the other sign is no gain, and its prior still has to be paid."""
    for seed in range(10):
        first, exact = np.transpose(gains_of(*sided(seed, (0.0, pushed, pushed)), ()))
        assert (first[1:] < 0.5).all()
        assert np.abs(first - exact).max() < 0.5


def test_a_block_above_zero_gains_what_the_exact_one_gains():
    for seed in range(10):
        first, exact = np.transpose(gains_of(*sided(seed, (0.0, 1.0, 0.0)), ()))[:, 1]
        assert exact > 20.0
        assert abs(first - exact) < max(0.1 * exact, 2.0)


def test_what_is_held_at_zero_hides_nothing_from_a_further_block():
    """Beside a block held at zero a second one, much like it but free, brings what it brings alone."""
    for seed in range(10):
        linear, whitening = sided(seed, (0.0, -1.0, 0.0))
        held = linear.blocks[1]
        like = replace(linear.blocks[2], bare=(), source=held.columns + 0.01 * linear.blocks[2].columns)
        linear = Linear(linear.gap, linear.frames, (linear.blocks[0], held, like))
        search = Search(gram(linear, whitening), (0.0,) * 3)
        alone, beside = search.evaluate(()), search.evaluate((1,))
        assert beside.values.tolist() == [0.0]
        brought = [dict((b, gain) for b, gain, _ in gains(search.gram, base, [2]))[2] for base in (alone, beside)]
        assert brought[0] > 20.0
        assert brought[1] == pytest.approx(brought[0], abs=2.0)
