"""Causes that no library knows: when they act, where, and how they grow."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality import FAULTS, UNLISTED
from thermal_robot.effects import library


@pytest.fixture
def err(setting):
    """(N,) by how much the second joint errs."""

    def of(name, *numbers, day=setting):
        values = np.zeros((6, len(numbers)))
        values[1] = numbers
        body = day.world.sound(day.samples)
        UNLISTED[name].act(body, day, values)
        assert not np.delete(body.joints, 1, axis=1).any()
        return body.joints[:, 1]

    return of


def test_they_are_in_no_library():
    assert not set(library()) & set(UNLISTED)
    assert not set(FAULTS) & set(UNLISTED)
    assert len(UNLISTED) == 11 + 7 + 5


def test_a_belt_slips_once_and_stays(err, setting):
    jumped = err("slip", 1e-3, 0.4)
    np.testing.assert_array_equal(jumped, np.where(setting.time > 0.4 * setting.time[-1], 1e-3, 0.0))
    assert set(jumped) == {0.0, 1e-3}


def test_a_cable_is_slack_and_then_pulls_back(err, setting):
    q = setting.q[:, 1]
    taut = float(np.median(q))
    pulled = err("cable_pull", 1e-3, taut)
    assert not pulled[q <= taut].any()
    order = np.argsort(q)
    assert (np.diff(pulled[order]) <= 0).all()
    assert pulled.min() == pytest.approx(-1e-3 * (q.max() - taut))


def test_a_hose_is_moved_by_the_joint_before(err, setting):
    q = setting.q[:, 0]
    pushed = err("hose", 1e-3, 0.3)
    assert (pushed >= 0).all()
    mirrored = setting.q.copy()
    mirrored[:, 0] = 0.6 - q  # as far on the other side of where the hose is straight
    np.testing.assert_allclose(err("hose", 1e-3, 0.3, day=replace(setting, q=mirrored)), pushed, atol=1e-15)
    assert UNLISTED["hose"].quantities(setting, [("joint", setting.world.names[1])]) == [setting.world.names[0]]


def test_a_hot_motor_leans_with_the_square_of_its_heat(err, setting):
    warm, hot = (replace(setting, extra={"motor_temperature": np.full(setting.samples, t)}) for t in (30.0, 40.0))
    np.testing.assert_allclose(err("hot_motor", 1e-3, day=hot), 4.0 * err("hot_motor", 1e-3, day=warm))


def test_a_damaged_tooth_errs_only_where_it_is(err, setting):
    q = setting.q[:, 1]
    bump = err("damaged_teeth", 1e-3, 0.2, 0.3)
    assert np.abs(bump[np.abs(q - 0.2) > 1.5]).max() < 1e-8
    assert bump[np.abs(q - 0.2) < 0.05].min(initial=1.0) > 0.98e-3
    order = np.argsort(np.abs(q - 0.2))
    assert (np.diff(bump[order]) <= 0).all()


def test_an_axis_droops_four_times_as_far_at_twice_the_speed(err, setting):
    slow, fast = (replace(setting, speed=np.full(setting.samples, s)) for s in (0.3, 0.6))
    np.testing.assert_allclose(err("speed_droop", 1e-3, day=fast), 4.0 * err("speed_droop", 1e-3, day=slow))


def test_a_joint_relaxes_anew_after_each_switching_on(err, setting):
    left = err("relaxing_joint", 1e-3, 0.05)
    starts = np.flatnonzero(np.diff(setting.session, prepend=-1))
    assert len(starts) > 1
    np.testing.assert_array_equal(left[starts], 1e-3)
    within = np.diff(setting.session) == 0
    assert (np.diff(left)[within] < 0).all()


def test_a_remounted_target_is_constant_between_sessions(setting, body):
    values = np.arange(12.0).reshape(4, 3) * 1e-4
    UNLISTED["remounted_target"].act(body, setting, values)
    np.testing.assert_allclose(body.tool[:, :3, 3], values[setting.session])
    np.testing.assert_array_equal(body.tool[:, :3, :3], np.tile(np.eye(3), (setting.samples, 1, 1)))


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
    tilt = UNLISTED["damp_platform"].draw(damp, np.random.default_rng(1))
    UNLISTED["damp_platform"].act(body, damp, tilt)
    np.testing.assert_array_equal(body.base[0], np.eye(4))
    turned = body.base[:, :3, :3]
    angle = np.linalg.norm(turned - np.eye(3), axis=(1, 2))
    np.testing.assert_allclose(angle / angle[-1], np.linspace(0.0, 1.0, setting.samples), atol=1e-4)


def test_a_bolt_tilts_a_link_across_its_axis_once(setting, body):
    rng = np.random.default_rng(4)
    for _ in range(20):
        values = UNLISTED["yielding_bolt"].draw(setting, rng)
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
    values = fault.draw(setting, np.random.default_rng(3))
    places = fault.places(setting)
    where = [places[p] for p in np.flatnonzero(np.abs(values[:, 0]) > 0)] or places[:1]
    columns = {*setting.world.names, "time", "order", "session", "payload", "speed", "humidity", "motor_temperature"}
    columns |= {"temperature", *(f"temperature.{link}" for link in setting.world.links)}
    columns |= {f"{column}.{joint}" for column in ("approach", "torque", "since_turn") for joint in setting.world.names}
    derived = {f"gravity.{axis}" for axis in "xyz"}
    said = {part for quantity in fault.quantities(setting, where) for part in quantity.split(" * ")}
    assert said
    assert said <= columns | derived or said == {"none"}
    if fault.few and places[0][0] == "joint":  # frames would hide the first and the last
        assert not values[[0, -1], 0].any()
