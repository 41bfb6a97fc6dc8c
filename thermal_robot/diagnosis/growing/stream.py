"""A diagnosis and the rows that came after it: what is held, the fit to all, and whether the choice still stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaln

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import CLOCK
from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.begun import begun, can_grow
from thermal_robot.diagnosis.growing.choice import together, without_columns
from thermal_robot.diagnosis.growing.grown import Grown
from thermal_robot.diagnosis.growing.received import weighed
from thermal_robot.diagnosis.growing.runners import Runner, ahead, runners
from thermal_robot.diagnosis.growing.watched import Agreement, Watch, scatter_of
from thermal_robot.effects import gate, library
from thermal_robot.errors import EstimationError
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import blocks, each
from thermal_robot.observations import observe
from thermal_robot.prediction import Spread


@dataclass(frozen=True, eq=False)
class Stream:
    """All rows of a diagnosis and since.

    ``fit`` is the diagnosis's, ``grown`` that of its choice to all rows, ``watch`` what new rows are compared with,
    ``agreement`` that of the last rows. ``rival`` is the best combination of ``runners`` by all rows so far, ``lead``
    its log odds against the chosen one, −∞ for none. ``fallen``: what new rows said against the choice, one sentence a
    reason; it stays.
    """

    fit: Fit
    grown: Grown
    watch: Watch
    runners: tuple[Runner, ...]
    agreement: Agreement
    rival: tuple[str, ...] = ()
    lead: float = -np.inf
    fallen: tuple[str, ...] = ()

    @classmethod
    def of(cls, fit: Fit) -> Stream:
        """Begin with a diagnosis.

        Raises :class:`EstimationError` if rows of one pose have something in common that is drawn anew for each: all
        rows tell how much.
        """
        if not can_grow(fit):
            raise EstimationError(
                f"{fit.campaign.name}: what remains is drawn anew in every pose or visit, and how rows count depends "
                "on all of them; diagnose old and new rows together"
            )
        grown = begun(fit)
        return cls(fit, grown, _watch(fit), _behind(grown, runners(fit)), Agreement())

    def plus(self, rows: Campaign, spread: Spread | None) -> Stream:
        """Return the same with further rows; ``spread`` says where the model was measured."""
        new, before = weighed(self.grown.choice, rows), sum(one.campaign.samples for one in self.grown.batches)
        agreement = self.watch.look(self.grown, new, self.agreement) if rows.samples else self.agreement
        after = replace(self, grown=self.grown.plus(new), agreement=agreement)
        if not rows.samples:
            return after
        after = after._weighed()
        found = [*after._misfits(), *_beyond(spread, rows, before), *after._testable()]
        if not after.grown.fitted.steady:
            found.append("The fit of the chosen effects to all rows does not come to rest.")
        return replace(after, fallen=tuple(dict.fromkeys((*self.fallen, *found))))

    def _misfits(self) -> Iterator[str]:
        """Yield what is unlikely where the robot and its noise are as they were."""
        a, level = self.agreement, settings.LEVEL / settings.TESTS
        if a.p_batch < level:
            yield (
                f"The new rows leave {a.chi2 / a.figures:.3g} times the mean square that noise and the parameters' "
                f"deviations allow (p = {a.p_batch:.1g})."
            )
        elif a.p_whole < level:
            yield (
                f"The rows since the diagnosis leave {a.whole / a.whole_figures:.3g} times the mean square that noise "
                f"and the parameters' deviations allow (p = {a.p_whole:.1g})."
            )
        if a.p_change < level:
            effect, parameter = a.changed
            yield (
                f"Something begins with the new rows that {effect} would explain, most of it in {parameter} "
                f"(p = {a.p_change:.1g})."
            )
        if a.p_aside < level:
            yield f"{a.aside} of {a.rows} rows since the diagnosis are gross errors (p = {a.p_aside:.1g})."

    def _testable(self) -> Iterator[str]:
        """Yield the effects that could not be tested, and can be with what the new rows recorded."""
        known = library()
        asked = [(name, needs) for name, needs in self.fit.needs.items() if name in known]
        if not asked:
            return
        both = observe(self.grown.fitted.single.campaign, self.grown.fitted.point.frames)
        for name, needs in asked:
            if not gate.missing(known[name], both):
                yield f"{name} could not be tested without {', '.join(needs)}, and now can be."

    def _weighed(self) -> Stream:
        """Return the same with the best of the combinations that may come first."""
        if not self.runners:
            return self
        gain = ahead(self.grown, self.runners)
        best = int(np.argmax(gain))
        return replace(self, rival=self.runners[best].names, lead=float(gain[best]))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the choice is to be made anew, one sentence each; empty while it stands."""
        return (*self.fallen, *self._overtaken())

    def _overtaken(self) -> Iterator[str]:
        """Yield the combination that explains all rows better now."""
        if self.lead > settings.LEAD:
            own = dict.fromkeys(effect.name for effect in self.grown.choice.effects)
            told, before = (" and ".join(some) or "no effect" for some in (self.rival, own))
            same = set(self.rival) == set(own)
            rest = "in other settings or places than chosen" if same else f"rather than {before}"
            odds = np.exp(min(self.lead, settings.MOST_LEAD))
            yield f"All rows together speak for {told}, {rest} (odds {odds:.2g} : 1)."


def _behind(grown: Grown, listed: tuple[Runner, ...]) -> tuple[Runner, ...]:
    """Return the combinations that are behind the chosen one by the rows of the diagnosis alone.

    What it preferred to a more probable one for other reasons stays preferred.
    """
    if not listed:
        return ()
    return tuple(runner for runner, gain in zip(listed, ahead(grown, listed), strict=True) if gain < 0.0)


def _watch(fit: Fit) -> Watch:
    e, campaign = fit.explanation, fit.campaign
    kept = ~e.outliers
    left = (fit.corrected.gap / (e.whitening.sigma() * e.best.noise))[kept]
    first = [own[0] for own in fit.variants.values() if own]
    tested = [without_columns(block(fit.nominal, f), gate.delivered(f, fit.nominal), left.shape[1]) for f in first]
    apart = [own[kept] for own in each(blocks(campaign)) if own[kept].any()]
    return Watch(
        tuple(item for item in tested if len(item.sizes)),
        scatter_of(left, apart),
        int(e.outliers.sum()),
        campaign.samples,
    )


def _beyond(spread: Spread | None, rows: Campaign, before: int) -> Iterator[str]:
    """Yield that many of the new rows leave what was measured by ``before`` rows, and not by chance.

    Of rows in no particular order, the k of n new ones that are the outermost of all N + n, at either end, have the
    chance (k + 1) · n!/(n − k)! · (N + n − k)!/(N + n)!.
    """
    known = () if spread is None else spread.outside(rows)
    outside = [[name for name in names if name not in CLOCK] for names in known]  # time goes on
    count, n = sum(bool(names) for names in outside), rows.samples
    if spread is None or count < max(settings.FEWEST_OUTSIDE, settings.OUTSIDE * n):
        return
    for name in dict.fromkeys(name for own in outside for name in own):
        k = sum(name in own for own in outside)
        chance = np.log(k + 1.0) + gammaln([n + 1.0, before + n - k + 1.0]).sum()
        chance -= gammaln([n - k + 1.0, before + n + 1.0]).sum()
        if chance + np.log(len(spread.ranges)) < np.log(settings.LEVEL / settings.TESTS):
            yield f"{k} of {n} new rows lie outside of what was measured, in {name}."


def expected_sizes(stream: Stream) -> Array:
    """(P,) prior standard deviation of every parameter, SI."""
    scales = stream.grown.fitted.best.scales
    return together([item.sizes * scales[k] for k, item in enumerate(stream.grown.choice.blocks)])
