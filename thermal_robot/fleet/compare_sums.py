"""What each campaign says of the parameters that are compared: its sums of products, frames projected out.

With y the gap, X the columns of all parameters and F those of the unknown frames, whitened by the campaign's own noise,

    G = Xᵀ(1 − F F⁺)X,   b = Xᵀ(1 − F F⁺)y.

What an unknown frame takes up, such as the first joint's zero, is not in G: campaigns are compared without it. Where
what remains is no noise, rows say less than they seem to: along each axis of G the information is divided by as much as
the variance of the parameters exceeds what independent rows would give (:mod:`thermal_robot.diagnosis.deviations`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.deviations import exceeding
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_effects import Candidate
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.columns import Block, block, frame_columns, moved_by
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.inside import distinct
from thermal_robot.inference.problem import Linear, whitened


@dataclass(frozen=True, eq=False)
class Sums:
    """What one campaign says, in units of its noise and of the expected sizes.

    Attributes
    ----------
    matrix, vector
        G (P, P) and b (P,).
    """

    matrix: Array
    vector: Array

    @property
    def inverse(self) -> tuple[Array, Array]:
        """(P, P) pseudo-inverse of G, and (P,) part of each parameter's direction that G sees."""
        value, axes = np.linalg.eigh(self.matrix)
        seen = value > settings.INFORMATION_FLOOR
        return (axes[:, seen] / value[seen]) @ axes[:, seen].T, np.asarray((axes[:, seen] ** 2).sum(axis=1))

    def some(self, kept: Sequence[int]) -> Sums:
        """Return what it says with the other parameters at zero."""
        return Sums(self.matrix[np.ix_(kept, kept)], self.vector[list(kept)])


def sums(found: Diagnosis, fit: Fit, listed: Sequence[Candidate], number: int) -> Sums:
    """Return what a campaign says of the listed effects.

    Parameters
    ----------
    found, fit
        Its diagnosis, and the fit behind it.
    listed
        Effects that are compared.
    number
        Which of the campaigns it is.
    """
    at, e = fit.corrected, fit.explanation
    gap = at.gap + sum((block(at, effect).columns @ values for effect, values in fit.effects), np.zeros_like(at.gap))
    measures = gap.shape[1]
    blocks = []
    for item in listed:
        own = item.parameters[number]
        columns = moved_by(at, own) if own else np.zeros((len(gap), measures, len(item.told)))
        blocks.append(Block(item.effect, item.told, columns * item.sizes, np.ones(len(item.told))))
    linear = Linear(gap, frame_columns(at)[0], tuple(blocks))
    stack = whitened(linear, e.whitening)
    matrix, vector = _projected(stack.T @ stack / e.best.noise**2, linear.frames.shape[2])
    left = found.unexplained if found.remaining is None else found.remaining
    value, axes = np.linalg.eigh(matrix)
    value = np.maximum(value, 0.0)
    times = exceeding(fit, linear, value, axes) if left.flagged else np.ones(len(value))
    return Sums((axes * (value / times)) @ axes.T, axes @ ((axes.T @ vector) / times))


def _projected(full: Array, flat: int) -> tuple[Array, Array]:
    """(P, P) and (P,) products without the first columns, what is left of their aliases set to zero.

    Rounding leaves something, and so does a base that rocks: a shift of the first link is then no more exactly one of
    the base, and a campaign would tell it to decimetres.
    """
    along = whitener(full[:flat, :flat]).T @ full[:flat, flat:]
    rest, before = full[flat:, flat:] - along.T @ along, np.diag(full)[flat:-1]
    matrix, vector = 0.5 * (rest + rest.T)[:-1, :-1], rest[:-1, -1]
    value, axes = np.linalg.eigh(matrix)
    floor = max(compare_settings.SAYS, settings.PROJECTED_FLOOR * float(before.max(initial=0.0)))
    seen = value > floor
    return (axes[:, seen] * value[seen]) @ axes[:, seen].T, axes[:, seen] @ (axes[:, seen].T @ vector)


def told(said: Sequence[Sums]) -> list[int]:
    """Return the parameters that are told: none that campaigns together do not see, or see as others before it."""
    together = np.sum([one.matrix for one in said], axis=0)
    value, axes = np.linalg.eigh(together)
    root = (axes * np.sqrt(np.maximum(value, 0.0))).T
    length = np.sqrt(np.maximum(np.diag(together), 0.0))
    seen = length > np.sqrt(settings.INFORMATION_FLOOR)
    return distinct(root / np.where(seen, length, 1.0), seen, compare_settings.DISTINCT)
