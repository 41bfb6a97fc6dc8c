"""Warmth follows its surroundings as a body of one heat capacity does."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality.setting import followed, hall, time_constant, warmed

TIME = np.linspace(0.0, 9000.0, 181)


@pytest.mark.parametrize("constant", [300.0, 1700.0, 8000.0])
def test_a_steady_rise_is_followed_late_by_the_time_constant(constant):
    """Of a ramp of rate r a body that starts in balance is r τ (1 − exp(−t/τ)) behind."""
    drive = 20.0 + 1e-3 * TIME
    behind = drive - followed(TIME, drive, constant)
    np.testing.assert_allclose(behind, 1e-3 * constant * -np.expm1(-TIME / constant), atol=1e-6)


def test_it_obeys_its_differential_equation_between_rows_and_across_them():
    drive = 20.0 + 3.0 * np.sin(TIME / 900.0)
    fine = np.arange(0.0, 9000.0, 10.0)
    straight = np.interp(fine, TIME, drive)  # the drive runs straight between its rows
    body = followed(fine, straight, 1200.0)
    rate = (body[2:] - body[:-2]) / 20.0
    np.testing.assert_allclose(rate, (straight - body)[1:-1] / 1200.0, atol=2e-6)
    np.testing.assert_allclose(np.interp(TIME[:-1], fine, body), followed(TIME, drive, 1200.0)[:-1], atol=1e-5)


def test_what_is_warmer_at_first_cools_by_a_factor_e_in_a_time_constant():
    body = followed(TIME, np.full(181, 21.0), 900.0, start=31.0)
    assert body[0] == 31.0
    assert body[18] == pytest.approx(21.0 + 10.0 * np.exp(-1.0), rel=1e-9)
    assert (np.diff(body) < 0).all()


def test_what_is_in_balance_stays():
    np.testing.assert_allclose(followed(TIME, np.full(181, 25.0), 600.0), 25.0)


def test_a_wall_takes_minutes_to_hours_and_no_favoured_time():
    drawn = np.array([time_constant(np.random.default_rng(seed)) for seed in range(500)])
    assert 600.0 < drawn.min() < 1000.0  # aluminium, 4 mm, a draught
    assert 5000.0 < drawn.max() < 8200.0  # steel, 15 mm, still air
    assert len(np.unique(drawn)) == 500
    assert np.histogram(np.log(drawn), 12, (np.log(600.0), np.log(8200.0)))[0].max() < 100


def test_a_hall_is_a_hall():
    days = [hall(TIME, np.random.default_rng(seed)) for seed in range(200)]
    assert 14.0 < np.min(days) < np.max(days) < 31.0
    assert min(np.ptp(day) for day in days) > 0.1


def test_motors_make_a_link_warmer_than_the_hall(ur10):
    rng = np.random.default_rng(2)
    links = warmed(ur10, TIME, np.full(181, 21.0), None, rng)
    assert links.shape == (181, len(ur10.links))
    np.testing.assert_allclose(links[0], 21.0)
    assert (np.diff(links, axis=0) > 0).all()
    assert (links[-1] < 31.0).all()  # ten kelvin at most
    for a, b in ((s, t) for s in range(len(ur10.links)) for t in range(s)):
        assert (ur10.links[a] == ur10.links[b]) == np.array_equal(links[:, a], links[:, b])


def test_a_robot_that_was_switched_off_warms_again(ur10):
    session = np.repeat([0, 1], [90, 91])
    links = warmed(ur10, TIME, np.full(181, 21.0), session, np.random.default_rng(2))
    assert (links[100] < links[89]).all()  # the motors are cold again, and the links cool towards the hall
    assert (links[-1] > links.min(axis=0)).all()
