"""The score of a blind trial: what was asked, what was said, how often it was right."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, get_args

import numpy as np

from thermal_robot.blind.cases import SEVERAL, Kind
from thermal_robot.blind.confusion import Confusion, Detection, confusion, detection
from thermal_robot.blind.coverage import (
    Calibration,
    Coverage,
    Rate,
    Shrinkage,
    Spread,
    calibration,
    coverage,
    fresh_ratio,
    rate,
    shrinkage,
    spread,
    worse,
)
from thermal_robot.blind.judged import (
    BAD,
    HEADLINE,
    KNOWN,
    LAW,
    Plain,
    Record,
    answer,
    at_work,
    failed,
    found,
    is_miss,
    is_right_law,
    marks,
    said,
)
from thermal_robot.blind.judged_several import said_words, true_words

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
    """Score a trial.

    Parameters
    ----------
    records
        As in :mod:`thermal_robot.blind.cases`.

    Returns
    -------
    Score
        A failed diagnosis counts as wrong everywhere.
    """
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


def _grouped(named: Iterable[tuple[str, Record]]) -> dict[str, dict[str, Rate]]:
    groups: dict[str, list[Record]] = defaultdict(list)
    for name, record in named:
        groups[name].append(record)
    return {name: _rates(groups[name]) for name in sorted(groups)}


def _by_effect(records: Sequence[Record]) -> dict[str, dict[str, Rate]]:
    groups: dict[str, list[Record]] = defaultdict(list)
    for record in records:
        for name in at_work(record):
            groups[name].append(record)
    return {
        name: {
            "first_named": rate(all(marks(r)["first_named"]) for r in groups[name]),
            "found": rate(name in found(r) for r in groups[name]),
        }
        for name in sorted(groups)
    }


def _seconds(values: Sequence[float]) -> Seconds:
    if not values:
        return Seconds(None, None, None)
    return Seconds(float(np.median(values)), float(np.quantile(values, 0.95)), max(values))


def _miss(record: Record) -> Miss:
    true, told = _told_of_several(record) if record["kind"] in SEVERAL else _told(record)
    return Miss(
        id=record["id"],
        kind=record["kind"],
        robot=record["robot"],
        truth=true,
        **told,
        wrong=tuple(q for q, given in marks(record).items() if any(a == (q in BAD) for a in given)),
        error=(record.get("error") or "no diagnosis") if failed(record) else None,
    )


def _told(record: Record) -> tuple[tuple[str, ...], dict[str, Any]]:
    truth, verdict = record["truth"], said(record)["verdict"]
    place, quantity = answer(record)
    where = f"{place[1] or place[0]}, {quantity}" if place else str(quantity or "somewhere")
    true = (*at_work(record), *([truth["unlisted"]] if truth.get("unlisted") else []))
    return true, {
        "said": tuple(verdict["effects"]),
        "unexplained": where if verdict["unexplained"] else None,
        "probability": None if failed(record) else verdict["probability"],
    }


def _told_of_several(record: Record) -> tuple[tuple[str, ...], dict[str, Any]]:
    told = said_words(record["kind"], said(record))
    return true_words(record["truth"]), {"said": told, "unexplained": None, "probability": None}


def _plain(value: Any) -> Any:
    if isinstance(value, Rate):
        return {
            "successes": value.successes,
            "trials": value.trials,
            "value": value.value,
            "interval": _plain(value.interval),
        }
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
