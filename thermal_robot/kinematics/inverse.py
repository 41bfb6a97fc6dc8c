"""Inverse kinematics of a chain, displaced or not, by damped least squares within the joints' limits.

Two steps, both on the exact kinematics. First Levenberg-Marquardt on the point and the direction of the tool at once,

    min_q |p* − p(q)|² + a² |log(R* Rᵀ(q))|²,    a the arm that weighs an angle against a length,

within a box of joint positions by projection: joints at a bound that would leave it are held, and the others do their
work. Then Newton steps of least length on the point alone, Δq = J_p⁺ (p* − p): where not all six coordinates can be had
(fewer than six joints, a singular pose, a limit) the point has priority, and the direction is the nearest that the
first step found. An arm with more than six joints stays near where it starts, as each step is the shortest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.frames import Displacement, as_rows, chain_frames, frame_jacobians
from thermal_robot.kinematics.lanes import ChainFrames
from thermal_robot.kinematics.lie import log3

if TYPE_CHECKING:
    from thermal_robot.robot import Robot


ARM = 0.05
"""m; lever arm that weighs an error of orientation against one of position: short, as the point has priority."""
STEPS = 60
"""Largest number of Levenberg-Marquardt steps; from a good start four are enough, from anywhere thirty."""
POINT_STEPS = 12
"""Largest number of Newton steps on the point; each squares the error."""
EXACT = 1e-12
"""m; position error below which a point counts as reached: a hundred times the rounding of an arm of a metre."""
STARTS = 24
"""Random starts of the search for a pose in addition to the given one: an arm of six joints has up to eight postures
(sixteen with general axes), and from a random place a third of the searches ends at a limit."""
_SAME = 1e-6
"""rad; difference of orientation errors below which two postures reach a pose equally well."""
_DAMPING = 1e-6
"""m²; Levenberg-Marquardt damping of the first step, divided or multiplied by ten as steps succeed or fail."""
_LEAST_DAMPING = 1e-15
"""m²; floor of the damping, below which rounding decides."""
_GAIN = 1e-9
"""Smallest relative decrease of the cost by a step; with less, a row counts as converged."""
_SMALLEST = 1e-6
"""Cutoff of the pseudo-inverse, of J_p's largest singular value: directions that hardly move the point are not used."""


class Reached(NamedTuple):
    """Result of inverse kinematics.

    Attributes
    ----------
    q
        (N, n) rad or m.
    position
        (N, 3) m, root frame: error of the point, wanted − reached.
    direction
        (N, 3) rad, rotation vectors in the root frame: error of the orientation, wanted − reached.
    """

    q: Array
    position: Array
    direction: Array

    @property
    def miss(self) -> Array:
        """Position error (N,), m."""
        return np.asarray(np.linalg.norm(self.position, axis=1))

    @property
    def turned(self) -> Array:
        """Angle error (N,), rad."""
        return np.asarray(np.linalg.norm(self.direction, axis=1))


def inverse_kinematics(
    robot: Robot,
    poses: ArrayLike,
    start: ArrayLike,
    *,
    tool: ArrayLike | None = None,
    displaced: Callable[[Array], Displacement | None] | None = None,
    within: tuple[ArrayLike, ArrayLike] | None = None,
) -> Reached:
    """Inverse kinematics by damped least squares: joint positions for tool poses, as near as possible to a start.

    Parameters
    ----------
    robot
        The robot.
    poses
        (N, 4, 4) wanted, root frame, m.
    start
        (N, n) rad or m from which each row begins; a good one makes it quick.
    tool
        (4, 4) pose, in the tool frame, of what is brought there; the tool frame itself by default.
    displaced
        What displaces the chain at (N, n) joint positions, as of a robot whose joints yield; nothing by default.
    within
        Lowest and highest joint positions, (n,) or (N, n), rad or m; the robot's limits by default. A start outside is
        brought inside.

    Returns
    -------
    Reached
        Nearest solution of each row; the caller decides whether its error is acceptable.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    q = as_rows(robot, start)
    wanted = np.asarray(poses, dtype=float)
    if wanted.shape != (len(q), 4, 4):
        raise RobotError(f"poses of shape {wanted.shape} do not fit: expected {(len(q), 4, 4)}", name=robot.name)
    low, high = (np.broadcast_to(np.asarray(end, dtype=float), q.shape) for end in within or (robot.lower, robot.upper))
    chain = _Driven(robot, wanted, np.eye(4) if tool is None else np.asarray(tool, dtype=float), displaced, low, high)
    q = _to_the_pose(chain, np.clip(q, low, high))
    q = _to_the_point(chain, q)
    error = chain.error(chain.frames(q))
    return Reached(q, error[:, :3], error[:, 3:])


def nearest_postures(
    robot: Robot, poses: ArrayLike, *, tool: ArrayLike | None = None, near: ArrayLike | None = None
) -> Reached:
    """Multi-start inverse kinematics: of the postures that reach each pose best, the one nearest to ``near``.

    Parameters
    ----------
    robot, poses, tool
        As for :func:`inverse_kinematics`.
    near
        (n,) or (N, n) rad or m near which the posture shall be; the middle of the limits by default.

    Returns
    -------
    Reached
        Each row is searched from ``near`` and from :data:`STARTS` other places within the limits. Of those that reach
        the pose as well as the best, the nearest; where none does, the one with the smallest miss. A nearer one may
        exist.

    Raises
    ------
    RobotError
        If an array has not the shape that the robot asks for.
    """
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    rows = len(np.asarray(poses, dtype=float))
    first = np.broadcast_to((low + high) / 2.0 if near is None else as_rows(robot, near), (rows, robot.n))
    drawn = np.random.default_rng(0).uniform(low, high, (STARTS, robot.n))
    best = inverse_kinematics(robot, poses, first, tool=tool)
    for start in drawn:
        found = inverse_kinematics(robot, poses, np.broadcast_to(start, first.shape), tool=tool)
        best = _better(best, found, first)
    return best


def _better(one: Reached, other: Reached, near: Array) -> Reached:
    """Row by row the solution with the smaller error, or at equal errors the nearer one."""
    cost = [np.maximum(each.miss, EXACT) + ARM * np.maximum(each.turned, _SAME) for each in (one, other)]
    far = [np.linalg.norm(each.q - near, axis=1) for each in (one, other)]
    alike = np.abs(cost[1] - cost[0]) <= ARM * _SAME
    taken = np.where(alike, far[1] < far[0], cost[1] < cost[0])[:, None]
    return Reached(*(np.where(taken, b, a) for a, b in zip(one, other, strict=True)))


@dataclass(frozen=True, eq=False)
class _Driven:
    """Inverse kinematics problem: a chain, its targets, and its limits."""

    robot: Robot
    wanted: Array
    tool: Array
    displaced: Callable[[Array], Displacement | None] | None
    low: Array
    high: Array

    def frames(self, q: Array) -> ChainFrames:
        return chain_frames(self.robot, q, None if self.displaced is None else self.displaced(q))

    def error(self, frames: ChainFrames) -> Array:
        """Pose error (N, 6), wanted − reached: m, and a rotation vector in rad; root frame."""
        place = frames.tool_position + frames.tool_rotation @ self.tool[:3, 3]
        rotation = frames.tool_rotation @ self.tool[:3, :3]
        turn = log3(self.wanted[:, :3, :3] @ rotation.transpose(0, 2, 1))
        return np.concatenate([self.wanted[:, :3, 3] - place, turn], axis=1)

    def jacobian(self, frames: ChainFrames) -> Array:
        """Jacobian (N, 6, n) of the displaced chain, without the derivative of the displacement."""
        return frame_jacobians(self.robot, np.empty(0), frames=frames, point=self.tool[:3, 3])

    def free(self, q: Array, downhill: Array) -> NDArray[np.bool_]:
        """Mask (N, n) of the joints that can follow the descent direction without leaving their limits."""
        return ~(((q <= self.low) & (downhill < 0.0)) | ((q >= self.high) & (downhill > 0.0)))


def _to_the_pose(chain: _Driven, q: Array) -> Array:
    """Levenberg-Marquardt with box constraints, all rows at once, each with its own damping."""
    weights = np.array([1.0, 1.0, 1.0, ARM, ARM, ARM])
    damping, going = np.full(len(q), _DAMPING), np.ones(len(q), dtype=bool)
    frames = chain.frames(q)
    error = weights * chain.error(frames)
    cost = (error**2).sum(axis=1)
    for _ in range(STEPS):
        going &= cost > EXACT**2
        if not going.any():
            break
        jacobian = weights[:, None] * chain.jacobian(frames)
        downhill = np.einsum("nri,nr->ni", jacobian, error)
        jacobian *= chain.free(q, downhill)[:, None, :]
        downhill = np.einsum("nri,nr->ni", jacobian, error)
        normal = np.einsum("nri,nrj->nij", jacobian, jacobian) + damping[:, None, None] * np.eye(q.shape[1])
        step = np.linalg.solve(normal, downhill[..., None])[..., 0]
        tried = np.where(going[:, None], np.clip(q + step, chain.low, chain.high), q)
        frames = chain.frames(tried)
        error_there = weights * chain.error(frames)
        cost_there = (error_there**2).sum(axis=1)
        better = going & (cost_there < cost)
        going &= ~(better & (cost - cost_there < _GAIN * cost)) & (damping < 1.0)
        damping = np.where(better, np.maximum(damping / 10.0, _LEAST_DAMPING), damping * 10.0)
        q, error = np.where(better[:, None], tried, q), np.where(better[:, None], error_there, error)
        cost = np.where(better, cost_there, cost)
        if not better.all():
            frames = chain.frames(q)
    return q


def _to_the_point(chain: _Driven, q: Array) -> Array:
    """Minimum-norm Newton steps on the position; joints at their limits are held."""
    nearest, miss = q, np.full(len(q), np.inf)
    for _ in range(POINT_STEPS):
        frames = chain.frames(q)
        error = chain.error(frames)[:, :3]
        distance = np.linalg.norm(error, axis=1)
        better = distance < miss
        nearest, miss = np.where(better[:, None], q, nearest), np.minimum(distance, miss)
        if not (miss > EXACT).any():
            break
        jacobian = chain.jacobian(frames)[:, :3]
        jacobian = jacobian * chain.free(q, np.einsum("nri,nr->ni", jacobian, error))[:, None, :]
        step = np.linalg.pinv(jacobian, rcond=_SMALLEST) @ error[..., None]
        q = np.where((miss > EXACT)[:, None], np.clip(q + step[..., 0], chain.low, chain.high), nearest)
    return nearest
