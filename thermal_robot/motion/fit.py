"""Maximum a posteriori fit of the servo model by Gauss-Newton, and its normal equations, deflated for motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from thermal_robot.arrays import Array
from thermal_robot.inference.evidence import Gram
from thermal_robot.motion import settings
from thermal_robot.motion.following import slope
from thermal_robot.motion.model import SHARED, JointModel, Mask, Rows

Groups = Sequence[Sequence[int]]
Problem = tuple[Array, Array, Array, Array]


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

    def without_residual(self) -> Part:
        """Return the sums alone."""
        return replace(self, residual=np.empty(0), motion=np.empty(0, dtype=np.int64))

    @property
    def bread(self) -> Array:
        """(M, P') diagonals of the information matrices: sums of squared derivatives over the noise, by motion."""
        return np.diagonal(self.matrix, axis1=1, axis2=2)

    @property
    def score(self) -> Array:
        """(M, P') gradient of the log likelihood by the parameters, by motion."""
        return np.asarray(self.vector - self.matrix @ self.values)

    def at(self, values: Array) -> Part:
        """Return the sums at other values (P,) of all parameters, as far as the model is linear."""
        there = values[self.columns]
        square, here = (
            float(self.total.sum() + x @ (self.matrix.sum(axis=0) @ x - 2.0 * self.vector.sum(axis=0)))
            for x in (there, self.values)
        )
        noise = max(self.noise * float(np.sqrt(max(square, 0.0) / here)), settings.LEAST_NOISE)
        less = (self.noise / noise) ** 2
        matrix, vector, total = less * self.matrix, less * self.vector, less * self.total
        one = self.without_residual()
        return replace(one, values=there, noise=noise, matrix=matrix, vector=vector, total=total)


@dataclass(frozen=True, eq=False)
class Point:
    """Linearised model at the parameters ``values`` (P,), with each joint's normal equations there."""

    model: JointModel
    values: Array
    rows: list[Part]

    @classmethod
    def at(cls, model: JointModel, values: Array, wanted: Mask | None = None, groups: Groups | None = None) -> Point:
        """Linearise the model at some values by the parameters of the mask ``wanted``, by default all.

        With ``groups`` it has the rows of these joints alone.
        """
        count = model.clusters

        def parts(group: Sequence[int]) -> list[Part]:
            return [Part.of(one, values, count) for one in model.rows(group, values, wanted)]

        return cls(model, values, model.by_joint(parts, groups))

    def with_rows(self, other: Point, groups: Groups) -> Point:
        """Return the point with the rows that another one has of some groups of joints."""
        joints = sorted(j for group in groups for j in group)
        own = dict(enumerate(self.rows)) | dict(zip(joints, other.rows, strict=True))
        return replace(self, rows=[own[j] for j in range(len(self.rows))])

    @property
    def noise(self) -> Array:
        """(J,) root mean square of each joint's residual, rad."""
        return np.array([one.noise for one in self.rows])

    @cached_property
    def whole(self) -> tuple[Array, Array]:
        """Return normal equations of all parameters (P, P) and right side (P,), summed over joints and motions."""
        matrix, vector = (one.sum(axis=(0, 1)) for one in self.products[:2])
        return matrix, vector

    def ahead(self, active: Mask) -> Point:
        """Predict the linearised model at the maximum a posteriori values of some parameters (P,), the others zero."""
        own, (matrix, vector), values = np.flatnonzero(active), self.whole, np.zeros(len(active))
        if len(own):
            problem = matrix[np.ix_(own, own)], vector[own], self.model.sizes[own] ** -2.0, self.model.least[own]
            values[own], _ = _ahead(problem, values[own], 0.0)
        return Point(self.model, values, [one.at(values) for one in self.rows])

    @property
    def products(self) -> tuple[Array, Array, Array]:
        """Return normal equations of all parameters (J, M, P, P), right sides (J, M, P), squared targets (J, M)."""
        shape, width = (len(self.rows), self.model.clusters), len(self.values)
        matrix, vector = np.zeros((*shape, width, width)), np.zeros((*shape, width))
        for j, one in enumerate(self.rows):
            matrix[j][:, one.columns[:, None], one.columns], vector[j][:, one.columns] = one.matrix, one.vector
        return matrix, vector, np.array([one.total for one in self.rows])


def fit(
    model: JointModel, values: Array, active: Mask, motions: Mask | None = None, groups: Groups | None = None,
    known: Mask | None = None,
) -> Array:  # fmt: skip
    """Maximum a posteriori values (P,) of the active parameters, the others zero, by damped Gauss-Newton.

    The prior counts as much as one independent reading. ``motions`` (M,) are the clusters that are fitted, by default
    all. Of some ``groups`` of joints only their own parameters move; those ``known`` (P,) stay.
    """
    return _fit(model, values, active, motions, groups, known)[0]


def fitted(model: JointModel, values: Array, active: Mask, groups: Groups | None = None) -> Point:
    """Maximum a posteriori fit of the active parameters, as :func:`fit`, and the model linearised there by these."""
    values, point = _fit(model, values, active, None, groups, None)
    return point or Point.at(model, values, active, groups)


def _fit(
    model: JointModel, values: Array, active: Mask, motions: Mask | None, groups: Groups | None, known: Mask | None
) -> tuple[Array, Point | None]:
    """Return the fit's values (P,), and if the last round moved nothing, the model as it was linearised there."""
    some, groups = groups is not None and len(groups) < len(model.groups), groups or model.groups
    values, every = np.where(active, values, 0.0), active
    joint_of = model.placed
    active = active if known is None else active & ~known
    motions = np.ones(model.clusters, dtype=bool) if motions is None else motions
    common = active & (joint_of == SHARED) & (not some)
    inside = active & np.isin(joint_of, [j for group in groups for j in group])
    quiet, alone = 0, len(groups) == 1
    for number in range(settings.ROUNDS):
        # joints go their own ways first; what they share moves in every second round
        shared = alone or (bool(common.any()) and number % 2 == 1)
        now = inside | common if shared else inside
        own = np.flatnonzero(now)
        if not len(own):
            continue
        point = Point.at(model, values, every if some else now, groups)
        matrix, vector = (one[:, motions].sum(axis=(0, 1)) for one in point.products[:2])
        problem = matrix[np.ix_(own, own)], vector[own], model.sizes[own] ** -2.0, model.least[own]
        # as one where a shared parameter moves, else each group by itself
        sets = [np.ones(len(joint_of), dtype=bool)] if shared else [np.isin(joint_of, group) for group in groups]
        parts = np.ones((1, len(groups))) if shared else np.eye(len(groups))
        cost = _Cost(model, groups, point, motions, parts)
        values, gain = _line_search(cost, problem, own, sets)
        if gain < settings.SETTLED:
            values, more = _shifted(cost, values, now, sets)
            gain += more
        if gain == 0.0 and (some or (now == every).all()):
            return values, point
        quiet = quiet + 1 if gain < settings.SETTLED else 0
        if quiet > (common.any() and not alone):
            break
    return values, None


def _line_search(cost: _Cost, problem: Problem, own: NDArray[np.int64], sets: list[Mask]) -> tuple[Array, float]:
    """Take for each set of parameters the step of least damping that betters its cost; return also the relative gain.

    Nothing moves where the undamped step promises less than SETTLED of the cost.
    """
    here = cost.point.values
    least = before = cost.of(here)
    found, better = here.copy(), np.zeros(len(sets), dtype=bool)
    for damping in settings.DAMPINGS:
        then = here.copy()
        then[own], promised = _ahead(problem, here[own], damping)
        if damping == 0.0 and promised < settings.SETTLED * before.sum():
            break
        costs = cost.of(then)
        for k in np.flatnonzero(~better & (costs < least)).tolist():
            found[sets[k]], better[k] = then[sets[k]], True
        least = np.where(better, np.minimum(least, costs), least)
        if better.all():
            break
    return found, float((before - least).sum() / max(before.sum(), 1e-300))


def _shifted(cost: _Cost, here: Array, now: Mask, sets: list[Mask]) -> tuple[Array, float]:
    """Pattern search along the valley of delay and lag, where kinks stop Newton's steps; return the relative gain too.

    Delays go earlier and later by SHIFTS of their expected size, lags the other way, where that betters a set's cost.
    """
    delay, lag = (now & cost.model.of_effects((name,)) for name in ("delay", "lag"))
    if not delay.any():
        return here, 0.0
    found, least = here, cost.of(here)
    before = least.sum()
    for share in settings.SHIFTS:
        own = share * cost.model.sizes[delay].mean() * (delay.astype(float) - lag)
        then = np.maximum(here + own, np.where(now, cost.model.least, here))
        costs = cost.of(then)
        for k in np.flatnonzero(costs < least).tolist():
            found = np.where(sets[k], then, found)
        least = np.minimum(costs, least)
    return found, float((before - least.sum()) / before)


def _ahead(problem: Problem, here: Array, damping: float) -> tuple[Array, float]:
    """Return values (K,) after a Levenberg-Marquardt step, bounded, and by how much −2 log posterior falls.

    ``problem``: information (K, K), right side (K,), the priors' precisions and least values (K,).
    """
    inside, along, prior, least = problem
    own = np.diag(inside)
    held = damping * (own + np.median(own / prior) * prior)
    whole = inside + np.diag(held + prior)
    root = np.linalg.cholesky(whole)
    pull = np.linalg.solve(root, along + held * here)
    found = np.asarray(lsq_linear(root.T, pull, bounds=(least, np.inf), method="bvls").x)
    cost = [x @ (inside @ x + prior * x - 2.0 * along) for x in (here, found)]
    return found, float(cost[0] - cost[1])


@dataclass(frozen=True, eq=False)
class _Cost:
    """−2 log posterior by group of joints: squares over the noise at a point, of some motions, and the prior's squares.

    A parameter's prior counts in its joint's group, that of a shared parameter in the last one. ``parts`` (K, G) of the
    groups are added.
    """

    model: JointModel
    groups: Groups
    point: Point
    motions: Mask
    parts: Array

    def of(self, values: Array) -> Array:
        """(K,) costs at values (P,)."""
        order = sorted(j for group in self.groups for j in group)
        noise, model = dict(zip(order, self.point.noise, strict=True)), self.model

        def of_group(group: Sequence[int]) -> float:
            if values is self.point.values:
                left = [self.point.rows[order.index(j)].residual for j in group]
            else:
                left = [one[0] for one in model.residuals(group, values[None])]
            used = (one[self.motions[model.motion_of(j)]] for j, one in zip(group, left, strict=True))
            return float(sum((one**2).sum() / noise[j] ** 2 for j, one in zip(group, used, strict=True)))

        found = np.array(model.each(of_group, self.groups))
        place = {j: k for k, group in enumerate(self.groups) for j in group} | {SHARED: len(found) - 1}
        for value, one in zip(values, model.parameters, strict=True):
            if one.joint in place:
                found[place[one.joint]] += (value / one.size) ** 2
        return np.asarray(self.parts @ found)


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


def worth(point: Point, deflation: Array) -> Array:
    """(J,) number of independent readings that each joint's are worth, by the median ratio of its parameters."""
    return np.array([len(one.residual) / float(np.median(deflation[one.columns])) for one in point.rows])


def deflated(point: Point, deflation: Array, worth: Array) -> Gram:
    """Return normal equations in units of prior sizes, deflated to the independent information of the motions.

    G′ = S G S and b′ = G′ θ̂ with S the inverse root of the ratios, so that θ̂ stays. Each parameter is a block.
    """
    matrix, vector = point.whole
    sizes, parameters = point.model.sizes, point.model.parameters
    wide = np.diag((settings.WIDE * sizes) ** -2.0)
    found = np.linalg.solve(matrix + wide, vector)
    less = np.diag(sizes / np.sqrt(deflation))
    whole = less @ matrix @ less
    along = whole @ (found / sizes)
    equations = float(worth.sum())
    k = range(len(sizes))
    return Gram(
        whole,
        along,
        equations + float(found / sizes @ along),
        tuple(slice(i, i + 1) for i in k),
        tuple(np.eye(1) for _ in k),
        point.model.least == 0.0,
        tuple(int(whole[i, i] > settings.SEEN) for i in k),
        np.array([one.spread for one in parameters]),
        equations,
        noise_dof=0.0,
    )
