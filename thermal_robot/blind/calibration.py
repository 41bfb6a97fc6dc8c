"""Whether a probability means what it says: of all effects and laws called 70 % probable, 70 % should be at work."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.judged import LAW, PRESENT, Record, at_work, is_absent, is_right_law, ratio, said
from thermal_robot.blind.rate import Rate

KINDS = ("mixed",)
"""Only where chance decides what is at work: where one of a kind always is, a probability has nothing to mean."""
BINS = 10
DOUBTFUL = (0.05, 0.95)


@dataclass(frozen=True)
class Bin:
    """Effects and laws whose probability lies from ``low`` to ``high``: how probable on average, how often at work."""

    low: float
    high: float
    mean: float | None
    present: Rate


@dataclass(frozen=True)
class Reliability:
    """Bins of equal width, and the expected calibration error over so many effects; ``None`` without any."""

    bins: tuple[Bin, ...]
    trials: int
    error: float | None


@dataclass(frozen=True)
class Calibration:
    """Over all effects and laws, and over those of which the diagnosis was not sure."""

    all: Reliability
    doubtful: Reliability


def calibration(records: Sequence[Record]) -> Calibration:
    """Compare probabilities with what is true, over mixtures: of all effects, and of all laws.

    An effect in the background, neither clearly present nor clearly absent, does not count. A discovered law is right
    where its place, or one beside it, and its quantity are those of the unlisted cause.
    """
    pairs = [pair for record in records if record["kind"] in KINDS for pair in _pairs(record)]
    p = np.array([probability for probability, _ in pairs], dtype=float)
    present = np.array([there for _, there in pairs], dtype=bool)
    doubtful = (p > DOUBTFUL[0]) & (p < DOUBTFUL[1])
    return Calibration(reliability(p, present), reliability(p[doubtful], present[doubtful]))


def _pairs(record: Record) -> Iterator[tuple[float, bool]]:
    for effect in said(record)["effects"]:
        name, probability = effect["name"], effect["probability"]
        if probability is None:
            continue
        if name.startswith(LAW):
            yield float(probability), is_right_law(record, effect)
        elif name in at_work(record) or (ratio(record, name) or 0.0) >= PRESENT:
            yield float(probability), True
        elif is_absent(record, name):
            yield float(probability), False


def reliability(p: NDArray[np.float64], present: NDArray[np.bool_]) -> Reliability:
    """Sort probabilities into bins.

    Parameters
    ----------
    p, present
        (N,) each.

    Returns
    -------
    Reliability
        With error = Σ n_b/N |mean p_b − frequency_b| (Naeini et al. 2015; Guo et al. 2017).
    """
    number = np.minimum((p * BINS).astype(int), BINS - 1)  # certainty belongs to the last bin
    bins, error = [], 0.0
    for k in range(BINS):
        here = number == k
        count, there = int(here.sum()), int(present[here].sum())
        mean = float(p[here].mean()) if count else None
        if mean is not None:
            error += abs(count * mean - there)
        bins.append(Bin(k / BINS, (k + 1) / BINS, mean, Rate(there, count)))
    return Reliability(tuple(bins), len(p), error / len(p) if len(p) else None)
