"""From commands to measurements: joints scatter, effects displace, the instrument reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.plausible import doubts
from thermal_robot.effects import Effect, RandomEffect
from thermal_robot.effects.apply import displacement
from thermal_robot.errors import CampaignError
from thermal_robot.inference.rows import repeated_poses
from thermal_robot.kinematics import exp3, rotation_to_quaternion
from thermal_robot.observations import Frames, observe
from thermal_robot.schema import boolean, fitted, number, optional, shown, word
from thermal_robot.simulation.commanded import CALL

_MEASURES = ("position", "pose")


@dataclass(frozen=True)
class Instrument:
    """An instrument with normal noise, the same along and about each axis.

    Attributes
    ----------
    turns
        Whether it measures orientations, too.
    noise, noise_orientation
        One sigma per axis, m and rad.
    """

    turns: bool
    noise: float
    noise_orientation: float

    def awaiting(self, plan: Campaign) -> Campaign:
        """Return rows that tell effects what will be measured: orientations, not yet turned, where they are."""
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (plan.samples, 1)) if self.turns else None
        return replace(plan, orientation=turned)

    def reading(self, position: Array, rotation: Array, rng: np.random.Generator) -> tuple[Array, Array | None]:
        """Return one reading of poses in the measurement frame.

        Parameters
        ----------
        position, rotation
            (N, 3) m and (N, 3, 3).
        rng
            Source of the noise.

        Returns
        -------
        position
            (N, 3) m.
        orientation
            (N, 4) quaternions wxyz; ``None`` where it does not measure them.
        """
        read = position + self.noise * rng.normal(size=position.shape)
        if not self.turns:
            return read, None
        turn = exp3(self.noise_orientation * rng.normal(size=position.shape))
        return read, rotation_to_quaternion(turn @ rotation)


def instrument(measures: Any, noise: Any, noise_orientation: Any) -> Instrument:
    """Return the instrument that a user asks for; see :func:`thermal_robot.simulate`.

    Raises
    ------
    CampaignError
        A word that it does not know, a noise that is none, or one of what is not measured.
    """
    sigma = number(least=0.0, expected="one sigma per axis, 0 for none", problem="a noise cannot be negative")
    shift, turn = fitted(sigma, noise, CALL, "noise"), fitted(sigma, noise_orientation, CALL, "noise_orientation")
    what = fitted(word(_MEASURES), _MEASURES[0] if measures is None else measures, CALL, "measures")
    if turn > 0.0 and what != "pose":
        expected = 'measures="pose", or no noise of orientations'
        raise CampaignError(CALL, "only positions are measured", column="noise_orientation", expected=expected)
    return Instrument(what == "pose", shift, turn)


_RIGID = 1e-6
"""Of a rotation: by how much its entries, written with few digits, may be off."""


def placed(plan: Campaign, base: Any, tool: Any, base_known: Any, tool_known: Any) -> tuple[Campaign, Frames]:
    """Return the rows with what they declare of their frames, and the true ones.

    Parameters
    ----------
    plan
        Commands and conditions; a campaign that was taken over has frames of its own.
    base, tool, base_known, tool_known
        As for :func:`thermal_robot.simulate`.

    Raises
    ------
    CampaignError
        Something that is no pose; a frame that is said to be known and is not where it is declared.
    """
    declared = Frames.declared(plan)
    told = {"base_known": base_known, "tool_known": tool_known}
    known = {key: fitted(optional(boolean), value, CALL, key) for key, value in told.items()}
    ground = declared.base if base is None else _pose("base", base)
    point = None if tool is None else _point(tool)
    if point is not None:
        plan = replace(plan, target=point)
        target, sits = Frames.declared(plan).tool, True
    elif tool is not None:
        target, sits = _pose("tool", tool), False
        plan = replace(plan, target=target[:3, 3])
    else:
        target, sits = declared.tool, plan.tool_known
    stands = plan.base_known if base is None else False
    stands, sits = (
        own if key is None else key for own, key in ((stands, known["base_known"]), (sits, known["tool_known"]))
    )
    for key, claimed, true, where in (
        ("base_known", stands, ground, declared.base),
        ("tool_known", sits, target, Frames.declared(plan).tool),
    ):
        if claimed and not np.allclose(true, where, atol=_RIGID, rtol=0.0):
            expected = "a frame where it is declared: its error is an effect of its own"
            raise CampaignError(CALL, "the frame that is given is elsewhere", column=key, expected=expected)
    return replace(plan, base_known=stands, tool_known=sits), Frames(ground, target)


def _point(tool: Any) -> Array | None:
    """Return three numbers; ``None`` for everything else."""
    try:
        point = np.array(tool, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return point if point.shape == (3,) else None


def _pose(key: str, given: Any) -> Array:
    """Return a (4, 4) pose, seen to be rigid."""
    also = ", or three numbers" if key == "tool" else ""
    try:
        pose = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        pose = np.empty(0)
    if pose.shape == (4, 4) and np.isfinite(pose).all():
        turn = pose[:3, :3]
        right = np.allclose(turn @ turn.T, np.eye(3), atol=_RIGID) and np.linalg.det(turn) > 0.0
        if right and np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0]):
            return pose
    expected = f"a (4, 4) pose: a rotation, a shift in m, and the row 0 0 0 1{also}"
    raise CampaignError(CALL, "no pose", column=key, found=shown(given), expected=expected)


def measured(
    plan: Campaign,
    frames: Frames,
    effects: Sequence[tuple[Effect, Array]],
    instrument: Instrument,
    joints: np.random.Generator,
    readings: np.random.Generator,
) -> Campaign:
    """Return the campaign that an instrument measures of a robot with effects at work.

    Parameters
    ----------
    plan
        Commands and conditions.
    frames
        Where the robot stands and where the target sits, truly.
    effects
        Each with the (P,) values of its parameters; of one that scatters, one a joint.
    instrument
        Who measures.
    joints, readings
        Chance of what scatters, and of the instrument.

    Raises
    ------
    CampaignError
        If values are so large that no finite position follows.
    """
    systematic = [(effect, values) for effect, values in effects if not isinstance(effect, RandomEffect)]
    moved, shift = displacement(observe(plan, frames), systematic)
    moved = replace(moved, joint=np.asarray(moved.joint) + _scatter(plan, effects, joints))
    real = observe(plan, frames, displacement=moved)
    position = real.predicted_position + (0.0 if shift is None else shift)
    if not np.isfinite(position).all():
        raise CampaignError(CALL, "these values lead to no finite position", column="effects", expected="smaller ones")
    read, orientation = instrument.reading(position, frames.base[:3, :3] @ real.rotation, readings)
    found = replace(
        plan,
        position=read,
        orientation=orientation,
        noise_position=instrument.noise or None,
        noise_orientation=instrument.noise_orientation or None,
    )
    return replace(found, warnings=tuple(doubts(found)))


def _scatter(plan: Campaign, effects: Sequence[tuple[Effect, Array]], rng: np.random.Generator) -> Array:
    """(N, n) by how much joints stand elsewhere than they were told to by chance, rad or m."""
    away, pose, names = np.zeros_like(plan.q), repeated_poses(plan), plan.robot.joint_names
    for effect, sizes in effects:
        if isinstance(effect, RandomEffect):
            for joint, size in zip(effect.joints(names), sizes.tolist(), strict=True):
                j = names.index(joint)
                away[:, j] += effect.drawn(plan.q[:, j], pose, size, rng)
    return away
