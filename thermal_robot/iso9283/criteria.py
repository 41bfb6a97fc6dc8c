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
"""Fewest cycles for a confidence interval. Two lie equally far from their barycentre: the spread stays unknown."""
DRAWS = 1000
"""Simulated repetitions of the test for the interval, whose ends are then good to 1 % at 30 cycles."""
_LEVEL = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class Attained:
    """Attained poses of one target in n cycles, all in one frame, which the standard wants to be the base frame.

    Attributes
    ----------
    position
        (n, 3) m.
    rotation
        (n, 3, 3) rotation matrices from the target's frame to that frame; ``None`` where only positions are known.
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
        """Return the attained poses of some cycles, chosen by number or mask."""
        return Attained(self.position[rows], None if self.rotation is None else self.rotation[rows])


def mean_rotation(rotations: Array) -> Array:
    """Chordal mean (3, 3) of (n, 3, 3) rotations: the arithmetic mean matrix, projected onto SO(3) by its SVD.

    Moakher, *SIAM J. Matrix Anal. Appl.* 24 (2002).
    """
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def angles(rotations: Array, reference: Array) -> Array:
    """Angles a, b, c (..., 3) from a reference rotation to rotations R: the rotation vector of R R_refᵀ, rad.

    The standard turns about one axis after the other, which differs by products of the angles: 1 µrad at 1 mrad.
    """
    return log3(rotations @ np.swapaxes(reference, -1, -2))


def three(values: ArrayLike) -> Three:
    """Convert an array of three numbers to a tuple of floats."""
    a, b, c = (float(v) for v in np.asarray(values))
    return a, b, c


@dataclass(frozen=True)
class Accuracy:
    """Pose accuracy AP: difference of the barycentre of the attained poses from the commanded pose.

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
    """Pose accuracy AP of one pose: mean attained position and rotation against the mean commanded ones.

    Parameters
    ----------
    attained
        Attained poses of n cycles.
    commanded
        Commanded pose, one row; or n rows, where a model (with temperature, say) predicts every cycle separately.
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
        95 % confidence interval of the RP_l of infinitely many cycles, m; ``None`` with two cycles, or without scatter.
        RP_l of few cycles is biased low, by a sixth with five; the interval corrects that, and so lies higher.
    angles
        RP_a, RP_b, RP_c: three standard deviations, to be read as ±, rad; ``None`` where only positions are known.
    """

    position: float
    ci95: tuple[float, float] | None = None
    angles: Three | None = None


def repeatability(attained: Attained) -> Repeatability:
    """Pose repeatability RP of one pose from n ≥ 2 cycles: RP_l with its confidence interval, RP_a, RP_b and RP_c."""
    deviations, turned = attained.position - attained.barycentre, None
    value = float(_of(np.linalg.norm(deviations, axis=1)))
    if attained.rotation is not None:
        turns = angles(attained.rotation, mean_rotation(attained.rotation))
        turned = three(SPREADS * turns.std(axis=0, ddof=1))
    return Repeatability(value, _interval(deviations, value), turned)


def _of(distances: Array) -> Array:
    """RP_l: mean plus 3 sample standard deviations, over the last axis (cycles), of distances to the barycentre, m."""
    return np.asarray(distances.mean(axis=-1) + SPREADS * distances.std(axis=-1, ddof=1))


def _interval(deviations: Array, value: float) -> tuple[float, float] | None:
    """Parametric bootstrap 95 % interval of the RP_l of infinitely many cycles; ``None`` below 3 cycles or with RP_l 0.

    Cycles are drawn from a normal law with the principal standard deviations of ``deviations`` (n, 3); quantiles of
    RP_l of n cycles over that of all divide ``value``, the RP_l measured. The random draws are the same in each call.
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
    """Repeatability RP_l, m, that isotropic normal noise of an instrument alone shows, ``sigma`` m per axis.

    The distances have a Maxwell distribution: mean 2 √(2/π) σ, standard deviation √(3 − 8/π) σ.
    """
    return float(sigma * (2.0 * np.sqrt(2.0 / np.pi) + SPREADS * np.sqrt(3.0 - 8.0 / np.pi)))


@dataclass(frozen=True)
class Variation:
    """Multi-directional pose accuracy variation vAP: largest differences between the mean poses of two directions.

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
    """Multi-directional variation vAP: largest difference of the mean poses over all pairs of approach directions."""
    pairs = list(combinations(attained, 2))
    away = max(float(np.linalg.norm(one.barycentre - other.barycentre)) for one, other in pairs)
    means = [(one.mean_rotation, other.mean_rotation) for one, other in pairs]
    turns = [np.abs(angles(one, other)) for one, other in means if one is not None and other is not None]
    return Variation(away, three(np.max(turns, axis=0)) if turns else None)


@dataclass(frozen=True)
class Drift:
    """Drift of pose characteristics: largest absolute changes of AP and RP against the first measuring time.

    Attributes
    ----------
    accuracy, accuracy_angles
        dAP_p, m, and dAP_a, dAP_b, dAP_c, rad: change of AP; ``None`` where AP is not known.
    repeatability, repeatability_angles
        dRP_l, m, and dRP_a, dRP_b, dRP_c, rad: change of RP.
    shift
        Largest distance of the barycentre from the first one, m. It is no criterion of the standard, whose dAP_p does
        not see a pose that goes from one side of the commanded pose to the other.
    """

    accuracy: float | None
    repeatability: float
    shift: float
    accuracy_angles: Three | None = None
    repeatability_angles: Three | None = None


def drift_of(attained: Sequence[Attained], commanded: Sequence[Attained] | None = None) -> Drift:
    """Drift of one pose: largest absolute changes of AP, RP and barycentre against the first measuring time.

    Parameters
    ----------
    attained
        Attained poses of each measuring time, first to last: two times or more, each of two cycles or more.
    commanded
        Commanded pose of each measuring time, as for :func:`~thermal_robot.iso9283.accuracy`; ``None`` where AP is
        not known.
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
    """Largest absolute difference from the first value, of numbers or per component of triples; ``None`` if any is."""
    if any(value is None for value in values):
        return None
    largest = np.abs(np.subtract(values, values[0])).max(axis=0)
    return three(largest) if np.ndim(largest) else float(largest)


@dataclass(frozen=True)
class AlongPath:
    """Path accuracy AT or path repeatability RT: the largest AP or RP among the points of a path.

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
    """Path accuracy AT (or repeatability RT): largest position figure, and largest absolute angles, of a path's points.

    ``points`` are the accuracies AP of the points for AT, their repeatabilities RP for RT.
    """
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
        Number of directions of approach; ``None`` where unknown.
    repeatability
        RP, of all cycles.
    accuracy
        AP; ``None`` where the fit of unknown frames has as many unknowns as there are measured numbers.
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
