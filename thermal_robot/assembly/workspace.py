"""Workspace map of joining: poses that hold a peg at each place, and the clearance required there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.assembly.repeatability import tool_covariance
from thermal_robot.assembly.thermal import PerSegment, displacement, elongation
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import chain_frames, frame_jacobians
from thermal_robot.robot import Robot

_CLOSE = 1e-11  # m and rad: a pose is reached
_SETTLED = 1e-7  # rad or m; the way home that is left where the free directions have settled
_STEPS = 60
_PULL = 0.5  # share of the way home that a step takes in directions that the task leaves free
_LONGEST_STEP = 0.4  # rad or m, so that a branch of the inverse kinematics is not left
_DAMPING = 1e-12  # m², rad²; beside the square of what is missing: keeps what nothing asks for out of the step
_NEIGHBOURS = 9
_SAME_BRANCH = (0.25, 0.5, 1.0)
# rad or m that a joint may move between neighbours: small first, so that a way leads round a singularity if it can.


@dataclass(frozen=True, eq=False)
class AssemblyMap:
    """Probability of joining and required clearance at M places, by :func:`assembly_map`; NaN for a pose that is NaN.

    Parameters
    ----------
    positions, directions
        (M, 3) m in the root frame: the peg's tip; and the unit vectors along the peg.
    covariance
        (M, 3, 3) m²: scatter of the tip, in root axes.
    displacement
        (M, 3) m: how far the whole rise moves the tip away from the hole, in root axes.
    clearance, capability
        Diameter, m, that ``probability`` is meant for, and the C_p that ``required`` is meant for.
    probability, probability_warm
        (M,) probability of joining without the rise and with it.
    required, required_warm
        (M,) m: clearance at which the joint has the capability, without the rise and with it.
    """

    positions: Array
    directions: Array
    covariance: Array
    displacement: Array
    clearance: float
    capability: float
    probability: Array
    probability_warm: Array
    required: Array
    required_warm: Array

    @property
    def cost(self) -> Array:
        """Additional clearance (M,), m, required by the rise of temperature."""
        return self.required_warm - self.required

    @property
    def best(self) -> int:
        """Row of the place with the smallest warm clearance."""
        return int(np.nanargmin(self.required_warm))

    @property
    def worst(self) -> int:
        """Row of the place with the largest warm clearance."""
        return int(np.nanargmax(self.required_warm))


def grid(xs: ArrayLike, ys: ArrayLike, zs: ArrayLike) -> Array:
    """Regular grid of points (M, 3), m, x varying fastest, z slowest; a plane if one coordinate is a single number."""
    heights, ahead, across = np.meshgrid(*(np.atleast_1d(np.asarray(v, float)) for v in (zs, ys, xs)), indexing="ij")
    return np.stack([across, ahead, heights], axis=-1).reshape(-1, 3)


def reach(
    robot: Robot,
    positions: ArrayLike,
    seed_q: ArrayLike,
    *,
    approach: ArrayLike = (0.0, 0.0, -1.0),
    axis: ArrayLike = (0.0, 0.0, 1.0),
    point: ArrayLike = (0.0, 0.0, 0.0),
) -> Array:
    """Inverse kinematics of a peg along ``approach`` with its tip at each place; rotation about the peg is free.

    The place nearest to the seed is solved first, and every other from a neighbour that is solved, so that the whole
    map keeps the seed's branch (elbow up, say). A place counts as not reached too if that branch does not lead there
    through the places given: these should lie no farther than about 0.2 m apart.

    Parameters
    ----------
    robot
        The robot.
    positions
        (M, 3) m in the root frame.
    seed_q
        (n,) rad or m: a configuration of the branch that is meant, roughly in the pose that is asked for.
    approach
        (3,) direction in which the peg enters the hole, in the root frame; of any length.
    axis
        (3,) direction of the peg, in the tool frame.
    point
        (3,) m: the peg's tip, in the tool frame.

    Returns
    -------
    ndarray
        (M, n) rad or m: configurations within the joint limits, to 1e-11 m and rad; NaN where a place is not reached.

    Raises
    ------
    RobotError
        If a shape does not fit or a direction is zero.
    """
    from scipy.spatial import cKDTree

    targets, start = np.asarray(positions, dtype=float), np.asarray(seed_q, dtype=float)
    if targets.ndim != 2 or targets.shape[1] != 3 or not len(targets) or start.shape != (robot.n,):
        shapes = f"{targets.shape} and {start.shape} do not fit: expected (M, 3) and ({robot.n},)"
        raise RobotError(f"positions and a seed of shapes {shapes}", name=robot.name)
    along, held = _vector(approach, "approach", unit=True), _vector(axis, "axis", unit=True)
    tip = _vector(point, "point")
    here = chain_frames(robot, start)
    distance = np.linalg.norm(targets - here.tool_position[0] - here.tool_rotation[0] @ tip, axis=1)
    near = cKDTree(targets).query(targets, k=min(_NEIGHBOURS, len(targets)))[1].reshape(len(targets), -1)
    q, places = np.full((len(targets), robot.n), np.nan), np.argsort(distance)

    def solved(places: NDArray[np.int64], from_q: Array) -> tuple[Array, NDArray[np.bool_]]:
        found, done = converged(robot, targets[places], from_q, along, held, tip)
        return found, done & np.all((found >= robot.lower) & (found <= robot.upper), axis=1)

    found, done = solved(places, np.tile(start, (len(places), 1)))
    q[places[done][:1]] = found[done][:1]
    for limit in _SAME_BRANCH:
        newest = np.flatnonzero(~np.isnan(q[:, 0]))
        while len(newest):
            fresh = np.isin(near, newest)
            places = np.flatnonzero(np.isnan(q[:, 0]) & np.any(fresh, axis=1))
            from_q = q[near[places, np.argmax(fresh[places], axis=1)]]
            found, done = solved(places, from_q)
            done &= np.max(np.abs(found - from_q), axis=1) < limit
            newest = places[done]
            q[newest] = found[done]
    return q


def assembly_map(
    robot: Robot,
    q: ArrayLike,
    sigma_q: ArrayLike | Mapping[str, float],
    *,
    coefficients: PerSegment,
    rise: PerSegment,
    clearance: float,
    capability: float = 1.33,
    law: Literal["shift", "uniform"] = "shift",
    carrier_strain: float = 0.0,
    axis: ArrayLike = (0.0, 0.0, 1.0),
    point: ArrayLike = (0.0, 0.0, 0.0),
) -> AssemblyMap:
    """Probability of joining a round peg, and required clearance, at each pose before and after warming.

    Only errors across the peg count.

    Parameters
    ----------
    robot
        The robot.
    q
        (M, n) rad or m, such as :func:`reach` finds; rows that are NaN stay NaN.
    sigma_q
        Standard deviation of each joint, as for :func:`~thermal_robot.assembly.repeatability.tool_covariance`.
    coefficients, rise
        1/K and K: of each segment, in the forms of :func:`~thermal_robot.assembly.thermal.elongation`.
    clearance
        Diameter, m, for the map of the probability.
    capability
        Required C_p, in the convention P = 2Φ(3 C_p) − 1.
    law
        ``"shift"``: the rise has happened and nobody corrects for it; ``"uniform"``: the temperature is anywhere
        within ± ``rise`` with equal probability, all segments together.
    carrier_strain
        Relative growth of what ties the hole to the origin of the root frame, its coefficient times its rise.
    axis, point
        As for :func:`reach`. The peg itself does not grow.

    Raises
    ------
    RobotError
        If a shape does not fit, a name is unknown, ``axis`` is zero or ``law`` is unknown.
    """
    # Imported here: this room brings a part of scipy with it.
    from thermal_robot.assembly.probability import joining_probability, planes, required_clearance

    if law not in ("shift", "uniform"):
        raise RobotError(f"law is 'shift' or 'uniform', not {law!r}", name=robot.name)
    held, tip = _vector(axis, "axis", unit=True), _vector(point, "point")
    frames = chain_frames(robot, q)
    positions, directions = frames.tool_position + frames.tool_rotation @ tip, frames.tool_rotation @ held
    covariance = tool_covariance(robot, q, sigma_q, point=tip)
    grown = elongation(robot, rise, coefficients=coefficients, reference=0.0)
    moved = displacement(robot, q, grown) - carrier_strain * positions
    numbers = np.full((4, len(positions)), np.nan)
    known = np.flatnonzero(np.isfinite(positions[:, 0]))
    if len(known):
        plane = planes(directions[known])
        scatter = plane @ covariance[known] @ np.swapaxes(plane, 1, 2)
        off = np.einsum("nij,nj->ni", plane, moved[known])
        heated = {"mean": off} if law == "shift" else {"segments": off}
        for row, thermal in enumerate(({}, heated)):
            numbers[row, known] = joining_probability(scatter, clearance, **thermal)
            numbers[row + 2, known] = required_clearance(scatter, capability=capability, **thermal)
    return AssemblyMap(positions, directions, covariance, moved, float(clearance), float(capability), *numbers)


def converged(
    robot: Robot, targets: Array, start: Array, approach: Array, axis: Array, tip: Array, home: Array | None = None
) -> tuple[Array, NDArray[np.bool_]]:
    """Inverse kinematics of a peg by Levenberg-Marquardt, all places at once; damping is the squared residual's half.

    Brings the tip (3,), m, from configurations (N, n) to places (N, 3), m, the tool ``axis`` along ``approach``, unit
    vectors; what that leaves free moves towards ``home`` (n,), if given. Returns configurations (N, n), which may be
    beyond limits, and a mask (N,) of those that converged to 1e-11.
    """
    q, found = start.copy(), np.zeros(len(start), dtype=bool)
    for number in range(_STEPS):
        open_ = np.flatnonzero(~found)
        if not len(open_):
            break
        frames = chain_frames(robot, q[open_])
        held = frames.tool_rotation @ axis
        missing = np.empty((len(open_), 6))
        missing[:, :3] = targets[open_] - frames.tool_position - frames.tool_rotation @ tip
        missing[:, 3:] = np.cross(held, approach)  # vanishes at a half turn, too
        jacobian = np.ascontiguousarray(frame_jacobians(robot, q[open_], frames=frames, point=tip))
        jacobian[:, 3:] -= held[:, :, None] * np.einsum("ni,nij->nj", held, jacobian[:, 3:])[:, None]
        damping = 0.5 * np.sum(missing**2, axis=1) + _DAMPING
        square = jacobian @ np.swapaxes(jacobian, 1, 2) + damping[:, None, None] * np.eye(6)
        away = np.zeros((len(open_), robot.n)) if home is None else _PULL * (home - q[open_])
        both = np.stack([missing, np.einsum("nij,nj->ni", jacobian, away)], axis=2)
        task, along = np.moveaxis(np.swapaxes(jacobian, 1, 2) @ np.linalg.solve(square, both), 2, 0)
        free = away - along
        late = number > _STEPS // 2  # what has not settled by then goes on without being drawn
        settled = late | (np.max(np.abs(free), axis=1) < _SETTLED)
        step = task if late else task + free
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(np.max(np.abs(step), axis=1), _LONGEST_STEP))[:, None]
        found[open_] = (np.max(np.abs(missing), axis=1) < _CLOSE) & (held @ approach > 0.0) & settled
        step[found[open_]] = 0.0
        q[open_] += step
    return q, found


def _vector(values: ArrayLike, what: str, *, unit: bool = False) -> Array:
    vector = np.asarray(values, dtype=float)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)) or (unit and not np.any(vector)):
        raise RobotError(f"{what} is three finite numbers{', not all zero' * unit}; got {values!r}")
    return vector / np.linalg.norm(vector) if unit else vector
