"""Effects, outliers and noise are found together, and each from the rows that may speak."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from inference.problems import WIDTHS, columns_of

from thermal_robot.effects import choose
from thermal_robot.effects.backlash import Backlash
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.explain import exclusive_settings, explain, log_odds, log_priors
from thermal_robot.inference.kernels import Kernel
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.weights import Noise

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


def explained(linear, noise=NOISE, rarity=(), **told):
    """The explanation where each block has the prior of an effect, some less by so many natural logarithms."""
    prior = np.full(len(linear.blocks), log_odds())
    for b, less in dict(rarity).items():
        prior[b] += less
    return explain(linear, noise, log_prior=prior.tolist(), **told)


@pytest.mark.parametrize("present", [(), (1,), (0, 2), (0, 1, 2)], ids=str)
@pytest.mark.parametrize("gross", [0, 8])
def test_what_is_at_work_is_chosen_and_gross_errors_are_set_aside(present, gross):
    for seed in range(5):
        linear, values, spoilt = problem(seed, present, gross)
        found = explained(linear)
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
    found = explained(linear)
    moved = sum(linear.contribution(b, mean) for b, (mean, _) in found.values.items())
    framed = (linear.gap - moved - found.remainder).ravel()
    design = linear.frames.reshape(len(framed), -1)
    step = np.linalg.lstsq(design, framed, rcond=None)[0]
    np.testing.assert_allclose(design @ step, framed, rtol=0, atol=1e-14)
    np.testing.assert_allclose(step, [0.5, -0.2], rtol=0, atol=2e-5)
    assert np.abs(found.smooth).max() == 0.0  # without kernels there is no discrepancy
    assert (found.discrepancy.kernel, found.discrepancy.tau, found.discrepancy.probability) == (None, 0.0, 0.0)


def test_settings_of_one_effect_are_never_together_and_share_its_prior():
    linear, _, _ = problem(3, (1,))
    near = replace(linear.blocks[1], source=linear.blocks[1].columns + 1e-3 * linear.blocks[2].columns[:, :, :2])
    linear = Linear(linear.gap, linear.frames, (*linear.blocks, near))
    found = explained(linear, families=("a", "b", "c", "b"))
    assert not any({1, 3} <= set(c.blocks) for c in found.combinations)
    assert found.probability([1, 3]) == pytest.approx(1.0, abs=1e-3)
    assert found.probabilities.sum() == pytest.approx(1.0)
    assert exclusive_settings(("a", "b", "c", "b")) == {frozenset({1, 3})}
    assert exclusive_settings(("a", "b")) == frozenset()


def test_log_priors_are_those_of_effects_and_not_of_settings():
    """However many settings of an effect are listed, the odds that it is at work are one to five, or a little less."""
    gain, lost = choose(("joint_gain", "backlash"), (), ())
    assert np.exp(log_odds()) == pytest.approx(1.0 / 5.0)
    joints = ("a", "b", "c", "d")
    everywhere, alone = lost, [replace(lost, places=(j,)) for j in joints]
    several = [replace(lost, places=own) for k in (2, 3, 4) for own in combinations(joints, k)]
    odds = np.exp(log_priors([gain, everywhere, *alone, *several]))
    assert odds[0] == pytest.approx(1.0 / 5.0)
    assert 0.9 * odds[0] < odds[1:].sum() <= odds[0]
    # in all as likely as in one; which one, nobody knows
    assert odds[1] == pytest.approx(odds[2:6].sum())
    np.testing.assert_allclose(odds[2:6], odds[2])
    assert odds[6:12].sum() == pytest.approx(0.5 * odds[1])
    # what else is listed changes nothing
    fewer = np.exp(log_priors([gain, everywhere, *alone, several[0]]))
    np.testing.assert_allclose(fewer, odds[:7])


def test_settings_of_the_same_places_share_by_their_weight_and_a_law_with_all_that_were_tried():
    hangs = Backlash(largest=(1.0, 1.0, 1.0), chain=("a", "b", "c"))
    shares = [replace(hangs, held=held) for held in (0.0, 0.2, 0.5, (0.5, 0.5, 0.0))]
    odds = np.exp(log_priors(shares))
    assert odds.sum() == pytest.approx(1.0 / 5.0)
    assert odds[1] == pytest.approx(odds[2])
    assert odds[0] > odds[1]
    assert odds[3] == pytest.approx(odds[2] / 5.0)
    # however many laws are compared
    laws = [Discovered(place=f"joint_{k}", quantity="time", tried=100.0 * k) for k in (1, 2)]
    odds = np.exp(log_priors([*choose(("joint_gain",), (), ()), *laws]))
    np.testing.assert_allclose(odds[0] / odds[1:], [100.0, 200.0])
    assert np.exp(log_priors(laws[:1]))[0] == pytest.approx(odds[1])


def test_what_was_picked_out_of_many_must_explain_more():
    linear, _, _ = problem(4, (1,))
    lost = []
    for rarity in ({}, {1: -np.log(1000.0)}):
        found = explained(linear, rarity=rarity)
        evidence = {c.blocks: c.log_evidence for c in found.combinations}
        lost.append((evidence[(1,)], evidence[(0, 1)], evidence[(1, 2)]))
    np.testing.assert_allclose(np.subtract(*lost), np.log(1000.0), atol=1e-2)
    # an effect that is faint is then no longer believed
    faint, _, _ = problem(4, (1,), size=5e-6)
    chances = [explained(faint, rarity=r).probability([1]) for r in ({}, {1: -20.0})]
    assert chances[0] > 0.9 > 0.1 > chances[1]


def alike(copies, size, seed=5):
    """One block of eight poses, each visited so often, that does nothing; each pose has an error of its own."""
    linear, _, _ = problem(seed, ())
    rng = np.random.default_rng(seed)
    pose = np.repeat(np.arange(ROWS // copies), copies)
    steady = columns_of(rng.normal(size=(len(linear.gap) // copies, 3, 2))[pose], np.full(2, 3e-5))
    shared = size * rng.normal(size=(ROWS // copies, 3))[pose]
    each = Kernel("poses", pose.astype(float), np.eye(3), grouped=True)
    return Linear(linear.gap + shared, linear.frames, (steady,)), each


def test_rows_of_one_pose_that_err_alike_count_less():
    """Ten visits a pose: what its visits share is one error and not ten that agree."""
    beliefs = []
    for seed in range(12):
        linear, each = alike(10, 4e-5, seed)
        told, plain = explained(linear, kernels=(each,)), explained(linear)
        assert told.discrepancy.kernel is each
        assert told.discrepancy.probability > 0.99
        assert 1.0 <= told.discrepancy.tau <= 4.0  # twice the noise
        beliefs.append((plain.probability([0]), told.probability([0])))
    plain, told = np.array(beliefs).T
    assert np.mean(plain) > 0.5
    assert np.mean(told) < 0.2


def test_the_discrepancy_is_what_poses_share_and_part_of_the_remainder():
    # the discrepancy is a part of the remainder and what poses share
    linear, each = alike(10, 2e-4)
    found = explained(linear, kernels=(each,))
    for pose in range(8):
        own = slice(10 * pose, 10 * pose + 10)
        assert np.ptp(found.smooth[own], axis=0).max() < 1e-12
        # three sigma of the mean of ten rows
        assert np.abs(found.smooth[own][0] - found.remainder[own].mean(axis=0)).max() < 3.0 * 2e-5 / np.sqrt(10.0)
    # a noise that is not stated is read off the remainder
    linear, _, _ = problem(7, (1,))
    found = explained(linear, Noise())
    assert found.best.blocks == (1,)
    assert (found.whitening.noise * found.best.noise)[0] == pytest.approx(2e-5, rel=0.15)
    assert found.whitening.held == 0.0


def test_where_the_search_starts_does_not_matter():
    linear, _, _ = problem(6, (0, 2), 6)
    plain = explained(linear)
    begun = explained(linear, starts=[(1,), (0, 1)])
    assert begun.best.blocks == plain.best.blocks
    np.testing.assert_array_equal(begun.outliers, plain.outliers)
    assert begun.best.log_evidence == pytest.approx(plain.best.log_evidence, abs=1e-2)
    # a start that is not allowed is left out
    two = explained(linear, families=("a", "b", "a"), starts=[(0, 2)])
    assert not {0, 2} <= set(two.best.blocks)
