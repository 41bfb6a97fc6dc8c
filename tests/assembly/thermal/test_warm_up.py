"""Links that lag: exact solutions, and the paper's story of before and after stabilisation."""

import numpy as np
import pytest

from thermal_robot.assembly.repeatability import tool_covariance
from thermal_robot.assembly.thermal import displacement, elongation, mean_shift_test, segment_names, warm_up
from thermal_robot.errors import RobotError

Q = np.array([0.5235, 0.8726, -1.3965, -1.0471, 0.0])
TAU = {"column": 7200.0, "shoulder": 5400.0, "upper_arm": 2700.0, "forearm": 1800.0, "hand": 900.0}
SIGMA_Q = 1e-6 * np.array([33, 38, 62, 49, 0])
ALPHA = 11.9e-6


def test_a_step_is_followed_exponentially(rv_m2):
    times = np.linspace(0.0, 20000.0, 41)
    found = warm_up(rv_m2, times, 23.0, time_constants=TAU, initial=20.0)
    expected = 23.0 - 3.0 * np.exp(-times[:, None] / np.array(list(TAU.values())))
    np.testing.assert_allclose(found.temperatures, expected, rtol=0.0, atol=1e-12)


def test_a_ramp_is_followed_at_its_distance(rv_m2):
    times, slope, tau = np.array([0.0, 1e3, 3e3, 3e4]), 1e-3, 900.0
    found = warm_up(rv_m2, times, 20.0 + slope * times, time_constants=tau)
    expected = 20.0 + slope * (times - tau * -np.expm1(-times / tau))
    np.testing.assert_allclose(found.temperatures, np.tile(expected[:, None], 5), rtol=0.0, atol=1e-12)
    assert 20.0 + slope * times[-1] - found.temperatures[-1, 0] == pytest.approx(slope * tau, rel=1e-9)


def test_more_instants_on_the_same_straight_pieces_change_nothing(rv_m2):
    corners, heights = np.array([0.0, 3600.0, 5000.0, 9000.0]), np.array([20.0, 24.0, 21.0, 21.5])
    fine = np.union1d(np.linspace(0.0, 9000.0, 3001), corners)
    coarse = warm_up(rv_m2, corners, heights, time_constants=TAU, initial=19.0)
    detailed = warm_up(rv_m2, fine, np.interp(fine, corners, heights), time_constants=TAU, initial=19.0)
    np.testing.assert_allclose(detailed.temperatures[np.isin(fine, corners)], coarse.temperatures, rtol=0.0, atol=1e-11)
    # A solver of differential equations that knows nothing of the exact solution agrees.
    from scipy.integrate import solve_ivp

    def rate(t, temperature):
        return (np.interp(t, corners, heights) - temperature) / np.array(list(TAU.values()))

    solved = solve_ivp(rate, (0.0, 9000.0), np.full(5, 19.0), t_eval=corners, rtol=1e-10, atol=1e-10, max_step=50.0)
    np.testing.assert_allclose(coarse.temperatures, solved.y.T, rtol=0.0, atol=2e-6)


def test_two_equal_times_are_a_step(rv_m2):
    times = np.array([0.0, 1000.0, 1000.0, 1900.0])
    found = warm_up(rv_m2, times, [20.0, 20.0, 25.0, 25.0], time_constants=900.0)
    np.testing.assert_allclose(found.temperatures[:, 0], [20.0, 20.0, 20.0, 25.0 - 5.0 / np.e], atol=1e-12)


def test_as_many_instants_as_segments_are_still_instants(rv_m2):
    found = warm_up(rv_m2, np.arange(5.0), [20.0, 21.0, 22.0, 23.0, 24.0], time_constants=1e-3)
    np.testing.assert_allclose(found.temperatures[:, 0], [20.0, 21.0, 22.0, 23.0, 24.0], atol=2e-3)
    assert np.ptp(found.temperatures, axis=1).max() == 0.0


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)
def test_a_link_may_have_surroundings_of_its_own(arm, configurations):
    names, times = segment_names(arm), np.linspace(0.0, 1e5, 50)
    motor = {name: 20.0 for name in names} | {names[1]: np.full(50, 35.0)}
    found = warm_up(arm, times, motor, time_constants=1800.0, initial=20.0)
    np.testing.assert_allclose(found.temperatures[-1], [35.0 if name == names[1] else 20.0 for name in names])
    q = configurations(arm, 1)[0]
    final = displacement(arm, q, elongation(arm, motor | {names[1]: 35.0}, coefficients=ALPHA))
    np.testing.assert_allclose(found.displacements(q, coefficients=ALPHA)[-1], final[0], rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(found.displacements(q, coefficients=ALPHA)[0], 0.0)


def repetitions(robot, start, tau, rng):
    """Measured displacements (100, 3), a minute apart, of a robot in a hall that went from 20 to 23 °C at zero."""
    times = np.concatenate([[0.0], start + 60.0 * np.arange(100)])
    moved = warm_up(robot, times, 23.0, time_constants=tau, initial=20.0).displacements(Q, coefficients=ALPHA)[1:]
    return moved + rng.multivariate_normal(np.zeros(3), tool_covariance(robot, Q, SIGMA_Q)[0], 100)


def test_the_mean_agrees_after_stabilisation_and_not_during_warm_up(rv_m2):
    # Section 3 of the paper: U outside the critical set once all arms have one temperature, inside it before.
    rng = np.random.default_rng(2018)
    static = displacement(rv_m2, Q, elongation(rv_m2, 23.0, coefficients=ALPHA))[0]
    sigma = np.sqrt(np.diag(tool_covariance(rv_m2, Q, SIGMA_Q)[0]))
    tests = {
        when: [mean_shift_test(repetitions(rv_m2, start, TAU, rng), static, sigma) for _ in range(150)]
        for when, start in (("during", 0.0), ("after", 12 * max(TAU.values())))
    }
    rejected = {when: np.mean([~test.accepted for test in runs], axis=0) for when, runs in tests.items()}
    # After: every axis is rejected as often as α says (5 %, standard error 1.8 %).
    np.testing.assert_allclose(rejected["after"], 0.05, atol=0.06)
    # During: the mean of 100 minutes falls short by 0.2, 0.3 and 0.6 σ in x, y and z, and no experiment misses that.
    assert np.mean([not test.accepted.all() for test in tests["during"]]) > 0.99
    # As often as the power of the test says for the mean that is still missing.
    still = warm_up(rv_m2, 60.0 * np.arange(100), 23.0, time_constants=TAU, initial=20.0)
    missing = still.displacements(Q, coefficients=ALPHA).mean(axis=0) - static
    np.testing.assert_allclose(rejected["during"], tests["during"][0].power(missing), atol=0.13)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([1.0, 0.0], 20.0, 900.0), "do not decrease"),
        (([], 20.0, 900.0), "at least one number"),
        (([0.0, 1.0], 20.0, 0.0), "positive time constant"),
        (([0.0, 1.0], 20.0, np.inf), "positive time constant"),
        (([0.0, 1.0], [20.0, 20.0, 20.0], 900.0), "3 ambient temperatures do not fit 2 times"),
        (([0.0, 1.0], np.full((3, 5), 20.0), 900.0), r"\(3, 5\) do not fit 2 times"),
        (([0.0, 1.0], {"column": 20.0}, 900.0), "no ambient temperature is given for joint_2"),
    ],
)
def test_what_does_not_fit_is_said(rv_m2, arguments, words):
    times, ambient, tau = arguments
    with pytest.raises(RobotError, match=words):
        warm_up(rv_m2, times, ambient, time_constants=tau)
