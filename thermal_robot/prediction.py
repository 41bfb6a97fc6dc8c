"""Predictive uncertainty of a corrected model, from parameters, residual and instrument; tests for extrapolation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.settings import STILL
from thermal_robot.effects import Effect, gate, settings
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.kernels import chunks
from thermal_robot.observations import Observations


@dataclass(frozen=True)
class FileGap:
    """Expected rms distance, m, on rows held out with a robot file alone: base and tool are registered anew.

    Attributes
    ----------
    holds
        What the file holds: ``placements``, ``zeros`` or ``ticks``.
    min_sigma
        Standard deviations from zero below which parameters are left out; ``None`` for a file with all.
    rms_before, rms_after
        With the nominal robot and with the file.
    shrinkage, shrinkage_ci95
        Share of the gap's mean square that the file removes, and the 95 % interval for other rows of the same kind.
    alone
        Displacement (n + 6 S) of joints and segments, m and rad, of a file that was fitted anew, to be used without the
        rest of the model; empty for one that holds the model's own values.
    """

    holds: str
    min_sigma: float | None
    rms_before: float
    rms_after: float
    shrinkage: float
    shrinkage_ci95: tuple[float, float]
    alone: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Spread:
    """Predictive uncertainty of a model, and the range in which it was measured.

    Attributes
    ----------
    covariance
        (K, K) of the errors of the frames' step and of the effects' parameters, in the order of :func:`sensitivity`.
    beyond
        (3,) one sigma per axis of the residual that neither frames nor effects explain, measurement frame, m.
    noise
        (3,) one sigma per axis of the instrument, measurement frame, m; rows held out tell it with ``beyond``.
    ranges
        Least and largest value that was measured, by joint and by column that the model needs, SI.
    wider
        (K, K) the same covariance for rows outside these ranges; ``None`` where it is no other.
    prior
        (P,) standard deviation that each of the effects' parameters was expected to have before the data, in its unit;
        ``None`` where a file of an older program does not say.
    levels
        By label, such as the session: those that were measured.
    between
        (3,) one sigma per axis by which what is left of one label's rows differs from that of another's, m.
    """

    covariance: Array
    beyond: Array
    noise: Array
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    wider: Array | None = None
    prior: Array | None = None
    levels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    between: Array | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        arrays = {name: getattr(self, name).tolist() for name in ("covariance", "beyond", "noise")}
        more = {"wider": self.wider, "prior": self.prior, "between": self.between}
        told = {name: values.tolist() for name, values in more.items() if values is not None}
        levels = {"levels": {name: list(own) for name, own in self.levels.items()}} if self.levels else {}
        return {**arrays, **told, **levels, "ranges": {name: list(ends) for name, ends in self.ranges.items()}}

    def std(
        self,
        observations: Observations,
        effects: Sequence[tuple[Effect, Array]],
        outside: Sequence[tuple[str, ...]],
        noise: bool,
    ) -> Array:
        """Return the standard deviation (N, 3) per axis of a prediction, measurement frame, m.

        NaN where the covariance is of other effects.

        Parameters
        ----------
        observations
            Observations of the corrected model.
        effects
            Its effects with their (P,) values.
        outside
            Extrapolation of the same rows, as :meth:`outside` returns it.
        noise
            Whether to include the instrument's noise.
        """
        moved = sensitivity(observations, [effect for effect, _ in effects])
        if moved.shape[2] != len(self.covariance):
            return np.full(moved.shape[:2], np.nan)
        variance = by_parameters(moved, self.covariance)
        if self.wider is not None:
            away = np.flatnonzero([bool(names) for names in outside])
            variance[away] = by_parameters(moved[away], self.wider)
        variance += self.beyond**2 + (self.noise**2 if noise else 0.0)
        first = moved.shape[2] - sum(len(values) for _, values in effects)
        for effect, values in effects:
            own, edge = slice(first, first + len(values)), gate.unfaded(effect)
            first = own.stop
            if edge != effect:  # what it may still be where nobody knows: as much as was given up
                given_up = sensitivity(observations, [edge])[:, :, -len(values) :] - moved[:, :, own]
                variance += (given_up @ values) ** 2
        for label, levels in self.levels.items():
            new = np.flatnonzero([label in names for names in outside])
            if new.size and len(levels) > 1:
                variance[new] += self._apart(observations, effects, label)[new] * (1.0 + 1.0 / len(levels))
        return np.asarray(np.sqrt(variance))

    def _apart(self, observations: Observations, effects: Sequence[tuple[Effect, Array]], label: str) -> Array:
        """Variance (N, 3) per axis, m², of the effects' displacement over the levels of a label, plus ``between``²."""
        campaign, moved = observations.campaign, []
        for level in self.levels[label]:
            labels = {**campaign.labels, label: np.full(campaign.samples, level)}
            there = replace(observations, campaign=replace(campaign, labels=labels))
            at = [sensitivity(there, [effect])[:, :, -len(values) :] @ values for effect, values in effects]
            moved.append(sum(at, np.zeros((campaign.samples, 3))))
        left = np.zeros(3) if self.between is None else self.between
        return np.asarray(np.var(moved, axis=0, ddof=1) + left**2)

    def outside(self, samples: Campaign, effects: Sequence[tuple[Effect, Array]] = ()) -> tuple[tuple[str, ...], ...]:
        """Joints, columns and labels in which each row leaves the measured range (extrapolation).

        A row without a label counts as outside if one of the effects follows that label.
        """
        followed = {effect.quantity for effect, _ in effects if isinstance(effect, Discovered) and effect.labels}
        joints = samples.robot.joint_names
        left: list[list[str]] = [[] for _ in range(samples.samples)]
        for name, (low, high) in self.ranges.items():
            values = samples.q[:, joints.index(name)] if name in joints else samples.covariates.get(name)
            if values is None:
                continue
            allowed = max(settings.BESIDE * (high - low), STILL if name in joints else 0.0)
            for row in np.flatnonzero((values < low - allowed) | (values > high + allowed)):
                left[row].append(name)
        for label, levels in self.levels.items():
            own = np.full(samples.samples, "" if label in followed else levels[0])
            for row in np.flatnonzero(~np.isin(samples.labels.get(label, own), levels)):
                left[row].append(label)
        return tuple(tuple(names) for names in left)


class Prediction(NamedTuple):
    """Predicted measurement with its standard deviation.

    Attributes
    ----------
    position
        (N, 3) in the measurement frame, m.
    orientation
        (N, 4) quaternions wxyz; ``None`` where the campaign measured positions only.
    std
        (N, 3) one standard deviation per axis, measurement frame, m; NaN where the model does not tell.
    outside
        Per row: the joints, columns and labels in which it leaves what was measured.
    """

    position: Array
    orientation: Array | None
    std: Array
    outside: tuple[tuple[str, ...], ...]


def sensitivity(observations: Observations, effects: Sequence[Effect]) -> Array:
    """Jacobian (N, 3, K) of the target's position by the unknown frames and the effects' parameters.

    Columns as :func:`~thermal_robot.inference.columns.frame_columns` orders them, those that turn the target left out,
    then each effect's parameters. In the axes of the measurement frame; m per unit of each.
    """
    frames, names = frame_columns(observations)
    columns = [frames[:, :3, moves(names)]]
    columns += [block(observations, effect).columns[:, :3].copy() for effect in effects]  # of poses three of six
    found = np.concatenate(columns, axis=2)
    for part in chunks(len(found)):
        found[part] = observations.frames.base[:3, :3] @ found[part]
    return found


def moves(names: Sequence[str]) -> NDArray[np.bool_]:
    """Mask (f,) of the unknown frames' columns, by name, that move the target: of the base, and tool translations."""
    place = [name == "base" or (name == "tool" and k < names.index("tool") + 3) for k, name in enumerate(names)]
    return np.array(place, dtype=bool)


def by_parameters(moved: Array, covariance: Array) -> Array:
    """Propagated variance (N, 3) per axis of a covariance C (K, K) of parameters, m²: diag(J C Jᵀ), J (N, 3, K)."""
    found = np.empty(moved.shape[:2])
    for part in chunks(len(found)):
        found[part] = ((moved[part] @ covariance) * moved[part]).sum(axis=2)
    return np.asarray(np.maximum(found, 0.0))
