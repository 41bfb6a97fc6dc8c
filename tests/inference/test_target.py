"""What further columns are worth to a remainder: an F test, a share and a gain in evidence, all of them honest."""

import numpy as np
import pytest
from scipy.stats import f as f_law
from scipy.stats import kstest

from thermal_robot.inference.screening import NOTHING, Target

ROWS, DESIGN, FURTHER = 40, 4, 3


def drawn(rng, rows=ROWS):
    """A gap of noise (m), a design that was fitted, and further columns."""
    return 1e-5 * rng.normal(size=(rows, 3)), rng.normal(size=(rows, 3, DESIGN)), rng.normal(size=(rows, 3, FURTHER))


def plain(gap, design):
    """A target whose rows all weigh alike."""
    return Target.of(gap, design, np.ones(len(gap), dtype=bool))


def squares(gap, columns):
    """Sum of squared residuals of a fit by least squares, and how many columns it has."""
    own = columns.reshape(gap.size, -1)
    left = gap.ravel() - own @ np.linalg.lstsq(own, gap.ravel(), rcond=None)[0]
    return float(left @ left)


def test_in_noise_p_values_are_uniform_the_share_is_zero_and_the_evidence_falls():
    # in noise every p value is as likely the share is zero and the evidence falls
    rng = np.random.default_rng(0)
    noise = [plain(gap, design).score(further) for gap, design, further in (drawn(rng) for _ in range(200))]
    assert kstest([w.p_value for w in noise], "uniform").pvalue > 0.01
    shares = np.array([w.share for w in noise])
    assert abs(shares.mean()) < 4.0 * shares.std() / np.sqrt(len(shares))
    assert (shares < 0.0).any()
    assert np.mean([w.gain for w in noise]) < -3.0
    assert np.mean([w.gain > 0.0 for w in noise]) < 0.02
    # With the weights of a robust fit, too, no more than its share of p-values lies below a level.
    rng = np.random.default_rng(1)
    found = []
    for _ in range(200):
        gap, design, further = drawn(rng)
        found.append(Target.of(gap, design).score(further).p_value)
    assert np.mean(np.array(found) < 0.05) < 0.05 + 4.0 * np.sqrt(0.05 * 0.95 / 200)


@pytest.mark.parametrize("rows", [6, ROWS])
def test_the_gain_is_that_of_the_bayes_information_criterion_and_the_p_value_that_of_the_f_test(rows):
    """BIC = n ln(S/n) + k ln n of each fit, n being what the design leaves; the gain is half of what it falls by."""
    rng = np.random.default_rng(2)
    for signal in (0.0, 1e-6, 1e-5, 1e-3):
        gap, design, further = drawn(rng, rows)
        gap = gap + signal * further[:, :, 0]
        own = plain(gap, design)
        before, after = squares(gap, design), squares(gap, np.concatenate([design, further], axis=2))
        n = own.freedom
        assert n == 3 * rows - DESIGN
        falls = (n * np.log(before / n)) - (n * np.log(after / n) + FURTHER * np.log(n))
        worth = own.score(further)
        assert worth.gain == pytest.approx(0.5 * falls, rel=1e-6, abs=1e-9)
        ratio = (before - after) / FURTHER / (after / (n - FURTHER))
        assert worth.p_value == pytest.approx(f_law.sf(ratio, FURTHER, n - FURTHER), rel=1e-6)
        # units do not matter, neither of further columns nor of the design
        units = 10.0 ** np.array([-6.0, 0.0, 3.0, 6.0])
        assert plain(gap, design * units).score(further).gain == pytest.approx(worth.gain, rel=1e-6, abs=1e-9)
        assert own.score(further * [1e-6, 1.0, 1e6]).p_value == pytest.approx(worth.p_value, rel=1e-6)


def test_the_share_is_that_of_what_is_left():
    rng = np.random.default_rng(3)
    shares = []
    for _ in range(60):
        gap, design, further = drawn(rng, 200)
        # as much as the noise: half of the mean square
        shares.append(plain(gap + 1e-5 * further[:, :, 0], design).score(further).share)
    assert np.mean(shares) == pytest.approx(0.5, abs=4.0 * np.std(shares) / np.sqrt(60))


def test_columns_that_explain_everything_leave_nothing():
    gap, design, further = drawn(np.random.default_rng(4))
    exact = plain(1e-3 * further @ [1.0, -2.0, 0.5] + 1e-15 * gap, design).score(further)
    assert exact.share == pytest.approx(1.0)
    assert exact.p_value < 1e-100
    assert np.isfinite(exact.gain)


def test_what_the_design_holds_already_and_too_few_equations_are_worth_nothing():
    gap, design, further = drawn(np.random.default_rng(5))
    own = plain(gap, design)
    assert own.score(design) == NOTHING
    assert own.score(design[:, :, :2] @ [[1.0], [3.0]]) == NOTHING
    # beside further columns it does not count as one
    assert own.score(np.concatenate([design, further], axis=2)).gain == pytest.approx(own.score(further).gain, rel=1e-6)
    few = plain(gap[:4], np.zeros((4, 3, 0)))
    for columns, worth in ((7, False), (8, True)):
        assert (few.score(np.random.default_rng(6).normal(size=(4, 3, columns))) == NOTHING) == worth


def test_rows_far_from_the_rest_weigh_little_unless_they_are_trusted():
    rng = np.random.default_rng(7)
    gap, design, further = drawn(rng, 200)
    spoilt = np.arange(200) % 20 == 0
    step = spoilt[:, None, None] * np.ones((200, 3, 1))
    gap = gap + 1e-2 * step[:, :, 0]
    robust = Target.of(gap, design)
    trusted = Target.of(gap, design, spoilt)
    assert trusted.score(step).gain > 100.0
    assert robust.score(step).gain < 0.5 * trusted.score(step).gain
    # what else is there is seen beside them all the same
    shifted = Target.of(gap + 1e-5 * further[:, :, 0], design)
    assert shifted.score(further[:, :, :1]).gain > 50.0
    assert np.abs(plain(gap + 1e-5 * further[:, :, 0], design).score(further[:, :, :1]).gain) < 10.0


@pytest.mark.parametrize("components", [1, 6])
def test_a_seat_tells_of_many_laws_what_the_target_tells_of_each(components):
    rng = np.random.default_rng(3)
    gap, design, _ = drawn(rng)
    target = Target.of(gap, design)
    moves = rng.normal(size=(ROWS, 3, components))
    laws = [rng.normal(size=(ROWS, k)) for k in (1, 3, 2, 3)]
    # one law twice over, one of nothing, one that the gap follows
    laws += [np.repeat(laws[0], 2, axis=1), np.zeros((ROWS, 1)), laws[1][:, :1]]
    loud = Target.of(gap + 3e-5 * moves[:, :, 0] * laws[1][:, :1], design)
    for own in (target, loud):
        expected = [own.score((law[:, None, :, None] * moves[:, :, None, :]).reshape(ROWS, 3, -1)).gain for law in laws]
        np.testing.assert_allclose(own.statistics(moves).gains(laws), expected, rtol=1e-9)
    assert loud.statistics(moves).gains(laws)[-1] > 10.0
    assert target.statistics(moves).gains(laws)[-2] == -np.inf
    # what the design can do does not count
    assert target.statistics(design[:, :, :1]).gains([np.ones((ROWS, 1))])[0] == -np.inf


def test_rows_count_by_their_own_noise():
    """What a law gains in rows of unlike noise is what it gains in the same rows over their noise."""
    rng = np.random.default_rng(5)
    relative = np.repeat(rng.uniform(0.1, 10.0, (80, 1)), 3, axis=1)
    gap, design, law = rng.normal(size=(80, 3)), rng.normal(size=(80, 3, 4)), rng.normal(size=(80, 3, 2))
    even = Target.of(gap, design).score(law)
    own = Target.of(gap * relative, design * relative[:, :, None], relative=relative).score(law * relative[:, :, None])
    assert own.gain == pytest.approx(even.gain, rel=1e-9)
    assert own.p_value == pytest.approx(even.p_value, rel=1e-9)


def test_what_a_design_nearly_contains_gains_no_more_than_the_exact_residual_allows():
    """Functions that a design contains but for a small part: their Gram matrix is a difference of large numbers."""
    rng = np.random.default_rng(5)
    seen = 0
    for k in range(300):
        gap, design, further = drawn(rng)
        moves, functions, other = further[:, :, :1], rng.normal(size=(ROWS, 2)), rng.normal(size=(ROWS, 2))
        design = np.concatenate([design, moves * functions[:, None, :]], axis=2)
        gap += 2e-5 * moves[:, :, 0] * other[:, 1:]  # what one direction explains
        other[:, 1] = other[:, 0] + 10.0 ** rng.uniform(-3.0, -2.0) * other[:, 1]
        law, target = functions + 10.0 ** rng.uniform(-6.0, -3.0) * other, plain(gap, design)
        (gain,) = target.statistics(moves).gains([law])
        exact = max(target.score(moves * law[:, None, columns]).gain for columns in ([0], [1], [0, 1]))
        assert gain <= 1.2 * max(exact, 0.0) + 1.0, k
        seen += np.isfinite(gain)
    assert 100 < seen < 300
