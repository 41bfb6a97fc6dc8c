"""Faults of the pairing: columns shifted by rows, clocks that differ, so that joints and measurement do not belong.

Where readings were interpolated to another clock, each is a mixture of what was commanded at two rows: w = A u with two
entries a row of A. What was mixed is given back by A⁺ w, as far as that is determined.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.kind import Kind, Repair
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows

_JOINTS, _MEASURED = ("q", "simulated_position"), ("position",)


def _shifted(readings: Readings) -> Iterator[tuple[str, Repair]]:
    for rows in (sign * k for k in range(1, settings.MOST_SHIFT + 1) for sign in (1, -1)):
        yield f"{abs(rows)} row{'' if abs(rows) == 1 else 's'} {'below' if rows > 0 else 'above'}", _rolled(rows)


def _rolled(by: int) -> Repair:
    def repair(readings: Readings, struck: Rows) -> Readings:
        source = np.arange(len(readings.q)) + by
        there = (source >= 0) & (source < len(source))
        source = np.where(struck & there, source, np.arange(len(source)))
        return _joints_of(readings, source, ~struck | there)

    return repair


def _joints_of(readings: Readings, source: NDArray[np.int64], known: Rows) -> Readings:
    """Return the readings with the joints of other rows."""
    columns = {name: column[source] for name in _JOINTS if (column := getattr(readings, name)) is not None}
    return replace(readings, **columns, known=known)


def _offsets(readings: Readings) -> tuple[float, ...]:
    """Return the offsets that are tried, s: linear where they are near, geometric beyond and below."""
    ordered = np.sort(np.asarray(readings.clock))
    between = np.diff(ordered)[np.diff(ordered) > 0.0]
    if not len(between):
        return ()
    unit, longest = float(np.median(between)), 0.5 * float(np.ptp(ordered))
    ratio, near = settings.OFFSET_RATIO, settings.NEAR_OFFSETS
    low = np.geomspace(
        settings.SMALLEST_OFFSET, near, 1 + round(np.log(near / settings.SMALLEST_OFFSET) / np.log(ratio))
    )
    middle = np.arange(settings.ORDERED, near, settings.ORDERED)
    far = np.geomspace(near, settings.FAR_OFFSETS, 1 + round(np.log(settings.FAR_OFFSETS / near) / np.log(ratio)))
    sizes = np.unique(np.concatenate([low, middle, far])) * unit
    sizes = sizes[sizes < longest]
    return tuple(float(s) for s in np.concatenate([-sizes[::-1], sizes]))


def _late(readings: Readings) -> Iterator[tuple[tuple[float, ...], Callable[[float], tuple[str, Repair]]]]:
    clock = readings.clock
    if clock is None or not np.ptp(clock) > 0.0:
        return
    tried = _offsets(readings)
    for style in (_between, _before, _nearest):
        yield tried, lambda by, style=style: (_words(by), style(by))  # type: ignore[misc]
    if len(clock) <= settings.MIXED_ROWS:
        yield tried, lambda by: (_words(by), _unmixed(-by, _JOINTS))
        yield tried, lambda by: (_words(by), _unmixed(by, _MEASURED))


def _words(by: float) -> str:
    return f"{abs(by):.3g} s {'earlier' if by < 0 else 'later'}"


def _places(readings: Readings, by: float) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Rows]:
    """Return for each row at its time and an offset: the rows before and after, the part of the latter, what is known.

    All (N,), by row numbers of the table.
    """
    clock = np.asarray(readings.clock)
    order = np.argsort(clock, kind="stable")
    at = clock + by
    after = np.clip(np.searchsorted(clock[order], at, "right"), 1, len(clock) - 1)
    low, high = clock[order[after - 1]], clock[order[after]]
    part = np.clip((at - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    inside = (at >= clock[order[0]]) & (at <= clock[order[-1]])
    return order[after - 1], order[after], part, inside


def _between(by: float) -> Repair:
    """Joints between two rows, where the arm goes straight from one to the next."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        first, second, part, inside = _places(readings, by)
        q = (1.0 - part)[:, None] * readings.q[first] + part[:, None] * readings.q[second]
        return replace(readings, q=np.where(struck[:, None], q, readings.q), known=~struck | inside)

    return repair


def _of_one(by: float, least: float) -> Repair:
    """Joints of one row: of the next where so large a part of the way to it is gone, else of the last one."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        first, second, part, inside = _places(readings, by)
        source = np.where(part >= least, second, first)
        return _joints_of(readings, np.where(struck, source, np.arange(len(source))), ~struck | inside)

    return repair


def _before(by: float) -> Repair:
    """Joints of the last row before, where the arm waits in its pose."""
    return _of_one(by, 1.0)


def _nearest(by: float) -> Repair:
    """Joints of the row that is nearest in time, as tables are joined."""
    return _of_one(by, 0.5)


def _unmixed(by: float, columns: tuple[str, ...]) -> Repair:
    """Columns that were interpolated at another time, as they were before."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        first, second, part, _ = _places(readings, by)
        own = np.arange(len(part))
        mixture = np.zeros((len(part), len(part)))
        mixture[own, np.where(struck, first, own)] = np.where(struck, 1.0 - part, 1.0)
        mixture[own, second] += np.where(struck, part, 0.0)
        back = np.linalg.pinv(mixture, rcond=settings.MIXED_FLOOR)
        known = np.einsum("ij,ji->i", back, mixture) > settings.UNMIXED
        changed = {name: back @ column for name in columns if (column := getattr(readings, name)) is not None}
        return replace(readings, **changed, known=known)

    return repair


KINDS = (
    Kind("shifted rows", "columns are shifted: measurements belong to the joints {}", "pair them anew", _shifted),
    Kind(
        "clock offset", "clocks differ: measurements belong to what the joints were {}", "pair them anew", offsets=_late
    ),
)
