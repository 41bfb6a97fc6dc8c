"""Faults of the measured columns: another unit, exchanged or mirrored axes, quaternions of another convention."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from thermal_robot.diagnosis.data_faults.kind import Kind, Repair
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows

Array = NDArray[np.float64]

METRIC = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
INCH = 0.0254
"""m."""


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


def _metric(readings: Readings) -> Iterator[tuple[str, Repair]]:
    for unit, size in METRIC.items():
        if unit != readings.length_unit:
            yield f"{unit}, not in {readings.length_unit}", _at_places(lambda p, by=size / _read(readings): p * by)  # type: ignore[misc]


def _inches(readings: Readings) -> Iterator[tuple[str, Repair]]:
    """Read as the declared unit; or converted from it where it was none, and the other way round."""
    exact = INCH / _read(readings)
    for by in dict.fromkeys(round(by, 9) for by in (exact, 25.4, 1 / 25.4) if by != 1.0):
        size = f"{by:.3g} times too small" if by > 1.0 else f"{1 / by:.3g} times too large"
        stand = f"positions stand in inches, not in {readings.length_unit}: " if by == round(exact, 9) else ""
        yield f"{stand}lengths are {size}{'' if stand else ': inches?'}", _at_places(lambda p, by=by: p * by)  # type: ignore[misc]


def _read(readings: Readings) -> float:
    return {**METRIC, "inch": INCH}[readings.length_unit]


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
    Kind("metric unit", "positions stand in {}", "correct length_unit", _metric),
    Kind("inch", "{}", 'set length_unit = "inch", or convert them', _inches),
)
AXES = (
    Kind("exchanged axes", "the columns {} are exchanged", "exchange their headers", _axes_exchanged),
    Kind("mirrored axis", "axis {} of the instrument points the other way", "change its sign", _mirrored),
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
