"""What a temperature adds to the lengths of a robot (Eq 5), and the coefficients of expansion behind an elongation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.errors import RobotError
from thermal_robot.kinematics import growing
from thermal_robot.robot import Robot, Segment

Array = NDArray[np.float64]

PerSegment: TypeAlias = "ArrayLike | Mapping[str, ArrayLike]"
"""One number for all segments, an array (..., S), or a value (...) for each name of a segment or of its link."""

STANDARD_TEMPERATURE = 20.0
"""°C at which lengths are meant (ISO 1)."""


def segment_names(robot: Robot) -> tuple[str, ...]:
    """Names of the S segments that have a length, from the root on: the order of every array of elongations."""
    return tuple(segment.name for segment in _segments(robot))


def lengths(robot: Robot) -> Array:
    """Lengths (S,) of these segments, m."""
    return np.array([segment.length for segment in _segments(robot)])


def elongation(
    robot: Robot,
    temperature: PerSegment,
    *,
    coefficients: PerSegment,
    reference: float = STANDARD_TEMPERATURE,
) -> Array:
    """Elongation of every segment with a length: Δl_i = χ_i l_i (T_i − T_reference), Eq 5.

    Parameters
    ----------
    robot
        The robot.
    temperature
        °C: one number, an array (..., S), or a mapping from the names of segments, or of the links that carry them,
        to numbers or to arrays of one shape (...), such as the instants of a warm-up.
    coefficients
        Coefficient of expansion, 1/K, in the same forms.
    reference
        °C at which the lengths of the robot description hold.

    Returns
    -------
    ndarray
        (..., S) m, in the order of :func:`segment_names`.

    Raises
    ------
    RobotError
        If a name is unknown, a segment gets no value, or a shape does not fit.
    """
    rise = per_segment(robot, temperature, "temperature") - reference
    return per_segment(robot, coefficients, "coefficient of expansion") * lengths(robot) * rise


def expansion_coefficients(robot: Robot, elongations: PerSegment, rise: PerSegment) -> Array:
    """Coefficient of expansion (..., S), 1/K, of each segment that grew by ``elongations`` (m) in ``rise`` kelvins."""
    strain = per_segment(robot, elongations, "elongation") / lengths(robot)
    found: Array = strain / per_segment(robot, rise, "rise of temperature")
    return found


def expansion_coefficient(
    robot: Robot, elongations: PerSegment, rise: PerSegment, *, segments: Iterable[str] | None = None
) -> float:
    """Find the one coefficient of expansion that explains elongations best, by least squares.

    Parameters
    ----------
    robot
        The robot.
    elongations, rise
        m and K, in the forms of :func:`elongation`; any number of states may be given at once.
    segments
        Names of the segments, or links, to count; all by default.

    Returns
    -------
    float
        1/K.

    Raises
    ------
    RobotError
        If a name is unknown or a shape does not fit.
    """
    chosen = slice(None) if segments is None else [c for name in segments for c in columns_of(robot, name)]
    expected = (lengths(robot) * per_segment(robot, rise, "rise of temperature"))[..., chosen]
    grown = per_segment(robot, elongations, "elongation")[..., chosen]
    return float(np.sum(expected * grown) / np.sum(np.broadcast_to(expected, np.broadcast(expected, grown).shape) ** 2))


def per_segment(robot: Robot, values: PerSegment, what: str) -> Array:
    """Write values given in any form as (..., S), one for each segment with a length.

    The name of a segment goes before the name of its link.

    Raises
    ------
    RobotError
        If a name is unknown, a segment gets no value, or a shape does not fit.
    """
    names = segment_names(robot)
    if not isinstance(values, Mapping):
        array = np.asarray(values, dtype=float)
        if array.ndim == 0:
            return np.full(len(names), array)
        if array.shape[-1] != len(names):
            raise RobotError(
                f"{what} of shape {array.shape} does not fit the {len(names)} segments of robot {robot.name!r}: "
                f"{', '.join(names)}",
                name=robot.name,
                candidates=names,
            )
        return array
    found: dict[int, Array] = {}
    # Links first, so that a segment's own value replaces the value of its link.
    for name in sorted(values, key=lambda name: name in names):
        for column in columns_of(robot, name):
            found[column] = np.asarray(values[name], dtype=float)
    missing = tuple(name for column, name in enumerate(names) if column not in found)
    if missing:
        raise RobotError(f"no {what} is given for {', '.join(missing)}", name=missing[0], candidates=missing)
    return np.stack(np.broadcast_arrays(*(found[column] for column in range(len(names)))), axis=-1)


def columns_of(robot: Robot, name: str) -> tuple[int, ...]:
    """Columns of the segment of a name, or of the segments that a link carries.

    Raises
    ------
    RobotError
        If neither a segment with a length nor a link that carries one has the name.
    """
    chosen = _segments(robot)
    own = tuple(column for column, segment in enumerate(chosen) if segment.name == name)
    carried = tuple(column for column, segment in enumerate(chosen) if segment.parent_link == name)
    if not (own or carried):
        known = tuple(dict.fromkeys(n for segment in chosen for n in (segment.name, segment.parent_link)))
        raise RobotError(
            f"{name!r} is no segment with a length, nor a link that carries one, of robot {robot.name!r}; "
            f"these are {', '.join(known)}",
            name=name,
            candidates=known,
        )
    return own or carried


def _segments(robot: Robot) -> list[Segment]:
    return [robot.segments[s] for s in growing(robot)]
