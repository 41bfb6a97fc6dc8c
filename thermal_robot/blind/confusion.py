"""What was named where something else was true."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from thermal_robot.blind.judged import LAW, Record, at_work, failed, first_named, unexplained

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
