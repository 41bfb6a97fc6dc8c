"""What was not used for the fit was not used, and noise alone is neither explained nor shrunk."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot import EstimationError, diagnose
from thermal_robot.diagnosis.held_out import held_out
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit

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
