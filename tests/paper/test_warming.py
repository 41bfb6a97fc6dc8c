"""Rows of section 3: values, verdicts, and the laws that displacements, tests and polygons follow."""

from dataclasses import replace
from functools import cache
from itertools import product

import mpmath as mp
import numpy as np
import pytest

from thermal_robot.assembly.thermal import displacement
from thermal_robot.paper import PaperInputs, rv_m2_with_hand
from thermal_robot.paper.inputs import joints
from thermal_robot.paper.rows import WARMING, critical, median_error, random_systems

EXACT = {
    "Table 2 row 1, calculated": [8.42280e-6, 14.5920e-6, 9.39402e-6],
    "Table 2 row 2, calculated": [17.7548e-6, 3.12998e-6, 4.16864e-6],
    "U of Eq 13, row 1": [-0.714286, 1.11111, 1.17647, 1.95996, 0.915181],
    "U of Eq 13, row 2": [1.30435, 0.0, 1.11111, 1.95996, 0.915181],
    "U of Eq 13 before stabilisation": [
        *(-5.71429, -7.77778, -5.29412, -7.3913, -1.875, -2.22222),
        *(0.342994, 0.251995, 0.370215, 0.265172, 1.04531, 0.881984),
    ],
    "strain Δl/(l·ΔT)": [11.6667e-6, 13.8889e-6, 12.0e-6, 11.6667e-6, 17.7778e-6, 11.8575e-6],
    "Fig 5a, farthest point in y–z": [27.3472e-6, 29.3377e-6, 478.043e-12, 1912.17e-12, 10],
    "Fig 5b, farthest point in y–z": [22.8870e-6, 32.7149e-6, 419.765e-12, 1679.06e-12, 10],
}
# Answers of simulations ten times as large with another seed, and at least four Monte Carlo standard errors.
SIMULATED = {
    "Eq 12, five unknowns": (
        [60.29, 3.7, 2.3e-6, 4.2e-6, 15.38e-6, 36.37e-6, 14e-6, 5e-6, 9e-6, 7e-6, 8e-6],
        # The best of a sample is an extreme, of which only the size is known.
        [3.0, 0.7, 0.9e-6, 0.6e-6, 0.8e-6, 1.5e-6, *[1e-12] * 5],
    ),
}


@cache
def computed(inputs):
    return {entry.quantity: entry for entry in (row(inputs) for row in WARMING)}


def default():
    return computed(PaperInputs())


def few(**changed):
    """Other inputs, and fewer random poses."""
    return computed(replace(PaperInputs(pose_sets=50), **changed))


@pytest.mark.parametrize("quantity", EXACT)
def test_computed_value(quantity):
    np.testing.assert_allclose(default()[quantity].values, EXACT[quantity], rtol=1e-5, atol=1e-15)


@pytest.mark.parametrize("quantity", SIMULATED)
def test_simulated_value(quantity):
    expected, tolerance = map(np.array, SIMULATED[quantity])
    np.testing.assert_array_less(np.abs(np.array(default()[quantity].values) - expected), tolerance + 1e-15)


def test_every_row_is_checked_above():
    assert {*EXACT, *SIMULATED} == set(default())


@pytest.mark.parametrize("row", [1, 2])
def test_that_table_2_was_calculated_is_said_to_be_an_inference(row):
    # The paper: "The results of measurements of the gripper displacement … are shown in Table 2".
    why = default()[f"Table 2 row {row}, calculated"].why
    assert "calls these figures measured" in why
    assert "an inference of this ledger" in why


def test_before_stabilisation_five_of_six_components_are_critical():
    entry = default()["U of Eq 13 before stabilisation"]
    u, share = np.array(entry.values).reshape(2, 6)
    assert (np.abs(u) > critical(0.05)).tolist() == [True] * 4 + [False, True]
    assert (share < 1.0).tolist() == [True] * 4 + [False, True]
    assert entry.verdict == "agrees in part"
    assert "5 of 6 components" in entry.why
    assert "never in y of row 2" in entry.why


def test_before_stabilisation_a_larger_sample_sees_all_six_and_a_smaller_none():
    larger, smaller = (few(n=n)["U of Eq 13 before stabilisation"] for n in (1000, 4))
    assert (larger.verdict, smaller.verdict) == ("agrees", "not reproducible")
    assert "never" not in larger.why


def test_a_mean_that_is_off_belongs_to_the_critical_set():
    moved = few(sample_means=((12e-6, 16e-6, 11e-6), (20e-6, 3e-6, 6e-6)))
    assert moved["U of Eq 13, row 1"].verdict == "erratum"
    assert moved["U of Eq 13, row 2"].verdict == "agrees"


def test_displacements_lie_in_the_arms_own_plane_and_grow_with_the_elongations():
    inputs = PaperInputs()
    for row in (0, 1):
        name = f"Table 2 row {row + 1}, calculated"
        x, y, _ = default()[name].values
        assert x / y == pytest.approx(np.tan(inputs.poses[row][0]), rel=1e-12)
        doubled = few(delta_l=tuple(2.0 * grown for grown in inputs.delta_l))[name]
        np.testing.assert_allclose(doubled.values, 2.0 * np.array(default()[name].values), rtol=1e-13)
        # Every kelvin lifts the column; l1 alone has no other effect.
        lifted = few(delta_l=(inputs.delta_l[0] + 1e-6, *inputs.delta_l[1:]))[name]
        np.testing.assert_allclose(np.subtract(lifted.values, default()[name].values), [0, 0, 1e-6], atol=1e-18)


@pytest.mark.parametrize("which", ["5a", "5b"])
def test_farthest_point_is_that_of_the_farthest_corner(which):
    inputs = PaperInputs()
    q = joints(inputs.pose_5a if which == "5a" else inputs.poses[0])
    for lower, found in zip((0.0, -1.0), default()[f"Fig {which}, farthest point in y–z"].values[:2], strict=True):
        corners = np.array(list(product(*((lower * grown, grown) for grown in inputs.delta_l))))
        moved = displacement(rv_m2_with_hand(), q, corners)[:, 1:]
        assert found == pytest.approx(np.linalg.norm(moved, axis=1).max(), rel=1e-12, abs=0.0)


def test_strain_halves_when_the_rise_doubles():
    once, twice = default()["strain Δl/(l·ΔT)"], few(temperature=26.0)["strain Δl/(l·ΔT)"]
    np.testing.assert_allclose(twice.values, 0.5 * np.array(once.values), rtol=1e-13)


def test_a_quieter_instrument_and_a_larger_sample_find_elongations_better():
    errors = [
        few(**changed)["Eq 12, five unknowns"].values[2:6] for changed in ({}, {"n": 400}, {"reading_noise": 0.0})
    ]
    np.testing.assert_allclose(errors[1], 0.5 * np.array(errors[0]), rtol=1e-13)
    assert not np.any(errors[2])


def test_error_of_a_median_is_that_of_repeated_draws():
    rng = np.random.default_rng(3)
    drawn = rng.standard_normal((400, 1001))
    stated = np.mean([median_error(sample) for sample in drawn])
    # √(π/2) σ/√n for normal numbers; the standard error of 400 draws' deviation is 3.5 %.
    assert np.median(drawn, axis=1).std() == pytest.approx(stated, rel=0.15)
    assert stated == pytest.approx(np.sqrt(np.pi / 2.0 / 1001), rel=0.05)


def test_random_systems_follow_their_seed_and_agree_between_seeds():
    one, other = random_systems(4000, 1), random_systems(4000, 2)
    assert not np.array_equal(one[0], other[0])
    for first, second in ((one[0], other[0]), (one[2], other[2])):
        apart = abs(np.median(first) - np.median(second))
        assert apart < 5.0 * np.hypot(median_error(first), median_error(second))
    # Five equations need not be solvable well; ten always are better, and no condition number is below one.
    assert np.median(one[2]) < np.median(one[0])
    assert min(one[0].min(), one[2].min()) >= 1.0


@pytest.mark.parametrize("alpha", [0.5, 0.05, 1e-6])
def test_critical_value_leaves_alpha_in_both_tails(alpha):
    assert float(mp.erfc(mp.mpf(critical(alpha)) / mp.sqrt(2))) == pytest.approx(alpha, rel=1e-9)
