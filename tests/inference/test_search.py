"""The search finds the best of all combinations; what a further block would bring, to first order."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from inference.problems import columns_of, small_problem

from thermal_robot.effects import Parameter
from thermal_robot.inference import settings
from thermal_robot.inference.problem import Linear, Whitening, contained, gram
from thermal_robot.inference.search import Search, gains

NEAR = 3.0 * settings.EVIDENCE_SETTLED  # to so much the scales of a few blocks are found


def best_of_all(search, most=3, out=()):
    """Log evidence of the best of all allowed combinations without some blocks, each computed from scratch."""
    alone = Search(search.gram, search.log_prior, search.exclusive)
    every = [b for b in range(len(search.gram.slices)) if b not in out]
    chosen = (c for size in range(most + 1) for c in combinations(every, size))
    return max(alone.evaluate(c).log_evidence for c in chosen if alone.allowed(c))


def alike(seed, rows=25, count=7):
    """Blocks of one column that much resemble each other, as those of a robot do; two or three of them are present."""
    rng = np.random.default_rng(seed)
    common = rng.normal(size=(rows, 3, 3))
    columns = [0.35 * rng.normal(size=(rows, 3)) + common @ rng.normal(size=3) for _ in range(count)]
    blocks = tuple(columns_of(c[:, :, None], np.ones(1)) for c in columns)
    gap = rng.normal(size=(rows, 3))
    for b in rng.permutation(count)[: rng.integers(2, 4)]:
        gap = gap + blocks[b].columns @ rng.choice([-1.0, 1.0], 1)
    linear = Linear(gap, rng.normal(size=(rows, 3, 2)), blocks)
    return Search(gram(linear, Whitening(np.ones(rows), np.ones(3), 20.0)), (-2.2,) * count)


@pytest.mark.parametrize(
    ("seeds", "known"),
    # from one wrong start of 144 the way to the best leads through pairs 18 nats below: why there are several starts
    [(range(3), set()), pytest.param(range(3, 60), {(48, (0, 1))}, marks=pytest.mark.slow)],
    ids=["3", "57"],
)
def test_blocks_that_resemble_each_other_do_not_lead_astray(seeds, known):
    """From nothing, or from a wrong combination: two that stand in for two others are left again."""
    astray = set()
    for seed in seeds:
        best = best_of_all(alike(seed), most=4)
        for start in ((), (0, 1), (4, 5, 6)):
            search = alike(seed)
            if search.run(start).log_evidence <= best - 0.5:
                astray.add((seed, start))
            assert all(len(set(blocks)) == len(blocks) for blocks in search.seen)
    assert astray == known


def test_smaller_blocks_are_found_inside_one_that_contains_them():
    """Two single columns, each of another block, against one of six columns that holds both: it comes first."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        parts = rng.normal(size=(30, 3, 6))
        blocks = [columns_of(parts), *(columns_of(parts[:, :, [k]]) for k in range(6))]
        gap = parts @ [1.0, 0.0, 0.0, 1.5, 0.0, 0.0] + 0.1 * rng.normal(size=(30, 3))
        linear = Linear(gap, np.zeros((30, 3, 0)), tuple(blocks))
        problem = gram(linear, Whitening(np.ones(30), np.full(3, 0.1), 20.0))
        inside = contained(problem)
        assert inside == {frozenset({0, k}) for k in range(1, 7)}
        search = Search(problem, (-2.2,) * 7, inside, frozenset({0}))
        assert search.run((0,)).blocks == (1, 4)


def test_what_is_stretched_to_stand_in_for_another_does_not_hide_it():
    """Beside a block blown up to thirty times its size, what the missing one gains is hardly seen to first order."""
    rng = np.random.default_rng(3)
    one = rng.normal(size=(40, 3, 1))
    near = one + 0.02 * rng.normal(size=(40, 3, 6))
    gap = one @ [1.0] + near @ (0.3 * rng.normal(size=6)) + 0.05 * rng.normal(size=(40, 3))
    linear = Linear(gap, np.zeros((40, 3, 0)), (columns_of(near, np.full(6, 0.3)), columns_of(one)))
    search = Search(gram(linear, Whitening(np.ones(40), np.full(3, 0.05), 20.0)), (-2.2,) * 2)
    assert search.run().log_evidence == pytest.approx(best_of_all(search, 2), abs=1e-3)


def test_the_best_settings_of_the_same_effects_are_found():
    for seed in range(10):
        search, families = alike(seed), ("a", "a", "a", "b", "b", "b", "c")
        best = search.set_best((0, 3), families)
        every = [search.evaluate((i, j)).log_evidence for i in (0, 1, 2) for j in (3, 4, 5)]
        assert {families[b] for b in best.blocks} == {"a", "b"}
        # no other setting of one of the two is better
        beside = [c for c in search.seen.values() if c.exact and len(set(c.blocks) & set(best.blocks)) == 1]
        same = [c for c in beside if {families[b] for b in c.blocks} == {"a", "b"}]
        assert best.log_evidence >= max(c.log_evidence for c in same) - 1e-2
        assert best.log_evidence >= search.evaluate((0, 3)).log_evidence
        assert best.log_evidence <= max(every) + 1e-9


def test_without_some_blocks_it_is_the_search_that_never_had_them():
    for seed in range(8):
        search = alike(seed)
        whole = search.run().blocks
        out = frozenset({*whole[:1], 6})
        less, never = search.without(out), alike(seed).without(out)
        best = less.run([b for b in whole if b not in out]).log_evidence
        assert best == pytest.approx(never.run().log_evidence, abs=NEAR)
        assert best == pytest.approx(best_of_all(search, 4, out), abs=NEAR)
        assert not any(out & set(blocks) for blocks in less.seen)
        assert any(out & set(blocks) for blocks in search.seen)  # that of which they were left out keeps them


def test_every_neighbour_of_a_combination_is_weighed():
    search = alike(5)
    found = search.evaluate_neighbours((0, 1))
    seen = {c for c in search.seen if len(set(c) ^ {0, 1}) == 1}
    assert {(0,), (1,), *(tuple(sorted((0, 1, k))) for k in range(2, 7))} <= seen
    exact = Search(search.gram, search.log_prior)
    assert found.log_evidence >= max(exact.evaluate(c).log_evidence for c in ((0, 1), (0,), (1,)))


def test_what_rounding_hides_has_nothing_added_to_it():
    search = alike(2)
    hidden = replace(search.evaluate(()), blocks=(0,), log_evidence=-np.inf)
    search.seen[(0,)] = hidden
    assert search._with_one_more(hidden, search.evaluate(())) == []
    assert np.isfinite(search.run().log_evidence)


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


def constrained(seed, push):
    """Three blocks of one parameter that cannot be negative; the data push each by so many of its sizes."""
    linear, whitening = small_problem(seed, rows=40, present=(), noise=0.3)
    one = (Parameter("size", "m", 2.0, "joint", "joint", (), positive=True),)
    blocks = tuple(replace(b, bare=one, source=b.columns[:, :, :1], sizes=b.sizes[:1]) for b in linear.blocks)
    gap = linear.gap + sum(own * b.columns[:, :, 0] * 2.0 for own, b in zip(push, blocks, strict=True))
    return Linear(gap, linear.frames, blocks), whitening


@pytest.mark.parametrize("positive", [False, True], ids=["of either sign", "above zero"])
def test_a_gain_to_first_order_is_near_the_exact_one_where_a_block_explains_all(positive):
    """So large ones come first: they are within a tenth, or two nats, of what they gain."""
    for seed in range(10):
        plain = small_problem(seed, rows=40, present=(2,), noise=0.3)
        first, exact = gains_of(*(constrained(seed, (0.0, 0.0, 1.0)) if positive else plain), ())[2]
        assert exact > 20.0
        assert abs(first - exact) < max(0.1 * exact, 2.0)


@pytest.mark.parametrize("pushed", [-1.0, -0.05, 0.0])
def test_a_block_that_is_pushed_below_zero_costs_what_the_exact_one_costs(pushed):
    """It stays at zero: what it could explain with the other sign is no gain, and its prior still has to be paid."""
    for seed in range(10):
        first, exact = np.transpose(gains_of(*constrained(seed, (0.0, pushed, pushed)), ()))
        assert (first[1:] < 0.5).all()
        assert np.abs(first - exact).max() < 0.5


def test_what_is_held_at_zero_hides_nothing_from_a_further_block():
    """Beside a block held at zero a second one, much like it but free, brings what it brings alone."""
    for seed in range(10):
        linear, whitening = constrained(seed, (0.0, -1.0, 0.0))
        held = linear.blocks[1]
        like = replace(linear.blocks[2], bare=(), source=held.columns + 0.01 * linear.blocks[2].columns)
        linear = Linear(linear.gap, linear.frames, (linear.blocks[0], held, like))
        search = Search(gram(linear, whitening), (0.0,) * 3)
        alone, beside = search.evaluate(()), search.evaluate((1,))
        assert search.gram.posterior(beside)[0].tolist() == [0.0]
        brought = [dict((b, gain) for b, gain, _ in gains(search.gram, base, [2]))[2] for base in (alone, beside)]
        assert brought[0] > 20.0
        assert brought[1] == pytest.approx(brought[0], abs=2.0)
