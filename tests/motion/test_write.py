"""Causes written into robot files: MuJoCo with the written model does what the arm did; what a file lacks is said."""

from __future__ import annotations

import math
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from thermal_robot.blind.motions.fault import NOTHING, Fault
from thermal_robot.blind.motions.world import draw_world
from thermal_robot.diagnosis.values import Estimate, HeldOut, Unexplained
from thermal_robot.errors import CampaignError
from thermal_robot.motion.diagnose import diagnose_motion
from thermal_robot.motion.effects import physical
from thermal_robot.motion.log import Servo
from thermal_robot.motion.mjcf import opened, servos_of_mjcf
from thermal_robot.motion.model import ServoModel
from thermal_robot.motion.result import MotionDiagnosis, rms
from thermal_robot.motion.rollout import Rollout, rollout, simulated
from thermal_robot.motion.write import Cause, causes, motion_mjcf, motion_urdf

pytest.importorskip("mujoco", reason="an MJCF is written by MuJoCo")
JOINT = 1


def a_world(seed=5, rows=150, motions=2):
    world = draw_world(np.random.default_rng(seed), 3, motions)
    return replace(
        world, commands=world.commands[:, :rows], step=1e-3, rate=50.0, count=1e-7, explicit=False, sticks=True
    )


def strong(world):
    """The arm with servos that never saturate."""
    servos = {name: replace(servo, limit=1e3) for name, servo in world.arm.servos.items()}
    return replace(world, arm=replace(world.arm, servos=servos))


def found_of(log, values):
    """A diagnosis that found these values, by effect; of the whole arm where the key is no pair."""
    own = {(key, log.joints[JOINT]) if isinstance(key, str) else key: value for key, value in values.items()}
    held = HeldOut("motion", 2, 1.0, 0.1, 0.99, (0.98, 1.0))
    return MotionDiagnosis(log, {}, held, (), (), 1.0, Unexplained(False, 0.0, 1.0), own, {})


def stiffness(log):
    return log.servos[log.joints[JOINT]].kp


def rolled(world, log, values):
    written = motion_mjcf(found_of(log, values), world.mjcf())
    assert written.held
    assert written.kept == []
    return np.concatenate(simulated(written.text, log))


CASES = [
    ("coulomb", 0.2, lambda k, limit: {"coulomb": 0.2 / k}),
    ("armature", 0.02, lambda k, limit: {"armature": 0.02 / k}),
    ("viscous", 0.3, lambda k, limit: {"lag": 0.3 / k}),
    ("kp", 0.3, lambda k, limit: {"kp": math.log(1.3)}),
    ("zero", 0.02, lambda k, limit: {"zero": 0.02}),
    ("gain", 0.03, lambda k, limit: {"gain": 0.03}),
    ("payload", 0.05, lambda k, limit: {("payload", ""): 0.05}),
    ("torque limit", 1.0, lambda k, limit: {"torque_limit": k * (1.0 - 1.0 / limit)}),
]


@pytest.mark.parametrize(("name", "size", "values"), CASES, ids=[case[0] for case in CASES])
def test_mujoco_with_what_was_written_does_what_the_faulty_arm_did(name, size, values):
    world = a_world()
    sound = world.simulated(Fault(NOTHING))
    faulty = world.simulated(Fault(name, JOINT, size))
    log = world.log(faulty)
    told = values(stiffness(log), log.servos[log.joints[JOINT]].limit)
    own = rolled(world, log, told)
    moved = float(np.abs(faulty.position - sound.position).max())
    assert moved > 1e-3
    assert float(np.abs(own - faulty.position).max()) < 0.03 * moved + 1e-5


@pytest.mark.parametrize(("kp", "stiffness", "fitted"), [(10.0, 10.0, 10.0 / 2.0 - 10.0 / 3.0), (None, 8.0, 8.0 / 2.0)])
def test_a_torque_limit_is_told_and_written_as_what_the_servo_does(kp, stiffness, fitted):
    """A servo of stated stiffness adds the inverse of its stated limit, 3 N·m, to what is fitted: it ends at 2 N·m."""
    servo, values = Servo(kp, limit=3.0), {"torque_limit": fitted} | ({} if kp else {"droop": 1.0 / stiffness})
    assert Cause("j", servo, values, (-1.0, 1.0)).limit == pytest.approx(2.0)
    told = physical("torque_limit", Estimate("j", fitted, 0.01 * fitted, "1/rad", True), servo, np.zeros(1))
    assert told.value == pytest.approx(2.0 if kp else 2.0 / stiffness)


@pytest.mark.parametrize(("name", "size"), [("gain", 0.03), ("zero", 0.02)])
def test_a_servo_that_was_written_is_read_again_and_leaves_nothing_to_find(name, size, tmp_path):
    world = strong(a_world(motions=4))
    log = world.log(world.simulated(Fault(name, JOINT, size)))
    found = diagnose_motion(log, only=("gain", "zero", "kp"))
    assert found.values[name, log.joints[JOINT]] == pytest.approx(size, rel=0.05)
    (tmp_path / "arm.xml").write_text(motion_mjcf(found, world.mjcf()).text)
    better = replace(log, servos=servos_of_mjcf(opened(tmp_path / "arm.xml")))
    assert list(better.servos) == list(log.joints)
    again = diagnose_motion(better, only=("gain", "zero", "kp"))
    assert again.verdict == ()
    assert again.values == {("step", ""): pytest.approx(world.step, rel=0.1)}  # MuJoCo's, which is no cause
    assert again.rms_after == pytest.approx(found.rms_after, rel=0.05)
    more = found_of(better, {"zero": 1e-3})
    (tmp_path / "arm.xml").write_text(motion_mjcf(more, tmp_path / "arm.xml").text)
    servo, before = (one[log.joints[JOINT]] for one in (servos_of_mjcf(opened(tmp_path / "arm.xml")), better.servos))
    assert servo.zero == pytest.approx((before.zero or 0.0) + 1e-3, rel=1e-4)
    assert servo.gain == (before.gain and pytest.approx(before.gain, rel=1e-3))


def test_where_nothing_is_told_nothing_is_drawn_or_written():
    """A zero stands for the mean of what a soft servo droops: most of the gap stays, and that is no answer."""
    world = strong(a_world(motions=4))
    log = world.log(world.simulated(Fault("kp", JOINT, -0.4)))
    found = diagnose_motion(log, only=("zero",))
    assert found.verdict == ()
    assert found.unexplained.flagged
    assert found.values == {}
    assert not [one for one in found.effects if one.parameters or one.probability]
    assert found.held_out.shrinkage == found.probability == 0.0
    assert found.rms_after == found.rms_before == pytest.approx(found.unexplained.rms)
    for curve in found.curves.values():
        assert (curve["simulated"] == curve["nominal"]).all()


def test_a_delay_of_every_joint_is_held_by_the_actuators():
    world = a_world()
    late = 0.0305  # between two steps, so that rounding of the clock does not choose one
    faulty = world.simulated(Fault("delay", size=late))
    log = world.log(faulty)
    own = rolled(world, log, {("delay", joint): late for joint in log.joints})
    assert float(np.abs(own - faulty.position).max()) < 1e-4


@pytest.mark.slow
def test_friction_that_is_written_sticks_as_the_servo_models_does():
    world = strong(a_world(rows=300, motions=5))
    faulty = world.simulated(Fault("coulomb", JOINT, 0.15))
    log = world.log(faulty)
    found = found_of(log, {"coulomb": 0.15 / stiffness(log)})
    did = rollout(found, motion_mjcf(found, world.mjcf()).text, log)
    creeping = world.log(replace(world, sticks=False).simulated(Fault("coulomb", JOINT, 0.15)))
    soft = rollout(found, motion_mjcf(found, world.mjcf()).text, creeping)
    assert did.agrees
    assert did.simulated[JOINT] < 0.05 * did.nominal[JOINT]
    assert soft.simulated[JOINT] > 5.0 * did.simulated[JOINT]


@pytest.mark.slow
def test_friction_that_creeps_in_the_log_creeps_in_the_model_that_is_written():
    """MuJoCo's friction holds nine tenths by default; in a tenth too much the joint is elsewhere."""
    world = replace(strong(a_world(rows=300, motions=5)), sticks=False)
    log = world.log(world.simulated(Fault("coulomb", JOINT, 0.15)))
    own = {("coulomb", log.joints[JOINT]): 0.15 / stiffness(log)}
    sticking, creeping, soft = (
        rollout(found, motion_mjcf(found, world.mjcf()).text, log)
        for found in (found_of(log, own | more) for more in ({}, {("creep", ""): 0.1}, {("creep", ""): 0.2}))
    )
    assert creeping.agrees
    assert creeping.simulated[JOINT] < 1e-5
    assert min(sticking.simulated[JOINT], soft.simulated[JOINT]) > 10.0 * creeping.simulated[JOINT]


def test_an_end_stop_becomes_a_range():
    world = a_world()
    sound = world.simulated(Fault(NOTHING)).position[:, JOINT]
    stop = float(np.quantile(sound, 0.7))
    faulty = world.simulated(Fault("end stop", JOINT, stop, 1.0))
    log = world.log(faulty)
    value = float(world.commands[..., JOINT].max()) - stop
    own = rolled(world, log, {"high_stop": value})
    assert float(np.abs(own - faulty.position).max()) < 2e-3
    assert causes(found_of(log, {"high_stop": value}))[JOINT].stops == (None, pytest.approx(stop))


def test_without_a_stiffness_no_torque_is_written():
    world = a_world()
    log = world.log(world.simulated(Fault(NOTHING)), stated=False)
    loose = found_of(log, {"coulomb": 0.01, "lag": 0.05})
    for written in (motion_mjcf(loose, world.mjcf()), motion_urdf(loose)):
        assert written.held == []
        assert [told.split(":")[0] for told in written.kept] == ["coulomb of joint_2", "lag of joint_2"]
        assert all("stiffness is not stated" in told for told in written.kept)
    known = motion_mjcf(found_of(log, {"coulomb": 0.01, "droop": 0.05}), world.mjcf())
    assert "frictionloss of joint_2: 0.2 N·m" in known.held
    assert 'frictionloss="0.2"' in known.text


def test_what_no_file_holds_is_said():
    world = a_world()
    log = world.log(world.simulated(Fault(NOTHING)))
    found = found_of(
        log, {"dead_zone": 0.01, "load_friction": 0.1, "stribeck": 0.01, ("contact", ""): 0.1, ("payload", ""): -0.1}
    )
    for written in (motion_mjcf(found, world.mjcf()), motion_urdf(found)):
        assert written.held == []
        assert {told.split(" of ")[0].split(":")[0] for told in written.kept} == {
            "dead_zone", "load_friction", "stribeck", "contact", "payload"
        }  # fmt: skip


def test_a_urdf_holds_friction_damping_limits_and_load():
    world = a_world()
    log = world.log(world.simulated(Fault(NOTHING)))
    k = stiffness(log)
    values = {"coulomb": 0.01, "lag": 0.02, "low_stop": 0.1, "armature": 1e-3, ("payload", ""): 0.2}
    written = motion_urdf(found_of(log, values))
    robot = ElementTree.fromstring(written.text.encode())
    joint = robot.find(f"joint[@name='{log.joints[JOINT]}']")
    dynamics = joint.find("dynamics")
    assert float(dynamics.get("friction")) == pytest.approx(0.01 * k)
    assert float(dynamics.get("damping")) == pytest.approx(0.02 * k)
    assert float(joint.find("limit").get("lower")) == pytest.approx(world.commands[..., JOINT].min() + 0.1)
    assert float(joint.find("limit").get("upper")) == 3.2
    assert robot.find("link[@name='tool_payload']/inertial/mass").get("value") == "0.2"
    assert written.kept == ["armature of joint_2: a URDF describes no servo"]
    assert "armature of joint_2" in written.text


def test_a_joint_that_the_model_lacks_is_refused():
    world = a_world()
    log = world.log(world.simulated(Fault(NOTHING)))
    other = world.mjcf().replace('"joint_2"', '"elbow"')
    with pytest.raises(CampaignError, match="has no joint 'joint_2'"):
        motion_mjcf(found_of(log, {"kp": 0.1}), other)


def test_the_rollout_shrinks_the_gap_as_it_was_told():
    fitted = strong(a_world(5, 200))
    unseen = replace(fitted, commands=0.7 * fitted.commands[:, ::-1].copy())
    fault = Fault("kp", JOINT, -0.4)
    found = found_of(fitted.log(fitted.simulated(fault)), {"kp": math.log(0.6)})
    written = motion_mjcf(found, fitted.mjcf())
    did = rollout(found, written.text, unseen.log(unseen.simulated(fault)))
    assert did.shrinkage > 0.9
    assert did.agrees
    nominal = rollout(found_of(found.log, {}), fitted.mjcf(), unseen.log(unseen.simulated(fault)))
    assert nominal.shrinkage == pytest.approx(0.0, abs=0.1)
    assert nominal.shrinkage_told == pytest.approx(0.0, abs=1e-2)  # loads are taken anew


def test_shrinkages_that_differ_by_more_than_a_tenth_do_not_agree():
    one = Rollout(("a", "b"), (3.0, 4.0), (0.0, 1.0), (3.0, 1.0))
    assert one.shrinkage_told == pytest.approx(0.96)
    assert one.shrinkage == pytest.approx(0.6)
    assert not one.agrees


def test_what_the_mjcf_holds_is_in_the_nominal_model_and_stays_when_more_is_written(tmp_path):
    """A joint with friction, damping, inertia and a delay of its own leaves no gap but MuJoCo's soft constraints."""
    world = a_world()
    faults = {
        name: Fault(name, JOINT, size) for name, size in (("coulomb", 0.05), ("viscous", 0.2), ("armature", 0.01))
    }
    for name, fault in faults.items():
        spec = world.spec(fault)
        spec.compile()
        file = tmp_path / f"{name}.xml"
        file.write_text(spec.to_xml())
        servos = servos_of_mjcf(opened(file))
        log = replace(world.log(world.simulated(fault)), servos=servos)
        left = {}
        for told, model in (("stated", ServoModel(log)), ("not", ServoModel(replace(log, servos=world.arm.servos)))):
            model.refreshed(np.zeros(len(model.parameters)))
            left[told] = rms(model.all_residuals(np.zeros(len(model.parameters)))[JOINT])
        assert left["stated"] < 0.3 * left["not"], name
    more = found_of(replace(log, servos=servos), {"armature": 0.01 / servos[log.joints[JOINT]].kp})
    assert causes(more)[JOINT].torque("armature") == pytest.approx(0.02)


def test_a_delay_that_is_stated_is_no_effect():
    world = a_world()
    log = world.log(world.simulated(Fault("delay", -1, 0.03)))
    stated = {joint: replace(servo, delay=0.03) for joint, servo in log.servos.items()}
    late, known = (ServoModel(replace(log, servos=servos)) for servos in (log.servos, stated))
    one, other = (rms(model.all_residuals(np.zeros(len(model.parameters)))[JOINT]) for model in (late, known))
    assert other < 0.1 * one
