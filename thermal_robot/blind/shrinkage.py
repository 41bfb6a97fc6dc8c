"""How far the gap really shrinks: on fresh samples, over the noise, and against what the diagnosis claims."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from thermal_robot.blind.judged import Record, corrects, failed
from thermal_robot.blind.rate import Rate, rate

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
