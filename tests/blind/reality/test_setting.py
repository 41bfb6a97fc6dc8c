"""A day of measurements is one that can be: in limits, in time, in order; and warmth follows as in a body."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality.setting import draw_setting, followed, hall, humidity, time_constant, warmed

ASKED = {
    "standing": {},
    "moving": {"moving": True},
    "sessions": {"sessions": True},
    "visits": {"visits": (5, 5)},
    "robot": {"sensor": "robot"},
    "air": {"sensor": "air"},
}


@pytest.fixture(scope="module")
def days(ur10):
    """Six days of each kind."""
    rngs = [np.random.default_rng(seed) for seed in range(6)]
    return {kind: [draw_setting(ur10, 40, rng, **asked) for rng in rngs] for kind, asked in ASKED.items()}


@pytest.mark.parametrize("kind", ASKED)
def test_a_day_is_within_limits_and_cables_in_time_and_carries_what_suits(kind, days):
    for day in days[kind]:
        assert (day.q >= 0.75 * np.maximum(day.world.lower, -2.4) - 1e-12).all()
        assert (day.q <= 0.75 * np.minimum(day.world.upper, 2.4) + 1e-12).all()
        assert np.ptp(day.q, axis=0).min() > 0.9
        assert day.time[0] == 0.0
        assert (np.diff(day.time) > 0).all()
        assert 1.5 * 3600.0 <= day.time[-1] <= 6.0 * 3600.0
        heaviest = day.payload.max()
        assert set(day.payload) == {0.0, round(heaviest / 2, 2), heaviest}
        assert 0.5 <= heaviest <= 8.0
        if kind != "moving":  # it has come from where it was before
            assert not day.velocity.any()
            assert not day.acceleration.any()
            np.testing.assert_array_equal(day.approach, np.sign(np.diff(day.q, axis=0, prepend=day.q[:1])))
    poses, torque = day.world.poses(day.q, day.payload, day.world.sound(day.samples))
    np.testing.assert_array_equal(day.poses, poses)
    np.testing.assert_array_equal(day.torque, torque)
    np.testing.assert_array_equal(day.overturning, day.world.overturning(day.q, day.payload))


def test_between_two_sessions_the_robot_rests_long(days):
    for day in days["sessions"]:
        number, steps = day.session, np.diff(day.time)
        assert set(np.diff(number)) == {0, 1}
        assert number[0] == 0
        assert number[-1] in (1, 2)
        assert steps[np.diff(number) == 1].min() > 3.0 * np.median(steps)


def test_one_that_is_measured_in_passing_goes_the_way_of_its_speed(days):
    for day in days["moving"]:
        np.testing.assert_array_equal(day.approach, np.sign(day.velocity))
        assert (np.abs(day.velocity) <= 0.8 * day.speed[:, None]).all()
        assert np.abs(day.velocity).min() > 0.0


def test_a_repeated_pose_is_the_same_command(days):
    for day in days["visits"]:
        visits = np.bincount(day.pose)
        assert (visits == 5).all()
        assert all(np.ptp(day.q[day.pose == pose], axis=0).max() == 0.0 for pose in range(len(visits)))
        assert len(np.unique(day.q, axis=0)) == len(visits)


def test_one_sensor_says_something_of_every_link(days):
    for day in days["robot"]:
        apart = day.links - day.links.mean(axis=1, keepdims=True)
        assert np.abs(apart).max() < 1.0
        assert np.ptp(day.links.mean(axis=1)) > 1.0


def test_where_only_the_air_is_recorded_the_links_follow_it_late(days):
    for day in days["air"]:
        assert np.ptp(day.links, axis=1).max() == 0.0
        body = day.links[:, 0]
        assert body[0] == pytest.approx(day.air[0], abs=1e-9)
        assert day.air.min() - 1e-9 <= body.min()
        assert body.max() <= day.air.max() + 1e-9
        warmer = day.air[1:-1] > body[1:-1]
        # a link warms while its hall is warmer; rows where the two cross within a step decide nothing
        clear = np.abs(day.air - body)[1:-1] > 0.3
        rising = body[2:] > body[:-2]
        assert (rising == warmer)[clear].mean() > 0.9


def test_the_day_is_spent_twice_on_poses_to_measure_and_on_others(ur10):
    day = draw_setting(ur10, 12, np.random.default_rng(4), fresh=30, visits=(2, 3))
    assert (day.samples, day.given.sum(), day.given[0]) == (42, 12, True)
    for rows in (np.flatnonzero(day.given), np.flatnonzero(~day.given)):
        np.testing.assert_array_equal(day.before[rows], np.append(rows[:1], rows[:-1]))
        moves = np.diff(day.q[rows], axis=0, prepend=day.q[rows][:1])
        np.testing.assert_array_equal(day.approach[rows], np.sign(moves))
    # rows to predict are poses that were never measured
    assert not set(day.pose[day.given]) & set(day.pose[~day.given])


def test_the_air_grows_as_damp_in_many_rows_as_in_few():
    ends = [np.std([humidity(n, np.random.default_rng(s))[-1] for s in range(300)]) for n in (60, 1100)]
    # standard deviations of 300 draws are sure to 4 %
    assert ends[0] == pytest.approx(ends[1], rel=0.25)


# ---- warmth

TIME = np.linspace(0.0, 9000.0, 181)


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
    # what is in balance stays
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
