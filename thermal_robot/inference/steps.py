"""What errors of a joint follow: a smooth law of some quantity, or the steps of an encoder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, i0e, logsumexp

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
    log_factor
        Natural logarithm of the Bayes factor of steps against errors without a period; 0 where it cannot be asked.
    """

    step: float
    log_factor: float


def period(errors: Array, weight: Array, command: Array, step: float) -> Steps:
    """Look for the period with which errors repeat along the command, as those of an encoder do.

    The size of the errors implies a step, and the periodogram P (Scargle 1982) is searched near it. With a share ρ of
    the errors' variance in a wave of unknown phase, the likelihood ratio at one frequency, averaged over phases, is
    (1 - ρ)^(-K/2) exp(-K ρ/(1 - ρ)) I₀(√(2 ρ K P)/(1 - ρ)) (Bretthorst, *Bayesian Spectrum Analysis*, 1988, ch. 2, with
    a known amplitude). The Bayes factor is its mean over the frequencies near that of the implied step.

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
        return Steps(step, 0.0)
    size = weight * (errors - float(weight @ errors / weight.sum()))
    length = int(next_fast_len(2 * int(place.max()) + 2, real=True))
    frequency = np.arange(length // 2 + 1) / (length * cell)
    near = (frequency > highest / settings.BAND**2) & (frequency < highest)
    if not near.any():
        return Steps(step, 0.0)
    frequency, count = frequency[near], len(errors)
    power = np.abs(rfft(np.bincount(place, size, length))[near]) ** 2 / float((size**2).sum())
    share = settings.SAWTOOTH_POWER * float(np.minimum(weight * step**2 / settings.FLAT, 1.0).mean())
    reach = np.sqrt(2.0 * share * count * power) / (1.0 - share)
    level = -0.5 * count * np.log1p(-share) - count * share / (1.0 - share)
    factor = float(level + logsumexp(np.log(i0e(reach)) + reach) - np.log(len(power)))
    sure = factor > settings.STEP_SURE
    return Steps(float(1.0 / frequency[np.argmax(power)]) if sure else step, factor)


def stepped(log_factors: Sequence[float], *, again: bool) -> float:
    """Return the probability that joints which err anew from pose to pose do so by the steps of their encoders.

    Parameters
    ----------
    log_factors
        Of each joint: see :class:`Steps`.
    again
        Whether later visits of a pose find the same error, so that wear is none.
    """
    hidden = np.log(settings.STEPS_HIDDEN)
    seen = np.logaddexp(np.log1p(-settings.STEPS_HIDDEN) + np.asarray(log_factors, dtype=float), hidden).sum()
    return float(expit(seen - np.log(settings.RIVALS_AGAIN if again else settings.RIVALS_ONCE)))
