"""Maximum a posteriori fit of the servo model by Gauss-Newton, and its normal equations, deflated for motions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, pairwise

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
    def at(
        cls, model: JointModel, values: Array, wanted: Mask | None = None, groups: Groups | None = None,
        secant: bool = False,
    ) -> Point:  # fmt: skip
        """Linearise the model at some values by the parameters of the mask ``wanted``, by default all.

        With ``groups`` it has the rows of these joints alone. See :meth:`JointModel.rows` for ``secant``.
        """

        def parts(group: Sequence[int]) -> list[Part]:
            return [Part.of(one, values, model.clusters) for one in model.rows(group, values, wanted, secant)]

        return cls(model, values, model.by_joint(parts, groups))

    def with_rows(self, other: Point, groups: Groups) -> Point:
        """Return the point with the rows that another one has of some groups of joints."""
        joints = sorted(j for group in groups for j in group)
        own = dict(enumerate(self.rows)) | dict(zip(joints, other.rows, strict=True))
        return replace(self, rows=[own[j] for j in range(len(self.rows))])

    def without_residuals(self) -> Point:
        """Return the sums alone: of long logs residuals would be large."""
        return replace(self, rows=[one.without_residual() for one in self.rows])

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
            problem = matrix[np.ix_(own, own)], vector[own], self.model.sizes[own] ** -2.0, self.model.bounds[:, own]
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
    """Return the fit's values (P,), and if it ended where the model was linearised by all that is active, that."""
    some, groups = groups is not None and len(groups) < len(model.groups), groups or model.groups
    values, placed, alone = np.where(active, values, 0.0), model.placed, len(groups) == 1
    moving = active if known is None else active & ~known
    motions = np.ones(model.clusters, dtype=bool) if motions is None else motions
    common = moving & (placed == SHARED) & (not some)
    inside = common | (moving & np.isin(placed, [j for group in groups for j in group]))

    def descended(group: Sequence[int]) -> tuple[Array, Point | None]:
        own = moving & np.isin(placed, group) | common & alone
        return _Descent(model, [group], own, active if some else own, motions).run(values, settings.ROUNDS)

    for _ in range(settings.ROUNDS):  # joints go their own ways, then move with what they share
        each = model.each(descended, groups)
        for group, (there, _) in zip(groups, each, strict=True):
            values = np.where(np.isin(placed, group) | common & alone, there, values)
        if alone or not common.any():
            points = [point for _, point in each if point is not None and (some or (moving == active).all())]
            rows = [row for point in points for row in point.rows]
            return values, Point(model, values, rows) if len(points) == len(groups) else None
        values, point = _Descent(model, groups, inside, inside, motions).run(values, 1)
        if point is not None:
            return values, point if (inside == active).all() else None
    return values, None


@dataclass(frozen=True, eq=False)
class _Descent:
    """Gauss-Newton descent of −2 log posterior by the parameters ``own`` (P,), of some groups' joints and motions.

    The model is linearised by all that are ``wanted`` (P,).
    """

    model: JointModel
    groups: Groups
    own: Mask
    wanted: Mask
    motions: Mask

    def run(self, values: Array, rounds: int) -> tuple[Array, Point | None]:
        """Return the values (P,) where it ends, and the model linearised there unless ``rounds`` were too few."""
        for _ in range(rounds):
            point = Point.at(self.model, values, self.wanted, self.groups)
            before = self._cost(point, values, [one.residual for one in point.rows])
            then = self._stepped(point, before)
            then = self._shifted(point, before) if then is None else then
            if then is None:
                return values, point
            values = then
        return values, None

    def _left(self, values: Array) -> list[Array]:
        at = values[None]
        return self.model.by_joint(lambda group: [one[0] for one in self.model.residuals(group, at)], self.groups)

    def _cost(self, point: Point, values: Array, left: Sequence[Array]) -> float:
        """Squares of what is ``left`` over the noise at a point, of the motions, and the prior's squares."""
        used = (
            x if self.motions.all() else x[self.motions[row.motion]] for x, row in zip(left, point.rows, strict=True)
        )
        found = sum(float(x @ x) / row.noise**2 for x, row in zip(used, point.rows, strict=True))
        return found + float(np.sum((values / self.model.sizes)[self.own] ** 2))

    def _better(self, point: Point, before: float, tried: Iterable[Array], descending: bool = False) -> Array | None:
        """Return the first of some values (P,) that lowers the cost ``before``, at a point, by SETTLED, if any.

        Of steps ``descending`` from too long ones to short ones none lowers it much after the first that lowers it.
        """
        for then in tried:
            cost = self._cost(point, then, self._left(then))
            if cost < (1.0 if descending else 1.0 - settings.SETTLED) * before:
                return then if cost < (1.0 - settings.SETTLED) * before else None
        return None

    def _stepped(self, point: Point, before: float) -> Array | None:
        """Take the step of least damping that betters the cost; none where the undamped one promises too little."""
        own, here, sizes = np.flatnonzero(self.own), point.values, self.model.sizes
        if not len(own):
            return None
        matrix, vector = (one[:, self.motions].sum(axis=(0, 1)) for one in point.products[:2])
        problem = matrix[np.ix_(own, own)], vector[own], sizes[own] ** -2.0, self.model.bounds[:, own]
        steps = (_ahead(problem, here[own], damping) for damping in settings.DAMPINGS)
        first, promised = next(steps)
        if promised < settings.SETTLED * before:
            return None
        ahead = chain([first], (then for then, _ in steps))
        return self._better(point, before, (_with(here, own, then) for then in ahead), True)

    def _shifted(self, point: Point, before: float) -> Array | None:
        """Pattern search along the valley of delay and lag, where kinks stop Newton's steps.

        Delays go earlier and later by SHIFTS of their expected size, lags the other way or not at all.
        """
        delay, lag = (self.own & self.model.of_effects((name,)) for name in ("delay", "lag"))
        if not delay.any():
            return None
        size, least = self.model.sizes[delay].mean(), np.where(self.own, self.model.least, -np.inf)
        ways = [share * size * (delay - with_lag * lag) for share in settings.SHIFTS for with_lag in (1.0, 0.0)]
        return self._better(point, before, (np.maximum(point.values + way, least) for way in ways))


def _with(values: Array, own: NDArray[np.int64], some: Array) -> Array:
    found = values.copy()
    found[own] = some
    return found


def _ahead(problem: Problem, here: Array, damping: float) -> tuple[Array, float]:
    """Return values (K,) after a Levenberg-Marquardt step, bounded, and by how much −2 log posterior falls.

    ``problem``: information (K, K), right side (K,), the priors' precisions (K,), least and largest values (2, K).
    """
    inside, along, prior, (least, most) = problem
    own = np.diag(inside)
    held = damping * (own + np.median(own / prior) * prior)
    whole = inside + np.diag(held + prior)
    root = np.linalg.cholesky(whole)
    pull = np.linalg.solve(root, along + held * here)
    found = lsq_linear(root.T, pull, bounds=(least, most), method="bvls").x
    found = np.clip(found, least, most)  # it rounds: a limit of -1e-21 is none
    cost = [x @ (inside @ x + prior * x - 2.0 * along) for x in (here, found)]
    return found, float(cost[0] - cost[1])


def mean_squares(residual: Array, motion: NDArray[np.int64], count: int) -> Array:
    """(M,) mean square of a joint's residual (N,) in each of ``count`` clusters, by its readings' indices (N,)."""
    return np.bincount(motion, residual**2, count) / np.maximum(np.bincount(motion, minlength=count), 1)


def logs(squares: Array, noise: float) -> Array:
    """(M,) logarithm of the rms residual of each motion: minus its log likelihood a reading, its noise its own.

    ``squares`` (M,) are mean squares by motion; no motion is more exact than the readings' ``noise``.
    """
    return np.asarray(0.5 * np.log(np.maximum(squares, 0.0) + noise**2))


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


def deflated(point: Point, own: NDArray[np.int64], deflation: Array, worth: Array) -> Gram:
    """Return normal equations in units of prior sizes, deflated to the independent information of the motions.

    G′ = S G S and b′ = G′ θ̂ with S the inverse root of the ratios, so that θ̂ stays, that of the parameters ``own`` (K,)
    alone: what else the point is linearised by tells nothing of them. Each is a block.
    """
    matrix, vector = point.whole[0][np.ix_(own, own)], point.whole[1][own]
    sizes, parameters = point.model.sizes[own], [point.model.parameters[p] for p in own]
    found = np.linalg.solve(matrix + np.diag((settings.WIDE * sizes) ** -2.0), vector)
    less = np.diag(sizes / np.sqrt(deflation[own]))
    whole = less @ matrix @ less
    along, equations = whole @ (found / sizes), float(worth.sum())
    k = range(len(own))
    return Gram(
        whole,
        along,
        equations + float(found / sizes @ along),
        tuple(slice(i, i + 1) for i in k),
        tuple(np.eye(1) for _ in k),
        point.model.least[own] == 0.0,
        tuple(int(whole[i, i] > settings.SEEN) for i in k),
        np.array([one.spread for one in parameters]),
        equations,
        noise_dof=0.0,
    )
