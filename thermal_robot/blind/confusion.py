"""What was named where something else was true."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from thermal_robot.arrays import Array
from thermal_robot.blind.coverage import Rate
from thermal_robot.blind.judged import LAW, Record, at_work, failed, first_named, found, ratio, unexplained

NOTHING, UNLISTED, UNEXPLAINED, FAILED = "nothing", "unlisted", "unexplained", "failed"


@dataclass(frozen=True)
class Confusion:
    """How often each row's truth was answered by each column's name.

    Attributes
    ----------
    rows
        Effects, ``nothing``, ``unlisted``.
    columns
        The rows' effects, then others, ``nothing``, ``unexplained``, ``failed``.
    counts
        One tuple a row.
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]


def confusion(records: Sequence[Record], kinds: Sequence[str]) -> Confusion:
    """Count truths against what was named first, over cases of some kinds.

    Of several effects at work the first of the truth's list is the row. A discovered law counts as unexplained: it
    names no cause.
    """
    pairs = Counter((_true(r), _named(r)) for r in records if r["kind"] in kinds)
    rows = _ordered({true for true, _ in pairs}, (NOTHING, UNLISTED))
    effects = [r for r in rows if r not in (NOTHING, UNLISTED)]
    rest = {name for _, name in pairs} - set(effects)
    columns = (*effects, *_ordered(rest, (NOTHING, UNEXPLAINED, FAILED)))
    return Confusion(rows, columns, tuple(tuple(pairs[row, column] for column in columns) for row in rows))


def _true(record: Record) -> str:
    if record["truth"].get("unlisted"):
        return UNLISTED
    return next(iter(at_work(record)), NOTHING)


def _named(record: Record) -> str:
    if failed(record):
        return FAILED
    name = first_named(record)
    if name is None:
        return UNEXPLAINED if unexplained(record) else NOTHING
    return UNEXPLAINED if name.startswith(LAW) else name


def _ordered(names: set[str], last: tuple[str, ...]) -> tuple[str, ...]:
    return (*sorted(names - set(last)), *(name for name in last if name in names))


KINDS = ("single", "hard")
RATIOS = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
SAMPLES = (20, 30, 45, 60, 80, 100, 150, 200)
WANTED = 0.9
ASKED_RATIOS = (1.0, 2.0)
_RIDGE = 0.01  # as if each coefficient were known to 10 beforehand: next to nothing, unless the data are separable
_POINTS = 41


@dataclass(frozen=True)
class Step:
    """Rate from ``low`` to below ``high``; ``None`` for no upper bound."""

    low: float
    high: float | None
    found: Rate


@dataclass(frozen=True)
class Line:
    """A curve to draw: chance of detection at ``x`` while the other quantity is ``other``."""

    other: float
    x: tuple[float, ...]
    chance: tuple[float, ...]


@dataclass(frozen=True)
class Needed:
    """Rows that find an effect of this ratio in 90 % of cases; ``None`` where the curve does not say."""

    ratio: float
    samples: float | None


@dataclass(frozen=True)
class Curve:
    """Chance of detection = logistic(intercept + ratio · ln(ratio) + samples · ln(samples)).

    Attributes
    ----------
    intercept, ratio, samples
        Coefficients.
    std
        Standard deviations of the three.
    ratios, rows
        Smallest and largest in the data: beyond them the curve is a guess.
    needed
        For :data:`ASKED_RATIOS`.
    over_ratio, over_samples
        Lines at the lower and the upper quartile of the other quantity.
    """

    intercept: float
    ratio: float
    samples: float
    std: tuple[float, float, float]
    ratios: tuple[float, float]
    rows: tuple[float, float]
    needed: tuple[Needed, ...]
    over_ratio: tuple[Line, ...]
    over_samples: tuple[Line, ...]


@dataclass(frozen=True)
class Detection:
    """Rates over ratio, over samples, over both (one tuple of rates for each step of the ratio), and the curve."""

    ratio: tuple[Step, ...]
    samples: tuple[Step, ...]
    table: tuple[tuple[Rate, ...], ...]
    curve: Curve | None


def detection(records: Sequence[Record]) -> Detection:
    """Count in which cases with one effect that effect is found; one whose size is unknown does not count."""
    cases = [
        (ratio(r, name), r["samples"], name in found(r)) for r in records if r["kind"] in KINDS for name in at_work(r)
    ]
    known = np.array([(size, rows, hit) for size, rows, hit in cases if size], dtype=float).reshape(-1, 3)
    size, rows, hit = known.T
    by_ratio = np.searchsorted(RATIOS, size, side="right") - 1
    by_samples = np.searchsorted(SAMPLES, rows, side="right") - 1

    def counted(where: NDArray[np.bool_]) -> Rate:
        return Rate(int(hit[where].sum()), int(where.sum()))

    return Detection(
        tuple(Step(lo, hi, counted(by_ratio == k)) for k, (lo, hi) in enumerate(_bounds(RATIOS))),
        tuple(Step(lo, hi, counted(by_samples == k)) for k, (lo, hi) in enumerate(_bounds(SAMPLES))),
        tuple(
            tuple(counted((by_ratio == k) & (by_samples == m)) for m in range(len(SAMPLES))) for k in range(len(RATIOS))
        ),
        logistic(size, rows, hit > 0.5) if 0 < hit.sum() < len(hit) else None,
    )


def _bounds(edges: Sequence[float]) -> list[tuple[float, float | None]]:
    return list(zip(edges, (*edges[1:], None), strict=True))


def logistic(size: Array, rows: Array, hit: NDArray[np.bool_]) -> Curve:
    """Fit the curve of detection by penalised maximum likelihood.

    Parameters
    ----------
    size, rows
        (N,) ratio to the noise, and number of rows of the campaign.
    hit
        (N,) whether the effect was found.

    Returns
    -------
    Curve
        Ridge as in le Cessie & van Houwelingen 1992 (Appl. Stat. 41, 191), on centred logarithms.
    """
    logs = np.column_stack([np.log(size), np.log(rows)])
    centre = logs.mean(axis=0)
    design = np.column_stack([np.ones(len(logs)), logs - centre])

    def cost(b: Array) -> tuple[float, Array]:
        z = design @ b
        value = np.logaddexp(0.0, z).sum() - z[hit].sum() + 0.5 * _RIDGE * (b @ b)
        return float(value), design.T @ (expit(z) - hit) + _RIDGE * b

    best = np.asarray(minimize(cost, np.zeros(3), jac=True, method="BFGS").x)
    weight = expit(design @ best) * expit(-design @ best)
    spread = np.linalg.inv(design.T @ (design * weight[:, None]) + _RIDGE * np.eye(3))
    uncentred = np.eye(3)
    uncentred[0, 1:] = -centre
    a, b, c = uncentred @ best
    std = np.sqrt(np.diag(uncentred @ spread @ uncentred.T))

    def chance(s: Array, n: Array) -> tuple[float, ...]:
        return tuple(float(p) for p in expit(a + b * np.log(s) + c * np.log(n)))

    s_range, n_range = np.geomspace(size.min(), size.max(), _POINTS), np.geomspace(rows.min(), rows.max(), _POINTS)
    return Curve(
        float(a),
        float(b),
        float(c),
        (float(std[0]), float(std[1]), float(std[2])),
        (float(size.min()), float(size.max())),
        (float(rows.min()), float(rows.max())),
        tuple(Needed(r, _needed(a, b, c, r)) for r in ASKED_RATIOS),
        tuple(Line(n, tuple(map(float, s_range)), chance(s_range, np.full(_POINTS, n))) for n in _quartiles(rows)),
        tuple(Line(s, tuple(map(float, n_range)), chance(np.full(_POINTS, s), n_range)) for s in _quartiles(size)),
    )


def _needed(a: float, b: float, c: float, size: float) -> float | None:
    if b <= 0.0 or c <= 0.0:
        return None
    power = (np.log(WANTED / (1.0 - WANTED)) - a - b * np.log(size)) / c
    return float(np.exp(power)) if power < 20.0 else None  # beyond that it is no number of rows


def _quartiles(values: Array) -> tuple[float, float]:
    low, high = np.quantile(values, (0.25, 0.75))
    return float(low), float(high)
