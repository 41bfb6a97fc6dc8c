"""Application of effects: Jacobians of the channels, and the displacement by fitted effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import gate
from thermal_robot.effects.effect import Channel, Effect, Parameter, Response
from thermal_robot.errors import EffectError, ThermalRobotError
from thermal_robot.kinematics import Displacement, left_jacobian
from thermal_robot.observables import instrument_rows

if TYPE_CHECKING:
    from thermal_robot.observations import Observations
    from thermal_robot.robot import Robot


def sensitivity(observations: Observations, channel: Channel, index: int) -> Array:
    """Twist (N, 6, k) of the target per unit of each of a channel's k components, root frame axes, m and rad.

    One component in a joint (rad or m), six of a twist at a segment, the base and the tool (in the frame that
    :class:`Response` states), three of a displacement of the measured point (measurement frame, m), which turns
    nothing.
    """
    if channel == "joint":
        return observations.joint_sensitivity[:, :, index, None]
    if channel == "segment":
        return observations.segment_sensitivity[:, :, index, :]
    if channel in ("base", "tool"):
        found, side = (
            (observations.base_sensitivity, 1.0) if channel == "base" else (observations.tool_sensitivity, -1.0)
        )
        twist = _set_twist(observations, channel)
        return found if twist is None else found @ left_jacobian(side * twist)
    shifts = np.zeros((observations.campaign.samples, 6, 3))
    shifts[instrument_rows(observations.campaign), :3] = observations.frames.base[:3, :3].T
    return shifts


def _set_twist(observations: Observations, channel: Channel) -> Array | None:
    """Return the twist (6,) that displaces a frame in all rows alike; none where it follows a quantity, being small."""
    moved = np.asarray(getattr(observations.displacement, channel, None))
    return moved[0] if moved.ndim == 2 and moved.any() and (moved == moved[0]).all() else None


def column(observations: Observations, response: Response, measures: int) -> Array:
    """Displacement (N, m) of the target's pose per unit of one response, root frame axes; m = ``measures``, 3 or 6."""
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
    """Split a parameter by place: itself where it has one, else a part for each place that it acts on.

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
    :class:`EffectError` if parameters break the contract, or their number differs from that of the values because
    columns are missing.
    """
    samples, robot = observations.campaign.samples, observations.robot
    joint, segment = np.zeros((samples, robot.n)), np.zeros((samples, len(robot.segments), 6))
    whole = {"base": np.zeros((samples, 6)), "tool": np.zeros((samples, 6)), "instrument": np.zeros((samples, 3))}
    channels = set()
    for effect, values in effects:
        parameters = gate.checked(effect, observations)
        if len(parameters) != len(values):
            lacking = ", ".join(gate.missing(effect, observations))
            raise EffectError(
                f"effect {effect.name!r} was fitted with {len(values)} parameters and has {len(parameters)} in these "
                "rows" + (f", which lack {lacking}" if lacking else "")
            )
        for parameter, value in zip(parameters, values, strict=True):
            for response in parameter.responses:
                each = {"joint": joint, "segment": segment}.get(response.channel)
                moved = whole[response.channel] if each is None else each[:, response.index]
                moved += value * response.values
                channels.add(response.channel)
    displaced = Displacement(joint=joint, segment=segment, base=whole["base"], tool=whole["tool"])
    return displaced, whole["instrument"] if "instrument" in channels else None


def depends_on(effect: Effect, observations: Observations) -> tuple[str, ...]:
    """Return the columns of :func:`gate.reads` on which the displacement by a fitted effect depends.

    A column counts unless the effect's parameters stay the same without it and with other values in it. Raises
    :class:`EffectError` if the effect breaks the contract.
    """
    campaign, own = observations.campaign, gate.checked(effect, observations)
    read = gate.reads(effect, observations)

    def same(columns: Sequence[str], other: Mapping[str, Array]) -> bool:
        covariates = {name: values for name, values in campaign.covariates.items() if name not in columns}
        try:
            changed = replace(campaign, covariates={**covariates, **other})
            return _alike(own, gate.checked(effect, replace(observations, campaign=changed)))
        except ThermalRobotError:  # such rows cannot be: nothing says that they would not matter
            return False

    def others(column: str) -> tuple[Array, ...]:
        values = campaign.covariates[column]
        moved = np.roll(values, 1)  # those of other rows, or one more and one less where all are one
        return (moved,) if np.any(moved != values) else (values - 1.0, values + 1.0)

    spare = [c for c in read if same([c], {}) and any(same([c], {c: other}) for other in others(c))]
    return tuple(c for c in read if c not in spare) if same(spare, {}) else read


def _alike(some: Sequence[Parameter], others: Sequence[Parameter]) -> bool:
    """Whether two lists of parameters have the same names and the same responses, value by value."""
    one, two = ([(p.name, r.channel, r.index, r.values) for p in own for r in p.responses] for own in (some, others))
    named = [p.name for p in some] == [p.name for p in others]
    pairs = zip(one, two, strict=False)
    return named and len(one) == len(two) and all(a[:3] == b[:3] and np.array_equal(a[3], b[3]) for a, b in pairs)
