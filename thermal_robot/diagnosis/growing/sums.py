"""Rows that need not be looked at again: their sums of products, and how far the model may move before they must be.

In the fit of a diagnosis a row counts in full unless it stands in the tail, and the noise, where none is stated, is
told by the median of what rows leave. So a row bears on the fit by its products alone as long as it crosses neither the
edge of the tail nor the median. With J_i the row's columns in units of the noise, and any positive A, a step δ of the
parameters moves it by at most √tr(J_i A⁻¹ J_iᵀ) √(δᵀAδ) (Cauchy and Schwarz), and where A is that of all N rows, by
√(δᵀAδ/N) in the root mean square. Rows that might reach the tail at most, or the median by a few root mean squares, are
kept one by one; the others are in the sums. One that crosses the median all the same moves the noise by 1/N of itself,
and with it nothing but the weights in the tail. Where noise is stated, and no more than it remains, the median bears on
nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice, Point
from thermal_robot.effects.gate import checked
from thermal_robot.inference import settings as chosen
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.columns import Block, frame_columns, moved_by
from thermal_robot.inference.gauss_newton import corrected_observations
from thermal_robot.observations import Observations


@dataclass(frozen=True, eq=False)
class Seen:
    """N rows at a point: ``stack`` (N, m, K + 1) of the frames, chosen effects, rivals if asked for, and the gap."""

    campaign: Campaign
    stack: Array
    names: tuple[str, ...]

    @classmethod
    def at(cls, campaign: Campaign, point: Point, choice: Choice, *, rivals: bool = False) -> Seen:
        """Run the kinematics of some rows with the effects at work."""
        if not campaign.samples:
            return cls._nothing(campaign, point, choice, rivals)
        there = corrected_observations(campaign, point.frames, choice.split(point.values))
        flat, names = frame_columns(there)
        asked = (*choice.blocks, *(choice.rivals if rivals else ()))
        columns = [_columns(there, item) for item in asked]
        return cls(campaign, np.concatenate([flat, *columns, there.gap[:, :, None]], axis=2), names)

    @classmethod
    def _nothing(cls, campaign: Campaign, point: Point, choice: Choice, rivals: bool) -> Seen:
        asked = (*choice.blocks, *(choice.rivals if rivals else ()))
        names = frame_names(campaign)
        width = len(names) + sum(len(item.sizes) for item in asked) + 1
        return cls(campaign, np.zeros((0, choice.measures, width)), names)

    @property
    def gap(self) -> Array:
        """(N, m) measured − predicted at the point, m and rad."""
        return self.stack[:, :, -1]

    @property
    def alike(self) -> Array:
        """(N, m, K + 1) columns and gap, in units of each row's own noise over that of all."""
        relative = self.campaign.relative_noise
        return self.stack if relative is None else self.stack / relative[:, :, None]


def _columns(there: Observations, item: Block) -> Array:
    """(N, m, P) columns of an effect's parameters; zero for those of which these rows tell nothing."""
    known = {parameter.name: parameter for parameter in checked(item.effect, there)}
    told = [k for k, parameter in enumerate(item.bare) if parameter.name in known]
    found = np.zeros((there.campaign.samples, 6 if there.campaign.measures == "pose" else 3, len(item.bare)))
    found[:, :, told] = moved_by(there, [known[item.bare[k].name] for k in told])
    return found


def frame_names(campaign: Campaign) -> tuple[str, ...]:
    """Return what the columns of the unknown frames are (:func:`~thermal_robot.inference.columns.frame_columns`)."""
    measures = 6 if campaign.measures == "pose" else 3
    tool = not campaign.tool_known and campaign.simulated_position is None
    return (*("base",) * (0 if campaign.base_known else 6), *("tool",) * (measures if tool else 0))


def products(rows: Array, weights: Array) -> Array:
    """(G, K + 1, K + 1) products of weighed rows (N, m, K + 1), positions and orientations apart."""
    groups = rows.shape[1] // 3
    found = np.zeros((groups, rows.shape[2], rows.shape[2]))
    for own, part in zip(found, np.split(rows * np.sqrt(weights)[:, None, None], groups, axis=1), strict=True):
        flat = equations_of(part)
        own += flat.T @ flat
    return found


def carried(sums: Array, step: Array) -> Array:
    """Return products (…, K + 1, K + 1) with (k,) times the first columns taken from the last: the gap after a step."""
    change = np.eye(sums.shape[-1])
    change[: len(step), -1] = -step
    return np.asarray(change.T @ sums @ change)


Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Guard:
    """How far parameters and limits may move while every row in the sums stays on its side of each limit.

    Steps up to √(δᵀAδ) = ``reach`` are safe, A (k, k) the ``metric``, positive. ``share`` and ``typical``: how far a
    step of 1 moves a row, at most and in the root mean square, in units of the noise, of the median row and over all;
    limits may move by as much beside. ``sigma`` (m,): the unit of distances. ``medians`` (G,) and ``bend``: median
    distance, and that from which on a row is in the tail. ``quiet``: noise is stated, and clearly less than its slack
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

    def scores(self, rows: Array, weights: Array) -> Array:
        """(N,) the reach up to which each of the rows at the point of the sums, (N, m, K + 1), is safe; −1 for none."""
        groups = len(self.medians)
        parts = np.sqrt(((rows[:, :, -1] / self.sigma) ** 2).reshape(len(rows), groups, 3).sum(axis=2))
        tail = (self.bend - np.sqrt((parts**2).sum(axis=1))) / (self.moves(rows) + self.share)
        if not self.quiet:
            wide = 2.0 * settings.WIDE * self.typical  # the row and the median
            tail = np.minimum(tail, np.abs(parts - self.medians).min(axis=1) / wide)
        return np.where((tail > 0.0) & (weights >= 1.0), tail, -1.0)

    def moves(self, rows: Array) -> Array:
        """(N,) how far a unit of reach moves each of the rows (N, m, K + 1) at most, in units of the noise."""
        white = rows[:, :, : len(self.metric)] / self.sigma[:, None]
        within = white @ np.linalg.inv(np.linalg.cholesky(self.metric)).T
        return np.asarray(np.sqrt((within**2).sum(axis=(1, 2))))

    def holds(self, step: Array, sigma: Array, medians: Array, bend: float, rms: Array) -> bool:
        """Tell whether a fit is within reach: step (k,), noise, limits in its units, rms (G,) per axis, m and rad."""
        far, ratio = float(np.sqrt(step @ self.metric @ step)), sigma[::3] / self.sigma[::3]
        within = far <= self.reach and bool(np.abs(bend * ratio - self.bend).max() <= self.share * self.reach)
        if self.quiet:
            return within and bool((rms <= chosen.NOISE_SLACK * sigma[::3]).all())
        apart = np.abs(medians * ratio - self.medians).max()
        return within and bool(apart <= settings.WIDE * self.typical * self.reach)


@dataclass(frozen=True, eq=False)
class Sums:
    """Products of rows, with what must be known of them beside.

    ``weighed`` (G, K + 1, K + 1): of rows with weight, positions and orientations apart, in units of each row's own
    noise over that of all, columns and gap at the point of linearisation; ``plain``: of rows not set aside, m and rad.
    ``rows``, ``used`` and ``kept``: how many there are, have weight, are not set aside; ``below`` (G,): nearer than the
    median. ``guard`` says how far it holds; ``None`` where rows keep their weights, or there are none.
    """

    weighed: Array
    plain: Array
    rows: int
    used: int
    kept: int
    below: NDArray[np.int64]
    guard: Guard | None

    @classmethod
    def empty(cls, width: int, groups: int) -> Sums:
        """Return the sums of no rows, with K + 1 columns."""
        nothing = np.zeros((groups, width, width))
        return cls(nothing, nothing, 0, 0, 0, np.zeros(groups, dtype=np.int64), None)

    def plus(self, rows: Array, alike: Array, weights: Array, aside: Mask) -> Sums:
        """Return the sums with further rows (N, m, K + 1) at the same point, their weights, and which are set aside."""
        below = self.below
        if self.guard is not None:
            parts = ((alike[:, :, -1] / self.guard.sigma) ** 2).reshape(len(rows), len(below), 3).sum(axis=2)
            below = below + (parts < self.guard.medians**2).sum(axis=0)
        return replace(
            self,
            weighed=self.weighed + products(alike, weights),
            plain=self.plain + products(rows, (~aside).astype(float)),
            rows=self.rows + len(rows),
            used=self.used + int((weights > 0).sum()),
            kept=self.kept + int((~aside).sum()),
            below=below,
        )


def bend(measures: int, leverage: float, sigma: Array, scale: Array) -> float:
    """Return the distance, in units of the noise, from which on a row counts less; of two parts the nearer one's."""
    return float(np.sqrt(chdtri(measures, chosen.BEND_LEVEL) * (1.0 - leverage)) * (scale / sigma).min())
