"""What errors of a joint follow: a smooth law of some quantity, or the steps of an encoder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.inference import settings
from thermal_robot.inference.algebra import without
from thermal_robot.inference.laws import smooth_columns
from thermal_robot.inference.target import Target

Array = NDArray[np.float64]


def followed(errors: Array, weight: Array, recorded: Mapping[str, Array], pose: NDArray[np.int64] | None = None) -> str:
    """Name the quantity that errors follow smoothly; empty where none does.

    Each quantity has an F test, its p-value multiplied by the number of quantities (Bonferroni). A law must
    also explain a good part of the errors.

    Parameters
    ----------
    errors, weight
        (K,) errors, and one over the variance of each.
    recorded
        (K,) values of each quantity, by name.
    pose
        (K,) number of each row's pose, where errors are those within a pose: the mean of each was taken out of them.
    """
    best, follows = settings.LEVEL, ""
    root = np.sqrt(weight)
    number = np.zeros(len(errors), dtype=np.int64) if pose is None else np.unique(pose, return_inverse=True)[1]
    means = np.eye(int(number.max()) + 1)[number] * root[:, None]
    means = means / np.linalg.norm(means, axis=0)
    target = Target(without(errors * root, means), root[:, None], means)
    for name, values in recorded.items():
        columns = smooth_columns(values) if np.ptp(values) > settings.ROUNDING else np.zeros((len(values), 0))
        worth = target.worth(columns[:, None, :])
        p = worth.p_value * len(recorded)
        if p < best and worth.share > settings.SCATTER_LAW_SHARE:
            best, follows = p, name
    return follows


@dataclass(frozen=True)
class Steps:
    """What a periodogram says of steps.

    Attributes
    ----------
    step
        Period of the errors along the command, rad or m; where none is seen, that which their size implies.
    p_value
        Of the hypothesis that there is no period; ``None`` where there are too many to search.
    visible
        Whether steps would be seen if all of the errors came from them.
    """

    step: float
    p_value: float | None
    visible: bool


def period(errors: Array, weight: Array, command: Array, step: float) -> Steps:
    """Look for the period with which errors repeat along the command, as those of an encoder do.

    The size of the errors implies a step, and the periodogram (Scargle 1982) is searched near it. At a frequency that
    the errors do not have, its height is exponentially distributed: this gives the p-value.

    Parameters
    ----------
    errors, weight
        (K,) errors, rad or m, and one over the variance of each.
    command
        (K,) commanded position of the joint, rad or m.
    step
        That the size of the errors implies, rad or m.
    """
    from scipy.fft import next_fast_len, rfft

    highest = settings.BAND / step
    cell = settings.STEP_CELL / highest  # rounding the command to it costs 3 % of the height
    place = np.round((command - command.min()) / cell).astype(np.int64)
    if place.max() > settings.MOST_CELLS:
        return Steps(step, None, False)
    size = weight * (errors - float(weight @ errors / weight.sum()))
    length = int(next_fast_len(2 * int(place.max()) + 2, real=True))
    frequency = np.arange(length // 2 + 1) / (length * cell)
    power = np.abs(rfft(np.bincount(place, size, length))) ** 2 / float((size**2).sum())
    near = (frequency > highest / settings.BAND**2) & (frequency < highest)
    if not near.any():
        return Steps(step, None, False)
    best = int(np.argmax(np.where(near, power, -1.0)))
    tried = int(near.sum())
    p = float(-np.expm1(tried * np.log1p(-np.exp(-power[best]))))
    # the first harmonic holds 6/π² of a sawtooth's power; the root of a height is normal with variance 1/2
    expected = settings.SAWTOOTH_POWER * float((weight * step**2 / settings.FLAT).sum())
    seen = np.sqrt(expected) > np.sqrt(np.log(tried) - np.log(settings.REFUTED)) + settings.HEIGHT_SIGMAS
    if power[best] < settings.STEPPED * expected:
        p = 1.0 if seen else p  # a ripple on errors of another kind
    return Steps(float(1.0 / frequency[best]) if p < settings.LEVEL else step, p, bool(seen))
