"""A diagnosis that grows: its rows as sums and a few kept one by one, and the fit of its choice to all of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice, Point
from thermal_robot.diagnosis.growing.settled import Begin, Fitted, Single, settled
from thermal_robot.diagnosis.growing.split import end_to_end, some, split
from thermal_robot.diagnosis.growing.sums import Seen, Sums, products
from thermal_robot.inference import settings as chosen
from thermal_robot.inference.algebra import whitener

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
