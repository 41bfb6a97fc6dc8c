"""What a program hands to the constructor of a campaign, as arrays and numbers that can be computed with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.figures import LARGEST_COMMAND, SMALLEST, first_beyond, impossible, no_orientation, settled
from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.errors import CampaignError
from thermal_robot.schema import LARGEST

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


def check_quaternions(file: str, key: str, quaternions: NDArray[np.float64]) -> None:
    """Refuse (N, 4) quaternions of which one is no orientation.

    Raises
    ------
    CampaignError
        Naming the first.
    """
    row = no_orientation(quaternions)
    if row is not None:
        found, expected = f"{quaternions[row]} at index {row}", "qw, qx, qy, qz of length 1"
        raise CampaignError(file, "no orientation", column=key, found=found, expected=expected)


def check_covariate(file: str, name: str, values: NDArray[np.float64]) -> None:
    """Refuse (N,) numbers that cannot be what their name says.

    Raises
    ------
    CampaignError
        Naming the first.
    """
    wrong = impossible(name, values)
    if wrong:
        row, expected = wrong
        found = f"{values[row]:.15g} at index {row}"
        raise CampaignError(file, "impossible value", column=name, found=found, expected=expected)


def check_joints(file: str, key: str, named: Iterable[str], joints: tuple[str, ...]) -> None:
    """Refuse what is stated of a joint that the chain does not have.

    Raises
    ------
    CampaignError
        Naming it, and the nearest joint of the chain.
    """
    for joint in named:
        if joint not in joints:
            problem = f"the chain has no such joint{did_you_mean(joint, joints)}"
            raise CampaignError(file, problem, column=f"{key}.{joint}", expected=f"one of {listed(joints)}")


def checked_number(file: str, key: str, value: Any, *, least: float = -LARGEST, expected: str = "a number") -> float:
    """Return a finite number, at least ``least``.

    Raises
    ------
    CampaignError
        Anything else.
    """
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
    """Return (N,) standard deviations, read-only.

    Raises
    ------
    CampaignError
        Another shape, or one that is not above 0: naming the first.
    """
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
    """Return what is given by names.

    Raises
    ------
    CampaignError
        Something else than a mapping, or keys that are no text.
    """
    if isinstance(given, Mapping) and all(isinstance(name, str) for name in given):
        return given
    raise CampaignError(
        file, "wrong kind of value", column=key, found=repr(given), expected="values by name, as a dict"
    )
