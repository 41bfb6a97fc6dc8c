"""The log of a motion: command, encoder and what else was recorded of a robot's joints, each with its own stamps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from lxml import etree

from thermal_robot.arrays import Array
from thermal_robot.motion.settings import VISIBLE
from thermal_robot.robot import Robot


@dataclass(frozen=True, eq=False)
class Channel:
    """Samples of one quantity of the joints.

    Attributes
    ----------
    time
        (N,) s, increasing: the channel's own stamps.
    values
        (N, joints), NaN where a joint has no sample.
    """

    time: Array
    values: Array

    def of(self, joint: int) -> tuple[Array, Array]:
        """Return the finite samples of a joint, stamps and values; all samples where none is finite."""
        column = self.values[:, joint]
        kept = np.isfinite(column) if np.isfinite(column).any() else np.ones(len(column), dtype=bool)
        return self.time[kept], column[kept]


@dataclass(frozen=True, eq=False)
class Motion:
    """One uninterrupted motion; its clock begins at its first stamp of any channel.

    Attributes
    ----------
    name, kind
        Label, and label of the type of motion, empty where none is given.
    command, position
        rad, m for a prismatic joint.
    velocity, torque, current, volts, temperature
        rad/s (m/s), N·m (N), A, V, °C; ``None`` where nothing was recorded.
    """

    name: str
    kind: str
    command: Channel
    position: Channel
    velocity: Channel | None = None
    torque: Channel | None = None
    current: Channel | None = None
    volts: Channel | None = None
    temperature: Channel | None = None

    def with_channels(self, names: Iterable[str], change: Callable[[Channel], Channel]) -> Motion:
        """Return the motion with the named channels mapped by a function; absent ones stay ``None``."""
        held = {name: getattr(self, name) for name in names}
        changed: dict[str, Any] = {name: change(channel) for name, channel in held.items() if channel is not None}
        return replace(self, **changed)


@dataclass(frozen=True)
class Servo:
    """Position servo of a joint as its maker states it, SI; ``None`` where unknown.

    Attributes
    ----------
    kp, kd
        Stiffness, N·m/rad, and damping, N·m·s/rad.
    limit
        Largest torque, N·m.
    dead_band
        Error within which the servo does nothing, rad; below zero the starting force over the stiffness, by which its
        drive exceeds stiffness times error (firmware that overcomes friction).
    gain, zero
        Share of the command and rad that it adds: at rest without load the joint is at (1 + gain) u + zero.
    friction, damping, armature
        Of the joint and its drive: Coulomb friction, N·m, viscous, N·m·s/rad, and inertia, kg·m².
    delay
        Dead time of the command, s.
    """

    kp: float | None = None
    kd: float | None = None
    limit: float | None = None
    dead_band: float | None = None
    gain: float | None = None
    zero: float | None = None
    friction: float | None = None
    damping: float | None = None
    armature: float | None = None
    delay: float | None = None

    def saturation(self, stiffness: float, inverse: float) -> float:
        """Return the torque limit, N·m, of a fitted inverse limit, 1/rad, which adds to the stated one where kp is."""
        return stiffness / (inverse + (stiffness / self.limit if self.kp and self.limit else 0.0))


@dataclass(frozen=True, eq=False)
class MotionLog:
    """Commanded and measured motion of a robot's joints, in several motions, SI.

    Attributes
    ----------
    name
        Of the log.
    robot
        Chain that holds the joints; of an MJCF, translated from it.
    joints
        Names of those that are recorded, in the order of the channels' values.
    motions
        In the order of the log.
    servos
        What is known of the servos, by joint.
    payload
        Mass, kg, and centre of mass (3,), m, in the frame of the chain's last link; ``None`` without one.
    tolerance
        What an output must move by to be shown, rad, by joint.
    notes
        What was odd about the log and was accepted, a sentence each.
    about
        Whose log it is, for reports: serial numbers, operator, date.

    Examples
    --------
    >>> import numpy as np, pandas as pd
    >>> import thermal_robot as tr
    >>> t = np.arange(0.0, 10.0, 0.02)
    >>> moved = {"time": t, "cmd.joint_1": np.sin(t), "q.joint_1": 0.98 * np.sin(t - 0.06)}
    >>> log = tr.motion_from_table(tr.load_robot("builtin:rv_m2", "tool0"), pd.DataFrame(moved))
    >>> log.joints, log.motions[0].position.values.shape
    (('joint_1',), (500, 1))
    """

    name: str
    robot: Robot
    joints: tuple[str, ...]
    motions: tuple[Motion, ...]
    servos: Mapping[str, Servo] = field(default_factory=dict)
    payload: tuple[float, Array] | None = None
    tolerance: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    about: Mapping[str, str] = field(default_factory=dict)

    @property
    def commanded(self) -> bool:
        """Whether commands were recorded; if not, each motion's command is its encoder's channel."""
        return any(motion.command is not motion.position for motion in self.motions)

    def servo(self, joint: str) -> Servo:
        """Return what is stated of a joint's servo; one with ``None`` throughout where nothing is."""
        return self.servos.get(joint, Servo())

    def visible_from(self, joint: str, noise: float) -> float:
        """Return the least move of a joint that counts as visible: twice its noise or its tolerance, the larger."""
        return max(VISIBLE * noise, self.tolerance.get(joint, 0.0))

    def with_joints(self, joints: Sequence[str]) -> MotionLog:
        """Return the log restricted to some of its joints, in their order."""
        at = [self.joints.index(name) for name in joints]

        def only(motion: Motion) -> Motion:
            cut = motion.with_channels(CHANNELS, lambda channel: Channel(channel.time, channel.values[:, at]))
            return replace(cut, command=cut.position) if motion.command is motion.position else cut

        return replace(self, joints=tuple(joints)).with_motions(only)

    def with_motions(self, change: Callable[[Motion], Motion]) -> MotionLog:
        """Return the log with every motion mapped by a function."""
        return replace(self, motions=tuple(map(change, self.motions)))

    def __repr__(self) -> str:
        seconds = sum(float(motion.position.time[-1] - motion.position.time[0]) for motion in self.motions)
        return f"<MotionLog {self.name!r}: {len(self.motions)} motions of {len(self.joints)} joints, {seconds:.0f} s>"


CHANNELS = ("command", "position", "velocity", "torque", "current", "volts", "temperature")
"""Fields of a motion that are channels."""


def joint_kinds(robot: Robot) -> dict[str, str]:
    """Return the type of every joint of the robot's URDF by name, whether on the chain or not."""
    joints = etree.fromstring(robot.urdf.encode()).iter("{*}joint")
    return {joint.get("name", ""): joint.get("type", "fixed") for joint in joints}
