"""From effects to columns: what each parameter does to the gap, and what a set of values does to the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.effects import Effect, Parameter, Response
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Observations

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Block:
    """The parameters of one effect (in one setting of its nonlinear arguments) as columns.

    Attributes
    ----------
    effect
        The effect, its arguments set.
    parameters
        Its P parameters.
    columns
        (N, m, P) derivative of the gap by each parameter, root frame axes.
    sizes
        (P,) expected size of each parameter, the campaign's ``[priors]`` applied.
    """

    effect: Effect
    parameters: tuple[Parameter, ...]
    columns: Array
    sizes: Array


def column(observations: Observations, response: Response, measures: int) -> Array:
    """(N, m) change of the target's pose in the root frame a unit of one response."""
    values, rows = response.values, slice(0, measures)
    if response.channel == "instrument":
        full = np.zeros((len(values), 6))
        full[:, :3] = values @ observations.frames.base[:3, :3]
        return full[:, rows]
    if response.channel == "joint":
        direction = observations.joint_sensitivity[:, rows, response.index]
        return direction * (values[:, None] if values.ndim else values)
    sensitivity = {
        "segment": lambda: observations.segment_sensitivity[:, rows, response.index, :],
        "base": lambda: observations.base_sensitivity[:, rows, :],
        "tool": lambda: observations.tool_sensitivity[:, rows, :],
    }[response.channel]()
    if values.ndim == 1:
        used = np.flatnonzero(values)  # most twists move along or about one axis
        return np.asarray(sensitivity[:, :, used] @ values[used])
    return np.asarray(np.einsum("nrk,nk->nr", sensitivity, values))


def block(observations: Observations, effect: Effect) -> Block:
    """Return an effect's columns at the observations' place."""
    campaign = observations.campaign
    measures = 6 if campaign.measures == "pose" else 3
    parameters = effect.parameters(observations)
    columns = np.zeros((campaign.samples, measures, len(parameters)))
    for p, parameter in enumerate(parameters):
        for response in parameter.responses:
            columns[:, :, p] += column(observations, response, measures)
    sizes = np.array([parameter.size for parameter in parameters])
    if effect.name in campaign.priors and len(sizes):
        # one size is stated for the effect; where its parameters differ in unit, their default proportions stay
        sizes = sizes * (campaign.priors[effect.name] / sizes[0])
    return Block(effect, parameters, columns, sizes)


def frame_columns(observations: Observations) -> tuple[Array, tuple[str, ...]]:
    """(N, m, f) derivative of the gap by the unknown frames, and what each column is.

    Base: twist in the root frame. Tool: translation of the target in the tool frame, and its turn where orientation is
    measured. An unknown tool is not refitted to a simulator's prediction.
    """
    campaign = observations.campaign
    measures = 6 if campaign.measures == "pose" else 3
    parts, names = [], []
    if not campaign.base_known:
        parts.append(observations.base_sensitivity[:, :measures, :])
        names += ["base"] * 6
    if not campaign.tool_known and campaign.simulated_position is None:
        parts.append(observations.tool_sensitivity[:, :measures, :measures])
        names += ["tool"] * measures
    if not parts:
        return np.zeros((campaign.samples, measures, 0)), ()
    return np.concatenate(parts, axis=2), tuple(names)


def displacement(
    observations: Observations, effects: Sequence[tuple[Effect, Array]]
) -> tuple[Displacement, Array | None]:
    """Return what a set of fitted values does: the displacement of the chain, and of the measured point.

    Parameters
    ----------
    observations
        What the responses are read from.
    effects
        Each effect with the (P,) values of its parameters.

    Returns
    -------
    displacement
        The four channels.
    instrument
        (N, 3) in the measurement frame, m; ``None`` where no effect acts on the instrument.
    """
    samples, robot = observations.campaign.samples, observations.robot
    joint = np.zeros((samples, robot.n))
    segment = np.zeros((samples, len(robot.segments), 6))
    base, tool = np.zeros((samples, 6)), np.zeros((samples, 6))
    instrument: Array | None = None
    for effect, values in effects:
        for parameter, value in zip(effect.parameters(observations), values, strict=True):
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
