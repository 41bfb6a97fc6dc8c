"""Faults of formats.md and causes that no library knows, as laws of what they do to the arm, and how they are drawn."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.plan import ROBOTS
from thermal_robot.blind.reality import FAULTS, UNLISTED, World
from thermal_robot.blind.reality.fault import ratings
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import Gauge, place
from thermal_robot.blind.reality.unlisted import INTERPLAY, SLOW, slipped, wandered
from thermal_robot.blind.reality.world import from_vector, rpy_matrix
from thermal_robot.effects import library
from thermal_robot.robot import load_robot

ALL = {**FAULTS, **UNLISTED}
TWIST = np.array([3e-4, -2e-4, 1e-4, 2e-4, 1e-4, -3e-4])
HALF, SOFT = 1e-3, 0.05


@pytest.fixture
def err(setting):
    """(N,) by how much a joint errs, the second unless told otherwise, while no other does."""

    def of(name, *numbers, joint=1, day=setting, **changed):
        day = replace(day, **changed)
        values = np.zeros((day.world.n, len(numbers)))
        values[joint] = numbers
        body = day.world.sound(day.samples)
        ALL[name].act(body, day, values)
        assert not np.delete(body.joints, joint, axis=1).any()
        return body.joints[:, joint]

    return of


def drawn(name, day, count, seed=8):
    """(count, P, D) draws of a fault."""
    rng = np.random.default_rng(seed)
    return np.array([ALL[name].draw(day, rng) for _ in range(count)])


def steady(day, value):
    """The same (N,) in each row."""
    return np.full(day.samples, value)


def test_what_the_library_knows_the_reality_can_make_and_the_causes_are_in_no_library():
    assert set(library()) <= set(FAULTS)
    assert all(name == fault.name for name, fault in ALL.items())
    assert not {*library(), *FAULTS} & set(UNLISTED)
    assert len(UNLISTED) == 11 + 7 + 5


# ---- discs, teeth, servos, encoders


@pytest.fixture(scope="module")
def turning(setting):
    """The same day, with the second joint going round once."""
    q = setting.q.copy()
    q[:, 1] = np.linspace(-np.pi, np.pi, setting.samples, endpoint=False)
    return replace(setting, q=q)


@pytest.fixture
def hanging(err, setting):
    """(N,) error of play under this torque on the second joint and this way of arrival, over half the play."""

    def of(load, way):
        torque, approach = setting.torque.copy(), setting.approach.copy()
        torque[:, 1], approach[:, 1] = load, way
        return err("backlash", HALF, 30.0, SOFT, torque=torque, approach=approach) / HALF

    return of


def test_a_disc_off_its_centre_misreads_by_the_arc_sine_at_most(err, turning):
    """Read from a centre that is e radii off, marks err by up to asin e, and not at all on average."""
    error = err("transmission_error", 0.3, 0.4, 0.0, 0.0, 1.0, day=turning)
    assert np.abs(error).max() == pytest.approx(np.arcsin(0.5), rel=2e-3)
    assert error.mean() == pytest.approx(0.0, abs=1e-6)
    # not a sine: the second harmonic of a ray of a circle is e²/2
    spectrum = np.abs(np.fft.rfft(error)) * 2.0 / len(error)
    assert spectrum[1] == pytest.approx(0.5, rel=1e-9)
    assert spectrum[2] == pytest.approx(0.5**2 / 2.0, rel=1e-9)


def test_an_oval_wheel_repeats_after_half_a_turn_and_a_motors_disc_after_a_motors_turn(err, turning):
    oval = err("transmission_error", 0.0, 0.0, 1e-3, 0.4, 1.0, day=turning)
    motor = err("transmission_error", 1e-3, 0.0, 0.0, 0.0, 10.0, day=turning)
    np.testing.assert_allclose(oval[:45], oval[45:], atol=1e-15)
    np.testing.assert_allclose(motor[:81], motor[9:], atol=1e-15)
    assert min(np.ptp(oval), np.ptp(motor)) > 1e-3


@pytest.mark.parametrize("way", [-1.0, 0.0, 1.0])
def test_teeth_lie_on_the_side_of_gravity_or_behind_on_the_way_whichever_is_larger(hanging, way):
    for load in (-1.0, 1.0):
        np.testing.assert_allclose(hanging(90.0 * load, way), -load, rtol=1e-6)
        np.testing.assert_allclose(hanging(10.0 * load, way), -way, rtol=1e-6, atol=1e-6)


def test_between_the_two_they_change_sides_gradually_and_once(hanging, setting):
    load = np.linspace(-60.0, 60.0, setting.samples)
    up, down = (-hanging(load, way) for way in (1.0, -1.0))
    for side in (up, down):
        assert (np.diff(side) >= 0.0).all()
        assert np.abs(side).max() <= 1.0
        assert (np.abs(side) < 0.9).any()
    np.testing.assert_allclose(up, -down[::-1], atol=1e-12)  # the other way, turned over
    # a hysteresis: where the two ways differ friction decides, and the loop is twice the friction wide
    assert np.trapezoid(up - down, load) / 2.0 == pytest.approx(2 * 30.0, rel=1e-3)


def test_only_the_joints_own_torque_and_friction_count(err, setting):
    """A wrist with little friction hangs however heavy the arm before it; in other units nothing changes."""
    found = err("backlash", HALF, 0.05, SOFT, joint=3)
    light = setting.torque * (np.arange(6) == 3)
    np.testing.assert_array_equal(err("backlash", HALF, 0.05, SOFT, joint=3, torque=light), found)
    pounds = err("backlash", HALF, 0.05 * 0.7376, SOFT, joint=3, torque=setting.torque * 0.7376)
    np.testing.assert_allclose(pounds, found, rtol=1e-9)
    hung = np.abs(setting.torque[:, 3]) > 0.1
    assert hung.mean() > 0.5
    np.testing.assert_allclose(found[hung], -HALF * np.sign(setting.torque[hung, 3]), rtol=1e-6)


@pytest.mark.parametrize("name", ["ur10", "panda", "rv_m2"])
def test_play_is_drawn_so_that_it_can_be_told_from_an_offset(name):
    _, urdf, tool = next(robot for robot in ROBOTS if robot[0] == name)
    day = draw_setting(World(load_robot(urdf, tool).urdf, tool), 120, np.random.default_rng(4))
    draws = drawn("backlash", day, 150)
    erring, friction = draws[:, :, 0] > 0, draws[:, :, 1]
    held = (np.abs(day.torque) < friction[:, None, :]).mean(axis=1)[erring]
    assert held.min() >= 0.25 - 1.0 / 120  # a quarter of the rows
    assert 0.2 < (held < 1.0).mean() < 0.7  # some hang, some never do
    assert len(np.unique(friction)) == friction.size
    assert (friction > 0).all()
    ratio = friction / friction[:, :1]  # one grease: joints differ by their size, not from draw to draw
    assert np.log(ratio[:, 1]).std() < 0.5 < np.log(friction[:, 1]).std()


def test_a_gear_is_built_for_the_arm_stretched_out_and_smaller_the_farther_out_it_sits(beam, setting):
    """A uniform arm with its payload at the end, level: exactly what holds it there."""
    day = draw_setting(beam, 20, np.random.default_rng(1))
    level = beam.poses(np.zeros((1, 1)), day.payload.max(keepdims=True), beam.sound(1))[1]
    np.testing.assert_allclose(ratings(day), level[0], rtol=1e-9)
    built = ratings(setting)
    assert (np.diff(built) <= 0.0).all()
    assert (np.abs(setting.torque[:, :3]).max(axis=0) < 1.3 * built[:3]).all()


@pytest.mark.parametrize("loop", [0.0, 0.3, 1.0])
def test_a_servo_is_a_dead_time_and_a_loop_of_first_order(err, setting, loop):
    """y(t) = x(t + dead time) obeys loop · y' + y = command, once any start has died away."""
    delay, speed, rate = 4e-3, 0.6, 2.5
    dead, lag = (1.0 - loop) * delay, loop * delay
    time, ones = np.linspace(0.0, 1.0, setting.samples), np.ones((setting.samples, 6))

    def stands(t):
        moving = {"velocity": (speed + rate * t)[:, None] * ones, "acceleration": rate * ones, "approach": ones}
        return speed * t + rate * t**2 / 2.0 + err("tracking_lag", delay, 0.0, loop, **moving)

    step = 1e-3
    slope = (stands(time + dead + step) - stands(time + dead - step)) / (2.0 * step)
    command = speed * time + rate * time**2 / 2.0
    np.testing.assert_allclose(lag * slope + stands(time + dead), command, atol=1e-12)


def test_friction_holds_a_servo_back_whatever_its_speed(err, setting):
    way = np.where(setting.time > 4e3, 1.0, -1.0)
    found = err("tracking_lag", 0.0, 1e-4, 0.5, approach=way[:, None] * np.ones(6))
    np.testing.assert_allclose(found, -1e-4 * way)


def test_delays_are_those_of_controllers_and_no_two_alike(setting):
    delay, friction, _ = drawn("tracking_lag", setting, 150, 5).transpose(2, 0, 1)
    erring = delay > 0
    np.testing.assert_array_equal(erring, friction > 0)
    assert set(erring.sum(axis=1)) == {1, 2, 3}
    assert 5e-4 <= delay[erring].min() < 7e-4
    assert 6e-3 < delay[erring].max() <= 8e-3
    assert len(np.unique(delay[erring])) == erring.sum()
    # independent: 300 draws and more correlate by 0.06, one sigma
    assert np.abs(np.corrcoef(np.log(delay[erring]), np.log(friction[erring]))[0, 1]) < 0.2


def test_springs_give_way_and_never_push(setting, body):
    draws = drawn("joint_compliance", setting, 100, 6)[:, :, 0]
    assert (draws > 0).all()
    worn = draws.max(axis=1) > 5.0 * np.median(draws, axis=1)
    assert 0.2 < worn.mean() < 0.65
    assert set(draws[worn].argmax(axis=1)) <= set(np.argsort((setting.torque**2).mean(axis=0))[-3:])
    FAULTS["joint_compliance"].act(body, setting, -draws[0][:, None])
    np.testing.assert_array_equal(body.springs, draws[0])


def test_an_encoder_stands_at_the_nearest_step(err, setting):
    step = 3e-3
    moved = err("encoder_resolution", -step)
    assert np.abs(moved).max() <= step / 2 + 1e-12
    steps = (setting.q[:, 1] + moved) / step
    np.testing.assert_allclose(steps, steps.round(), atol=1e-9)
    # of 90 even draws the standard deviation is sure to 5 %, one sigma
    assert moved.std() == pytest.approx(step / np.sqrt(12.0), rel=0.15)


def test_scatter_is_the_same_at_any_size_and_another_on_another_day(err, setting):
    one, two = err("excess_repeatability", 1e-4), err("excess_repeatability", 3e-4)
    np.testing.assert_allclose(two, 3.0 * one)
    assert one.std() == pytest.approx(1e-4, rel=0.35)  # 90 rows: 4.5 sigma
    assert not np.allclose(err("excess_repeatability", 1e-4, time=setting.time + 7.0), one)


# ---- frames, links, warmth


def settles(setting, body, constant):
    FAULTS["drift"].act(body, setting, np.append(TWIST, constant)[None])
    return body.base


@pytest.mark.parametrize("constant", [600.0, 2500.0, 7e4])
def test_drift_is_nothing_at_the_first_row_and_slows_as_what_is_left_of_it_does(setting, body, constant):
    """Newton's law: in equal times equal shares of the rest are made up, exp(−Δt/τ)."""
    base = settles(setting, body, constant)
    np.testing.assert_array_equal(base[0], np.eye(4))
    away = np.linalg.norm(base[:, :3, 3], axis=1)
    assert (np.diff(away) >= 0).all()
    rest = 1.0 - base[:, 0, 3] / TWIST[0]
    early = setting.time < 8.0 * constant  # later only rounding is left
    np.testing.assert_allclose(rest[early], np.exp(-setting.time[early] / constant), rtol=1e-6)


def test_stands_settle_in_minutes_to_a_day_and_no_two_alike(setting):
    constants = drawn("drift", setting, 400)[:, 0, 6]
    assert 600.0 <= constants.min() < 900.0
    assert 5e4 < constants.max() <= 7.2e4
    assert len(np.unique(constants)) == 400
    # no more of a campaign's length than of another time
    assert np.histogram(np.log(constants), 8, np.log([600.0, 7.2e4]))[0].max() < 80


def test_links_grow_along_themselves(ur10, setting, gauge):
    """Tool displacement of growth equals the sum of segment vectors times their strain."""
    values = np.full((len(ur10.segments), 1), 12e-6)
    moved = place(setting, [(FAULTS["thermal_elongation"], values)], gauge.target)[0] - gauge.sound
    expected = np.zeros_like(moved)
    start, movable = np.tile(np.eye(4), (setting.samples, 1, 1)), 0
    for k, joint in enumerate(ur10.chain):
        if k in ur10.segments:
            strain = 12e-6 * (setting.links[:, ur10.segments.index(k)] - 20.0)
            expected += (start[:, :3, :3] @ joint.xyz) * strain[:, None]
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = rpy_matrix(joint.rpy), joint.xyz
        start = start @ step
        if joint.movable:
            start = start @ from_vector(np.outer(setting.q[:, movable], np.append(np.zeros(3), joint.axis)))
            movable += 1
    np.testing.assert_allclose(moved, expected, atol=1e-10)
    assert np.abs(moved).max() > 50e-6


def test_a_soft_base_lets_its_load_sink_about_a_point_that_stays(setting, body):
    FAULTS["base_compliance"].act(body, setting, np.array([[1e-6, 2e-6, 0.7]]))
    below = np.array([0.0, 0.0, -0.7])
    np.testing.assert_allclose(body.base[:, :3, :3] @ below + body.base[:, :3, 3], np.tile(below, (90, 1)), atol=1e-6)
    # the centre of all that has weight goes down: gravity does work on each spring
    turned = (body.base[:, [2, 0], [1, 2]] - body.base[:, [1, 2], [2, 0]]) / 2.0
    assert (turned * setting.overturning[:, :2] >= -1e-15).all()
    np.testing.assert_allclose(turned, setting.overturning[:, :2] * [1e-6, 2e-6], rtol=1e-3, atol=1e-9)


def test_some_bases_turn_at_the_flange_and_some_below(setting):
    draws = drawn("base_compliance", setting, 40, 6)
    depths = draws[:, 0, 2]
    assert (depths == 0.0).any()
    assert ((depths >= 0.0) & (depths <= 1.0)).all()
    assert {len(FAULTS["base_compliance"].known_as(setting, values)) for values in draws} == {2, 4}


def test_a_link_as_warm_as_its_hall_does_not_bow(setting, body):
    values = np.full((len(setting.world.segments), 2), 1e-4)
    level = replace(setting, links=np.repeat(setting.air[:, None], setting.links.shape[1], axis=1))
    FAULTS["thermal_bending"].act(body, level, values)
    assert not body.bow.any()
    FAULTS["thermal_bending"].act(body, setting, values)
    warmer = (setting.links - setting.air[:, None])[:, :, None]
    np.testing.assert_array_equal(np.sign(body.bow), np.sign(warmer) * np.ones(2))


@pytest.mark.parametrize("name", ["joint_offset", "geometric", "base_frame", "tool_frame", "instrument_scale"])
def test_what_is_always_there_does_not_know_the_row(name, setting, gauge):
    """The same command measured later and carrying more is as far off."""
    fault = [(FAULTS[name], FAULTS[name].draw(setting, np.random.default_rng(2)))]
    later = replace(setting, time=setting.time + 1e4, payload=setting.payload + 1.0, links=setting.links + 5.0)
    np.testing.assert_array_equal(*(place(day, fault, gauge.target)[0] for day in (setting, later)))


@pytest.mark.parametrize("name", ["joint_compliance", "link_compliance"])
def test_what_yields_yields_more_under_a_payload(name, setting, gauge):
    fault = FAULTS[name]
    values = np.full((len(fault.places(setting)), 2 if name == "link_compliance" else 1), 1e-6)
    days = (replace(setting, payload=steady(setting, mass)) for mass in (0.0, 8.0))
    bare, loaded = (np.linalg.norm(place(d, [(fault, values)], gauge.target)[0] - gauge.sound, axis=1) for d in days)
    assert (loaded > bare).mean() > 0.95
    assert np.median(loaded) > 1.1 * np.median(bare)


def test_a_scale_is_about_the_instruments_origin(setting):
    pose = from_vector(np.array([[1.0, 2.0, 0.5, 0.2, -0.3, 1.0]]))[0]
    scaled = place(setting, [(FAULTS["instrument_scale"], np.array([[1e-3]]))], np.zeros(3), pose)[0]
    np.testing.assert_allclose(scaled, 1.001 * place(setting, [], np.zeros(3), pose)[0], rtol=1e-12)


def test_misplaced_frames_move_their_own_end(setting, gauge):
    base, tool = (place(setting, [(FAULTS[f"{end}_frame"], TWIST[None])], gauge.target)[0] for end in ("base", "tool"))
    motion = from_vector(TWIST[None])[0]
    np.testing.assert_allclose(base, gauge.sound @ motion[:3, :3].T + motion[:3, 3], atol=1e-12)
    shifted = motion[:3, :3] @ gauge.target + motion[:3, 3]
    turned = setting.poses[:, :3, :3]
    np.testing.assert_allclose(tool, turned @ shifted + setting.poses[:, :3, 3], atol=1e-12)


def test_one_time_in_three_geometry_is_one_bent_link(setting):
    second, first = np.sort(np.abs(drawn("geometric", setting, 300, 5)).max(axis=2), axis=1)[:, -2:].T
    # three times in ten, to 2.7 %, one sigma, and what chance leaves beside
    assert 0.2 < (first > 3.0 * second).mean() < 0.45


# ---- which joints err, and what is no size


@pytest.fixture(scope="module")
def scara():
    """Four joints, the third of which slides."""
    _, urdf, tool = next(robot for robot in ROBOTS if robot[0] == "scara")
    return draw_setting(World(load_robot(urdf, tool).urdf, tool), 10, np.random.default_rng(1))


def test_one_to_three_joints_err_and_none_that_frames_would_hide(scara, setting):
    gains, offsets = (drawn(name, scara, 200)[:, :, 0] for name in ("joint_gain", "joint_offset"))
    assert set((gains != 0).sum(axis=1)) == {1, 2, 3}
    assert (gains != 0).any(axis=0).tolist() == [True, True, True, False]
    assert (offsets != 0).any(axis=0).tolist() == [False, True, True, False]
    assert set((offsets != 0).sum(axis=1)) == {1, 2}  # of four joints two are left: three cannot err
    # one of them is no draw near zero
    assert np.abs(gains).max(axis=1).min() >= 1e-3
    assert gains.min() < 0.0 == drawn("encoder_resolution", scara, 50).min()


def test_a_disc_turns_with_no_joint_that_slides(scara):
    draws = drawn("transmission_error", scara, 60, 3)
    on_the_joint = draws[(draws[:, :, 4] == 1.0).all(axis=1)]
    assert len(on_the_joint) > 20
    slides = int(np.flatnonzero(scara.world.slides)[0])
    assert not on_the_joint[:, slides, :3].any()


@pytest.mark.parametrize("name", FAULTS)
def test_every_effect_can_be_drawn_for_an_arm_of_four_joints(name, scara):
    draws = drawn(name, scara, 8)
    assert np.isfinite(draws).all()
    assert draws.shape[1] == max(len(FAULTS[name].places(scara)), 1)


# ---- causes that no library knows: one quantity at one place


def test_a_belt_slips_once_and_stays(err, setting):
    np.testing.assert_array_equal(err("slip", 1e-3, 0.4), np.where(setting.time > 0.4 * setting.time[-1], 1e-3, 0.0))


def test_a_cable_is_slack_and_then_pulls_back(err, setting):
    q = setting.q[:, 1]
    taut = float(np.median(q))
    pulled = err("cable_pull", 1e-3, taut)
    assert not pulled[q <= taut].any()
    assert (np.diff(pulled[np.argsort(q)]) <= 0).all()
    assert pulled.min() == pytest.approx(-1e-3 * (q.max() - taut))


def test_a_hose_is_moved_by_the_joint_before(err, setting):
    pushed, mirrored = err("hose", 1e-3, 0.3), setting.q.copy()
    assert (pushed >= 0).all()
    mirrored[:, 0] = 0.6 - setting.q[:, 0]  # as far on the other side of where the hose is straight
    np.testing.assert_allclose(err("hose", 1e-3, 0.3, q=mirrored), pushed, atol=1e-15)
    assert UNLISTED["hose"].quantities(setting, [("joint", setting.world.names[1])]) == [setting.world.names[0]]


def test_heat_and_speed_count_by_their_squares(err, setting):
    warm, hot = (err("hot_motor", 1e-3, extra={"motor_temperature": steady(setting, t)}) for t in (30.0, 40.0))
    slow, fast = (err("speed_droop", 1e-3, speed=steady(setting, s)) for s in (0.3, 0.6))
    np.testing.assert_allclose(hot, 4.0 * warm)
    np.testing.assert_allclose(fast, 4.0 * slow)


def test_a_damaged_tooth_errs_only_where_it_is(err, setting):
    away = np.abs(setting.q[:, 1] - 0.2)
    bump = err("damaged_teeth", 1e-3, 0.2, 0.3)
    assert np.abs(bump[away > 1.5]).max() < 1e-8
    assert bump[away < 0.05].min(initial=1.0) > 0.98e-3
    assert (np.diff(bump[np.argsort(away)]) <= 0).all()


def test_a_joint_relaxes_anew_after_each_switching_on(err, setting):
    left = err("relaxing_joint", 1e-3, 0.05)
    starts = np.flatnonzero(np.diff(setting.session, prepend=-1))
    assert len(starts) > 1
    np.testing.assert_array_equal(left[starts], 1e-3)
    assert (np.diff(left)[np.diff(setting.session) == 0] < 0).all()


def test_what_changes_with_the_session_is_constant_in_between(setting, body):
    values = np.arange(12.0).reshape(4, 3) * 1e-4
    UNLISTED["remounted_target"].act(body, setting, values)
    np.testing.assert_allclose(body.tool[:, :3, 3], values[setting.session])
    np.testing.assert_array_equal(body.tool[:, :3, :3], np.tile(np.eye(3), (setting.samples, 1, 1)))
    values = UNLISTED["rehomed"].draw(setting, np.random.default_rng(2))
    UNLISTED["rehomed"].act(body, setting, values)
    np.testing.assert_array_equal(body.joints, values[:, setting.session].T)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_loose_nest_falls_the_way_gravity_pulls_and_no_farther_than_its_play(setting, body, axis):
    UNLISTED["loose_nest"].act(body, setting, np.array([[1e-4, axis]]))
    fallen = body.tool[:, :3, 3]
    assert not np.delete(fallen, axis, axis=1).any()
    down = setting.poses[:, :3, :3].transpose(0, 2, 1) @ [0.0, 0.0, -1.0]  # in the tool's frame
    assert ((fallen * down).sum(axis=1) >= 0).all()
    assert np.abs(fallen).max() <= 1e-4


def test_a_platform_is_level_at_first_and_swells_with_the_damp(setting, body):
    damp = replace(setting, extra={"humidity": np.linspace(40.0, 60.0, setting.samples)})
    UNLISTED["damp_platform"].act(body, damp, drawn("damp_platform", damp, 1)[0])
    np.testing.assert_array_equal(body.base[0], np.eye(4))
    angle = np.linalg.norm(body.base[:, :3, :3] - np.eye(3), axis=(1, 2))
    np.testing.assert_allclose(angle / angle[-1], np.linspace(0.0, 1.0, setting.samples), atol=1e-4)


def test_a_bolt_tilts_a_link_across_its_axis_once(setting, body):
    for values in drawn("yielding_bolt", setting, 20, 4):
        k = int(np.flatnonzero(values.any(axis=1))[0])
        assert values[k, 3:6] @ setting.world.chain[k].axis == pytest.approx(0.0, abs=1e-15)
        assert np.linalg.norm(values[k, 3:6]) == pytest.approx(1e-3)
    UNLISTED["yielding_bolt"].act(body, setting, values)
    late = setting.time > values[k, 6] * setting.time[-1]
    np.testing.assert_array_equal(body.placements[:, k].any(axis=1), late)
    np.testing.assert_allclose(body.placements[late, k], np.tile(values[k, :6], (late.sum(), 1)))


@pytest.mark.parametrize("name", UNLISTED)
def test_what_a_cause_follows_is_a_column_that_can_be_asked_for(name, setting):
    fault = UNLISTED[name]
    values, places = fault.draw(setting, np.random.default_rng(3)), fault.places(setting)
    where = [places[p] for p in np.flatnonzero(np.abs(values[:, 0]) > 0)] or places[:1]
    columns = {*setting.world.names, "time", "order", "session", "payload", "speed", "humidity", "motor_temperature"}
    columns |= {"temperature", *(f"temperature.{link}" for link in setting.world.links)}
    columns |= {f"{column}.{joint}" for column in ("approach", "torque", "since_turn") for joint in setting.world.names}
    columns |= {f"gravity.{axis}" for axis in "xyz"}
    said = {part for quantity in fault.quantities(setting, where) for part in quantity.split(" * ")}
    assert said
    # that it follows nothing is an answer
    assert said == {"none"} if name in ("coolant", "crane") else said <= columns
    if fault.few and places[0][0] == "joint":  # frames would hide the first and the last
        assert not values[[0, -1], 0].any()


# ---- effects that change with a condition, and products of two quantities


@pytest.mark.parametrize("name", ["loaded_play", "warm_spring", "warm_gain"])
def test_what_changes_is_at_the_middle_what_the_library_knows(name, err, setting):
    """With the condition steady at its middle only the listed effect is left: linear in what drives that."""
    [(listed, _)] = UNLISTED[name].also
    driver = {"backlash": setting.approach, "joint_compliance": setting.torque, "joint_gain": setting.q}[listed][:, 1]
    left = err(name, 1e-3, 1e-3, payload=steady(setting, 1.0), links=np.full_like(setting.links, 25.0))
    slope = left @ driver / (driver @ driver)
    np.testing.assert_allclose(left, slope * driver, atol=1e-15)
    assert np.sign(slope) == (1.0 if listed == "joint_gain" else -1.0)  # gains add, plays and springs fall short


def test_a_play_opens_with_the_payload_and_never_closes_beyond_nothing(err, setting):
    draws = drawn("loaded_play", setting, 20, 2)
    assert (draws[:, :, :1] + draws[:, :, 1:] * np.array([-1.0, 1.0]) >= 0.0).all()
    late = np.abs(err("loaded_play", 1e-3, 1e-3))[1:]
    payload = setting.payload[1:]
    np.testing.assert_allclose(late[payload == payload.max()], 0.5 * 2e-3)
    np.testing.assert_allclose(late[payload == payload.min()], 0.0, atol=1e-18)


@pytest.mark.parametrize("name", ["hot_under_load", "fast_under_load", "late_hose"])
def test_a_product_is_nothing_where_either_is_at_its_middle(name, err, setting):
    extra = {"motor_temperature": np.linspace(30.0, 50.0, setting.samples)}
    day, middle = replace(setting, extra=extra, speed=np.linspace(0.1, 1.0, setting.samples)), setting.q.copy()
    middle[:, 0] = 0.3
    assert np.abs(err(name, 1e-3, day=day)).max() > 5e-4
    idle = err(name, 1e-3, day=day, payload=steady(setting, 2.0), q=middle)
    np.testing.assert_allclose(idle, 0.0, atol=1e-18)


def test_a_floor_leans_with_the_payload_one_way_early_and_the_other_late(setting, body):
    UNLISTED["sinking_floor"].act(body, setting, np.array([[0.0, 0.0, 0.0, 1e-3, 0.0, 0.0]]))
    lean, when = body.base[:, 2, 1], setting.time / setting.time[-1]  # sine of the turn about x
    heavy = setting.payload == setting.payload.max()
    assert (lean[(when < 0.4) & heavy] < 0).all()
    assert (lean[(when > 0.6) & heavy] > 0).all()


@pytest.mark.parametrize("fault", INTERPLAY, ids=lambda fault: fault.name)
def test_neither_one_listed_effect_nor_two_do_what_they_do(fault, setting, gauge):
    """The trial makes them as large as it likes beyond what any two effects of the library can do."""
    day = replace(setting, extra={"motor_temperature": np.linspace(30.0, 50.0, setting.samples)})
    own = Gauge(day, gauge.rows, gauge.target, True, True)
    moved = own.moved(fault, fault.draw(day, np.random.default_rng(6)))
    beyond = own.beyond(fault, moved, ["backlash", "joint_compliance", "joint_gain"], together=2)
    assert min(beyond.values()) > 0.15 * own.rms(own.left(moved))


def test_right_answers_name_the_condition_or_both_in_either_order(setting):
    before, name = setting.world.names[1:3]
    said = {f.name: set(f.quantities(setting, [("joint", name)])) for f in INTERPLAY if f.few}
    assert said["loaded_play"] == {"payload", f"approach.{name} * payload", f"payload * approach.{name}"}
    assert {"temperature", f"{name} * temperature"} <= said["warm_gain"]
    assert said["late_hose"] == {f"time * {before}", f"{before} * time", f"order * {before}", f"{before} * order"}
    assert said["hot_under_load"] == {"motor_temperature * payload", "payload * motor_temperature"}


# ---- waves of any order, memory, and what nobody records


@pytest.mark.parametrize(("name", "orders"), [("slow_wave", SLOW), ("joint_ripple", (5.0, 200.0))])
def test_a_ripple_comes_back_after_its_period_whatever_its_order(name, orders, err, setting):
    found = drawn(name, setting, 200, 1).max(axis=1)[:, 1]
    assert orders[0] <= found.min()
    assert found.max() <= orders[1]
    # as many below the geometric mean as above: 1e-5 that chance leaves fewer than 70 of 200 on a side
    assert 70 < (found < np.sqrt(orders[0] * orders[1])).sum() < 130
    assert (np.abs(found - np.round(found)) > 1e-9).all()
    once, again = (err(name, 1e-3, 17.3, 0.4, q=setting.q + k * 2 * np.pi / 17.3) for k in (0, 1))
    np.testing.assert_allclose(once, again, atol=1e-15)
    assert np.abs(once).max() == pytest.approx(1e-3, rel=0.02)


def test_an_element_follows_until_it_slips_and_forgets_small_excursions():
    """Out by 3, back by 1: strained to its limit, then released by what it came back, over the limit of 2."""
    chain = np.array([0, 0, 1, 2, 3])
    strained = slipped(np.array([0.0, 1.0, 3.0, 2.0, -4.0]), chain, np.array([2.0]))[:, 0]
    np.testing.assert_allclose(strained, [0.0, 0.5, 1.0, 0.5, -1.0])
    # two ways of arrival that end with the same move are told apart
    slips = np.array([0.5, 2.0])
    one, other = (slipped(np.array([0.0, out, 1.0, 1.4]), chain[:4], slips)[-1] for out in (3.0, -3.0))
    assert one.sum() != pytest.approx(other.sum(), abs=0.1)
    # closed loops of the moves close in the force (Madelung)
    loop = slipped(np.array([0.0, 3.0, 2.6, 3.0]), chain[:4], slips)
    np.testing.assert_allclose(loop[3], loop[1], atol=1e-15)
    # what is measured and what is to be predicted have each their own past
    q = np.array([0.0, 5.0, 1.0, -5.0])
    both = slipped(q, np.array([0, 1, 0, 1]), slips)
    np.testing.assert_array_equal(both[[0, 2]], slipped(q[[0, 2]], np.array([0, 0]), slips))


def test_a_winding_holds_back_and_only_its_joint(setting, err):
    drawn_ = drawn("winding", setting, 1, 3)[0]
    j = int(np.flatnonzero(drawn_[:, 0])[0])
    values, moved = drawn_[j], err("winding", *drawn_[j], joint=j)
    assert np.abs(moved).max() <= abs(values[0]) * (1 + 1e-12)
    held = -np.sign(values[0]) * moved
    assert (held * np.diff(setting.q[:, j], prepend=setting.q[0, j])).sum() > 0


def test_what_nobody_records_is_of_size_one_and_forgets_itself(setting):
    states = np.array([wandered(setting, 1.0, seed) for seed in range(400)])
    # standard deviations of 400 draws are sure to 3.5 %, correlations to 5 %, one sigma
    np.testing.assert_allclose(states.std(axis=0), 1.0, atol=0.16)
    row = setting.time[-1] / setting.samples
    far = np.searchsorted(setting.time, setting.time[0] + 6 * row)
    assert abs(np.mean(states[:, 0] * states[:, far])) < 0.2
    np.testing.assert_array_equal(wandered(setting, 1.0, 7.0), states[7])
