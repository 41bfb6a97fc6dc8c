"""Columns of a workspace map: inverse kinematics for all postures of an arm at many places, and their quality.

Postures (branches of the inverse kinematics) are searched by multi-start at a few places, and continued from there to
neighbouring places. Where the task leaves a direction free (a turn about the tool, a seventh joint), the configuration
nearest to home is taken within the branch, by damped least squares with a null-space step, J being the task Jacobian:

    Δq = J⁺ e + (1 − J⁺J) λ (q_home − q),    J⁺ = Jᵀ (J Jᵀ + μ)⁻¹,  μ half the square of the task error e.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.assembly.thermal import elongation
from thermal_robot.assembly.workspace import assembly_map, converged
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import elongation_jacobian
from thermal_robot.maps.question import Joints, Spec, within
from thermal_robot.robot import Robot

Rows = NDArray[np.intp]

SEEDS = 12
"""Places of a chunk whose postures are searched from everywhere at a time; all others continue from neighbours."""
STARTS = 64
"""Configurations from which a posture is searched at a seed: one of eight postures that attracts a twentieth of all
starts is missed once in 27."""
IDLE = 3
"""Times in a row that seeds, taken where fewest postures are known, bring nothing new before the search ends: what one
in twenty places has is then overlooked in one map of six."""
MOST = 32
"""Postures that are kept of a place: sixteen is the most of six joints in general; redundant arms may have more."""
NEIGHBOURS = 9
"""From which a place is continued: those beside it in a plane, corners too."""
ALIKE = 1e-4
"""rad or m; two configurations of a place that differ by less are one."""
MOST_LINKS = 12
"""Segments whose 2^11 corners are compared for the width of a polygon."""


class Task:
    """Inverse kinematics task: bring the tip (3,), m, to a place, the tool ``axis`` along ``approach`` (root frame).

    Directions that the task leaves free move towards the configuration ``home``, (n,) rad or m.
    """

    def __init__(self, robot: Robot, approach: Array, axis: Array, tip: Array, home: Array) -> None:
        self.robot, self.approach, self.axis, self.tip, self.home = robot, approach, axis, tip, home
        self.turns = np.array([kind != "prismatic" for kind in robot.joint_types])
        with np.errstate(invalid="ignore"):
            self.whole = self.turns & (robot.upper - robot.lower > 2.0 * np.pi - 1e-9)

    def nearest_turn(self, q: Array) -> Array:
        """Shift fully turning joints of q (N, n) by whole turns to within half a turn of home, where limits allow."""
        turns = np.where(self.whole, np.round((q - self.home) / (2.0 * np.pi)), 0.0)
        turned = q - 2.0 * np.pi * turns
        return np.where((turned >= self.robot.lower) & (turned <= self.robot.upper), turned, q)

    def way(self, start: Array, q: Array) -> Array:
        """Joint displacements (N, n) from ``start`` to ``q``, reduced to half a turn for joints that can turn fully."""
        gone = q - start
        return np.where(self.whole, gone - 2.0 * np.pi * np.round(gone / (2.0 * np.pi)), gone)

    def solve(self, targets: Array, start: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Solve the inverse kinematics for targets (N, 3), m, by damped least squares from (N, n) configurations.

        Returns configurations (N, n) and a mask (N,) of those that converged and are within the joint limits.
        """
        robot = self.robot
        q, found = converged(robot, targets, start, self.approach, self.axis, self.tip, self.home)
        q = self.nearest_turn(q)
        return q, found & np.all((q >= robot.lower) & (q <= robot.upper), axis=1)


class _Known:
    """Store of the distinct postures found so far at each of M places, 32 at most for each."""

    def __init__(self, task: Task, places: int) -> None:
        self.task, self.q = task, np.full((places, MOST, task.robot.n), np.nan)
        self.count = np.zeros(places, dtype=np.intp)

    def fresh(self, places: Rows, q: Array) -> NDArray[np.bool_]:
        """Add configurations (K, n) of places (K,) that differ from those stored by 1e-4 rad or m; return a mask."""
        new = np.zeros(len(places), dtype=bool)
        left = np.arange(len(places))
        while len(left):
            # the first of each place at a time, so that two that are alike are compared with each other
            _, first = np.unique(places[left], return_index=True)
            rows = left[first]
            apart = np.abs(self.task.way(self.q[places[rows]], q[rows, None])).max(axis=2)
            unknown = ~(apart < ALIKE).any(axis=1) & (self.count[places[rows]] < MOST)
            rows = rows[unknown]
            self.q[places[rows], self.count[places[rows]]] = q[rows]
            self.count[places[rows]] += 1
            new[rows] = True
            left = np.delete(left, first)
        return new


def all_postures(task: Task, targets: Array) -> tuple[Rows, Array]:
    """Find all inverse kinematics solutions (postures) at M places (M, 3), m, by multi-start and continuation.

    Returns place numbers (K,), ascending, and configurations (K, n), nearest to home first. Neighbouring places should
    be at most about 0.2 m apart.
    """
    from scipy.spatial import cKDTree

    near = cKDTree(targets).query(targets, k=min(NEIGHBOURS, len(targets)))[1].reshape(len(targets), -1)
    known = _Known(task, len(targets))
    starts, random, idle = _everywhere(task), np.random.default_rng(0), 0

    def searched(places: Rows, start: Array) -> tuple[Rows, Array]:
        """Solve at numbered places from start configurations; return places and configurations of new postures only."""
        q, found = task.solve(targets[places], start)
        new = found.copy()
        new[found] = known.fresh(places[found], q[found])
        return places[new], q[new]

    while idle < IDLE:
        seeds = _wanting(known.count, random)
        places, q = searched(np.repeat(seeds, len(starts)), np.tile(starts, (len(seeds), 1)))
        every, all_q = [places], [q]
        while len(places):
            places, q = searched(*_flipped(task, places, q))
            every, all_q = [*every, places], [*all_q, q]
        places, q = np.concatenate(every), np.concatenate(all_q)
        idle = 0 if len(places) else idle + 1
        while len(places):
            before = np.repeat(q, near.shape[1], axis=0)
            places, q = searched(near[places].ravel(), before)
        if known.count.min() == MOST:
            break
    places = np.repeat(np.arange(len(targets)), known.count)
    q = known.q[np.arange(MOST) < known.count[:, None]]
    order = np.lexsort((np.linalg.norm(q - task.home, axis=1), places))
    return places[order], q[order]


def _everywhere(task: Task) -> Array:
    """Start configurations (S, n): home, then a Sobol sequence within limits, at most half a turn from home."""
    from scipy.stats import qmc

    robot = task.robot
    low = np.where(task.whole, task.home - np.pi, robot.lower)
    high = np.where(task.whole, task.home + np.pi, robot.upper)
    drawn = qmc.Sobol(robot.n, scramble=False).random(STARTS)
    return np.vstack([task.home, low + drawn * (high - low)])


def _wanting(count: NDArray[np.intp], random: np.random.Generator) -> Rows:
    """Draw the places to search next: up to 6 without any posture, and 6 with fewer postures than the most so far."""
    some = (count > 0) & (count < count.max())
    halves = (np.flatnonzero(chosen) for chosen in (count == 0, some if some.any() else count > 0))
    return np.concatenate([random.permutation(half)[: SEEDS // 2] for half in halves])


def _flipped(task: Task, places: Rows, q: Array) -> tuple[Rows, Array]:
    """Start configurations, from known ones q (K, n), for the search of other postures at the same places.

    One joint is mirrored about home or turned by half a turn; or one inner joint changes its sign (elbow flip) and both
    neighbours compensate as for two equal links. All are clipped to the joint limits.
    """
    n, elbows = task.robot.n, np.arange(1, task.robot.n - 1)
    starts = np.repeat(q[:, None], 2 * n + 2 * len(elbows), axis=1)
    every = np.arange(n)
    starts[:, every, every] = 2.0 * task.home - q
    starts[:, n + every, every] = q + np.where(task.turns, np.pi, 0.0) * np.where(q > task.home, -1.0, 1.0)
    for k, sign in enumerate((1.0, -1.0)):
        rows = 2 * n + k * len(elbows) + np.arange(len(elbows))
        starts[:, rows, elbows] = -q[:, elbows]
        starts[:, rows, elbows - 1] += sign * q[:, elbows]
        starts[:, rows, elbows + 1] += sign * q[:, elbows]
    starts = np.clip(starts, task.robot.lower, task.robot.upper)
    return np.repeat(places, starts.shape[1]), starts.reshape(-1, n)


Columns = dict[str, NDArray[Any]]

UNITS = {
    **{"place": "", "branch": ""},
    **{f"{kind}{axis}": "m" for kind in ("", "std.", "shift.") for axis in "xyz"},
    **{"polygon.area": "m²", "polygon.width": "m"},
    **dict.fromkeys(("probability", "probability_warm", "capability", "capability_warm"), "1"),
    **{"required": "m", "required_warm": "m", "margin": "1"},
}
"""Columns beside the joints', and their units."""


def columns(spec: Spec, rows: NDArray[np.int64]) -> Columns:
    """Compute all columns of a chunk of a map: for all postures at numbered places, or for numbered configurations."""
    robot, asked = spec.robot, spec.question
    if isinstance(spec.over, Joints):
        q = spec.over.drawn(rows, robot)
        places, branch = rows, np.zeros(len(rows), dtype=np.int64)
    else:
        home = np.mean(within(robot), axis=0) if spec.over.home is None else np.asarray(spec.over.home, dtype=float)
        approach, axis = (np.asarray(v, dtype=float) / np.linalg.norm(v) for v in (asked.approach, asked.axis))
        task = Task(robot, approach, axis, np.asarray(asked.point, dtype=float), home)
        here, q = all_postures(task, spec.over.place(rows))
        places = rows[here]
        branch = np.arange(len(here)) - np.searchsorted(here, here)
    told = _assembly_columns(spec, q) if len(q) else dict.fromkeys(list(UNITS)[2:-1], np.zeros(0))
    joints = {name: q[:, k] for k, name in enumerate(robot.joint_names)}
    inside = np.minimum(q - robot.lower, robot.upper - q)
    with np.errstate(invalid="ignore"):
        share = np.where(np.isfinite(inside), inside / (robot.upper - robot.lower), 0.5)
    told["margin"] = share.min(axis=1) if len(q) else np.zeros(0)
    return {"place": places, "branch": branch, **joints, **told}


def _assembly_columns(spec: Spec, q: Array) -> Columns:
    from thermal_robot.assembly.probability import capability, failing_probability, planes

    robot, asked = spec.robot, spec.question
    found = assembly_map(robot, q, **{name: value for name, value in vars(asked).items() if name != "approach"})
    plane = planes(found.directions)
    scatter = plane @ found.covariance @ np.swapaxes(plane, 1, 2)
    across = np.einsum("nij,nj->ni", plane, found.displacement)
    heated: dict[str, Any] = {"mean": across} if asked.law == "shift" else {"segments": across}
    grown = elongation(robot, asked.rise, coefficients=asked.coefficients, reference=0.0)
    area, width = polygon(plane @ (elongation_jacobian(robot, q) * grown))
    std = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    return {
        **dict(zip("xyz", found.positions.T, strict=True)),
        **{f"std.{axis}": std[:, k] for k, axis in enumerate("xyz")},
        **{f"shift.{axis}": found.displacement[:, k] for k, axis in enumerate("xyz")},
        "polygon.area": area,
        "polygon.width": width,
        "probability": found.probability,
        "probability_warm": found.probability_warm,
        "capability": capability(failing=failing_probability(scatter, asked.clearance)),
        "capability_warm": capability(failing=failing_probability(scatter, asked.clearance, **heated)),
        "required": found.required,
        "required_warm": found.required_warm,
    }


def polygon(edges: Array) -> tuple[Array, Array]:
    """Area (N,), m², and diameter (N,), m, of the zonogons that the tip can reach, each segment being cold to warm.

    The edges ``g`` (N, 2, S), m, are the tip's displacements across the tool by the whole rise of each of S segments
    (Eqs 14-15). The area is ``sum |g_i x g_j|`` over all pairs; the width, the largest distance of two corners, is the
    longest ``sum ± g_i``. More than 12 segments raise a :class:`RobotError`.
    """
    links = edges.shape[2]
    if links > MOST_LINKS:
        raise RobotError(f"the polygon of {links} segments has too many corners; {MOST_LINKS} are compared")
    first, second = np.triu_indices(links, 1)
    crossed = edges[:, 0, first] * edges[:, 1, second] - edges[:, 1, first] * edges[:, 0, second]
    # a corner and the one opposite are as far apart as one with its signs and one with all others: half of them do
    signs = np.array(list(product((-1.0, 1.0), repeat=links)))[: max(2**links // 2, 1)]
    corners = edges @ signs.T
    return np.abs(crossed).sum(axis=1), np.sqrt((corners**2).sum(axis=1).max(axis=1))
