"""The exact model: a step that minimises what it says, a fit that ends where nothing moves, frames that follow."""

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.effects import choose
from thermal_robot.effects.joint_offset import JointOffset
from thermal_robot.inference.fit import fit
from thermal_robot.inference.gauss_newton import _ridge_step, corrected_observations, gauss_newton
from thermal_robot.kinematics import exp6
from thermal_robot.observations import Frames, observe


@pytest.fixture(scope="module")
def known(rv_m2):
    data, _, _ = simulate(rv_m2, ["joint_offset"], seed=2, ratio=(30.0, 40.0))
    return fit(data, choose(("joint_offset",), (), ()))


def test_a_step_minimises_misfit_and_prior_together():
    rng = np.random.default_rng(0)
    design, gap = rng.normal(size=(40, 7)), rng.normal(size=40)
    state, prior = rng.normal(size=4), rng.uniform(0.1, 2.0, 4)
    step, size = _ridge_step(design, gap, state, prior)
    rows = np.vstack([design, np.hstack([np.zeros((4, 3)), np.diag(1.0 / prior)])])
    wanted = np.linalg.lstsq(rows, np.concatenate([gap, -state / prior]), rcond=None)[0]
    np.testing.assert_allclose(step, wanted, rtol=1e-9)
    # what it moves, in noise: the length of the step as rows see it
    assert size == pytest.approx(np.linalg.norm(rows @ step), rel=1e-9)


def test_directions_that_nothing_determines_are_not_moved():
    rng = np.random.default_rng(1)
    column = rng.normal(size=(30, 1))
    step, _ = _ridge_step(np.hstack([column, -column]), rng.normal(size=30), np.zeros(0), np.zeros(0))
    assert step[0] == pytest.approx(-step[1], rel=1e-9)
    assert abs(step.sum()) < 1e-9 * abs(step[0])


def test_a_fit_that_has_ended_does_not_move(known):
    again, held = gauss_newton(known.campaign, known.corrected.frames, known.explanation, known.effects, 1e-4)
    ((_, values),) = held
    spread = np.sqrt(np.diag(known.explanation.values[known.explanation.best.blocks[0]][1]))
    np.testing.assert_array_less(np.abs(values - known.effects[0][1]), 1e-3 * spread)
    np.testing.assert_allclose(again.gap, known.corrected.gap, atol=1e-9)


def test_it_finds_its_way_back_from_a_start_that_is_off(known):
    away = [(effect, values + 2e-3) for effect, values in known.effects]
    _, held = gauss_newton(known.campaign, known.corrected.frames, known.explanation, away, 1e-4)
    spread = np.sqrt(np.diag(known.explanation.values[known.explanation.best.blocks[0]][1]))
    np.testing.assert_array_less(np.abs(held[0][1] - known.effects[0][1]), 1e-2 * spread)


def test_without_effects_only_the_frames_are_fitted(known):
    bare = fit(known.campaign, choose(("drift",), (), ()))
    assert not bare.effects
    weight = bare.explanation.whitening.weights[:, None]
    off = Frames(bare.corrected.frames.base @ exp6(np.full(6, 2e-3)), bare.corrected.frames.tool)
    moved, held = gauss_newton(known.campaign, off, bare.explanation, [], 1e-6)
    assert held == []
    least = float((weight * moved.gap**2).sum())
    assert least <= float((weight * bare.corrected.gap**2).sum())
    for axis in range(6):  # no turn or shift of the base makes it better
        near = Frames(moved.frames.base @ exp6(1e-6 * np.eye(6)[axis]), moved.frames.tool)
        assert float((weight * observe(known.campaign, near).gap ** 2).sum()) >= least * (1.0 - 1e-9)


def test_values_of_zero_correct_nothing(rv_m2):
    data, _, _ = simulate(rv_m2, seed=4)
    frames = Frames.declared(data)
    corrected = corrected_observations(data, frames, [(JointOffset(), np.zeros(rv_m2.n))])
    np.testing.assert_allclose(corrected.position, observe(data, frames).position, atol=1e-15)
