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
from thermal_robot.inference.algebra import equations_of, orthonormal, ridge, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import blocks, each, neighbourhoods
from thermal_robot.inference.scan import Thin, independent, orders, peak, periodogram
from thermal_robot.inference.target import Target
from thermal_robot.observations import Observations

Rows = NDArray[np.bool_]


def left_out(columns: Array, values: Array, flat: int, prior: Array, folds: Sequence[Rows]) -> float:
    """Cross-validation: sum of squares that fits to the other rows leave in each fold, in units of the noise.

    Columns (N, m, K) are weighted; the first ``flat`` have no prior, the others ``prior`` (K − flat,), 1/variance.
    """
    stack = np.concatenate([columns, values[:, :, None]], axis=2)
    whole = _products(equations_of(stack))
    total = 0.0
    for fold in folds:
        held = equations_of(stack[fold])
        fitted = ridge(whole - _products(held), flat, prior)
        total += float(((held[:, -1] - held[:, :-1] @ fitted) ** 2).sum())
    return total


def _products(flat: Array) -> Array:
    return np.asarray(flat.T @ flat)


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
    return _Pursuit.of(thin, others, fit).run()


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

    def run(self) -> JointRipple:
        """Return the waves."""
        found: list[_Wave] = []
        astray = np.ones(len(self.folds))
        while len(found) < settings.MOST_WAVES:
            wider = self._wider(found, astray)
            if wider is None:
                break
            found, astray = wider
        return _ripple(self._pruned(found))

    def _wider(self, found: list[_Wave], astray: Array) -> tuple[list[_Wave], Array] | None:
        """Return the waves with the one that is worth most of those that do no harm; ``None`` where none is worth it.

        ``astray`` (S,) is what rows held out are left with by each scheme, times the least that any wave before left.
        """
        target = self._target(found)
        before = self._left(target, found)
        seen = list(found)
        for _ in range(settings.WAVES_REFUSED):
            worth = [(self._gain(target, wave) - np.log(wave.tried), wave) for wave in self._peaks(target, found, seen)]
            offered = [wave for gain, wave in sorted(worth, key=lambda item: -item[0]) if gain > 0.0]
            if not offered:
                break
            for wave in offered:
                left = astray * self._left(target, [*found, wave]) / before
                if (left <= self.allowed).all():
                    return [*found, wave], np.maximum(left, 1.0)
                seen.append(wave)
        return None

    def _pruned(self, found: list[_Wave]) -> list[_Wave]:
        """Return the waves less those that later ones made needless."""
        kept = list(found)
        while kept:
            worth = []
            for wave in kept:
                target = self._target([other for other in kept if other != wave])
                worth.append(self._gain(target, wave) - np.log(wave.tried))
            if min(worth) > 0.0:
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

    def _target(self, found: Sequence[_Wave]) -> Target:
        columns = block(self.observations, _ripple(found)).columns
        design = np.concatenate([self.design, columns], axis=2)
        return Target.of(self.gap, design, self.changed, self.observations.campaign.relative_noise)

    def _moves(self, joint: str) -> tuple[Array, Array]:
        """(N,) positions of a joint, and (N, m, 1) what a unit of it moves."""
        j = self.observations.robot.joint_names.index(joint)
        return self.observations.q[:, j], self.observations.joint_sensitivity[:, : self.gap.shape[1], j, None]

    def _gain(self, target: Target, wave: _Wave) -> float:
        """Return the log evidence that a wave gains: the lesser of all equations and of one a row."""
        q, moves = self._moves(wave.joint)
        functions = np.column_stack([np.sin(wave.order * q), np.cos(wave.order * q)])
        columns = moves * functions[:, None, :]
        own = _along(target, moves[:, :, 0])
        return min(target.worth(columns).gain, own.worth(functions[:, None, :]).gain)

    def _left(self, target: Target, found: Sequence[_Wave]) -> Array:
        """(S,) sums of squares that are left beside waves in rows held out, by each scheme."""
        item = block(self.observations, _ripple(found))
        columns = np.concatenate([self.design, item.columns], axis=2) * target.root[:, :, None]
        prior = np.concatenate([self.prior, item.sizes**-2.0])
        return np.array([left_out(columns, self.gap * target.root, self.flat, prior, folds) for folds in self.folds])


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


def _along(target: Target, moves: Array) -> Target:
    """Return the target of one equation a row: the part of it that goes with moves (N, m) of one joint, a unit each."""
    own = moves * target.root
    length = np.linalg.norm(own, axis=1)
    way = own / np.where(length > 0.0, length, 1.0)[:, None]
    basis = orthonormal(np.einsum("nm,nmr->nr", way, target.basis.reshape(*own.shape, -1)))
    white = np.einsum("nm,nm->n", way, target.white.reshape(own.shape))
    return Target(without(white, basis), length[:, None], basis)
