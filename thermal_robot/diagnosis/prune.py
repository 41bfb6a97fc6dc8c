"""Forward selection of unlisted terms, then backward elimination by cross-validation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, stdtr

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.answer import Conclusion
from thermal_robot.diagnosis.attribution import without_laws
from thermal_robot.diagnosis.cross_validation import CrossValidation, Model, schemes
from thermal_robot.diagnosis.residual_tests import ResidualAnalysis, analyse_residual
from thermal_robot.diagnosis.values import Dependence, Location, Refused, Unexplained
from thermal_robot.effects import Effect, JointRipple
from thermal_robot.effects.law import PREFIX
from thermal_robot.effects.law_words import is_event
from thermal_robot.inference import settings
from thermal_robot.inference.explain import Discrepancy, explain, log_odds
from thermal_robot.inference.fit import Fit, less, refit
from thermal_robot.inference.generate import (
    Discovery,
    alike,
    as_ripple,
    candidates,
    discovered,
    events,
    ripple_of,
    waves,
)
from thermal_robot.inference.grouping import STAND, blocks
from thermal_robot.inference.problem import generalised
from thermal_robot.inference.scatter import RandomGap, random_gap
from thermal_robot.inference.weights import Noise


def forward_selection(fit: Fit, number: int, progress: Callable[[str], None]) -> Fit | None:
    """Forward selection: add unlisted terms in competition with all known effects; ``None`` if none is selected.

    Terms are generated from the residual: change points, waves of the joints, laws of any quantity at any place. A law
    that is a wave of a joint's own position competes as ripple. One other law is added at a time, as
    ``discovered.<number>``.
    """
    progress(f"causes that nobody listed: scan {number}")
    held = [effect for effect, _ in fit.effects]
    scanned = candidates(fit, number, events(fit))
    waved = {law: as_ripple(law, fit) for law in scanned}
    laws = tuple(law for law in scanned if waved[law] is None)
    shown = (ripple for ripple in (_ripple(fit), *waved.values()) if ripple is not None)
    ripples = tuple(dict.fromkeys(ripple for ripple in shown if not alike(ripple, ripple_of(fit))))
    offered: dict[str, tuple[Effect, ...]] = {f"{PREFIX}{number}": laws} if laws else {}
    bases = [held]
    if ripples:
        others = [effect for effect in held if not isinstance(effect, JointRipple)]
        offered[JointRipple.name] = ripples
        bases = [*([*others, ripple] for ripple in ripples), others]
    if not offered:
        return None
    before = [effect for effect in bases[0] if effect.name.startswith(PREFIX)]
    starts = [*bases, *([*base, law] for base in (*bases, before) for law in laws)]
    wider = refit(fit, offered, starts, progress)
    return wider if any(effect.name in offered for effect, _ in wider.effects) else None


def _ripple(fit: Fit) -> JointRipple | None:
    """Significant waves in the residual as joint ripple; ``None`` without any, with very many rows, or if left out."""
    if JointRipple.name not in fit.variants or fit.campaign.samples > settings.RIPPLE_ROWS:
        return None
    return found if (found := waves(fit)).orders else None


def attributed_to_laws(left: Unexplained, found: Sequence[Discovery], discrepancy: Discrepancy) -> Unexplained:
    """Residual of the known effects, with the places and quantities of the laws that explain it.

    Without laws, the place is that of a per-pose or per-visit discrepancy, if any.
    """
    kernel = discrepancy.kernel
    if not found and left.flagged and kernel is not None and kernel.grouped and kernel.place[0]:
        return replace(left, locations=(Location(*kernel.place, discrepancy.kernels[kernel.name]),), depends_on=())
    if not found:
        return left
    places: dict[tuple[str, str], float] = {}
    followed: dict[str, float] = {}
    for discovery in found:
        for place, probability in discovery.places:
            places.setdefault(place, probability)
        for quantity, probability in discovery.quantities[:1]:
            followed.setdefault(quantity, max(1.0 - probability, 0.0))
    locations = tuple(
        Location(kind, name, min(p, 1.0)) for (kind, name), p in places.items() if p >= settings.LIKELY_PLACE
    )
    return replace(
        left,
        flagged=True,
        locations=locations,
        depends_on=tuple(Dependence(name, p) for name, p in followed.items()),
    )


def selected_with_scatter(
    fit: Fit, chance: RandomGap, refused: Mapping[str, Refused], progress: Callable[[str], None]
) -> Conclusion:
    """Repeat the model selection with the joints' scatter (``chance``) in the covariance of the noise.

    Effects and laws that only fitted the scatter then drop out.
    """
    e = fit.explanation
    scatter, sensitivity = chance.scatter, fit.corrected.joint_sensitivity
    covariance = scatter.covariance(sensitivity, replace(e.whitening, noise=scatter.noise).sigma())
    linear = generalised(e.linear, covariance, scatter.noise)
    place, *turn = (float(s) for s in scatter.noise[::3])
    noise = Noise(place, turn[0] if turn else None)
    # what obeys the rule is asked whether it stays
    linear = replace(linear, blocks=tuple(linear.blocks[b] for b in e.best.blocks))
    families = [item.effect.name for item in linear.blocks]
    again = explain(linear, noise, families=families)
    kept = {families[b] for b in again.best.blocks}
    feigned: dict[str, tuple[Effect, ...]] = {name: () for name in dict.fromkeys(fit.families) if name not in kept}
    own = {name: [b for b, family in enumerate(families) if family == name] for name in feigned}
    chances = {n: again.probability(blocks) if blocks else fit.probability(n) for n, blocks in own.items()}
    refused = {**refused, **{name: Refused(p) for name, p in chances.items() if not name.startswith(PREFIX)}}
    fit = refit(fit, feigned, [[linear.blocks[b].effect for b in again.best.blocks]], progress)
    chance = random_gap(fit)
    sigma = replace(fit.explanation.whitening, noise=chance.scatter.noise).sigma()
    covariance = chance.scatter.covariance(fit.corrected.joint_sensitivity, sigma)[:, :3, :3]
    floor = float(np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean() / 3.0))
    left = Unexplained(not chance.explains_size, 0.0, chance.p_value)
    if left.flagged:
        left = analyse_residual(fit, progress).unexplained
    return concluded(fit, ResidualAnalysis(left, floor, "scatter"), chance, refused)


def concluded(fit: Fit, left: ResidualAnalysis, chance: RandomGap, refused: Mapping[str, Refused]) -> Conclusion:
    """Conclusion of a fit, in which what discovered laws explain counts as residual of the known effects."""
    laws = discovered(fit)
    unexplained = attributed_to_laws(without_laws(fit, left.unexplained), laws, fit.explanation.discrepancy)
    return Conclusion(fit, laws, unexplained, left, chance, refused)


@dataclass(frozen=True)
class DensityGain:
    """Held-out log predictive density of one effect under one cross-validation scheme.

    ``nats`` is its gain over all rows held out, ``error`` its standard error with ``freedom`` degrees of freedom;
    ``share`` is 1 − (rms with it / rms without it)² of these rows, noise included.
    """

    scheme: str
    share: float
    nats: float
    error: float
    freedom: int

    @property
    def chance(self) -> float:
        """Probability, by Student's t, that the density is higher with the effect."""
        return float(stdtr(self.freedom, self.nats / max(self.error, np.finfo(float).tiny)))


_NOT_ASKED = DensityGain("time", 0.0, 0.0, np.inf, 1)


@dataclass(frozen=True)
class HeldOutTest:
    """Cross-validation of one effect against the refitted model without it, under each scheme.

    The first scheme holds out stands, or else blocks of consecutive rows, as the answer does; the others conditions,
    regions and ends of ranges.
    """

    gains: tuple[DensityGain, ...]

    @property
    def blocked(self) -> DensityGain:
        """Gain under the scheme of the answer: on stands held out, or else on blocks of consecutive rows."""
        return next((gained for gained in self.gains if gained.scheme in (STAND, "time")), _NOT_ASKED)

    @property
    def hardest(self) -> DensityGain:
        """Gain under the scheme in which the effect least probably raises the held-out density."""
        return min(self.gains, key=lambda gained: gained.chance, default=_NOT_ASKED)

    @property
    def clearly(self) -> bool:
        """Whether in some scheme the odds exceed nine that the held-out predictive density is lower with the effect."""
        return self.hardest.chance < 1.0 / (1.0 + settings.NAMING_ODDS)

    @property
    def harms(self) -> bool:
        """Whether the held-out predictive density is lower with the effect: :attr:`blocked`, or :attr:`clearly`."""
        return self.blocked.nats < 0.0 or self.clearly

    @property
    def helps(self) -> bool:
        """Whether the :attr:`blocked` density is significantly (97.5 %) higher with the effect, and none harms."""
        return self.blocked.chance > settings.INTERVAL[1] and not self.harms


def held_out_tests(fit: Fit) -> dict[str, HeldOutTest]:
    """Cross-validate every effect and law of a fit: paired differences of held-out log predictive densities.

    The density of a row is Student's with ν degrees of freedom, −½ (ν + m) log(1 + |r|²/ν), r what is left of its m
    components in units of the noise (Vehtari, Gelman and Gabry, *Statistics and Computing* 27, 2017, on elpd and its
    standard error): robust to a few rows. The standard error is that of the sums over blocks of consecutive rows. An
    effect within a single block gains nothing, as other rows do not predict it.

    Rows are also held out by condition, by region, and at the ends of each joint's range. There, effects that
    compensate each other only within the measured range fail. Events are tested in blocks of consecutive rows alone,
    since a whole session held out contains all that an event did.
    """
    block = blocks(fit.campaign)
    model = Model.of(fit.explanation, block)
    walks = [(name, CrossValidation.over(model, tests)) for name, _, tests in schemes(fit)]
    every = range(len(model.spans))
    found: dict[str, list[DensityGain]] = {effect.name: [] for effect, _ in fit.effects}
    for name, validation in walks:
        if not validation.tests:
            continue
        judged = model.kept[validation.numbers]
        number = validation.numbers[judged]
        noise = model.whitening.sigma(number) * fit.explanation.best.noise
        left = validation.residuals(every)[judged] / noise
        for k, (effect, _) in enumerate(fit.effects):
            if name != "time" and is_event(effect):
                continue
            without = validation.residuals([b for b in every if b != k])[judged] / noise
            found[effect.name].append(_density_gain(name, left, without, block[number]))
    return {name: HeldOutTest(tuple(own)) for name, own in found.items()}


def _density_gain(scheme: str, left: Array, without: Array, block: NDArray[np.int64]) -> DensityGain:
    after, before = (left**2).sum(axis=1), (without**2).sum(axis=1)
    total = float(before.sum())
    share = 1.0 - float(after.sum()) / total if total > 0.0 else 0.0
    density = 0.5 * (settings.TAILS + left.shape[1]) * np.log((settings.TAILS + before) / (settings.TAILS + after))
    parts = np.bincount(block, density)[np.unique(block)]
    freedom = len(parts) - 1
    error = float(np.sqrt(len(parts) * parts.var(ddof=1))) if freedom else np.inf
    return DensityGain(scheme, share, float(parts.sum()), error, max(freedom, 1))


def pruned(
    fit: Fit, progress: Callable[[str], None], lost: Mapping[str, Refused] | None = None
) -> tuple[Fit, dict[str, Refused]]:
    """Backward elimination by cross-validation until every remaining term obeys one rule.

    The rule: posterior odds of at least nine against nothing in its place, a held-out density that is not lower (of a
    law, but no event: significantly higher), and at least one determined direction. All clearly harmful terms are
    removed at once, as they may compensate each other; the others one at a time, the smallest held-out gain first. Also
    returns the removed effects by name. Terms that are ``lost`` are removed first.
    """
    refused: dict[str, Refused] = {}
    exact, out = True, lost or {}
    while True:
        out = out or (_failing(fit, progress) if fit.effects else {})
        if out:
            refused |= {name: why for name, why in out.items() if not name.startswith(PREFIX)}
            fit, exact, out = less(fit, *out), False, {}
        elif exact:
            return fit, refused
        else:
            fit, exact = refit(fit, {}, (), progress), True


def _failing(fit: Fit, progress: Callable[[str], None]) -> dict[str, Refused]:
    """Terms to remove next, with the reason: all clearly harmful ones, else of those that break the rule the worst."""
    table = held_out_tests(fit)
    if harmful := {name: _refused(e) for name, e in table.items() if e.clearly}:
        progress(f"rows held out refuse {', '.join(harmful)}")
        return harmful
    odds, blind = odds_in_place(fit), undetermined(fit)
    laws = {law.name for law, _ in fit.effects if law.name.startswith(PREFIX) and not is_event(law)}
    poor = {name for name, e in table.items() if e.harms or (name in laws and not e.helps)}
    out = poor | {name for name in table if odds[name] < settings.NAMING_ODDS or name in blind}
    if not out:
        return {}
    worst = min(out, key=lambda name: table[name].blocked.nats)
    why = "rows held out refuse" if worst in poor else "nothing determines" if worst in blind else "in question:"
    progress(f"{why} {worst}")
    if worst in poor:
        return {worst: _refused(table[worst])}
    return {worst: blind.get(worst, Refused(fit.probability(worst)))}


def odds_in_place(fit: Fit) -> dict[str, float]:
    """Posterior odds of each effect and law against nothing in its place, of a law at most those of place and quantity.

    Alternatives of an effect do not count here: they are reported as confounded. The odds are capped at
    ``NAMING_ODDS``² times, for a law, the probability of its place and quantity.
    """
    odds = {name: fit.odds(name) for name in fit.names_of(fit.explanation.best)}
    told = {d.law.name: d.probability for d in discovered(fit)}
    return {name: min(own, settings.NAMING_ODDS**2 * told.get(name, 1.0)) for name, own in odds.items()}


def undetermined(fit: Fit) -> dict[str, Refused]:
    """Effects and laws of a fit of which the data determine no direction, with at most their prior probability.

    Determined means that the posterior standard deviation is below half the prior's along some principal axis.
    """
    e, seen = fit.explanation, set()
    for b in e.best.blocks:
        prior = e.linear.blocks[b].sizes * e.best.scales[b]
        variances = np.linalg.eigvalsh(e.values[b][1] / np.outer(prior, prior))
        if variances.min(initial=np.inf) < settings.DETERMINED**2:
            seen.add(fit.families[b])
    lost = sorted(fit.names_of(e.best) - seen)
    return {name: Refused(min(fit.probability(name), settings.PRIOR_PROBABILITY)) for name in lost}


def unsupported(fit: Fit, inflated: Fit) -> dict[str, Refused]:
    """Effects and laws of a fit that structure in the residual may mimic, with at most their prior probability.

    The covariance that is ``inflated`` for structure leaves all their directions undetermined, and their held-out
    density is not significantly higher.
    """
    lost = undetermined(inflated)
    table = held_out_tests(fit) if lost else {}
    return {name: why for name, why in lost.items() if not table[name].helps}


def _refused(judged: HeldOutTest) -> Refused:
    """Record why an effect is removed: probability from prior odds and held-out log density, and its held-out share.

    The probability is at most the prior's: a gain of density does not count.
    """
    said = judged.hardest if judged.clearly else judged.blocked
    return Refused(float(expit(log_odds() + min(judged.blocked.nats, 0.0))), said.share)
