"""How far elongations move the tool (Eqs 6–11), and how far a kelvin does."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.assembly.thermal.elongation import PerSegment, lengths, per_segment
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import Displacement, elongation_jacobian, growing, tool_poses
from thermal_robot.robot import Robot

Array = NDArray[np.float64]


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
