"""What a temperature adds to the lengths of a robot (Eq 5), and the coefficients of expansion behind an elongation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import Displacement, elongation_jacobian, growing, tool_poses
from thermal_robot.robot import Robot, Segment


def displacement(robot: Robot, q: ArrayLike, elongations: PerSegment, *, exact: bool = False) -> Array:
    """Displacement of the tool point by elongations of the segments, Eqs 6–8 (9–11 for the RV-M2).

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.
    elongations
        m: (S,) or one number for all configurations, (N, S), or a mapping from names to numbers or (N,); (T, S) with
        one configuration gives T displacements.
    exact
        Move the tool with the elongated chain, not by the derivative. An elongation turns nothing, so both agree to
        rounding; the linear one is faster and keeps its digits however small the elongations are.

    Returns
    -------
    ndarray
        (N, 3) or (T, 3) m in the root frame; the tool is not turned.

    Raises
    ------
    RobotError
        If a name is unknown, a segment gets no value, or a shape does not fit.
    """
    grown = per_segment(robot, elongations, "elongation")
    jacobian = elongation_jacobian(robot, q)
    if grown.ndim > 2 or (grown.ndim == 2 and 1 not in (len(jacobian), len(grown)) and len(jacobian) != len(grown)):
        raise RobotError(f"elongations of shape {grown.shape} do not fit {len(jacobian)} configurations")
    if not exact:
        linear: Array = (jacobian @ grown[..., None])[..., 0]
        return linear
    rows = np.broadcast_to(np.atleast_2d(grown), (max(len(jacobian), len(np.atleast_2d(grown))), jacobian.shape[2]))
    joints = np.broadcast_to(np.atleast_2d(np.asarray(q, dtype=float)), (len(rows), robot.n))
    twists = np.zeros((len(rows), len(robot.segments), 6))
    for column, s in enumerate(growing(robot)):
        twists[:, s, :3] = rows[:, column, None] * robot.segments[s].direction
    after, before = tool_poses(robot, joints, Displacement(segment=twists)), tool_poses(robot, joints)
    moved: Array = after[:, :3, 3] - before[:, :3, 3]
    return moved


def sensitivity(robot: Robot, q: ArrayLike, *, coefficients: PerSegment) -> Array:
    """Displacement of the tool for a kelvin in each segment alone: the matrix of Eq 14 times χ_i l_i.

    The sum over the segments is the displacement for a kelvin in the whole robot; its norm, drawn over the workspace,
    is the map of where a part is joined with the least sensitivity to temperature.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.
    coefficients
        1/K, as for :func:`~thermal_robot.assembly.thermal.elongation`.

    Returns
    -------
    ndarray
        (N, 3, S) m/K in the root frame.

    Raises
    ------
    RobotError
        If a name is unknown, a segment gets no value, or a shape does not fit.
    """
    strain = per_segment(robot, coefficients, "coefficient of expansion")
    per_kelvin: Array = elongation_jacobian(robot, q) * (strain * lengths(robot))[..., None, :]
    return per_kelvin


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
