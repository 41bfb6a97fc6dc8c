"""Generalised Procrustes analysis of several targets: their places on the tool, and the pose of each row.

In row i target k is seen at y_ik = t_i + R_i s_k + noise, with its unknown place s_k on the tool the same in all rows.
The places are those to which all rows together are nearest once each is moved rigidly (Gower, *Psychometrika* 40,
1975); what is free in them is a rigid motion of all, which the unknown tool frame takes up. The common frame has its
origin in their mean and the axes of their principal moments. Of a row, (R_i, t_i) then tells all that its targets say
of the robot: the rest is how they move against each other.

To first order the twist (t, ω) of that frame, in its own axes, has the covariance σ² (Σ_k J_kᵀ J_k)⁻¹ over the targets
that are seen, with J_k = [1, −[s_k]×]. Where all are seen its six figures are independent; where some are not, what
they then have in common is left out.

The instrument's noise of a point, and of single rows, tells that of the frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.kinematics import align, point_jacobian, rotation_to_quaternion

Mask = NDArray[np.bool_]

FEWEST = 3  # targets without which a pose can turn about the line through two
LINE = 0.01  # width over length of a line: the turn about it would be known a hundred times worse than the others
ROUNDS = 100  # of the analysis at most; a few are enough where the noise is small beside the distances
SETTLED = 1e-12  # share of the extent by which places still move when they are found: rounding moves them by 1e-15
TAIL = 3.0  # median distances from which on a target counts less for its place (Cauchy): one row in a few is gross
TINY = 1e-30  # m, where exact figures leave no distance


@dataclass(frozen=True, eq=False)
class Targets:
    """Coordinates of K targets in N rows, with their noise."""

    numbers: tuple[int, ...]  # K numbers, as of ``x.1``
    points: Array  # (N, K, 3) measured places, measurement frame, m; NaN where one was not seen
    places: Array  # (K, 3) in their common frame, m
    # (N, 6) one sigma of the common frame's place, 1, and of its turn about its own axes, 1/m, over that of a target
    spread: Array
    typical: Array  # (2,) root mean squares of both, over the rows with which the targets were read
    sigma: float  # one sigma per axis by which the targets move against each other, m: the median over the rows

    def take(self, rows: NDArray[np.int64] | Mask) -> Targets:
        """Return the targets of some rows, chosen by number or mask; places on the tool and typical noise stay."""
        return Targets(self.numbers, self.points[rows], self.places, self.spread[rows], self.typical, self.sigma)


@dataclass(frozen=True, eq=False)
class Posed:
    """Result of the Procrustes analysis: targets, and the pose of their common frame in each row."""

    targets: Targets  # of the rows that tell a pose
    # position, orientation: (N, 3) m and (N, 4) unit quaternions wxyz of their common frame
    position: Array
    orientation: Array
    deviation: Array  # (N,) one sigma per axis by which the targets of each row are off their places, m


def telling(points: Array) -> Mask:
    """Mask (N,) of rows that determine a pose: three or more of the targets (N, K, 3) seen, and not collinear."""
    return _wide(points, _seen(points))


def posed(numbers: tuple[int, ...], points: Array) -> Posed | None:
    """Generalised Procrustes analysis: the places of the targets, and the pose of their common frame in each row.

    ``points`` are (N, K, 3) measured places, m, of K ``numbers`` in rows that are :func:`telling`; NaN where a target
    was not seen. Returns ``None`` if a target is never seen together with three others whose places are known.
    """
    seen = _seen(points)
    found = _places(np.nan_to_num(points), seen)
    if np.isnan(found).any():
        return None
    middle = found - found.mean(axis=0)
    axes = np.linalg.svd(middle)[2][:2]
    along = middle @ axes.T
    # principal axes, right-handed: the farthest along each of the first two is in front
    axes = axes * np.sign(along[np.abs(along).argmax(axis=0), [0, 1]])[:, None]
    places = middle @ np.vstack([axes, np.cross(*axes)]).T
    motion = align(places, np.nan_to_num(points), seen.astype(float))
    turn, shift = motion[:, :3, :3], motion[:, :3, 3]
    left = np.nan_to_num(points - shift[:, None] - places @ turn.transpose(0, 2, 1))
    freedom = 3 * seen.sum(axis=1) - 6
    deviation = np.sqrt((left**2).sum(axis=(1, 2)) / freedom)
    sigma = float(np.median(deviation * np.sqrt(freedom / chdtri(freedom, 0.5))))
    spread = _spread(places, seen)
    typical = np.sqrt((spread.reshape(-1, 2, 3) ** 2).mean(axis=(0, 2)))
    targets = Targets(numbers, points, places, spread, typical, sigma)
    return Posed(targets, shift, rotation_to_quaternion(turn), deviation)


def _seen(points: Array) -> Mask:
    return np.asarray(np.isfinite(points).all(axis=2))


def _wide(points: Array, seen: Mask) -> Mask:
    """Mask (N,) of rows in which three or more of (N, K, 3) points are seen, and are at least 1 % as wide as long."""
    points, count = np.where(seen[:, :, None], points, 0.0), seen.sum(axis=1)
    middle = points.sum(axis=1) / np.maximum(count, 1)[:, None]
    extent = np.linalg.svd(np.where(seen[:, :, None], points - middle[:, None], 0.0), compute_uv=False)
    wide = extent[:, 1] > LINE * extent[:, 0] if extent.shape[1] > 1 else False
    return np.asarray((count >= FEWEST) & wide)


def _places(points: Array, seen: Mask) -> Array:
    """Robust generalised Procrustes mean (K, 3) of the targets' places, with Cauchy weights, in the frame of one row.

    It is the row that shows most targets. A target never seen with three others whose places are known is NaN.
    """
    first = int(np.argmax(seen.sum(axis=1)))
    places = np.where(seen[first][:, None], points[first], np.nan)
    extent = float(np.linalg.norm(np.ptp(points[first][seen[first]], axis=0)))
    for _ in range(ROUNDS):
        known, before = np.isfinite(places).all(axis=1), places
        rows = _wide(points, seen & known)
        use, own = (seen & known)[rows], np.nan_to_num(places)
        motion = align(own, points[rows], use.astype(float))
        local = (points[rows] - motion[:, None, :3, 3]) @ motion[:, :3, :3]
        distance = np.linalg.norm(local - own, axis=2)
        scale = TAIL * float(np.median(distance[use])) + TINY
        weight = seen[rows] * np.where(known, 1.0 / (1.0 + (distance / scale) ** 2), 1.0)
        total = weight.sum(axis=0)[:, None]
        places = np.where(total > 0.0, (weight[:, :, None] * local).sum(axis=0) / np.maximum(total, TINY), np.nan)
        linked = bool((np.isfinite(places) == np.isfinite(before)).all())
        if linked and np.nanmax(np.abs(places - before)) < SETTLED * extent:
            break
    return np.asarray(places)


def _spread(places: Array, seen: Mask) -> Array:
    """Propagate unit noise of the targets seen to the common frame's position and rotation: standard deviations (N, 6).

    Those of the position are averaged over its three axes (root mean square).
    """
    jacobian = point_jacobian(places)
    each = jacobian.transpose(0, 2, 1) @ jacobian
    variance = np.linalg.inv(np.einsum("nk,kab->nab", seen.astype(float), each)).diagonal(axis1=1, axis2=2).copy()
    variance[:, :3] = variance[:, :3].mean(axis=1, keepdims=True)
    return np.asarray(np.sqrt(variance))


def sigma_of_all(sigmas: Array, targets: Targets | None) -> tuple[float, float | None]:
    """Root mean square over rows of the standard deviation of positions, m, and with several targets rotations, rad.

    ``sigmas`` (N,), m, are those of one point in each row. The second value is ``None`` without several targets.
    """
    alike = bool(sigmas.min() == sigmas.max())
    return propagated_sigma(float(sigmas[0]) if alike else float(np.sqrt((sigmas**2).mean())), targets)


def propagated_sigma(sigma: float, targets: Targets | None) -> tuple[float, float | None]:
    """Propagate one point's sigma, m, to positions, m, and rotations, rad (``None`` without several targets)."""
    return (sigma, None) if targets is None else (sigma * float(targets.typical[0]), sigma * float(targets.typical[1]))


def of_a_point(sigma: float, targets: Targets | None) -> float:
    """Return the standard deviation of one point, m, from that of positions: inverse of :func:`propagated_sigma`."""
    return sigma if targets is None else sigma / float(targets.typical[0])


def relative_sigmas(sigmas: Array | None, whole: float | None, targets: Targets | None, turned: bool) -> Array | None:
    """Ratio (N, m) of the standard deviation of each measured figure to that of all rows; ``None`` if all are 1.

    ``sigmas`` (N,), m, are those of one point in each row, ``None`` if equal; ``whole``, m, is that of positions over
    all rows. m is 6 if orientations were measured (``turned``), else 3; noise of orientations is equal in all rows
    unless they come from several targets.
    """
    factor = np.ones(1) if sigmas is None or not whole else sigmas / of_a_point(whole, targets)
    if targets is not None:
        found = targets.spread / np.repeat(targets.typical, 3) * factor[:, None]
    else:
        found = np.column_stack([factor] * 3 + [np.ones(len(factor))] * 3)
    found = found if turned else found[:, :3]
    return None if bool((found == 1.0).all()) else found
