"""Backward elimination of servo effects: deflated evidence and the held-out loss of motions decide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.inference.evidence import Combination, Gram
from thermal_robot.inference.search import Search
from thermal_robot.inference.settings import PRIOR_PROBABILITY
from thermal_robot.motion import settings
from thermal_robot.motion.fit import Point, deflated, fit, ratios
from thermal_robot.motion.model import JointModel

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Choice:
    """The effects that were chosen, and the model there.

    ``active`` (P,) parameters; ``point`` of the exact fit, ``best`` and ``search`` the evidence there, ``gram`` its
    normal equations, ``deflation`` (P,) the ratios; ``sizes`` (P,) prior standard deviations.
    """

    active: Mask
    point: Point
    best: Combination
    search: Search
    gram: Gram
    deflation: Array
    sizes: Array

    def probability(self, blocks: Sequence[int]) -> float:
        """Posterior probability that any of some parameters is at work."""
        found, weights = self.search.probabilities()
        return min(float(sum(w for c, w in zip(found, weights, strict=True) if set(blocks) & set(c.blocks))), 1.0)

    def odds(self, block: int) -> float:
        """Log odds of a parameter of the choice against nothing in its place."""
        without = self.search.evaluate([b for b in self.best.blocks if b != block], self.best)
        return self.best.log_evidence - without.log_evidence

    def alternatives(self, block: int) -> list[int]:
        """Parameters that could stand in the place of one: their evidence is near that of the choice."""
        rest, found = [b for b in self.best.blocks if b != block], []
        for other in range(len(self.active)):
            if other in self.best.blocks or not self.gram.ranks[other]:
                continue
            there = self.search.evaluate([*rest, other], self.best)
            if there.log_evidence > self.best.log_evidence - settings.ALIKE:
                found.append(other)
        return found

    def deviations(self) -> Array:
        """(P,) posterior standard deviations of the chosen parameters, NaN of the others."""
        found = np.full(len(self.active), np.nan)
        sizes = np.array([self.sizes[b] for b in self.best.blocks])
        found[list(self.best.blocks)] = sizes * np.sqrt(np.maximum(np.diag(self.best.covariance), 0.0))
        return found


def everything(model: JointModel, allowed: Mask, progress: Callable[[str], None]) -> Array:
    """Maximum a posteriori values of all effects together, loads taken where the joints go, until both agree."""
    sizes = np.array([one.size for one in model.parameters])
    values = np.where(allowed, model.start(), 0.0)
    for number in range(1, settings.REFRESHES + 1):
        progress(f"all effects of the servos, round {number}")
        model.refreshed(values)
        values = fit(model, values, allowed, sizes)
    return values


def select(model: JointModel, allowed: Mask, progress: Callable[[str], None]) -> Choice:
    """Search the effects by evidence at the fit of all, then at the exact fit of the choice, and prune by one rule."""
    sizes = np.array([one.size for one in model.parameters])
    values = everything(model, allowed, progress)
    deflation = None
    known: Mask | None = None
    for number in range(1, settings.SELECTIONS + 1):
        progress(f"which effects, round {number}")
        choice = _weighed(model, values, allowed, sizes, deflation, known)
        deflation = choice.deflation
        if known is not None and (choice.active == known).all():
            break
        known = choice.active
        values = fit(model, np.where(known, values, 0.0), known, sizes)
        model.refreshed(values)
        values = fit(model, values, known, sizes)
    return _pruned(model, choice, allowed, values)


def _weighed(
    model: JointModel, values: Array, allowed: Mask, sizes: Array, deflation: Array | None, start: Mask | None
) -> Choice:
    point = Point.at(model, values)
    deflation = ratios(point) if deflation is None else deflation
    gram, _ = deflated(model, point, deflation)
    barred = frozenset(np.flatnonzero(~allowed).tolist())
    prior = float(np.log(PRIOR_PROBABILITY / (1.0 - PRIOR_PROBABILITY)))
    search = Search(gram, [prior] * len(values), out=barred)
    best = search.run(() if start is None else np.flatnonzero(start).tolist())
    return Choice(np.isin(np.arange(len(values)), best.blocks), point, best, search, gram, deflation, sizes)


def held_out_loss(point: Point, active: Mask, sizes: Array, by_joint: bool = False) -> Array:
    """Leave-one-motion-out, linearised: squared residual of each motion (M,) over the noise, fitted to the others.

    ``by_joint`` keeps the joints apart, (M, J).
    """
    matrix, vector = point.products()
    own = np.flatnonzero(active)
    found = np.zeros(vector.shape)
    if len(own):
        whole, along = matrix[:, own[:, None], own], vector[:, own]
        rest = whole.sum(axis=0) - whole + np.diag(sizes[own] ** -2.0), along.sum(axis=0) - along
        found[:, own] = np.linalg.solve(rest[0], rest[1][:, :, None])[:, :, 0]
    losses = []
    for one, noise in zip(point.rows, point.noise, strict=True):
        target = one.residual + one.derivative @ point.values[one.columns]
        left = (target - (one.derivative * found[one.motion][:, one.columns]).sum(axis=1)) / noise
        losses.append(np.bincount(one.motion, left**2, len(matrix)))
    each = np.stack(losses, axis=1)
    return each if by_joint else np.asarray(each.sum(axis=1))


def _pruned(model: JointModel, choice: Choice, allowed: Mask, values: Array) -> Choice:
    """Drop what has odds below nine to one or harms motions held out, the worst first, and fit what stays exactly."""
    while True:
        least: tuple[float, int] | None = None
        whole = held_out_loss(choice.point, choice.active, choice.sizes).sum()
        for block in choice.best.blocks:
            less = choice.active.copy()
            less[block] = False
            harm = whole - held_out_loss(choice.point, less, choice.sizes).sum()
            odds = choice.odds(block)
            if (odds < np.log(settings.ODDS) or harm > 0.0) and (least is None or odds < least[0]):
                least = odds, block
        if least is None:
            return choice
        allowed = allowed.copy()
        allowed[least[1]] = False
        kept = choice.active & allowed
        values = fit(model, np.where(kept, values, 0.0), kept, choice.sizes)
        choice = _weighed(model, values, allowed, choice.sizes, choice.deflation, kept)
        if not (choice.active == kept).all():
            values = fit(model, np.where(choice.active, values, 0.0), choice.active, choice.sizes)
            choice = _weighed(model, values, allowed, choice.sizes, choice.deflation, choice.active)
