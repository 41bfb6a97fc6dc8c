"""Validation of numbers and arrays: finite, within range, of the required shape."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import did_you_mean, listed, split_name
from thermal_robot.campaign.settings import ABSOLUTE_ZERO, SMALLEST
from thermal_robot.errors import CampaignError
from thermal_robot.schema import LARGEST

QUATERNION_TOLERANCE = 0.1
"""A quaternion whose length differs from 1 by more is a mistake, not a rounding: four parts that are written with one
decimal change the length by at most 0.05 · √4."""
ROTATION_TOLERANCE = 0.01  # By how much the product of a matrix with its transpose may differ from 1: two decimals do
LARGEST_COMMAND = 1e6  # rad or m: 160 000 turns, which leave ten digits for the angle

Rows: TypeAlias = "NDArray[np.int64]"
IMPOSSIBLE: dict[str, tuple[Callable[[Array], NDArray[np.bool_]], str]] = {
    "approach.<joint>": (lambda values: ~np.isin(values, (-1.0, 0.0, 1.0)) & ~np.isnan(values), "-1, 0 or 1"),
    "payload": (lambda values: values < 0, "a mass in kg that is not negative"),
    "temperature": (lambda values: values < ABSOLUTE_ZERO, "°C"),
}
"""Which values a quantity cannot have, and what is expected."""


def first_true(refused: NDArray[np.bool_]) -> int | None:
    """Index of the first true entry of (N,), or row of (N, k); ``None`` without one."""
    rows = refused if refused.ndim == 1 else refused.any(axis=1)
    return int(np.argmax(rows)) if rows.any() else None


def beyond(values: Array, most: float = LARGEST) -> NDArray[np.bool_]:
    """Mask, of the shape of the values, of numbers that are not finite or whose absolute value exceeds ``most``."""
    return ~(np.abs(values) <= most)


def without_rounding(values: Array) -> Array:
    """Set numbers below 1e-30 in absolute value to 0; returns the array itself where there are none."""
    vanishing = (np.abs(values) < SMALLEST) & (values != 0.0)
    return np.where(vanishing, 0.0, values) if vanishing.any() else values


def no_orientation(quaternions: Array) -> NDArray[np.bool_]:
    """Mask (N,) of the (N, 4) quaternions whose norm differs from 1 by more than 0.1."""
    return np.asarray(np.abs(np.linalg.norm(quaternions, axis=1) - 1.0) > QUATERNION_TOLERANCE)


def no_rotation(matrices: Array) -> NDArray[np.bool_]:
    """Mask (N,) of the (N, 3, 3) matrices that are no rotations: R Rᵀ is off by more than 0.01, or det R < 0."""
    away = np.abs(matrices @ matrices.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    return np.asarray((away > ROTATION_TOLERANCE) | (np.linalg.det(matrices) < 0.0))


def refuse(
    file: str,
    column: str,
    wrong: NDArray[np.bool_],
    problem: str,
    expected: str,
    found: Callable[[int], str],
    rows: Rows | None = None,
) -> None:
    """Raise a CampaignError for the first row that is true in a mask (N,) or (N, k); do nothing without one.

    The message has the row's number in ``rows`` (N,), or its index, and what ``found`` says of that index.
    """
    index = first_true(wrong)
    if index is not None:
        row, place = (None, f" at index {index}") if rows is None else (int(rows[index]), "")
        told = f"{found(index)}{place}"
        raise CampaignError(file, problem, row=row, column=column, found=told, expected=expected)


def checked_array(file: str, key: str, value: Any, shape: tuple[int, ...], kind: Any) -> NDArray[Any]:
    """Convert a value to a read-only array of a required shape and type; a copy unless the input is read-only.

    A CampaignError with ``file`` and ``key`` refuses other values than numbers, another shape, and numbers that are not
    finite or too large. ``kind`` is ``np.float64``, ``np.int64``, ``np.bool_`` or ``np.str_``.
    """
    try:
        array = _as_array(value, kind)
    except (TypeError, ValueError, OverflowError) as error:
        found = type(value).__name__ if not isinstance(value, np.ndarray) else f"{value.dtype} {value.shape}"
        expected = str(shape) if kind is np.str_ else f"numbers of shape {shape}"
        raise CampaignError(file, "cannot be read as an array", column=key, found=found, expected=expected) from error
    if array.shape != shape:
        raise CampaignError(file, "wrong shape", column=key, found=str(array.shape), expected=str(shape))
    if kind is np.float64:
        wrong = beyond(array, LARGEST_COMMAND if key == "q" else LARGEST)
        expected, problem = "a finite number in every place", "not a figure of a campaign"
        refuse(file, key, wrong, problem, expected, lambda index: str(array[index]))
        array = without_rounding(array)
    if array.flags.writeable:
        array = array.copy()
        array.flags.writeable = False
    return array


def _as_array(value: Any, kind: Any) -> NDArray[Any]:
    if np.ma.is_masked(value):
        value = value.astype(np.float64).filled(np.nan)
    array = np.asarray(value)
    if kind is not np.str_ and array.dtype.kind not in "biufO":
        raise TypeError(f"{array.dtype} is no kind of number")
    if kind is np.int64 and array.dtype.kind in "fO" and beyond(array.astype(np.float64)).any():
        raise ValueError("not a finite number")
    return array.astype(kind, copy=False)


def check_quaternions(file: str, key: str, quaternions: Array, rows: Rows | None = None) -> None:
    """Raise a CampaignError for the first of (N, 4) quaternions whose norm differs from 1 by more than 0.1."""

    def found(index: int) -> str:
        one = quaternions[index]
        return f"({', '.join(f'{part:g}' for part in one)}) of length {np.linalg.norm(one):.3g}"

    problem, expected = "no orientation: the quaternion's length is not 1", "qw, qx, qy, qz of length 1"
    refuse(file, key, no_orientation(quaternions), problem, expected, found, rows)


def check_covariate(file: str, name: str, values: Array, rows: Rows | None = None) -> None:
    """Raise a CampaignError for the first of (N,) values that its quantity cannot have.

    These are approach other than −1, 0, 1, negative payload, and temperature below absolute zero.
    """
    quantity, place = split_name(name)
    known = "approach.<joint>" if quantity == "approach" and place else quantity if quantity == "temperature" else name
    if known in IMPOSSIBLE:
        wrong, expected = IMPOSSIBLE[known]
        refuse(file, name, wrong(values), "impossible value", expected, lambda index: f"{values[index]:.15g}", rows)


def check_joints(
    file: str, key: str, named: Iterable[str], joints: tuple[str, ...], lines: Mapping[str, int | None] | None = None
) -> None:
    """Raise a CampaignError for the first name that is no joint of the chain, with its line and the nearest name."""
    for joint in named:
        if joint not in joints:
            problem = f"the chain has no such joint{did_you_mean(joint, joints)}"
            row, expected = (lines or {}).get(joint), f"one of {listed(joints)}"
            raise CampaignError(file, problem, row=row, column=f"{key}.{joint}", expected=expected)


def checked_mapping(file: str, key: str, given: Any) -> Mapping[str, Any]:
    """Return the value if it is a mapping with text keys; else raise a CampaignError."""
    if isinstance(given, Mapping) and all(isinstance(name, str) for name in given):
        return given
    expected = "values by name, as a dict"
    raise CampaignError(file, "wrong kind of value", column=key, found=repr(given), expected=expected)
