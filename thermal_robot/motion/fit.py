"""Maximum a posteriori fit of the servo model by Gauss-Newton, and its normal equations, deflated for motions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from thermal_robot.arrays import Array
from thermal_robot.inference.evidence import Gram
from thermal_robot.motion import settings
from thermal_robot.motion.following import slope
from thermal_robot.motion.model import SHARED, JointModel, Mask, Rows


@dataclass(frozen=True, eq=False)
class Part:
    """Normal equations of one joint, by motion: sums over its rows, whose derivatives are not kept.

    ``residual`` (N,), rad, and its root mean square ``noise``; ``motion`` (N,). Of the derivatives J over
    the noise, by the parameters ``columns`` (P',): Gram matrices JᵀJ, ``matrix`` (M, P', P'), products with the target
    r + Jθ over the noise, ``vector`` (M, P'), and its square, ``total`` (M,). ``values`` (P',): θ.
    """

    residual: Array
    motion: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: Array
    noise: float
    matrix: Array
    vector: Array
    total: Array

    @classmethod
    def of(cls, rows: Rows, values: Array, count: int) -> Part:
        """Sum a joint's normal equations over each of ``count`` clusters; ``values`` (P,) are all parameters."""
        noise, own = max(np.sqrt(np.mean(rows.residual**2)), settings.LEAST_NOISE), values[rows.columns]
        target = (rows.residual + rows.derivative @ own) / noise
        ends = pairwise(np.searchsorted(rows.motion, np.arange(count + 1)))
        each = [(rows.derivative[a:b] / noise, target[a:b]) for a, b in ends]
        matrix, vector = np.array([x.T @ x for x, _ in each]), np.array([x.T @ y for x, y in each])
        total = np.array([y @ y for _, y in each])
        return cls(rows.residual, rows.motion, rows.columns, own, noise, matrix, vector, total)

    @property
    def bread(self) -> Array:
        """(M, P') diagonals of the information matrices: sums of squared derivatives over the noise, by motion."""
        return np.diagonal(self.matrix, axis1=1, axis2=2)

    @property
    def score(self) -> Array:
        """(M, P') gradient of the log likelihood by the parameters, by motion."""
        return np.asarray(self.vector - self.matrix @ self.values)

    @property
    def moved(self) -> Array:
        """(P',) rms contribution of each parameter to the joint's output, its size times the rms derivative, rad."""
        mean = self.bread.sum(axis=0) / len(self.residual)
        return np.asarray(self.noise * np.sqrt(mean) * np.abs(self.values))


@dataclass(frozen=True, eq=False)
class Point:
    """Linearised model at the parameters ``values`` (P,), with each joint's normal equations there."""

    model: JointModel
    values: Array
    rows: list[Part]

    @classmethod
    def at(cls, model: JointModel, values: Array, wanted: Mask | None = None) -> Point:
        """Linearise the model at some values by the parameters of the mask ``wanted``, by default all."""
        count = model.clusters
        return cls(model, values, model.each(lambda joint: Part.of(model.rows(joint, values, wanted), values, count)))

    @property
    def noise(self) -> Array:
        """(J,) root mean square of each joint's residual, rad."""
        return np.array([one.noise for one in self.rows])

    @cached_property
    def products(self) -> tuple[Array, Array, Array]:
        """Return normal equations of all parameters (J, M, P, P), right sides (J, M, P), squared targets (J, M)."""
        shape, width = (len(self.rows), self.model.clusters), len(self.values)
        matrix, vector = np.zeros((*shape, width, width)), np.zeros((*shape, width))
        for j, one in enumerate(self.rows):
            matrix[j][:, one.columns[:, None], one.columns], vector[j][:, one.columns] = one.matrix, one.vector
        return matrix, vector, np.array([one.total for one in self.rows])


def fit(model: JointModel, values: Array, active: Mask, motions: Mask | None = None) -> Array:
    """Maximum a posteriori values (P,) of the active parameters, the others zero, by damped Gauss-Newton.

    The prior counts as much as one independent reading. ``motions`` (M,) are the clusters that are fitted, by default
    all.
    """
    values = np.where(active, values, 0.0)
    joint_of = np.array([one.joint for one in model.parameters])
    motions = np.ones(model.clusters, dtype=bool) if motions is None else motions
    used = [motions[model.motion_of(joint)] for joint in model.joints]
    common = active & (joint_of == SHARED)
    quiet = 0
    for number in range(settings.ROUNDS):
        # joints go their own ways first; what they share moves in every second round
        shared = bool(common.any()) and number % 2 == 1
        now = active if shared else active & ~common
        own = np.flatnonzero(now)
        if not len(own):
            continue
        point = Point.at(model, values, now)
        matrix, vector = (one[:, motions].sum(axis=(0, 1)) for one in point.products[:2])
        sets = np.vstack([values, _ahead(model, values, own, matrix, vector)])
        costs = _costs(model, sets, used, point.noise)
        before, least = costs[:, 0].sum(), costs.min(axis=1).sum()
        if shared:
            whole = costs.sum(axis=0)
            values, least = sets[np.argmin(whole)], whole.min()
        else:
            values = values.copy()
            for j, cost in enumerate(costs):
                values[joint_of == j] = sets[np.argmin(cost)][joint_of == j]
        quiet = quiet + 1 if before - least < settings.SETTLED * before else 0
        if quiet > common.any():
            break
    return values


def _ahead(model: JointModel, values: Array, own: Any, matrix: Array, vector: Array) -> Array:
    """(S, P) values after one Levenberg-Marquardt step for each damping, by least squares with bounds at zero."""
    lower = np.where([model.parameters[p].positive for p in own], 0.0, -np.inf)
    found = np.tile(values, (len(settings.DAMPINGS), 1))
    inside = matrix[np.ix_(own, own)]
    for one, damping in zip(found, settings.DAMPINGS, strict=True):
        whole = inside + np.diag(damping * np.diag(inside) + model.sizes[own] ** -2.0)
        root = np.linalg.cholesky(whole)
        pull = np.linalg.solve(root, vector[own] + damping * np.diag(inside) * values[own])
        one[own] = lsq_linear(root.T, pull, bounds=(lower, np.inf), method="bvls").x
    return found


def _costs(model: JointModel, sets: Array, used: list[Mask], noise: Array) -> Array:
    """(J, S) −2 log posterior of S sets of parameters, by joint: squared residuals over noise, and the prior's squares.

    A parameter's prior counts in its joint, that of a shared parameter in the last joint.
    """
    found = np.stack(model.each(lambda j: (model.residuals(j, sets)[:, used[j]] ** 2).sum(axis=1) / noise[j] ** 2))
    np.add.at(found, [one.joint for one in model.parameters], ((sets / model.sizes) ** 2).T)
    return found


def ratios(point: Point) -> Array:
    """(P,) variance of each score clustered by motion over that of independent rows; at least 1 and the joint's median.

    The sandwich's meat over its bread (White, *Econometrica* 50, 1982; Liang and Zeger 1986). The scores are those
    that remain once the parameter itself is fitted.
    """
    found = np.ones(len(point.values))
    clustered, white = np.zeros(len(found)), np.zeros(len(found))
    for one in point.rows:
        whole, (_, error) = one.bread.sum(axis=0), slope(one.bread, one.score)
        clustered[one.columns] += np.nan_to_num(error * whole) ** 2
        white[one.columns] += whole
    seen = white > 0.0
    found[seen] = np.maximum(clustered[seen] / white[seen], 1.0)
    for one in point.rows:  # what few motions show has at least the ratio that is usual in its joint
        found[one.columns] = np.maximum(found[one.columns], np.median(found[one.columns]))
    return found


def deflated(point: Point, deflation: Array) -> Gram:
    """Return normal equations in units of prior sizes, deflated to the independent information of the motions.

    G′ = S G S and b′ = G′ θ̂ with S the inverse root of the ratios, so that θ̂ stays. Each parameter is a block.
    """
    matrix, vector = (one.sum(axis=(0, 1)) for one in point.products[:2])
    sizes, parameters = point.model.sizes, point.model.parameters
    wide = np.diag((settings.WIDE * sizes) ** -2.0)
    found = np.linalg.solve(matrix + wide, vector)
    less = np.diag(sizes / np.sqrt(deflation))
    whole = less @ matrix @ less
    along = whole @ (found / sizes)
    each = [float(np.median(deflation[one.columns])) for one in point.rows]
    equations = sum(len(one.residual) / ratio for one, ratio in zip(point.rows, each, strict=True))
    k = range(len(sizes))
    return Gram(
        whole,
        along,
        equations + float(found / sizes @ along),
        tuple(slice(i, i + 1) for i in k),
        tuple(np.eye(1) for _ in k),
        np.array([one.positive for one in parameters]),
        tuple(int(whole[i, i] > settings.SEEN) for i in k),
        np.array([one.spread for one in parameters]),
        equations,
        noise_dof=0.0,
    )
