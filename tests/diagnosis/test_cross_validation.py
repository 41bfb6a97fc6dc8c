"""A fold predicts its rows from the others alone; shares, intervals and schemes of what it leaves."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import WIDTHS, drawn, explained, forced, on_fresh
from helpers import NOISE
from simulate import simulate

from thermal_robot import EstimationError, diagnose
from thermal_robot import simulate as simulated
from thermal_robot.diagnosis.cross_validation import (
    CrossValidation,
    Model,
    hardest,
    harmed,
    held_out,
    jackknife,
    share,
    shrinkage,
    worst_folds,
)
from thermal_robot.diagnosis.prune import forward_selection
from thermal_robot.diagnosis.values import FoldScheme, HeldOut
from thermal_robot.effects import choose
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import fit
from thermal_robot.inference.grouping import each
from thermal_robot.inference.kernels import Kernel, KernelCovariance, SmoothKernel
from thermal_robot.inference.problem import Linear
from thermal_robot.kinematics import exp6

ROWS = 60


def model(seed=1, rows=ROWS, scale=1e4):
    """A model of three blocks without priors worth the name, in twenty blocks of rows."""
    linear, _, _ = drawn(np.random.default_rng(seed), rows)
    found = Model.of(explained(linear), np.arange(rows) * 20 // rows)
    linear = replace(linear, blocks=linear.blocks[2:5])
    return replace(found, linear=linear, scales=(scale,) * 3, kept=np.ones(rows, dtype=bool), near=np.inf)


def fitted(linear, blocks, weights, rows):
    """What a least-squares fit to some rows leaves of all, by the textbook."""
    columns = np.concatenate([linear.frames, *(linear.blocks[b].columns for b in blocks)], axis=2)
    root = np.sqrt(weights[rows])[:, None]
    design = (columns[rows] * root[:, :, None]).reshape(-1, columns.shape[2])
    solution = np.linalg.lstsq(design, (linear.gap[rows] * root).ravel())[0]
    return linear.gap - columns @ solution


def test_rows_held_out_are_predicted_by_a_fit_to_the_others():
    known = model()
    validation = CrossValidation.over(known, each(known.block))
    for chosen in ((), (1,), (0, 1, 2)):
        left = validation.residuals(chosen)
        for test in each(known.block):
            right = fitted(known.linear, chosen, known.whitening.weights, ~test)[test]
            np.testing.assert_allclose(left[test[validation.numbers]], right, atol=1e-6)
        assert validation.squares(chosen)[0] == pytest.approx((left**2).sum(), rel=1e-9)


def test_frames_that_the_other_rows_hardly_tell_stay_near():
    known = model()
    frames, rng = known.linear.frames.copy(), np.random.default_rng(3)
    frames[:, :, 1] = frames[:, :, 0] + 1e-4 * rng.normal(size=frames.shape[:2])  # a place of the tool, and of a table
    gap, blocks = 1e-3 * rng.normal(size=known.linear.gap.shape), known.linear.blocks
    own = replace(known, linear=Linear(gap, frames, blocks), variance=1e-6)
    rows = [~each(known.block)[0]]
    free, held = (np.abs(replace(own, near=near).fits(rows, ())[0, :9]) for near in (np.inf, 5e-3))
    assert free[:2].max() > 0.1
    assert held[:2].max() < 5e-3
    np.testing.assert_allclose(held[2:], free[2:], atol=1e-4)


@pytest.mark.parametrize("tests", ["blocks", "regions"])
def test_the_walk_without_a_block_is_that_of_a_campaign_without_it(tests):
    known = model(rows=120)
    folds = each(known.block) if tests == "blocks" else each(np.random.default_rng(0).integers(0, 4, 120))
    chosen = (0, 1, 2)
    found = CrossValidation.over(known, folds).squares(chosen)
    literal = []
    for b in range(20):
        rows = known.block != b
        some = Linear(
            known.linear.gap[rows],
            known.linear.frames[rows],
            tuple(replace(c, source=c.columns[rows]) for c in known.linear.blocks),
        )
        whitening = replace(known.whitening, weights=known.whitening.weights[rows])
        less = replace(known, linear=some, whitening=whitening, kept=known.kept[rows], block=np.arange(rows.sum()))
        own = [fold[rows] for fold in folds if fold[rows].any()]
        literal.append(sum((CrossValidation.over(less, [f]).residuals(chosen) ** 2).sum() for f in own))
    # to first order: a twentieth of the rows is left out twice
    np.testing.assert_allclose(found[1:], literal, rtol=0.02)
    assert np.sqrt(jackknife(found[1:])) == pytest.approx(np.sqrt(jackknife(np.array(literal))), rel=0.15)


def test_rows_that_are_alike_count_by_their_own_covariance():
    """Generalised least squares on some rows: their covariance is that part of the whole one."""
    known = model()
    rng = np.random.default_rng(2)
    kernel = Kernel("some", rng.normal(size=(ROWS, 4)), rng.normal(size=(3, 2)))
    weights, noise = np.where(np.arange(ROWS) == 5, 0.0, 1.0), np.full(3, 2.0)
    smooth = KernelCovariance(SmoothKernel.of(kernel, weights, noise), 3.0)
    alike = replace(known, whitening=replace(known.whitening, weights=weights, noise=noise, smooth=smooth))
    # K of mean one on the diagonal, in units of the noise
    likeness = np.kron(kernel.functions @ kernel.functions.T, kernel.moves @ kernel.moves.T)
    covariance = np.eye(3 * ROWS) + 3.0**2 * likeness / np.diag(likeness).mean()
    for rows in (known.block != 3, known.block < 10, np.ones(ROWS, dtype=bool)):
        own = np.repeat(rows & (weights > 0), 3)
        columns = known.linear.stack.reshape(3 * ROWS, -1)[own] / 2.0
        right = columns.T @ np.linalg.inv(covariance[np.ix_(own, own)]) @ columns
        np.testing.assert_allclose(alike.products(rows)[0], right, rtol=1e-6, atol=1e-6 * np.abs(right).max())


def test_a_fold_that_leaves_the_frames_open_is_left_out():
    known = model()
    alone = known.linear.frames.copy()
    alone[known.block != 4, :, 0] = alone[known.block != 4, :, 1]
    short = replace(known, linear=replace(known.linear, frames=alone))
    validation = CrossValidation.over(short, each(short.block))
    assert len(validation.tests) == 19
    assert not (validation.numbers == np.flatnonzero(short.block == 4)[0]).any()
    assert list(validation.counts) == [ROWS - 3, *(ROWS - 3 if b == 4 else ROWS - 6 for b in range(20))]


def test_what_a_model_leaves_out_counts_as_noise_against_priors():
    """A column of one millionth is not stretched to stand in for what nothing in the model explains."""
    known = model(scale=1.0)
    far = replace(known.linear, gap=known.linear.gap + 1e4 * np.random.default_rng(3).normal(size=(ROWS, 3)))
    fit = replace(known, linear=far).fits([np.ones(ROWS, dtype=bool)], (0,))[0]
    free = model(scale=1e9)
    loose = replace(free, linear=far).fits([np.ones(ROWS, dtype=bool)], (0,))[0]
    width = WIDTHS[2]
    assert np.abs(fit[-1 - width : -1]).max() < 0.01 * np.abs(loose[-1 - width : -1]).max()


def squares(total, spread, seed=0):
    without = total * (0.95 + spread * np.random.default_rng(seed).normal(size=20))
    return np.append(total, without)


def test_a_share_lies_within_its_interval_and_nothing_is_known_exactly():
    whole = squares(50.0, 0.004)
    for part in (0.999 * whole, 0.3 * whole, -0.2 * whole, squares(10.0, 0.01, 1), 1.7 * whole, squares(60.0, 0.1, 2)):
        value, (low, high) = share(part, whole)
        assert low <= value <= high
        assert value == pytest.approx(part[0] / whole[0])
    assert share(0.0 * whole, whole) == (0.0, (0.0, 0.0))
    assert share(whole, 0.0 * whole) == (0.0, (0.0, 0.0))
    assert share(np.array([1.0, 1.0]), np.array([2.0, 1.0]))[1] == (-np.inf, 1.0)  # one block tells no interval
    wide = [np.ptp(share(squares(25.0, spread, 1), squares(50.0, 0.0))[1]) for spread in (0.002, 0.02)]
    assert wide[1] > 5.0 * wide[0]


def test_an_interval_is_wider_where_one_block_makes_up_the_spread():
    """The jackknife's variance is then told by one value: less is known of it than of one that twenty tell."""
    even = np.tile([-1.0, 1.0], 10)
    single = np.where(np.arange(20) == 0, 1.0, 0.0)
    wide = []
    for moved in (even, single):
        moved = moved - moved.mean()
        moved *= 0.01 / np.sqrt((moved**2).sum())
        value, (low, high) = share(0.5 + np.append(0.0, moved), np.ones(21))
        assert low < value < high
        wide.append(high - low)
    assert wide[1] > 1.5 * wide[0]


@pytest.mark.slow
@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_held_out_rows_are_fitted_as_badly_as_fresh_ones(arm):
    """Twenty parameters from sixty rows: the fit is 15 % closer to its own rows than to any others, held out or new."""
    to_fresh, to_own = [], []
    for seed in range(3):
        campaign, _, (fresh, place) = simulate(arm, ["geometric"], seed=seed, samples=60, fresh=200)
        found = diagnose(campaign, only=["geometric"])
        miss2 = ((found.model.prediction(fresh)[0] - place) ** 2).sum(axis=1).mean() + 3.0 * 25e-6**2
        to_fresh.append(found.gap.held_out.rms_after / np.sqrt(miss2))
        to_own.append(found.gap.held_out.rms_after / found.gap.rms_after)
    assert 0.9 < np.mean(to_fresh) < 1.15
    assert np.mean(to_own) > 1.07


def noise_alone(robot):
    """Campaigns of a perfect robot, however they come."""
    yield simulate(robot, seed=0)
    yield simulate(robot, seed=1, turning=3e-5)
    yield simulate(robot, seed=2, outliers=0.1)
    yield simulate(robot, seed=3, samples=30)
    yield simulate(robot, seed=4, heavy=True)
    campaign, truth, _ = simulate(robot, seed=5)
    yield replace(campaign, noise_position=None), truth, None


@pytest.mark.slow
@pytest.mark.parametrize("arm", ["rv_m2", "panda"], indirect=True)
def test_noise_is_not_explained_and_does_not_shrink(arm):
    named, flagged, shrinkage, gains = [], [], [], []
    for campaign, truth, _ in noise_alone(arm):
        found = diagnose(campaign)
        named.append(found.verdict)
        flagged.append(found.unexplained.flagged)
        shrinkage.append(found.gap.held_out.shrinkage)
        # in thirty rows an effect may shrink by chance what was held out
        gains += [f.shrinkage for f in found.effects if f.status == "not_found" and campaign.samples > 30]
        kept = campaign.samples - len(found.outliers)
        assert set(found.outliers) >= {row for row in truth["outliers"] if far(campaign, found, row)}
        assert found.gap.rms_before / found.gap.noise_floor == pytest.approx(1.0, abs=4.0 / np.sqrt(3 * kept) + 0.2)
        if len(truth["outliers"]) > 0.03 * campaign.samples and found.unexplained.flagged:
            # more rows than an instrument spoils are no noise, and nothing else is said
            assert all("rows were set aside" in reason for reason in found.unexplained.reasons)
        else:
            assert "noise" in found.summary
    assert sum(bool(n) for n in named) + sum(flagged) <= 1, named
    assert not any(name.startswith("discovered.") for verdict in named for name in verdict)
    assert np.median(shrinkage) < 0.005
    assert max(shrinkage) < 0.05
    # nor would anything else have shrunk rows held out
    assert len(gains) >= 48
    assert np.mean(gains) < 0.005
    assert max(gains) < 0.05


def far(campaign, found, row):
    """Whether a row lies ten noises from where the target is."""
    index = int(np.flatnonzero(campaign.rows == row)[0])
    return np.linalg.norm(campaign.position[index] - found.model.prediction(campaign)[0][index]) > 10.0 * 25e-6


@pytest.mark.slow
def test_shares_do_not_depend_on_the_order_of_effects(rv_m2):
    """Shapley values ask every order, so that none of them matters: neither that of the candidates nor of the rows."""
    campaign = simulate(rv_m2, ["thermal_elongation", "backlash", "joint_offset"], samples=60, seed=3, outliers=0.03)[0]
    names = ("thermal_elongation", "backlash", "joint_offset", "drift", "joint_gain")
    listed = {effect.name: effect for effect in choose(names, (), ())}
    first = held_out(fit(campaign, [listed[name] for name in names]))
    other = held_out(fit(campaign, [listed[name] for name in reversed(names)]))
    assert set(first.shares) == set(other.shares) == set(names)
    for name, (value, interval) in first.shares.items():
        assert other.shares[name][0] == pytest.approx(value, abs=1e-9)
        assert other.shares[name][1] == pytest.approx(interval, abs=1e-9)
    assert other.overall.shrinkage == pytest.approx(first.overall.shrinkage, abs=1e-9)


def test_shares_of_the_explanation_add_up_to_what_all_of_it_gains(rv_m2):
    """The axiom of efficiency: the whole and the parts come from the same fits."""
    known = fit(simulate(rv_m2, ["thermal_elongation", "backlash"], seed=1)[0], choose((), (), ()))
    found = held_out(known)
    inside = [effect.name for effect, _ in known.effects]
    assert len(inside) == 2
    assert sum(found.shares[name][0] for name in inside) == pytest.approx(found.overall.shrinkage, abs=1e-12)
    assert all(value < 0.01 for name, (value, _) in found.shares.items() if name not in inside)
    for value, (low, high) in found.shares.values():
        assert low <= value <= high


def test_the_gap_of_rows_held_out_is_that_of_the_registered_robot(rv_m2):
    """Of poses, too: an effect that moves more than it turns does not make the gap larger by how it is weighed."""
    for seed in range(2):
        campaign = simulate(rv_m2, ["geometric"], seed=seed, turning=1e-6, ratio=(10.0, 20.0))[0]
        known = fit(campaign, choose(("geometric",), (), ()))
        kept = ~known.explanation.outliers
        registered = np.sqrt((known.before.gap[kept, :3] ** 2).sum(axis=1).mean())
        # nine to twelve unknowns of the frames in 360 equations
        assert held_out(known).overall.rms_before == pytest.approx(registered, rel=0.12)


def test_without_effects_nothing_shrinks(rv_m2):
    known = fit(simulate(rv_m2, seed=2)[0], ())
    found = held_out(known)
    assert found.shares == {}
    # the model that is saved is the nominal one
    assert found.overall.shrinkage == 0.0
    assert found.overall.shrinkage_ci95 == (0.0, 0.0)
    np.testing.assert_array_equal(found.after, found.before)
    for scheme in worst_folds(known):
        assert scheme.shrinkage == pytest.approx(0.0, abs=1e-9)


def test_rows_of_one_pose_cannot_be_held_out(rv_m2):
    campaign = simulate(rv_m2, samples=40, seed=2)[0]
    known = fit(campaign, ())
    alike = replace(known, campaign=replace(campaign, labels={"pose": np.full(40, "home")}))
    with pytest.raises(EstimationError, match="nothing can be held out"):
        held_out(alike)


def coverage(rows, campaigns):
    """How often the intervals of the shrinkage, and of shares, hold what fresh rows say; and wrong choices' part."""
    total, shares, wrong = [], [], []
    for seed in range(campaigns):
        linear, fresh, present = drawn(np.random.default_rng([rows, seed]), rows)
        e = explained(linear, stated=seed % 3 > 0)
        if not e.best.blocks:
            continue
        block = np.arange(rows) * 20 // rows
        own = replace(linear, blocks=tuple(linear.blocks[b] for b in e.best.blocks))
        found = shrinkage(e, own, [str(k) for k in range(len(WIDTHS))], block)
        real, parts = on_fresh(e, block, fresh)
        low, high = found.overall.shrinkage_ci95
        total.append(low <= real <= high)
        said = [found.shares[str(b)][1] for b in e.best.blocks]
        shares.append(np.mean([low <= part <= high for part, (low, high) in zip(parts, said, strict=True)]))
        wrong.append(set(e.best.blocks) != present)
    return np.array(total), np.array(shares), np.array(wrong)


@pytest.mark.slow
def test_intervals_hold_what_fresh_rows_say():
    """Effects of half to sixty noises, chosen rightly or not: 95 % of the intervals hold, whatever the rows."""
    parts = [coverage(rows, 260) for rows in (30, 45, 100, 300)]
    for held in zip(*parts, strict=True):
        assert len(np.concatenate(held)) >= 1000
    total, shares, wrong = (np.concatenate(held) for held in zip(*parts, strict=True))
    for held in (total, shares):
        assert 0.93 - 2.0 * chance(len(held)) < held.mean() < 0.97 + 2.0 * chance(len(held))
    for few in (*(part[0] for part in parts), *(part[1] for part in parts), total[wrong], shares[wrong]):
        assert 0.93 - 2.5 * chance(len(few)) < few.mean() < 0.97 + 2.5 * chance(len(few))


def chance(count):
    """Standard deviation of a share of 95 % among so many."""
    return np.sqrt(0.95 * 0.05 / count)


def test_rows_set_aside_are_told_with_the_figure(rv_m2):
    """Spoilt rows are no part of the claim, and the figure that has them in it says how bad they are."""
    campaign, truth, _ = simulate(rv_m2, ["backlash"], seed=4, outliers=0.06)
    known = fit(campaign, choose(("backlash",), (), ()))
    found, aside = held_out(known), known.explanation.outliers
    assert aside.sum() >= len(truth["outliers"]) >= 3
    assert np.isnan(found.after[aside]).all()
    assert not np.isnan(found.after[~aside]).any()
    assert found.overall.rms_after == pytest.approx(np.sqrt(np.mean(found.after[~aside] ** 2)))
    spoilt = np.sqrt(np.mean((campaign.position - known.corrected.predicted_position)[aside] ** 2) * 3.0)
    share = aside.mean()
    expected = np.hypot(np.sqrt(1.0 - share) * found.overall.rms_after, np.sqrt(share) * spoilt)
    assert found.overall.rms_after_with_aside == pytest.approx(expected, rel=0.05)
    assert found.overall.rms_before_with_aside > found.overall.rms_after_with_aside > 2.0 * found.overall.rms_after


SEEDS = range(8)


def in_sessions(campaign, count=4):
    """The same campaign, said to have been measured in several sessions one after the other."""
    labels = np.array([f"day {k * count // campaign.samples + 1}" for k in range(campaign.samples)])
    return replace(campaign, labels={"session": labels})


@pytest.fixture(scope="module")
def warm(rv_m2):
    """Campaigns of links that grow; each with its schemes under the right effect and under drift alone."""
    found = []
    for seed in SEEDS:
        campaign, _, _ = simulate(rv_m2, ["thermal_elongation"], seed=seed, ratio=(4.0, 6.0))
        campaign = in_sessions(campaign)
        right, nothing = (fit(campaign, choose(only, (), ()) if only else ()) for only in (("thermal_elongation",), ()))
        (drift,) = choose(("drift",), (), ())
        wrong = forced(nothing, block(nothing.corrected, drift))
        found.append([{s.name: s for s in worst_folds(f)} for f in (right, wrong)])
    return found


@pytest.mark.slow
def test_a_correction_that_interpolates_leaves_more_where_it_must_extrapolate_and_the_right_one_does_not(warm):
    # a correction that interpolates leaves more where it must extrapolate
    for name, factor in (("session", 1.2), ("temperature", 1.15)):
        ratio = [wrong[name].rms_after / wrong["time"].rms_after for _, wrong in warm]
        assert np.mean(ratio) > factor, name
        assert np.mean(np.array(ratio) > 1.0) > 0.75, name
    # the right explanation leaves the same whatever is held out
    apart = []
    for right, _ in warm:
        blocked = right["time"]
        for name, scheme in right.items():
            if name != "time":
                apart.append((scheme.rms_after - blocked.rms_after) / np.hypot(scheme.uncertainty, blocked.uncertainty))
    assert np.median(np.abs(apart)) < 1.0
    assert np.max(np.abs(apart)) < 4.0
    for right, _ in warm:
        assert all(0.8 < s.rms_after / (np.sqrt(3.0) * NOISE) < 1.5 for s in right.values())
    # schemes come in order and say what they are
    for pair in warm:
        for schemes in pair:
            after = [s.rms_after for s in schemes.values()]
            assert after == sorted(after, reverse=True)
            assert set(schemes) == {"time", "session", "temperature", "region", "reach", "range"}
            for s in schemes.values():
                assert s.shrinkage == pytest.approx(1.0 - (s.rms_after / s.rms_before) ** 2)
            assert (schemes["session"].folds, schemes["time"].folds, schemes["temperature"].folds) == (4, 20, 2)
            assert schemes["reach"].rows == pytest.approx(0.2 * schemes["time"].rows, abs=1)


def test_the_hardest_and_what_harms_other_sessions_and_regions_are_told():
    # the hardest is told where it leaves clearly more than the average
    average = HeldOut("blocked", 5, 4e-4, 1e-4, 0.94, (0.9, 0.96))
    found = [FoldScheme(name, name, 2, 40, 4e-4, left, 0.9, 1e-6) for name, left in (("reach", 1.5e-4), ("time", 1e-4))]
    assert hardest(found, average).name == "reach"
    assert hardest(found, replace(average, rms_after=1.3e-4)) is None
    assert hardest((), average) is None
    # harm to other sessions and regions is told and no other
    found = [FoldScheme(name, name, 2, 40, 1e-4, 2e-4, -3.0, 1e-6) for name in ("reach", "temperature", "region")]
    assert harmed(found).name == "region"
    assert harmed(found[:2]) is None
    assert harmed([replace(found[2], shrinkage=0.1)]) is None


@pytest.mark.slow
def test_a_target_mounted_anew_for_a_session_does_not_count_against_what_carries_over(rv_m2):
    """Lost motion in all sessions; in one of them the target sits elsewhere: held out, it is taken as it was found."""
    tools = (exp6(np.array([0.03, 0.02, 0.09, 0.0, 0.0, 0.0])), exp6(np.array([0.0306, 0.0205, 0.0896, 0.0, 0.0, 0.0])))
    campaign, other = (
        in_sessions(simulated(rv_m2, {"backlash": 3e-4}, rows=100, noise=NOISE, base=np.eye(4), tool=tool, seed=3))
        for tool in tools
    )
    there = campaign.labels["session"] == "day 2"
    moved = np.where(there[:, None], other.position, campaign.position)
    alone = {s.name: s for s in worst_folds(fit(campaign, choose(("backlash",), (), ())))}
    known = forward_selection(fit(replace(campaign, position=moved), choose(("backlash",), (), ())), 1, lambda _: None)
    (event,) = [law for law, _ in known.effects if law.name == "discovered.1"]
    assert (event.kind, event.quantity, event.labels[int(event.marks[0])]) == ("tool", "session", "day 2")
    for name, scheme in {s.name: s for s in worst_folds(known)}.items():
        assert scheme.rms_after == pytest.approx(alone[name].rms_after, rel=0.1), name


def test_folds_by_time_are_those_of_the_diagnosis(rv_m2):
    found = fit(simulate(rv_m2, ["backlash"], seed=3)[0], choose((), (), ()))
    blocked = next(s for s in worst_folds(found) if s.name == "time")
    overall = held_out(found).overall
    assert blocked.rms_before == pytest.approx(overall.rms_before, rel=1e-9)
    assert blocked.rms_after == pytest.approx(overall.rms_after, rel=1e-9)


def test_a_column_that_is_not_there_makes_no_scheme(rv_m2):
    campaign, _, _ = simulate(rv_m2, ["joint_offset"], seed=1)
    bare = replace(campaign, covariates={})
    schemes = worst_folds(fit(bare, choose(("joint_offset",), (), ())))
    assert {s.name for s in schemes} == {"time", "region", "reach", "range"}
