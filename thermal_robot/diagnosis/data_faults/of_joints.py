"""Faults of the joints' columns: reversed, exchanged, coupled, in another unit, counted from another zero."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.data_faults.kind import Kind, Repair
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows
from thermal_robot.diagnosis.data_faults.settings import (
    FEW_REVERSED,
    KUKA_JOINTS,
    KUKA_REVERSED,
    MOST_PATTERNS,
    TURN,
)


def _changed(joints: list[int], change: Callable[[Array], Array]) -> Repair:
    """Return a repair that changes the columns of some joints."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        q = np.array(readings.q)
        q[..., joints] = np.where(struck[:, None], change(q[..., joints]), q[..., joints])
        return replace(readings, q=q)

    return repair


def _turning(readings: Readings) -> list[int]:
    return [j for j, kind in enumerate(readings.robot.joint_types) if kind != "prismatic"]


def sign_patterns(joints: int) -> NDArray[np.int64]:
    """(P, n) signs of the joints, all that are not all right; the fewest reversed first, of many joints the first."""
    most = joints if joints <= MOST_PATTERNS else FEW_REVERSED
    sets = [own for count in range(1, most + 1) for own in combinations(range(joints), count)]
    return np.array([[-1 if j in own else 1 for j in range(joints)] for own in sets])


def reversing(signs: NDArray[np.int64], readings: Readings) -> tuple[str, Repair, frozenset[str]]:
    """Return place and repair of joints that are reversed, those of sign −1, and their names."""
    joints = [int(j) for j in np.flatnonzero(signs < 0)]
    names = [readings.robot.joint_names[j] for j in joints]
    usual = " (as a KUKA's do)" if len(signs) == KUKA_JOINTS and joints == KUKA_REVERSED else ""
    said = f"{', '.join(names[:-1])} and {names[-1]} count the other way round{usual}" if names[1:] else names[0]
    return said, _changed(joints, np.negative), frozenset(names)


def _reversed(several: bool) -> Callable[[Readings], Iterator[tuple[str, Repair, frozenset[str]]]]:
    def proposals(readings: Readings) -> Iterator[tuple[str, Repair, frozenset[str]]]:
        for signs in sign_patterns(readings.robot.n):
            if ((signs < 0).sum() > 1) is np.bool_(several):
                yield reversing(signs, readings)

    return proposals


def _coupled(readings: Readings) -> Iterator[tuple[str, Repair]]:
    """Pendants that count a joint from the ground, not from the link before it, and wrists that turn together."""
    names = readings.robot.joint_names
    for j, k in permutations(range(len(names)), 2):
        if abs(j - k) == 1 and readings.robot.joint_types[j] != "prismatic" != readings.robot.joint_types[k]:
            for word, sign in (("minus", 1.0), ("plus", -1.0)):
                place = f"{names[j]} holds {names[j]} {word} {names[k]}"
                yield place, _changed([j, k], lambda two, s=sign: two + two[..., 1:] * [s, 0.0])  # type: ignore[misc]


def _exchanged(readings: Readings) -> Iterator[tuple[str, Repair]]:
    names = readings.robot.joint_names
    for i, j in combinations(range(len(names)), 2):
        yield f"{names[i]} and {names[j]}", _changed([i, j], lambda two: two[..., ::-1])


def _scaled(factor: float) -> Callable[[Readings], Iterator[tuple[str, Repair]]]:
    def proposals(readings: Readings) -> Iterator[tuple[str, Repair]]:
        turning = _turning(readings)
        for j in turning:
            yield readings.robot.joint_names[j], _changed([j], lambda angle: angle * factor)
        if len(turning) > 1:
            yield "all joints", _changed(turning, lambda angle: angle * factor)

    return proposals


def _zeros(*shifts: float) -> Callable[[Readings], Iterator[tuple[str, Repair]]]:
    def proposals(readings: Readings) -> Iterator[tuple[str, Repair]]:
        for j in _turning(readings):
            for shift in shifts:
                yield readings.robot.joint_names[j], _changed([j], lambda angle, by=shift: angle + by)  # type: ignore[misc]

    return proposals


KINDS = (
    Kind(
        "reversed joint",
        "{} is reversed: it counts the other way round",
        "change the sign of its column",
        _reversed(False),
    ),
    Kind("reversed joints", "{}", "change the sign of their columns", _reversed(True)),
    Kind("coupled joints", "the column of {} (coupled, as on a Fanuc's pendant)", "undo the coupling", _coupled),
    Kind("exchanged joints", "the columns of {} are exchanged", "exchange their headers", _exchanged),
    Kind("degrees read as rad", "degrees are read as rad in {}", "convert them", _scaled(np.pi / 180)),
    Kind("rad read as degrees", "rad are read as degrees in {}", "convert them", _scaled(180 / np.pi)),
    Kind("zero off by 90°", "the zero of {} is 90° off", "add 90° or take it off", _zeros(TURN / 2, -TURN / 2)),
    Kind("zero off by 180°", "the zero of {} is 180° off", "add 180°", _zeros(TURN)),
)
