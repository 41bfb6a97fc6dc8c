"""The score of a blind trial: what was asked, what was said, how often it was right."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from itertools import combinations
from math import factorial
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import binomtest

from thermal_robot.arrays import Array
from thermal_robot.blind.cases import SEVERAL, Kind
from thermal_robot.blind.judged import (
    BAD,
    HEADLINE,
    KNOWN,
    LAW,
    PRESENT,
    SIGMAS,
    Plain,
    Record,
    answer,
    at_work,
    corrects,
    failed,
    first_named,
    found,
    is_absent,
    is_miss,
    is_right_law,
    marks,
    ratio,
    said,
    said_words,
    true_words,
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
        frames and each subset of the effects fitted to the given rows (:mod:`thermal_robot.blind.examinee`).
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


_CALIBRATED = ("mixed",)
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
    pairs = [pair for record in records if record["kind"] in _CALIBRATED for pair in _pairs(record)]
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
    """Return the expected calibration error Σ n_b/N |mean p_b − frequency_b| of (N,) probabilities, and its bins.

    Naeini et al. 2015; Guo et al. 2017.
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

    Predicted are, for every subset by its names joined with ``+``, (M, 3) positions, m, with the frames and this subset
    fitted to the given rows; true is where the target really is; the noise, one sigma per axis, m, is in the gap that
    is shared, as in the claim. The sum is what all effects together take away; empty without subsets.
    """
    left = {
        frozenset(filter(None, name.split("+"))): float(((np.asarray(rows) - true) ** 2).sum(axis=1).mean())
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


_DETECTED = ("single", "hard")
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
        (ratio(r, name), r["samples"], name in found(r))
        for r in records
        if r["kind"] in _DETECTED
        for name in at_work(r)
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
    """Fit the curve of detection by ridge logistic regression (le Cessie & van Houwelingen 1992, Appl. Stat. 41, 191).

    On centred logarithms of the (N,) ratios to the noise and numbers of rows; ``hit`` says where the effect was found.
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


SCHEMA = "thermal-robot/blind/1"
CONFUSIONS = {"single": ("single", "null", "unlisted"), "hard": ("hard",), "removed": ("removed",)}
"""Tables of confusion, and the kinds of cases that each counts."""


@dataclass(frozen=True)
class KindScore:
    """Cases of one kind: rates by question (see :mod:`thermal_robot.blind.judged`), and what stays on fresh samples.

    Attributes
    ----------
    kind, cases, failed
        How many there are, and how many of them ended with an error.
    headline
        The question that decides whether a case is a miss.
    rates
        By question.
    fresh
        Rms per axis over the noise, after correction.
    """

    kind: str
    cases: int
    failed: int
    headline: str
    rates: Mapping[str, Rate]
    fresh: Spread


@dataclass(frozen=True)
class Seconds:
    """How long a diagnosis took."""

    median: float | None
    q95: float | None
    longest: float | None


@dataclass(frozen=True)
class RealAnswer:
    """A real campaign: what was asked, what was answered."""

    id: str
    robot: str
    asked: str
    answer: str
    right: bool


@dataclass(frozen=True)
class Miss:
    """A case that was answered wrongly, with what it takes to look at it again.

    Attributes
    ----------
    id, kind, robot
        Which case.
    truth
        Effects at work, or the cause that no library knows.
    said
        The verdict's effects.
    unexplained
        Whether it called something unexplained, and then where and following what.
    probability
        Of the verdict.
    wrong
        Questions that it answered wrongly.
    error
        Why there is no diagnosis.
    """

    id: str
    kind: str
    robot: str
    truth: tuple[str, ...]
    said: tuple[str, ...]
    unexplained: str | None
    probability: float | None
    wrong: tuple[str, ...]
    error: str | None


@dataclass(frozen=True)
class Score:
    """All figures of a trial.

    Attributes
    ----------
    cases, failed
        How many, and how many ended with an error.
    kinds
        Kind by kind; those without cases are missing.
    by_effect
        Of cases with known effects (one, two, many, small), each counted for every effect at work: whether one at work
        is named first, whether this one is found.
    by_robot
        Of the same cases and those with nothing at work.
    removed, unlisted
        Rates by effect that was taken out of the library, and by cause that no library knows, alone or beside effects.
    changes
        Of several campaigns of one robot: rates by what changes, and how. The figures below are of cases of a single
        campaign.
    laws
        Laws printed at 0.9 or more: how many are right.
    worse
        Cases whose corrected model predicts fresh samples worse than the frames alone.
    coverage
        How often 95 % intervals hold the truth.
    shrinkage, calibration, detection
        Claims against fresh samples, probabilities against truth, what it takes to be found.
    confusion
        Tables by name of :data:`CONFUSIONS`; those without cases are missing.
    seconds
        Time of a diagnosis.
    real
        Real campaigns one by one.
    misses
        Case by case.
    """

    cases: int
    failed: int
    kinds: tuple[KindScore, ...]
    by_effect: Mapping[str, Mapping[str, Rate]]
    by_robot: Mapping[str, Mapping[str, Rate]]
    removed: Mapping[str, Mapping[str, Rate]]
    unlisted: Mapping[str, Mapping[str, Rate]]
    changes: Mapping[str, Mapping[str, Rate]]
    laws: Rate
    worse: Rate
    coverage: Coverage
    shrinkage: Shrinkage
    calibration: Calibration
    confusion: Mapping[str, Confusion]
    detection: Detection
    seconds: Seconds
    real: tuple[RealAnswer, ...]
    misses: tuple[Miss, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the format ``thermal-robot/blind/1``."""
        return {"schema": SCHEMA, **_plain(self)}


def score(records: Sequence[Record]) -> Score:
    """Score records as in :mod:`thermal_robot.blind.cases`; a failed diagnosis counts as wrong everywhere."""
    of_kind = {kind: [r for r in records if r["kind"] == kind] for kind in get_args(Kind)}
    known = [r for kind in KNOWN for r in of_kind[kind] if at_work(r)]
    alone = [r for r in records if r["kind"] not in SEVERAL]
    tables = {name: confusion(records, kinds) for name, kinds in CONFUSIONS.items()}
    return Score(
        cases=len(records),
        failed=sum(map(failed, records)),
        kinds=tuple(_kind(kind, chosen) for kind, chosen in of_kind.items() if chosen),
        by_effect=_by_effect(known),
        by_robot=_grouped((r["robot"], r) for r in (*known, *of_kind["null"])),
        removed=_grouped((name, r) for r in of_kind["removed"] for name in at_work(r)),
        unlisted=_grouped((str(r["truth"]["unlisted"]), r) for r in (*of_kind["unlisted"], *of_kind["both"])),
        changes=_grouped((f"{c['effect']} {c['how']}", r) for r in records for c in r["truth"].get("changes", ())),
        laws=sure_laws(alone),
        worse=worse(alone),
        coverage=coverage(alone),
        shrinkage=shrinkage(alone),
        calibration=calibration(alone),
        confusion={name: table for name, table in tables.items() if table.rows},
        detection=detection(alone),
        seconds=_seconds([float(r["seconds"]) for r in alone if r.get("seconds") is not None]),
        real=tuple(
            RealAnswer(r["id"], r["robot"], r.get("asked", ""), r.get("answer", ""), all(marks(r)["right"]))
            for r in of_kind["real"]
        ),
        misses=tuple(_miss(r) for r in records if is_miss(r)),
    )


def _kind(kind: str, records: Sequence[Record]) -> KindScore:
    ratios = [ratio for ratio in map(fresh_ratio, records) if ratio is not None]
    return KindScore(kind, len(records), sum(map(failed, records)), HEADLINE[kind], _rates(records), spread(ratios))


def _rates(records: Iterable[Record]) -> dict[str, Rate]:
    answers: dict[str, list[bool]] = defaultdict(list)
    for record in records:
        for question, given in marks(record).items():
            answers[question] += given
    return {question: rate(given) for question, given in answers.items()}


def _groups(named: Iterable[tuple[str, Record]]) -> list[tuple[str, list[Record]]]:
    groups: dict[str, list[Record]] = defaultdict(list)
    for name, record in named:
        groups[name].append(record)
    return sorted(groups.items())


def _grouped(named: Iterable[tuple[str, Record]]) -> dict[str, dict[str, Rate]]:
    return {name: _rates(chosen) for name, chosen in _groups(named)}


def _by_effect(records: Sequence[Record]) -> dict[str, dict[str, Rate]]:
    return {
        name: {
            "first_named": rate(all(marks(r)["first_named"]) for r in chosen),
            "found": rate(name in found(r) for r in chosen),
        }
        for name, chosen in _groups((name, r) for r in records for name in at_work(r))
    }


def _seconds(values: Sequence[float]) -> Seconds:
    if not values:
        return Seconds(None, None, None)
    return Seconds(float(np.median(values)), float(np.quantile(values, 0.95)), max(values))


def _miss(record: Record) -> Miss:
    return Miss(
        **{name: record[name] for name in ("id", "kind", "robot")},
        **_told(record),
        wrong=tuple(q for q, given in marks(record).items() if any(a == (q in BAD) for a in given)),
        error=(record.get("error") or "no diagnosis") if failed(record) else None,
    )


def _told(record: Record) -> dict[str, Any]:
    if record["kind"] in SEVERAL:
        words = said_words(record["kind"], said(record))
        return {"truth": true_words(record["truth"]), "said": words, "unexplained": None, "probability": None}
    truth, verdict = record["truth"], said(record)["verdict"]
    place, quantity = answer(record)
    where = f"{place[1] or place[0]}, {quantity}" if place else str(quantity or "somewhere")
    return {
        "truth": (*at_work(record), *([truth["unlisted"]] if truth.get("unlisted") else [])),
        "said": tuple(verdict["effects"]),
        "unexplained": where if verdict["unexplained"] else None,
        "probability": None if failed(record) else verdict["probability"],
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Rate):
        return {**asdict(value), "value": value.value, "interval": _plain(value.interval)}
    if is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(name): _plain(content) for name, content in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(content) for content in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


SURE = 0.9


def laws(record: Record) -> Iterator[Plain]:
    """Yield the laws of a diagnosis that have a probability, found or not."""
    for effect in said(record)["effects"]:
        if effect["name"].startswith(LAW) and effect["probability"] is not None:
            yield effect


def sure_laws(records: Sequence[Record]) -> Rate:
    """Count laws printed at 0.9 or more in all records but real ones, and which of them are right.

    A law where all that is at work is in the library is wrong.
    """
    told = [(record, law) for record in records if record["kind"] != "real" for law in laws(record)]
    return rate(is_right_law(record, law) for record, law in told if law["probability"] >= SURE)
