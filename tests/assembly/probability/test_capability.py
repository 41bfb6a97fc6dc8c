"""Capability and required clearance: conventions and inverses; the paper's figures stand in the ledger's tests."""

import mpmath as mp
import numpy as np
import pytest
from helpers import some

from thermal_robot.assembly.probability import (
    UniformSpread,
    capability,
    capability_ratio,
    failing_from_capability,
    failing_probability,
    required_clearance,
)


def test_two_sided_capability_is_that_of_one_normal_coordinate():
    for value in (0.1, 1.0, 4.0 / 3.0, 5.0, 12.0):
        with mp.workdps(50):
            fails = float(mp.erfc(3 * mp.mpf(value) / mp.sqrt(2)))
        assert failing_from_capability(value) == pytest.approx(fails, rel=1e-11)
        assert capability(failing=fails) == pytest.approx(value, rel=1e-12)
    # by the failing share it goes on where the probability is one
    assert capability(1.0) == np.inf
    assert capability(failing=1e-200) == pytest.approx(10.07, abs=0.01)
    assert capability(0.9973002039367398) == pytest.approx(1.0, rel=1e-12)
    assert capability(0.0) == 0.0


def test_one_sided_capability_has_a_sign():
    values = np.array([-3.0, -0.5, 0.0, 0.2, 1.0, 9.0])
    fails = failing_from_capability(values, convention="one_sided")
    np.testing.assert_allclose(
        capability(failing=fails, convention="one_sided")[2:], values[2:], rtol=1e-12, atol=1e-15
    )
    joined = failing_from_capability(-values, convention="one_sided")
    np.testing.assert_allclose(capability(joined, convention="one_sided")[:4], values[:4], rtol=1e-12, atol=1e-15)


def test_ratio_is_clearance_over_six_standard_deviations():
    matrix = np.array([[2.5, 1.5], [1.5, 2.5]])  # principal variances 4 and 1
    assert capability_ratio(matrix, 24.0) == pytest.approx(2.0, rel=1e-14)
    assert capability_ratio(matrix, 24.0, thermal=UniformSpread.segment([3.0, 3.0])) == pytest.approx(
        4.0 / np.sqrt(10.0), rel=1e-14
    )


@pytest.mark.parametrize(
    "wanted", [{"capability": 0.2}, {"capability": 1.33}, {"probability": 0.3}, {"failing": 1e-40}]
)
@pytest.mark.parametrize(
    "case",
    [
        {},
        {"mean": (3.0, -5.0)},
        {"thermal": UniformSpread.segment([2.0, 6.0])},
        {"thermal": (4.0, 1.0), "shape": "rectangle", "sides": (1.0, 2.0)},
    ],
)
def test_required_clearance_undoes_the_probability(wanted, case):
    matrix = np.array([[9.0, 2.0], [2.0, 1.0]])
    size = required_clearance(matrix, **wanted, **case)
    proportion = np.asarray(case.get("sides", 1.0))
    options = {k: v for k, v in case.items() if k != "sides"}
    fails = float(failing_probability(matrix, size * proportion, **options))
    name, value = next(iter(wanted.items()))
    if name == "capability":
        assert capability(failing=fails) == pytest.approx(value, rel=1e-10)
    elif name == "probability":
        assert fails == pytest.approx(1.0 - value, rel=1e-10)
    else:
        assert fails == pytest.approx(value, rel=1e-9)


def test_required_clearance_of_equal_axes_is_the_closed_form_with_its_ends():
    assert required_clearance(np.eye(2), probability=0.0) == 0.0
    assert required_clearance(np.eye(2), probability=1.0) == np.inf
    for fails in (0.999999, 0.5, 1e-3, 1e-100):
        expected = np.sqrt(-8.0 * np.log(fails))
        assert required_clearance(np.eye(2), failing=fails) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("spread", some([UniformSpread.segment, UniformSpread.box], 2))
def test_a_law_without_a_normal_part_is_bounded(spread):
    """A clearance of 2 sqrt(2) holds all of the diagonal, or of the square; less holds less."""
    found = required_clearance(np.zeros((2, 2)), failing=1e-6, thermal=spread([1.0, 1.0]))
    assert found == pytest.approx(2.0 * np.sqrt(2.0), rel=2e-3)


@pytest.mark.parametrize(
    ("deviations", "shift", "expected"),
    [((14.0, 18.0), (7.0, 16.0), (1.20, 9.6, 9.7)), ((23.0, 16.0), (20.0, 3.0), (1.21, 9.0, 9.2))],
)
def test_heat_along_the_shift_costs_the_papers_rows_as_much_as_said(deviations, shift, expected):
    """Capability at the clearance of 1.33 without heat; its loss and the clearance to add, in per cent."""
    matrix, thermal = np.diag(deviations) ** 2, UniformSpread.segment(shift)  # micrometres
    cold, warm = (required_clearance(matrix, capability=1.33, thermal=heat) for heat in (None, thermal))
    index = float(capability(failing=failing_probability(matrix, cold, thermal=thermal)))
    assert index == pytest.approx(expected[0], abs=0.005)
    assert (100.0 * (1.0 - index / 1.33), 100.0 * (warm / cold - 1.0)) == pytest.approx(expected[1:], abs=0.05)


def test_questions_with_none_or_two_requirements_are_refused():
    for wanted in ({}, {"capability": 1.0, "probability": 0.5}):
        with pytest.raises(ValueError, match="exactly one"):
            required_clearance(np.eye(2), **wanted)
    with pytest.raises(ValueError, match="either"):
        capability(0.5, failing=0.5)
    with pytest.raises(ValueError, match="between 0 and 1"):
        capability(1.5)
    with pytest.raises(ValueError, match="convention"):
        capability(0.5, convention="three_sided")
    with pytest.raises(ValueError, match="every clearance"):
        required_clearance(np.zeros((2, 2)), probability=0.5)
    with pytest.raises(ValueError, match="is not negative"):
        failing_from_capability(-1.0)
    with pytest.raises(ValueError, match="convention"):
        failing_from_capability(1.0, convention="three_sided")
    with pytest.raises(ValueError, match="two positive numbers"):
        required_clearance(np.eye(2), probability=0.5, shape="rectangle", sides=(1.0, 0.0))
