"""A diagnosis that grows: its rows as sums and a few kept one by one, and the fit of its choice to all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.campaign.campaign import appended
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice, Point, together
from thermal_robot.diagnosis.growing.settled import Begin, Fitted, Single, settled, weighed
from thermal_robot.diagnosis.growing.sums import Guard, Seen, Sums, frame_names, products
from thermal_robot.inference import settings as chosen
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.gauss_newton import corrected_observations

Rows = NDArray[np.int64]


def end_to_end(batches: Sequence[Single]) -> Single:
    """Return several batches of rows as one."""
    return Single(
        appended([one.campaign for one in batches]),
        np.concatenate([one.weights for one in batches]),
        np.concatenate([one.aside for one in batches]),
    )


def some(rows: Single, which: Rows) -> Single:
    """Return some of the rows."""
    return Single(rows.campaign.take(which), rows.weights[which], rows.aside[which])


def split(choice: Choice, rows: Single, begin: Begin) -> tuple[Sums, Rows]:
    """Form the sums of many rows, linearised near their fit (``begin``); with the numbers (n,) of the other rows."""
    rows, guard = _weighed(choice, rows, begin)
    total = Sums.empty(_width(choice, rows), choice.measures // 3)
    total, scores = replace(total, guard=guard), []
    for part in _parts(rows.campaign.samples):
        own = some(rows, part)
        seen = Seen.at(own.campaign, begin.point, choice, rivals=True)
        total = total.plus(seen.stack, seen.alike, own.weights, own.aside)
        scores.append(np.zeros(len(part)) if guard is None else guard.scores(seen.alike, own.weights))
    kept, reach = _kept(np.concatenate(scores), guard)
    own = some(rows, kept)
    seen = Seen.at(own.campaign, begin.point, choice, rivals=True)
    left = _less(total, Sums.empty(_width(choice, rows), choice.measures // 3), seen, own, guard)
    return replace(left, guard=None if guard is None else replace(guard, reach=reach)), kept


def _width(choice: Choice, rows: Single) -> int:
    """Return K + 1, the columns of frames, chosen effects, rivals and gap."""
    return len(frame_names(rows.campaign)) + choice.count + sum(len(item.sizes) for item in choice.rivals) + 1


def _less(total: Sums, nothing: Sums, seen: Seen, own: Single, guard: Guard | None) -> Sums:
    """Return the sums without some rows."""
    taken = replace(nothing, guard=guard).plus(seen.stack, seen.alike, own.weights, own.aside)
    names = ("weighed", "plain", "rows", "used", "kept", "below")
    return replace(total, **{name: getattr(total, name) - getattr(taken, name) for name in names})


def _kept(scores: Array, guard: Guard | None) -> tuple[Rows, float]:
    """Return which rows are kept one by one, and up to which reach the others are safe."""
    if guard is None:
        return np.linspace(0, len(scores) - 1, min(settings.SAMPLED, len(scores))).astype(np.int64), 0.0
    tail = int((scores < 0.0).sum())
    count = min(max(settings.KEPT, tail + settings.KEPT // 2), len(scores))
    order = np.argsort(scores, kind="stable")
    reach = scores[order[count]] if count < len(scores) else scores[order[-1]]
    return np.sort(order[:count]), float(reach)


def _weighed(choice: Choice, rows: Single, begin: Begin) -> tuple[Single, Guard | None]:
    """Weigh all rows at the point, and say what holds them."""
    if not choice.judged:
        return rows, None
    gap = np.concatenate([_gap(choice, rows, part, begin.point) for part in _parts(rows.campaign.samples)])
    found = weighed(choice, Sums.empty(1, choice.measures // 3), rows, gap, begin)
    sample = np.linspace(0, len(gap) - 1, min(settings.SAMPLED, len(gap))).astype(np.int64)
    seen = Seen.at(rows.campaign.take(sample), begin.point, choice)
    white = np.einsum("g,gij->ij", found.sigma[::3] ** -2.0, products(seen.alike, np.ones(len(sample))))[:-1, :-1]
    white = white * (len(gap) / len(sample))
    flat = len(white) - choice.count
    tight = np.concatenate([np.full(flat, settings.FRAME**-2.0), together([b.sizes**-2.0 for b in choice.blocks])])
    measured = found.medians * found.sigma[::3] / np.sqrt(float(chdtri(3, 0.5)) * (1.0 - begin.leverage))
    stated = all(sigma is not None for sigma in choice.noise(rows.campaign).parts(choice.measures))
    quiet = stated and bool((measured < settings.QUIET * chosen.NOISE_SLACK * found.sigma[::3]).all())
    guard = Guard(
        white + np.diag(tight), 1.0, 0.0, len(gap) ** -0.5, found.sigma, found.medians, found.bend, quiet
    )  # fmt: skip
    return found.single, replace(guard, share=float(np.median(guard.moves(seen.alike))))


def _gap(choice: Choice, rows: Single, part: Rows, point: Point) -> Array:
    """(n, m) what is left of some rows at a point, in units of each row's own noise over that of all."""
    campaign = rows.campaign.take(part)
    gap = corrected_observations(campaign, point.frames, choice.split(point.values)).gap
    return gap if campaign.relative_noise is None else gap / campaign.relative_noise


def _parts(rows: int) -> Iterator[Rows]:
    """Yield the numbers of rows, some thousands at a time, as columns of all would fill the memory."""
    for start in range(0, rows, settings.AT_A_TIME):
        yield np.arange(start, min(start + settings.AT_A_TIME, rows))


Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Grown:
    """All rows so far, as a fit of the choice needs them.

    ``sums`` are of rows that are not looked at again, linearised at ``anchor``, ``single`` those kept one by one,
    ``fitted`` the fit to all; ``batches`` are read only when the sums must be formed anew; ``aside`` are those of the
    last batch set aside; ``anew`` whether the last rows made it necessary to look at all of them.
    """

    choice: Choice
    anchor: Point
    sums: Sums
    single: Single
    fitted: Fitted
    batches: tuple[Single, ...]
    aside: Mask
    anew: bool = False

    @classmethod
    def of(cls, choice: Choice, batches: tuple[Single, ...], begin: Begin) -> Grown:
        """Fit a choice to rows, and form the sums of those that need not be looked at again."""
        whole = end_to_end(batches)
        begin = replace(begin, step=np.zeros_like(begin.step))
        groups = choice.measures // 3
        sums = Sums.empty(len(begin.step) + sum(len(b.sizes) for b in choice.rivals) + 1, groups)
        aside, kept = whole.aside.copy(), np.arange(whole.campaign.samples)
        if len(kept) > 2 * settings.KEPT:
            sums, kept = split(choice, whole, begin)
            whole = some(whole, kept)
        fitted = settled(choice, sums, whole, begin)
        aside[kept] = fitted.single.aside  # rows in the sums are not set aside, or keep what they had
        last = len(batches[-1].aside)
        return cls(choice, begin.point, sums, fitted.single, fitted, batches, aside[len(aside) - last :])

    def plus(self, new: Single) -> Grown:
        """Return all rows and some more; old rows in the sums are looked at again only where ``anew`` says so."""
        both, batches = end_to_end((self.single, new)), (*self.batches, new)
        fitted = settled(self.choice, self.sums, both, Begin.about(self.fitted))
        many = both.campaign.samples > 2 * settings.KEPT
        aside = fitted.single.aside[len(both.aside) - len(new.aside) :]
        if not self.sums.rows:
            whole = replace(self, single=fitted.single, fitted=fitted, batches=batches, aside=aside)
            return Grown.of(self.choice, batches, Begin.about(fitted)) if many else whole
        if not (fitted.steady and self._holds(fitted)):
            return replace(Grown.of(self.choice, batches, Begin.about(fitted)), anew=True)
        grown = replace(self, fitted=fitted, batches=batches, aside=aside, anew=False)._taking_in(new.campaign.samples)
        if grown.single.campaign.samples > 2 * settings.KEPT:
            return replace(Grown.of(self.choice, batches, Begin.about(fitted)), anew=True)
        return grown

    def _taking_in(self, count: int) -> Grown:
        """Return the same with those of the last rows in the sums that need not be looked at again."""
        rows = self.fitted.single
        last = np.arange(len(rows.weights) - count, len(rows.weights))
        own = some(rows, last)
        seen = Seen.at(own.campaign, self.anchor, self.choice, rivals=True)
        guard = self.sums.guard
        safe = np.ones(count, dtype=bool)
        if guard is not None:
            safe = guard.scores(seen.alike, own.weights) >= guard.reach
        sums = self.sums.plus(seen.stack[safe], seen.alike[safe], own.weights[safe], own.aside[safe])
        kept = np.concatenate([np.arange(len(rows.weights) - count), last[~safe]])
        return replace(self, sums=sums, single=some(rows, kept))

    def _holds(self, fitted: Fitted) -> bool:
        """Tell whether every row in the sums kept its side of the limits, and is straight as far as the point moved."""
        guard = self.sums.guard
        rms = np.sqrt(fitted.squares / max(3 * fitted.count, 1))
        if guard is not None and not guard.holds(fitted.step, fitted.sigma, fitted.medians, fitted.bend, rms):
            return False
        return self._bent(fitted) < settings.CURVED

    def _bent(self, fitted: Fitted) -> float:
        """Return by how many deviations the curvature of the rows in the sums moves a parameter at most.

        Rows kept one by one tell what it leaves of the gap, which adds up over rows, and how it turns the columns. The
        latter meets residuals that know nothing of it, so that its sum grows as the square root of the rows.
        """
        old, k = self.single, len(fitted.step)
        there = Seen.at(old.campaign, fitted.point, self.choice).alike
        here = Seen.at(old.campaign, self.anchor, self.choice).alike
        curved = here.copy()
        curved[:, :, -1] = there[:, :, -1] - (here[:, :, -1] - here[:, :, :k] @ fitted.step)
        turned = there - here
        turned[:, :, -1] = there[:, :, -1]
        root, times = whitener(fitted.products[:-1, :-1]), self.sums.used / max(len(here), 1)
        unit = np.sqrt((root**2).sum(axis=1)).clip(chosen.TINY) * fitted.best.noise
        shift = np.zeros(k)
        for rows, factor in ((curved, times), (turned, np.sqrt(times))):
            apart = products(rows, old.weights)[:, :k, -1]
            along = np.einsum("g,gi->i", fitted.sigma[::3] ** -2.0, apart) * factor
            shift += np.abs(root @ (root.T @ along)) / unit
        return float(shift.max(initial=0.0))
