"""Pinocchio called for each configuration: what is kept between calls must not show."""

import threading
from dataclasses import replace

import numpy as np
import pytest
import reference

from thermal_robot import kinematics as kin
from thermal_robot.kinematics import thin

ROWS = 20


def test_a_point_is_forgotten_after_its_call(rv_m2, configurations):
    q = configurations(rv_m2, ROWS)
    before = kin.frame_jacobians(rv_m2, q), kin.placement_sensitivities(rv_m2, q), kin.tool_poses(rv_m2, q)
    kin.frame_jacobians(rv_m2, q, point=(0.3, 0.2, 0.1))
    kin.placement_sensitivities(rv_m2, q, point=(0.3, 0.2, 0.1))
    kin.gravity_torques(rv_m2, q, payload=2.0, payload_com=(0.3, 0.2, 0.1))
    after = kin.frame_jacobians(rv_m2, q), kin.placement_sensitivities(rv_m2, q), kin.tool_poses(rv_m2, q)
    for old, new in zip(before, after, strict=True):
        np.testing.assert_array_equal(new, old)


def test_each_robot_is_held_against_its_own_gravity(rv_m2, configurations):
    """Robots of one chain share the model; gravity is theirs."""
    q = configurations(rv_m2, ROWS)
    floating = replace(rv_m2, gravity=np.zeros(3))
    on_the_wall = replace(rv_m2, gravity=np.array([9.81, 0.0, 0.0]))
    down = kin.gravity_torques(rv_m2, q)
    assert np.all(kin.gravity_torques(floating, q) == 0.0)
    assert np.abs(kin.gravity_torques(on_the_wall, q) - down).max() > 1.0
    np.testing.assert_array_equal(kin.gravity_torques(rv_m2, q), down)


def test_results_are_the_callers(rv_m2, configurations):
    q = configurations(rv_m2, 2)
    first = kin.tool_poses(rv_m2, q[:1])
    copy = first.copy()
    kin.tool_poses(rv_m2, q[1:])
    np.testing.assert_array_equal(first, copy)


def test_threads_do_not_disturb_each_other(awkward, configurations):
    q = [configurations(awkward, 40, seed=seed) for seed in range(4)]
    expected = [reference.frame_jacobians(awkward, rows) for rows in q]
    wrong = []

    def work(rows, right):
        for _ in range(50):
            wrong.append(np.abs(kin.frame_jacobians(awkward, rows) - right).max())

    threads = [threading.Thread(target=work, args=pair) for pair in zip(q, expected, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(wrong) == 200
    assert max(wrong) < 1e-12


@pytest.mark.parametrize("rows", [1, 5])
def test_configurations_may_lie_in_memory_as_they_like(awkward, configurations, rows):
    q = configurations(awkward, rows)
    spread = np.full((2 * rows, 2 * awkward.n), np.nan)
    spread[::2, ::2] = q
    out = np.empty((rows, 4, 4))
    thin.poses(awkward, spread[::2, ::2], out)
    np.testing.assert_allclose(out, reference.tool_poses(awkward, q), rtol=0.0, atol=1e-12)
