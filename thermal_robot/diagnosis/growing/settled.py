"""The fit of a choice: parameters, prior scales, noise and weights at which none of them would change another.

A diagnosis goes round the same circle while it chooses, and leaves it where the choice no longer changes. Here nothing
is chosen, and the circle is gone round until it stands still, so that old rows and new ones in whatever order, and one
batch or many, end at the same place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.choice import Choice, Point, together
from thermal_robot.diagnosis.growing.sums import Seen, Sums, bend, carried, products
from thermal_robot.inference import settings as chosen
from thermal_robot.inference.algebra import solve
from thermal_robot.inference.evidence import Combination, Gram, evidence
from thermal_robot.inference.frames import moved
from thermal_robot.inference.problem import Linear, Whitening, normal_equations, parameter_values
from thermal_robot.inference.robust import distance_limit, far_scale, judged, tail_weight

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Single:
    """Rows (n,) that are kept one by one, their weights, 0 where set aside, and which are; found anew where judged."""

    campaign: Campaign
    weights: Array
    aside: Mask


@dataclass(frozen=True, eq=False)
class Fitted:
    """A choice fitted to all rows: frames and parameters (``point``) and, per chosen effect, mean and covariance.

    ``step`` (k,) is from where the sums were linearised, frames first; ``best`` and ``gram`` are prior scales and
    noise, and the normal equations; ``sigma`` (m,) and ``held`` the whitening noise and its prior's degrees of freedom;
    ``leverage`` the share of equations taken up. ``medians`` and ``bend`` (G,), in units of ``sigma``: median distance
    of rows, and that from which on one counts less. ``products`` (k + 1, k + 1) in units of ``sigma``, the gap at the
    point. ``squares`` and ``count`` (G,): sum of squares, m² and rad², over so many rows not set aside. ``steady``: at
    rest, with no median outside the single rows.
    """

    point: Point
    step: Array
    best: Combination
    gram: Gram
    values: dict[int, tuple[Array, Array]]
    sigma: Array
    held: float
    leverage: float
    single: Single
    medians: Array
    bend: float
    products: Array
    squares: Array
    count: int
    steady: bool

    @property
    def noise(self) -> Array:
        """(m,) one sigma of each component, m and rad."""
        return self.sigma * self.best.noise


@dataclass(frozen=True, eq=False)
class Begin:
    """Where a fit begins: point, step since the sums were linearised, noise, leverage, and scales if they are known."""

    point: Point
    step: Array
    sigma: Array
    held: float
    leverage: float
    best: Combination | None = None

    @classmethod
    def about(cls, known: Fitted) -> Begin:
        """Begin where another fit ended."""
        return cls(known.point, known.step, known.sigma, known.held, known.leverage, known.best)


def settled(choice: Choice, sums: Sums, single: Single, begin: Begin) -> Fitted:
    """Fit a choice to the rows in the sums and those kept one by one; where it ends does not depend on ``begin``."""
    state = begin
    for _ in range(settings.STEPS):
        found, size = _round(choice, sums, single, state)
        before = np.e * found.best.noise if state.best is None else state.best.noise
        still = max(abs(found.leverage - state.leverage), abs(np.log(found.best.noise / before))) < settings.SETTLED
        state, single = Begin.about(found), found.single
        if size < settings.SETTLED and still:
            return found
    return replace(found, steady=False)


def _round(choice: Choice, sums: Sums, single: Single, begin: Begin) -> tuple[Fitted, float]:
    """Go round once: weigh the rows, find scales and noise, step; return also how far the step went, in noise."""
    seen = Seen.at(single.campaign, begin.point, choice)
    alike, flat = seen.alike, len(seen.names)
    weighing = weighed(choice, sums, single, alike[:, :, -1], begin)
    single, sigma = weighing.single, weighing.sigma
    k = flat + choice.count
    whole = carried(_chosen(sums.weighed, k), begin.step) + products(alike, single.weights)
    white = np.einsum("g,gij->ij", sigma[::3] ** -2.0, whole)
    gram, best, values = _explained(choice, white, flat, sums.used, weighing, begin)
    mean = together([values[b][0] for b in range(len(choice.blocks))])
    change = mean - begin.point.values
    left = white[:flat, -1] - white[:flat, flat:-1] @ change
    step = np.concatenate([solve(white[:flat, :flat], left) if flat else np.zeros(0), change])
    size = float(np.sqrt(max(step @ white[:-1, :-1] @ step, 0.0))) / best.noise
    leverage = float(min((best.effective + flat) / max(gram.equations + flat, 1), chosen.MOST_LEVERAGE))
    plain = carried(_chosen(sums.plain, k), begin.step) + products(seen.stack, (~single.aside).astype(float))
    fitted = Fitted(
        point=Point(moved(begin.point.frames, step[:flat], seen.names), mean),
        step=begin.step + step,
        best=best,
        gram=gram,
        values=values,
        sigma=sigma,
        held=weighing.held,
        leverage=leverage,
        single=single,
        medians=weighing.medians,
        bend=weighing.bend,
        products=carried(white, step),
        squares=carried(plain, step)[:, -1, -1],
        count=sums.kept + int((~single.aside).sum()),
        steady=weighing.inside,
    )
    return fitted, size


@dataclass(frozen=True, eq=False)
class Weighing:
    """Rows with their weights, the noise, and the limits that rows must not cross unseen: see :class:`Fitted`."""

    single: Single
    sigma: Array
    held: float
    medians: Array
    bend: float
    inside: bool


def weighed(choice: Choice, sums: Sums, single: Single, gap: Array, begin: Begin) -> Weighing:
    """Weigh the rows that are kept one by one, (n, m) what is left of them, as a diagnosis does."""
    groups, measures = len(sums.below), choice.measures
    if not choice.judged:
        return Weighing(single, begin.sigma, begin.held, np.zeros(groups), np.inf, True)
    parts = (gap.reshape(len(gap), groups, 3) ** 2).sum(axis=2)
    if sums.guard is not None and sums.guard.quiet:
        middle, inside = (sums.guard.medians * sums.guard.sigma[::3]) ** 2, True
    else:
        middle, inside = _medians(parts, sums)
    measured = np.maximum(np.sqrt(middle / float(chdtri(3, 0.5)) / (1.0 - begin.leverage)), chosen.ROUNDING)
    sigma, held, distance2 = judged(gap, measured, choice.noise(single.campaign), begin.leverage, measures)
    aside = distance2 > distance_limit(measures, sums.rows + len(gap))
    weights = np.where(aside, 0.0, tail_weight(distance2, measures))
    edge = bend(measures, begin.leverage, sigma, far_scale(measured, sigma))
    return Weighing(
        replace(single, weights=weights, aside=aside), sigma, held, np.sqrt(middle) / sigma[::3], edge, inside
    )


def _medians(parts: Array, sums: Sums) -> tuple[Array, bool]:
    """(G,) medians of squared distances, of rows one by one (n, G) and those in the sums; and whether they are known.

    They are as long as they lie among the rows that are kept one by one.
    """
    ordered, total = np.sort(parts, axis=0), sums.rows + len(parts)
    pair = np.array([(total - 1) // 2, total // 2])[:, None] - sums.below
    known = bool((pair >= 0).all() and (pair < len(parts)).all())
    return np.take_along_axis(ordered, np.clip(pair, 0, len(parts) - 1), axis=0).mean(axis=0), known


def _explained(
    choice: Choice, white: Array, flat: int, used: int, weighing: Weighing, begin: Begin
) -> tuple[Gram, Combination, dict[int, tuple[Array, Array]]]:
    """Find the most probable prior scales and noise, and the parameters, from whitened products at a point."""
    measures, weights = choice.measures, weighing.single.weights
    nothing = np.zeros((0, measures, flat))
    linear = Linear(nothing[:, :, 0] if flat else np.zeros((0, measures)), nothing, choice.blocks)
    whitening = Whitening(weights, weighing.sigma, weighing.held)
    full = carried(white, np.concatenate([np.zeros(flat), -begin.point.values]))
    gram = normal_equations(linear, whitening, full, (used + int((weights > 0).sum())) * measures)
    best = evidence(gram, tuple(range(len(choice.blocks))), 0.0, begin.best, settled=settings.SETTLED)
    return gram, best, parameter_values(linear, gram, best)


def _chosen(sums: Array, k: int) -> Array:
    """Return the products of the first k columns and the gap."""
    kept = np.array([*range(k), sums.shape[-1] - 1])
    return np.asarray(sums[:, kept[:, None], kept])
