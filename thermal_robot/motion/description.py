"""A log of motion in words: what `thermal-robot check motion.toml` prints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from thermal_robot.campaign.description import aligned
from thermal_robot.motion.faults import Sound
from thermal_robot.motion.following import at
from thermal_robot.motion.log import CHANNELS, MotionLog, joint_kinds


def text(log: MotionLog, sound: Sound) -> str:
    """Return blocks of aligned lines: facts, joints, channels, faults of the log, notes."""
    blocks = [
        [f"Motion {log.name}", *aligned(_facts(log))],
        ["Joints", *aligned(_joints(sound))],
        ["Channels recorded", *aligned(_channels(log))],
        ["Faults of the log", *([f"  - {fault.told}" for fault in sound.faults] or ["  none"])],
        ["Warnings", *([f"  - {note}" for note in log.notes] or ["  none"])],
    ]
    return "\n\n".join("\n".join(block) for block in blocks)


def _facts(log: MotionLog) -> Iterator[Sequence[str]]:
    robot, kinds = log.robot, sorted({motion.kind for motion in log.motions} - {""})
    spans = [float(motion.position.time[-1] - motion.position.time[0]) for motion in log.motions]
    yield "robot", f"{robot.name}, chain from {robot.root_frame} to {robot.tool_frame}, {robot.n} movable joints"
    yield "motions", f"{len(log.motions)} of {min(spans):.3g} to {max(spans):.3g} s, {sum(spans):.0f} s in all"
    if kinds:
        yield "types of motion", ", ".join(kinds)
    if log.payload:
        yield "payload", f"{log.payload[0]:g} kg"
    if not robot.has_masses:
        yield "masses", "none in the robot's description: gravity is not known"


def _joints(sound: Sound) -> Iterator[Sequence[str]]:
    yield "joint", "commanded", "gap, rms", "servo, as stated", ""
    log, kinds = sound.log, joint_kinds(sound.log.robot)
    for j, joint in enumerate(log.joints):
        commanded = np.concatenate([motion.command.values[:, j] for motion in log.motions])
        gaps = [m.position.values[:, j] - at(m.command, m.position.time)[:, j] for m in log.motions]
        gap = np.concatenate(gaps)
        gap = gap[np.isfinite(gap)]
        unit, servo = "m" if kinds[joint] == "prismatic" else "rad", vars(log.servo(joint))
        told = ", ".join(f"{key} {value:g}" for key, value in servo.items() if value is not None) or "unknown"
        span = f"{np.nanmin(commanded):.3f} .. {np.nanmax(commanded):.3f} {unit}"
        yield (
            joint,
            span,
            f"{1e3 * np.sqrt(np.mean(gap**2)):.3g} m{unit}" if len(gap) else "not read",
            told,
            "" if joint in sound.joints else "left out",
        )


def _channels(log: MotionLog) -> Iterator[Sequence[str]]:
    yield "channel", "motions", "rate", "joints"
    for name in CHANNELS:
        held = [channel for motion in log.motions if (channel := getattr(motion, name)) is not None]
        if held:
            rate = 1.0 / float(np.median(np.concatenate([np.diff(channel.time) for channel in held])))
            some = np.logical_or.reduce([~np.isnan(channel.values).all(axis=0) for channel in held])
            who = "all" if some.all() else ", ".join(np.array(log.joints)[some])
            yield name, str(len(held)), f"{rate:.4g} Hz", who
    absent = [name for name in CHANNELS if all(getattr(motion, name) is None for motion in log.motions)]
    if absent:
        yield "not recorded", ", ".join(absent)
