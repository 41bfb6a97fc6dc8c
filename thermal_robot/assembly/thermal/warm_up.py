"""Links that lag behind the hall: temperatures, and so displacements, before and after stabilisation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.assembly.thermal.elongation import (
    STANDARD_TEMPERATURE,
    PerSegment,
    displacement,
    elongation,
    per_segment,
)
from thermal_robot.errors import RobotError
from thermal_robot.robot import Robot


@dataclass(frozen=True, eq=False)
class LinkWarmUp:
    """Temperatures of the S segments of a robot at T instants; made by :func:`warm_up`.

    Parameters
    ----------
    robot
        The robot.
    times
        (T,) s.
    ambient
        (T, S) °C around each segment.
    temperatures
        (T, S) °C of each segment.
    """

    robot: Robot
    times: Array
    ambient: Array
    temperatures: Array

    def elongations(self, *, coefficients: PerSegment, reference: float = STANDARD_TEMPERATURE) -> Array:
        """Elongations (T, S) m, Eq 5; arguments as for :func:`~thermal_robot.assembly.thermal.elongation`."""
        return elongation(self.robot, self.temperatures, coefficients=coefficients, reference=reference)

    def displacements(
        self, q: ArrayLike, *, coefficients: PerSegment, reference: float = STANDARD_TEMPERATURE
    ) -> Array:
        """Displacements (T, 3) m of the tool point that stands at ``q``, (n,), or at (T, n) as time goes by."""
        grown = self.elongations(coefficients=coefficients, reference=reference)
        return displacement(self.robot, q, grown)


def warm_up(
    robot: Robot,
    times: ArrayLike,
    ambient: PerSegment,
    *,
    time_constants: PerSegment,
    initial: PerSegment | None = None,
) -> LinkWarmUp:
    """Let every link follow the temperature around it with a lag of first order: τ_i dT_i/dt = T_ambient − T_i.

    Parameters
    ----------
    robot
        The robot.
    times
        (T,) s, not decreasing. Two equal times are a step of the ambient temperature.
    ambient
        °C at ``times``, linear in between, for which the solution is exact: a number, (T,), (T, S), or a mapping from
        names of segments or links to numbers or (T,), where a link has surroundings of its own, such as a motor.
    time_constants
        τ_i > 0, s: a number, (S,), or a mapping from names to numbers.
    initial
        °C of the segments at the first instant, in the forms of the time constants; ambient by default.

    Returns
    -------
    LinkWarmUp
        Temperatures of the segments at ``times``, and from them elongations and displacements.

    Raises
    ------
    RobotError
        If times decrease, a time constant is not positive and finite, a name is unknown, or a shape does not fit.
    """
    instants = np.asarray(times, dtype=float)
    if instants.ndim != 1 or not len(instants) or not np.all(np.diff(instants) >= 0.0):
        raise RobotError("the times of a warm-up are at least one number of seconds and do not decrease")
    around = _over_time(robot, ambient, len(instants))
    lag = per_segment(robot, time_constants, "time constant")
    if lag.ndim != 1 or not np.all((lag > 0.0) & np.isfinite(lag)):
        raise RobotError("every segment needs one positive time constant, s")
    start = around[0] if initial is None else per_segment(robot, initial, "initial temperature")
    temperatures = np.empty_like(around)
    temperatures[0] = start
    for i, step in enumerate(np.diff(instants)):
        now, begins, ends = temperatures[i], around[i], around[i + 1]
        elapsed = step / lag
        caught_up = -np.expm1(-elapsed)
        # A ramp is followed at a distance of slope · τ, reached as the exponential dies; a step has no duration.
        slope = (ends - begins) / step if step > 0.0 else np.zeros_like(begins)
        temperatures[i + 1] = now + (begins - now) * caught_up + slope * lag * (elapsed - caught_up)
    return LinkWarmUp(robot, instants, around, temperatures)


def _over_time(robot: Robot, ambient: PerSegment, rows: int) -> Array:
    array = None if isinstance(ambient, Mapping) else np.asarray(ambient, dtype=float)
    # A row of T numbers is the hall's temperature over time, whatever the number of segments.
    if array is not None and array.ndim == 1:
        if len(array) != rows:
            raise RobotError(f"{len(array)} ambient temperatures do not fit {rows} times")
        ambient = array[:, None] * np.ones(len(per_segment(robot, 0.0, "")))
    values = per_segment(robot, ambient, "ambient temperature")
    if values.ndim > 2 or (values.ndim == 2 and len(values) != rows):
        raise RobotError(f"ambient temperatures of shape {values.shape} do not fit {rows} times")
    return np.broadcast_to(values, (rows, values.shape[-1])).copy()
