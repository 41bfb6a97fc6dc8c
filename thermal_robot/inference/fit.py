"""The whole fit: frames, then effects jointly, then the exact model of the explanation by Gauss-Newton."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.settings import STILL
from thermal_robot.effects import Effect, gate
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.columns import frame_columns, unknown_frames
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.explain import Explanation
from thermal_robot.inference.frames import register
from thermal_robot.inference.gauss_newton import gauss_newton
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.rows import near_repeats
from thermal_robot.inference.settle import Settled, settle
from thermal_robot.observations import Observations, observe


@dataclass(frozen=True, eq=False)
class Fit:
    """What was fitted, at the two places that a diagnosis compares.

    ``nominal`` are the observations of the nominal robot with its unknown frames fitted, ``before`` the linear problem
    there; ``corrected`` those of the corrected model, where ``explanation`` is linearised. ``effects`` have their (P,)
    values, ``families`` names the effect of each block, ``needs`` says what effects that cannot be tested lack,
    ``variants`` by name which settings were compared.
    """

    campaign: Campaign
    nominal: Observations
    before: Linear
    corrected: Observations
    explanation: Explanation
    effects: tuple[tuple[Effect, Array], ...]
    families: tuple[str, ...]
    needs: dict[str, tuple[str, ...]]
    variants: dict[str, tuple[Effect, ...]]

    def blocks_of(self, name: str) -> list[int]:
        """Return the blocks of one effect: its settings."""
        return [b for b, family in enumerate(self.families) if family == name]

    def names_of(self, combination: Combination) -> frozenset[str]:
        """Return the effects of a combination of blocks."""
        return frozenset(self.families[b] for b in combination.blocks)

    def probability(self, name: str) -> float:
        """Posterior probability that an effect is at work, in whatever setting."""
        return self.explanation.probability(self.blocks_of(name))

    def probability_of_just(self, names: Set[str]) -> float:
        """Posterior probability of exactly this set of effects, summed over their settings."""
        e = self.explanation
        return min(float(e.probabilities[[self.names_of(c) == names for c in e.combinations]].sum()), 1.0)

    def odds(self, name: str) -> float:
        """Odds of an effect of the explanation against nothing in its place."""
        best = self.names_of(self.explanation.best)
        return self.probability_of_just(best) / max(self.probability_of_just(best - {name}), settings.TINY)


def fit(campaign: Campaign, effects: Sequence[Effect], progress: Callable[[str], None] = lambda _: None) -> Fit:
    """Fit frames, choose effects and refit the choice exactly, until a Gauss-Newton step moves nothing measurable.

    Raises :class:`EstimationError` if there are too few different poses for the unknown frames.
    """
    progress("unknown frames")
    require_enough(campaign)
    nominal = observe(campaign, register(campaign))
    needs = {e.name: missing for e in effects if (missing := gate.missing(e, nominal))}
    variants = {e.name: _settings(e, nominal) for e in effects if e.name not in needs}
    settled = settle(nominal, variants, progress)
    return _fitted(campaign, settled, needs, variants)


def _settings(effect: Effect, observations: Observations) -> tuple[Effect, ...]:
    """Return the settings of an effect that are compared, in all its joints and in each alone."""
    known = gate.variants(effect, observations)
    return tuple(dict.fromkeys((*known, *gate.alone(known[0], observations))))


def less(known: Fit, *names: str) -> Fit:
    """Backward elimination: a fit without some effects, the others chosen anew in the same linear problem.

    Weights and all that was weighed stay; the choice is fitted exactly.
    """
    explanation = known.explanation.without([b for name in names for b in known.blocks_of(name)])
    linear = [(explanation.linear.blocks[b].effect, explanation.values[b][0]) for b in explanation.best.blocks]
    corrected, held = gauss_newton(
        known.campaign, known.corrected.frames, explanation, linear, settings.SETTLED_BETWEEN, known.effects
    )
    variants = {other: own for other, own in known.variants.items() if other not in names}
    return replace(known, explanation=explanation, corrected=corrected, effects=tuple(held), variants=variants)


def refit(
    known: Fit,
    variants: Mapping[str, tuple[Effect, ...]],
    starts: Sequence[Sequence[Effect]] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Choose again at the exact model of a fit, with other settings to choose from, such as discovered laws.

    ``variants`` replace those of the fit by name, or join them; none takes the effect out. The search starts from each
    of the ``starts``, by default from the effects of the fit.
    """
    whole = {name: own for name, own in {**known.variants, **variants}.items() if own}
    # rows that were set aside are judged anew beside what joins: they may be what it explains
    before = None if starts and known.explanation.outliers.any() else known.explanation
    settled = settle(known.corrected, whole, progress, held=known.effects, before=before, starts=starts)
    return _fitted(known.campaign, settled, known.needs, whole)


def _fitted(
    campaign: Campaign,
    settled: Settled,
    needs: dict[str, tuple[str, ...]],
    variants: dict[str, tuple[Effect, ...]],
) -> Fit:
    explanation = settled.explanation
    nominal = observe(campaign, register(campaign, ~explanation.outliers))
    before = Linear(nominal.gap, frame_columns(nominal)[0], ())
    corrected = settled.observations if settled.held else nominal
    return Fit(campaign, nominal, before, corrected, explanation, settled.held, settled.families, needs, variants)


def require_enough(campaign: Campaign) -> None:
    """Refuse a campaign that leaves nothing to tell effects by once the frames are fitted and a fold is held out."""
    still = np.unique(np.round(campaign.q / STILL), axis=0)  # an encoder's jitter makes no other pose
    poses = min(len(still), len(np.unique(near_repeats(campaign))))  # nor do rows of one label
    unknown, measures = len(unknown_frames(campaign)), campaign.orientation is not None
    fewest = -(-(unknown + settings.SPARE_EQUATIONS) // (6 if measures else 3)) + 2
    if poses < fewest:
        raise EstimationError(
            f"{poses} different poses are too few: {unknown} unknowns of the frames need at least {fewest} of them, "
            "and effects many more"
        )
