"""Many rows split into sums and those that are kept one by one: the one pass over all rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.campaign.appended import appended
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice, Point, together
from thermal_robot.diagnosis.growing.settled import Begin, Single, weighed
from thermal_robot.diagnosis.growing.sums import Guard, Seen, Sums, frame_names, products
from thermal_robot.inference import settings as chosen
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
