"""Campaigns as one problem: each one's frames mean nothing, other robots are refused, what frames hide is nil."""

from dataclasses import replace

import numpy as np
import pytest
from compared import lagging_days

from thermal_robot import CampaignError, load_robot, simulate
from thermal_robot.effects import choose
from thermal_robot.fleet.wear_problem import problem, require_alike
from thermal_robot.inference.fit import fit
from thermal_robot.kinematics import exp6

EFFECTS = ("joint_offset",)


def campaign(robot, seed, place=0, **effects):
    """A campaign whose instrument and target stand in one of several places; noise along its own axes alike."""
    rng = np.random.default_rng(place)
    base, tool = (exp6(rng.uniform(-0.5, 0.5, 6)), np.eye(4)) if place else (np.eye(4), np.eye(4))
    tool[:3, 3] = [0.05, 0.02, 0.1] if not place else [-0.03, 0.06, 0.04]
    known = dict(rows=40, seed=seed, noise=0.0, base=base, tool=tool, base_known=False, tool_known=False)
    made = simulate(robot, {"joint_offset": {robot.joint_names[2]: 1e-3}, **effects}, **known)
    turned = 2e-5 * np.random.default_rng([seed, 1]).normal(size=made.position.shape) @ base[:3, :3].T
    return replace(made, position=made.position + turned, noise_position=2e-5)


def fitted(*campaigns):
    return [fit(one, choose(EFFECTS, (), ())) for one in campaigns]


def test_where_instrument_and_target_stand_means_nothing(rv_m2):
    here = problem(fitted(*(campaign(rv_m2, seed) for seed in (1, 2, 3))))
    there = problem(fitted(*(campaign(rv_m2, seed, place=seed) for seed in (1, 2, 3))))
    assert here.keys == there.keys
    values = []
    for one in (here, there):
        total = one.matrices.sum(axis=0) + 1e-3 * np.eye(len(one.keys))
        values.append(one.sizes * np.linalg.solve(total, one.vectors.sum(axis=0)))
    assert abs(values[0][2] - 1e-3) < 5e-5
    # targets at other places have other lever arms: the noise enters in another way, the value does not
    np.testing.assert_allclose(values[0], values[1], atol=3e-5)
    turn = exp6(np.array([0.0, 0.0, 0.0, 1.0, 2.0, 3.0]))[:3, :3]
    others = [replace(c, position=c.position @ turn.T + 1.0) for c in (campaign(rv_m2, 2), campaign(rv_m2, 3))]
    moved = problem(fitted(campaign(rv_m2, 1), *others))
    np.testing.assert_allclose(moved.matrices, here.matrices, rtol=2e-3, atol=1e-3 * here.matrices.max())


def test_zeros_that_unknown_frames_take_up_are_nil(rv_m2):
    found = problem(fitted(*(campaign(rv_m2, seed) for seed in (1, 2, 3))))
    names = [name for _, name in found.keys]
    assert names[:5] == [f"zero offset, joint_{k}" for k in range(1, 6)]
    assert not found.matrices[:, 0].any()
    assert found.matrices[:, 2, 2].min() > 100.0


def test_every_joint_is_followed_whatever_was_named(rv_m2):
    found = problem([fit(campaign(rv_m2, seed), ()) for seed in (1, 2, 3)])
    assert [effect for effect, _ in found.keys] == ["joint_offset"] * 5


def test_an_effect_that_one_campaign_cannot_show_is_nil_there(rv_m2):
    hot = {"thermal_elongation": 2e-5}
    with_it = [campaign(rv_m2, seed, **hot) for seed in (1, 2)]
    bare = campaign(rv_m2, 3)
    bare = replace(bare, covariates={k: v for k, v in bare.covariates.items() if k != "temperature"})
    fits = [fit(one, choose(("thermal_elongation",), (), ())) for one in (*with_it, bare)]
    found = problem(fits)
    own = [k for k, (effect, _) in enumerate(found.keys) if effect == "thermal_elongation"]
    assert own
    assert found.has[:2][:, own].all()
    assert not found.has[2, own].any()
    assert not found.matrices[2][own].any()


def test_another_robot_is_refused(rv_m2):
    ur10 = load_robot("example-robot-data:ur10", "tool0")
    fits = fitted(campaign(rv_m2, 1), campaign(ur10, 2))
    with pytest.raises(CampaignError, match="is of another robot"):
        require_alike(fits)
    other = load_robot(rv_m2.urdf.replace("<robot", "<!-- calibrated --><robot", 1), rv_m2.tool_frame)
    with pytest.raises(CampaignError, match="another URDF"):
        require_alike(fitted(campaign(rv_m2, 1), campaign(other, 2)))


def test_links_that_lag_follow_the_record_of_each_campaign():
    """Each campaign by itself says what was at work, whichever one has the setting that all are followed by."""
    for days in (lagging_days(), lagging_days()[:2][::-1]):
        found = problem([fit(day, choose(("thermal_elongation",), (), ())) for day in days])
        own = [k for k, (effect, _) in enumerate(found.keys) if effect == "thermal_elongation"]
        assert found.has[:, own].all()
        for matrix, vector in zip(found.matrices, found.vectors, strict=True):
            values = np.linalg.solve(matrix + 1e-6 * np.eye(len(matrix)), vector) * found.sizes
            np.testing.assert_allclose(values[own], 2e-5, rtol=0.15)
