"""Elongations from measured displacements at chosen poses (Eq 12), with what the poses leave undetermined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.assembly.thermal.best_poses import Axes, axes_of, measured, rank_of, visible
from thermal_robot.assembly.thermal.elongation import segment_names
from thermal_robot.errors import EstimationError
from thermal_robot.kinematics import elongation_jacobian
from thermal_robot.robot import Robot


@dataclass(frozen=True, eq=False)
class IdentifiedElongations:
    """Elongations of the S segments with a length, from m measured components; what is not identified is NaN.

    Parameters
    ----------
    names
        S names of segments.
    values, standard_errors
        (S,) m; standard errors are NaN too where the noise is neither given nor left over in the residuals.
    covariance
        (S, S) m².
    identified
        (S,) whether the measured components determine the elongation by themselves.
    condition
        Condition number of the m × S system, unweighted; infinite where something is not identified.
    rank
        Number of combinations of elongations that are determined.
    residuals
        (N, 3) m, measured − fitted; NaN where a component was not measured.
    """

    names: tuple[str, ...]
    values: Array
    standard_errors: Array
    covariance: Array
    identified: NDArray[np.bool_]
    condition: float
    rank: int
    residuals: Array

    def __str__(self) -> str:
        width = max(len(name) for name in self.names)
        lines = [f"elongations from {int(np.sum(np.isfinite(self.residuals)))} components, µm:"]
        for name, value, error, known in zip(
            self.names, 1e6 * self.values, 1e6 * self.standard_errors, self.identified, strict=True
        ):
            spread = f"± {error:.2f}" if np.isfinite(error) else "(noise unknown)"
            lines.append(
                f"  {name:<{width}}  " + (f"{value:.2f} {spread}" if known else "not identified by these poses")
            )
        return "\n".join([*lines, f"  condition number {self.condition:.3g}"])


def identify_elongations(
    robot: Robot,
    q: ArrayLike,
    displacement: ArrayLike,
    *,
    axes: Axes = "xyz",
    sigma: ArrayLike | None = None,
    covariance: ArrayLike | None = None,
) -> IdentifiedElongations:
    """Solve Eq 12 for the elongations, by weighted least squares, from displacements measured at N poses.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m, held while the temperature changed.
    displacement
        (N, 3) m in the root frame; components that ``axes`` leaves out are not read.
    axes
        What was measured: letters for all poses, such as ``"xyz"``, or a word for each, such as
        ``("x", "x", "x", "x", "z")`` for the paper's Eq 12.
    sigma
        Standard deviation of a measured component, m: a number, (3,) or (N, 3). By default all have one unknown
        standard deviation, which is then taken from the residuals if there are more components than unknowns.
    covariance
        (3, 3) or (N, 3, 3) m² instead, where the components of a pose are correlated, such as
        :func:`~thermal_robot.assembly.repeatability.tool_covariance` over the number of repetitions.

    Returns
    -------
    IdentifiedElongations
        Values with standard errors, covariance, condition number and residuals.

    Raises
    ------
    EstimationError
        If shapes do not fit, a measured component or the noise is not finite, or both kinds of noise are given.
    """
    jacobian = elongation_jacobian(robot, q)
    moved = np.atleast_2d(np.asarray(displacement, dtype=float))
    if moved.shape != (len(jacobian), 3) or not len(jacobian):
        raise EstimationError(f"displacements of shape {moved.shape} do not fit: expected {(len(jacobian), 3)}")
    chosen = measured(axes_of(axes, len(moved)))
    if not np.all(np.isfinite(moved[chosen])):
        raise EstimationError("a measured component of a displacement is not a finite number")
    noise = _noise(len(moved), sigma, covariance)
    system, right, weighted, weighted_right = [], [], [], []
    for pose, (rows, kept) in enumerate(zip(jacobian, chosen, strict=True)):
        whiten = np.eye(int(kept.sum())) if noise is None else _whitening(noise[pose][np.ix_(kept, kept)])
        system.append(rows[kept])
        right.append(moved[pose, kept])
        weighted.append(whiten @ rows[kept])
        weighted_right.append(whiten @ moved[pose, kept])
    design, observed = np.concatenate(weighted), np.concatenate(weighted_right)
    left, singular, right_vectors = np.linalg.svd(design, full_matrices=True)
    rank = rank_of(singular)
    inverse = right_vectors[:rank].T / singular[:rank]
    values = inverse @ (left[:, :rank].T @ observed)
    known = visible(right_vectors, rank)

    spread = inverse @ inverse.T
    if noise is None:
        freedom = len(observed) - rank
        spread = spread * (np.sum((observed - design @ values) ** 2) / freedom if freedom else np.nan)
    residuals = np.full_like(moved, np.nan)
    residuals[chosen] = np.concatenate(right) - np.concatenate(system) @ values
    return IdentifiedElongations(
        segment_names(robot),
        np.where(known, values, np.nan),
        np.where(known, np.sqrt(np.diag(spread)), np.nan),
        np.where(np.outer(known, known), spread, np.nan),
        known,
        float(np.linalg.cond(np.concatenate(system))) if rank == len(known) else np.inf,
        rank,
        residuals,
    )


def _noise(poses: int, sigma: ArrayLike | None, covariance: ArrayLike | None) -> Array | None:
    """Covariance (N, 3, 3) of the measured displacements, or None."""
    if sigma is not None and covariance is not None:
        raise EstimationError("give the noise as sigma or as a covariance, not as both")
    if covariance is not None:
        given = np.asarray(covariance, dtype=float)
        if given.shape not in ((3, 3), (poses, 3, 3)):
            raise EstimationError(f"a covariance of shape {given.shape} does not fit: expected {(poses, 3, 3)}")
        return np.broadcast_to(given, (poses, 3, 3))
    if sigma is None:
        return None
    deviations = np.asarray(sigma, dtype=float)
    if deviations.shape not in ((), (3,), (poses, 3)):
        raise EstimationError(f"sigma of shape {deviations.shape} does not fit: expected {(poses, 3)}")
    squares: Array = np.broadcast_to(deviations**2, (poses, 3))[:, :, None] * np.eye(3)
    return squares


def _whitening(covariance: Array) -> Array:
    if not np.all(np.isfinite(covariance)):
        raise EstimationError("the noise of a measured component is not a finite number")
    try:
        return np.linalg.inv(np.linalg.cholesky(covariance))
    except np.linalg.LinAlgError as error:
        raise EstimationError("the covariance of a measured displacement is not positive definite") from error
