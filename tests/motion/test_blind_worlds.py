"""Worlds of the trial of motions: statics and invariants of drawn arms and their faults; what counts as named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers import some

from thermal_robot.blind.motions import sizes
from thermal_robot.blind.motions.fault import EVERYTHING, FAULTS, NOTHING, Fault, draw_fault
from thermal_robot.blind.motions.trial import Answer, Case, ask, plan, table, text
from thermal_robot.blind.motions.world import MOVES, draw_log, draw_world
from thermal_robot.kinematics.gravity import gravity_torques
from thermal_robot.robot import load_robot

pytest.importorskip("mujoco", reason="worlds are simulated by MuJoCo")


def a_world(joints=3, motions=2, seed=5, rows=150):
    world = draw_world(np.random.default_rng(seed), joints, motions)
    return replace(world, commands=world.commands[:, :rows], step=1e-3)


def still(world):
    """The arm at rest for three seconds, at the place where its first motion begins."""
    first = world.commands[:1, :1]
    return replace(world, commands=np.repeat(first, round(3 * world.rate), axis=1), kinds=("rest",))


def last(world, fault=NOTHING, **of):
    found = world.simulated(Fault(fault, **of) if isinstance(fault, str) else fault)
    return found.position[-1], found.torque[-1], found.height[-1]


@pytest.mark.parametrize("joints", [2, 4, 7])
def test_an_arm_at_rest_is_held_against_gravity_by_its_servos(joints):
    world = still(a_world(joints))
    position, torque, _ = last(world)
    robot = load_robot(world.arm.urdf, "tool")
    np.testing.assert_allclose(torque, gravity_torques(robot, position[None])[0], atol=2e-4)
    kp = np.array([servo.kp for servo in world.arm.servos.values()])
    np.testing.assert_allclose(kp * (world.commands[0, 0] - position), torque, atol=1e-4)


def test_a_delay_shifts_what_an_arm_does():
    world = a_world()
    late = 4
    sound, found = world.simulated(Fault(NOTHING)), world.simulated(Fault("delay", size=late / world.rate))
    rows = world.commands.shape[1]
    np.testing.assert_allclose(found.position[late:rows], sound.position[: rows - late], atol=1e-6)


def test_a_zero_is_a_shift_of_the_command_and_a_gain_a_stretch():
    world = a_world()
    shifted, stretched = world.commands.copy(), world.commands.copy()
    shifted[:, :, 1] += 0.03
    stretched[:, :, 1] *= 1.02
    for fault, commands in ((Fault("zero", 1, 0.03), shifted), (Fault("gain", 1, 0.02), stretched)):
        same = replace(world, commands=commands).simulated(Fault(NOTHING)).position
        start = np.abs(same - world.simulated(fault).position)
        np.testing.assert_allclose(start, 0.0, atol=2e-4)  # it settles from another place


def test_statics_of_payload_stiffness_and_dead_zone():
    world = still(a_world(3, seed=11))
    position, torque, _ = last(world)
    kp = np.array([servo.kp for servo in world.arm.servos.values()])
    robot = load_robot(world.arm.urdf, "tool")
    loaded, held, _ = last(world, "payload", size=0.1)
    np.testing.assert_allclose(held, gravity_torques(robot, loaded[None], payload=0.1)[0], atol=3e-4)
    stiff, pulled, _ = last(world, "kp", joint=1, size=0.5)
    assert 1.5 * kp[1] * (world.commands[0, 0, 1] - stiff[1]) == pytest.approx(pulled[1], abs=2e-4)
    dead, _, _ = last(world, "dead zone", joint=1, size=5e-3)
    sign = np.sign(torque[1])
    assert sign * (position[1] - dead[1]) == pytest.approx(5e-3, abs=5e-4)


def test_stops_limits_and_tables_hold():
    world = a_world(3, 3, seed=8)
    sound = world.simulated(Fault(NOTHING))
    stop = float(np.quantile(sound.position[:, 1], 0.8))
    found = world.simulated(Fault("end stop", 1, stop, 1.0)).position[:, 1]
    assert sound.position[:, 1].max() > stop + 0.02
    assert found.max() < stop + 0.02  # MuJoCo's stops are soft
    most = 0.5 * float(np.abs(sound.torque[:, 1]).max())
    assert np.abs(world.simulated(Fault("torque limit", 1, most)).torque[:, 1]).max() == pytest.approx(most)
    table_ = float(np.quantile(sound.height, 0.3))
    assert sound.height.min() < table_ - 0.01
    assert world.simulated(Fault("table", size=table_)).height.min() > table_ - 0.01


@pytest.mark.parametrize("name", ["armature", "viscous", "coulomb"])
def test_drag_and_inertia_leave_the_place_of_rest_but_for_sticking(name):
    world = still(a_world(2))
    kp = next(iter(world.arm.servos.values())).kp
    size = 0.01 * kp
    before, after = last(world)[0], last(world, name, joint=0, size=size)[0]
    assert abs(after - before)[0] < (size / kp if name == "coulomb" else 2e-4)


@pytest.mark.parametrize("name", some(EVERYTHING, 5))
def test_every_fault_is_drawn_moves_an_encoder_and_comes_again(name):
    world = a_world(3, 4, seed=21, rows=250)
    log, fault = draw_log(np.random.default_rng(4), world, name)
    again, same = draw_log(np.random.default_rng(4), world, name)
    assert fault.name == name
    assert (fault.size, fault.joint) == (same.size, same.joint)
    sound = world.log(world.simulated(Fault(NOTHING)))
    moved = 0.0
    for one, other, before in zip(log.motions, again.motions, sound.motions, strict=True):
        np.testing.assert_array_equal(one.position.values, other.position.values)
        counts = one.position.values / world.count
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        moved = max(moved, float(np.abs(one.position.values - before.position.values).max()))
    assert (moved >= world.count) == (name != NOTHING)


def test_sizes_that_are_asked_for_grow():
    world = a_world(2)
    sound = world.simulated(Fault(NOTHING))
    one, more = (draw_fault(np.random.default_rng(1), "coulomb", world.arm, sound, by) for by in (1.0, 2.0))
    assert more.size == pytest.approx(2.0 * one.size)


def test_commands_of_every_kind_stay_within_reach_and_begin_at_their_place():
    time = np.arange(0.0, 8.0, 0.01)
    for kind, move in MOVES.items():
        found = np.array([move(np.random.default_rng(seed), time) for seed in range(20)])
        assert np.abs(found).max() < sizes.CENTRE + 1.5 * sizes.REACH, kind
        if kind != "steps":
            assert np.abs(np.diff(found)).max() < 0.1, kind


def test_what_counts_as_named_first_and_silent():
    told = {"verdict": ("gain", "kp"), "groups": ((), ("payload",)), "places": (("a",), ("b",)), "joint": "b"}
    payload, kp = (Answer(Case(fault, 1), **told) for fault in ("payload", "kp"))
    assert (payload.named, payload.first, payload.placed) == (True, False, False)
    assert (kp.named, kp.first, kp.placed) == (True, False, True)
    assert not Answer(Case(NOTHING, 1), **told).named
    assert Answer(Case(NOTHING, 1)).named
    loose = Answer(Case("delay", 1, stated=False), verdict=("lag", "delay"), groups=((), ()), places=((), ()))
    assert loose.first
    assert loose.alone
    rows = table([payload, kp, Answer(Case(NOTHING, 1)), Answer(Case("zero", 1), failure="unseen")])
    assert [(row["fault"], row["named"]) for row in rows] == [("payload", 1.0), ("kp", 1.0), (NOTHING, 1.0)]
    assert "nothing: silent 100%" in text([Answer(Case(NOTHING, 1))])


def test_a_plan_asks_every_fault_of_arms_of_all_sizes():
    cases = plan(3, 6)
    assert {case.fault for case in cases} == set(EVERYTHING)
    assert {case.joints for case in cases} == {2, 3, 4, 5, 6, 7}
    assert set(FAULTS) < set(EVERYTHING)


@pytest.mark.slow
def test_a_delay_is_named():
    found = ask(Case("delay", 2, joints=2, motions=8))
    assert found.failure == ""
    assert found.named
    assert found.first
