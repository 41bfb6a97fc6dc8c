"""Effects, outliers and noise are found together, and each from the rows that may speak."""

from dataclasses import replace

import numpy as np
import pytest
from inference.problems import WIDTHS, columns_of

from thermal_robot.inference.explain import explain, log_odds, log_priors, settings_of_one
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.robust import Noise

NOISE = Noise(2e-5)
ROWS = 80


def problem(seed, present=(1,), gross=0, size=1e-3):
    """Metres: two flat frame columns, three blocks of which some are at work, some rows grossly wrong."""
    rng = np.random.default_rng(seed)
    frames = rng.normal(size=(ROWS, 3, 2))
    blocks = tuple(columns_of(rng.normal(size=(ROWS, 3, w)), np.full(w, size)) for w in WIDTHS)
    values = {b: size * rng.choice([-1.0, 1.0], WIDTHS[b]) for b in present}
    gap = 2e-5 * rng.normal(size=(ROWS, 3)) + frames @ [0.5, -0.2]
    for b, own in values.items():
        gap = gap + blocks[b].columns @ own
    spoilt = np.isin(np.arange(ROWS), rng.permutation(ROWS)[:gross])
    gap[spoilt] += 0.05 * rng.normal(size=(gross, 3))
    return Linear(gap, frames, blocks), values, spoilt


@pytest.mark.parametrize("present", [(), (1,), (0, 2), (0, 1, 2)], ids=str)
@pytest.mark.parametrize("gross", [0, 8])
def test_what_is_at_work_is_chosen_and_gross_errors_are_set_aside(present, gross):
    for seed in range(5):
        linear, values, spoilt = problem(seed, present, gross)
        found = explain(linear, NOISE)
        assert found.best.blocks == present
        np.testing.assert_array_equal(found.outliers, spoilt)
        for b, true in values.items():
            mean, covariance = found.values[b]
            assert (np.abs(mean - true) < 5.0 * np.sqrt(np.diag(covariance))).all()
        sound = found.remainder[~spoilt]
        assert np.sqrt((sound**2).mean()) == pytest.approx(2e-5, rel=0.15)
        for b in range(3):
            assert (found.probability([b]) > 0.9) == (b in present)


def test_the_remainder_is_the_gap_less_all_that_was_fitted():
    linear, _, _ = problem(1, (0, 2), 5)
    found = explain(linear, NOISE)
    moved = sum(linear.contribution(b, mean) for b, (mean, _) in found.values.items())
    fitted = found.remainder + moved + linear.frames @ found.frame_step
    np.testing.assert_allclose(fitted, linear.gap, rtol=0, atol=1e-15)


def test_rows_that_may_not_be_used_do_not_matter():
    linear, _, _ = problem(2, (1,))
    use = np.arange(ROWS) % 4 > 0
    spoilt = replace(linear, gap=linear.gap.copy())
    spoilt.gap[~use] += 1.0
    plain, other = (explain(own, NOISE, rows=use) for own in (linear, spoilt))
    np.testing.assert_array_equal(other.values[1][0], plain.values[1][0])
    assert not other.outliers.any()
    # what an explanation would say of them is said all the same
    np.testing.assert_allclose((other.remainder - plain.remainder)[~use], 1.0, atol=1e-9)
    assert other.far(~use).sum() == (~use).sum()
    assert plain.far(~use).sum() <= 1


def test_settings_of_one_effect_are_never_together_and_share_its_prior():
    linear, _, _ = problem(3, (1,))
    near = replace(linear.blocks[1], columns=linear.blocks[1].columns + 1e-3 * linear.blocks[2].columns[:, :, :2])
    linear = Linear(linear.gap, linear.frames, (*linear.blocks, near))
    found = explain(linear, NOISE, families=("a", "b", "c", "b"))
    assert not any({1, 3} <= set(c.blocks) for c in found.combinations)
    assert found.probability([1, 3]) == pytest.approx(1.0, abs=1e-3)
    assert found.probabilities.sum() == pytest.approx(1.0)
    assert settings_of_one(("a", "b", "c", "b")) == {frozenset({1, 3})}
    assert settings_of_one(("a", "b")) == frozenset()


def test_log_priors_are_those_of_effects_and_not_of_settings():
    """However many settings an effect has, the odds that it is at work are one to nine."""
    own = log_priors(("a", "b", "b", "b"), {})
    odds = np.exp(own)
    assert odds[0] == pytest.approx(1.0 / 9.0)
    assert odds[1:].sum() == pytest.approx(odds[0])
    assert np.exp(log_odds()) == pytest.approx(1.0 / 9.0)
    rare = log_priors(("a", "b"), {"b": -np.log(100.0)})
    assert np.exp(rare[0] - rare[1]) == pytest.approx(100.0)


def test_what_was_picked_out_of_many_must_explain_more():
    linear, _, _ = problem(4, (1,))
    lost = []
    for rarity in ({}, {"b": -np.log(1000.0)}):
        found = explain(linear, NOISE, families=("a", "b", "c"), rarity=rarity)
        evidence = {c.blocks: c.log_evidence for c in found.combinations}
        lost.append((evidence[(1,)], evidence[(0, 1)], evidence[(1, 2)]))
    np.testing.assert_allclose(np.subtract(*lost), np.log(1000.0), atol=1e-2)
    # an effect that is faint is then no longer believed
    faint, _, _ = problem(4, (1,), size=5e-6)
    chances = [explain(faint, NOISE, families="abc", rarity=r).probability([1]) for r in ({}, {"b": -20.0})]
    assert chances[0] > 0.9 > 0.1 > chances[1]


def test_rows_whose_remainders_are_alike_are_worth_fewer():
    """Every row ten times over, noise and all: the columns' gain in evidence is that of the rows, not of the copies."""
    linear, _, _ = problem(5, ())
    rng = np.random.default_rng(5)
    steady = columns_of(np.repeat(rng.normal(size=(8, 3, 2)), 10, axis=0), np.full(2, 1e-3))
    shared = np.repeat(2e-5 * rng.normal(size=(8, 3)), 10, axis=0)
    linear = Linear(linear.gap + shared, linear.frames, (steady,))
    groups = (np.repeat(np.arange(8), 10),)
    told, plain = explain(linear, NOISE, groups=groups), explain(linear, NOISE)
    assert plain.design_effect == 1.0
    assert 2.0 < told.design_effect <= 10.0
    assert told.probability([0]) < plain.probability([0])


def test_where_the_search_starts_does_not_matter():
    linear, _, spoilt = problem(6, (0, 2), 6)
    plain = explain(linear, NOISE)
    begun = explain(linear, NOISE, start=(1,), outliers=np.roll(spoilt, 1))
    assert begun.best.blocks == plain.best.blocks
    np.testing.assert_array_equal(begun.outliers, plain.outliers)
    assert begun.best.log_evidence == pytest.approx(plain.best.log_evidence, abs=1e-2)
    # a start that is not allowed is left out
    two = explain(linear, NOISE, families=("a", "b", "a"), start=(0, 2))
    assert not {0, 2} <= set(two.best.blocks)


def test_a_noise_that_is_not_stated_is_read_off_the_remainder():
    linear, _, _ = problem(7, (1,))
    found = explain(linear, Noise())
    assert found.best.blocks == (1,)
    assert (found.whitening.noise * found.best.noise)[0] == pytest.approx(2e-5, rel=0.15)
    assert found.whitening.held == 0.0
