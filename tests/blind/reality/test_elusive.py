"""Waves of any order, memory, new zeros, and what nobody records."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.reality.fault import FAULTS, Fault
from thermal_robot.blind.reality.unlisted import ELUSIVE, SLOW, slipped, wandered

BY_NAME: dict[str, Fault] = {**FAULTS, **{fault.name: fault for fault in ELUSIVE}}


@pytest.mark.parametrize(("name", "orders"), [("slow_wave", SLOW), ("joint_ripple", (5.0, 200.0))])
def test_a_ripple_comes_back_after_its_period_whatever_its_order(name, orders, setting):
    rng = np.random.default_rng(1)
    drawn = np.array([BY_NAME[name].draw(setting, rng).max(axis=0)[1] for _ in range(200)])
    assert orders[0] <= drawn.min()
    assert drawn.max() <= orders[1]
    # as many below the geometric mean as above: 1e-5 that chance leaves fewer than 70 of 200 on a side
    assert 70 < (drawn < np.sqrt(orders[0] * orders[1])).sum() < 130
    assert (np.abs(drawn - np.round(drawn)) > 1e-9).all()
    values = np.zeros((6, 3))
    values[3] = 1e-3, 17.3, 0.4
    once, again = setting.world.sound(setting.samples), setting.world.sound(setting.samples)
    BY_NAME[name].act(once, setting, values)
    BY_NAME[name].act(again, replace(setting, q=setting.q + 2 * np.pi / 17.3), values)
    np.testing.assert_allclose(once.joints, again.joints, atol=1e-15)
    assert np.abs(once.joints).max() == pytest.approx(1e-3, rel=0.02)


def test_an_element_follows_until_it_slips_and_back():
    """Out by 3, back by 1: strained to its limit, then released by what it came back, over the limit of 2."""
    q = np.array([0.0, 1.0, 3.0, 2.0, -4.0])
    strained = slipped(q, np.array([0, 0, 1, 2, 3]), np.array([2.0]))[:, 0]
    np.testing.assert_allclose(strained, [0.0, 0.5, 1.0, 0.5, -1.0])


def test_a_memory_tells_two_ways_of_arrival_apart_that_end_with_the_same_move():
    slips = np.array([0.5, 2.0])
    one = slipped(np.array([0.0, 3.0, 1.0, 1.4]), np.array([0, 0, 1, 2]), slips)[-1]
    other = slipped(np.array([0.0, -3.0, 1.0, 1.4]), np.array([0, 0, 1, 2]), slips)[-1]
    assert one @ [1, 1] != pytest.approx(other @ [1, 1], abs=0.1)
    # closed loops of the moves close in the force (Madelung): the small excursion is forgotten
    loop = slipped(np.array([0.0, 3.0, 2.6, 3.0]), np.array([0, 0, 1, 2]), slips)
    np.testing.assert_allclose(loop[3], loop[1], atol=1e-15)


def test_what_is_measured_and_what_is_to_be_predicted_have_each_their_own_past():
    q = np.array([0.0, 5.0, 1.0, -5.0])
    alone = slipped(q[[0, 2]], np.array([0, 0]), np.array([0.7]))
    both = slipped(q, np.array([0, 1, 0, 1]), np.array([0.7]))
    np.testing.assert_array_equal(both[[0, 2]], alone)


def test_a_winding_holds_back_and_only_its_joint(setting, body):
    values = BY_NAME["winding"].draw(setting, np.random.default_rng(3))
    j = int(np.flatnonzero(values[:, 0])[0])
    BY_NAME["winding"].act(body, setting, values)
    assert not np.delete(body.joints, j, axis=1).any()
    assert np.abs(body.joints).max() <= abs(values[j, 0]) * (1 + 1e-12)
    held = -np.sign(values[j, 0]) * body.joints[:, j]
    assert (held * np.diff(setting.q[:, j], prepend=setting.q[0, j])).sum() > 0


def test_a_joint_finds_a_zero_for_each_session(setting, body):
    values = BY_NAME["rehomed"].draw(setting, np.random.default_rng(2))
    BY_NAME["rehomed"].act(body, setting, values)
    j = int(np.flatnonzero(values[:, 0])[0])
    for session in np.unique(setting.session):
        np.testing.assert_array_equal(body.joints[setting.session == session, j], values[j, session])


def test_what_nobody_records_is_of_size_one_and_forgets_itself(setting):
    states = np.array([wandered(setting, 1.0, seed) for seed in range(400)])
    np.testing.assert_allclose(states.std(axis=0), 1.0, atol=0.2)
    row = setting.time[-1] / setting.samples
    far = np.searchsorted(setting.time, setting.time[0] + 6 * row)
    assert abs(np.mean(states[:, 0] * states[:, far])) < 0.2
    np.testing.assert_array_equal(wandered(setting, 1.0, 7.0), states[7])


def test_that_it_follows_nothing_is_an_answer(setting):
    for name in ("coolant", "crane"):
        assert BY_NAME[name].quantities(setting, [("base", "base")]) == ("none",)
