"""The torque channel: friction, second moments and bias found in torques that Pinocchio computes of another arm."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

pytest.importorskip("numba", reason="the extra fast is not installed")

from thermal_robot.blind.motions.arm import TOOL, draw_arm
from thermal_robot.errors import CampaignError
from thermal_robot.motion import Servo, motion_from_table
from thermal_robot.motion.diagnose import diagnose_motion
from thermal_robot.motion.faults import find_faults
from thermal_robot.motion.model import ServoModel
from thermal_robot.motion.rollout import rollout
from thermal_robot.motion.torque import _prandtl
from thermal_robot.motion.write import motion_mjcf, motion_urdf
from thermal_robot.robot import load_robot

ARM = draw_arm(np.random.default_rng(4), 2)
ROBOT = load_robot(ARM.urdf, TOOL)
RATE, COULOMB, OFFSET = 500, 0.15, 0.05


def waves(motion, time, derivative):
    """(n, 2) positions of five harmonics, or their derivatives."""
    draw = np.random.default_rng(motion)
    size, phase = draw.uniform(0.1, 0.4, (5, 2, 1)), draw.uniform(0.0, 6.0, (5, 2, 1))
    rate = 2.0 * np.pi * np.arange(1, 6)[:, None, None] / 8.0
    return (size * rate**derivative * np.sin(rate * time + phase + derivative * np.pi / 2)).sum(axis=0).T


def bristles(q):
    """(n,) friction over its size as Dahl has it: bristles that bend over a thousandth of a radian."""
    state = np.zeros_like(q)
    for n, move in enumerate(np.diff(q) / 1e-3, 1):
        state[n] = np.sign(move) + (state[n - 1] - np.sign(move)) * np.exp(-abs(move))
    return state


def log(more=0.0, coulomb=0.0, offset=0.0, hum=0.0, viscous=0.0, heavier=(0.0, 0.0)):
    """Eight motions; the last link's products of inertia are larger by ``more``, kg·m², unlike any drive.

    Links are ``heavier`` by shares, of the same size and shape.
    """
    model = pin.buildModelFromXML(ARM.urdf)
    for k, share in enumerate(heavier, 1):
        model.inertias[k] = pin.Inertia.FromDynamicParameters((1.0 + share) * model.inertias[k].toDynamicParameters())
    numbers = model.inertias[2].toDynamicParameters()
    numbers[4:] += more * np.array([0.0, 1.0, 0.0, 1.0, 1.0, 0.0])
    model.inertias[2] = pin.Inertia.FromDynamicParameters(numbers)
    data, time = model.createData(), np.arange(0.0, 8.0, 1.0 / RATE)
    draw, frames = np.random.default_rng(0), []
    for motion in range(8):
        q, v, a = (waves(motion, time, k) for k in range(3))
        tau = np.array([pin.rnea(model, data, *each).copy() for each in zip(q, v, a, strict=True)])
        tau[:, 0] += coulomb * bristles(q[:, 0]) + hum * np.sin(2.0 * np.pi * 31.0 * time)
        tau[:, 0] += viscous * v[:, 0]
        tau[:, 1] += offset
        tau += draw.normal(0.0, 0.01, tau.shape)
        columns = {f"{kind}.joint_{j + 1}": one[:, j] for kind, one in (("q", q), ("tau", tau)) for j in range(2)}
        frames.append(pd.DataFrame({"time": time, "motion": f"m{motion}", **columns}))
    return motion_from_table(ROBOT, pd.concat(frames))


@pytest.fixture(scope="module")
def found():
    return diagnose_motion(log(more=0.01, coulomb=COULOMB, offset=OFFSET, hum=0.1))


def test_friction_bias_and_second_moments_are_found_with_their_sizes(found):
    assert set(found.verdict) == {"coulomb", "masses", "offset"}
    told = found.parameters
    assert told.loc["coulomb"]["value"].iloc[0] == pytest.approx(COULOMB, rel=0.05)
    assert told.loc["offset"]["value"].iloc[0] == pytest.approx(OFFSET, rel=0.1)
    assert any("second moment of joint_2" in name for name in told.loc["masses"].index)


def test_masses_of_two_links_stand_side_by_side_among_the_values():
    both = diagnose_motion(log(heavier=(0.3, 0.5)))
    assert both.values["masses", "mass of joint_1"] > 0.2
    assert both.values["masses", "mass of joint_2"] == pytest.approx(0.5, rel=0.15)
    assert sorted(both.values.values()) == sorted(both.parameters["value"])


def as_mjcf(text):
    """The arm as an MJCF, with all digits of its masses."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    spec = mujoco.MjSpec.from_string(text)
    spec.compiler.fusestatic, spec.compiler.boundmass, spec.compiler.boundinertia = False, 0.0, 0.0
    spec.compile()
    return spec.to_xml()


def needed(text, log):
    """Torques (N, 2) by MuJoCo's inverse dynamics, those measured, along all motions."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    data, found, measured = mujoco.MjData(model), [], []
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    for motion in log.motions:
        number = int(motion.name[1:])
        time = np.arange(0.0, 8.0, 0.01)
        for data.qpos, data.qvel, data.qacc in zip(*(waves(number, time, k) for k in range(3)), strict=True):
            mujoco.mj_inverse(model, data)
            found.append(data.qfrc_inverse.copy())
        measured.append(motion.torque.values[::5][: len(time)])
    return np.array(found), np.concatenate(measured)


def test_masses_that_were_found_are_written_and_mujoco_needs_the_torques():
    """What goes away in MuJoCo's own inverse dynamics, of motions that were not fitted, is the share that was told."""
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    whole = log(heavier=(0.3, 0.5))
    fitted, unseen = (replace(whole, motions=whole.motions[k::2]) for k in (0, 1))
    heavy = diagnose_motion(fitted)
    nominal = as_mjcf(ARM.urdf)
    written, as_urdf = motion_mjcf(heavy, nominal), motion_urdf(heavy)
    assert sum("masses of the link" in told for told in written.held) == 2, written.kept
    (before, tau), (after, _) = (needed(text, unseen) for text in (nominal, written.text))
    shrinkage = 1.0 - ((tau - after) ** 2).sum() / ((tau - before) ** 2).sum()
    assert shrinkage == pytest.approx(heavy.held_out.shrinkage, abs=0.02)
    assert shrinkage > 0.95
    # MuJoCo writes six digits of each number
    np.testing.assert_allclose(needed(as_mjcf(as_urdf.text), unseen)[0], after, atol=1e-5)


def test_numbers_of_no_rigid_body_are_not_written():
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    heavy = diagnose_motion(log(heavier=(0.0, 0.5)))
    hollow = replace(heavy, values={("masses", "second moment of joint_2, xx"): -1.0})
    for written in (motion_mjcf(hollow, as_mjcf(ARM.urdf)), motion_urdf(hollow)):
        assert [told for told in written.kept if "no rigid body" in told]
        assert not [told for told in written.held if "masses" in told]


@pytest.mark.parametrize("kp", [None, 20.0])
def test_torques_are_written_as_they_are_whatever_the_servo(found, kp):
    """Friction and damping are in N·m whether a stiffness is stated or not; what a file does not hold is said."""
    servos = {joint: Servo(kp) for joint in found.log.joints} if kp else {}
    values = found.values | {("viscous", "joint_1"): 0.3}
    written = motion_urdf(replace(found, log=replace(found.log, servos=servos), values=values))
    dynamics = ElementTree.fromstring(written.text.encode()).find("joint[@name='joint_1']/dynamics")
    assert float(dynamics.get("friction")) == pytest.approx(COULOMB, rel=0.05)
    assert float(dynamics.get("damping")) == pytest.approx(0.3)
    assert {told.split(" of ")[0].split(":")[0] for told in written.kept} == {"offset", "masses"}
    with pytest.raises(CampaignError, match="explains torques"):
        rollout(found, "<mujoco/>", found.log)


def test_a_joint_stands_once_among_the_places(found):
    listed = [[place.name for place in one.locations] for one in (*found.effects, found.unexplained)]
    assert any(listed)
    for names in listed:
        assert len(names) == len(set(names))
    masses = next(one for one in found.effects if one.name == "masses")
    assert sum(place.share for place in masses.locations) <= masses.shrinkage + 1e-9


def test_a_vibration_that_no_rigid_body_has_is_left_out_on_both_sides(found):
    """Of 70 mN·m rms at 31 Hz and 10 of noise, less than 20 remain in motions held out."""
    assert max(gap.held_out for gap in found.joints.values()) < 0.02
    assert found.held_out.shrinkage > 0.99


@pytest.mark.parametrize("rows", [41, 2001])
def test_friction_turns_round_over_four_thousandths_of_a_radian(rows):
    """Twenty forth and twenty back, at any rate: half the turn after two, all of it after four."""
    way = np.linspace(0.0, 0.04, rows)
    state = _prandtl(np.where(way < 0.02, way, 0.04 - way)[:, None])[:, 0]
    np.testing.assert_allclose(np.interp([0.01, 0.02, 0.022, 0.024, 0.04], way, state), [1, 1, 0, -1, -1], atol=1e-6)


def test_the_height_of_the_tool_has_the_derivative_that_is_said():
    model = ServoModel(log())
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 2))
    height, tool = model.ends.lowest(q)
    slope = model.ends.up @ tool
    for j in range(2):
        moved = q + 1e-5 * (np.arange(2) == j)
        np.testing.assert_allclose((model.ends.heights(moved) - height) / 1e-5, slope[:, j], atol=1e-5)


def test_the_drag_of_a_strong_gear_is_found_whose_torque_limit_nobody_stated():
    """An industrial arm's: 20 N·m·s/rad, where a hobby servo of 3 N·m would stall; all of the gap but noise goes."""
    strong = diagnose_motion(log(viscous=20.0))
    assert "viscous" in strong.verdict
    assert strong.parameters.loc["viscous"]["value"].iloc[0] == pytest.approx(20.0, rel=0.02)
    assert strong.held_out.shrinkage > 0.99


def test_a_torque_of_the_other_sign_is_turned_round():
    """Whatever the offset; friction, which opposes the motion, turns with it."""
    sound = log(coulomb=COULOMB, offset=OFFSET)
    assert not find_faults(sound).log.commanded
    assert not [fault for fault in find_faults(sound).faults if fault.what == "sign"]
    values = np.array([1.0, -1.0])
    turned = [replace(m, torque=replace(m.torque, values=m.torque.values * values)) for m in sound.motions]
    undone = find_faults(replace(sound, motions=tuple(turned)))
    (fault,) = [fault for fault in undone.faults if fault.what == "sign"]
    assert fault.joint == "joint_2"
    assert fault.size == pytest.approx(-1.0, abs=max(0.05, 4.0 * fault.sigma))
    for motion, other in zip(undone.log.motions, sound.motions, strict=True):
        np.testing.assert_array_equal(motion.torque.values, other.torque.values)
