"""Laplace's evidence of sets of servo effects, each at its own maximum a posteriori fit, and motions held out there.

A problem that is linear at the fit of one set tells what a little more of an effect would do, and not what another one
does in its place. So what is compared is fitted. Whitening by the rms σ_j of what a set leaves in joint j, worth n_j
independent readings, costs n_j ln σ_j.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

from thermal_robot.arrays import Array
from thermal_robot.inference.evidence import evidence
from thermal_robot.inference.explain import log_odds
from thermal_robot.motion import settings
from thermal_robot.motion.effects import ABRUPT, SIMULATOR
from thermal_robot.motion.fit import Groups, Point, deflated, fitted, logs, ratios, worth
from thermal_robot.motion.model import SHARED, JointModel, Mask


def without(active: Mask, block: int | Sequence[int]) -> Mask:
    """(P,) mask of the parameters without one, or some."""
    return np.asarray(active & ~np.isin(np.arange(len(active)), block))


@dataclass(eq=False)
class Scales:
    """What all sets of parameters of a model are weighed by: ``deflation`` (P,) of their information, ``worth`` (J,).

    ``known`` keeps the fit of each group of joints, whose parameters may be those of several sets; ``far`` what the
    linear problem at its start predicts of a fit that was left off; ``linear`` that problem with more parameters.
    """

    model: JointModel
    deflation: Array
    worth: Array
    known: dict[tuple[bytes, ...], Point] = field(default_factory=dict)
    far: dict[tuple[bytes, ...], Point] = field(default_factory=dict)
    linear: dict[tuple[bytes, ...], Point] = field(default_factory=dict)

    def forget(self) -> None:
        """Forget all fits, which no longer hold where the model's loads are others."""
        for one in (self.known, self.far, self.linear):
            one.clear()

    @classmethod
    def of(cls, point: Point) -> Scales:
        """Take the scales at a fit that is linearised by all parameters."""
        deflation = ratios(point)
        return cls(point.model, deflation, worth(point, deflation))

    def fitted(self, active: Mask, values: Array) -> Weighed:
        """Weigh a set ``active`` (P,) at its maximum a posteriori fit from some values (P,)."""
        return Weighed(self, active, fitted(self.model, values, active))

    def others(
        self, base: Weighed, sets: Sequence[tuple[Mask, tuple[Array, ...]]], least: float = -np.inf
    ) -> list[Weighed]:
        """Weigh sets of parameters near one; only groups of joints whose parameters are others are fitted anew.

        A fit starts from the best of the set's starting values. It is left off where the problem that is linear there,
        and again a step ahead, promises a log evidence below ``least``, unless the second one makes up for half of what
        the first lacks.
        """
        missing = dict[tuple[bytes, ...], tuple[Groups, Mask, tuple[Array, ...]]]()
        for active, values in sets:
            for groups in self._touched(base, active):
                key = self._key(base, active, groups)
                if key not in self.known and (key not in self.far or least == -np.inf):
                    missing.setdefault(key, (groups, active, values))

        def near(key: tuple[bytes, ...]) -> Point | None:
            groups, active, values = missing[key]
            within, begun, before = self._within(groups), self._best(base, groups, values), -np.inf
            while least > -np.inf:
                self.far[key] = Point.at(self.model, begun, active, groups).ahead(active)
                told = self._placed(base, np.where(within, active, base.active))
                there = np.where(within, self.far[key].values, begun)
                if told.log_evidence >= least:
                    begun = there
                    break
                if not told.log_evidence - before >= least - told.log_evidence:
                    return None
                begun, before = there, told.log_evidence
            return fitted(self.model, begun, active, groups=groups).without_residuals()

        alone = [key for key, (groups, _, _) in missing.items() if len(groups) < len(self.model.groups)]
        found = dict(zip(alone, self.model.each(near, alone), strict=True)) if alone else {}
        found |= {key: near(key) for key in missing if key not in found}
        self.far = {key: one for key, one in self.far.items() if key not in found or found[key] is None}
        self.known |= {key: one for key, one in found.items() if one is not None}
        return [self._placed(base, active) for active, _ in sets]

    def linearised(self, base: Weighed, more: Mask, secant: bool = False) -> Weighed:
        """Linearise all joints at a set's fit by its own parameters and ``more`` (P,); see :meth:`JointModel.rows`."""
        found, wanted = base.point, base.active | more
        for group in self.model.groups:
            own = self.model.own(group)
            key = bytes(group), wanted[own].tobytes(), base.point.values[own].tobytes(), bytes([secant])
            if key not in self.linear:
                self.linear[key] = Point.at(self.model, base.point.values, wanted, [group], secant).without_residuals()
            found = found.with_rows(self.linear[key], [group])
        return Weighed(self, base.active, found)

    def _best(self, base: Weighed, groups: Groups, values: Sequence[Array]) -> Array:
        """(P,) those of some starting values with which the joints of some groups leave least."""
        starts, left = np.where(self._within(groups), values, base.point.values), np.zeros(len(values))
        for group in groups:
            for joint, one in zip(group, self.model.residuals(group, starts), strict=True):
                left += self.worth[joint] * np.log(np.maximum((one**2).sum(axis=1), 1e-300))
        return np.asarray(starts[np.argmin(left)])

    def _within(self, groups: Groups) -> Mask:
        """(P,) mask of what a fit of some groups moves: their own parameters, or if they are all, every one."""
        joints = [j for group in groups for j in group]
        return np.isin(self.model.placed, joints if len(joints) < len(self.model.joints) else (*joints, SHARED))

    def _touched(self, base: Weighed, active: Mask) -> list[Groups]:
        """Return the groups of joints whose parameters differ, one by one; all at once, if they share one of these."""
        other = set(self.model.placed[active ^ base.active].tolist())
        if SHARED in other:
            return [self.model.groups]
        return [(group,) for group in self.model.groups if other & set(group)]

    def _key(self, base: Weighed, active: Mask, groups: Groups) -> tuple[bytes, ...]:
        """Key of the fit of some groups: their joints and parameters, and the values of what all share there."""
        joints, shared = [j for group in groups for j in group], self.model.placed == SHARED
        whole = len(joints) == len(self.model.joints)
        return (
            bytes(joints),
            active[np.isin(self.model.placed, joints) | shared].tobytes(),
            b"" if whole else base.point.values[shared].tobytes(),
        )

    def _placed(self, base: Weighed, active: Mask) -> Weighed:
        """Return the set with the fits that are known of groups which differ, and the base's of the others."""
        found, values = base.point, np.where(active, base.point.values, 0.0)
        for groups in self._touched(base, active):
            key, joints = self._key(base, active, groups), [j for group in groups for j in group]
            point = self.known[key] if key in self.known else self.far[key]
            own = np.isin(self.model.placed, (*joints, SHARED))
            values[own] = point.values[own]
            found = found.with_rows(point, groups)
        return Weighed(self, active, replace(found, values=values))


@dataclass(frozen=True, eq=False)
class Weighed:
    """A set of parameters ``active`` (P,) at its own fit ``point``, whose joints may have no residuals kept."""

    scales: Scales
    active: Mask
    point: Point

    @cached_property
    def own(self) -> NDArray[np.int64]:
        """(K,) places of the active parameters."""
        return np.flatnonzero(self.active)

    def ahead(self, active: Mask) -> Weighed:
        """Predict the weighing of some of its parameters (P,) alone, by the problem that is linear at its fit."""
        return Weighed(self.scales, active, self.point.ahead(active))

    def instead(self, block: int, others: NDArray[np.int64]) -> tuple[Array, Array]:
        """(K,) squared partial correlations of one parameter's derivative with others', and values that replace it."""
        rest, ends = without(self.active, block), np.array([block, *others])
        matrix = self.point.whole[0] + np.diag(self.point.model.sizes**-2.0)
        cross = matrix[np.ix_(rest, ends)]
        left = matrix[np.ix_(ends, ends)] - cross.T @ np.linalg.solve(matrix[np.ix_(rest, rest)], cross)
        told, own = left[0, 1:], np.diag(left)
        return told**2 / (own[0] * own[1:]), self.point.values[block] * told / own[1:]

    @property
    def effects(self) -> frozenset[str]:
        """Names of the effects whose parameters are active."""
        return frozenset(self.point.model.parameters[p].effect for p in self.own)

    @cached_property
    def _laplace(self) -> tuple[float, Array]:
        """Log marginal likelihood with prior odds, but for what whitening costs, and standard deviations (K,)."""
        gram = deflated(self.point, self.own, self.scales.deflation, self.scales.worth)
        found = evidence(gram, tuple(range(len(self.own))), log_odds() * len(self.own), None)
        _, covariance = gram.posterior(found)
        return found.log_evidence, self.point.model.sizes[self.own] * np.sqrt(np.maximum(np.diag(covariance), 0.0))

    @cached_property
    def log_evidence(self) -> float:
        """Log marginal likelihood with log prior odds."""
        return float(self._laplace[0] - self.scales.worth @ np.log(self.point.noise))

    @property
    def rival_from(self) -> float:
        """Log evidence from which on another set is a rival of this one."""
        return self.log_evidence - settings.FAR_BELOW

    @property
    def likely_from(self) -> float:
        """Log evidence from which on another set is less likely than this one by ODDS at most."""
        return float(self.log_evidence - np.log(settings.ODDS))

    @cached_property
    def _smooth(self) -> tuple[NDArray[np.int64], Array, Array, Array]:
        """Places (K,) of parameters that are not abrupt, and normal equations of these by joint and motion.

        What is abrupt is taken as known, as one motion alone may tell it.
        """
        (matrix, vector, total), model = self.point.products, self.point.model
        abrupt = model.of_effects(ABRUPT)[self.own]
        own, known = self.own[~abrupt], self.own[abrupt]
        there = self.point.values[known]
        moved = matrix[:, :, own[:, None], known] @ there
        left = total - 2.0 * vector[:, :, known] @ there
        left += np.einsum("p,jmpq,q->jm", there, matrix[:, :, known[:, None], known], there, optimize=True)
        return own, matrix[:, :, own[:, None], own], vector[:, :, own] - moved, left

    @cached_property
    def _left_out(self) -> Array:
        """(J, M) linearised leave-one-motion-out cross-validation: sums of squared residuals by motion, rad²."""
        own, whole, along, left = self._smooth
        if len(own):
            found = deleted(whole.sum(axis=0), along.sum(axis=0), self.point.model.sizes[own])
            fitted = np.einsum("mp,jmpq,mq->jm", found, whole, found, optimize=True)
            left = left + fitted - 2.0 * (found * along).sum(axis=2)
        return np.asarray(left * self.point.noise[:, None] ** 2)

    @property
    def left_out(self) -> Array:
        """(J,) linearised leave-one-motion-out cross-validation: sum of squared residuals, rad²."""
        return np.asarray(self._left_out.sum(axis=1))

    @cached_property
    def losses(self) -> Array:
        """(M,) minus log likelihood of motions held out, each with its own noise, of as many readings as all are worth.

        With one noise for all the motion that a model explains least would decide alone.
        """
        model = self.point.model
        each = [
            logs(one / np.maximum(count, 1), noise)
            for one, count, noise in zip(self._left_out, model.counts, model.noises, strict=True)
        ]
        return np.asarray(self.scales.worth @ np.array(each) / model.clusters)

    @property
    def loss(self) -> float:
        """Negative log likelihood of all motions held out."""
        return float(self.losses.sum())

    @cached_property
    def seen(self) -> Mask:
        """(P,) whether a parameter, set to zero, moves a joint by twice its noise, rms, and by the tolerance.

        What is of a simulator, and not told of the robot, need not.
        """
        model, log = self.point.model, self.point.model.log
        least = np.array([log.visible_from(log.joints[joint], model.noises[joint]) for joint in model.joints])
        found = np.zeros(len(self.active), dtype=bool)
        found[self.own] = model.of_effects(SIMULATOR)[self.own] | (
            model.moved(self.point.values, self.own) >= least
        ).any(axis=1)
        return found

    @cached_property
    def deviations(self) -> Array:
        """(P,) standard deviations by the jackknife of motions, no less than the posterior's; NaN where not active.

        Delete-one-motion estimates, linearised (of clusters: MacKinnon, Nielsen and Webb, *Journal of Applied
        Econometrics* 38, 2023), times what Student's t with M − 1 degrees has at two sigma over a normal's. What
        motions differ by a single one does not tell: of its pieces. What is abrupt has the posterior's.
        """
        found, model = np.full(len(self.active), np.nan), self.point.model
        found[self.own] = self._laplace[1]
        count = len(model.log.motions) if len(model.log.motions) > 1 else model.clusters
        own, matrix, vector, _ = self._smooth
        pieces = matrix.shape[1] // count
        whole, along = (one.sum(axis=0).reshape(count, pieces, *one.shape[2:]).sum(axis=1) for one in (matrix, vector))
        estimates = deleted(whole, along, model.sizes[own])
        square = (count - 1) * np.var(estimates, axis=0) * (0.5 * stdtrit(count - 1, ndtr(2.0))) ** 2
        found[own] = np.maximum(np.sqrt(square), found[own])
        return found


def deleted(matrix: Array, vector: Array, sizes: Array) -> Array:
    """(M, K) linear estimates without one motion each, from normal equations (M, K, K) and (M, K)."""
    others, pull = (one.sum(axis=0) - one for one in (matrix, vector))
    scaled = np.einsum("i,mij,j->mij", sizes, others, sizes) + np.eye(len(sizes))
    return np.asarray(sizes * np.linalg.solve(scaled, (sizes * pull)[:, :, None])[:, :, 0])
