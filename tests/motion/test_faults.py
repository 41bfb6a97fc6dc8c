"""Faults of a log: each is found by itself with its size, undone, and nothing else is told; a sound log has none."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from helpers import some
from motion.arms import JOINTS, STEP, log, tables

from thermal_robot.motion import Channel, find_faults, read_motion
from thermal_robot.motion.clocks import reclocked
from thermal_robot.motion.description import text

Q = [f"q.{joint}" for joint in JOINTS]
QD = [f"qd.{joint}" for joint in JOINTS]


def told(state, command):
    found = find_faults(log(state, command))
    return found, [(fault.what, fault.joint) for fault in found.faults]


@pytest.mark.parametrize(("motions", "seed"), some(product((3, 1, 10), (1, 2, 3)), 9))
def test_a_sound_log_has_no_fault_and_stays_as_it_is(motions, seed):
    whole = log(*tables(motions, seed=seed))
    found = find_faults(whole)
    assert found.faults == ()
    assert found.joints == JOINTS
    assert all(a.position is b.position or np.array_equal(a.position.values, b.position.values)
               for a, b in zip(found.log.motions, whole.motions, strict=True))  # fmt: skip


@pytest.mark.parametrize("along", [True, False])
@pytest.mark.parametrize("order", [[1, 0, 2, 3, 4], [1, 2, 0, 3, 4]])
def test_exchanged_joints_are_found_and_put_back(order, along):
    state, command = tables()
    sound = log(state, command)
    state[Q] = state[[Q[k] for k in order]].to_numpy()
    if along:
        state[QD] = state[[QD[k] for k in order]].to_numpy()
    found, said = told(state, command)
    assert said == [("swap", JOINTS[j]) for j, k in enumerate(order) if j != k]
    for one, other in zip(found.log.motions, sound.motions, strict=True):
        np.testing.assert_allclose(one.position.values, other.position.values)
        np.testing.assert_allclose(one.velocity.values, other.velocity.values)


@pytest.mark.parametrize("along", [True, False])
def test_a_joint_that_is_turned_round_is_turned_back(along):
    state, command = tables()
    sound = log(state, command)
    state[[Q[2], *([QD[2]] if along else [])]] *= -1.0
    found, said = told(state, command)
    assert said == [("sign", "joint_3")]
    np.testing.assert_allclose(found.log.motions[0].position.values, sound.motions[0].position.values)
    np.testing.assert_allclose(found.log.motions[0].velocity.values, sound.motions[0].velocity.values)


@pytest.mark.slow
@pytest.mark.parametrize(("motions", "rate"), some([(3, 1.02), (10, 1.02), (10, 0.99), (6, 1.003)], 4))
def test_the_rate_of_a_clock_is_recovered_within_its_error(motions, rate):
    state, command = tables(motions, seconds=40.0)
    found, said = told(state.assign(time=state.time / rate), command)
    assert said == [("clock", "")]
    fault = found.faults[0]
    assert fault.size == pytest.approx(rate, abs=3.0 * fault.sigma)
    assert fault.sigma < 2e-3
    np.testing.assert_allclose(found.log.motions[0].position.time[-1], state.time[state.motion == "m0"].max(), atol=0.1)


def test_stamps_that_are_shifted_in_one_motion_are_moved():
    state, command = tables(10)
    rows = state.motion == "m4"
    state.loc[rows, "time"] -= 0.4
    sound = log(*tables(10))
    command.loc[(command.motion == "m4") & (command.time < 0.0), "time"] = 0.0
    found, said = told(state, command)
    assert [fault.motion for fault in found.faults] == ["m4"]
    assert said == [("shift", "")]
    assert found.faults[0].size == pytest.approx(-0.4, abs=0.03)
    gap = found.log.motions[4].position.time[-1] - found.log.motions[4].command.time[-1]
    was = sound.motions[4].position.time[-1] - sound.motions[4].command.time[-1]
    assert gap == pytest.approx(was, abs=0.03)


def test_readings_before_their_commands_are_told():
    state, command = tables(6)
    found, said = told(state.assign(time=state.time - 0.3), command)
    assert said == [("shift", "")]
    assert -0.3 < found.faults[0].size < -0.15


def test_late_stamps_of_even_samples_are_evened():
    state, command = tables(6)
    draw = np.random.default_rng(0)
    even = np.round(state.time / STEP) * STEP
    for label in state.motion.unique():
        rows = state.motion == label
        own, grid = state.loc[rows, "time"].to_numpy(), even[rows].to_numpy()
        state.loc[rows, [*Q, *QD]] = np.column_stack([np.interp(grid, own, state.loc[rows, n]) for n in (*Q, *QD)])
    late = even + draw.uniform(0.0, 0.5, len(even)) * STEP
    found, said = told(state.assign(time=late), command)
    assert said == [("jitter", "")]
    steps = np.diff(found.log.motions[0].position.time)
    assert np.ptp(steps) < 1e-6


def test_a_frozen_reading_is_left_out_and_a_frozen_joint_too():
    state, command = tables(6)
    part = state.groupby("motion").cumcount().between(200, 500)
    spoilt = state.copy()
    spoilt.loc[part & (state.motion == "m1"), "q.joint_2"] = 0.123
    found, said = told(spoilt, command)
    assert said == [("stale", "joint_2")]
    assert found.joints == JOINTS
    gaps = np.isnan(found.log.motions[1].position.values)
    assert gaps.sum() == gaps[200:501, 1].sum() == 301
    assert not np.isnan(found.log.motions[0].position.values).any()
    found, said = told(state.assign(**{"q.joint_2": 0.1}), command)
    assert said == [("stale", "joint_2")]
    assert found.joints == tuple(joint for joint in JOINTS if joint != "joint_2")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (line,) = (line for line in text(found.log, found).splitlines() if "not read" in line)
    assert line.split()[0] == "joint_2"


UNITS = [("q.joint_4", 180 / np.pi, "taken for deg"), ("cmd.joint_4", 180 / np.pi, "the command for deg")]
UNITS += [("q.joint_4", 2.5, "rad, as the integral of qd says"), ("qd.joint_4", 1 / 0.429, "so qd is brought to it")]


@pytest.mark.parametrize(("column", "factor", "remedy"), UNITS)
def test_a_channel_in_another_unit_is_named_and_brought_back(column, factor, remedy):
    state, command = tables()
    if column in state:
        state[column] *= factor
    else:
        command[column] *= factor
    found, said = told(state, command)
    assert said[0] == ("unit", "joint_4")
    assert remedy in found.faults[0].told
    motion = found.log.motions[0]
    if not column.startswith("cmd"):
        np.testing.assert_allclose(motion.position.values, log(*tables()).motions[0].position.values, rtol=0.01)
        np.testing.assert_allclose(motion.velocity.values, log(*tables()).motions[0].velocity.values, rtol=0.01)
    assert found.joints == JOINTS


def test_a_joint_in_a_unit_that_nothing_tells_is_left_out():
    state, command = tables()
    state = state.drop(columns=QD).assign(**{"q.joint_1": 2.5 * state["q.joint_1"]})
    found, said = told(state, command)
    assert said == [("unit", "joint_1")]
    assert found.joints == JOINTS[1:]


@pytest.mark.slow
def test_several_faults_at_once_are_told_apart():
    state, command = tables(10, seconds=40.0)
    state[Q[:2]] = state[[Q[1], Q[0]]].to_numpy()
    state["q.joint_5"] *= -1.0
    _, said = told(state.assign(time=state.time / 1.01), command)
    assert said == [("clock", ""), ("swap", "joint_1"), ("swap", "joint_2"), ("sign", "joint_5")]


@pytest.fixture(scope="module")
def servo_arm(tmp_path_factory):
    if "THERMAL_ROBOT_DATA" not in os.environ:
        pytest.skip("THERMAL_ROBOT_DATA does not name the folder of the public campaigns")
    pytest.importorskip("pyarrow", reason="Parquet files need pyarrow")
    folder = Path(os.environ["THERMAL_ROBOT_DATA"]) / "so101_motion"
    file = tmp_path_factory.mktemp("so101") / "motion.toml"
    file.write_text('[robot]\nurdf = "robot.urdf"\n[motion]\nlog = ["state.parquet", "command.parquet"]\n'
                    'angle_unit = "rad"\n')  # fmt: skip
    return read_motion(file, folder=folder)


def test_the_servo_arm_has_the_unit_fault_of_its_gripper_and_no_other(servo_arm):
    assert len(servo_arm.motions) == 34
    assert servo_arm.joints[-1] == "gripper"
    found = find_faults(servo_arm)
    assert [(fault.what, fault.joint) for fault in found.faults] == [("unit", "gripper")]
    assert found.faults[0].size == pytest.approx(1 / 2.33, abs=0.005)
    assert found.joints == servo_arm.joints


@pytest.mark.slow
def test_the_servo_arm_with_stamps_of_its_own_is_sound_but_a_slow_clock_is_found(servo_arm):
    def stamped(motion, rate):
        own = Channel(motion.command.time + 1e-4, motion.command.values)
        return reclocked(replace(motion, command=own), lambda t: t / rate)

    few = replace(servo_arm, motions=servo_arm.motions[::3])
    sound = find_faults(replace(few, motions=tuple(stamped(m, 1.0) for m in few.motions)))
    assert [(fault.what, fault.joint) for fault in sound.faults] == [("unit", "gripper")]
    slow = find_faults(replace(few, motions=tuple(stamped(m, 1.02) for m in few.motions)))
    assert [fault.what for fault in slow.faults] == ["clock", "unit"]
    assert slow.faults[0].size == pytest.approx(1.02, abs=3 * slow.faults[0].sigma)
