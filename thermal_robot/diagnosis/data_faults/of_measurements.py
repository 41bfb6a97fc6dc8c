"""Faults of the measured columns: another unit, exchanged or mirrored axes, quaternions of another convention."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
from scipy.spatial.transform import Rotation

from thermal_robot.arrays import Array
from thermal_robot.campaign.units import LENGTH_UNITS
from thermal_robot.diagnosis.data_faults.kind import Kind, Repair
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows
from thermal_robot.diagnosis.data_faults.settings import ALIKE, FEET, INCHES, LARGEST_VOLUME, METRIC


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


def _sizes(steps: tuple[float, ...], ask: str = "") -> Callable[[Readings], Iterator[tuple[str, Repair]]]:
    """Propose factors; one that is no unit beside the declared one was applied twice, or where none was due."""

    def proposals(readings: Readings) -> Iterator[tuple[str, Repair]]:
        if readings.spread() > LARGEST_VOLUME:
            return
        read = LENGTH_UNITS[readings.length_unit]
        for by in (sign for step in steps for sign in (step, 1.0 / step)):
            size = f"lengths are {by if by > 1.0 else 1.0 / by:.4g} times too {'small' if by > 1.0 else 'large'}"
            unit = next((own for own, one in LENGTH_UNITS.items() if abs(one / read / by - 1.0) < ALIKE), "")
            said = f"positions stand in {unit}, not in {readings.length_unit}: {size}" if unit else f"{size}{ask}"
            yield said, _at_places(lambda p, by=by: p * by)  # type: ignore[misc]

    return proposals


def _axes_exchanged(_: Readings) -> Iterator[tuple[str, Repair]]:
    for i, j in combinations(range(3), 2):
        order = [{i: j, j: i}.get(k, k) for k in range(3)]
        yield f"{'xyz'[i]} and {'xyz'[j]}", _at_places(lambda p, order=order: p[..., order])  # type: ignore[misc]


def _mirrored(_: Readings) -> Iterator[tuple[str, Repair]]:
    for k, axis in enumerate("xyz"):
        sign = np.where(np.arange(3) == k, -1.0, 1.0)
        yield axis, _at_places(lambda p, sign=sign: p * sign)  # type: ignore[misc]


_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def _ordered(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        yield "x y z w", _turned(lambda wxyz: np.roll(wxyz, 1, axis=-1))
        yield "x y z w and conjugate", _turned(lambda wxyz: np.roll(wxyz, 1, axis=-1) * _CONJUGATE)


def _conjugate(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        yield "", _turned(lambda wxyz: wxyz * _CONJUGATE)


ANGLES = {
    "xyz": "rotations about fixed x, y, z",
    "zyx": "rotations about fixed z, y, x",
    "zyz": "rotations about fixed z, y, z",
    "XYZ": "rotations about turning x, y, z",
    "ZYX": "rotations about turning z, y, x",
    "ZYZ": "rotations about turning z, y, z",
    "rotvec": "a rotation vector",
}
"""Three numbers that tell a turn, as SciPy names them, and in words."""


def _three(quaternions: Array, meant: str) -> Array:
    """(N, 3) rad, of which these (N, 4) quaternions were made."""
    turn = Rotation.from_quat(np.roll(quaternions, -1, axis=-1))
    return np.asarray(turn.as_rotvec() if meant == "rotvec" else turn.as_euler(meant, suppress_warnings=True))


def _wxyz(three: Array, meant: str) -> Array:
    turn = Rotation.from_rotvec(three) if meant == "rotvec" else Rotation.from_euler(meant, three)
    return np.asarray(np.roll(turn.as_quat(), 1, axis=-1))


def _angles(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        for taken, meant in permutations(ANGLES, 2):
            change = lambda wxyz, taken=taken, meant=meant: _wxyz(_three(wxyz, taken), meant)  # noqa: E731
            yield f"{ANGLES[meant]}, not of {ANGLES[taken]}", _turned(change)


def _angles_in_degrees(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        for own, words in ANGLES.items():
            yield words, _turned(lambda wxyz, own=own: _wxyz(np.rad2deg(_three(wxyz, own)), own))  # type: ignore[misc]


UNITS = (
    Kind("metric unit", "{}", "correct length_unit", _sizes(METRIC)),
    Kind("inch", "{}", "convert them, or correct length_unit", _sizes(INCHES, " (inches?)")),
    Kind("foot", "{}", "convert them, or correct length_unit", _sizes(FEET, " (feet?)")),
)
AXES = (
    Kind("exchanged axes", "columns {} are exchanged", "exchange their headers", _axes_exchanged),
    Kind("mirrored axis", "the instrument's axis {} is mirrored", "change its sign", _mirrored),
)
TURNS = (
    Kind("quaternion order", "quaternions stand in the order {}", "put the scalar first", _ordered),
    Kind(
        "conjugate quaternion",
        "quaternions turn the measurement frame into the target's, not back",
        "change the sign of qx, qy, qz",
        _conjugate,
    ),
    Kind("angles of orientations", "orientations are made of {}", "convert them anew", _angles),
    Kind("angles in degrees", "angles in rad are read as degrees in {}", "convert them anew", _angles_in_degrees),
)
KINDS = (*UNITS, *AXES, *TURNS)
