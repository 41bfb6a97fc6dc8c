"""Joints err as joints do: laws of discs, teeth under load, servos and encoders."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.plan import ROBOTS
from thermal_robot.blind.reality import World
from thermal_robot.blind.reality import fault as gears
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.robot import load_robot

HALF, SOFT = 1e-3, 0.05


@pytest.fixture
def err(setting):
    """(N, n) by how much joints err: one joint, or as told."""

    def of(act, numbers, joint=1, day=setting):
        values = np.zeros((day.world.n, len(numbers)))
        values[joint] = numbers
        body = day.world.sound(day.samples)
        act(body, day, values)
        assert not np.delete(body.joints, joint, axis=1).any()
        return body.joints[:, joint]

    return of


@pytest.fixture(scope="module")
def turning(setting):
    """The same day, with the second joint going round once."""
    q = setting.q.copy()
    q[:, 1] = np.linspace(-np.pi, np.pi, setting.samples, endpoint=False)
    return replace(setting, q=q)


def hanging(setting, load, way):
    """The same day, with this torque on the second joint and this way of arrival."""
    torque, approach = setting.torque.copy(), setting.approach.copy()
    torque[:, 1], approach[:, 1] = load, way
    return replace(setting, torque=torque, approach=approach)


def test_a_zero_is_elsewhere_by_a_constant_and_a_graduation_by_a_share(err, setting):
    np.testing.assert_allclose(err(gears.offset, [2e-3]), 2e-3)
    np.testing.assert_allclose(err(gears.gain, [2e-3]) / setting.q[:, 1], 2e-3)


def test_a_disc_off_its_centre_misreads_by_the_arc_sine_at_most(err, turning):
    """Read from a centre that is e radii off, marks err by up to asin e, and not at all on average."""
    error = err(gears.wheels, [0.3, 0.4, 0.0, 0.0, 1.0], day=turning)
    assert np.abs(error).max() == pytest.approx(np.arcsin(0.5), rel=2e-3)
    assert error.mean() == pytest.approx(0.0, abs=1e-6)
    # not a sine: the second harmonic of a ray of a circle is e²/2
    spectrum = np.abs(np.fft.rfft(error)) * 2.0 / len(error)
    assert spectrum[1] == pytest.approx(0.5, rel=1e-9)
    assert spectrum[2] == pytest.approx(0.5**2 / 2.0, rel=1e-9)


def test_an_oval_wheel_repeats_after_half_a_turn_and_a_motors_disc_after_a_motors_turn(err, turning):
    oval = err(gears.wheels, [0.0, 0.0, 1e-3, 0.4, 1.0], day=turning)
    np.testing.assert_allclose(oval[:45], oval[45:], atol=1e-15)
    motor = err(gears.wheels, [1e-3, 0.0, 0.0, 0.0, 10.0], day=turning)
    np.testing.assert_allclose(motor[:81], motor[9:], atol=1e-15)
    assert np.ptp(oval) > 1e-3
    assert np.ptp(motor) > 1e-3


def test_teeth_lie_on_the_side_of_gravity_where_it_is_far_above_friction(err, setting):
    for way in (-1.0, 0.0, 1.0):
        for load in (-90.0, 90.0):
            found = err(gears.play, [HALF, 30.0, SOFT], day=hanging(setting, load, way))
            np.testing.assert_allclose(found, -HALF * np.sign(load), rtol=1e-6)


def test_they_lie_behind_on_the_way_where_friction_is_far_above_gravity(err, setting):
    for way in (-1.0, 0.0, 1.0):
        for load in (-10.0, 10.0):
            found = err(gears.play, [HALF, 30.0, SOFT], day=hanging(setting, load, way))
            np.testing.assert_allclose(found, -HALF * way, rtol=1e-6, atol=1e-9)


def test_between_the_two_they_change_sides_gradually_and_once(err, setting):
    load = np.linspace(-60.0, 60.0, setting.samples)
    up, down = (-err(gears.play, [HALF, 30.0, SOFT], day=hanging(setting, load, way)) / HALF for way in (1.0, -1.0))
    for side in (up, down):
        assert (np.diff(side) >= 0.0).all()
        assert np.abs(side).max() <= 1.0
        assert (np.abs(side) < 0.9).any()
    np.testing.assert_allclose(up, -down[::-1], atol=1e-12)  # the other way, turned over
    # a hysteresis: where the two ways differ friction decides, and the loop is twice the friction wide
    apart = np.trapezoid(up - down, load) / 2.0
    assert apart == pytest.approx(2 * 30.0, rel=1e-3)


def test_only_the_joints_own_torque_and_friction_count(err, setting):
    """A wrist with little friction hangs however heavy the arm before it; in other units nothing changes."""
    found = err(gears.play, [HALF, 0.05, SOFT], joint=3)
    light = replace(setting, torque=setting.torque * (np.arange(6) == 3))
    np.testing.assert_array_equal(err(gears.play, [HALF, 0.05, SOFT], joint=3, day=light), found)
    pounds = replace(setting, torque=setting.torque * 0.7376)
    np.testing.assert_allclose(err(gears.play, [HALF, 0.05 * 0.7376, SOFT], joint=3, day=pounds), found, rtol=1e-9)
    hung = np.abs(setting.torque[:, 3]) > 0.1
    assert hung.mean() > 0.5
    np.testing.assert_allclose(found[hung], -HALF * np.sign(setting.torque[hung, 3]), rtol=1e-6)


@pytest.mark.parametrize("name", ["ur10", "panda", "rv_m2"])
def test_play_is_drawn_so_that_it_can_be_told_from_an_offset(name):
    _, urdf, tool = next(robot for robot in ROBOTS if robot[0] == name)
    world = World(load_robot(urdf, tool).urdf, tool)
    rng = np.random.default_rng(4)
    day = draw_setting(world, 120, rng)
    draws = np.array([gears.draw_play(day, rng) for _ in range(150)])
    erring, friction = draws[:, :, 0] > 0, draws[:, :, 1]
    held = (np.abs(day.torque) < friction[:, None, :]).mean(axis=1)[erring]
    assert held.min() >= 0.25 - 1.0 / 120  # a quarter of the rows
    assert 0.2 < (held < 1.0).mean() < 0.7  # some hang, some never do
    assert len(np.unique(friction)) == friction.size
    assert (friction > 0).all()
    ratio = friction / friction[:, :1]  # one grease: joints differ by their size, not from draw to draw
    assert np.log(ratio[:, 1]).std() < 0.5 < np.log(friction[:, 1]).std()


def test_a_gear_is_built_for_the_arm_stretched_out():
    """A uniform arm with its payload at the end, level: exactly what holds it there."""
    urdf = """<robot name="beam"><link name="wall"/>
      <link name="arm"><inertial><origin xyz="0.4 0 0"/><mass value="4"/></inertial></link><link name="end"/>
      <joint name="turn" type="revolute"><parent link="wall"/><child link="arm"/><axis xyz="0 -1 0"/>
        <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
      <joint name="tip" type="fixed"><parent link="arm"/><child link="end"/><origin xyz="0.8 0 0"/></joint></robot>"""
    world = World(urdf, "end", payload_com=(0.0, 0.0, 0.0))
    day = draw_setting(world, 20, np.random.default_rng(1))
    level = world.poses(np.zeros((1, 1)), day.payload.max(keepdims=True), world.sound(1))[1]
    np.testing.assert_allclose(gears.ratings(day), level[0], rtol=1e-9)


def test_a_gear_is_smaller_the_farther_out_it_sits(setting):
    built = gears.ratings(setting)
    assert (np.diff(built) <= 0.0).all()
    assert (np.abs(setting.torque[:, :3]).max(axis=0) < 1.3 * built[:3]).all()


@pytest.mark.parametrize("loop", [0.0, 0.3, 1.0])
def test_a_servo_is_a_dead_time_and_a_loop_of_first_order(setting, loop):
    """y(t) = x(t + dead time) obeys loop · y' + y = command, once any start has died away."""
    delay, speed, rate = 4e-3, 0.6, 2.5
    dead, lag = (1.0 - loop) * delay, loop * delay
    time = np.linspace(0.0, 1.0, setting.samples)

    def stands(t):
        moving = np.ones((len(t), 6))
        day = replace(
            setting, velocity=(speed + rate * t)[:, None] * moving, acceleration=rate * moving, approach=moving
        )
        body = setting.world.sound(len(t))
        values = np.zeros((6, 3))
        values[1] = delay, 0.0, loop
        gears.servo(body, day, values)
        return speed * t + rate * t**2 / 2.0 + body.joints[:, 1]

    step = 1e-3
    slope = (stands(time + dead + step) - stands(time + dead - step)) / (2.0 * step)
    command = speed * time + rate * time**2 / 2.0
    np.testing.assert_allclose(lag * slope + stands(time + dead), command, atol=1e-12)


def test_friction_holds_a_servo_back_whatever_its_speed(err, setting):
    found = err(gears.servo, [0.0, 1e-4, 0.5], day=hanging(setting, 0.0, np.where(setting.time > 4e3, 1.0, -1.0)))
    np.testing.assert_allclose(found, np.where(setting.time > 4e3, -1e-4, 1e-4))


def test_delays_are_those_of_controllers_and_no_two_alike(setting):
    rng = np.random.default_rng(5)
    draws = np.array([gears.draw_servo(setting, rng) for _ in range(150)])
    delay, friction = draws[:, :, 0], draws[:, :, 1]
    erring = delay > 0
    np.testing.assert_array_equal(erring, friction > 0)
    assert set(erring.sum(axis=1)) == {1, 2, 3}
    assert 5e-4 <= delay[erring].min() < 7e-4
    assert 6e-3 < delay[erring].max() <= 8e-3
    assert len(np.unique(delay[erring])) == erring.sum()
    assert np.abs(np.corrcoef(np.log(delay[erring]), np.log(friction[erring]))[0, 1]) < 0.25


def test_springs_give_way_and_never_push(setting, body):
    rng = np.random.default_rng(6)
    draws = np.array([gears.draw_springs(setting, rng) for _ in range(100)])[:, :, 0]
    assert (draws > 0).all()
    worn = draws.max(axis=1) > 5.0 * np.median(draws, axis=1)
    assert 0.2 < worn.mean() < 0.65
    assert set(draws[worn].argmax(axis=1)) <= set(np.argsort((setting.torque**2).mean(axis=0))[-3:])
    gears.springs(body, setting, -draws[0][:, None])
    np.testing.assert_array_equal(body.springs, draws[0])


def test_an_encoder_stands_at_the_nearest_step(err, setting):
    step = 3e-3
    moved = err(gears.ticks, [-step])
    assert np.abs(moved).max() <= step / 2 + 1e-12
    steps = (setting.q[:, 1] + moved) / step
    np.testing.assert_allclose(steps, steps.round(), atol=1e-9)
    assert moved.std() == pytest.approx(step / np.sqrt(12.0), rel=0.2)


def test_scatter_is_the_same_at_any_size_and_another_on_another_day(err, setting):
    one, two = err(gears.scatter, [1e-4]), err(gears.scatter, [3e-4])
    np.testing.assert_allclose(two, 3.0 * one)
    assert one.std() == pytest.approx(1e-4, rel=0.35)  # 90 rows: 4.5 sigma
    later = replace(setting, time=setting.time + 7.0)
    assert not np.allclose(err(gears.scatter, [1e-4], day=later), one)
