"""Backward elimination of servo effects: deflated evidence and the held-out loss of motions decide."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.inference.algebra import total_probability
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.explain import log_odds
from thermal_robot.inference.search import Search
from thermal_robot.motion import settings
from thermal_robot.motion.fit import Point, deflated, fit, ratios
from thermal_robot.motion.model import JointModel, Mask

PLAIN = ("zero", "lag", "droop", "coulomb", "load_friction", "kp", "payload", "masses", "offset", "viscous")
"""Effects from which a fit starts: what every servo has, and little that does the same."""
ABRUPT = ("contact", "torque_limit", "low_stop", "high_stop")
"""Effects that do nothing until they are reached."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Chosen parameters, the model linearised at their fit, and the search by evidence there.

    ``active`` (P,) masks those chosen of those ``allowed`` (P,); ``point`` is the model there, ``best`` the combination
    of largest evidence in ``search``, ``deflation`` (P,) the ratios of clustered to independent variance.
    """

    active: Mask
    allowed: Mask
    point: Point
    best: Combination
    search: Search
    deflation: Array

    def probability(self, block: int) -> float:
        """Posterior probability that a parameter is in the model, summed over the combinations searched."""
        found = zip(*self.search.probabilities(), strict=True)
        return total_probability([weight for one, weight in found if block in one.blocks])

    def without(self, block: int) -> Mask:
        """(P,) mask of the chosen parameters without one."""
        return np.asarray(self.active & (np.arange(len(self.active)) != block))

    def evidence(self, active: Mask) -> float:
        """Log evidence of the parameters of a mask (P,); leaves the search and its probabilities unchanged."""
        apart = replace(self.search, seen={})
        return apart.evaluate(np.flatnonzero(active).tolist(), self.best).log_evidence

    def odds(self, block: int) -> float:
        """Log odds of the choice against the same without one of its parameters."""
        return self.best.log_evidence - self.evidence(self.without(block))

    def alternatives(self, block: int) -> list[int]:
        """Return parameters that could replace one: log evidence no more than ALIKE below the choice's."""
        rest, least = self.without(block), self.best.log_evidence - settings.ALIKE
        places = np.arange(len(rest))
        others = places[self.allowed & ~self.active & (np.array(self.search.gram.ranks) > 0)].tolist()
        return [b for b in others if self.evidence(rest | (places == b)) > least]

    def deviations(self) -> Array:
        """(P,) posterior standard deviations of the chosen parameters, NaN of the others."""
        found, own = np.full(len(self.active), np.nan), list(self.best.blocks)
        _, covariance = self.search.gram.posterior(self.best)
        found[own] = self.point.model.sizes[own] * np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return found


def everything(model: JointModel, allowed: Mask, start: Array | None, progress: Callable[[str], None]) -> Array:
    """Fit all allowed effects by maximum a posteriori, recomputing the loads before each of REFRESHES rounds.

    From ``start``, by default from a fit of plain servos; effects that are abrupt start where the joints end.
    """
    begun = np.where(allowed, model.start(), 0.0)
    if start is None:
        plain = allowed & np.array([one.effect in PLAIN for one in model.parameters])
        start = fit(model, begun, plain)
    abrupt = allowed & (start == 0.0) & np.array([one.effect in ABRUPT for one in model.parameters])
    values = np.where(abrupt, begun, start)  # of what does nothing until it is reached a slope at zero tells nothing
    for number in range(1, settings.REFRESHES + 1):
        progress(f"all effects of the servos, round {number}")
        model.refreshed(values)
        values = fit(model, values, allowed)
    return values


def select(model: JointModel, allowed: Mask, progress: Callable[[str], None], start: Array | None = None) -> Choice:
    """Search effects by evidence at the fit of all, refit, keep the round of least held-out loss, then prune it."""
    values = everything(model, allowed, start, progress)
    deflation: Array | None = None
    known: Mask | None = None
    fitted: list[tuple[float, Choice]] = []
    for number in range(1, settings.SELECTIONS + 1):
        progress(f"which effects, round {number}")
        choice = _weighed(model, values, allowed, deflation, known)
        deflation = choice.deflation
        if known is not None and (choice.active == known).all():
            break
        known = choice.active
        values = fit(model, values, known)
        model.refreshed(values)
        values = fit(model, values, known)
        choice = _weighed(model, values, allowed, deflation, known, frozenset())
        left = held_out_loss(choice.point, known).sum(axis=1) * choice.point.noise**2
        counts = [len(one.residual) for one in choice.point.rows]
        fitted.append((float(counts @ np.log(np.maximum(left, 1e-300))), choice))
    # a search that left the neighbourhood of its point may have chosen worse than the round before
    choice = min(fitted, key=lambda one: one[0])[1]
    model.refreshed(choice.point.values)
    return _pruned(choice)


def _weighed(
    model: JointModel, values: Array, allowed: Mask, deflation: Array | None, start: Mask | None,
    gone: frozenset[int] | None = None,
) -> Choice:  # fmt: skip
    """Search combinations of parameters by deflated evidence, linearised at some values (P,).

    With ``gone``, parameters that are barred, the choice is ``start`` itself; the search only weighs its rivals.
    """
    point = Point.at(model, values)
    deflation = ratios(point) if deflation is None else deflation
    barred = frozenset(np.flatnonzero(~allowed).tolist()) | (gone or frozenset())
    search = Search(deflated(point, deflation), [log_odds()] * len(values), out=barred)
    first = [] if start is None else np.flatnonzero(start).tolist()
    best = search.run(first)
    best = best if gone is None else search.evaluate(first)
    return Choice(np.isin(np.arange(len(values)), best.blocks), allowed, point, best, search, deflation)


def _fewer(choice: Choice, values: Array, kept: Mask) -> Choice:
    """Return the choice of the mask ``kept`` (P,), linearised at values fitted with it; parameters removed stay out."""
    gone = choice.search.out | set(np.flatnonzero(choice.active & ~kept).tolist())
    return _weighed(choice.point.model, values, choice.allowed, choice.deflation, kept, gone)


def held_out_loss(point: Point, active: Mask) -> Array:
    """Linearised leave-one-motion-out cross-validation: squared residual (J, M) over the noise variance."""
    matrix, vector, total = point.products
    own = np.flatnonzero(active)
    if not len(own):
        return total
    whole, along = matrix[:, :, own[:, None], own], vector[:, :, own]
    others, pull = (one.sum(axis=(0, 1)) - one.sum(axis=0) for one in (whole, along))
    found = np.linalg.solve(others + np.diag(point.model.sizes[own] ** -2.0), pull[:, :, None])[:, :, 0]
    fitted = np.einsum("mp,jmpq,mq->jm", found, whole, found, optimize=True)
    return np.asarray(total + fitted - 2.0 * (found * along).sum(axis=2))


def _pruned(choice: Choice) -> Choice:
    """Backward elimination of parameters with odds below 9 or that raise the held-out loss, repeated after a refit.

    Then the weakest are tested by likelihood ratio.
    """
    for _ in range(settings.SELECTIONS):
        kept = _kept(choice)
        choice = _fewer(choice, fit(choice.point.model, choice.point.values, kept), kept)
        if (_kept(choice) == kept).all():
            break
    return _needed(choice)


def _needed(choice: Choice) -> Choice:
    """Backward elimination by likelihood ratio against a refit without the weakest parameter, rows deflated.

    No odds exceed that ratio; but a linear problem misses what other effects can do together in its place.
    """
    model = choice.point.model
    worth = [len(one.residual) / choice.deflation[one.columns].mean() for one in choice.point.rows]
    while choice.active.any():
        less = choice.without(min(choice.best.blocks, key=choice.odds))
        values = fit(model, choice.point.values, less)
        if worth @ np.log(Point.at(model, values, less).noise / choice.point.noise) >= np.log(settings.ODDS):
            break
        choice = _fewer(choice, values, less)
    return choice


def _kept(choice: Choice) -> Mask:
    """Backward elimination at one fit: mask of visible parameters with odds of 9 or more that lower held-out loss."""
    active = choice.active & seen(choice.point)
    while active.any():
        here, whole, worst = choice.evidence(active), held_out_loss(choice.point, active).sum(), None
        for block in np.flatnonzero(active).tolist():
            less = active & (np.arange(len(active)) != block)
            odds = here - choice.evidence(less)
            harm = whole - held_out_loss(choice.point, less).sum()
            if (odds < np.log(settings.ODDS) or harm > 0.0) and (worst is None or odds < worst[0]):
                worst = odds, block
        if worst is None:
            break
        active[worst[1]] = False
    return active


def seen(point: Point) -> Mask:
    """(P,) whether a parameter's rms contribution to any joint reaches both twice its noise and the tolerance."""
    found, model = np.zeros(len(point.values), dtype=bool), point.model
    for joint, one in zip(model.joints, point.rows, strict=True):
        least = model.log.visible_from(model.log.joints[joint], model.noise(joint))
        found[one.columns] |= one.moved >= least
    return found
