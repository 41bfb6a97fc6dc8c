"""Faults of the measured columns: another unit, exchanged or mirrored axes, quaternions of another convention."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.units import LENGTH_UNITS
from thermal_robot.diagnosis.data_faults.kind import Kind, Repair
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows

Array = NDArray[np.float64]

METRIC = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
INCH = {"inch": 0.0254}


def _at_places(change: Callable[[Array], Array]) -> Repair:
    """Return a repair that changes measured positions."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        return replace(readings, position=np.where(struck[:, None], change(readings.position), readings.position))

    return repair


def _turned(change: Callable[[Array], Array]) -> Repair:
    """Return a repair that changes measured orientations."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        measured = np.asarray(readings.orientation)
        return replace(readings, orientation=np.where(struck[:, None], change(measured), measured))

    return repair


def _units(units: dict[str, float]) -> Callable[[Readings], Iterator[tuple[str, Repair]]]:
    def proposals(readings: Readings) -> Iterator[tuple[str, Repair]]:
        read = LENGTH_UNITS[readings.length_unit]
        for unit, size in units.items():
            if size != read:
                yield f"{unit}, not in {readings.length_unit}", _at_places(lambda p, by=size / read: p * by)  # type: ignore[misc]

    return proposals


def _axes_exchanged(_: Readings) -> Iterator[tuple[str, Repair]]:
    for i, j in combinations(range(3), 2):
        order = [{i: j, j: i}.get(k, k) for k in range(3)]
        yield f"{'xyz'[i]} and {'xyz'[j]}", _at_places(lambda p, order=order: p[:, order])  # type: ignore[misc]


def _mirrored(_: Readings) -> Iterator[tuple[str, Repair]]:
    for k, axis in enumerate("xyz"):
        sign = np.where(np.arange(3) == k, -1.0, 1.0)
        yield axis, _at_places(lambda p, sign=sign: p * sign)  # type: ignore[misc]


_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def _ordered(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        yield "x y z w", _turned(lambda wxyz: np.roll(wxyz, 1, axis=1))
        yield "x y z w and conjugate", _turned(lambda wxyz: np.roll(wxyz, 1, axis=1) * _CONJUGATE)


def _conjugate(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        yield "", _turned(lambda wxyz: wxyz * _CONJUGATE)


KINDS = (
    Kind("metric unit", "positions stand in {}", "correct length_unit", _units(METRIC)),
    Kind("inch", "positions stand in {}", "convert them", _units(INCH)),
    Kind("exchanged axes", "the columns {} are exchanged", "exchange their headers", _axes_exchanged),
    Kind("mirrored axis", "axis {} of the instrument points the other way", "change its sign", _mirrored),
    Kind("quaternion order", "quaternions stand in the order {}", "put the scalar first", _ordered),
    Kind(
        "conjugate quaternion",
        "quaternions turn the measurement frame into the target's, not back",
        "change the sign of qx, qy, qz",
        _conjugate,
    ),
)
