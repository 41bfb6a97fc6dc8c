"""Temperature to elongation to displacement: Eqs 5–11, Table 2 and the strain of the paper, and laws of every arm."""

import numpy as np
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.assembly.thermal import (
    displacement,
    elongation,
    expansion_coefficient,
    expansion_coefficients,
    segment_names,
    sensitivity,
)
from thermal_robot.errors import RobotError

# Table 2, row 1 with its own q3, and row 2; Δl of the paper's section 3.
Q = np.array([[0.5235, 0.8726, -1.3965, -1.0471, 0.0], [1.3963, 0.3839, -1.2217, -0.7330, 0.0]])
PAPER = 1e-6 * np.array([14, 5, 9, 7, 8])


def lengths(robot):
    return np.array([robot.segments[s].length for s in kin.growing(robot)])


def test_table_2_of_the_paper(rv_m2):
    moved = 1e3 * displacement(rv_m2, Q, PAPER)
    np.testing.assert_allclose(moved, [[0.00842, 0.01459, 0.00939], [0.01775, 0.00313, 0.00417]], atol=1e-5)
    # The paper cut the figures off; rounded, two of them would be others.
    np.testing.assert_array_equal(np.floor(1e3 * moved), [[8, 14, 9], [17, 3, 4]])
    np.testing.assert_array_equal(np.round(1e3 * moved), [[8, 15, 9], [18, 3, 4]])


def test_strain_behind_the_papers_elongations(rv_m2):
    np.testing.assert_allclose(
        1e6 * expansion_coefficients(rv_m2, PAPER, 3.0), [11.67, 13.89, 12.00, 11.67, 17.78], atol=0.005
    )
    first_four = segment_names(rv_m2)[:4]
    assert 1e6 * expansion_coefficient(rv_m2, PAPER, 3.0, segments=first_four) == pytest.approx(11.857, abs=1e-3)
    by_link = ["column", "shoulder", "upper_arm", "forearm"]
    assert expansion_coefficient(rv_m2, PAPER, 3.0, segments=by_link) == expansion_coefficient(
        rv_m2, PAPER, 3.0, segments=first_four
    )


def test_a_coefficient_comes_back_from_elongations_at_several_temperatures(arm):
    temperature = np.array([[18.0], [24.0], [31.0]]) * np.ones(len(segment_names(arm)))
    grown = elongation(arm, temperature, coefficients=2.3e-5)
    assert expansion_coefficient(arm, grown, temperature - 20.0) == pytest.approx(2.3e-5, rel=1e-12)
    np.testing.assert_allclose(expansion_coefficients(arm, grown, temperature - 20.0), 2.3e-5, rtol=1e-12)


def test_elongation_is_equation_5_in_every_form(rv_m2):
    links = {"column": 22.0, "shoulder": 23.0, "upper_arm": 24.0, "forearm": 25.0, "hand": 26.0}
    coefficients = dict(zip(segment_names(rv_m2), [1e-5, 2e-5, 3e-5, 4e-5, 5e-5], strict=True))
    expected = np.array([1e-5, 2e-5, 3e-5, 4e-5, 5e-5]) * [0.4, 0.12, 0.25, 0.2, 0.15] * np.array([2, 3, 4, 5, 6])
    np.testing.assert_allclose(elongation(rv_m2, links, coefficients=coefficients), expected, rtol=1e-13)
    np.testing.assert_allclose(
        elongation(rv_m2, [22, 23, 24, 25, 26], coefficients=[1e-5, 2e-5, 3e-5, 4e-5, 5e-5]), expected, rtol=1e-13
    )
    assert not np.any(elongation(rv_m2, 23.5, coefficients=1.2e-5, reference=23.5))
    # A segment's own value goes before its link's, in whatever order they are written.
    for mixed in ({**links, "joint_3": 30.0}, {"joint_3": 30.0, **links}):
        grown = elongation(rv_m2, mixed, coefficients=coefficients)
        np.testing.assert_allclose(grown[2], 3e-5 * 0.25 * 10.0, rtol=1e-13)
    over_time = elongation(rv_m2, {**links, "hand": np.array([20.0, 26.0, 32.0])}, coefficients=coefficients)
    assert over_time.shape == (3, 5)
    np.testing.assert_allclose(over_time[1], expected, rtol=1e-13)


def test_displacement_is_linear_in_elongations_however_large(arm, configurations):
    q = configurations(arm, 30)
    grown = np.random.default_rng(0).normal(0.0, 0.1, (30, len(segment_names(arm))))
    linear = displacement(arm, q, grown)
    np.testing.assert_allclose(displacement(arm, q, grown, exact=True), linear, rtol=0.0, atol=1e-13)
    augmented = kin.augmented_model(arm)
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
    strokes = np.array([kind == "prismatic" for kind in arm.joint_types]) * q
    places = kin.tool_poses(arm, q)[:, :3, 3] - np.einsum("nij,nj->ni", kin.frame_jacobians(arm, q)[:, :3], strokes)
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


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: elongation(r, {"column": 20.0}, coefficients=1e-5), "no temperature is given for joint_2, joint_3"),
        (lambda r: elongation(r, 20.0, coefficients={"elbow": 1e-5}), "'elbow' is no segment .* column_top, column"),
        (lambda r: elongation(r, 20.0, coefficients=[1e-5] * 4), r"shape \(4,\) does not fit the 5 segments"),
        (lambda r: displacement(r, Q, np.zeros((3, 5))), r"\(3, 5\) do not fit 2 configurations"),
        (lambda r: displacement(r, Q, np.zeros((1, 2, 5))), r"\(1, 2, 5\) do not fit"),
        (lambda r: expansion_coefficient(r, PAPER, 3.0, segments=["wrist"]), "'wrist' is no segment with a length"),
        (lambda r: displacement(r, Q[:, :4], PAPER), r"expected \(N, 5\)"),
    ],
)
def test_what_does_not_fit_is_said(rv_m2, call, words):
    with pytest.raises(RobotError, match=words):
        call(rv_m2)
