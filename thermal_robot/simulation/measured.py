"""From commands to measurements: joints scatter, effects displace, the instrument reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.campaign.plausible import doubts
from thermal_robot.effects import Effect, RandomEffect
from thermal_robot.effects.apply import displacement
from thermal_robot.errors import CampaignError
from thermal_robot.inference.rows import repeated_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.simulation.commanded import CALL
from thermal_robot.simulation.instrument import Instrument

Array = NDArray[np.float64]


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
