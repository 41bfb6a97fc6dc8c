"""Time stepping of a servo against closed forms of the equation of motion."""

import numpy as np
import pytest

pytest.importorskip("numba", reason="the extra fast is not installed")

from thermal_robot.errors import EstimationError
from thermal_robot.motion import servo
from thermal_robot.motion.servo import PARAMETERS, simulate

STEP, LEVER = 0.02, 0.3


def moved(command=1.0, seconds=2.0, load=0.0, slope=0.0, start=0.0, substeps=5, joints=1, plane=-np.inf, **numbers):
    """Position after a step of the command (or a table of stamps and values), and its instants; of joints alike."""
    times, values = (np.array([0.0]), np.array([command])) if np.isscalar(command) else map(np.asarray, command)
    values = values.astype(float)
    n = round(seconds / STEP) + 1
    row = np.zeros(len(PARAMETERS))
    row[PARAMETERS.index("low")], row[PARAMETERS.index("high")] = -np.inf, np.inf
    for name, value in numbers.items():
        row[PARAMETERS.index(name)] = value
    loads, none, slopes = (np.zeros((k, n, *shape)) for k, shape in ((8, (joints,)), *[(2, (joints, joints))] * 2))
    loads[0], slopes[0] = load, slope * np.eye(joints)
    loads[2, :, -1] = LEVER if joints > 1 else 0.0
    around = loads, none, slopes, none, np.zeros((n, joints)), np.zeros((n, joints)), np.zeros(n)
    grid = np.array([0, n]), np.zeros(1)
    ends = len(times) * np.arange(joints)[:, None] + [0, len(times)]
    command = np.tile(times, joints), np.tile(values, joints), ends
    rows, begun = np.tile(row, (1, joints, 1)), np.full((1, joints), start)
    weights = np.array([[0.0, plane if joints > 1 else 0.0, 0.0, 0.0, 0.0]])
    found = simulate(rows, weights, grid, command, around, begun, STEP, substeps)
    return found[0, :, -1], STEP * np.arange(n)


def test_lag_follows_its_exponential():
    q, t = moved(lag=0.07)
    np.testing.assert_allclose(q, 1.0 - np.exp(-t / 0.07), atol=2e-4)


@pytest.mark.parametrize("numbers", [{"lag": 0.05}, {"lag": 0.05, "inertia": 1e-3, "coulomb": 0.01}])
def test_a_tool_rests_on_a_plane_and_leaves_it_when_it_is_lifted(numbers):
    """The tool is at LEVER times the last joint's angle; lowered to −0.5 rad it is held at the plane, −0.06 m."""
    down = np.array([0.0, 1.0]), np.array([-0.5, 0.2])
    q, t = moved(down, joints=2, plane=-0.06, droop=0.07, **numbers)
    free, _ = moved(down, joints=2, droop=0.07, **numbers)
    assert LEVER * q.min() > -0.06 - 1e-6
    assert LEVER * q[t == 0.9] == pytest.approx(-0.06, abs=1e-6)
    assert (q[:2] == free[:2]).all()
    assert free.min() < -0.4
    assert q[-1] == pytest.approx(free[-1], abs=1e-3 + numbers.get("coulomb", 0.0))


@pytest.mark.parametrize("joints", [1, 2])
def test_a_set_point_of_limited_speed_is_a_ramp_that_the_lag_follows(joints):
    lag, speed = 0.07, 1.3
    q, t = moved(lag=lag, slew=1.0 / speed, joints=joints)
    ramp = speed * (t - lag * (1.0 - np.exp(-t / lag)))
    reached = speed * (1.0 / speed - lag * (1.0 - np.exp(-1.0 / (speed * lag))))
    after = 1.0 - (1.0 - reached) * np.exp(-(t - 1.0 / speed) / lag)
    np.testing.assert_allclose(q, np.where(t < 1.0 / speed, ramp, after), atol=2e-3)


@pytest.mark.parametrize("joints", [1, 2])
@pytest.mark.parametrize("speed", [0.9, np.inf])
def test_a_set_point_of_limited_acceleration_is_a_trapezoid_of_velocity(joints, speed):
    """A step of 1 rad at 4 rad/s² takes v/a + 1/v at the speed v, and 2 √(1/a) where speed has no limit."""
    q, t = moved(slew=1.0 / speed, ramp=0.25, joints=joints)
    peak = min(speed, 2.0)
    rises, whole = peak / 4.0, peak / 4.0 + 1.0 / peak
    cruise = 0.5 * peak * rises + peak * (t - rises)
    ends = np.where(t < whole, 1.0 - 2.0 * (whole - t) ** 2, 1.0)
    exact = np.where(t < rises, 2.0 * t**2, np.where(t < whole - rises, cruise, ends))
    np.testing.assert_allclose(q, exact, atol=peak * STEP / 5)  # way of one time step
    assert np.abs(np.diff(q, 2)).max() <= 4.0 * (t[1] - t[0]) ** 2 * 1.01
    assert q.max() <= 1.0 + 1e-9


@pytest.mark.parametrize(("substeps", "error"), [(5, 2e-3), (10, 5e-4), (20, 1.3e-4)])
def test_inertia_rings_as_an_oscillator_to_second_order_of_the_step(substeps, error):
    inertia, lag = 1e-3, 0.02
    q, t = moved(lag=lag, inertia=inertia, substeps=substeps)
    root, decay = 1.0 / np.sqrt(inertia), lag / (2.0 * inertia)
    rings = np.sqrt(root**2 - decay**2)
    exact = 1.0 - np.exp(-decay * t) * (np.cos(rings * t) + decay / rings * np.sin(rings * t))
    np.testing.assert_allclose(q, exact, atol=error)


@pytest.mark.parametrize("inertia", [0.0, 1e-3])
def test_friction_stops_the_joint_within_its_width_and_holds_it(inertia):
    q, _ = moved(lag=0.05, inertia=inertia, coulomb=0.1)
    assert abs(1.0 - q[-1]) <= 0.1 + 1e-12
    assert np.ptp(q[-20:]) < 1e-13
    q, _ = moved(command=0.09, lag=0.05, inertia=inertia, coulomb=0.1)
    assert np.ptp(q) == 0.0  # a pull below the friction moves nothing


def test_a_joint_hangs_below_its_command_by_compliance_times_load():
    q, _ = moved(lag=0.05, droop=0.07, load=2.0)
    assert q[-1] == pytest.approx(1.0 - 0.07 * 2.0, abs=1e-9)
    q, _ = moved(command=0.4, lag=0.05, droop=0.07, load=2.0, slope=3.0)  # the load grows with the position
    assert q[-1] == pytest.approx((0.4 - 0.07 * 2.0) / (1.0 + 0.07 * 3.0), abs=1e-9)


def test_delay_shifts_the_answer_and_no_more():
    stamps = np.arange(0.0, 2.0, 0.05)
    command = stamps, np.sin(3.0 * stamps)
    q, _ = moved(command, lag=0.05)
    late, _ = moved(command, lag=0.05, delay=0.06)
    np.testing.assert_allclose(late[3:], q[:-3], atol=1e-3)
    assert not np.allclose(late, q, atol=1e-2)


def test_delay_moves_the_answer_smoothly():
    stamps = np.arange(0.0, 2.0, 0.05)
    command = stamps, np.sin(3.0 * stamps)
    each = np.array([moved(command, lag=0.05, delay=d)[0] for d in np.linspace(0.010, 0.020, 11)])
    slopes = np.diff(each, axis=0)
    assert np.abs(np.diff(slopes, axis=0)).max() < 0.1 * np.abs(slopes).max()


def test_a_saturated_servo_turns_at_its_limit_over_its_lag():
    q, _ = moved(command=2.0, seconds=0.6, lag=0.1, saturation=1.0 / 0.2)
    speed = np.diff(q) / STEP
    np.testing.assert_allclose(speed[:20], 0.2 / 0.1, rtol=1e-6)


def test_a_stop_is_never_passed_and_is_left_without_delay():
    q, t = moved(lag=0.05, high=0.4)
    assert q.max() == 0.4
    stamps = np.array([0.0, 1.0])
    q, t = moved((stamps, [1.0, 0.0]), lag=0.05, high=0.4)
    assert q[t > 1.05].max() < 0.4


def test_dead_zone_leaves_half_its_width_on_either_side():
    up, _ = moved(command=1.0, lag=0.05, dead_zone=0.03)
    down, _ = moved(command=-1.0, lag=0.05, dead_zone=0.03)
    assert up[-1] == pytest.approx(0.97, abs=1e-6)
    assert down[-1] == pytest.approx(-0.97, abs=1e-6)


@pytest.mark.parametrize("joints", [1, 2])
def test_a_starting_force_overcomes_friction_and_carries_as_much_load(joints):
    """Friction stops a joint 30 mrad from its command, with a starting force of 20 at 10; a load hangs less."""
    up, _ = moved(lag=0.05, coulomb=0.03, dead_zone=-0.02, joints=joints)
    assert up[-1] == pytest.approx(0.99, abs=2e-3)
    loaded, _ = moved(lag=0.05, droop=0.1, load=0.8, dead_zone=-0.02, joints=joints)
    assert loaded[-1] == pytest.approx(1.0 - (0.08 - 0.02), abs=1e-4)
    carried, _ = moved(lag=0.05, droop=0.1, load=0.15, dead_zone=-0.02, joints=joints)  # at no error it gives 0 to 20
    assert carried[-1] == pytest.approx(1.0, abs=1e-4)


def test_friction_that_grows_with_load_widens_the_hysteresis():
    stamps = np.array([0.0, 2.0])
    width = []
    for load in (1.0, 2.0):
        up, _ = moved((stamps, [1.0, 1.0]), seconds=2.0, lag=0.05, droop=0.1, load=load, load_friction=0.5)
        down, _ = moved((stamps, [1.0, 1.0]), seconds=2.0, lag=0.05, droop=0.1, load=load, load_friction=0.5, start=2.0)
        width.append(down[-1] - up[-1])
    np.testing.assert_allclose(width, [2 * 0.5 * 0.1, 2 * 0.5 * 0.2], rtol=1e-3)


def test_breakaway_is_above_sliding_friction():
    held, _ = moved(command=0.05, lag=0.05, coulomb=0.03, stribeck=0.03)
    free, _ = moved(command=0.05, lag=0.05, coulomb=0.03)
    assert np.ptp(held) == 0.0
    assert np.ptp(free) > 0.01


@pytest.mark.parametrize("load_friction", [0.0, 0.1])
def test_friction_of_joints_that_move_each_other_obeys_coulombs_law(load_friction):
    rng, joints, h = np.random.default_rng(0), 7, 4e-3
    stuck = 0
    for _ in range(300):
        root, turn, load, command = (rng.normal(size=shape) for shape in ((joints, joints), joints, joints, joints))
        mass, load = 1e-4 * root @ root.T, 0.05 * load
        row = np.zeros((joints, len(PARAMETERS)))
        most = np.abs(0.2 * turn)
        for name, value in (("low", -np.inf), ("high", np.inf), ("lag", 0.05), ("droop", 1.0), ("coulomb", most),
                            ("load_friction", load_friction)):  # fmt: skip
            row[:, PARAMETERS.index(name)] = value
        loads, still = np.zeros((8, 2, joints)), np.zeros((2, joints))
        masses = np.stack([np.stack([mass, mass]), np.zeros((2, joints, joints))])
        loads[0], none = load, np.zeros_like(masses)
        around = loads, masses, none, none, still, still, still[:, 0]
        given = np.zeros(joints), command * 0.1, np.stack([np.arange(joints), np.arange(1, joints + 1)], axis=1)
        grid = np.array([0, 2]), np.zeros(1)
        found = simulate(row[None], np.zeros((1, 5)), grid, given, around, np.zeros((1, joints)), h, 1)
        v = found[0, 1] / h
        pulled = load + (2.0 / h) * (mass - np.diag(np.diag(mass))) @ v
        force = 0.1 * command - 0.5 * h * v - 0.05 * v - (2.0 / h) * mass @ v - load
        bound = most + load_friction * np.abs(pulled)
        stuck += int((v == 0.0).sum())
        np.testing.assert_allclose(force[v != 0.0], (np.sign(v) * bound)[v != 0.0], atol=1e-8)
        assert (np.abs(force) <= bound + 1e-8).all()
    assert 0.2 < stuck / (300 * joints) < 0.8


def test_without_numba_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(servo, "find_spec", lambda name: None)
    servo._kernels.cache_clear()
    with pytest.raises(EstimationError, match=r"thermal-robot\[fast\]"):
        moved(lag=0.05)
