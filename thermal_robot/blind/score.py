"""Score of a blind trial as plain JSON: rates with Wilson intervals, calibration, coverage, detection."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from math import factorial, sqrt
from typing import Any, get_args

import numpy as np
import pandas as pd
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

SCHEMA = "thermal-robot/blind/1"
CONFUSIONS = {"single": ("single", "null", "unlisted"), "hard": ("hard",), "removed": ("removed",)}
"""Tables of confusion, and the kinds of cases that each counts."""
SURE = 0.9
"""Probability from which on a law is held to be right."""
Plain = dict[str, Any]


def score(records: Sequence[Record]) -> Plain:
    """Score records (:mod:`thermal_robot.blind.cases`); a failed diagnosis counts as wrong everywhere.

    Parameters
    ----------
    records
        Of the cases of a trial that were not withdrawn.

    Returns
    -------
    dict
        The JSON object of the format ``thermal-robot/blind/1``. Each rate is as :func:`rate` gives it:

        ``cases``, ``failed``: how many there are, and how many ended with an error;
        ``kinds``: kind by kind, the rates by question (:mod:`thermal_robot.blind.judged`), the headline that decides
        a miss, and the rms per axis over the noise that stays on fresh samples (``fresh``);
        ``by_effect``: of cases with known effects, for each effect at work, whether one at work is named first, and
        whether this one is found; ``by_robot``: of these and of cases with nothing at work;
        ``removed``, ``unlisted``: by the effect taken out of the library, and by the cause that no library knows;
        ``changes``: of several campaigns of one robot, by what changes and how; the figures below are of cases of a
        single campaign;
        ``laws``: laws printed at 0.9 or more, those that are right; ``worse``: corrected models that predict fresh
        samples worse than the frames alone; ``coverage``: 95 % intervals that hold the truth;
        ``shrinkage``, ``calibration``, ``detection``: claims against fresh samples, probabilities against truth, what
        it takes to be found; ``confusion``: tables by name of :data:`CONFUSIONS`;
        ``seconds``: of a diagnosis; ``real``: real campaigns, and ``misses``: wrong answers, one by one.
    """
    of_kind = {kind: [r for r in records if r["kind"] == kind] for kind in get_args(Kind)}
    known = [r for kind in KNOWN for r in of_kind[kind] if at_work(r)]
    alone = [r for r in records if r["kind"] not in SEVERAL]
    tables = {name: confusion(records, kinds) for name, kinds in CONFUSIONS.items()}
    beside = (*of_kind["unlisted"], *of_kind["both"])
    seconds = [float(r["seconds"]) for r in alone if r.get("seconds") is not None]
    return {
        "schema": SCHEMA,
        "cases": len(records),
        "failed": sum(map(failed, records)),
        "kinds": [_kind(kind, chosen) for kind, chosen in of_kind.items() if chosen],
        "by_effect": _by_effect(known),
        "by_robot": _grouped((r["robot"], r) for r in (*known, *of_kind["null"])),
        "removed": _grouped((name, r) for r in of_kind["removed"] for name in at_work(r)),
        "unlisted": _grouped((str(r["truth"]["unlisted"]), r) for r in beside),
        "changes": _grouped((f"{c['effect']} {c['how']}", r) for r in records for c in r["truth"].get("changes", ())),
        "laws": sure_laws(alone),
        "worse": worse(alone),
        "coverage": coverage(alone),
        "shrinkage": shrinkage(alone),
        "calibration": calibration(alone),
        "confusion": {name: table for name, table in tables.items() if table["rows"]},
        "detection": detection(alone),
        "seconds": _quantiles(seconds, median=0.5, q95=0.95, longest=1.0),
        "real": [_real(r) for r in of_kind["real"]],
        "misses": [_miss(r) for r in records if is_miss(r)],
    }


def rate(successes: int, trials: int) -> Plain:
    """Proportion with Wilson's score interval, 95 % (Wilson 1927, J. Am. Stat. Assoc. 22, 209).

    ``value`` and ``interval`` are ``None`` without trials.
    """
    successes, trials = int(successes), int(trials)
    if not trials:
        return {"successes": successes, "trials": trials, "value": None, "interval": None}
    bounds = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    interval = [float(bounds.low), float(bounds.high)]
    return {"successes": successes, "trials": trials, "value": successes / trials, "interval": interval}


def counted(outcomes: Iterable[bool]) -> Plain:
    """Proportion of outcomes that are true, with its Wilson interval (:func:`rate`)."""
    told = [bool(outcome) for outcome in outcomes]
    return rate(sum(told), len(told))


def _tally(answers: Iterable[tuple[str, str, bool | None]]) -> dict[str, dict[str, Plain]]:
    """Rates of right answers by group (alphabetical) and question; ``None`` lists a question without a trial."""
    table = pd.DataFrame(answers, columns=["group", "question", "right"]).astype({"right": float})
    counts = table.groupby(["group", "question"], sort=False)["right"].agg(["sum", "count"])
    return {
        str(group): {str(question): rate(*row) for (_, question), row in zip(part.index, part.to_numpy(), strict=True)}
        for group, part in counts.groupby(level=0)
    }


def _grouped(named: Iterable[tuple[str, Record]]) -> dict[str, dict[str, Plain]]:
    return _tally(
        (name, question, right)
        for name, record in named
        for question, given in marks(record).items()
        for right in (*given, None)
    )


def _by_effect(records: Sequence[Record]) -> dict[str, dict[str, Plain]]:
    return _tally(
        (name, question, right)
        for r in records
        for name in at_work(r)
        for question, right in (("first_named", all(marks(r)["first_named"])), ("found", name in found(r)))
    )


def _kind(kind: str, records: Sequence[Record]) -> Plain:
    left = [ratio for ratio in map(fresh_ratio, records) if ratio is not None]
    return {
        "kind": kind,
        "cases": len(records),
        "failed": sum(map(failed, records)),
        "headline": HEADLINE[kind],
        "rates": _grouped((kind, r) for r in records)[kind],
        "fresh": {"count": len(left), **_quantiles(left, median=0.5, q90=0.9)},
    }


def _quantiles(values: Sequence[float], **shares: float) -> dict[str, float | None]:
    return {name: float(np.quantile(values, share)) if len(values) else None for name, share in shares.items()}


def _real(record: Record) -> Plain:
    told = {"asked": record.get("asked", ""), "answer": record.get("answer", "")}
    return {"id": record["id"], "robot": record["robot"], **told, "right": all(marks(record)["right"])}


def _miss(record: Record) -> Plain:
    return {
        **{name: record[name] for name in ("id", "kind", "robot")},
        **_told(record),
        "wrong": [q for q, given in marks(record).items() if any(a == (q in BAD) for a in given)],
        "error": (record.get("error") or "no diagnosis") if failed(record) else None,
    }


def _told(record: Record) -> Plain:
    """Return the true effects and the verdict: effects, place and quantity of an unexplained residual, probability."""
    if record["kind"] in SEVERAL:
        words = {"truth": list(true_words(record["truth"])), "said": list(said_words(record["kind"], said(record)))}
        return {**words, "unexplained": None, "probability": None}
    truth, verdict = record["truth"], said(record)["verdict"]
    place, quantity = answer(record)
    where = f"{place[1] or place[0]}, {quantity}" if place else str(quantity or "somewhere")
    return {
        "truth": [*at_work(record), *([truth["unlisted"]] if truth.get("unlisted") else [])],
        "said": list(verdict["effects"]),
        "unexplained": where if verdict["unexplained"] else None,
        "probability": None if failed(record) else verdict["probability"],
    }


def coverage(records: Sequence[Record]) -> Plain:
    """Coverage of 95 % intervals: how often the truth lies inside, over all records but real ones.

    ``parameters``: value ± 1.96 standard deviations of identified parameters with a known true value, where exactly the
    effects at work were found and nothing is unexplained, as a wrong model has no right parameters. Those of one effect
    do not err independently: the rate's own interval is too narrow. ``shrinkage``: held-out shrinkage against that on
    fresh rows, both with the noise in them, where a correctable effect is named. ``shares``: that of each effect found,
    against its Shapley value on fresh rows (:func:`shares`).
    """
    told = [r for r in records if not failed(r) and r["kind"] != "real"]
    parts = {"parameters": _parameters, "shrinkage": _shrinkage, "shares": _shares}
    return {name: counted(inside for r in told for inside in held(r)) for name, held in parts.items()}


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
    if fresh and record.get("noise") is not None and corrects(record):
        noise2 = 3.0 * float(record["noise"]) ** 2
        low, high = held["shrinkage_ci95"]
        yield low <= 1.0 - (fresh["rms_after"] ** 2 + noise2) / (fresh["rms_before"] ** 2 + noise2) <= high


def _shares(record: Record) -> Iterator[bool]:
    real = (record.get("fresh") or {}).get("shares") or {}
    for effect in record["said"]["effects"]:
        if effect["name"] in real and effect["name"] in found(record) and effect.get("shrinkage_ci95"):
            low, high = effect["shrinkage_ci95"]
            yield low <= real[effect["name"]] <= high


def fresh_ratio(record: Record) -> float | None:
    """Residual of the corrected model on fresh samples, rms per axis over the noise."""
    fresh = record.get("fresh")
    if failed(record) or not fresh or not record.get("noise"):
        return None
    return float(fresh["rms_after"]) / sqrt(3.0) / float(record["noise"])


def worse(records: Sequence[Record]) -> Plain:
    """Rate of corrected models that predict fresh samples worse than the frames alone, over all with fresh samples.

    Where nothing is named that a correction could take away, the corrected model is the frames alone.
    """
    told = [r for r in records if not failed(r) and r.get("fresh")]
    return counted(corrects(r) and r["fresh"]["rms_after"] > r["fresh"]["rms_before"] for r in told)


_VISIBLE = 0.5  # × noise per axis: where the gap before is less, a share of it is a share of nothing


def shrinkage(records: Sequence[Record]) -> Plain:
    """Pairs of shrinkage claimed from held-out rows and reached on fresh samples, and median absolute difference."""
    pairs = [pair for record in records for pair in _pair(record)]
    apart = [abs(pair["claimed"] - pair["real"]) for pair in pairs]
    return {"pairs": pairs, "median_absolute_difference": float(np.median(apart)) if apart else None}


def _pair(record: Record) -> Iterator[Plain]:
    """Yield claimed and real shrinkage, 1 − mean square after / before, without noise; of real campaigns with it.

    Nothing without fresh samples, or where the rms gap is below half the noise.
    """
    fresh = record.get("fresh")
    if failed(record) or not fresh or not fresh["rms_before"] or record.get("noise") is None:
        return
    held, noise2 = record["said"]["gap"]["held_out"], 3.0 * float(record["noise"]) ** 2
    before, after = held["rms_before"] ** 2 - noise2, held["rms_after"] ** 2 - noise2
    if before <= _VISIBLE**2 * noise2:
        return
    if record["kind"] == "real":
        before, after = before + noise2, after + noise2
    real = 1.0 - (fresh["rms_after"] / fresh["rms_before"]) ** 2
    yield {"id": record["id"], "kind": record["kind"], "claimed": 1.0 - max(after, 0.0) / before, "real": real}


_CALIBRATED = ("mixed",)
"""Only where chance decides what is at work: where one of a kind always is, a probability has nothing to mean."""
BINS = 10
DOUBTFUL = (0.05, 0.95)


def calibration(records: Sequence[Record]) -> Plain:
    """Reliability diagrams of the probabilities of effects and laws of mixtures, all and uncertain ones.

    An effect in the background, neither clearly present nor clearly absent, does not count. A discovered law is right
    where its place, or one beside it, and its quantity are those of the unlisted cause.
    """
    pairs = [pair for record in records if record["kind"] in _CALIBRATED for pair in _pairs(record)]
    p = np.array([probability for probability, _ in pairs], dtype=float)
    present = np.array([there for _, there in pairs], dtype=bool)
    doubtful = (p > DOUBTFUL[0]) & (p < DOUBTFUL[1])
    return {"all": reliability(p, present), "doubtful": reliability(p[doubtful], present[doubtful])}


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


def reliability(p: Array, present: NDArray[np.bool_]) -> Plain:
    """Return the expected calibration error Σ n_b/N |mean p_b − frequency_b| of (N,) probabilities, with its bins.

    Naeini et al. 2015; Guo et al. 2017. The error is ``None`` without any.
    """
    number = np.minimum((p * BINS).astype(int), BINS - 1)  # certainty belongs to the last bin
    bins, error = [], 0.0
    for k in range(BINS):
        here = number == k
        told, mean = counted(present[here]), float(p[here].mean()) if here.any() else None
        error += abs(told["trials"] * (mean or 0.0) - told["successes"])
        bins.append({"low": k / BINS, "high": (k + 1) / BINS, "mean": mean, "present": told})
    return {"bins": bins, "trials": len(p), "error": error / len(p) if len(p) else None}


def sure_laws(records: Sequence[Record]) -> Plain:
    """Rate of correct laws among those of probability 0.9 or more, in all records but real ones.

    A law where all that is at work is in the library is wrong.
    """
    told = [(r, law) for r in records if r["kind"] != "real" for law in said(r)["effects"]]
    sure = [(r, law) for r, law in told if law["name"].startswith(LAW) and (law["probability"] or 0.0) >= SURE]
    return counted(is_right_law(record, law) for record, law in sure)


NOTHING, UNLISTED, UNEXPLAINED, FAILED = "nothing", "unlisted", "unexplained", "failed"


def confusion(records: Sequence[Record], kinds: Sequence[str]) -> Plain:
    """Confusion matrix (counts) of truths and first-named effects, over cases of some kinds.

    Rows are effects, ``nothing``, ``unlisted``; columns the rows' effects, then others, ``nothing``, ``unexplained``,
    ``failed``. Of several effects at work the first of the truth's list is the row. A discovered law counts as
    unexplained: it names no cause.
    """
    pairs = Counter((_true(r), _named(r)) for r in records if r["kind"] in kinds)
    rows = _ordered({true for true, _ in pairs}, (NOTHING, UNLISTED))
    effects = [r for r in rows if r not in (NOTHING, UNLISTED)]
    columns = [*effects, *_ordered({name for _, name in pairs} - set(effects), (NOTHING, UNEXPLAINED, FAILED))]
    return {"rows": rows, "columns": columns, "counts": [[pairs[row, column] for column in columns] for row in rows]}


def _true(record: Record) -> str:
    return UNLISTED if record["truth"].get("unlisted") else next(iter(at_work(record)), NOTHING)


def _named(record: Record) -> str:
    name = first_named(record)
    if failed(record):
        return FAILED
    if name is None:
        return UNEXPLAINED if unexplained(record) else NOTHING
    return UNEXPLAINED if name.startswith(LAW) else name


def _ordered(names: set[str], last: tuple[str, ...]) -> list[str]:
    return [*sorted(names - set(last)), *(name for name in last if name in names)]


_DETECTED = ("single", "hard")
RATIOS = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
SAMPLES = (20, 30, 45, 60, 80, 100, 150, 200)
WANTED = 0.9
ASKED_RATIOS = (1.0, 2.0)
_RIDGE = 0.01  # as if each coefficient were known to 10 beforehand: next to nothing, unless the data are separable
_POINTS = 41


def detection(records: Sequence[Record]) -> Plain:
    """Return detection rates by bins of size over noise, of rows and of both, and the fitted :func:`logistic` curve.

    Over cases with one effect of known size. ``table`` has one row for each bin of the size.
    """
    one = [(ratio(r, e), r["samples"], e in found(r)) for r in records if r["kind"] in _DETECTED for e in at_work(r)]
    size, rows, hit = np.array([case for case in one if case[0]], dtype=float).reshape(-1, 3).T
    by_ratio = np.searchsorted(RATIOS, size, side="right") - 1
    by_samples = np.searchsorted(SAMPLES, rows, side="right") - 1

    def steps(edges: Sequence[float], step: NDArray[np.int64]) -> list[Plain]:
        bounds = enumerate(zip(edges, (*edges[1:], None), strict=True))
        return [{"low": low, "high": high, "found": counted(hit[step == k])} for k, (low, high) in bounds]

    return {
        "ratio": steps(RATIOS, by_ratio),
        "samples": steps(SAMPLES, by_samples),
        "table": [
            [counted(hit[(by_ratio == k) & (by_samples == m)]) for m in range(len(SAMPLES))] for k in range(len(RATIOS))
        ],
        "curve": logistic(size, rows, hit > 0.5) if 0 < hit.sum() < len(hit) else None,
    }


def logistic(size: Array, rows: Array, hit: NDArray[np.bool_]) -> Plain:
    """Ridge logistic regression of detection (le Cessie & van Houwelingen 1992, Appl. Stat. 41, 191).

    Chance = logistic(intercept + ratio · ln(ratio) + samples · ln(samples)), on centred logarithms of the (N,) ratios
    to the noise and numbers of rows; ``hit`` says where the effect was found. ``std`` are the standard deviations of
    the three; ``ratios`` and ``rows`` the smallest and largest in the data, beyond which the curve is a guess;
    ``needed`` the rows that find an effect of :data:`ASKED_RATIOS` in 90 % of cases; ``over_ratio`` and
    ``over_samples`` lines at the lower and the upper quartile of the other quantity.
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

    def line(other: float, x: Array, s: Array | float, n: Array | float) -> Plain:
        chance = expit(a + b * np.log(s) + c * np.log(n))
        return {"other": float(other), "x": x.tolist(), "chance": chance.tolist()}

    s_range, n_range = (np.geomspace(v.min(), v.max(), _POINTS) for v in (size, rows))
    return {
        "intercept": float(a),
        "ratio": float(b),
        "samples": float(c),
        "std": np.sqrt(np.diag(uncentred @ spread @ uncentred.T)).tolist(),
        "ratios": [float(size.min()), float(size.max())],
        "rows": [float(rows.min()), float(rows.max())],
        "needed": [{"ratio": r, "samples": _needed(a, b, c, r)} for r in ASKED_RATIOS],
        "over_ratio": [line(n, s_range, s_range, n) for n in np.quantile(rows, (0.25, 0.75))],
        "over_samples": [line(s, n_range, s, n_range) for s in np.quantile(size, (0.25, 0.75))],
    }


def _needed(a: float, b: float, c: float, size: float) -> float | None:
    if b <= 0.0 or c <= 0.0:
        return None
    power = (np.log(WANTED / (1.0 - WANTED)) - a - b * np.log(size)) / c
    return float(np.exp(power)) if power < 20.0 else None  # beyond that it is no number of rows


def shares(
    predicted: Mapping[str, Sequence[Sequence[float]]], true: Sequence[Sequence[float]], noise: float
) -> dict[str, float]:
    """Shapley value of each effect's reduction of the gap's mean square, as a share of that mean square.

    ``predicted``: (M, 3) positions, m, by every subset's names joined with ``+``, frames and this subset being fitted;
    ``true``: positions without noise; ``noise``: one sigma per axis, m, which counts in the mean square, as in the
    claim. The sum is what all effects together take away; empty without subsets.
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
