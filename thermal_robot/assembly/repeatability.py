"""Propagation of joint scatter to the tool (Kluz et al. 2018, Eqs 1–4), and its inverse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError, RobotError
from thermal_robot.kinematics import frame_jacobians
from thermal_robot.kinematics.lanes import chunks, result, rows_last
from thermal_robot.robot import Robot

_EXACT = 1e-6
# Share of the largest variance within which a value must be met when neither rounding nor a sample size loosens it:
# above the tolerance of a linear program, below any measurement.

_NO_LEVER = 1e-9
# m/rad; a joint whose axis passes this near to the point does not move it.


@dataclass(frozen=True, eq=False)
class JointSigmas:
    """Standard deviations of n joints, fitted to measured scatter of the tool by :func:`joint_sigmas`.

    Parameters
    ----------
    joint_names
        n names.
    sigma
        (n,) rad or m: the non-negative least-squares fit. NaN for a joint that moves nothing measured.
    lower, upper
        (n,) rad or m: least and largest value over all non-negative solutions that are compatible with what was
        measured; infinite where nothing limits it, NaN where no solution is compatible.
    status
        ``"determined"``; ``"only bounded"`` where zero is compatible too, so that ``sigma`` is one choice of many;
        ``"not limited"`` where no measured component moves with the joint; ``"incompatible"`` where no solution
        exists.
    measured, fitted
        (N, c) m, rad: standard deviations of the measured components, and those of the fit; NaN where not measured.
    needed
        Factor by which the tolerance of every measured variance would have to grow, or could shrink, for exactly one
        solution to remain: compatible means at most 1.
    """

    joint_names: tuple[str, ...]
    sigma: Array
    lower: Array
    upper: Array
    status: tuple[str, ...]
    measured: Array
    fitted: Array
    needed: float

    @property
    def compatible(self) -> bool:
        """Whether some σ_q² ≥ 0 reproduces every measured (co)variance within its tolerance: ``needed`` ≤ 1."""
        return self.needed <= 1.0

    @property
    def misfit(self) -> float:
        """Largest |fitted − measured| standard deviation among the measured components, m (or rad)."""
        return float(np.nanmax(np.abs(self.fitted - self.measured)))

    def __str__(self) -> str:
        width = max(len(name) for name in self.joint_names)
        lines = ["standard deviations of the joints, µrad or µm:"]
        for name, value, low, high, status in zip(
            self.joint_names, 1e6 * self.sigma, 1e6 * self.lower, 1e6 * self.upper, self.status, strict=True
        ):
            said = {
                "determined": f"{value:.1f}, between {low:.1f} and {high:.1f}",
                "only bounded": f"only bounded: anything from 0 to {high:.1f}",
                "not limited": "not limited by what was measured",
                "incompatible": "no non-negative value is compatible with what was measured",
            }[status]
            lines.append(f"  {name:<{width}}  {said}")
        return "\n".join(lines)


def tool_covariance(
    robot: Robot,
    q: ArrayLike,
    sigma_q: ArrayLike | Mapping[str, float],
    *,
    measures: Literal["position", "pose"] = "position",
    point: ArrayLike | None = None,
) -> Array:
    """Covariance of the tool's position or pose for independent joint errors: J diag(σ_q²) Jᵀ.

    Its diagonal is Eqs 2–4 squared; the rest is the correlation that the paper leaves out.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m; (n,) counts as one configuration.
    sigma_q
        Standard deviation of each joint, rad or m: (n,), one number for all, or a mapping from the names of all
        joints.
    measures
        ``"position"`` for 3 × 3, m²; ``"pose"`` for 6 × 6, linear first: m², m·rad and rad².
    point
        (3,) or (N, 3) m: the point meant, fixed to the tool frame and expressed in it; its origin by default.

    Returns
    -------
    ndarray
        (N, 3, 3) or (N, 6, 6) in the axes of the root frame.

    Raises
    ------
    RobotError
        If a shape does not fit, a joint is unknown or missing, a σ is negative, or ``measures`` is unknown.
    """
    if measures not in ("position", "pose"):
        raise RobotError(f"measures is 'position' or 'pose', not {measures!r}", name=robot.name)
    jacobian = frame_jacobians(robot, q, point=point)[:, : 3 if measures == "position" else 6]
    rows, variances = rows_last(jacobian), _deviations(robot, sigma_q) ** 2
    size, joints, count = rows.shape
    covariance = result(None, count, size, size)
    written = rows_last(covariance)
    for part in chunks(count, joints):
        moved = rows[..., part] * variances[:, None]
        for a in range(size):
            for b in range(a + 1):
                written[a, b, part] = written[b, a, part] = np.einsum("jn,jn->n", moved[a], rows[b][:, part])
    return covariance


def joint_sigmas(
    robot: Robot,
    q: ArrayLike,
    measured: ArrayLike,
    *,
    rounding: float = 0.0,
    sample_size: int | None = None,
    confidence: float = 0.95,
    point: ArrayLike | None = None,
) -> JointSigmas:
    """Non-negative least squares for σ_q from measured scatter of the tool at N poses, with feasible intervals.

    The variances of Eqs 2–4 are linear in σ_q². They are fitted by non-negative least squares, each weighted by its
    tolerance; the intervals follow from linear programs over all σ_q² ≥ 0 that meet every measured value within its
    tolerance.

    Parameters
    ----------
    robot
        The robot.
    q
        (N, n) rad or m.
    measured
        (N, 3) m: standard deviations along the axes of the root frame, NaN where not measured; or full covariances
        (N, 3, 3) m², or (N, 6, 6) of the pose.
    rounding
        Half of the last printed digit of the standard deviations, m (rad for the angles of a pose). For a covariance
        it applies to its standard deviations and, times the other one, to the products.
    sample_size
        Number of repetitions behind each value: the tolerance then holds the sampling error too (the χ² interval of a
        variance; the normal one of a product).
    confidence
        Probability that the tolerances hold the truth all together (Bonferroni's), for ``sample_size``.
    point
        As for :func:`tool_covariance`.

    Returns
    -------
    JointSigmas
        Values, intervals, and which of them are determined. Without rounding and sample size the measured values
        count as exact.

    Raises
    ------
    RobotError
        If the shape of ``q`` does not fit.
    EstimationError
        If the shape of ``measured`` does not fit, nothing is measured, or a value or setting makes no sense.
    """
    jacobian, deviations, covariances = _measured(robot, q, measured, point)
    if rounding < 0.0 or not 0.0 < confidence < 1.0 or (sample_size is not None and sample_size < 2):
        raise EstimationError("needs rounding ≥ 0, a sample size of at least 2, and a confidence between 0 and 1")
    kept = np.isfinite(deviations)
    design, observed, low, high = _equations(jacobian, deviations, covariances, rounding, sample_size, 1.0 - confidence)
    seen = np.max(np.abs(jacobian[kept]), axis=0) > _NO_LEVER
    reach = np.max(np.abs(design[:, seen]), axis=0)
    scaled = design[:, seen] / reach
    fit, needed = _fit(scaled, observed, low, high)

    sigma, lower, upper = np.full(robot.n, np.nan), np.zeros(robot.n), np.full(robot.n, np.inf)
    sigma[seen] = np.sqrt(fit / reach)
    if needed <= 1.0:
        lower[seen], upper[seen] = (np.sqrt(bound / reach) for bound in _intervals(scaled, low, high))
    else:
        lower[:], upper[:] = np.nan, np.nan
    fitted = np.sqrt(np.sum((jacobian * np.nan_to_num(sigma)) ** 2, axis=2))
    fitted[~kept] = np.nan
    status = tuple(_status(*joint, needed) for joint in zip(seen, lower, strict=True))
    return JointSigmas(robot.joint_names, sigma, lower, upper, status, deviations, fitted, needed)


def _deviations(robot: Robot, sigma_q: ArrayLike | Mapping[str, float]) -> Array:
    if isinstance(sigma_q, Mapping):
        strange = [name for name in (*sigma_q, *robot.joint_names) if (name in sigma_q) != (name in robot.joint_names)]
        if strange:
            raise RobotError(
                f"the standard deviations and the joints of robot {robot.name!r} differ in {', '.join(strange)}",
                name=strange[0],
                candidates=robot.joint_names,
            )
        sigma_q = [sigma_q[name] for name in robot.joint_names]
    values = np.asarray(sigma_q, dtype=float)
    if values.shape not in ((), (robot.n,)) or not np.all(values >= 0.0):
        raise RobotError(
            f"expected a standard deviation ≥ 0 for each of the {robot.n} joints of robot {robot.name!r}, got {values}",
            name=robot.name,
        )
    return np.broadcast_to(values, (robot.n,))


def _measured(
    robot: Robot, q: ArrayLike, measured: ArrayLike, point: ArrayLike | None
) -> tuple[Array, Array, Array | None]:
    """Check measured scatter; return Jacobian (N, c, n), standard deviations (N, c), covariances (N, c, c) or None."""
    for given in (q, () if point is None else point):  # the solver of linear programs does not survive what is none
        if not np.isfinite(np.asarray(given, dtype=float)).all():
            raise EstimationError("joint positions and the point must be finite numbers")
    jacobian, values = frame_jacobians(robot, q, point=point), np.asarray(measured, dtype=float)
    poses, c = len(jacobian), values.shape[-1] if values.ndim else 0
    if c not in (3, 6) or values.shape not in ((poses, c), (poses, c, c)):
        raise EstimationError(
            f"measured scatter of shape {values.shape} does not fit {poses} poses: "
            f"expected {(poses, 3)} standard deviations or {(poses, 3, 3)} covariances"
        )
    if values.ndim == 2:
        if not np.any(np.isfinite(values)) or np.any(values < 0.0):
            raise EstimationError("standard deviations are numbers ≥ 0, at least one of them measured")
        return jacobian[:, :c], values, None
    variances = np.diagonal(values, axis1=1, axis2=2)
    if not np.all(np.isfinite(values)) or np.any(variances < 0.0):
        raise EstimationError("a measured covariance holds finite numbers, and variances ≥ 0")
    return jacobian[:, :c], np.sqrt(variances), values


def _equations(
    jacobian: Array,
    deviations: Array,
    covariances: Array | None,
    rounding: float,
    sample_size: int | None,
    risk: float,
) -> tuple[Array, Array, Array, Array]:
    """Linear equations in σ_q², one for each measured (co)variance: coefficients (m, n), value, lower and upper bound.

    Each row is divided by the largest deviations of its two components, so that lengths and angles weigh alike.
    """
    from scipy.special import chdtri, ndtri

    components = deviations.shape[1]
    paired = np.tri(components) if covariances is not None else np.eye(components)
    pose, a, b = np.nonzero(np.isfinite(deviations)[:, :, None] & (paired > 0.0))
    largest = np.max(np.nan_to_num(deviations), axis=0)
    size = np.where(largest[a] * largest[b] > 0.0, largest[a] * largest[b], 1.0)
    first, second, own = deviations[pose, a], deviations[pose, b], a == b
    value = first * second if covariances is None else np.where(own, first * second, covariances[pose, a, b])
    # of a variance
    low, high = np.maximum(first - rounding, 0.0) ** 2, (first + rounding) ** 2
    # of a product
    width = rounding * (first + second + rounding)
    if sample_size is not None:
        freedom, each = sample_size - 1, risk / len(pose) / 2.0
        low, high = low * freedom / chdtri(freedom, each), high * freedom / chdtri(freedom, 1.0 - each)
        width = width - ndtri(each) * np.sqrt(((first * second) ** 2 + value**2) / freedom)
    low, high = np.where(own, low, value - width), np.where(own, high, value + width)
    design = jacobian[pose, a] * jacobian[pose, b] / size[:, None]
    return design, value / size, low / size - _EXACT, high / size + _EXACT


def _fit(design: Array, observed: Array, low: Array, high: Array) -> tuple[Array, float]:
    """Non-negative least squares, and by linear program the least factor of all tolerances that admits a solution."""
    from scipy.optimize import linprog, nnls

    half, middle = (high - low) / 2.0, (high + low) / 2.0
    fit, _ = nnls(design / half[:, None], observed / half)
    # min t with |design v − middle| ≤ t half, v ≥ 0, t ≥ 0; it has a solution whatever was measured.
    within = np.hstack([design / half[:, None], -np.ones((len(half), 1))])
    beyond = np.hstack([-design / half[:, None], -np.ones((len(half), 1))])
    limits = np.concatenate([middle / half, -middle / half])
    found = linprog(np.eye(design.shape[1] + 1)[-1], A_ub=np.vstack([within, beyond]), b_ub=limits)
    if found.status != 0:
        raise EstimationError(f"the search for compatible standard deviations failed: {found.message}")
    return np.asarray(fit, dtype=float), float(found.fun)


def _intervals(design: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Linear programs for the least and largest value of each unknown over v ≥ 0 with low ≤ design v ≤ high."""
    from scipy.optimize import linprog

    above, limits = np.vstack([design, -design]), np.concatenate([high, -low])
    ends = np.empty((2, design.shape[1]))
    for j, unit in enumerate(np.eye(design.shape[1])):
        for end, sign in enumerate((1.0, -1.0)):
            found = linprog(sign * unit, A_ub=above, b_ub=limits)
            if found.status != 0:
                raise EstimationError(f"the interval of a standard deviation was not found: {found.message}")
            ends[end, j] = max(sign * found.fun, 0.0)
    return np.where(ends[0] > _EXACT, ends[0], 0.0), ends[1]


def _status(seen: bool, lower: float, needed: float) -> str:
    if not seen:
        return "not limited"
    if needed > 1.0:
        return "incompatible"
    return "determined" if lower > 0.0 else "only bounded"
