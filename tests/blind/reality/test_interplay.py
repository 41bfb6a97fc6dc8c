"""Effects that change with a condition, and products of two quantities."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.sizes import Gauge
from thermal_robot.blind.reality.unlisted import INTERPLAY, deviation

BY_NAME: dict[str, Fault] = {fault.name: fault for fault in INTERPLAY}


def day_of(setting, **changed):
    extra = {"motor_temperature": np.linspace(30.0, 50.0, setting.samples)}
    return replace(setting, extra={**extra, **changed.pop("extra", {})}, **changed)


def err(name, day, *numbers):
    """(N,) by how much the third joint errs."""
    values = np.zeros((6, len(numbers)))
    values[2] = numbers
    body = day.world.sound(day.samples)
    BY_NAME[name].act(body, day, values)
    assert not np.delete(body.joints, 2, axis=1).any()
    return body.joints[:, 2]


def test_a_deviation_runs_from_end_to_end_and_what_stands_still_has_none():
    np.testing.assert_allclose(deviation(np.array([2.0, 3.0, 6.0])), [-1.0, -0.5, 1.0])
    np.testing.assert_array_equal(deviation(np.full(4, 7.0)), 0.0)


@pytest.mark.parametrize("name", ["loaded_play", "warm_spring", "warm_gain"])
def test_what_changes_is_at_the_middle_what_the_library_knows(name, setting):
    """With the condition steady at its middle only the listed effect is left: linear in what drives that."""
    [(listed, _)] = BY_NAME[name].also
    driver = {"backlash": setting.approach, "joint_compliance": setting.torque, "joint_gain": setting.q}[listed][:, 2]
    steady = replace(setting, payload=np.ones(setting.samples), links=np.full_like(setting.links, 25.0))
    left = err(name, steady, 1e-3, 1e-3)
    slope = left @ driver / (driver @ driver)
    np.testing.assert_allclose(left, slope * driver, atol=1e-15)
    assert np.sign(slope) == (1.0 if listed == "joint_gain" else -1.0)  # gains add, plays and springs fall short


def test_a_play_opens_with_the_payload_and_never_closes_beyond_nothing(setting):
    rng = np.random.default_rng(2)
    for _ in range(20):
        values = BY_NAME["loaded_play"].draw(setting, rng)
        play = values[:, :1] + values[:, 1:] * np.array([-1.0, 1.0])
        assert (play >= 0.0).all()
    late = np.abs(err("loaded_play", setting, 1e-3, 1e-3))[1:]
    heavy = setting.payload[1:] == setting.payload.max()
    empty = setting.payload[1:] == setting.payload.min()
    np.testing.assert_allclose(late[heavy], 1e-3)
    np.testing.assert_allclose(late[empty], 0.0, atol=1e-18)


@pytest.mark.parametrize("name", ["hot_under_load", "fast_under_load", "late_hose"])
def test_a_product_is_nothing_where_either_is_at_its_middle(name, setting):
    day = day_of(setting, speed=np.linspace(0.1, 1.0, setting.samples))
    middle = setting.q.copy()
    middle[:, 1] = 0.3
    idle = replace(day, payload=np.full(setting.samples, 2.0), q=middle)
    assert np.abs(err(name, day, 1e-3)).max() > 5e-4
    np.testing.assert_allclose(err(name, idle, 1e-3), 0.0, atol=1e-18)


def test_a_floor_leans_with_the_payload_one_way_early_and_the_other_late(setting, body):
    twist = np.array([[0.0, 0.0, 0.0, 1e-3, 0.0, 0.0]])
    BY_NAME["sinking_floor"].act(body, setting, twist)
    lean = body.base[:, 2, 1]  # sine of the turn about x
    early = setting.time < 0.4 * setting.time[-1]
    late = setting.time > 0.6 * setting.time[-1]
    heavy = setting.payload == setting.payload.max()
    assert (lean[early & heavy] < 0).all()
    assert (lean[late & heavy] > 0).all()


@pytest.mark.parametrize("name", BY_NAME)
def test_neither_one_listed_effect_nor_two_do_what_they_do(name, setting, gauge):
    """The trial makes them as large as it likes beyond what any two effects of the library can do."""
    day = day_of(setting)
    own = Gauge(day, gauge.rows, gauge.target, True, True)
    fault = BY_NAME[name]
    values = fault.draw(day, np.random.default_rng(6))
    left = own.rms(own.left(own.moved(fault, values)))
    beyond = own.beyond(fault, own.moved(fault, values), ["backlash", "joint_compliance", "joint_gain"], together=2)
    assert min(beyond.values()) > 0.15 * left


def test_right_answers_name_the_condition_or_both_in_either_order(setting):
    joint = [("joint", setting.world.names[2])]
    name, before = setting.world.names[2], setting.world.names[1]
    said = {fault: set(BY_NAME[fault].quantities(setting, joint)) for fault in BY_NAME if fault != "sinking_floor"}
    assert said["loaded_play"] == {"payload", f"approach.{name} * payload", f"payload * approach.{name}"}
    assert {"temperature", f"{name} * temperature"} <= said["warm_gain"]
    assert said["late_hose"] == {f"time * {before}", f"{before} * time", f"order * {before}", f"{before} * order"}
    assert said["hot_under_load"] == {"motor_temperature * payload", "payload * motor_temperature"}
