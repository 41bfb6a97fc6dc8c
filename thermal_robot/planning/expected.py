"""How well a campaign will know each effect: posterior standard deviations of the linear Gaussian model.

All effects are y = F f + Σ_b X_b θ_b + e, θ ~ N(0, S²) with S the expected sizes, the frames f unknown. The covariance
of θ is (1 + S G S)⁻¹, scaled by S, with G the whitened products: it does not depend on what will be measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis import settings as design
from thermal_robot.effects import Effect, Parameter
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.columns import Block, block, frame_columns
from thermal_robot.inference.problem import Linear, Whitening, whitened
from thermal_robot.observations import Observations

FRAMES = "unknown frames"


@dataclass(frozen=True)
class ExpectedParameter:
    """How well one parameter will be known.

    Attributes
    ----------
    label, place, unit
        What it is, where, and its unit.
    size
        Expected size: its standard deviation before anything is measured.
    sigma, beside
        Its standard deviation afterwards, with the frames unknown: were this effect the only one at work, and were all
        of them.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain"])
    >>> known = found.effect("joint_gain").parameters[1]
    >>> known.place, known.told, known.sigma < known.size
    ('joint_2', True, True)
    """

    label: str
    place: str
    unit: str
    size: float
    sigma: float
    beside: float

    @property
    def told(self) -> bool:
        """Whether it will be known, alone, to less than half its size."""
        return self.sigma < settings.DETERMINED * self.size

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {**vars(self), "told": self.told}


@dataclass(frozen=True)
class Expected:
    """How well one effect will be known.

    Attributes
    ----------
    name, title
        The effect.
    parameters
        Its parameters.
    confounded
        What takes the knowledge of at least one of its parameters away: other effects by name, each beside it alone,
        and ``"unknown frames"``.
    lacks
        What the campaign would have to record for it to be testable; it then has no parameters.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.planning import plan
    >>> found = plan(tr.load_robot("builtin:rv_m2", "tool0"), rows=12, effects=["joint_gain", "tracking_lag"])
    >>> found.effect("tracking_lag").lacks[0]
    'velocity.joint_1'
    """

    name: str
    title: str
    parameters: tuple[ExpectedParameter, ...]
    confounded: tuple[str, ...] = ()
    lacks: tuple[str, ...] = ()

    @property
    def told(self) -> bool:
        """Whether at least one of its parameters will be known to less than half its size."""
        return any(parameter.told for parameter in self.parameters)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        parameters = [parameter.to_dict() for parameter in self.parameters]
        return {**vars(self), "confounded": list(self.confounded), "lacks": list(self.lacks), "parameters": parameters}


@dataclass(frozen=True, eq=False)
class Columns:
    """What unit errors do to the rows, in units of the noise; a parameter's unit is its expected size.

    Attributes
    ----------
    frames, effects
        (N, m, f) and (N, m, P).
    blocks
        The effects, in the order of their columns.
    """

    frames: Array
    effects: Array
    blocks: tuple[Block, ...]

    @classmethod
    def of(cls, observations: Observations, effects: Sequence[Effect], noise: Array) -> Columns:
        """Return the columns of effects in rows whose components have the noise (m,), m and rad."""
        items = tuple(block(observations, effect) for effect in effects)
        frames = frame_columns(observations)[0] * design.LOOSE
        rows, measures, flat = frames.shape
        linear = Linear(np.zeros((rows, measures)), frames, items)
        stack = whitened(linear, Whitening(np.ones(rows), noise, 0.0)).reshape(rows, measures, -1)
        sizes = np.concatenate([*(item.sizes for item in items), np.zeros(0)])
        return cls(stack[:, :, :flat], stack[:, :, flat:-1] * sizes, items)

    @property
    def root(self) -> Array:
        """(N, m, f + P) all columns."""
        return np.concatenate([self.frames, self.effects], axis=2)

    @property
    def information(self) -> float:
        """Of all rows about the effects' parameters, nats."""
        flat, precision = self.frames.shape[2], self.precision
        whole, known = (np.linalg.slogdet(part)[1] for part in (precision, precision[:flat, :flat]))
        return float(0.5 * (whole - known))

    @property
    def precision(self) -> Array:
        """(f + P, f + P) of the posterior, in units of the expected sizes."""
        flat = equations_of(self.root)
        return np.asarray(flat.T @ flat + np.eye(flat.shape[1]))


def expectations(columns: Columns) -> tuple[Expected, ...]:
    """Return how well each effect of the columns will be known."""
    flat, precision = columns.frames.shape[2], columns.precision
    ends = np.cumsum([flat, *(len(item.sizes) for item in columns.blocks)])
    own = [np.arange(a, b) for a, b in pairwise(ends)]
    frames, whole = np.arange(flat), _left(precision, np.arange(len(precision)))
    found = []
    for b, item in enumerate(columns.blocks):
        alone = _left(precision, np.concatenate([frames, own[b]]))[flat:]
        told = alone < settings.DETERMINED
        lost = [FRAMES] if (~told & (_left(precision, own[b]) < settings.DETERMINED)).any() else []
        for other, rival in enumerate(columns.blocks):
            if other != b and told.any():
                both = _left(precision, np.concatenate([frames, own[b], own[other]]))[flat : flat + len(own[b])]
                lost += [rival.effect.name] if (told & (both >= settings.DETERMINED)).any() else []
        pairs = zip(item.bare, item.sizes, alone, whole[own[b]], strict=True)
        parameters = tuple(_parameter(*each) for each in pairs)
        found.append(Expected(item.effect.name, item.effect.title, parameters, tuple(lost)))
    return tuple(found)


def _parameter(bare: Parameter, size: float, alone: float, beside: float) -> ExpectedParameter:
    size = float(size)
    return ExpectedParameter(bare.label, bare.place, bare.unit, size, size * float(alone), size * float(beside))


def _left(precision: Array, which: NDArray[np.int64]) -> Array:
    """(k,) standard deviations, as shares of the expected sizes, were no other parameters at work."""
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(precision[np.ix_(which, which)]))))
