"""What a model file says of the parameters that are compared, in the same sums as a campaign.

The file's parameters are those of its effects in its own setting and places. They become those that are compared by
what they do to the target: X_M = X A + F B over poses within the measured ranges, F the unknown frames, so that
θ = A θ_M. An effect that does what the compared parameters cannot do stays free: it is marginalised with the frames.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects import Effect
from thermal_robot.effects.law import Discovered
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_effects import Candidate
from thermal_robot.fleet.compare_model import Known
from thermal_robot.fleet.compare_sums import Sums
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.columns import block, frame_columns, moved_by


def sums_of_model(known: Known, listed: Sequence[Candidate], number: int) -> Sums:
    """Return what a model file says of the listed effects.

    Parameters
    ----------
    known
        The model.
    listed
        Effects that are compared.
    number
        Which of the campaigns it is.
    """
    ends = np.cumsum([0, *(len(item.told) for item in listed)])
    matrix, vector = np.zeros((ends[-1],) * 2), np.zeros(ends[-1])
    if not known.effects:
        return Sums(matrix, vector)
    prior = np.asarray(known.spread.prior)
    starts = np.cumsum([0, *(len(values) for _, values in known.effects)])
    flat = _columns(known, listed, number)
    kept: list[int] = []
    across: list[Array] = []
    for (effect, _), start in zip(known.effects, starts, strict=False):
        own = block(known.corrected, effect).columns
        own = equations_of(own) * prior[start : start + own.shape[2]]
        told = _expressed(known, effect, own, listed, flat, number)
        if told is not None:
            kept += range(start, start + own.shape[1])
            across.append(told)
    if not kept:
        return Sums(matrix, vector)
    information, said = _alone(known, np.array(kept), prior)
    back = np.linalg.pinv(np.column_stack(across), rcond=compare_settings.SAME_PLACE)
    return Sums(back.T @ information @ back, back.T @ said)


def _columns(known: Known, listed: Sequence[Candidate], number: int) -> list[Array]:
    """Return (3N, P) columns of each listed effect, in expected sizes; zeros where the model lacks what it needs."""
    found = []
    for item in listed:
        own = item.parameters[number]
        columns = moved_by(known.corrected, own) * item.sizes if own else np.zeros((len(known.q), 3, len(item.told)))
        found.append(equations_of(columns))
    return found


def _expressed(
    known: Known, effect: Effect, own: Array, listed: Sequence[Candidate], flat: Sequence[Array], number: int
) -> Array | None:
    """(P, K) listed parameters for one prior deviation of each of an effect's K; ``None`` if they cannot do the same.

    Its own parameters first; then, of what contains joints' zeros, with those beside them.
    """
    name = f"{effect.name} of {known.campaign}" if isinstance(effect, Discovered) else effect.name
    alike = [k for k, item in enumerate(listed) if item.name == name and item.parameters[number]]
    inside = [k for k, item in enumerate(listed) if item.effect.told_inside and item.parameters[number]]
    frames = equations_of(frame_columns(known.corrected)[0])
    for chosen in (alike, sorted({*alike, *inside})) if alike else ():
        every = np.column_stack([*(flat[k] for k in chosen), frames])
        length = np.linalg.norm(every, axis=0)
        seen = length > compare_settings.ROUNDING * length.max()
        told = np.zeros((len(length), own.shape[1]))
        told[seen] = np.linalg.lstsq(every[:, seen] / length[seen], own, rcond=None)[0] / length[seen, None]
        left = np.linalg.norm(own - every @ told, axis=0)
        if (left <= compare_settings.DISTINCT * np.linalg.norm(own, axis=0)).all():
            return _among(told, chosen, [columns.shape[1] for columns in flat])
    return None


def _among(told: Array, chosen: Sequence[int], widths: Sequence[int]) -> Array:
    """(P, K) of all listed parameters, zero where an effect was not chosen; what the frames do is left out."""
    rows = [np.zeros((width, told.shape[1])) for width in widths]
    start = 0
    for k in chosen:
        rows[k] = told[start : start + widths[k]]
        start += widths[k]
    return np.concatenate(rows)


def _alone(known: Known, kept: NDArray[np.int64], prior: Array) -> tuple[Array, Array]:
    """Return G and b of some of the model's parameters, in prior deviations: what rows say without the prior."""
    spread = known.spread
    covariance = spread.covariance if spread.wider is None else spread.wider
    flat = len(covariance) - len(prior)
    values = np.concatenate([values for _, values in known.effects])[kept] / prior[kept]
    own = covariance[np.ix_(flat + kept, flat + kept)] / np.outer(prior[kept], prior[kept])
    # a parameter that is known as well as before has variance one, and the rows say nothing of it
    value, axes = np.linalg.eigh(0.5 * (own + own.T))
    tight = 1.0 / np.maximum(value, settings.TINY)
    seen = tight > 1.0 + compare_settings.SAYS
    return (axes[:, seen] * (tight[seen] - 1.0)) @ axes[:, seen].T, axes[:, seen] @ (
        tight[seen] * (axes[:, seen].T @ values)
    )
