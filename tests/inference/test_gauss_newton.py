"""The exact fit is where the penalised misfit is least, and another step moves nothing."""

from dataclasses import replace

import numpy as np
import pytest
from inference.problems import FirstJoint
from simulate import simulate

from thermal_robot.effects import choose
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.exact import corrected_observations, gauss_newton
from thermal_robot.inference.explain import explain
from thermal_robot.inference.problem import Linear, gram, parameter_values
from thermal_robot.inference.registration import moved, register
from thermal_robot.inference.search import Search
from thermal_robot.inference.weights import Noise
from thermal_robot.observations import observe

SETTLED = 1e-4  # standard deviations
NOISE = 25e-6  # m


def explained(campaign, effects):
    """Frames fitted to the nominal robot, and the explanation by all of some effects, linearised there."""
    seen = observe(campaign, register(campaign))
    linear = Linear(seen.gap, frame_columns(seen)[0], tuple(block(seen, e) for e in effects))
    explanation = explain(replace(linear, blocks=()), Noise(campaign.noise_position))
    problem = gram(linear, explanation.whitening)
    best = Search(problem, [0.0] * len(effects)).evaluate(range(len(effects)))
    values = parameter_values(linear, problem, best)
    return seen, replace(explanation, linear=linear, problem=problem, best=best, values=values)


def objective(campaign, explanation, frames, pairs):
    """Half of the squared remainder, weighted, in noise, and of the values in their prior sizes."""
    whitening, best = explanation.whitening, explanation.best
    gap = corrected_observations(campaign, frames, pairs).gap / (whitening.noise * best.noise)
    sizes = [explanation.linear.blocks[b].sizes * best.scales[b] for b in best.blocks]
    penalty = sum(((v / s) ** 2).sum() for (_, v), s in zip(pairs, sizes, strict=True))
    return 0.5 * float((whitening.weights[:, None] * gap**2).sum() + penalty)


@pytest.fixture(scope="module")
def fitted(rv_m2):
    """Offsets and gains of ten millimetres at the target: far from linear beside 25 µm."""
    campaign = simulate(rv_m2, ["joint_offset", "joint_gain"], seed=2, ratio=(300.0, 400.0))[0]
    effects = choose(("joint_offset", "joint_gain"), (), ())
    seen, explanation = explained(campaign, effects)
    held = [(effects[b], explanation.values[b][0]) for b in explanation.best.blocks]
    return campaign, explanation, held, seen, gauss_newton(campaign, seen.frames, explanation, held, SETTLED)


def assert_least(campaign, explanation, observations, held, step):
    """No step of a value or a frame lowers the objective: the middle of its parabola is here."""
    least = objective(campaign, explanation, observations.frames, held)
    for k, (effect, values) in enumerate(held):
        for axis in np.eye(len(values)):
            near = [[*held[:k], (effect, values + s * step * axis), *held[k + 1 :]] for s in (1.0, -1.0)]
            ahead, behind = (objective(campaign, explanation, observations.frames, pairs) for pairs in near)
            # to within a hundredth of the parabola's own width
            bend = ahead + behind - 2.0 * least
            assert abs(ahead - behind) / (2.0 * np.sqrt(bend)) < 0.01
    names = frame_columns(observations)[1]
    for axis in np.eye(len(names)):
        near = [moved(observations.frames, s * 1e-5 * axis, names) for s in (1.0, -1.0)]
        assert min(objective(campaign, explanation, frames, held) for frames in near) > least


def test_no_neighbour_of_the_fit_has_a_smaller_misfit(fitted):
    campaign, explanation, _, _, (observations, held) = fitted
    assert_least(campaign, explanation, observations, held, 1e-6)


def test_a_firm_prior_is_balanced_against_the_data(rv_m2):
    """Offsets that are believed to be ten microradians, and are a hundred."""
    campaign = simulate(rv_m2, ["joint_offset"], seed=6)[0]
    seen, explanation = explained(campaign, choose(("joint_offset",), (), ()))
    size = explanation.linear.blocks[0].sizes[0]
    held = [(explanation.linear.blocks[0].effect, explanation.values[0][0])]
    firm = replace(explanation, best=replace(explanation.best, scales={0: 1e-5 / size}))
    free, tight = (gauss_newton(campaign, seen.frames, e, held, SETTLED) for e in (explanation, firm))
    assert_least(campaign, firm, *tight, 1e-6)
    assert 0.0 < np.linalg.norm(tight[1][0][1]) < 0.9 * np.linalg.norm(free[1][0][1])


def test_the_exact_model_leaves_the_noise_where_the_linear_one_did_not(fitted):
    campaign, explanation, before, seen, (observations, _) = fitted
    linear = corrected_observations(campaign, seen.frames, before).gap
    assert np.sqrt((linear**2).mean()) > 5.0 * NOISE
    used = explanation.whitening.weights > 0
    assert np.sqrt((observations.gap[used] ** 2).mean()) < 1.2 * NOISE


def test_another_fit_moves_nothing(fitted):
    campaign, explanation, _, _, (observations, held) = fitted
    again, values = gauss_newton(campaign, observations.frames, explanation, held, SETTLED)
    assert np.abs(again.gap - observations.gap).max() < 1e-3 * NOISE
    for (_, now), (_, then) in zip(values, held, strict=True):
        np.testing.assert_allclose(now, then, rtol=0, atol=1e-8)


def test_rows_without_weight_do_not_matter(fitted):
    campaign, explanation, before, seen, _ = fitted
    off = np.arange(campaign.samples) % 6 == 0
    weights = np.where(off, 0.0, explanation.whitening.weights)
    light = replace(explanation, whitening=replace(explanation.whitening, weights=weights))
    spoilt = replace(campaign, position=campaign.position + np.where(off[:, None], 0.1, 0.0))
    (_, plain), (_, other) = (gauss_newton(c, seen.frames, light, before, SETTLED) for c in (campaign, spoilt))
    for (_, now), (_, then) in zip(other, plain, strict=True):
        np.testing.assert_array_equal(now, then)


def test_frames_alone_are_fitted_where_nothing_is_explained(rv_m2):
    campaign = simulate(rv_m2, seed=3)[0]
    seen, explanation = explained(campaign, ())
    observations, held = gauss_newton(campaign, seen.frames, explanation, (), SETTLED)
    assert held == []
    assert np.sqrt((observations.gap**2).mean()) == pytest.approx(NOISE, rel=0.1)


def test_what_only_the_frames_see_stays_at_zero(rv_m2):
    """An offset of the first joint and a turn of the base do the same: the prior leaves it to the base."""
    campaign = simulate(rv_m2, ["joint_gain"], seed=4)[0]
    effects = [*choose(("joint_gain",), (), ()), FirstJoint()]
    seen, explanation = explained(campaign, effects)
    held = [(effects[0], np.zeros(rv_m2.n)), (effects[1], np.zeros(1))]
    observations, found = gauss_newton(campaign, seen.frames, explanation, held, SETTLED)
    assert abs(found[1][1][0]) < 1e-9
    assert np.sqrt((observations.gap**2).mean()) < 1.2 * NOISE


def test_without_effects_the_corrected_model_is_the_nominal_one(rv_m2):
    campaign = simulate(rv_m2, seed=5, samples=20)[0]
    frames = register(campaign)
    effects = choose(("joint_offset", "instrument_scale"), (), ())
    plain = observe(campaign, frames)
    sizes = [len(block(plain, e).sizes) for e in effects]
    for pairs in ([], [(e, np.zeros(k)) for e, k in zip(effects, sizes, strict=True)]):
        np.testing.assert_allclose(corrected_observations(campaign, frames, pairs).gap, plain.gap, rtol=0, atol=1e-15)
    # a small effect takes its columns away from the gap
    values = [1e-7 * np.ones(k) for k in sizes]
    taken = sum(block(plain, e).columns @ v for e, v in zip(effects, values, strict=True))
    gap = corrected_observations(campaign, frames, list(zip(effects, values, strict=True))).gap
    np.testing.assert_allclose(plain.gap - gap, taken, rtol=0, atol=1e-5 * np.abs(taken).max())


def test_a_linear_fit_that_went_astray_does_not_end_worse_than_it_began(fitted):
    """Sizes of which the sum of two is right and each is turns away, as of effects that cancel each other."""
    campaign, explanation, held, seen, (_, right) = fitted
    astray = [(effect, values + 40.0) for effect, values in held]
    lost, far = gauss_newton(campaign, seen.frames, explanation, astray, SETTLED)
    begun = objective(campaign, explanation, seen.frames, [(e, np.zeros(len(v))) for e, v in held])
    assert objective(campaign, explanation, lost.frames, far) > begun
    kept, found = gauss_newton(campaign, seen.frames, explanation, astray, SETTLED, ())
    assert objective(campaign, explanation, kept.frames, found) < begun
    for (_, one), (_, other) in zip(found, right, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)
