"""Stepwise selection of servo effects: evidence at the fit of each set, and the held-out loss of motions, decide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest

import numpy as np
from scipy.special import softmax

from thermal_robot.arrays import Array
from thermal_robot.inference.algebra import total_probability
from thermal_robot.inference.explain import log_odds
from thermal_robot.inference.search import Search
from thermal_robot.motion import settings
from thermal_robot.motion.effects import ABRUPT, SIMULATOR
from thermal_robot.motion.fit import Groups, Point, deflated, fit, fitted, mean_squares
from thermal_robot.motion.model import SHARED, JointModel, Mask
from thermal_robot.motion.weigh import Scales, Weighed

PLAIN = (*SIMULATOR, "zero", "lag", "droop", "coulomb", "load_friction", "payload", "masses", "offset", "viscous")
"""Effects from which a fit starts: what every servo has, and little that does the same."""

PROFILE = ("speed_limit", "acceleration_limit")
"""Limits of the profile along which a servo leads its set point."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Chosen set of parameters, and the ``rivals`` that were weighed beside it, all of effects that can be seen."""

    own: Weighed
    rivals: tuple[Weighed, ...]

    @property
    def point(self) -> Point:
        """The model linearised at the fit of the choice."""
        return self.own.point

    @property
    def active(self) -> Mask:
        """(P,) mask of the chosen parameters."""
        return self.own.active

    @cached_property
    def weights(self) -> list[tuple[Weighed, float]]:
        """Posterior probability of each set, the choice first."""
        every = (self.own, *self.rivals)
        return list(zip(every, softmax([one.log_evidence for one in every]).tolist(), strict=True))

    @property
    def nothing(self) -> Choice:
        """The choice of no effect at all."""
        none = np.zeros(len(self.active))
        own = Weighed(self.own.scales, none > 0.0, Point.at(self.point.model, none, none > 0.0))
        return Choice(own, ())

    def probability(self, block: int) -> float:
        """Posterior probability that a parameter is in the model, summed over the sets weighed."""
        return total_probability([weight for one, weight in self.weights if one.active[block]])

    def fewer(self, block: int) -> Weighed:
        """Return the set without one of its parameters."""
        return self.own.scales.others(self.own, [(without(self.active, block), (self.point.values,))])[0]

    def alternatives(self, block: int) -> list[int]:
        """Return parameters that could replace one: log evidence no more than ALIKE below the choice's."""
        rest, least = without(self.active, block), self.own.log_evidence - settings.ALIKE
        near = [one.active for one in self.rivals if one.log_evidence > least and not one.active[block]]
        added = [np.flatnonzero(one & ~rest).tolist() for one in near if one[rest].all()]
        return [one[0] for one in added if len(one) == 1]


def without(active: Mask, block: int) -> Mask:
    """(P,) mask of the parameters without one."""
    return np.asarray(active & (np.arange(len(active)) != block))


def everything(model: JointModel, allowed: Mask, progress: Callable[[str], None]) -> Point:
    """Fit all allowed effects by maximum a posteriori, recomputing the loads before each of REFRESHES rounds.

    From fits of plain servos with torque limits at the largest errors and of the expected size, and with speed limits,
    the best of each group of joints; effects that are abrupt start where the joints end.
    """
    begun = np.where(allowed, model.start(), 0.0)
    # of a servo that saturates, a softer one that does not is a local minimum, where nothing tells a limit
    limited, led = (model.of_effects((*PLAIN, *limits)) for limits in (("torque_limit",), PROFILE))
    sized = np.where(model.of_effects(("torque_limit",)), model.sizes, begun)
    fits = [fit(model, first, allowed & own) for first, own in ((begun, limited), (sized, limited), (begun, led))]
    left = np.stack([_of_motions(model, values) for values in fits])
    values = fits[int(left.sum(axis=1).argmin())].copy()
    for group in model.groups:
        own = np.isin(model.placed, group)
        values[own] = fits[int(left[:, list(group)].sum(axis=1).argmin())][own]
    # of what does nothing until it is reached a slope at zero tells nothing
    values = np.where(allowed & (values == 0.0) & model.of_effects(ABRUPT), begun, values)
    for number in range(1, settings.REFRESHES + 1):
        progress(f"all effects of the servos, round {number}")
        model.refreshed(values)
        point = fitted(model, values, allowed)
        values = point.values
    return point


def _of_motions(model: JointModel, values: Array) -> Array:
    """(J,) mean over motions of the logarithm of what is left: each has its own noise, so that none alone decides."""
    squares = (
        mean_squares(one, model.motion_of(j), model.clusters) for j, one in enumerate(model.all_residuals(values))
    )
    return np.array([0.5 * np.log(one + model.noise(j) ** 2).mean() for j, one in enumerate(squares)])


def searched(model: JointModel, allowed: Mask, progress: Callable[[str], None]) -> Weighed:
    """Search effects by evidence at the fit of all, then at the fit of what was chosen; each search is linear."""
    point = everything(model, allowed, progress)
    scales, found = Scales.of(point), list[Weighed]()
    for number in range(1, settings.SELECTIONS + 1):
        progress(f"which effects, round {number}")
        if found:
            point = Point.at(model, found[-1].point.values)
        first = found[-1].own.tolist() if found else []
        known = np.isin(np.arange(len(allowed)), _search(point, scales, allowed).run(first).blocks)
        if found and (known == found[-1].active).all():
            break
        values = fit(model, point.values, known)
        model.refreshed(values)
        found.append(scales.fitted(known, values))
    # a search that left the neighbourhood of its point may have chosen worse than the round before
    return min(found, key=lambda one: one.loss)


def _search(point: Point, scales: Scales, allowed: Mask) -> Search:
    """Return the search among parameters by the evidence of the problem that is linear at a point."""
    barred = frozenset(np.flatnonzero(~allowed).tolist())
    return Search(deflated(point, scales.deflation, scales.worth), [log_odds()] * len(allowed), out=barred)


def settled(own: Weighed, allowed: Mask, progress: Callable[[str], None]) -> Choice:
    """Drop, exchange and add parameters, one at a time in each group, until no set beside the choice is better.

    A parameter goes at odds below nine to one, where motions held out are no worse without it, or if nobody could see
    it; another comes in its place, or beside it, where the evidence is better, by nine to one of one more.
    """
    scales = own.scales
    for number in range(1, settings.MOVES + 1):
        progress(f"sets of effects fitted, round {number}")
        if number == 1 or len(scales.model.groups) == 1:  # a weight alone hardly changes with a joint's parameters
            scales.model.refreshed(own.point.values)
            scales.forget()
            own = scales.fitted(own.active, own.point.values)
        while (fewer := _fewer(scales, own)) is not None:
            own = fewer
        rivals = _rivals(scales, own, allowed)
        better = [one for one in rivals if _gain(own, one) > 0.0 and one.seen[one.active & ~own.active].all()]
        if not better or number == settings.MOVES:
            break
        own = _together(scales, own, sorted(better, key=lambda one: -_gain(own, one)))
    # what the evidence would rather have, and motions held out refuse or nobody could see, is no rival
    least = own.log_evidence - settings.FAR_BELOW
    near = [one for one in rivals if least < one.log_evidence and one.loss < own.loss + settings.ALIKE]
    near = [one for one in near if _gain(own, one) <= 0.0 and one.seen[one.own].all()]
    whole = Weighed(scales, own.active, Point.at(scales.model, own.point.values, own.active))
    return Choice(whole, (*_drops(scales, own), *near))


def _gain(own: Weighed, one: Weighed) -> float:
    """Log odds of a set against one of as many parameters, less nine to one for each that it has more.

    Zero where motions held out are no better.
    """
    more = max(len(one.own) - len(own.own), 0)
    return one.log_evidence - own.log_evidence - more * np.log(settings.ODDS) if one.loss < own.loss else 0.0


def _drops(scales: Scales, own: Weighed) -> list[Weighed]:
    """Weigh the set without each of its parameters."""
    ahead = [own.ahead(without(own.active, b)) for b in own.own.tolist()]
    return scales.others(own, [(one.active, (own.point.values, one.point.values)) for one in ahead])


def _fewer(scales: Scales, own: Weighed) -> Weighed | None:
    """Backward elimination: return the set without a parameter that is not needed, of each group of joints, if any.

    The linear problem tells the order; what joints share comes last, as then all are fitted anew. Motions held out
    decide once the evidence has: with parameters to spare, what the linear problem says of them scatters.
    """
    ahead = {b: own.ahead(without(own.active, b)) for b in own.own.tolist()}
    order, placed = sorted(ahead, key=lambda b: -ahead[b].log_evidence), scales.model.placed
    queues = [[b for b in order if placed[b] in group] for group in scales.model.groups]
    turns = [[b for b in turn if b is not None] for turn in zip_longest(*queues)]
    doubtful = list[Weighed]()
    for turn in (*turns, *([b] for b in order if placed[b] == SHARED)):
        found = list[Weighed]()
        for seen, least in ((True, own.log_evidence - settings.FAR_BELOW), (False, -np.inf)):
            some = [b for b in turn if own.seen[b] == seen]
            sets = [(ahead[b].active, (own.point.values, ahead[b].point.values)) for b in some]
            each = scales.others(own, sets, least)
            found += [one for one in each if not seen or one.log_evidence > own.log_evidence - np.log(settings.ODDS)]
            doubtful += [one for one in each if one.loss <= own.loss]
        if found:
            return _together(scales, own, found)
    return _together(scales, own, doubtful) if doubtful else None


def _together(scales: Scales, own: Weighed, changed: Sequence[Weighed]) -> Weighed:
    """Return the set with the first change of each group of joints; with one of what all share, that alone."""
    placed, active, taken = scales.model.placed, own.active, set[int]()
    for one in changed:
        other = one.active ^ own.active
        groups = {k for k, group in enumerate(scales.model.groups) if np.isin(placed[other], group).any()}
        if SHARED in placed[other] and not taken:
            return one
        if SHARED not in placed[other] and not groups & taken:
            active, taken = active ^ other, taken | groups
    return scales.others(own, [(active, (own.point.values,))])[0]


def _rivals(scales: Scales, own: Weighed, allowed: Mask) -> list[Weighed]:
    """Weigh the sets with one parameter exchanged, or one more, that the linear problem finds likeliest.

    Of each parameter of the choice so many, of each joint so many more; what may come in the place of a parameter tells
    the problem that is linear at the fit without it, and not where another effect stands in for it.
    """
    model, joint = scales.model, scales.model.placed
    start, places, sets = model.start(), np.arange(len(allowed)), list[tuple[Mask, tuple[Array, ...]]]()

    def propose(rest: Weighed, among: Sequence[Mask], groups: Groups = model.groups) -> None:
        base = scales.linearised(rest, allowed & np.any(among, axis=0), groups)
        for added in among:
            told = [base.ahead(rest.active | (places == k)) for k in places[allowed & ~own.active & added]]
            for one in sorted(told, key=lambda one: -one.log_evidence)[: settings.RIVALS]:
                begun = np.where(rest.active, rest.point.values, np.where(one.active, start, 0.0))
                sets.append((one.active, (begun, one.point.values)))

    # joints that go their own ways would all be fitted anew for what they share in the place of each of their effects
    together = len(model.groups) == 1
    for b, rest in zip(own.own.tolist(), _drops(scales, own), strict=True):
        alike = (joint == joint[b]) | (joint[b] == SHARED) | ((joint == SHARED) & together)
        propose(rest, [alike], [group for group in model.groups if joint[b] in (*group, SHARED)])
    propose(own, [joint == j for j in (*model.joints, SHARED)])
    return scales.others(own, sets, own.log_evidence - settings.FAR_BELOW)
