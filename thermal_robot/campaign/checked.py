"""What a program makes a campaign of: arrays and numbers that can be computed with, none too large or too small."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.names import did_you_mean, listed, split_name
from thermal_robot.campaign.settings import ABSOLUTE_ZERO
from thermal_robot.errors import CampaignError
from thermal_robot.schema import LARGEST

SMALLEST = 1e-30
"""In any unit: what is nearer to 0 is 0; a picometre in metres is 1e-12."""
QUATERNION_TOLERANCE = 0.1
"""A quaternion whose length differs from 1 by more is a mistake, not a rounding: four parts that are written with one
decimal change the length by at most 0.05 · √4."""
LARGEST_COMMAND = 1e6
"""rad or m: 160 000 turns, which leave ten digits for the angle."""


def first_beyond(values: NDArray[np.float64], most: float = LARGEST) -> int | None:
    """Return the row of the first figure that is not finite or too large, of (N,) or (N, k); ``None`` without one."""
    beyond = ~(np.abs(values) <= most)
    rows = beyond if values.ndim == 1 else beyond.any(axis=1)
    return int(np.argmax(rows)) if rows.any() else None


def settled(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the figures with those that are next to nothing as 0; the array itself where there are none."""
    vanishing = (np.abs(values) < SMALLEST) & (values != 0.0)
    return np.where(vanishing, 0.0, values) if vanishing.any() else values


def no_orientation(quaternions: NDArray[np.float64]) -> int | None:
    """Return the row of the first quaternion, of (N, 4), whose length is not 1; ``None`` without one."""
    refused = np.abs(np.linalg.norm(quaternions, axis=1) - 1.0) > QUATERNION_TOLERANCE
    return int(np.argmax(refused)) if refused.any() else None


Rows: TypeAlias = "NDArray[np.int64]"

_NUMBERS = "a finite number in every place"


def checked_array(file: str, key: str, value: Any, shape: tuple[int, ...], kind: Any) -> NDArray[Any]:
    """Return a value as an array, read-only; a copy unless it already was: the caller's own stays writable.

    Parameters
    ----------
    file, key
        What it belongs to, and its name, for a message.
    value
        Anything.
    shape, kind
        What it must have, and the type that it is given: ``np.float64``, ``np.int64``, ``np.bool_`` or ``np.str_``.

    Raises
    ------
    CampaignError
        Something else than numbers, another shape, a figure that is not finite or larger than any.
    """
    expected = str(shape) if kind is np.str_ else f"numbers of shape {shape}"
    try:
        if np.ma.is_masked(value):
            value = value.astype(np.float64).filled(np.nan)
        array = np.asarray(value)
        if kind is not np.str_ and array.dtype.kind not in "biufO":
            raise TypeError(f"{array.dtype} is no kind of number")
        if kind is np.int64 and array.dtype.kind in "fO":
            array = array.astype(np.float64)
            if first_beyond(array.ravel()) is not None:
                raise ValueError("not a finite number")
        array = array.astype(kind, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        found = type(value).__name__ if not isinstance(value, np.ndarray) else f"{value.dtype} {value.shape}"
        raise CampaignError(file, "cannot be read as an array", column=key, found=found, expected=expected) from error
    if array.shape != shape:
        raise CampaignError(file, "wrong shape", column=key, found=str(array.shape), expected=str(shape))
    if kind is np.float64:
        row = first_beyond(array, LARGEST_COMMAND if key == "q" else LARGEST)
        if row is not None:
            found = f"{array[row]} at index {row}"
            raise CampaignError(file, "not a figure of a campaign", column=key, found=found, expected=_NUMBERS)
        array = settled(array)
    if array.flags.writeable:
        array = array.copy()
        array.flags.writeable = False
    return array


def check_quaternions(file: str, key: str, quaternions: NDArray[np.float64], rows: Rows | None = None) -> None:
    """Refuse (N, 4) quaternions of which one is no orientation, naming its number of (N,) ``rows``, or its index."""
    index = no_orientation(quaternions)
    if index is not None:
        four = ", ".join(f"{part:g}" for part in quaternions[index])
        found, expected = f"({four}) of length {np.linalg.norm(quaternions[index]):.3g}", "qw, qx, qy, qz of length 1"
        problem = "no orientation: the quaternion's length is not 1"
        raise CampaignError(file, problem, column=key, expected=expected, **_at(found, index, rows))


def check_covariate(file: str, name: str, values: NDArray[np.float64], rows: Rows | None = None) -> None:
    """Refuse (N,) numbers that cannot be what their name says, naming the number of (N,) ``rows``, or the index."""
    quantity, place = split_name(name)
    if quantity == "approach" and place:
        refused, expected = ~np.isin(values, (-1.0, 0.0, 1.0)) & ~np.isnan(values), "-1, 0 or 1"
    elif name == "payload":
        refused, expected = values < 0, "a mass in kg that is not negative"
    elif quantity == "temperature":
        refused, expected = values < ABSOLUTE_ZERO, "°C"
    else:
        return
    if refused.any():
        row = int(np.argmax(refused))
        told = _at(f"{values[row]:.15g}", row, rows)
        raise CampaignError(file, "impossible value", column=name, expected=expected, **told)


def _at(found: str, index: int, rows: Rows | None) -> dict[str, Any]:
    """Return what was found, and in which row: by its number, where there are any."""
    return {"found": f"{found} at index {index}"} if rows is None else {"found": found, "row": int(rows[index])}


def check_joints(
    file: str, key: str, named: Iterable[str], joints: tuple[str, ...], lines: Mapping[str, int | None] | None = None
) -> None:
    """Refuse what is stated of a joint that the chain does not have, with its line; name the nearest joint."""
    for joint in named:
        if joint not in joints:
            problem = f"the chain has no such joint{did_you_mean(joint, joints)}"
            row, expected = (lines or {}).get(joint), f"one of {listed(joints)}"
            raise CampaignError(file, problem, row=row, column=f"{key}.{joint}", expected=expected)


def checked_number(file: str, key: str, value: Any, *, least: float = -LARGEST, expected: str = "a number") -> float:
    """Return a finite number, at least ``least``; refuse anything else."""
    if isinstance(value, (int, float, np.integer, np.floating)) and type(value) is not bool:
        if least <= value <= LARGEST:
            return float(value)
    raise CampaignError(file, "not a figure of a campaign", column=key, found=repr(value), expected=expected)


def checked_noise(file: str, key: str, sigma: Any) -> float | None:
    """Return a standard deviation, ``None`` where it is not given or 0, which says the same."""
    if sigma is None or (isinstance(sigma, (int, float, np.number)) and sigma == 0):
        return None
    return checked_number(file, key, sigma, least=SMALLEST, expected="a number above 0, or None")


def checked_sigmas(file: str, key: str, sigmas: Any, samples: int) -> NDArray[np.float64]:
    """Return (N,) standard deviations, read-only; refuse one that is not above 0."""
    values = checked_array(file, key, sigmas, (samples,), np.float64)
    refused = values < SMALLEST
    if refused.any():
        row = int(np.argmax(refused))
        found, expected = f"{values[row]:.15g} at index {row}", "a number above 0"
        raise CampaignError(file, "no standard deviation", column=key, found=found, expected=expected)
    return values


def checked_sizes(file: str, key: str, sizes: Any) -> dict[str, float]:
    """Return numbers above 0 by name."""
    above = "a number above 0"
    held = checked_mapping(file, key, sizes).items()
    return {name: checked_number(file, f"{key}.{name}", size, least=SMALLEST, expected=above) for name, size in held}


def checked_mapping(file: str, key: str, given: Any) -> Mapping[str, Any]:
    """Return what is given by names; refuse anything else than a mapping whose keys are text."""
    if isinstance(given, Mapping) and all(isinstance(name, str) for name in given):
        return given
    raise CampaignError(
        file, "wrong kind of value", column=key, found=repr(given), expected="values by name, as a dict"
    )
