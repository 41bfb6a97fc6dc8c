"""Waves of the joints, one after another: the one that explains most of what is left joins, while it is worth it.

This is a matching pursuit (Mallat and Zhang, *Matching pursuits with time-frequency dictionaries*, 1993) over all
joints and orders at once, all that is known fitted anew beside each wave.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects.joint_ripple import JointRipple
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, ridge, whitener, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import blocks, each, neighbourhoods
from thermal_robot.inference.scan import Thin, independent, orders, peak, periodogram
from thermal_robot.inference.target import Target, gained
from thermal_robot.observations import Observations

Rows = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Cross-validation of a ridge regression, from sums of products over the rows of each of F folds.

    ``stacks`` (n·m, K + 1) are the weighted columns in each fold, the values last, ``products`` (F, K + 1, K + 1).
    """

    folds: Sequence[Rows]
    stacks: tuple[Array, ...]
    products: Array

    @classmethod
    def of(cls, columns: Array, values: Array, folds: Sequence[Rows]) -> HeldOut:
        """Sum columns (N, m, K) and values (N, m) over folds that divide the rows."""
        stack = np.concatenate([columns, values[:, :, None]], axis=2)
        stacks = tuple(equations_of(stack[fold]) for fold in folds)
        return cls(folds, stacks, np.array([own.T @ own for own in stacks]))

    def left(self, flat: int, prior: Array, further: Array | None = None) -> float:
        """Sum of squares that fits to the other rows leave in each fold, in units of the noise.

        The first ``flat`` columns have no prior, the others ``prior`` (K − flat,), 1/variance; ``further`` columns
        (N, m, k) may join.
        """
        products = self.products if further is None else self._with(further)
        whole, total = products.sum(axis=0), 0.0
        for own in products:
            fitted = np.append(ridge(whole - own, flat, prior), -1.0)
            total += float(fitted @ own @ fitted)
        return total

    def _with(self, further: Array) -> Array:
        size, more = self.products.shape[1] - 1, further.shape[2]
        old, new = np.array([*range(size), size + more]), np.arange(size, size + more)
        found = np.empty((len(self.products), size + more + 1, size + more + 1))
        for own, before, stack, fold in zip(found, self.products, self.stacks, self.folds, strict=True):
            flat = equations_of(further[fold])
            own[np.ix_(old, old)], own[np.ix_(new, new)] = before, flat.T @ flat
            own[np.ix_(old, new)] = beside = stack.T @ flat
            own[np.ix_(new, old)] = beside.T
        return found


def waves(fit: Fit) -> JointRipple:
    """Return the ripple that the remainder of a fit shows, beside all its other effects; without waves where none does.

    The chance of the best of so many orders counts: a wave costs the logarithm of the number of independent orders of
    all joints (Baluev, *MNRAS* 385, 2008), one that another joint has that of the number of such waves. It must gain
    that in all equations, and in one a row, the part of the remainder that goes with the joint: what else is left is
    rarely independent in the components of a pose. And rows held out by time must be left with no more than without
    it, regions held out with hardly more.
    """
    thin = Thin.of(fit)
    others = [b for b in fit.explanation.best.blocks if not isinstance(thin.linear.blocks[b].effect, JointRipple)]
    return _Pursuit.of(thin, others, fit).run(_waves_of(fit))


def _waves_of(fit: Fit) -> list[_Wave]:
    """Return the waves that a fit holds: the pursuit goes on from them."""
    held = next((effect for effect, _ in fit.effects if isinstance(effect, JointRipple)), JointRipple())
    each = held.tried ** (1.0 / max(len(held.orders), 1))
    return [_Wave(joint, order, each) for joint, order in zip(held.joints, held.orders, strict=True)]


def alike(one: JointRipple, other: JointRipple) -> bool:
    """Whether two ripples have the same waves, but for what refining their orders may move these by."""
    first, second = (sorted(zip(ripple.joints, ripple.orders, strict=True)) for ripple in (one, other))
    return [joint for joint, _ in first] == [joint for joint, _ in second] and np.allclose(
        [order for _, order in first], [order for _, order in second], rtol=0.0, atol=settings.SAME_ORDER
    )


@dataclass(frozen=True)
class _Wave:
    """A wave of a joint, and among how many it was picked."""

    joint: str
    order: float
    tried: float


@dataclass(frozen=True, eq=False)
class _Pursuit:
    """Waves that are found one after another (matching pursuit), at the rows that are looked at.

    ``gap`` (N, m) is what all effects and waves explain; ``design`` (N, m, K) the columns of ``flat`` frame parameters
    and the other effects, ``prior`` (K − flat,) one over their prior variances; ``grids`` the orders tried by joint,
    ``folds`` the rows (N,) of each fold by scheme; rows that are ``changed`` (N,) weigh fully, however far they are.
    """

    observations: Observations
    gap: Array
    design: Array
    flat: int
    prior: Array
    grids: dict[str, Array]
    folds: tuple[list[Rows], ...]
    changed: Rows

    @classmethod
    def of(cls, thin: Thin, others: Sequence[int], fit: Fit) -> _Pursuit:
        linear, best, campaign = thin.linear, fit.explanation.best, thin.observations.campaign
        columns = [linear.blocks[b].columns for b in others]
        sizes = [linear.blocks[b].sizes * best.scales[b] for b in others]
        robot = campaign.robot
        grids = {
            joint: _orders(campaign.q[:, j], robot.joint_types[j] == "prismatic")
            for j, joint in enumerate(robot.joint_names)
        }
        return cls(
            thin.observations,
            linear.gap,
            np.concatenate([linear.frames, *columns], axis=2),
            linear.frames.shape[2],
            np.concatenate([np.zeros(0), *sizes]) ** -2.0,
            {joint: grid for joint, grid in grids.items() if len(grid)},
            (each(blocks(campaign)), each(neighbourhoods(campaign, settings.FOLDS))),
            thin.changed,
        )

    @property
    def allowed(self) -> Array:
        """(S,) how much more may be left in rows held out by each scheme than before: by time nothing."""
        return np.array([1.0, settings.WORSE_ELSEWHERE**2])

    @property
    def price(self) -> float:
        """Number of independent waves among which the best is picked."""
        return max(sum(independent(grid) for grid in self.grids.values()), 1.0)

    def run(self, found: list[_Wave]) -> JointRipple:
        """Return the waves, beginning with those that were found before."""
        astray, target = np.ones(len(self.folds)), self._target(found)
        while len(found) < settings.MOST_WAVES:
            wider = self._wider(found, astray, target)
            if wider is None:
                break
            found, astray = wider
            target = self._target(found, target)
        return _ripple(self._pruned(found, target))

    def _wider(self, found: list[_Wave], astray: Array, target: Target) -> tuple[list[_Wave], Array] | None:
        """Return the waves with the one that is worth most of those that do no harm; ``None`` where none is worth it.

        ``astray`` (S,) is what rows held out are left with by each scheme, times the least that any wave before left.
        """
        along = {joint: _along(target, self._moves(joint)[1][:, :, 0]) for joint in self.grids}
        root, columns = target.root[:, :, None], self._columns(found)
        held = [HeldOut.of(columns * root, self.gap * target.root, folds) for folds in self.folds]
        prior = np.concatenate([self.prior, self._priors(found)])
        before = np.array([one.left(self.flat, prior) for one in held])
        seen = list(found)
        for _ in range(settings.WAVES_REFUSED):
            worth = [
                (self._gain(target, along[wave.joint], wave) - np.log(wave.tried), wave)
                for wave in self._peaks(target, found, seen)
            ]
            offered = [wave for gain, wave in sorted(worth, key=lambda item: -item[0]) if gain > 0.0]
            if not offered:
                break
            for wave in offered:
                further, more = self._wave(wave) * root, np.concatenate([prior, self._priors([wave])])
                left = astray * np.array([one.left(self.flat, more, further) for one in held]) / before
                if (left <= self.allowed).all():
                    return [*found, wave], np.maximum(left, 1.0)
                seen.append(wave)
        return None

    def _pruned(self, found: list[_Wave], target: Target) -> list[_Wave]:
        """Backward elimination: return the waves less those that later ones made needless."""
        kept = list(found)
        while kept:
            whole = self._columns(kept) * target.root[:, :, None]
            values, last = self.gap * target.root, whole.shape[2] - 2 * np.arange(len(kept), 0, -1)
            worth = _dropped(equations_of(whole), values.ravel(), last)
            for joint in {wave.joint for wave in kept}:
                way = _way(target, self._moves(joint)[1][:, :, 0])[0]
                own = [k for k, wave in enumerate(kept) if wave.joint == joint]
                alone = _dropped(np.einsum("nm,nmk->nk", way, whole), (way * values).sum(axis=1), last[own])
                worth[own] = np.minimum(worth[own], alone)
            worth -= np.log([wave.tried for wave in kept])
            if worth.min() > 0.0:
                break
            kept.pop(int(np.argmin(worth)))
        return kept

    def _peaks(self, target: Target, found: Sequence[_Wave], seen: Sequence[_Wave]) -> Iterator[_Wave]:
        """Yield each joint's best wave beyond those that were seen, and its best of the orders of other joints.

        Joints of one size have gears of one kind: a wave that another joint has is one of few.
        """
        for joint, grid in self.grids.items():
            q, moves = self._moves(joint)
            width = np.pi / float(np.ptp(q))
            free, echo = np.ones(len(grid), dtype=bool), np.zeros(len(grid), dtype=bool)
            for wave in seen:
                free &= (wave.joint != joint) | (np.abs(grid - wave.order) > width)
            for wave in found:
                echo |= (wave.joint != joint) & (np.abs(grid - wave.order) <= width)
            seat = target.seat(moves)
            gains = np.where(free, periodogram(seat, q, grid), -np.inf)
            for among, tried in ((free, self.price), (free & echo, float(len(found) * len(self.grids)))):
                if among.any():
                    best = int(np.argmax(np.where(among, gains, -np.inf)))
                    order = peak(seat, q, grid[best : best + 1]) if np.isfinite(gains[best]) else 0.0
                    if grid[0] <= order <= grid[-1]:  # what peaks beyond is no ripple
                        yield _Wave(joint, order, tried)

    def _wave(self, wave: _Wave) -> Array:
        """(N, m, 2) what sine and cosine of a wave do."""
        q, moves = self._moves(wave.joint)
        return np.asarray(moves * np.column_stack([np.sin(wave.order * q), np.cos(wave.order * q)])[:, None, :])

    def _columns(self, found: Sequence[_Wave]) -> Array:
        """(N, m, K + 2W) the design and waves, in this order."""
        return np.concatenate([self.design, *(self._wave(wave) for wave in found)], axis=2)

    def _priors(self, found: Sequence[_Wave]) -> Array:
        """(2W,) one over the prior variance of the amplitudes of waves."""
        return block(self.observations, _ripple(found)).sizes ** -2.0

    def _target(self, found: Sequence[_Wave], like: Target | None = None) -> Target:
        relative = self.observations.campaign.relative_noise
        return Target.of(self.gap, self._columns(found), self.changed, relative, like)

    def _moves(self, joint: str) -> tuple[Array, Array]:
        """(N,) positions of a joint, and (N, m, 1) what a unit of it moves."""
        j = self.observations.robot.joint_names.index(joint)
        return self.observations.q[:, j], self.observations.joint_sensitivity[:, : self.gap.shape[1], j, None]

    def _gain(self, target: Target, along: Target, wave: _Wave) -> float:
        """Return the log evidence that a wave gains: the lesser of all equations and of one a row, along its joint."""
        q, _ = self._moves(wave.joint)
        functions = np.column_stack([np.sin(wave.order * q), np.cos(wave.order * q)])
        return min(target.worth(self._wave(wave)).gain, along.worth(functions[:, None, :]).gain)


def _dropped(columns: Array, values: Array, pairs: NDArray[np.int64]) -> Array:
    """(W,) log evidence that each pair of columns (E, K) gains beside all others, by their fit without it.

    Without a pair the sum of squares is larger by β_wᵀ C_ww⁻¹ β_w, β the values fitted and C their covariance.
    """
    root = whitener(columns.T @ columns)
    fitted = root @ (root.T @ (columns.T @ values))
    rest = max(float(((values - columns @ fitted) ** 2).sum()), settings.TINY)
    own = np.column_stack([pairs, pairs + 1])
    inner = root[own] @ root[own].transpose(0, 2, 1)
    more = np.einsum("wi,wi->w", fitted[own], np.linalg.solve(inner, fitted[own][:, :, None])[:, :, 0])
    return np.array([gained(rest + each, each, 2, len(values) - root.shape[1] + 2) for each in more])


def _ripple(waves: Sequence[_Wave]) -> JointRipple:
    found = JointRipple()
    for wave in waves:
        found = found.having(wave.joint, wave.order, wave.tried)
    return found


def _orders(q: Array, slides: bool) -> Array:
    """(K,) orders that are tried in a joint at positions (N,): those of which its range holds a whole wave."""
    grid = orders(q, slides)
    least = 2.0 * np.pi / max(float(np.ptp(q)), settings.TINY)
    return grid[grid >= (least if slides else max(least, settings.LOWEST_RIPPLE))]


def _way(target: Target, moves: Array) -> tuple[Array, Array]:
    """(N, m) unit vectors along what a joint moves, moves (N, m) weighted, and (N,) how far."""
    own = moves * target.root
    length = np.linalg.norm(own, axis=1)
    return own / np.where(length > 0.0, length, 1.0)[:, None], length


def _along(target: Target, moves: Array) -> Target:
    """Return the target of one equation a row: the part of it that goes with moves (N, m) of one joint, a unit each."""
    way, length = _way(target, moves)
    basis = orthonormal(np.einsum("nm,nmr->nr", way, target.basis.reshape(*way.shape, -1)))
    white = np.einsum("nm,nm->n", way, target.white.reshape(way.shape))
    return Target(without(white, basis), length[:, None], basis)
