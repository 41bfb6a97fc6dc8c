"""Sufficient statistics of rows in a robust fit, and the trust region in which they stand for their rows.

A row counts in full unless it stands in the tail (Huber 1964), and the noise, where none is stated, is told by the
median of the residuals. So a row bears on the fit by its products alone as long as it crosses neither the bend of its
weight nor the median. With J_i the row's columns in units of the noise, and any positive A, a step δ of the parameters
moves it by at most √tr(J_i A⁻¹ J_iᵀ) √(δᵀAδ) (Cauchy and Schwarz), and where A is that of all N rows, by √(δᵀAδ/N) in
the root mean square. Rows that might reach the bend at most, or the median by a few root mean squares, are kept one by
one; the others are summed. One that crosses the median all the same moves the noise by 1/N of itself, and with it
nothing but the weights in the tail. Where noise is stated, and no more than it remains, the median bears on nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.campaign import appended
from thermal_robot.effects import Effect
from thermal_robot.effects.gate import checked
from thermal_robot.inference import settings
from thermal_robot.inference.columns import Block, frame_columns, moved_by, unknown_frames
from thermal_robot.inference.gauss_newton import corrected_observations
from thermal_robot.inference.robust import Noise, distance_limit, tail_weight
from thermal_robot.observations import Frames

WIDE = 2.0
"""Root mean squares of the rows' moves by which rows stand off the median that are not kept one by one: of the few that
move further, as many cross it one way as the other."""


class Point(NamedTuple):
    """Frames, and the (P,) values of all parameters, SI, at which rows are linearised."""

    frames: Frames
    values: Array


class Judge(NamedTuple):
    """The diagnosis's model, by which new rows are weighed: (m,) one sigma of its residual, m and rad, its rows."""

    point: Point
    sigma: Array
    rows: int


@dataclass(frozen=True, eq=False)
class Choice:
    """The model that a diagnosis selected: P parameters of effects with their prior sizes, and the stated noise.

    ``blocks`` are without columns; ``rivals`` are further effects of combinations that were nearly as probable;
    ``measures`` is m, 3 for positions, 6 for poses. With a ``judge`` rows keep the weight that they had, and new ones
    get theirs by the model of the diagnosis; without, every row is weighed by its distance from the present model.
    """

    blocks: tuple[Block, ...]
    rivals: tuple[Block, ...]
    measures: int
    noise: Noise
    judge: Judge | None

    def listed(self, rivals: bool) -> tuple[Block, ...]:
        """Return the chosen blocks, and the rivals if they are asked for."""
        return (*self.blocks, *self.rivals) if rivals else self.blocks

    def split(self, values: Array) -> list[tuple[Effect, Array]]:
        """Return each chosen effect with its part of (P,) values."""
        parts = np.split(values, np.cumsum([len(item.sizes) for item in self.blocks], dtype=int))
        return [(item.effect, own) for item, own in zip(self.blocks, parts, strict=False)]  # no value is left over


@dataclass(frozen=True, eq=False)
class Rows:
    """Measured rows (n,) with their robust weights, 0 where set aside, and which are."""

    campaign: Campaign
    weights: Array
    aside: NDArray[np.bool_]

    @classmethod
    def weighed(cls, choice: Choice, campaign: Campaign) -> Rows:
        """Weigh new rows by the diagnosis's model; in full where each fit weighs them anew."""
        distance2, limit = np.zeros(campaign.samples), np.inf
        if choice.judge is not None and campaign.samples:
            point, sigma, rows = choice.judge
            distance2 = ((residual(campaign, point, choice) / sigma) ** 2).sum(axis=1)
            limit = distance_limit(choice.measures, rows)
        aside = distance2 > limit
        return cls(campaign, np.where(aside, 0.0, tail_weight(distance2, choice.measures)), aside)

    @classmethod
    def joined(cls, *batches: Rows) -> Rows:
        """Return several batches as one."""
        weights, aside = ([getattr(one, name) for one in batches] for name in ("weights", "aside"))
        return cls(appended([one.campaign for one in batches]), np.concatenate(weights), np.concatenate(aside))

    def take(self, which: NDArray[np.int64] | NDArray[np.bool_] | slice) -> Rows:
        """Return some of the rows."""
        numbers = np.arange(len(self.aside))[which]
        return Rows(self.campaign.take(numbers), self.weights[numbers], self.aside[numbers])

    @property
    def kept(self) -> Array:
        """(n, 1) or (n, m) square of each row's relative noise, 0 where set aside: turns products into m² and rad²."""
        relative = self.campaign.relative_noise
        return np.asarray(~self.aside[:, None] * (1.0 if relative is None else relative**2))


def linearised(rows: Campaign, point: Point, choice: Choice, *, rivals: bool = False) -> Array:
    """(N, m, K + 1) design matrix of frames, chosen effects and rivals if asked for; the residual is the last column.

    In m and rad, and in units of each row's own noise over that of all. Zero for parameters of which no row tells.
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


def residual(rows: Campaign, point: Point, choice: Choice) -> Array:
    """(N, m) the last column of :func:`linearised` alone."""
    gap = corrected_observations(rows, point.frames, choice.split(point.values)).gap
    return gap if rows.relative_noise is None else gap / rows.relative_noise


def joined(parts: Sequence[Array]) -> Array:
    """(P,) arrays end to end, of length 0 where there are none."""
    return np.concatenate([*parts, np.zeros(0)])


def products(stack: Array, weights: Array) -> Array:
    """(G, K + 1, K + 1) products of columns (N, m, K + 1) at weights (N,) or (N, m), of positions and orientations."""
    n, m, k = stack.shape
    parts = (stack.T * np.sqrt(weights).T).T.reshape(n, m // 3, 3, k).swapaxes(0, 1).reshape(m // 3, 3 * n, k)
    return np.asarray(parts.swapaxes(1, 2) @ parts)


def carried(sums: Array, step: Array) -> Array:
    """Return products (…, K + 1, K + 1) with (k,) times the first columns taken from the last: the gap after a step."""
    change = np.eye(sums.shape[-1])
    change[: len(step), -1] = -step
    return np.asarray(change.T @ sums @ change)


@dataclass(frozen=True, eq=False)
class Guard:
    """Trust region: how far parameters and limits may move while each summed row stays on its side of each limit.

    Steps up to √(δᵀAδ) = ``reach`` are safe, A (k, k) the ``metric``, positive. ``share`` and ``typical``: how far a
    step of 1 moves a row, at most and in the root mean square, in units of the noise, of the median row and over all;
    limits may move by as much beside. ``sigma`` (m,): the unit of distances. ``medians`` (G,) and ``bend``: median
    distance, and that from which on a row is in the tail. ``quiet``: noise is stated, and no more than its slack
    remains, so that medians bear on nothing.
    """

    metric: Array
    reach: float
    share: float
    typical: float
    sigma: Array
    medians: Array
    bend: float
    quiet: bool

    def distances(self, stack: Array) -> Array:
        """(N, G) distance of positions and of orientations from the model, in units of the noise."""
        white = (stack[:, :, -1] / self.sigma).reshape(len(stack), len(self.medians), 3)
        return np.asarray(np.linalg.norm(white, axis=2))

    def scores(self, stack: Array, weights: Array) -> Array:
        """(N,) the reach up to which each of the rows at the point of the sums, (N, m, K + 1), is safe; −1 for none."""
        parts = self.distances(stack)
        score = (self.bend - np.linalg.norm(parts, axis=1)) / (moves(stack, self.metric, self.sigma) + self.share)
        if not self.quiet:
            wide = 2.0 * WIDE * self.typical  # the row and the median
            score = np.minimum(score, np.abs(parts - self.medians).min(axis=1) / wide)
        return np.where((score > 0.0) & (weights >= 1.0), score, -1.0)

    def holds(self, step: Array, sigma: Array, medians: Array, bend: float, rms: Array) -> bool:
        """Tell whether a fit is within reach: step (k,), noise, limits in its units, rms (G,) per axis, m and rad."""
        far, ratio = float(np.sqrt(step @ self.metric @ step)), sigma[::3] / self.sigma[::3]
        within = far <= self.reach and bool(np.abs(bend * ratio - self.bend).max() <= self.share * self.reach)
        if self.quiet:
            return within and bool((rms <= settings.NOISE_SLACK * sigma[::3]).all())
        apart = np.abs(medians * ratio - self.medians).max()
        return within and bool(apart <= WIDE * self.typical * self.reach)


def moves(stack: Array, metric: Array, sigma: Array) -> Array:
    """(N,) how far a unit step in a metric (k, k) moves each row (N, m, K + 1) at most, in units of the noise."""
    white = stack[:, :, : len(metric)] / sigma[:, None]
    within = white @ np.linalg.inv(np.linalg.cholesky(metric)).T
    return np.asarray(np.sqrt((within**2).sum(axis=(1, 2))))


@dataclass(frozen=True, eq=False)
class Sums:
    """Sufficient statistics: the products of rows, and what must be counted beside.

    ``products`` (2, G, K + 1, K + 1): of rows with weight, in the units of :func:`linearised`, and of rows not set
    aside, m and rad. ``counts`` (3,): how many there are, have weight, are not set aside; ``below`` (G,): nearer than
    the median. ``guard`` says how far it holds; ``None`` where rows keep their weights, or there are none.
    """

    products: Array
    counts: NDArray[np.int64]
    below: NDArray[np.int64]
    guard: Guard | None

    @classmethod
    def of(cls, stack: Array, rows: Rows, guard: Guard | None = None) -> Sums:
        """Return the sums of rows with their columns (N, m, K + 1) at the point of linearisation."""
        below = np.zeros(stack.shape[1] // 3, dtype=np.int64)
        if guard is not None:
            below = (guard.distances(stack) < guard.medians).sum(axis=0)
        counts = np.array([len(rows.aside), (rows.weights > 0.0).sum(), (~rows.aside).sum()])
        return cls(np.stack([products(stack, own) for own in (rows.weights, rows.kept)]), counts, below, guard)

    def plus(self, other: Sums, sign: int = 1) -> Sums:
        """Return the sums with further rows at the same point, or without them where ``sign`` is −1."""
        names = ("products", "counts", "below")
        return replace(self, **{name: getattr(self, name) + sign * getattr(other, name) for name in names})

    def after(self, step: Array, columns: int) -> Sums:
        """Return the sums of some columns, the first ones and the residual, after a step of the parameters."""
        own = np.r_[: columns - 1, -1]
        return replace(self, products=carried(self.products[..., own[:, None], own], step))
