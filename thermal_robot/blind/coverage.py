"""Whether 95 % intervals hold the truth in 95 %: of parameters, of the shrinkage, of shares."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from thermal_robot.blind.judged import (
    LAW,
    PRESENT,
    Record,
    at_work,
    corrects,
    failed,
    found,
    is_absent,
    is_right_law,
    ratio,
    said,
    unexplained,
)


@dataclass(frozen=True)
class Rate:
    """So many successes in so many trials."""

    successes: int
    trials: int

    @property
    def value(self) -> float | None:
        """Their share; ``None`` without trials."""
        return self.successes / self.trials if self.trials else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """Wilson's score interval, 95 % (Wilson 1927, J. Am. Stat. Assoc. 22, 209); ``None`` without trials."""
        if not self.trials:
            return None
        bounds = binomtest(self.successes, self.trials).proportion_ci(0.95, method="wilson")
        return float(bounds.low), float(bounds.high)


def rate(outcomes: Iterable[bool]) -> Rate:
    """Count outcomes."""
    counted = list(outcomes)
    return Rate(sum(counted), len(counted))


SIGMAS = 1.959963984540054
"""Half the width of a normal law's central 95 %, in standard deviations."""


@dataclass(frozen=True)
class Coverage:
    """How often the truth lay inside.

    Attributes
    ----------
    parameters
        Where exactly what is at work was found, and nothing is unexplained: of a wrong model no parameter is right.
        Every parameter that is called identified and whose true value is in the record; normal, from its standard
        deviation. Those of one effect do not err independently: the rate's own interval is too narrow.
    shrinkage
        Where something is named that a correction takes away: the held-out shrinkage, against that on fresh rows. Both
        have the noise in them; fresh rows are many, so that their own scatter hardly counts.
    shares
        Of each effect in the model that is named: its held-out share, against the Shapley value on fresh rows with
        frames and each subset of the effects fitted to the given rows (:mod:`thermal_robot.blind.refitted`).
    """

    parameters: Rate
    shrinkage: Rate
    shares: Rate


def coverage(records: Sequence[Record]) -> Coverage:
    """Count intervals of all records but real ones, of which nobody knows the truth."""
    told = [r for r in records if not failed(r) and r["kind"] != "real"]
    return Coverage(
        rate(inside for r in told for inside in _parameters(r)),
        rate(inside for r in told for inside in _shrinkage(r)),
        rate(inside for r in told for inside in _shares(r)),
    )


def _parameters(record: Record) -> Iterator[bool]:
    if found(record) != frozenset(at_work(record)) or unexplained(record):
        return
    true = record["truth"].get("parameters", {})
    for effect in record["said"]["effects"]:
        for told in effect["parameters"]:
            value = true.get(effect["name"], {}).get(told["name"])
            if value is not None and effect["name"] in found(record) and told["identified"]:
                yield abs(told["value"] - value) <= SIGMAS * told["std"]


def _shrinkage(record: Record) -> Iterator[bool]:
    fresh, held = record.get("fresh"), record["said"]["gap"]["held_out"]
    if not fresh or record.get("noise") is None or not corrects(record):
        return
    noise2 = 3.0 * float(record["noise"]) ** 2
    real = 1.0 - (fresh["rms_after"] ** 2 + noise2) / (fresh["rms_before"] ** 2 + noise2)
    low, high = held["shrinkage_ci95"]
    yield low <= real <= high


def _shares(record: Record) -> Iterator[bool]:
    real = (record.get("fresh") or {}).get("shares") or {}
    for effect in record["said"]["effects"]:
        if effect["name"] in real and effect["name"] in found(record) and effect.get("shrinkage_ci95"):
            low, high = effect["shrinkage_ci95"]
            yield low <= real[effect["name"]] <= high


_VISIBLE = 0.5  # × noise per axis: where the gap before is less, a share of it is a share of nothing


@dataclass(frozen=True)
class Spread:
    """Of so many numbers the median, the 90 % quantile and the largest; ``None`` without any."""

    count: int
    median: float | None
    q90: float | None


@dataclass(frozen=True)
class Pair:
    """Shrinkage claimed from held-out rows and reached on fresh samples, of one case."""

    id: str
    kind: str
    claimed: float
    real: float


@dataclass(frozen=True)
class Shrinkage:
    """All pairs, and the median of their absolute differences."""

    pairs: tuple[Pair, ...]
    median_absolute_difference: float | None


def spread(values: Iterable[float]) -> Spread:
    """Return median and 90 % quantile."""
    known = np.array(list(values), dtype=float)
    if not len(known):
        return Spread(0, None, None)
    return Spread(len(known), float(np.median(known)), float(np.quantile(known, 0.9)))


def fresh_ratio(record: Record) -> float | None:
    """Return what the corrected model leaves on fresh samples, rms per axis over the noise."""
    fresh = record.get("fresh")
    if failed(record) or not fresh or not record.get("noise"):
        return None
    return float(fresh["rms_after"]) / math.sqrt(3.0) / float(record["noise"])


def worse(records: Sequence[Record]) -> Rate:
    """Count corrected models that predict fresh samples worse than the frames alone, over all cases with fresh samples.

    Where nothing is named that a correction could take away, the corrected model is the frames alone.
    """
    told = [r for r in records if not failed(r) and r.get("fresh")]
    return rate(corrects(r) and r["fresh"]["rms_after"] > r["fresh"]["rms_before"] for r in told)


def shrinkage(records: Sequence[Record]) -> Shrinkage:
    """Compare the claims with what was reached."""
    pairs = tuple(pair for pair in map(_pair, records) if pair is not None)
    apart = spread(abs(p.claimed - p.real) for p in pairs)
    return Shrinkage(pairs, apart.median)


def _pair(record: Record) -> Pair | None:
    """Compare the mean squares without noise; those of real campaigns with it, since their fresh rows hold it, too."""
    fresh = record.get("fresh")
    if failed(record) or not fresh or not fresh["rms_before"] or record.get("noise") is None:
        return None
    held, noise2 = record["said"]["gap"]["held_out"], 3.0 * float(record["noise"]) ** 2
    before, after = held["rms_before"] ** 2 - noise2, held["rms_after"] ** 2 - noise2
    if before <= _VISIBLE**2 * noise2:
        return None
    if record["kind"] == "real":
        before, after = before + noise2, after + noise2
    real = 1.0 - (fresh["rms_after"] / fresh["rms_before"]) ** 2
    return Pair(record["id"], record["kind"], 1.0 - max(after, 0.0) / before, real)


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


def shares(
    predicted: Mapping[str, Sequence[Sequence[float]]], true: Sequence[Sequence[float]], noise: float
) -> dict[str, float]:
    """Return each effect's share of the gap's mean square: the Shapley value of what it takes away.

    Parameters
    ----------
    predicted
        By names joined with ``+``, every subset: (M, 3) m, with the frames and this subset fitted to the given rows.
    true
        (M, 3) where the target really is, m.
    noise
        One sigma per axis, m: the gap that is shared has it in it, as in the claim.

    Returns
    -------
    dict
        By effect; the sum is what all of them together take away. Empty without subsets.
    """
    left = {
        frozenset(name.split("+")) if name else frozenset(): float(
            ((np.asarray(rows) - np.asarray(true)) ** 2).sum(axis=1).mean()
        )
        for name, rows in predicted.items()
    }
    players = sorted(frozenset[str]().union(*left))
    found = {}
    for player in players:
        others = [name for name in players if name != player]
        value = 0.0
        for size in range(len(players)):
            weight = factorial(size) * factorial(len(others) - size) / factorial(len(players))
            for chosen in map(frozenset, combinations(others, size)):
                value += weight * (left[chosen] - left[chosen | {player}])
        found[player] = value / (left[frozenset()] + 3.0 * noise**2)
    return found
