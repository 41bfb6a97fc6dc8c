"""Elongation to displacement: Eqs 6–11, Table 2, and laws of every arm."""

import numpy as np
import pytest
import reference

from thermal_robot import kinematics as kin
from thermal_robot.assembly.thermal import displacement, elongation, lengths, segment_names, sensitivity
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.model import PRISMATIC

# Table 2, row 1 with its own q3, and row 2; Δl of the paper's section 3.
Q = np.array([[0.5235, 0.8726, -1.3965, -1.0471, 0.0], [1.3963, 0.3839, -1.2217, -0.7330, 0.0]])
PAPER = 1e-6 * np.array([14, 5, 9, 7, 8])


def test_table_2_of_the_paper(rv_m2):
    moved = 1e3 * displacement(rv_m2, Q, PAPER)
    np.testing.assert_allclose(moved, [[0.00842, 0.01459, 0.00939], [0.01775, 0.00313, 0.00417]], atol=1e-5)
    # The paper cut the figures off; rounded, two of them would be others.
    np.testing.assert_array_equal(np.floor(1e3 * moved), [[8, 14, 9], [17, 3, 4]])
    np.testing.assert_array_equal(np.round(1e3 * moved), [[8, 15, 9], [18, 3, 4]])


def test_displacement_is_linear_in_elongations_however_large(arm, configurations):
    q = configurations(arm, 30)
    grown = np.random.default_rng(0).normal(0.0, 0.1, (30, len(segment_names(arm))))
    linear = displacement(arm, q, grown)
    np.testing.assert_allclose(displacement(arm, q, grown, exact=True), linear, rtol=0.0, atol=1e-13)
    augmented = reference.Augmented(arm)
    moved = augmented.tool_poses(q, grown)[:, :3, 3] - augmented.tool_poses(q)[:, :3, 3]
    np.testing.assert_allclose(moved, linear, rtol=0.0, atol=1e-10)


def test_elongations_by_name_by_row_and_over_time_agree(rv_m2):
    by_name = dict(zip(segment_names(rv_m2), PAPER, strict=True))
    once = displacement(rv_m2, Q, PAPER)
    np.testing.assert_array_equal(displacement(rv_m2, Q, by_name), once)
    np.testing.assert_array_equal(displacement(rv_m2, Q, np.stack([PAPER, 2 * PAPER]))[0], once[0])
    for exact in (False, True):
        over_time = displacement(rv_m2, Q[0], np.outer([0.0, 1.0, 3.0], PAPER), exact=exact)
        np.testing.assert_allclose(over_time, np.outer([0.0, 1.0, 3.0], once[0]), rtol=0.0, atol=1e-15)


def test_an_even_warming_keeps_the_arms_shape(arm, configurations):
    # Every length times 1 + χΔT moves the tool point away from the root by χΔT of its distance; strokes do not grow.
    q = configurations(arm, 50)
    frames, places, chain = kin.chain_frames(arm, q), kin.tool_poses(arm, q)[:, :3, 3], arm.chain
    for k, stroke in zip(chain.movable, chain.coupling.positions(q).T, strict=True):
        if chain.kinds[k] == PRISMATIC:
            places = places - stroke[:, None] * (frames.rotations[:, k] @ chain.axes[k])
    grown = elongation(arm, 23.0, coefficients=1.2e-5)
    np.testing.assert_allclose(displacement(arm, q, grown), 3.6e-5 * places, rtol=0.0, atol=1e-15)
    per_kelvin = sensitivity(arm, q, coefficients=1.2e-5)
    np.testing.assert_allclose(per_kelvin.sum(axis=2), 1.2e-5 * places, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_sensitivity_is_the_displacement_for_a_kelvin_in_one_segment(arm, configurations):
    q, names = configurations(arm, 10), segment_names(arm)
    coefficients = np.random.default_rng(1).uniform(1e-5, 3e-5, len(names))
    per_kelvin = sensitivity(arm, q, coefficients=coefficients)
    assert per_kelvin.shape == (10, 3, len(names))
    for column in range(len(names)):
        temperature = np.full(len(names), 20.0)
        temperature[column] += 1.0
        grown = elongation(arm, temperature, coefficients=coefficients)
        np.testing.assert_allclose(per_kelvin[:, :, column], displacement(arm, q, grown), rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(
        np.linalg.norm(per_kelvin, axis=1), np.tile(coefficients * lengths(arm), (10, 1)), rtol=1e-12
    )


def test_one_elongation_moves_the_tool_by_its_own_length(arm, configurations):
    # Eqs 6–8: each column is a direction, and what grows below a joint does not care how the joints above it stand.
    q, names = configurations(arm, 6), segment_names(arm)
    for name in names:
        only = dict.fromkeys(names, 0.0) | {name: 7e-6}
        np.testing.assert_allclose(np.linalg.norm(displacement(arm, q, only), axis=1), 7e-6, rtol=1e-12)
    first = displacement(arm, q, dict.fromkeys(names, 0.0) | {names[0]: 7e-6})
    np.testing.assert_allclose(first, np.tile(first[:1], (6, 1)), atol=1e-18)


def test_the_first_joint_turns_the_displacement(rv_m2):
    turned = Q[:1] + np.array([[0.0], [0.4], [-1.7]]) * np.eye(5)[0]
    moved = displacement(rv_m2, turned, PAPER)
    np.testing.assert_allclose(moved[:, 2], moved[0, 2], atol=1e-18)
    np.testing.assert_allclose(np.hypot(*moved[:, :2].T), np.hypot(*moved[0, :2]), rtol=1e-13)
    # q1 counts from +y towards +x.
    np.testing.assert_allclose(np.tan(turned[:, 0]), moved[:, 0] / moved[:, 1], rtol=1e-12)


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r, exact: displacement(r, Q, np.zeros((3, 5)), exact=exact), r"\(3, 5\) do not fit 2 configurations"),
        (lambda r, exact: displacement(r, Q, np.zeros((1, 2, 5)), exact=exact), r"\(1, 2, 5\) do not fit"),
        (lambda r, exact: displacement(r, Q[:, :4], PAPER, exact=exact), r"expected \(N, 5\)"),
        (lambda r, exact: displacement(r, Q, {"hand": 1e-6}, exact=exact), "no elongation is given for column_top"),
        (lambda r, _: sensitivity(r, Q, coefficients=[1e-5]), r"shape \(1,\) does not fit the 5 segments"),
    ],
)
def test_what_does_not_fit_is_said(rv_m2, call, words, exact):
    with pytest.raises(RobotError, match=words):
        call(rv_m2, exact)
