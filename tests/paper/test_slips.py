"""Rows on slips and correlations: values, geometry and simulation."""

from functools import cache

import numpy as np
import pytest

from thermal_robot.kinematics import tool_poses
from thermal_robot.paper import PaperInputs, rv_m2_with_hand
from thermal_robot.paper.inputs import joints
from thermal_robot.paper.rows import SLIPS

EXACT = {
    "q3 of row 1": [91.2439e-6, 2.98820e-9],
    "law of U": [1.95996, 4, -0.714286, 1.11111, 1.17647, 1.30435, 0.0, 1.11111],
    "Eq 16, convolution": [],
    "symbols of σ": [],
    "x–y correlation of the kinematic error": [0.124061, 0.0996120, -0.0110271, -0.00332527],
    "x–y correlation of the thermal error": [1, 1, -0.0105000, -0.000744590],
}
# Answers of simulations ten times as large with another seed, and at least four Monte Carlo standard errors.
SIMULATED = {"Eq 12, points and equations": ([60.29, 5.991, 4], [3.0, 0.1, 0])}


@cache
def computed(inputs):
    return {entry.quantity: entry for entry in (row(inputs) for row in SLIPS)}


def default():
    return computed(PaperInputs())


@pytest.mark.parametrize("quantity", EXACT)
def test_computed_value(quantity):
    np.testing.assert_allclose(default()[quantity].values, EXACT[quantity], rtol=1e-5, atol=1e-15)


@pytest.mark.parametrize("quantity", SIMULATED)
def test_simulated_value(quantity):
    expected, tolerance = map(np.array, SIMULATED[quantity])
    np.testing.assert_array_less(np.abs(np.array(default()[quantity].values) - expected), tolerance + 1e-15)


def test_every_row_is_checked_above():
    assert {*EXACT, *SIMULATED} == set(default())


def test_two_values_of_q3_are_a_chord_about_the_elbow():
    # Forearm and hand, 200 mm and l5 with the angle q4 between them, turn by 0.3 mrad.
    for l5 in (0.15, 0.08):
        lever = np.sqrt(0.2**2 + l5**2 + 2.0 * 0.2 * l5 * np.cos(PaperInputs().poses[0][3]))
        found = computed(PaperInputs(l5=l5, pose_sets=50))["q3 of row 1"].values[0]
        assert found == pytest.approx(2.0 * lever * np.sin(0.5 * 0.0003), rel=1e-7, abs=0.0)


def test_kinematic_correlation_is_that_of_joints_that_err():
    inputs, rng, drawn = PaperInputs(), np.random.default_rng(12), 100_000
    for row, told in enumerate(default()["x–y correlation of the kinematic error"].values[:2]):
        q = joints(inputs.poses[row]) + rng.standard_normal((drawn, 5)) * [*inputs.sigma_q, 0.0]
        places = tool_poses(rv_m2_with_hand(inputs.l5), q)[:, :3, 3]
        # The standard error of a correlation is (1 − ρ²)/√N.
        assert np.corrcoef(places.T)[0, 1] == pytest.approx(told, abs=5.0 / np.sqrt(drawn))


def test_thermal_correlation_is_one_whatever_the_elongations_and_turns_with_the_arm():
    grown, poses = (3e-6, 20e-6, 1e-6, 9e-6, 0.5e-6), PaperInputs().poses
    name = "x–y correlation of the thermal error"
    np.testing.assert_allclose(computed(PaperInputs(delta_l=grown, pose_sets=50))[name].values[:2], 1.0, rtol=1e-12)
    mirrored = tuple((-pose[0], *pose[1:]) for pose in poses)
    np.testing.assert_allclose(computed(PaperInputs(poses=mirrored, pose_sets=50))[name].values[:2], -1.0, rtol=1e-12)


def test_slips_without_a_figure_are_errata_and_say_so():
    for name in ("Eq 16, convolution", "symbols of σ"):
        assert default()[name].verdict == "erratum"
        assert "No figure follows from it." in default()[name].why
        assert default()[name].computed == "–"
