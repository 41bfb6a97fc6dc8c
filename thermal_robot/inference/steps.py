"""What errors of a joint follow: a smooth law of some quantity, or the steps of an encoder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_ndtr, logsumexp

from thermal_robot.arrays import Array
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import without
from thermal_robot.inference.laws import smooth_columns
from thermal_robot.inference.target import Target


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
    """What errors say of steps.

    Attributes
    ----------
    step
        Distance of the positions at which the joint stands, rad or m; where none is seen, that which the errors' size
        implies.
    log_factor
        Natural logarithm of the Bayes factor of steps against errors without any; 0 where it cannot be asked.
    """

    step: float
    log_factor: float


def period(errors: Array, variance: Array, command: Array, step: float) -> Steps:
    """Look for the distance of the only positions at which a joint stands, where an encoder counts in steps.

    The joint stands at the multiple of the step s, from a first position φ on, that is nearest to its command. Its
    error is then a sawtooth of the command, u s with u from -½ to ½, and is seen with its variance v and a slack of the
    steps; without steps it is normal with the variance v + s²/12. The Bayes factor is the ratio of these likelihoods,
    its mean over φ, over slacks, and over the frequencies 1/s near that which the size of the errors implies. The
    logarithm of a row's likelihood is periodic in φ less the command: by its Fourier series the sum over rows is one
    of waves exp(2π i k command/s).

    Parameters
    ----------
    errors, variance
        (K,) errors, rad or m, and the variance of each from everything but steps.
    command
        (K,) commanded position of the joint, rad or m.
    step
        That the size of the errors implies, rad or m.
    """
    some = np.linspace(0.0, len(errors) - 1.0, min(len(errors), settings.STEP_POSES)).round().astype(np.int64)
    errors, variance, command = errors[some] / step, variance[some] / step**2, (command - command.mean())[some] / step
    without = float(_normal(errors, 0.0, variance + 1.0 / settings.FLAT).sum())
    tried = [_tried(errors, variance, command, slack) for slack in settings.STEP_SLACKS]
    if not all(len(frequency) for frequency, _ in tried):
        return Steps(step, 0.0)
    means = [float(logsumexp(each) - np.log(len(each))) for _, each in tried]
    factor = float(logsumexp(means) - np.log(len(means))) - without
    frequency, each = tried[int(np.argmax(means))]
    return Steps(step / float(frequency[np.argmax(each)]) if factor > settings.STEP_SURE else step, factor)


def _tried(errors: Array, variance: Array, command: Array, slack: float) -> tuple[Array, Array]:
    """Return frequencies, and the log likelihood of steps of each, its mean over their phase; in implied steps.

    There are none where there would be too many.
    """
    known = variance + slack**2
    width = 1.0 / (max(float(command.std()), 1.0) * np.sqrt(max(float((1.0 / known).sum()), (2.0 * np.pi) ** 2)))
    bands = np.geomspace(1.0 / settings.BAND, settings.BAND, settings.STEP_BANDS + 1)
    if (bands[-1] - bands[0]) / width * len(errors) > settings.MOST_ANGLES:
        return np.zeros(0), np.zeros(0)
    frequencies, likelihoods = [], []
    for low, high in pairwise(bands):
        here, frequency = float(np.sqrt(low * high)), np.arange(low, high, width)
        series = _series(errors * here, known * here**2, slack)
        waves = [_sums(c, k * command, low, width, len(frequency)) for k, c in enumerate(series.T)]
        of_phase = np.fft.irfft(np.stack(waves), settings.STEP_PHASES, axis=0) + len(errors) * np.log(here)
        likelihoods.append(logsumexp(of_phase, axis=0) - np.log(settings.STEP_PHASES))
        frequencies.append(frequency)
    return np.concatenate(frequencies), np.concatenate(likelihoods)


def _normal(x: Array, mean: Array | float, variance: Array) -> Array:
    return np.asarray(-0.5 * ((x - mean) ** 2 / variance + np.log(2.0 * np.pi * variance)))


def _series(errors: Array, variance: Array, slack: float) -> NDArray[np.complex128]:
    """(K, H) Fourier coefficients, over the place of the first position, of each row's log likelihood; in steps.

    Of the positions around a command the nearest is taken, up to the slack.
    """
    u = np.arange(settings.STEP_PHASES) / settings.STEP_PHASES
    near = np.stack([u - 1.0, u, u + 1.0]) - 0.5
    taken = log_ndtr((0.5 - np.abs(near)) / slack)
    taken = taken - logsumexp(taken, axis=0)
    each = taken + _normal(errors[:, None, None], near, variance[:, None, None])
    return np.asarray(np.fft.rfft(logsumexp(each, axis=1), axis=1)[:, : settings.STEP_HARMONICS + 1])


def _sums(weight: NDArray[np.complex128], place: Array, lowest: float, width: float, count: int) -> Array:
    """(count,) Σ weight exp(-2π i f place) at frequencies f that begin at the lowest and are a width apart.

    A frequency is a coarse one and a fine one, so that the sums are a product of two small matrices.
    """
    fine = int(np.sqrt(count)) + 1
    coarse = lowest + width * fine * np.arange(-(-count // fine))
    first, second = (np.exp(-2j * np.pi * np.outer(f, place)) for f in (coarse, width * np.arange(fine)))
    return np.asarray(((weight * first) @ second.T).ravel()[:count])


def seen(log_factors: Sequence[float]) -> float:
    """Return the logarithm of the Bayes factor of steps in all these joints, of which some may stay hidden."""
    hidden = np.log(settings.STEPS_HIDDEN)
    return float(np.logaddexp(np.log1p(-settings.STEPS_HIDDEN) + np.asarray(log_factors, dtype=float), hidden).sum())


def stepped(factor: float, *, again: bool) -> float:
    """Return the probability that joints which err anew from pose to pose do so by the steps of their encoders.

    Parameters
    ----------
    factor
        What steps say, of all these joints: see :func:`seen`.
    again
        Whether later visits of a pose find the same error, so that wear is none.
    """
    return float(expit(factor - np.log(settings.RIVALS_AGAIN if again else settings.RIVALS_ONCE)))
