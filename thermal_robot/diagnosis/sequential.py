"""Sequential estimation of a fixed choice of effects: old rows as sufficient statistics, new rows one by one.

A diagnosis alternates between weights, noise, prior scales and parameters while it chooses, and ends where the choice
no longer changes. Here nothing is chosen, and the iteration goes on to its fixed point, so that old rows and new ones
in whatever order, and one batch or many, end at the same place.

Rows enter as sufficient statistics where a trust region allows. A row counts in full unless it stands in the tail
(Huber 1964), and the noise, where none is stated, is told by the median of the residuals. So a row enters the fit by
its products alone while it crosses neither Huber's threshold nor the median. With J_i the row's columns in units of the
noise, and any positive A, a step δ of the parameters moves it by at most √tr(J_i A⁻¹ J_iᵀ) √(δᵀAδ) (Cauchy and
Schwarz), and where A is that of all N rows, by √(δᵀAδ/N) in the root mean square. Rows that could cross the threshold,
or come within a few root mean squares of the median, are kept one by one; the others are summed. A row that crosses the
median all the same changes the noise by 1/N, which affects only the weights in the tail. With a stated noise that the
residual does not exceed, the median has no effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.campaign import appended
from thermal_robot.diagnosis import settings as own_settings
from thermal_robot.effects import Effect
from thermal_robot.effects.gate import checked
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import solve, whitener
from thermal_robot.inference.columns import Block, frame_columns, moved_by, unknown_frames
from thermal_robot.inference.evidence import Combination, Gram, evidence
from thermal_robot.inference.exact import corrected_observations
from thermal_robot.inference.kernels import chunks
from thermal_robot.inference.problem import Linear, Whitening, normal_equations, parameter_values
from thermal_robot.inference.registration import moved
from thermal_robot.inference.weights import Noise, distance_limit, huber_weight, judged, outlier_scale
from thermal_robot.observations import Frames


class Point(NamedTuple):
    """Linearisation point: frames, and the (P,) values of all parameters, SI."""

    frames: Frames
    values: Array


class Judge(NamedTuple):
    """Fixed model that gives new rows their weights: linearisation point, residual sigma (m,), m and rad, row count."""

    point: Point
    sigma: Array
    rows: int


@dataclass(frozen=True, eq=False)
class Choice:
    """Model that a diagnosis selected: P parameters of effects with their prior sizes, and the stated noise.

    ``blocks`` are without columns; ``rivals`` are further effects of the alternative combinations; ``measures`` is m, 3
    for positions, 6 for poses. With a ``judge`` old rows keep their weights, and new rows are weighted by the model of
    the diagnosis; without, all rows are reweighted by the present model.
    """

    blocks: tuple[Block, ...]
    rivals: tuple[Block, ...]
    measures: int
    noise: Noise
    judge: Judge | None

    def listed(self, rivals: bool) -> tuple[Block, ...]:
        """Chosen blocks, followed by the alternatives if ``rivals``."""
        return (*self.blocks, *self.rivals) if rivals else self.blocks

    def split(self, values: Array) -> list[tuple[Effect, Array]]:
        """Chosen effects, each with its part of the (P,) values."""
        parts = np.split(values, np.cumsum([len(item.sizes) for item in self.blocks], dtype=int))
        return [(item.effect, own) for item, own in zip(self.blocks, parts, strict=False)]  # no value is left over


@dataclass(frozen=True, eq=False)
class WeightedRows:
    """Measured rows with robust weights (n,), 0 where set aside, and the mask ``aside`` (n,) of those."""

    campaign: Campaign
    weights: Array
    aside: NDArray[np.bool_]

    @classmethod
    def weighed(cls, choice: Choice, campaign: Campaign) -> WeightedRows:
        """Robust weights of new rows from the diagnosis's residual scale; 1 where each fit reweights them."""
        distance2, limit = np.zeros(campaign.samples), np.inf
        if choice.judge is not None and campaign.samples:
            point, sigma, rows = choice.judge
            distance2 = ((relative_residual(campaign, point, choice) / sigma) ** 2).sum(axis=1)
            limit = distance_limit(choice.measures, rows)
        aside = distance2 > limit
        return cls(campaign, np.where(aside, 0.0, huber_weight(distance2, choice.measures)), aside)

    @classmethod
    def joined(cls, *batches: WeightedRows) -> WeightedRows:
        """Concatenate batches of rows."""
        weights, aside = ([getattr(one, name) for one in batches] for name in ("weights", "aside"))
        return cls(appended([one.campaign for one in batches]), np.concatenate(weights), np.concatenate(aside))

    def take(self, which: NDArray[np.int64] | NDArray[np.bool_] | slice) -> WeightedRows:
        """Return the rows selected by number, mask or slice."""
        numbers = np.arange(len(self.aside))[which]
        return WeightedRows(self.campaign.take(numbers), self.weights[numbers], self.aside[numbers])

    @property
    def kept(self) -> Array:
        """Squared relative noise (n, 1) or (n, m) of each row, 0 where set aside: turns products into m² and rad²."""
        relative = self.campaign.relative_noise
        return np.asarray(~self.aside[:, None] * (1.0 if relative is None else relative**2))


def linearised(rows: Campaign, point: Point, choice: Choice, *, rivals: bool = False) -> Array:
    """Design matrix (N, m, K + 1) of frames, effects, alternatives if ``rivals``; the residual is the last column.

    In m and rad, and in units of each row's own noise over that of all. Zero for parameters that these rows do not
    determine.
    """
    blocks = choice.listed(rivals)
    if not rows.samples:
        return np.zeros((0, choice.measures, len(unknown_frames(rows)) + len(joined([b.sizes for b in blocks])) + 1))
    there, columns = corrected_observations(rows, point.frames, choice.split(point.values)), []
    for item in blocks:
        known = {parameter.name: parameter for parameter in checked(item.effect, there)}
        columns.append(moved_by(there, [known.get(bare.name, bare) for bare in item.bare]))
    stack = np.concatenate([frame_columns(there)[0], *columns, there.gap[:, :, None]], axis=2)
    return stack if rows.relative_noise is None else stack / rows.relative_noise[:, :, None]


def relative_residual(rows: Campaign, point: Point, choice: Choice) -> Array:
    """Residual (N, m), m and rad, over each row's relative noise: the last column of :func:`linearised`."""
    gap = corrected_observations(rows, point.frames, choice.split(point.values)).gap
    return gap if rows.relative_noise is None else gap / rows.relative_noise


def joined(parts: Sequence[Array]) -> Array:
    """Concatenate (P,) arrays; of none, an array of length 0."""
    return np.concatenate([*parts, np.zeros(0)])


def products(stack: Array, weights: Array) -> Array:
    """Weighted Gram matrices (G, K + 1, K + 1) of columns (N, m, K + 1), of positions and, if G = 2, orientations."""
    n, m, k = stack.shape
    parts = (stack.T * np.sqrt(weights).T).T.reshape(n, m // 3, 3, k).swapaxes(0, 1).reshape(m // 3, 3 * n, k)
    return np.asarray(parts.swapaxes(1, 2) @ parts)


def carried(sums: Array, step: Array) -> Array:
    """Gram matrices (…, K + 1, K + 1) after a step (k,) of the parameters: the gap less the first k columns · step."""
    change = np.eye(sums.shape[-1])
    change[: len(step), -1] = -step
    return np.asarray(change.T @ sums @ change)


@dataclass(frozen=True, eq=False)
class Guard:
    """Trust region of the sums: how far parameters and limits may move before the weight of a summed row changes.

    Steps δ up to √(δᵀAδ) = ``reach`` are safe, A (k, k) the ``metric``, positive. In units of the noise a step of
    length 1 moves the median row by at most ``share``, and all rows by ``typical`` in the root mean square; limits may
    move as far. ``sigma`` (m,): the unit of distances. ``medians`` (G,): median distance; ``huber_threshold``: distance
    beyond which a row is down-weighted. ``quiet``: noise is stated and the residual within its slack, so that medians
    have no effect.
    """

    metric: Array
    reach: float
    share: float
    typical: float
    sigma: Array
    medians: Array
    huber_threshold: float
    quiet: bool

    def distances(self, stack: Array) -> Array:
        """Distance (N, G) of positions and of orientations from the model, in units of the noise."""
        white = (stack[:, :, -1] / self.sigma).reshape(len(stack), len(self.medians), 3)
        return np.asarray(np.linalg.norm(white, axis=2))

    def scores(self, stack: Array, weights: Array) -> Array:
        """Trust-region radius (N,) within which each row, (N, m, K + 1), keeps weight 1; −1 for rows of less weight."""
        parts = self.distances(stack)
        score = (self.huber_threshold - np.linalg.norm(parts, axis=1)) / (
            moves(stack, self.metric, self.sigma) + self.share
        )
        if not self.quiet:
            wide = 2.0 * own_settings.WIDE * self.typical  # the row and the median
            score = np.minimum(score, np.abs(parts - self.medians).min(axis=1) / wide)
        return np.where((score > 0.0) & (weights >= 1.0), score, -1.0)

    def holds(self, step: Array, sigma: Array, medians: Array, huber_threshold: float, rms: Array) -> bool:
        """Whether a fit is in the trust region: step (k,), noise, limits in its units, rms (G,) per axis, m and rad."""
        far, ratio = float(np.sqrt(step @ self.metric @ step)), sigma[::3] / self.sigma[::3]
        within = far <= self.reach and bool(
            np.abs(huber_threshold * ratio - self.huber_threshold).max() <= self.share * self.reach
        )
        if self.quiet:
            return within and bool((rms <= settings.NOISE_SLACK * sigma[::3]).all())
        apart = np.abs(medians * ratio - self.medians).max()
        return within and bool(apart <= own_settings.WIDE * self.typical * self.reach)


def moves(stack: Array, metric: Array, sigma: Array) -> Array:
    """Bound (N,) on how far a unit step in a metric (k, k) moves rows (N, m, K + 1), in noise units: Frobenius norm."""
    white = stack[:, :, : len(metric)] / sigma[:, None]
    within = white @ np.linalg.inv(np.linalg.cholesky(metric)).T
    return np.asarray(np.sqrt((within**2).sum(axis=(1, 2))))


@dataclass(frozen=True, eq=False)
class Sums:
    """Sufficient statistics of rows: Gram matrices and counts.

    ``products`` (2, G, K + 1, K + 1): of rows with weight, in the units of :func:`linearised`, and of rows not set
    aside, m and rad. ``counts`` (3,): of all rows, those with weight, those not set aside; ``below`` (G,): of rows
    nearer than the median. ``guard``: trust region in which they hold; ``None`` where weights are fixed, or no rows.
    """

    products: Array
    counts: NDArray[np.int64]
    below: NDArray[np.int64]
    guard: Guard | None

    @classmethod
    def of(cls, stack: Array, rows: WeightedRows, guard: Guard | None = None) -> Sums:
        """Sum rows to sufficient statistics: their Gram matrices from columns (N, m, K + 1), and counts."""
        below = np.zeros(stack.shape[1] // 3, dtype=np.int64)
        if guard is not None:
            below = (guard.distances(stack) < guard.medians).sum(axis=0)
        counts = np.array([len(rows.aside), (rows.weights > 0.0).sum(), (~rows.aside).sum()])
        return cls(np.stack([products(stack, own) for own in (rows.weights, rows.kept)]), counts, below, guard)

    def plus(self, other: Sums, sign: int = 1) -> Sums:
        """Add the statistics of further rows at the same point, or subtract them with ``sign`` −1."""
        names = ("products", "counts", "below")
        return replace(self, **{name: getattr(self, name) + sign * getattr(other, name) for name in names})

    def after(self, step: Array, columns: int) -> Sums:
        """Statistics with the first ``columns`` − 1 columns and the residual, after a step of the parameters."""
        own = np.r_[: columns - 1, -1]
        return replace(self, products=carried(self.products[..., own[:, None], own], step))


@dataclass(frozen=True, eq=False)
class State:
    """State of the iteration: point, step (k,) since the sums were linearised, rows kept one by one, noise.

    ``sigma`` (m,) and ``held``: whitening noise and its prior's degrees of freedom. ``leverage``: degrees of freedom
    fitted, over the number of equations. ``best``: prior scales and noise, if known. ``medians`` (G,) and
    ``huber_threshold``, in units of ``sigma``: median distance of rows, and distance beyond which one is down-weighted;
    ``steady``: whether the median lies among the rows kept one by one.
    """

    point: Point
    step: Array
    rows: WeightedRows
    sigma: Array
    held: float
    leverage: float
    best: Combination | None = None
    medians: Array = field(default_factory=lambda: np.zeros(1))
    huber_threshold: float = np.inf
    steady: bool = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Fitted(State):
    """Fit of a choice to all rows after an iteration; that of :func:`converged_fit` is converged only if ``steady``.

    ``products``: Gram matrix (k + 1, k + 1) in units of ``sigma``, the gap at the point. ``squares`` (G,): sum of
    squares, m² and rad², over ``count`` rows not set aside. ``values``: mean and covariance by effect; ``gram``: its
    linear problem.
    """

    best: Combination
    gram: Gram
    values: dict[int, tuple[Array, Array]]
    products: Array
    squares: Array
    count: int

    @property
    def noise(self) -> Array:
        """Residual standard deviation (m,) of each component, m and rad."""
        return self.sigma * self.best.noise

    @property
    def rms(self) -> Array:
        """Root mean square residual (G,) of positions and of orientations, m and rad."""
        return np.asarray(np.sqrt(self.squares / max(self.count, 1)))

    @property
    def deviations(self) -> Array:
        """Posterior standard deviations (P,) of the parameters, SI."""
        return joined([np.sqrt(np.maximum(np.diag(covariance), 0.0)) for _, covariance in self.values.values()])

    def expected(self, choice: Choice) -> Array:
        """Prior standard deviations (P,) of the parameters, SI."""
        return joined([item.sizes * self.best.scales[k] for k, item in enumerate(choice.blocks)])

    def precision(self, prior: Array, frames: float) -> Array:
        """Posterior precision (k, k) of frames and parameters, SI, for prior deviations (P,) and that of the frames."""
        found = self.products[:-1, :-1] / self.best.noise**2
        return np.asarray(found + np.diag(np.r_[np.full(len(found) - len(prior), frames), prior] ** -2.0))


def converged_fit(choice: Choice, sums: Sums, begin: State) -> Fitted:
    """Fit a choice to summed and single rows by fixed-point iteration, from any start; not ``steady`` if it fails."""
    for _ in range(own_settings.REST_ROUNDS):
        found, size = _round(choice, sums, begin)
        before = np.e * found.best.noise if begin.best is None else begin.best.noise
        still = max(abs(found.leverage - begin.leverage), abs(np.log(found.best.noise / before))) < own_settings.AT_REST
        begin = found
        if size < own_settings.AT_REST and still:
            return found
    return replace(found, steady=False)


def _round(choice: Choice, sums: Sums, begin: State) -> tuple[Fitted, float]:
    """One iteration: weights, prior scales, noise, Gauss-Newton step; also the step's length in units of the noise."""
    campaign, point = begin.rows.campaign, begin.point
    stack, names = linearised(campaign, point, choice), unknown_frames(campaign)
    state, flat = weighed(choice, sums, begin, stack[:, :, -1]), len(names)
    total = sums.after(state.step, stack.shape[2]).plus(Sums.of(stack, state.rows))
    white, linear, gram = normal(choice, total, state)
    best = evidence(gram, tuple(range(len(choice.blocks))), 0.0, begin.best, settled=own_settings.AT_REST)
    values = parameter_values(linear, gram, best)
    mean = joined([own for own, _ in values.values()])
    change = mean - point.values
    left = white[:flat, -1] - white[:flat, flat:-1] @ change
    step = np.concatenate([solve(white[:flat, :flat], left), change])
    size = float(np.sqrt(max(step @ white[:-1, :-1] @ step, 0.0))) / best.noise
    leverage = float(min((best.effective + flat) / max(gram.equations + flat, 1), settings.MOST_LEVERAGE))
    known: dict[str, Any] = {own.name: getattr(state, own.name) for own in fields(State)}
    known |= {"point": Point(moved(point.frames, step[:flat], names), mean), "step": begin.step + step}
    known |= {"leverage": leverage, "best": best}
    fitted = Fitted(
        **known,
        gram=gram,
        values=values,
        products=carried(white, step),
        squares=carried(total.products[1], step)[:, -1, -1],
        count=int(total.counts[2]),
    )
    return fitted, size


def normal(choice: Choice, total: Sums, state: State, rivals: bool = False) -> tuple[Array, Linear, Gram]:
    """Whitened Gram matrix of all rows at a point, and the linear problem with the frames projected out."""
    white, flat = np.tensordot(state.sigma[::3] ** -2.0, total.products[0], 1), len(unknown_frames(state.rows.campaign))
    full = carried(white, np.r_[np.zeros(flat), -state.point.values])
    nothing = np.zeros((0, choice.measures, flat + 1))
    linear = Linear(nothing[:, :, 0], nothing[:, :, 1:], choice.listed(rivals))
    whitening = Whitening(state.rows.weights, state.sigma, state.held)
    return white, linear, normal_equations(linear, whitening, full, int(total.counts[1]) * choice.measures)


def weighed(choice: Choice, sums: Sums, state: State, gap: Array) -> State:
    """Set Huber's weights (1964) of the single rows from their residual (n, m), and the noise from all rows' median."""
    if choice.judge is not None:
        return replace(state, steady=True)
    count, measures, rows, guard = len(gap), choice.measures, state.rows, sums.guard
    total = int(sums.counts[0]) + count
    if guard is not None and guard.quiet:
        medians, steady = guard.medians * guard.sigma[::3], True
    else:  # it is known as long as it lies among the rows that are kept one by one
        ordered = np.sort((gap.reshape(count, -1, 3) ** 2).sum(axis=2), axis=0)
        pair = np.array([(total - 1) // 2, total // 2])[:, None] - sums.below
        steady = bool((pair >= 0).all() and (pair < count).all())
        medians = np.sqrt(np.take_along_axis(ordered, np.clip(pair, 0, count - 1), axis=0).mean(axis=0))
    measured = np.maximum(axis_noise(medians, state.leverage), settings.ROUNDING)
    stated = replace(choice.noise, relative=rows.campaign.relative_noise)
    sigma, held, distance2 = judged(gap, measured, stated, state.leverage, measures)
    aside = distance2 > distance_limit(measures, total)
    rows = WeightedRows(rows.campaign, np.where(aside, 0.0, huber_weight(distance2, measures)), aside)
    edge = huber_threshold(measures, state.leverage, sigma, outlier_scale(measured, sigma))
    return replace(
        state, rows=rows, sigma=sigma, held=held, medians=medians / sigma[::3], huber_threshold=edge, steady=steady
    )


def axis_noise(medians: Array, leverage: float) -> Array:
    """One sigma per axis (G,), from the median distance of three normal axes, corrected for leverage."""
    return np.asarray(medians / np.sqrt(float(chdtri(3, 0.5)) * (1.0 - leverage)))


def huber_threshold(measures: int, leverage: float, sigma: Array, scale: Array) -> float:
    """Huber's threshold: the distance, in units of the noise, beyond which a row is down-weighted (a χ² quantile)."""
    return float(np.sqrt(chdtri(measures, settings.BEND_LEVEL) * (1.0 - leverage)) * (scale / sigma).min())


@dataclass(frozen=True, eq=False)
class Sequential:
    """Sequential estimate: fit of a choice, sums of old rows, and rows kept one by one.

    ``sums`` are of rows that are not revisited, linearised at ``anchor``; ``fitted`` is the fit to all, and holds the
    rows kept one by one. ``batches`` are read only when the sums must be formed anew; ``aside`` is the mask of the last
    batch's rows set aside; ``anew`` tells whether the last rows made it necessary to revisit all.
    """

    choice: Choice
    anchor: Point
    sums: Sums
    fitted: Fitted
    batches: tuple[WeightedRows, ...]
    aside: NDArray[np.bool_]
    anew: bool = False

    @classmethod
    def of(cls, choice: Choice, batches: tuple[WeightedRows, ...], begin: State, anew: bool = False) -> Sequential:
        """Fit a choice to rows, then sum the rows that need not be revisited."""
        rows = WeightedRows.joined(*batches)
        begin = replace(begin, step=np.zeros_like(begin.step), rows=rows)
        aside, kept, sums = rows.aside.copy(), np.arange(len(rows.aside)), summed(choice, rows.take(slice(0)), begin)
        if len(kept) > 2 * own_settings.KEPT:
            sums, kept = split(choice, begin)
        fitted = converged_fit(choice, sums, replace(begin, rows=rows.take(kept)))
        aside[kept] = fitted.rows.aside  # rows in the sums are not set aside, or keep what they had
        return cls(choice, begin.point, sums, fitted, batches, aside[len(aside) - len(batches[-1].aside) :], anew)

    @property
    def samples(self) -> int:
        """Number of rows, summed ones included."""
        return int(self.sums.counts[0]) + len(self.fitted.rows.aside)

    def plus(self, new: WeightedRows) -> Sequential:
        """Add rows and refit; all rows are revisited only if the sums do not hold, or too many are kept one by one."""
        batches, old = (*self.batches, new), len(self.fitted.rows.aside)
        fitted = converged_fit(
            self.choice, self.sums, replace(self.fitted, rows=WeightedRows.joined(self.fitted.rows, new))
        )
        grown = replace(self, fitted=fitted, batches=batches, aside=fitted.rows.aside[old:], anew=False)
        summing = bool(self.sums.counts[0])
        holds = not summing or (fitted.steady and self._holds(fitted))
        if summing and holds:
            grown = grown._take_in(old)
        if holds and len(grown.fitted.rows.aside) <= 2 * own_settings.KEPT:
            return grown
        return Sequential.of(self.choice, batches, fitted, anew=summing)

    def _take_in(self, old: int) -> Sequential:
        """Move those of the last rows that need not be revisited into the sums."""
        rows, guard = self.fitted.rows, self.sums.guard
        own = rows.take(slice(old, None))
        stack, safe = linearised(own.campaign, self.anchor, self.choice, rivals=True), np.ones(len(own.aside), bool)
        if guard is not None:
            safe = guard.scores(stack, own.weights) >= guard.reach
        sums = self.sums.plus(Sums.of(stack[safe], own.take(safe), guard))
        kept = rows.take(np.r_[np.ones(old, bool), ~safe])
        return replace(self, sums=sums, fitted=replace(self.fitted, rows=kept))

    def _holds(self, fitted: Fitted) -> bool:
        """Whether summed rows keep their weights, and the curvature up to the new point is negligible."""
        guard, axis = self.sums.guard, fitted.rms / np.sqrt(3.0)
        near = guard is None or guard.holds(fitted.step, fitted.sigma, fitted.medians, fitted.huber_threshold, axis)
        return near and self._bent(fitted) < own_settings.CURVED

    def _bent(self, fitted: Fitted) -> float:
        """Largest bias of a parameter, in standard deviations, by the curvature of the summed rows.

        It is estimated from the rows kept one by one: the second-order part of their gap adds up over all rows; the
        change of their columns meets independent residuals, so that its sum grows as the square root of the rows.
        """
        old, k = self.fitted.rows, len(fitted.step)
        here, there = (linearised(old.campaign, point, self.choice) for point in (self.anchor, fitted.point))
        curved, turned = here.copy(), there - here
        curved[:, :, -1] = turned[:, :, -1] + here[:, :, :-1] @ fitted.step
        turned[:, :, -1] = there[:, :, -1]
        root, times = whitener(fitted.products[:-1, :-1]), self.sums.counts[1] / max(len(here), 1)
        unit = np.sqrt((root**2).sum(axis=1)).clip(settings.TINY) * fitted.best.noise
        shift = np.zeros(k)
        for stack, factor in ((curved, times), (turned, np.sqrt(times))):
            along = np.tensordot(fitted.sigma[::3] ** -2.0, products(stack, old.weights), 1)[:k, -1] * factor
            shift += np.abs(root @ (root.T @ along)) / unit
        return float(shift.max(initial=0.0))


def summed(choice: Choice, rows: WeightedRows, at: State, guard: Guard | None = None) -> Sums:
    """Linearise rows at the point of a state and sum them to sufficient statistics."""
    return Sums.of(linearised(rows.campaign, at.point, choice, rivals=True), rows, guard)


def split(choice: Choice, begin: State) -> tuple[Sums, NDArray[np.int64]]:
    """Sum many rows, linearised near their fit (``begin``), and list the numbers (n,) of the rows kept singly."""
    rows, guard = _guarded(choice, begin)
    total, scores = summed(choice, rows.take(slice(0)), begin, guard), []
    for part in chunks(len(rows.aside)):
        own = rows.take(part)
        stack = linearised(own.campaign, begin.point, choice, rivals=True)
        total = total.plus(Sums.of(stack, own, guard))
        scores.append(np.zeros(len(stack)) if guard is None else guard.scores(stack, own.weights))
    kept, reach = _kept(np.concatenate(scores), guard)
    left = total.plus(summed(choice, rows.take(kept), begin, guard), -1)
    return replace(left, guard=None if guard is None else replace(guard, reach=reach)), kept


def _sample(rows: int) -> NDArray[np.int64]:
    """Systematic sample of row numbers, evenly spaced, at most ``KEPT`` of so many."""
    return np.linspace(0, rows - 1, min(own_settings.KEPT, rows)).astype(np.int64)


def _kept(scores: Array, guard: Guard | None) -> tuple[NDArray[np.int64], float]:
    """Numbers of the rows with the smallest radii, kept one by one, and the radius within which the others are safe."""
    if guard is None:
        return _sample(len(scores)), 0.0
    count = min(max(own_settings.KEPT, int((scores < 0.0).sum()) + own_settings.KEPT // 2), len(scores))
    order = np.argsort(scores, kind="stable")
    return np.sort(order[:count]), float(scores[order[min(count, len(scores) - 1)]])


def _guarded(choice: Choice, begin: State) -> tuple[WeightedRows, Guard | None]:
    """Reweighted rows, and the trust region of their sums with radius still 0; ``None`` where weights are fixed."""
    rows = begin.rows
    if choice.judge is not None:
        return rows, None
    gap = relative_residual(rows.campaign, begin.point, choice)
    found = weighed(choice, summed(choice, rows.take(slice(0)), begin), begin, gap)
    some = rows.take(_sample(len(rows.aside)))
    stack, share = linearised(some.campaign, begin.point, choice), len(rows.aside) / len(some.aside)
    metric = np.tensordot(found.sigma[::3] ** -2.0, products(stack, np.ones(len(stack))), 1)[:-1, :-1] * share
    prior = joined([item.sizes for item in choice.blocks])
    metric += np.diag(np.r_[np.full(len(metric) - len(prior), own_settings.LOOSE), prior] ** -2.0)
    left = axis_noise(found.medians * found.sigma[::3], begin.leverage)
    quiet = found.held > 0.0 and bool((left < settings.NOISE_SLACK * found.sigma[::3]).all())
    share, typical = float(np.median(moves(stack, metric, found.sigma))), len(rows.aside) ** -0.5
    return found.rows, Guard(metric, 0.0, share, typical, found.sigma, found.medians, found.huber_threshold, quiet)
