"""Design matrix: derivatives of the gap (measured − predicted pose) by parameters of effects and by unknown frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect, Parameter
from thermal_robot.effects.apply import column
from thermal_robot.effects.effect import UNSOURCED
from thermal_robot.effects.gate import checked
from thermal_robot.effects.settings import SIZE_MOST
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.observables import components, of_model, tool_width
from thermal_robot.observations import Observations, observe


@dataclass(frozen=True, eq=False)
class Block:
    """Design matrix (N, m, P) of the P parameters of one effect, in one setting of its nonlinear arguments.

    ``source`` is the columns, or the observations from which they are recomputed on demand to save memory. ``bare`` are
    the parameters without responses, ``sizes`` (P,) their expected sizes with the campaign's ``[priors]``, ``spread``
    the prior standard deviation of the logarithm of the factor λ that all sizes share, ``largest_scale`` the bound of
    λ.
    """

    effect: Effect
    bare: tuple[Parameter, ...]
    source: Observations | Array
    sizes: Array
    spread: float = UNSOURCED
    largest_scale: float = np.inf

    @property
    def columns(self) -> Array:
        """Jacobian (N, m, P) of the gap by the parameters, root frame axes; columns of rounding errors are set to 0."""
        if not isinstance(self.source, Observations):
            return self.source
        found = moved_by(self.source, self.parameters)
        found[:, :, np.abs(found).max(axis=(0, 1), initial=0.0) * self.sizes < settings.UNSEEN] = 0.0
        return found

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The P parameters, with their responses unless the block stores its columns."""
        return checked(self.effect, self.source) if isinstance(self.source, Observations) else self.bare

    @property
    def positive(self) -> NDArray[np.bool_]:
        """Mask (P,) of the parameters that cannot be negative."""
        return np.array([p.positive for p in self.bare] or [False] * len(self.sizes), dtype=bool)

    @property
    def held(self) -> Block:
        """Copy of the block with its columns in memory."""
        return replace(self, source=self.columns)

    def kept(self, values: Array) -> Array:
        """Factor (P,) on prior deviations: nearly 0 for a non-negative parameter with a value of 0 or less, else 1."""
        return np.where(self.positive & (values <= 0.0), settings.LEAST_HELD, 1.0)


def block(observations: Observations, effect: Effect) -> Block:
    """Build the design matrix of an effect at some observations; :class:`EffectError` on a breach of contract."""
    campaign = observations.campaign
    parameters = checked(effect, observations)
    sizes = np.array([parameter.size for parameter in parameters])
    if of_model(campaign):
        sizes = sizes * effect.in_model_times
    if effect.name in campaign.priors and len(sizes):
        # one size is stated for the whole effect: its parameters keep their default proportions
        sizes = sizes * (campaign.priors[effect.name] / sizes[0])
    bare = tuple(parameter.bare for parameter in parameters)
    return Block(effect, bare, observations, sizes, effect.size_spread, SIZE_MOST)


def moved_by(observations: Observations, parameters: Sequence[Parameter]) -> Array:
    """Return the Jacobian (N, m, P) of the gap by P parameters, root frame axes."""
    campaign = observations.campaign
    measures = components(campaign)
    columns = np.zeros((campaign.samples, measures, len(parameters)))
    for p, parameter in enumerate(parameters):
        for response in parameter.responses:
            columns[:, :, p] += column(observations, response, measures)
    return columns


def frame_columns(observations: Observations) -> tuple[Array, tuple[str, ...]]:
    """Jacobian (N, m, f) of the gap by the unknown frames and artefacts, and the name of each column.

    Base: twist in the root frame, of rows that an instrument measured. Tool: translation of the target in the tool
    frame, and its rotation where orientation is measured. Artefacts: unknowns of the measuring set-up that rows share
    (a plane, a stand), by their names. Where the campaign brings a simulator's prediction, which includes the tool, the
    tool is not fitted.
    """
    campaign, names = observations.campaign, _unknown(observations.campaign)
    measures = components(campaign)
    parts = []
    if "base" in names:
        parts.append(observations.base_sensitivity[:, :measures, :])
    if "tool" in names:
        parts.append(observations.tool_sensitivity[:, :measures, : tool_width(campaign)])
    shared, artefacts = observations.sight.columns()
    if artefacts:
        parts.append(shared)
    if not parts:
        return np.zeros((campaign.samples, measures, 0)), ()
    return np.concatenate(parts, axis=2), (*names, *artefacts)


def hidden_joints(observations: Observations) -> tuple[str, ...]:
    """Return the joints whose zeros are gauge freedoms: their columns lie in the span of those of frames and artefacts.

    A turn of all sockets is such about the sockets, one of the target on the tool about the predicted target.
    """
    frames = frame_columns(observations)[0]
    basis, found = orthonormal(equations_of(frames)), np.zeros(observations.robot.n, dtype=bool)
    looks = [observations.joint_sensitivity]
    if observations.campaign.position is None:
        looks.append(observations.joint_sensitivity_there)
    for own in looks:
        flat = equations_of(own[:, : frames.shape[1]])
        left = np.linalg.norm(without(flat, basis), axis=0)
        found |= left <= settings.ALIAS * np.linalg.norm(flat, axis=0)
    return tuple(np.array(observations.robot.joint_names)[found].tolist())


def unknown_frames(campaign: Campaign) -> tuple[str, ...]:
    """Return the frame, ``base`` or ``tool``, or artefact to which each column of :func:`frame_columns` belongs."""
    known = _unknown(campaign)
    if campaign.position is not None or not campaign.measured:
        return known
    return (*known, *observe(campaign).sight.columns()[1])


def _unknown(campaign: Campaign) -> tuple[str, ...]:
    base = 0 if campaign.base_known else 6
    fixed = campaign.tool_known or campaign.simulated_position is not None
    return ("base",) * base + ("tool",) * (0 if fixed else tool_width(campaign))
