"""ISO 9283:1998 criteria from attained poses.

Clauses: AP 7.2.1, RP 7.2.2, vAP 7.2.3, drift 7.6, AT and RT 8.2 and 8.3. The standard cuts the attained paths with
planes across the commanded one. Here a point of the path is a command with what was measured for it in each cycle, so
that a lag of the robot counts in AT.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.kinematics import log3

Three = tuple[float, float, float]
SPREADS = 3.0
"""Standard deviations that the standard adds to the mean distance."""
FEWEST_FOR_INTERVAL = 3
"""Cycles from which an interval is told. Two lie equally far from their barycentre: nothing is known of the spread."""
DRAWS = 1000
"""Times that the test is repeated in simulation: the ends of the interval are then good to 1 % at 30 cycles."""
_LEVEL = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class Attained:
    """Attained poses of one target in n cycles, in one frame: that of the base to meet the standard.

    Attributes
    ----------
    position
        (n, 3) m.
    rotation
        (n, 3, 3), which turn vectors of the target's frame into that frame; ``None`` where only positions are known.
    """

    position: Array
    rotation: Array | None = None

    @property
    def cycles(self) -> int:
        """Number of cycles n."""
        return len(self.position)

    @property
    def barycentre(self) -> Array:
        """(3,) mean position, m."""
        return np.asarray(self.position.mean(axis=0))

    @property
    def mean_rotation(self) -> Array | None:
        """Chordal mean rotation (3, 3); ``None`` where only positions are known."""
        return None if self.rotation is None else mean_rotation(self.rotation)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Attained:
        """Subset of the cycles."""
        return Attained(self.position[rows], None if self.rotation is None else self.rotation[rows])


def mean_rotation(rotations: Array) -> Array:
    """Chordal mean (3, 3) of (n, 3, 3) rotations: the mean matrix projected onto the rotations.

    Moakher, *SIAM J. Matrix Anal. Appl.* 24 (2002).
    """
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def angles(rotations: Array, reference: Array) -> Array:
    """(..., 3) angles a, b, c from a reference to rotations: the rotation vector of R R_refᵀ, rad.

    The standard turns about one axis after the other, which differs by products of the angles: 1 µrad at 1 mrad.
    """
    return log3(rotations @ np.swapaxes(reference, -1, -2))


def three(values: ArrayLike) -> Three:
    """Three numbers as plain values."""
    a, b, c = (float(v) for v in np.asarray(values))
    return a, b, c


@dataclass(frozen=True)
class Accuracy:
    """Pose accuracy AP: from the commanded pose to the barycentre of the attained ones.

    Attributes
    ----------
    position
        AP_p, the distance, m.
    axes
        AP_x, AP_y, AP_z, m.
    angles
        AP_a, AP_b, AP_c, about the same axes, rad; ``None`` where only positions are known.
    """

    position: float
    axes: Three
    angles: Three | None = None


def accuracy(attained: Attained, commanded: Attained) -> Accuracy:
    """Pose accuracy AP of one pose.

    Parameters
    ----------
    attained
        Attained poses of n cycles.
    commanded
        Commanded pose, one row; or n rows, where a model predicts every cycle separately, as one with temperature does.
    """
    away = attained.barycentre - commanded.barycentre
    is_, should = attained.mean_rotation, commanded.mean_rotation
    turned = None if is_ is None or should is None else three(angles(is_, should))
    return Accuracy(float(np.linalg.norm(away)), three(away), turned)


@dataclass(frozen=True)
class Repeatability:
    """Pose repeatability RP: scatter of the attained poses about their barycentre.

    Attributes
    ----------
    position
        RP_l: mean distance and three of its standard deviations, m.
    ci95
        95 % interval of RP_l of endlessly many cycles, m; ``None`` with two cycles, or without scatter. RP_l of few
        cycles is too small in the mean, by a sixth with five: the interval counts that, and lies higher.
    angles
        RP_a, RP_b, RP_c: three standard deviations, to be read as ±, rad; ``None`` where only positions are known.
    """

    position: float
    ci95: tuple[float, float] | None = None
    angles: Three | None = None


def repeatability(attained: Attained) -> Repeatability:
    """Pose repeatability RP of one pose from n ≥ 2 cycles."""
    deviations, turned = attained.position - attained.barycentre, None
    value = float(_of(np.linalg.norm(deviations, axis=1)))
    if attained.rotation is not None:
        turns = angles(attained.rotation, mean_rotation(attained.rotation))
        turned = three(SPREADS * turns.std(axis=0, ddof=1))
    return Repeatability(value, _interval(deviations, value), turned)


def _of(distances: Array) -> Array:
    """Positional repeatability RP_l from distances to the barycentre, the last axis being cycles."""
    return np.asarray(distances.mean(axis=-1) + SPREADS * distances.std(axis=-1, ddof=1))


def _interval(deviations: Array, value: float) -> tuple[float, float] | None:
    """Bootstrap interval (95 %, parametric) of RP_l, from normal scatter with the sample's principal axes.

    The ratio of RP_l from n cycles to its limit depends on the shape of the scatter, not on its size. The draws are the
    same in each call.
    """
    cycles = len(deviations)
    if cycles < FEWEST_FOR_INTERVAL or value == 0.0:
        return None
    spread = np.linalg.svd(deviations / value, compute_uv=False)[:3] / np.sqrt(cycles - 1.0)
    drawn = np.random.default_rng(0).standard_normal((DRAWS, cycles, len(spread))) * spread
    endless = _of(np.linalg.norm(drawn, axis=2).ravel())
    shown = _of(np.linalg.norm(drawn - drawn.mean(axis=1, keepdims=True), axis=2)) / endless
    low, high = np.quantile(shown, _LEVEL)
    return float(value / high), float(value / low)


def of_noise(sigma: float) -> float:
    """Repeatability RP_l of an instrument's noise alone, ``sigma`` per axis, m.

    The distances have Maxwell's law: mean 2 √(2/π) σ, standard deviation √(3 − 8/π) σ.
    """
    return float(sigma * (2.0 * np.sqrt(2.0 / np.pi) + SPREADS * np.sqrt(3.0 - 8.0 / np.pi)))


@dataclass(frozen=True)
class Variation:
    """Multi-directional pose accuracy variation vAP: largest differences between barycentres.

    Attributes
    ----------
    position
        vAP_p, the largest distance, m.
    angles
        vAP_a, vAP_b, vAP_c, the largest angle about each axis, rad; ``None`` where only positions are known.
    """

    position: float
    angles: Three | None = None


def variation(attained: Sequence[Attained]) -> Variation:
    """Multi-directional pose accuracy variation vAP, from the attained poses of two directions or more."""
    pairs = list(combinations(attained, 2))
    away = max(float(np.linalg.norm(one.barycentre - other.barycentre)) for one, other in pairs)
    means = [(one.mean_rotation, other.mean_rotation) for one, other in pairs]
    turns = [np.abs(angles(one, other)) for one, other in means if one is not None and other is not None]
    return Variation(away, three(np.max(turns, axis=0)) if turns else None)


@dataclass(frozen=True)
class Drift:
    """Drift of pose characteristics: largest changes against the first measuring time.

    Attributes
    ----------
    accuracy, accuracy_angles
        dAP_p, m, and dAP_a, dAP_b, dAP_c, rad: change of AP; ``None`` where AP cannot be told.
    repeatability, repeatability_angles
        dRP_l, m, and dRP_a, dRP_b, dRP_c, rad: change of RP.
    shift
        How far the barycentre went, m. It is no criterion of the standard, whose dAP_p does not see a pose that goes
        from one side of the commanded pose to the other.
    """

    accuracy: float | None
    repeatability: float
    shift: float
    accuracy_angles: Three | None = None
    repeatability_angles: Three | None = None


def drift_of(attained: Sequence[Attained], commanded: Sequence[Attained] | None = None) -> Drift:
    """Drift of pose accuracy and repeatability of one pose.

    Parameters
    ----------
    attained
        Attained poses of each measuring time, first to last: two times or more, each of two cycles or more.
    commanded
        Of each measuring time, as for :func:`~thermal_robot.iso9283.accuracy`; ``None`` where AP cannot be
        told.
    """
    spread = [repeatability(each) for each in attained]
    gone = [float(np.linalg.norm(each.barycentre - attained[0].barycentre)) for each in attained]
    near, turned = None, None
    if commanded is not None:
        away = [accuracy(a, c) for a, c in zip(attained, commanded, strict=True)]
        near, turned = _change([a.position for a in away]), _change([a.angles for a in away])
    again, scattered = _change([r.position for r in spread]), _change([r.angles for r in spread])
    return Drift(near, again, max(gone), turned, scattered)


def _change(values: Sequence[Any]) -> Any:
    """Largest change against the first of numbers or triples; ``None`` where one of them is unknown."""
    if any(value is None for value in values):
        return None
    largest = np.abs(np.subtract(values, values[0])).max(axis=0)
    return three(largest) if np.ndim(largest) else float(largest)


@dataclass(frozen=True)
class AlongPath:
    """Path criteria AT or RT: worst of a path's points.

    Attributes
    ----------
    position
        AT_p or RT_p, m.
    angles
        AT_a, AT_b, AT_c, or RT_a, RT_b, RT_c (±), each the largest of all points, rad; ``None`` where only positions
        are known.
    """

    position: float
    angles: Three | None = None


def along_path(points: Sequence[Accuracy] | Sequence[Repeatability]) -> AlongPath:
    """Path accuracy AT from the accuracies of its points; path repeatability RT from their repeatabilities."""
    turns = [np.abs(point.angles) for point in points if point.angles is not None]
    return AlongPath(max(point.position for point in points), three(np.max(turns, axis=0)) if turns else None)


@dataclass(frozen=True)
class PoseCriteria:
    """AP, RP, vAP and drift of one pose.

    Attributes
    ----------
    pose
        Its label.
    cycles
        How often it was repeated.
    directions
        From how many directions it was approached; ``None`` where that is unknown.
    repeatability
        RP, of all cycles.
    accuracy
        AP; ``None`` where the frames take up all that was measured.
    corrected
        AP against the prediction of a corrected model; ``None`` without one.
    variation, variation_cycles
        vAP, and the number of cycles from each direction that counts, two or more; ``None`` and empty with fewer than
        two such directions.
    drift, drift_cycles
        Drift, and the number of cycles at each measuring time; ``None`` and empty with fewer than two times.
    """

    pose: str
    cycles: int
    directions: int | None
    repeatability: Repeatability
    accuracy: Accuracy | None = None
    corrected: Accuracy | None = None
    variation: Variation | None = None
    variation_cycles: tuple[int, ...] = ()
    drift: Drift | None = None
    drift_cycles: tuple[int, ...] = ()


@dataclass(frozen=True)
class PathCriteria:
    """AT and RT of one path.

    Attributes
    ----------
    path
        Its label.
    points
        How many of its points were repeated.
    cycles
        Smallest number of repeats of any point.
    repeatability
        Path repeatability RT.
    accuracy, corrected
        Path accuracy AT, and AT against the prediction of a corrected model; ``None`` as for a pose.
    """

    path: str
    points: int
    cycles: int
    repeatability: AlongPath
    accuracy: AlongPath | None = None
    corrected: AlongPath | None = None
