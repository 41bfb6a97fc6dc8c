"""Diagnoses of motion that are known beforehand: a log simulated with known servos, and what would be said of it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
from motion.arms import COUNT, robot

from thermal_robot.diagnosis.values import Dependence, Estimate, Finding, HeldOut, Location, Unexplained
from thermal_robot.motion import Channel, Motion, MotionLog, Servo, motion_from_table
from thermal_robot.motion.effects import EFFECTS, SHARED_TITLES, TITLES
from thermal_robot.motion.model import SHARED, ServoModel
from thermal_robot.motion.result import JointGap, MotionDiagnosis, rms, with_summary

JOINTS = ("joint_2", "joint_3")
STEP, SECONDS = 0.02, 8.0
TRUE = {
    ("lag", "joint_2"): 0.06,
    ("lag", "joint_3"): 0.08,
    ("coulomb", "joint_2"): 0.012,
    ("droop", "joint_2"): 1e-3,
    ("gain", "joint_3"): 1e-5,
}
"""Parameters of the servos by effect and joint, SI; the gain is too small to be seen."""


def commanded(motions=3, seed=4):
    """Slow and quick sums of waves, motion by motion, (n, joints) rad."""
    draw = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, STEP)
    for m in range(motions):
        size, rate, phase = draw.uniform([0.1, 0.3, 0.0], [0.3, 1.0 + 1.5 * m, 6.0], (3, 2, 3)).transpose(2, 0, 1)
        waves = size * (np.sin(rate * time[:, None, None] + phase) - np.sin(phase))
        yield time, waves.sum(axis=1)


def log_of(motions, servos=(), name="bench"):
    """A log of (time, command, position)."""
    parts = []
    for k, (time, command, position) in enumerate(motions):
        parts.append(Motion(f"m{k}", "", Channel(time, command), Channel(time, position)))
    return MotionLog(name, robot(), JOINTS, tuple(parts), dict(servos))


@cache
def simulated(stated=False, scale=1.0, seed=4):
    """A log of servos with the true parameters, encoder counts, and the values (P,) of its model."""
    servos = {"joint_2": Servo(kp=20.0)} if stated else {}
    plan = list(commanded(seed=seed))
    first = ServoModel(log_of([(t, c, c) for t, c in plan], servos))
    values = true_values(first, scale)
    ends = np.split(np.arange(len(first.grid)), first.begins[1:-1])
    path = first.path(values)
    measured = [COUNT * np.round(path[rows] / COUNT) for rows in ends]
    return log_of([(t, c, q[: len(t)]) for (t, c), q in zip(plan, measured, strict=True)], servos)


def true_values(model, scale=1.0):
    known = {key: value * scale for key, value in TRUE.items()}
    names = [(one.effect, "" if one.joint == SHARED else model.log.joints[one.joint]) for one in model.parameters]
    return np.array([known.get(key, 0.0) for key in names])


def estimates(model, values, effect):
    for one, value in zip(model.parameters, values, strict=True):
        if one.effect == effect and value:
            name = f"{one.label}, {model.log.joints[one.joint]}"
            yield Estimate(name, float(value), 0.05 * abs(value), one.unit, True)


def findings(model, values, shares, rivals):
    """A finding of every effect: told where a value is given, with the share of each joint."""
    titles = {one.name: one.title for one in EFFECTS} | TITLES | SHARED_TITLES
    for name, title in titles.items():
        parameters = tuple(estimates(model, values, name))
        share = shares.get(name, 0.0)
        places = tuple(Location("joint", p.name.rpartition(", ")[2], share / len(parameters)) for p in parameters)
        against = rivals.get(name, ())
        status = "not_found" if not parameters else "confounded" if against else "found"
        if name == "kp" and not model.log.servos:
            yield Finding(name, "not_testable", needs=("servo.kp",), title=title)
        else:
            size = (0.99 if parameters else 0.02, share)
            yield Finding(name, status, *size, None, (), against, places, parameters, title=title)


@cache
def found(stated=False, flagged=False, rivals=(), scale=1.0, seed=4):
    """What a diagnosis of the log would be, put into words."""
    log = simulated(stated, scale, seed)
    model = ServoModel(log)
    values = true_values(model, scale)
    curves = model.curves(values)
    if not stated:  # the joint that follows its command at once
        curves = {name: one.assign(nominal=one["command"]) for name, one in curves.items()}
    gaps = {}
    for j, (name, one) in enumerate(curves.items()):
        before, after = (rms(np.asarray(one["measured"] - one[key])) for key in ("nominal", "simulated"))
        gaps[name] = JointGap(before, after, 1.1 * after, model.noise(j))
    before, after = (rms(np.array([getattr(gap, k) for gap in gaps.values()])) for k in ("before", "held_out"))
    shrinkage = 1.0 - (after / before) ** 2
    held = HeldOut("motion", 3, before, after, shrinkage, (shrinkage - 0.02, min(shrinkage + 0.001, 1.0)))
    shares = {"lag": 0.75, "coulomb": 0.1, "droop": 0.1, "gain": 0.0}
    effects = sorted(findings(model, values, shares, dict(rivals)), key=lambda one: -(one.shrinkage or 0.0))
    left = Unexplained(False, 0.0, 1.0)
    if flagged:
        reason = "42 % of what remains in joint_2 follows velocity"
        left = Unexplained(
            True, after, 0.0, (reason,), (Location("joint", "joint_2", 0.42),), (Dependence("velocity", 0.0),)
        )
    verdict = tuple(one.name for one in effects if one.status in ("found", "confounded"))
    names = {(p.effect, JOINTS[p.joint]): v for p, v in zip(model.parameters, values, strict=True) if v}
    return with_summary(
        MotionDiagnosis(
            log, gaps, held, tuple(effects), verdict, 0.93, left, names, curves, {}, (), log.notes, (),
            shares={"joint_2": 0.6, "joint_3": 0.35}, moves=model.moves(values),
        )
    )  # fmt: skip


def nothing():
    """A diagnosis that tells no effect."""
    whole = found()
    quiet = tuple(one for one in whole.effects if one.status not in ("found", "confounded"))
    return with_summary(replace(whole, effects=quiet, verdict=(), moves={}))


def table_of(log):
    """The log as one data frame."""
    rows = []
    for motion in log.motions:
        parts = {"motion": motion.name, "time": motion.position.time}
        for j, name in enumerate(log.joints):
            parts |= {f"cmd.{name}": motion.command.values[:, j], f"q.{name}": motion.position.values[:, j]}
        rows.append(pd.DataFrame(parts))
    return pd.concat(rows, ignore_index=True)


def again(log):
    return motion_from_table(log.robot, table_of(log))
