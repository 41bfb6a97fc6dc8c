"""Slopes of a sound robot, against small faults of the whole one."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality.world import from_vector, slopes

SMALL = 1e-6
TARGET = np.array([0.03, -0.02, 0.11])


@pytest.fixture(scope="module")
def linear(setting):
    return slopes(setting.world, setting.q, setting.payload, TARGET)


def exact(setting, body):
    poses, _ = setting.world.poses(setting.q, setting.payload, body)
    poses = body.base @ poses @ body.tool
    return (poses[:, :3, :3] @ TARGET + poses[:, :3, 3]) * (1.0 + body.scale)


def spoilt(body, name, rng):
    """The body with one kind of small error."""
    if name == "move":
        twists = SMALL * rng.normal(size=(2, len(body.joints), 6))
        return replace(body, base=from_vector(twists[0]), tool=from_vector(twists[1]), scale=SMALL)
    values = getattr(body, name)
    size = 1e-9 if name in ("springs", "beams") else SMALL
    return replace(body, **{name: size * rng.uniform(0.5, 1.0, values.shape)})


@pytest.mark.parametrize("name", ["joints", "springs", "beams", "bow", "growth", "placements", "move"])
def test_a_small_error_moves_the_target_by_its_slope(linear, setting, body, name):
    sound = exact(setting, setting.world.sound(setting.samples))
    wrong = spoilt(body, name, np.random.default_rng(5))
    moved = exact(setting, wrong) - sound
    assert np.abs(moved).max() > 1e-8
    np.testing.assert_allclose(linear.place(wrong) - sound, moved, atol=2e-4 * np.abs(moved).max())


def test_placements_that_come_and_go_count_in_their_rows(linear, setting, body):
    late = np.arange(setting.samples) > 40
    one = SMALL * np.ones((len(setting.world.chain), 6))
    always = linear.place(replace(body, placements=one))
    sometimes = linear.place(replace(body, placements=late[:, None, None] * one))
    np.testing.assert_allclose(sometimes[late], always[late], atol=1e-15)
    np.testing.assert_allclose(sometimes[~late], linear.place(body)[~late], atol=1e-15)


def test_torque_is_that_of_the_robot(linear, setting):
    np.testing.assert_allclose(linear.torque, setting.torque, atol=1e-9)
    np.testing.assert_allclose(linear.poses, setting.poses, atol=1e-12)
