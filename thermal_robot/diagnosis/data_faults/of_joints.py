"""Faults of the joints' columns: reversed, exchanged, in another unit, counted from another zero."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.diagnosis.data_faults.kind import Kind, Repair
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows
from thermal_robot.diagnosis.data_faults.settings import TURN

Array = NDArray[np.float64]


def _changed(joints: list[int], change: Callable[[Array], Array]) -> Repair:
    """Return a repair that changes the columns of some joints."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        q = np.array(readings.q)
        q[:, joints] = np.where(struck[:, None], change(q[:, joints]), q[:, joints])
        return replace(readings, q=q)

    return repair


def _turning(readings: Readings) -> list[int]:
    return [j for j, kind in enumerate(readings.robot.joint_types) if kind != "prismatic"]


def _reversed(readings: Readings) -> Iterator[tuple[str, Repair]]:
    for j, name in enumerate(readings.robot.joint_names):
        yield name, _changed([j], np.negative)


def _exchanged(readings: Readings) -> Iterator[tuple[str, Repair]]:
    names = readings.robot.joint_names
    for i, j in combinations(range(len(names)), 2):
        yield f"{names[i]} and {names[j]}", _changed([i, j], lambda two: two[:, ::-1])


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
    Kind("reversed joint", "{} is reversed: it counts the other way round", "change the sign of its column", _reversed),
    Kind("exchanged joints", "the columns of {} are exchanged", "exchange their headers", _exchanged),
    Kind("degrees read as rad", "degrees are read as rad in {}", "convert them", _scaled(np.pi / 180)),
    Kind("rad read as degrees", "rad are read as degrees in {}", "convert them", _scaled(180 / np.pi)),
    Kind("zero off by 90°", "the zero of {} is 90° off", "add 90° or take it off", _zeros(TURN / 2, -TURN / 2)),
    Kind("zero off by 180°", "the zero of {} is 180° off", "add 180°", _zeros(TURN)),
)
