"""Noise, gross errors, and rows that are alike."""

from dataclasses import replace

import numpy as np
import pytest
from inference.problems import columns_of, problem_of

from thermal_robot.effects import choose
from thermal_robot.inference.problem import Whitening, gram
from thermal_robot.inference.robust import (
    design_effect,
)


def test_rows_are_worth_one_each_unless_their_remainders_are_alike(rv_m2):
    linear, seen = problem_of(rv_m2, choose(["joint_offset", "joint_gain"]))
    whitening = Whitening(np.ones(120), np.full(3, 25e-6), 20.0)
    groups = (np.arange(120) // 10,)
    independent = []
    for seed in range(10):
        noise = 25e-6 * np.random.default_rng(seed).normal(size=(120, 3))
        independent.append(design_effect(linear, seen, noise, whitening, groups))
    assert np.median(independent) == 1.0
    assert max(independent) < 2.0
    # columns and remainders that are the same throughout each group of ten: ten rows are worth one
    rng = np.random.default_rng(10)
    constant = replace(linear, blocks=(columns_of(np.repeat(rng.normal(size=(12, 3, 2)), 10, axis=0)),))
    steady = gram(replace(constant, frames=linear.frames[:, :, :0]), whitening)
    shared = 25e-6 * np.repeat(rng.normal(size=(12, 3)), 10, axis=0)
    apart = (np.tile(np.arange(10), 12),)
    flat = replace(constant, frames=linear.frames[:, :, :0])
    assert design_effect(flat, steady, shared, whitening, groups) == pytest.approx(10.0, rel=1e-9)
    assert design_effect(flat, steady, shared, whitening, apart) == 1.0
    tempered = steady.tempered(10.0)
    assert tempered.equations == steady.equations / 10.0
    np.testing.assert_allclose(tempered.matrix, steady.matrix / 10.0)
