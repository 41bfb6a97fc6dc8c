"""Quasi-static contact with friction: a gantry of three springs, whose tool's Jacobian is the unit matrix."""

import numpy as np
import pytest

from thermal_robot.motion.contact import contact_yields

UP, SOFT = np.array([0.0, 0.0, 1.0]), np.array([1e-3, 2e-3, 5e-4])


def pressed(path, deep, friction, soft=SOFT, flex=0.0):
    """Loads (n, 3) of a gantry on a path (n, 3) whose tool is pressed ``deep`` (n,) into a floor, and derivatives."""
    first = np.arange(len(path)) == 0
    tool = np.broadcast_to(np.eye(3), (len(path), 3, 3))
    force = deep / (soft[2] + flex)
    return [one / soft for one in contact_yields(path, tool, UP, force, first, soft, friction, flex)]


def test_a_floor_pushes_as_the_spring_above_it_and_drags_by_coulombs_law():
    path, deep = np.zeros((200, 3)), np.full(200, 4e-3)
    path[:, 0] = np.linspace(0.0, 0.1, 200)
    load, *_ = pressed(path, deep, 0.3)
    np.testing.assert_allclose(load[:, 2], -4e-3 / SOFT[2])
    drag = 0.3 * 4e-3 / SOFT[2]
    np.testing.assert_allclose(load[:, 0], np.minimum(path[:, 0] / SOFT[0], drag), rtol=1e-6)
    np.testing.assert_allclose(load[:, 1], 0.0, atol=1e-9)


def test_friction_turns_with_the_motion_and_is_never_more_than_its_circle():
    angle = np.linspace(0.0, 4.0 * np.pi, 4000)
    path = 0.05 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])
    load, *_ = pressed(path, np.full(len(angle), 2e-3), 0.4, soft=np.full(3, 1e-4))
    most = 0.4 * 2e-3 / 1e-4
    assert np.hypot(*load[:, :2].T).max() <= most * (1.0 + 1e-9)
    along = np.gradient(path[:, :2], axis=0)
    power = (load[2000:, :2] * along[2000:]).sum(axis=1) / np.linalg.norm(along[2000:], axis=1)
    np.testing.assert_allclose(power, most, rtol=0.02)  # it brakes with all that it has


def test_a_path_that_comes_back_leaves_work_behind():
    turn = np.concatenate([np.linspace(0.0, 0.02, 500), np.linspace(0.02, 0.0, 500)] * 2)
    path = np.column_stack([turn, 0.0 * turn, 0.0 * turn])
    load, *_ = pressed(path, np.full(len(turn), 1e-3), 0.5)
    work = float(np.sum(0.5 * (load[1001:, 0] + load[1000:-1, 0]) * np.diff(path[1000:, 0])))
    force = 0.5 * 1e-3 / SOFT[2]
    slid = 2.0 * (0.02 - 2.0 * force * SOFT[0])  # twice it turns, and springs back from one side to the other
    assert work == pytest.approx(force * slid, rel=0.02)


def test_what_friction_would_do_is_told_where_there_is_none():
    path = np.linspace(0.0, 0.1, 50)[:, None] * [0.6, 0.8, 0.0]
    _, _, by_friction, _ = pressed(path, np.full(50, 2e-3), 0.0)
    np.testing.assert_allclose(np.hypot(*by_friction[1:, :2].T), 2e-3 / SOFT[2], rtol=1e-9)
    rougher = pressed(path, np.full(50, 2e-3), 1e-6)[0]
    np.testing.assert_allclose(1e-6 * by_friction[1:, :2], rougher[1:, :2], rtol=0.05)


def test_derivatives_are_those_of_the_loads():
    rng = np.random.default_rng(0)
    path = np.cumsum(rng.normal(scale=2e-3, size=(300, 3)), axis=0) * [1.0, 1.0, 0.0]
    deep, step = 2e-3 + 1e-3 * np.sin(np.arange(300) / 20.0), 1e-7
    load, by_height, by_friction, by_flex = pressed(path, deep, 0.3, flex=2e-4)
    higher, rougher = pressed(path, deep + step, 0.3, flex=2e-4)[0], pressed(path, deep, 0.3 + step, flex=2e-4)[0]
    softer = pressed(path, deep, 0.3, flex=2e-4 + step)[0]
    sliding = np.hypot(*load[:, :2].T) > 0.999 * 0.3 * deep / (SOFT[2] + 2e-4)
    assert 0.3 < sliding.mean() < 0.999
    for found, other in ((by_height, higher), (by_friction, rougher), (by_flex, softer)):
        told = (other - load) / step
        scale = np.abs(told).max()
        assert np.sqrt(np.mean((found - told)[sliding] ** 2)) < 0.2 * scale
