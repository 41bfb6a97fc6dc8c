"""Stepwise selection of servo effects: evidence at the fit of each set, and the held-out loss of motions, decide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np
from scipy.special import softmax

from thermal_robot.arrays import Array
from thermal_robot.inference.algebra import total_probability
from thermal_robot.motion import settings
from thermal_robot.motion.effects import ABRUPT, SIMULATOR
from thermal_robot.motion.fit import Point, fit, logs, mean_squares
from thermal_robot.motion.model import SHARED, JointModel, Mask
from thermal_robot.motion.weigh import Scales, Weighed, without

_COMMON = "zero lag droop coulomb load_friction masses offset viscous contact".split()
PLAIN = (*SIMULATOR, *_COMMON)
"""Effects from which a fit starts: what every servo has, and little that does the same."""

SATURATION = ("torque_limit", "delay")
"""What a saturated servo has: it moves at its fastest whatever its error, and no lag does what a delay does there."""

PROFILE = ("speed_limit", "acceleration_limit")
"""Limits of the profile along which a servo leads its set point."""


Proposed = tuple[Mask, tuple[Array, ...]]


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
        """Posterior probability of each set, the choice first: what motions held out refused is no likelier."""
        every = (self.own, *self.rivals)
        likely = [min(one.log_evidence, self.own.log_evidence) for one in every]
        return list(zip(every, softmax(likely).tolist(), strict=True))

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
        """Return parameters that could replace one: less likely by ODDS at most, or alike in motions held out."""
        rest = without(self.active, block)
        other = [one for one in self.rivals if not one.active[block]]
        near = [one.active for one in other if one.log_evidence > self.own.likely_from or _alike(self.own, one)]
        added = [np.flatnonzero(one & ~rest).tolist() for one in near if one[rest].all()]
        return [one[0] for one in added if len(one) == 1]


def plain(model: JointModel, allowed: Mask) -> Array:
    """Fit plain servos by maximum a posteriori: (P,) values; the loads are recomputed before each of REFRESHES rounds.

    From fits with torque limits and with limits of a profile the best of each group of joints. A payload comes
    after: with one at once, a servo that saturates has a local minimum where it falls instead.
    """
    begun = _scanned(model, np.where(allowed, model.start(), 0.0), allowed & model.of_effects(("torque_limit",)))
    starts = [(begun, allowed & model.of_effects((*PLAIN, *limits))) for limits in (SATURATION, PROFILE)]
    fits = [fit(model, *start) for start in starts]
    left = np.stack([_of_motions(model, values) for values in fits])
    best = np.full(len(begun), left.sum(axis=1).argmin())
    for group in model.groups:
        best[np.isin(model.placed, group)] = left[:, list(group)].sum(axis=1).argmin()
    values, active = np.array(fits), np.array([own for _, own in starts])
    values, active = (one[best, np.arange(len(best))] for one in (values, active))
    active |= allowed & model.of_effects(("payload",))
    for _ in range(settings.REFRESHES):  # what was at zero with other loads may not be there with these
        model.refreshed(values)
        values = fit(model, values, active)
    return values


def _scanned(model: JointModel, values: Array, wanted: Mask) -> Array:
    """Grid search: start a parameter of each joint where it leaves least, of SCAN times its expected size, or stay.

    Of a servo that saturates, a softer one that does not is a local minimum, where nothing tells a limit.
    """
    sets = np.stack([values, *(np.where(wanted, times * model.sizes, values) for times in settings.SCAN)])
    left = model.by_joint(lambda group: [(one**2).sum(axis=1) for one in model.residuals(group, sets)])
    best = np.array([one.argmin() for one in left])
    return np.where(wanted, sets[best[np.maximum(model.placed, 0)], np.arange(len(values))], values)


def _of_motions(model: JointModel, values: Array) -> Array:
    """(J,) mean over motions of the logarithm of what is left in each joint."""
    squares = (
        mean_squares(one, model.motion_of(j), model.clusters) for j, one in enumerate(model.all_residuals(values))
    )
    return np.array([logs(one, model.noises[j]).mean() for j, one in enumerate(squares)])


def searched(model: JointModel, allowed: Mask, progress: Callable[[str], None]) -> Weighed:
    """Forward selection: to the fit of plain servos, add one effect of each group of joints at a time.

    While the evidence is better by nine to one, and motions held out are better, too.
    """
    progress("plain servos")
    values = plain(model, allowed)
    scales = Scales.of(Point.at(model, values))
    own = scales.fitted(values != 0.0, values)
    for number in range(1, settings.MOVES + 1):
        progress(f"effects added, round {number}")
        better = _better(own, scales.others(own, _more(scales, own, allowed), own.likely_from))
        if not better:
            break
        own = _together(scales, own, better)
    return scales.fitted(own.active, own.point.values)


def settled(own: Weighed, allowed: Mask, progress: Callable[[str], None]) -> Choice:
    """Drop, exchange and add parameters, one at a time in each group, until no set beside the choice is better.

    A parameter goes at odds below nine to one, or if nobody could see it; another comes in its place, or beside it,
    where motions held out and the evidence are better, by nine to one of one more. Readings are worth what they are at
    the fit that is settled, not at that of plain servos.
    """
    scales = Scales.of(Point.at(own.scales.model, own.point.values))
    shared, held = scales.model.placed == SHARED, None
    own = replace(own, scales=scales)
    for number in range(1, settings.MOVES + 1):
        progress(f"sets of effects fitted, round {number}")
        if own.active[shared].tobytes() != held or len(scales.model.groups) == 1:  # loads change little with the rest
            scales.model.refreshed(own.point.values)
            scales.forget()
            own, held = scales.fitted(own.active, own.point.values), own.active[shared].tobytes()
        while (fewer := _fewer(scales, own)) is not None:
            own = fewer
        rivals = scales.others(own, _more(scales, own, allowed), own.likely_from)
        if not (better := _better(own, rivals)):  # what the linear problem held to be needed may not be
            better = [one for one in _drops(scales, own) if one.log_evidence > own.likely_from]
        if not better:
            rivals += scales.others(own, _exchanged(scales, own, allowed), own.rival_from)
            better = _better(own, rivals)
        if not better or number == settings.MOVES:
            break
        own = _together(scales, own, better)
    # nothing is a rival that nobody could see, nor one parameter more that evidence wants and motions held out refuse
    near = [one for one in rivals if one.log_evidence > own.rival_from and one.seen[one.own].all()]
    near = [one for one in near if own.log_evidence > one.likely_from or len(one.own) <= len(own.own)]
    near = [one for one in near if _gain(own, one) <= 0.0]
    whole = Weighed(scales, own.active, Point.at(scales.model, own.point.values, own.active))
    return Choice(whole, (*_drops(scales, own), *near))


def _alike(own: Weighed, one: Weighed) -> bool:
    """Tell whether motions held out are as likely by one set as by another, within one standard error.

    That of the difference, by its scatter between motions (Breiman and others, *Classification and Regression Trees*,
    1984, 3.4.3).
    """
    more = one.losses - own.losses
    return bool(more.sum() < len(more) * np.std(more) / np.sqrt(max(len(more) - 1, 1)))


def _better(own: Weighed, every: Sequence[Weighed]) -> list[Weighed]:
    """Return those of some sets that are better than one, the best first, and whose new effects somebody could see."""
    better = [one for one in every if _gain(own, one) > 0.0 and one.seen[one.active & ~own.active].all()]
    return sorted(better, key=lambda one: -_gain(own, one))


def _gain(own: Weighed, one: Weighed) -> float:
    """Log odds of a set against one of as many parameters, less nine to one for each that it has more.

    Zero where motions held out are no better.
    """
    more = max(len(one.own) - len(own.own), 0)
    return one.log_evidence - own.log_evidence - more * np.log(settings.ODDS) if one.loss < own.loss else 0.0


def _drops(scales: Scales, own: Weighed) -> list[Weighed]:
    """Weigh the set without each of its parameters."""
    return _refitted(scales, own, [own.ahead(without(own.active, b)) for b in own.own.tolist()], -np.inf)


def _refitted(scales: Scales, own: Weighed, ahead: Sequence[Weighed], least: float) -> list[Weighed]:
    """Weigh at their own fits sets that the linear problem predicts, begun at its fit or where it predicts theirs."""
    return scales.others(own, [(one.active, (own.point.values, one.point.values)) for one in ahead], least)


def _fewer(scales: Scales, own: Weighed) -> Weighed | None:
    """Backward elimination: return the set without what is not needed in each group of joints, if there is any.

    The linear problem tells the order, and of which several at once it promises so; what joints share comes last, as
    then all are fitted anew.
    """
    placed = scales.model.placed
    ahead = {b: own.ahead(without(own.active, b)) for b in own.own.tolist()}
    order = sorted(ahead, key=lambda b: -ahead[b].log_evidence)
    order = [b for b in order if ahead[b].log_evidence > own.rival_from or not own.seen[b]]

    def queue(joints: Sequence[int]) -> list[Weighed]:
        every = [b for b in order if placed[b] in joints]
        sizes = [n for n in settings.AT_ONCE if n <= len(every) and SHARED not in joints]
        many = [own.ahead(without(own.active, every[:n])) for n in sizes]
        return [one for one in many if one.log_evidence > own.likely_from] + [ahead[b] for b in every]

    turns = zip_longest(*(queue(group) for group in scales.model.groups))
    for turn in (*turns, *([one] for one in queue((SHARED,)))):
        tried, found = [one for one in turn if one is not None], list[Weighed]()
        for hidden, far in ((False, own.rival_from), (True, -np.inf)):
            some = [one for one in tried if own.seen[own.active & ~one.active].any() != hidden]
            found += [one for one in _refitted(scales, own, some, far) if hidden or one.log_evidence > own.likely_from]
        if found:
            return _together(scales, own, found)
    return None


def _together(scales: Scales, own: Weighed, changed: Sequence[Weighed]) -> Weighed:
    """Return the set with the first change of each joint; with one of what all share, that alone.

    Of joints that move each other the first change alone, where that is likelier.
    """
    placed, active, values, taken = scales.model.placed, own.active, own.point.values, set[int]()
    for one in changed:
        other = one.active ^ own.active
        joints = set(placed[other].tolist())
        if SHARED in joints and not taken:
            return one
        if SHARED not in joints and not joints & taken:
            active, taken = active ^ other, taken | joints
            values = np.where(other, one.point.values, values)
    several = scales.others(own, [(active, (values,))])[0]
    alone = len(scales.model.groups) == 1 and several.log_evidence < changed[0].log_evidence
    return changed[0] if alone else several


def _exchanged(scales: Scales, own: Weighed, allowed: Mask) -> list[Proposed]:
    """Propose sets with one parameter exchanged for another one of the same joint, by their partial correlation.

    Its square is the share of the evidence of the one that goes which another keeps, of their derivatives, and of what
    an expected size of each does: of joints that stick and slip one or the other is mostly of moments of slips.
    """
    model, joint, abrupt = scales.model, scales.model.placed, scales.model.of_effects(ABRUPT)
    free, begun = allowed & ~own.active, _begun(own)
    # joints that go their own ways would all be fitted anew for what they share in the place of each of their effects
    together, found = len(model.groups) == 1, dict[tuple[int, int], list[Array]]()
    for base in (scales.linearised(own, free), scales.linearised(own, free, secant=True)):
        for b in own.own.tolist():
            among = (joint == joint[b]) | (joint[b] == SHARED) | ((joint == SHARED) & together)
            places = np.flatnonzero(free & among)
            square, values = base.instead(b, places)
            square = np.where(values < model.least[places], 0.0, square)
            near = (square > settings.ALIKE) | (np.argsort(np.argsort(-square)) < settings.RIVALS)
            near |= abrupt[places] & abrupt[b] & (joint[places] == joint[b])
            for k, value in zip(places[near].tolist(), values[near], strict=True):
                there = np.where(np.arange(len(begun)) == k, np.clip(value, *model.bounds[:, k]), begun)
                found.setdefault((b, k), [begun]).append(there)
    sets = [(own.active ^ np.isin(np.arange(len(begun)), pair), starts) for pair, starts in found.items()]
    return [(active, tuple(np.where(active, one, 0.0) for one in starts)) for active, starts in sets]


def _begun(own: Weighed) -> Array:
    """(P,) start of a fit of a set's parameters and others: the values of its own fit, and where the others begin."""
    return np.where(own.active, own.point.values, own.scales.model.start())


def _more(scales: Scales, own: Weighed, allowed: Mask) -> list[Proposed]:
    """Propose sets with one parameter more: of each joint, and of what all share, the RIVALS likeliest ones.

    By the problem that is linear at the fit; of what is abrupt, which it tells nothing of, all.
    """
    model, free, begun = scales.model, allowed & ~own.active, _begun(own)
    base, abrupt, sets = scales.linearised(own, free), model.of_effects(ABRUPT), list[Proposed]()
    for joint in (*model.joints, SHARED):
        told = [
            base.ahead(own.active | (np.arange(len(free)) == k)) for k in np.flatnonzero(free & (model.placed == joint))
        ]
        told.sort(key=lambda one: -one.log_evidence)
        some = told[: settings.RIVALS] + [one for one in told[settings.RIVALS :] if (one.active & free & abrupt).any()]
        sets += [(one.active, (np.where(one.active, begun, 0.0), one.point.values)) for one in some]
    return sets
