"""What was not used for the fit was not used, and noise alone is neither explained nor shrunk."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import WIDTHS, drawn, explained, on_fresh
from simulate import simulate

from thermal_robot import EstimationError, diagnose
from thermal_robot.diagnosis.cross_validation import Model, Walk, held_out, shrinkage
from thermal_robot.effects import choose
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import fit
from thermal_robot.inference.rows import blocks, each

on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


@on_arms
def test_held_out_rows_are_fitted_as_badly_as_fresh_ones(arm):
    """Twenty parameters from sixty rows: the fit is 15 % closer to its own rows than to any others, held out or new."""
    to_fresh, to_own = [], []
    for seed in range(3):
        campaign, _, (fresh, place) = simulate(arm, ["geometric"], seed=seed, samples=60, fresh=200)
        found = diagnose(campaign, only=["geometric"])
        miss2 = ((found.model.predict(fresh)[0] - place) ** 2).sum(axis=1).mean() + 3.0 * 25e-6**2
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


@pytest.mark.parametrize("arm", ["rv_m2", "panda"], indirect=True)
def test_noise_is_not_explained_and_does_not_shrink(arm):
    named, flagged, shrinkage = [], [], []
    for campaign, truth, _ in noise_alone(arm):
        found = diagnose(campaign)
        named.append(found.verdict)
        flagged.append(found.unexplained.flagged)
        shrinkage.append(found.gap.held_out.shrinkage)
        kept = campaign.samples - len(found.outliers)
        assert set(found.outliers) >= {row for row in truth["outliers"] if far(campaign, found, row)}
        assert found.gap.rms_before / found.gap.noise_floor == pytest.approx(1.0, abs=4.0 / np.sqrt(3 * kept) + 0.2)
        if len(truth["outliers"]) > 0.03 * campaign.samples and found.unexplained.flagged:
            # more rows than an instrument spoils are no noise, and nothing else is said
            assert all("rows were set aside" in reason for reason in found.unexplained.reasons)
        else:
            assert "noise" in found.summary
    assert sum(bool(n) for n in named) + sum(flagged) <= 1, named
    assert np.median(shrinkage) < 0.005
    assert max(shrinkage) < 0.05


def far(campaign, found, row):
    """Whether a row lies ten noises from where the target is."""
    index = int(np.flatnonzero(campaign.rows == row)[0])
    return np.linalg.norm(campaign.position[index] - found.model.predict(campaign)[0][index]) > 10.0 * 25e-6


def test_effects_that_are_not_at_work_would_not_shrink_held_out_rows(rv_m2):
    gains = []
    for seed in range(3):
        found = diagnose(simulate(rv_m2, seed=seed)[0])
        gains += [f.shrinkage for f in found.effects if f.status == "not_found"]
    assert len(gains) >= 24
    assert np.mean(gains) < 0.005
    assert max(gains) < 0.05


def test_shares_do_not_depend_on_the_order_of_effects(rv_m2):
    """Shapley values ask every order, so that none of them matters: neither that of the candidates nor of the rows."""
    campaign = simulate(rv_m2, ["thermal_elongation", "backlash", "joint_offset"], seed=3, outliers=0.03)[0]
    names = ("thermal_elongation", "backlash", "joint_offset", "drift", "joint_gain")
    listed = {effect.name: effect for effect in choose(names, (), ())}
    first = held_out(fit(campaign, [listed[name] for name in names]))
    other = held_out(fit(campaign, [listed[name] for name in reversed(names)]))
    assert set(first.shares) == set(other.shares) == set(names)
    for name, (share, interval) in first.shares.items():
        assert other.shares[name][0] == pytest.approx(share, abs=1e-9)
        assert other.shares[name][1] == pytest.approx(interval, abs=1e-9)
    assert other.overall.shrinkage == pytest.approx(first.overall.shrinkage, abs=1e-9)


def test_shares_of_the_explanation_add_up_to_what_all_of_it_gains(rv_m2):
    """The axiom of efficiency: the whole and the parts come from the same fits."""
    known = fit(simulate(rv_m2, ["thermal_elongation", "backlash"], seed=1)[0], choose((), (), ()))
    found = held_out(known)
    inside = [effect.name for effect, _ in known.effects]
    assert len(inside) == 2
    assert sum(found.shares[name][0] for name in inside) == pytest.approx(found.overall.shrinkage, abs=1e-12)
    assert all(share < 0.01 for name, (share, _) in found.shares.items() if name not in inside)
    for share, (low, high) in found.shares.values():
        assert low <= share <= high


def test_the_gap_of_rows_held_out_is_that_of_the_registered_robot(rv_m2):
    """Of poses, too: an effect that moves more than it turns does not make the gap larger by how it is weighed."""
    for seed in range(3):
        campaign = simulate(rv_m2, ["geometric"], seed=seed, turning=1e-6, ratio=(10.0, 20.0))[0]
        known = fit(campaign, choose(("geometric",), (), ()))
        kept = ~known.explanation.outliers
        registered = np.sqrt((known.before.gap[kept, :3] ** 2).sum(axis=1).mean())
        # nine to twelve unknowns of the frames in 360 equations
        assert held_out(known).overall.rms_before == pytest.approx(registered, rel=0.12)


def test_parts_are_fitted_at_the_nominal_robot(rv_m2):
    """What the frames alone leave does not depend on what the corrected robot looks like."""
    known = fit(simulate(rv_m2, ["geometric", "backlash"], seed=1, ratio=(20.0, 30.0))[0], choose((), (), ()))
    model = Model.of(known.explanation, blocks(known.campaign))
    nominal = replace(known.before, blocks=tuple(block(known.nominal, effect) for effect, _ in known.effects))
    values = [known.explanation.values[b][0] for b in known.explanation.best.blocks]
    part = Walk.over(model.partial(nominal, values), each(model.block)).squares(())
    bare = Walk.over(model.partial(known.before), each(model.block)).squares(())
    assert len(values) == 2
    np.testing.assert_allclose(part, bare, rtol=1e-9)


def test_without_effects_nothing_shrinks(rv_m2):
    found = held_out(fit(simulate(rv_m2, seed=2)[0], ()))
    assert found.shares == {}
    # the model that is saved is the nominal one
    assert found.overall.shrinkage == 0.0
    assert found.overall.shrinkage_ci95 == (0.0, 0.0)
    np.testing.assert_array_equal(found.after, found.before)


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
