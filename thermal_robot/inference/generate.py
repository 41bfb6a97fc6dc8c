"""Generation of terms outside the library: change points, gear ripple, and laws of any quantity at any place.

Change points: every run of rows in the order of measurement is weighed at every place by a likelihood ratio (Page,
*Biometrika* 42, 1955, for one change; Siegmund, *Annals of Statistics* 14, 1986, for a run between two), from
cumulative sums. Clustered outliers count fully, as they may be the event.

Ripple: an orthogonal matching pursuit (Mallat and Zhang, *Matching pursuits with time-frequency dictionaries*, 1993)
over all joints and orders at once: all terms are refitted with each wave.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.effects import JointRipple
from thermal_robot.effects.law import PREFIX, Discovered
from thermal_robot.effects.quantities import quantity, unit
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, orthonormal, ridge, whitener, without
from thermal_robot.inference.columns import block
from thermal_robot.inference.exact import constant
from thermal_robot.inference.explain import log_odds
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import blocks, each, in_order, neighbourhoods
from thermal_robot.inference.screening import (
    RowSample,
    ScanCache,
    Scanned,
    Target,
    bic_gain,
    explained_by,
    independent,
    orders,
    peak,
    periodogram,
    scan,
    shaped,
)
from thermal_robot.observables import components, seen_components
from thermal_robot.observations import Observations

Rows = NDArray[np.bool_]
Runs = NDArray[np.int64]
"""Runs of rows (C, 2) in the order of measurement: the first row of each, and the first behind it."""


@dataclass(frozen=True, eq=False)
class _Sums:
    """Cumulative sums, in the order of measurement, of the sufficient statistics of a place, to score runs of rows.

    ``products`` (N, ·) are each row's products of the place's d displacement columns with each other, with the r
    columns of the design, and with the residual; ``summed`` (N + 1, ·) their cumulative sums; ``squares`` (N,) the
    squared lengths of the residual; ``size`` (m, d, r); ``total`` and ``freedom`` as of ``PlaceStatistics``.
    """

    products: Array
    summed: Array
    squares: Array
    size: tuple[int, int, int]
    total: float
    freedom: int

    @classmethod
    def of(cls, target: Target, moves: Array, order: NDArray[np.int64]) -> _Sums:
        """Form the sums for the displacement columns (N, m, d) of a place, and the residual of a target."""
        (rows, m, d), statistics = moves.shape, target.statistics(moves)
        parts = (statistics.weight, statistics.design.transpose(2, 0, 1), statistics.remainder)
        products = np.concatenate([part.reshape(rows, -1) for part in parts], axis=1)[order]
        summed = np.concatenate([np.zeros((1, products.shape[1])), np.cumsum(products, axis=0)])
        squares = (target.white.reshape(rows, m) ** 2).sum(axis=1)[order]
        return cls(products, summed, squares, (m, d, len(statistics.design)), statistics.total, statistics.freedom)

    @property
    def fewest(self) -> int:
        """Smallest number of rows in a run, and before or after it."""
        m, d, _ = self.size
        return settings.FEWEST_ASIDE + -(-2 * d // m)

    def gains(self, sums: Array, total: float, freedom: int) -> Array:
        """Gain of log evidence (C,) by a constant displacement in each run, from sums (C, ·) over its rows (BIC)."""
        (_, d, r), runs = self.size, len(sums)
        whole, design = sums[:, : d * d].reshape(runs, d, d), sums[:, d * d : d * (d + r)].reshape(runs, r, d)
        gram = whole - design.transpose(0, 2, 1) @ design
        explained, rank = explained_by(gram, sums[:, d * (d + r) :], np.einsum("cii->ci", whole), len(self.products))
        return bic_gain(total, explained, rank, freedom)

    def best(self, runs: Runs) -> Runs:
        """Return the run (2,) of rows with the largest gain; (0, 0) where there is none to choose from."""
        if not len(runs):
            return np.zeros(2, dtype=np.int64)
        sums = self.summed[runs[:, 1]] - self.summed[runs[:, 0]]
        return np.asarray(runs[int(np.argmax(self.gains(sums, self.total, self.freedom)))])

    def best_step(self) -> Runs:
        """Best run with one change point: it begins with the first row, or ends with the last."""
        rows = len(self.products)
        inner = np.arange(self.fewest, rows - self.fewest + 1)
        steps = [np.column_stack([0 * inner, inner]), np.column_stack([inner, 0 * inner + rows])]
        return self.best(np.concatenate(steps))

    def best_run(self) -> Runs:
        """Best run between two change points: coarse grid, then pattern search."""
        rows, least = len(self.products), self.fewest

        def best(runs: Runs) -> Runs:
            inside = (runs[:, 0] >= least) & (runs[:, 1] <= rows - least) & (runs[:, 1] - runs[:, 0] >= least)
            return self.best(runs[inside])

        marks = np.unique(np.linspace(least, rows - least, settings.EVENT_MARKS).round().astype(np.int64))
        run, step = best(marks[np.column_stack(np.triu_indices(len(marks), 1))]), max(rows // settings.EVENT_MARKS, 1)
        while step and run.any():
            near = np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)])
            better = best(run + step * near)
            step = step if (better != run).any() else step // 2
            run = better
        return run

    def shared(self, rows: Rows) -> float:
        """Robust gain of log evidence by a displacement of masked rows (N,): the smaller of with and without outliers.

        Left out are the rows with the largest residual, a fixed share: all rows contribute to an event, but only a few
        to consecutive gross errors.
        """
        few, far = max(int(np.ceil(settings.EVENT_CARRYING * rows.sum())), settings.FEWEST_ASIDE), self.squares * rows
        out = np.argsort(-far)[:few]
        total = max(self.total - float(far[out].sum()), settings.TINY)
        whole = self.products[rows].sum(axis=0)
        less, freedom = whole - self.products[out].sum(axis=0), max(self.freedom - few * self.size[0], 1)
        gain = self.gains(whole[None], self.total, self.freedom)[0]
        return float(min(gain, self.gains(less[None], total, freedom)[0]))


def events(fit: Fit) -> tuple[Discovered, ...]:
    """Change points of a fit: steps in time, runs of rows, and sessions; the largest net gain first, one a place.

    Net is the gain of log evidence less the logarithm of the number tried, and less the gain of an effect that was left
    out for it. Empty for very few or very many rows.
    """
    if fit.campaign.samples > settings.RIPPLE_ROWS or fit.campaign.samples < settings.FEWEST_WITH_EVENTS:
        return ()
    observations, order = fit.corrected, in_order(fit.campaign)
    turns, joints = components(fit.campaign) == 6, fit.campaign.robot.joint_names
    plain = Discovered(quantity="none", shape="constant", turns=turns)
    where = [("base", "base"), ("tool", "tool"), *(("joint", joint) for joint in joints)]
    places = [replace(plain, kind=kind, place=place) for kind, place in where]
    moves = [block(observations, place).columns for place in places]
    found: dict[tuple[str, str], tuple[float, Discovered]] = {}
    for target, instead in _targets(fit):
        for place, own in zip(places, moves, strict=True):
            for gain, law in _at_place(observations, place, _Sums.of(target, own, order), order):
                # the choice among all places and runs, and the law itself, are paid for
                law = replace(law, tried=law.tried * len(places))
                net, key = gain + log_odds() - float(np.log(law.tried)), (law.kind, law.place)
                if net > 0.0 and net - instead > found.get(key, (0.0, law))[0]:
                    found[key] = (net - instead, law)
    return tuple(law for _, law in sorted(found.values(), key=lambda item: -item[0]))


def _targets(fit: Fit) -> Iterator[tuple[Target, float]]:
    """Yield residuals in which clustered outliers weigh fully, and the gain that an event in each must exceed.

    First with all effects: once all rows but single outliers weigh fully, once far rows have Cauchy weights. Then
    without each effect, which may imitate an event: the event must gain more than the effect.
    """
    e = fit.explanation
    single = e.outliers & ~clustered_outliers(fit, e.outliers)
    blocks = e.best.blocks

    def target(some: Iterable[int], trusted: Rows) -> Target:
        design = np.concatenate([e.linear.frames, *(e.linear.blocks[b].columns for b in some)], axis=2)
        return Target.of(e.linear.gap, design, trusted, fit.campaign.relative_noise, seen=e.whitening.seen)

    yield target(blocks, ~single), 0.0
    yield target(blocks, e.outliers & ~single), 0.0
    for out in blocks if len(blocks) <= settings.LEFT_OUT else ():
        rest = target([b for b in blocks if b != out], ~single)
        yield rest, rest.score(e.linear.blocks[out].columns).gain


def clustered_outliers(fit: Fit, aside: Rows) -> Rows:
    """Outliers (N,) with at least two others within a few rows in the order of measurement."""
    order = in_order(fit.campaign)
    near = np.convolve(aside[order], np.ones(2 * settings.NEAR_IN_ORDER + 1), "same")
    found = np.zeros_like(aside)
    found[order] = near >= settings.FEWEST_ASIDE
    return found & aside


def _at_place(
    observations: Observations, place: Discovered, sums: _Sums, order: NDArray[np.int64]
) -> Iterator[tuple[float, Discovered]]:
    """Yield the best step, the best run and each session at a place, as robust gain and law (with the number tried)."""
    rows, labels = len(order), observations.campaign.labels.get("session")
    sessions = {} if labels is None else {str(label): labels == label for label in np.unique(labels)}
    kinds, inner = 3 if len(sessions) > 1 else 2, max(rows - 2 * sums.fewest + 1, 0)
    name = next((name for name in CLOCK if observations.varies(name)), "order")
    clock = np.asarray(quantity(observations, name), dtype=float)
    for run, tried in ((sums.best_step(), inner), (sums.best_run(), inner**2)):
        inside, ordered = np.zeros(rows, dtype=bool), clock[order]
        inside[run[0] : run[1]] = True
        ends = tuple(float(0.5 * (ordered[k - 1] + ordered[k])) for k in run if 0 < k < rows)
        if ends[:1] != ends[1:]:  # there is a run, and not all of it at one time
            law = replace(place, quantity=name, shape="step" if len(ends) == 1 else "run", marks=ends)
            law = replace(
                law, origin=float(clock.min()), span=float(np.ptp(clock)), unit=unit(observations.robot, name)
            )
            yield sums.shared(inside), replace(law, tried=float(kinds * tried))
    for number, own in sorted(enumerate(sessions.values()), key=lambda item: item[1].sum()):
        if kinds == 3 and sums.fewest <= own.sum() < rows - sums.fewest:
            law = replace(place, quantity="session", shape="apart", marks=(float(number),), labels=tuple(sessions))
            law = replace(law, origin=0.0, span=len(sessions) - 1.0, tried=float(kinds * len(sessions)))
            yield sums.shared(own[order]), law


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Cross-validation of a ridge regression from Gram matrices over each of F folds.

    ``stacks`` (n·m, K + 1) are the weighted columns in each fold, the values last, ``products`` (F, K + 1, K + 1).
    """

    folds: Sequence[Rows]
    stacks: tuple[Array, ...]
    products: Array

    @classmethod
    def of(cls, columns: Array, values: Array, folds: Sequence[Rows]) -> HeldOut:
        """Form the Gram matrices of columns (N, m, K) and values (N, m) over disjoint folds."""
        stack = np.concatenate([columns, values[:, :, None]], axis=2)
        stacks = tuple(equations_of(stack[fold]) for fold in folds)
        return cls(folds, stacks, np.array([own.T @ own for own in stacks]))

    def left(self, flat: int, prior: Array, further: Array | None = None) -> float:
        """Held-out sum of squares over all folds, each predicted by the others, in units of the noise.

        The first ``flat`` columns have no prior, the others ``prior`` (K − flat,), 1/variance; ``further`` columns (N,
        m, k) may join.
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
    """Ripple of the joints in the residual of a fit, by matching pursuit; without waves where none is significant.

    A wave must gain more log evidence than the logarithm of the number of independent orders of all joints (Baluev,
    *MNRAS* 385, 2008), or, at the order of another joint's wave, of the number of such waves. It must do so in all
    equations and in one equation a row, along the joint, since the components of a pose are rarely independent. The
    held-out residual must not grow by time, and hardly by region.
    """
    sample = RowSample.of(fit)
    others = [b for b in fit.explanation.best.blocks if not isinstance(sample.linear.blocks[b].effect, JointRipple)]
    # it goes on from the waves that the fit holds
    held = ripple_of(fit)
    share = held.tried ** (1.0 / max(len(held.orders), 1))
    known = [_Wave(joint, order, share) for joint, order in zip(held.joints, held.orders, strict=True)]
    return _Pursuit.of(sample, others, fit).run(known)


def ripple_of(fit: Fit) -> JointRipple:
    """Ripple of a fit; without waves where it has none."""
    return next((effect for effect, _ in fit.effects if isinstance(effect, JointRipple)), JointRipple())


def alike(one: JointRipple, other: JointRipple) -> bool:
    """Whether two ripples have the same waves, up to the refinement of their orders."""
    first, second = (sorted(zip(ripple.joints, ripple.orders, strict=True)) for ripple in (one, other))
    return [joint for joint, _ in first] == [joint for joint, _ in second] and np.allclose(
        [order for _, order in first], [order for _, order in second], rtol=0.0, atol=settings.SAME_ORDER
    )


@dataclass(frozen=True)
class _Wave:
    """Wave sin(k q), cos(k q) of order k in a joint's position q, and the number of waves it was selected from."""

    joint: str
    order: float
    tried: float


@dataclass(frozen=True, eq=False)
class _Pursuit:
    """Orthogonal matching pursuit of joint ripple: waves are added one after another, all refitted.

    ``gap`` (N, m) is what effects and waves together are to explain; ``design`` (N, m, K) the columns of ``flat`` frame
    parameters and the other effects, ``prior`` (K − flat,) one over their prior variances; ``grids`` the orders tried
    by joint, ``folds`` the rows (N,) of each fold by scheme; rows that are ``changed`` (N,) weigh fully, however far
    they are.
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
    def of(cls, sample: RowSample, others: Sequence[int], fit: Fit) -> _Pursuit:
        linear, best, campaign = sample.linear, fit.explanation.best, sample.observations.campaign
        columns = [linear.blocks[b].columns for b in others]
        sizes = [linear.blocks[b].sizes * best.scales[b] for b in others]
        robot = campaign.robot
        grids = {
            joint: _orders(campaign.q[:, j], robot.joint_types[j] == "prismatic")
            for j, joint in enumerate(robot.joint_names)
        }
        return cls(
            sample.observations,
            linear.gap,
            np.concatenate([linear.frames, *columns], axis=2),
            linear.frames.shape[2],
            np.concatenate([np.zeros(0), *sizes]) ** -2.0,
            {joint: grid for joint, grid in grids.items() if len(grid)},
            (each(blocks(campaign)), each(neighbourhoods(campaign, settings.FOLDS))),
            sample.changed,
        )

    @property
    def allowed_ratio(self) -> Array:
        """Largest ratio (S,) of held-out residuals after and before, by scheme: 1 by time, slightly more by region."""
        return np.array([1.0, settings.WORSE_ELSEWHERE**2])

    @property
    def independent_waves(self) -> float:
        """Number of independent wave orders of all joints together, at least 1: a correction for multiple tests."""
        return max(sum(independent(grid) for grid in self.grids.values()), 1.0)

    def run(self, found: list[_Wave]) -> JointRipple:
        """Add waves to those that were found before, then eliminate those that became needless."""
        astray, target = np.ones(len(self.folds)), self._target(found)
        while len(found) < settings.MOST_WAVES:
            wider = self._with_best_wave(found, astray, target)
            if wider is None:
                break
            found, astray = wider
            target = self._target(found, target)
        return _ripple(self._pruned(found, target))

    def _with_best_wave(self, found: list[_Wave], astray: Array, target: Target) -> tuple[list[_Wave], Array] | None:
        """Add the wave of largest net gain that keeps every scheme's held-out residual in bounds; ``None`` without one.

        ``astray`` (S,) is the held-out residual of each scheme over the smallest so far.
        """
        along = {joint: _along(target, self._moves(joint)[1][:, :, 0]) for joint in self.grids}
        root, columns = target.root[:, :, None], self._columns(found)
        held = [HeldOut.of(columns * root, self.gap * target.root, folds) for folds in self.folds]
        prior = np.concatenate([self.prior, self._priors(found)])
        before = np.array([one.left(self.flat, prior) for one in held])
        seen = list(found)
        for _ in range(settings.WAVES_REFUSED):
            net_gains = [
                (self._gain(target, along[wave.joint], wave) - np.log(wave.tried), wave)
                for wave in self._peaks(target, found, seen)
            ]
            offered = [wave for gain, wave in sorted(net_gains, key=lambda item: -item[0]) if gain > 0.0]
            if not offered:
                break
            for wave in offered:
                further, more = self._wave(wave) * root, np.concatenate([prior, self._priors([wave])])
                left = astray * np.array([one.left(self.flat, more, further) for one in held]) / before
                if (left <= self.allowed_ratio).all():
                    return [*found, wave], np.maximum(left, 1.0)
                seen.append(wave)
        return None

    def _pruned(self, found: list[_Wave], target: Target) -> list[_Wave]:
        """Backward elimination of waves that gain less log evidence than the logarithm of the number tried for them."""
        kept = list(found)
        while kept:
            whole = self._columns(kept) * target.root[:, :, None]
            values, last = self.gap * target.root, whole.shape[2] - 2 * np.arange(len(kept), 0, -1)
            net_gains = _dropped(equations_of(whole), values.ravel(), last)
            for joint in {wave.joint for wave in kept}:
                way = _unit_vectors(target, self._moves(joint)[1][:, :, 0])[0]
                own = [k for k, wave in enumerate(kept) if wave.joint == joint]
                alone = _dropped(np.einsum("nm,nmk->nk", way, whole), (way * values).sum(axis=1), last[own])
                net_gains[own] = np.minimum(net_gains[own], alone)
            net_gains -= np.log([wave.tried for wave in kept])
            if net_gains.min() > 0.0:
                break
            kept.pop(int(np.argmin(net_gains)))
        return kept

    def _peaks(self, target: Target, found: Sequence[_Wave], seen: Sequence[_Wave]) -> Iterator[_Wave]:
        """Yield the peak of each joint's periodogram, and its best order among those of waves in other joints.

        Joints often have gears of one kind, so that a wave at another joint's order is one of few. Orders within a
        peak's width of a wave seen in that joint are left out.
        """
        for joint, grid in self.grids.items():
            q, moves = self._moves(joint)
            width = np.pi / float(np.ptp(q))
            free, echo = np.ones(len(grid), dtype=bool), np.zeros(len(grid), dtype=bool)
            for wave in seen:
                free &= (wave.joint != joint) | (np.abs(grid - wave.order) > width)
            for wave in found:
                echo |= (wave.joint != joint) & (np.abs(grid - wave.order) <= width)
            statistics = target.statistics(moves)
            gains = np.where(free, periodogram(statistics, q, grid), -np.inf)
            for among, tried in ((free, self.independent_waves), (free & echo, float(len(found) * len(self.grids)))):
                if among.any():
                    best = int(np.argmax(np.where(among, gains, -np.inf)))
                    order = peak(statistics, q, grid[best : best + 1]) if np.isfinite(gains[best]) else 0.0
                    if _holds(grid, order):  # what peaks beyond is no ripple
                        yield _Wave(joint, order, tried)

    def _functions(self, wave: _Wave) -> Array:
        """Sine and cosine (N, 1, 2) of a wave."""
        q, _ = self._moves(wave.joint)
        return np.stack([np.sin(wave.order * q), np.cos(wave.order * q)], axis=1)[:, None, :]

    def _wave(self, wave: _Wave) -> Array:
        """Displacements (N, m, 2) of the target by unit sine and cosine of a wave."""
        return np.asarray(self._moves(wave.joint)[1] * self._functions(wave))

    def _columns(self, found: Sequence[_Wave]) -> Array:
        """Design matrix and waves, (N, m, K + 2W), in this order."""
        return np.concatenate([self.design, *(self._wave(wave) for wave in found)], axis=2)

    def _priors(self, found: Sequence[_Wave]) -> Array:
        """Prior precisions (2W,) of the amplitudes of waves."""
        return block(self.observations, _ripple(found)).sizes ** -2.0

    def _target(self, found: Sequence[_Wave], like: Target | None = None) -> Target:
        campaign = self.observations.campaign
        relative, seen = campaign.relative_noise, seen_components(campaign)
        return Target.of(self.gap, self._columns(found), self.changed, relative, like, seen)

    def _moves(self, joint: str) -> tuple[Array, Array]:
        """Positions (N,) of a joint, and the target's displacement (N, m, 1) per unit of it (Jacobian column)."""
        j = self.observations.robot.joint_names.index(joint)
        return self.observations.q[:, j], self.observations.joint_sensitivity[:, : self.gap.shape[1], j, None]

    def _gain(self, target: Target, along: Target, wave: _Wave) -> float:
        """Log evidence of a wave: the lesser of that in all equations and in one equation a row."""
        return min(target.score(self._wave(wave)).gain, along.score(self._functions(wave)).gain)


def _dropped(columns: Array, values: Array, pairs: NDArray[np.int64]) -> Array:
    """Wald test of each pair of columns (E, K) given all others: the log evidence (W,) that dropping it costs.

    ``pairs`` (W,) are the numbers of each pair's first column. Without a pair the sum of squares is larger by β_wᵀ
    C_ww⁻¹ β_w, β the values fitted and C their covariance.
    """
    root = whitener(columns.T @ columns)
    fitted = root @ (root.T @ (columns.T @ values))
    rest = max(float(((values - columns @ fitted) ** 2).sum()), settings.TINY)
    own = np.column_stack([pairs, pairs + 1])
    inner = root[own] @ root[own].transpose(0, 2, 1)
    more = np.einsum("wi,wi->w", fitted[own], np.linalg.solve(inner, fitted[own][:, :, None])[:, :, 0])
    return np.array([bic_gain(rest + each, each, 2, len(values) - root.shape[1] + 2) for each in more])


def _ripple(waves: Sequence[_Wave]) -> JointRipple:
    found = JointRipple()
    for wave in waves:
        found = found.having(wave.joint, wave.order, wave.tried)
    return found


def _orders(q: Array, slides: bool) -> Array:
    """Wave orders (K,) of a joint's grid with at least one period in the range of its positions ``q`` (N,).

    Those of a revolute joint are no less than :data:`settings.LOWEST_RIPPLE`.
    """
    grid = orders(q, slides)
    least = 2.0 * np.pi / max(float(np.ptp(q)), settings.TINY)
    return grid[grid >= (least if slides else max(least, settings.LOWEST_RIPPLE))]


def _holds(grid: Array, order: float) -> bool:
    """Whether an order lies between the ends of a grid (K,) of orders, both included; never for an empty grid."""
    return bool(len(grid)) and bool(grid[0] <= order <= grid[-1])


def as_ripple(law: Discovered, fit: Fit) -> JointRipple | None:
    """Ripple of a fit with one wave more: that of a law that is a harmonic of its joint's own position.

    The ripple itself where it has this wave; ``None`` for other laws, where ripple is no candidate, and for orders that
    are no ripple's.
    """
    is_wave = (law.kind, law.shape, law.follows, law.of) == ("joint", "harmonic", law.place, "")
    if not is_wave or JointRipple.name not in fit.variants:
        return None
    robot, order = fit.campaign.robot, law.marks[0]
    j = robot.joint_names.index(law.place)
    grid = _orders(fit.campaign.q[:, j], robot.joint_types[j] == "prismatic")
    held = ripple_of(fit)
    known = (n for name, n in zip(held.joints, held.orders, strict=True) if name == law.place)
    if any(abs(n - order) < settings.SAME_ORDER for n in known):
        return held
    return held.having(law.place, order, law.tried) if _holds(grid, order) else None


def _unit_vectors(target: Target, moves: Array) -> tuple[Array, Array]:
    """Return the unit vectors (N, m) along a joint's displacement (N, m), weighted, and its lengths (N,)."""
    own = moves * target.root
    length = np.linalg.norm(own, axis=1)
    return own / np.where(length > 0.0, length, 1.0)[:, None], length


def _along(target: Target, moves: Array) -> Target:
    """Reduce a target to one equation a row: residual and design along the displacement (N, m) of one joint."""
    way, length = _unit_vectors(target, moves)
    basis = orthonormal(np.einsum("nm,nmr->nr", way, target.basis.reshape(*way.shape, -1)))
    white = np.einsum("nm,nm->n", way, target.white.reshape(way.shape))
    return Target(without(white, basis), length[:, None], basis)


@dataclass(frozen=True, eq=False)
class Discovery:
    """Discovered law with its probability, and alternative places and quantities, most probable first."""

    law: Discovered
    probability: float
    places: tuple[tuple[tuple[str, str], float], ...]
    quantities: tuple[tuple[str, float], ...]


def candidates(fit: Fit, number: int, happened: Sequence[Discovered]) -> tuple[Discovered, ...]:
    """Candidate laws: possible events, then the best of each scanned residual in turn by net gain, then the next.

    Scanned are the residuals of the explanation, of its laws alone, and without each effect, since known effects may
    have absorbed an unlisted cause. A hinge comes with its mirror image: the two differ by a straight line, which a
    known effect may have absorbed. A law is called ``discovered.<number>``.
    """
    sample = RowSample.of(fit)
    remainders = list(dict.fromkeys(_remainders(fit)))
    targets = [sample.target(blocks) for blocks in remainders]
    if fit.explanation.outliers.any():
        targets += [sample.target(blocks, sound=True) for blocks in remainders[:2]]
    found, _ = scan(sample.observations, targets, [effect for own in fit.variants.values() for effect in own[:1]])
    offered = [_best_laws(sample, target, own) for target, own in zip(targets, found, strict=True)]
    chosen = list(happened[: settings.LIKELY_EVENTS])
    for k in range(max(map(len, offered), default=0)):  # the first of each remainder, in turn
        chosen += [own[k] for own in offered if k < len(own)]
    named = dict.fromkeys(replace(law, name=f"{PREFIX}{number}") for law in chosen)
    compared = islice((law for law in named if not listed(sample, law)), settings.COMPARED_LAWS)
    return tuple(dict.fromkeys(side for law in compared for side in law.sides))


def listed(sample: RowSample, law: Discovered) -> bool:
    """Whether a law is collinear with a known effect in its joint, up to constants and frames."""
    if law.kind != "joint":
        return False
    own = [item for item in sample.linear.blocks if item.effect.places == (law.place,)]
    free = [item.columns for item in own if constant(item.effect, sample.observations)] + [sample.linear.frames]
    columns = equations_of(block(sample.observations, law).columns)
    length = np.linalg.norm(columns, axis=0).max()
    for item in own:
        basis = orthonormal(equations_of(np.concatenate([item.columns, *free], axis=2)))
        if np.linalg.norm(without(columns, basis), axis=0).max() < settings.ALIAS * length:
            return True
    return False


def _remainders(fit: Fit) -> Iterator[tuple[int, ...]]:
    """Yield the subsets of blocks that are projected out of the gap, one for each residual that is scanned."""
    best = fit.explanation.best.blocks
    laws = tuple(b for b in best if fit.families[b].startswith(PREFIX))
    effects = [b for b in best if b not in laws]
    yield best
    if len(effects) > 1 or fit.explanation.discrepancy.probability > settings.SMOOTH_PRIOR:
        yield laws
    if 2 < len(effects) <= settings.LEFT_OUT or (len(effects) == 2 and laws):
        yield from (tuple(b for b in best if b != out) for out in effects)


def _best_laws(sample: RowSample, target: Target, own: Sequence[Scanned]) -> list[Discovered]:
    """Laws of a residual in their best functional form, by net gain; for a segment also that of the joint at its end.

    Left out are laws whose gain of log evidence, less the logarithm of the number tried, is clearly negative.
    """
    first = [(item, shaped(sample.observations, target, item.law)) for item in _with_joints(own)]
    joints = sample.observations.robot.joint_names
    at_links = [(item, s) for item, s in first if s.law.kind == "link" and s.law.place in joints]
    if at_links:
        simpler = [replace(s.law, kind="joint") for _, s in at_links]
        gains = ScanCache(sample.observations, [target]).gains(simpler)[0]
        first += [
            (item, replace(s, law=law, gain=float(gain)))
            for (item, s), law, gain in zip(at_links, simpler, gains, strict=True)
        ]
    net_gains = [(s.gain - float(np.log(item.tried * s.tried)), item, s) for item, s in first]
    net_gains.sort(key=lambda entry: -entry[0])
    return [
        replace(s.law, tried=float(item.tried * s.tried))
        for gain, item, s in net_gains
        if gain > -settings.AMPLITUDE_REACH
    ]


def _with_joints(own: Sequence[Scanned]) -> list[Scanned]:
    """Return the best candidates, and for those at a segment the laws of the same quantity in the joint at its end."""
    first = list(own[: settings.SHAPED])
    simpler = {(i.law.place, i.law.follows) for i in first if i.law.kind == "link"}
    return first + [
        i for i in own[settings.SHAPED :] if i.law.kind == "joint" and (i.law.place, i.law.follows) in simpler
    ]


def discovered(fit: Fit) -> tuple[Discovery, ...]:
    """Laws of a fit, with posterior probabilities of their places and quantities among all compared."""
    e = fit.explanation
    laws = {b: item.effect for b, item in enumerate(e.linear.blocks) if isinstance(item.effect, Discovered)}
    found = []
    for b in e.best.blocks:
        if b in laws:
            rivals = {k: law for k, law in laws.items() if law.name == laws[b].name}
            places: dict[tuple[str, str], float] = {}
            followed: dict[str, float] = {}
            same = 0.0
            for combination, w in zip(e.combinations, e.probabilities, strict=True):
                for law in (rivals[k] for k in combination.blocks if k in rivals):
                    place = where(fit, law)
                    places[place] = places.get(place, 0.0) + float(w)
                    followed[law.follows] = followed.get(law.follows, 0.0) + float(w)
                    same += float(w) * ((place, law.follows) == (where(fit, laws[b]), laws[b].follows))
            found.append(Discovery(laws[b], min(same, 1.0), _sorted(places), _sorted(followed)))
    return tuple(found)


def _sorted(found: dict) -> tuple:  # type: ignore[type-arg]
    return tuple(sorted(found.items(), key=lambda item: -item[1]))


def where(fit: Fit, law: Discovered) -> tuple[str, str]:
    """Kind and name of a law's place; for a segment the link that carries it, not the joint at its end."""
    if law.kind != "link":
        return law.kind, law.place
    return "link", next(s.parent_link for s in fit.campaign.robot.segments if s.name == law.place)
