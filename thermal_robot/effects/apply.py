"""From values to displacement: what an error in a channel moves, and what a set of fitted effects does to the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import Channel, Effect, Parameter, Response
from thermal_robot.effects.gate import checked, missing
from thermal_robot.errors import EffectError
from thermal_robot.kinematics import Displacement

if TYPE_CHECKING:
    from thermal_robot.observations import Observations
    from thermal_robot.robot import Robot


def sensitivity(observations: Observations, channel: Channel, index: int) -> Array:
    """Return (N, 6, k): twist of the target a unit of each of a channel's k components, root frame axes, m and rad.

    One component in a joint (rad or m), six of a twist at a segment, the base and the tool (in the frame that
    :class:`Response` states), three of a displacement of the measured point (measurement frame, m), which turns
    nothing.
    """
    if channel == "joint":
        return observations.joint_sensitivity[:, :, index, None]
    if channel == "segment":
        return observations.segment_sensitivity[:, :, index, :]
    if channel == "base":
        return observations.base_sensitivity
    if channel == "tool":
        return observations.tool_sensitivity
    shifts = np.zeros((observations.campaign.samples, 6, 3))
    shifts[:, :3] = observations.frames.base[:3, :3].T
    return shifts


def column(observations: Observations, response: Response, measures: int) -> Array:
    """Return (N, m) change of the target's pose a unit of one response, root frame axes; m = ``measures``, 3 or 6."""
    values = response.values
    moves = sensitivity(observations, response.channel, response.index)[:, :measures]
    if response.channel == "joint":
        return np.asarray(moves[:, :, 0] * (values[:, None] if values.ndim else values))
    if values.ndim == 1:
        used = np.flatnonzero(values)  # most twists move along or about one axis
        if len(used) == 1:
            return np.asarray(moves[:, :, used[0]] * values[used[0]])
        return np.asarray(moves[:, :, used] @ values[used])
    return np.asarray(np.einsum("nrk,nk->nr", moves, values))


def by_place(robot: Robot, parameter: Parameter) -> tuple[Parameter, ...]:
    """Return a parameter place by place: itself where it has one, else a part for each place that it acts on.

    A parameter without a place, such as one coefficient of expansion for all links, acts on all of them at once; the
    part at a joint, link, base, tool or instrument has the responses there.
    """
    if parameter.place:
        return (parameter,)
    named = {"segment": tuple(s.parent_link for s in robot.segments), "joint": robot.joint_names}
    parts: dict[str, tuple[Response, ...]] = {}
    for r in parameter.responses:
        place = named[r.channel][r.index] if r.channel in named else r.channel
        parts[place] = (*parts.get(place, ()), r)
    return tuple(replace(parameter, place=place, responses=responses) for place, responses in parts.items())


def displacement(
    observations: Observations, effects: Sequence[tuple[Effect, Array]]
) -> tuple[Displacement, Array | None]:
    """Displacement of the chain's four channels by fitted values (P,) of effects, and of the measured point (N, 3), m.

    The latter stands in the measurement frame, ``None`` where no effect acts on the instrument. Raises
    :class:`EffectError` if parameters break the contract, or are not as many as values: rows lack what is read.
    """
    samples, robot = observations.campaign.samples, observations.robot
    joint = np.zeros((samples, robot.n))
    segment = np.zeros((samples, len(robot.segments), 6))
    base, tool = np.zeros((samples, 6)), np.zeros((samples, 6))
    instrument: Array | None = None
    for effect, values in effects:
        for parameter, value in zip(_as_many(effect, observations, len(values)), values, strict=True):
            for response in parameter.responses:
                moved = value * response.values
                if response.channel == "joint":
                    joint[:, response.index] += moved
                elif response.channel == "segment":
                    segment[:, response.index] += moved
                elif response.channel == "base":
                    base += moved
                elif response.channel == "tool":
                    tool += moved
                else:
                    instrument = moved if instrument is None else instrument + moved
    return Displacement(joint=joint, segment=segment, base=base, tool=tool), instrument


def _as_many(effect: Effect, observations: Observations, values: int) -> tuple[Parameter, ...]:
    """Return the parameters of an effect that has so many values."""
    found = checked(effect, observations)
    if len(found) != values:
        lacking = ", ".join(missing(effect, observations))
        raise EffectError(
            f"effect {effect.name!r} was fitted with {values} parameters and has {len(found)} in these rows"
            + (f", which lack {lacking}" if lacking else "")
        )
    return found
