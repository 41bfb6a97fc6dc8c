"""The whole estimation: frames, then effects jointly, then the exact model of the explanation by Gauss-Newton."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.effects import Effect
from thermal_robot.errors import EstimationError
from thermal_robot.inference.columns import block, displacement, frame_columns
from thermal_robot.inference.explain import Explanation, Noise, explain
from thermal_robot.inference.frames import moved, register
from thermal_robot.inference.problem import Linear, contained
from thermal_robot.inference.refine import refined
from thermal_robot.inference.rows import neighbourhoods, spells
from thermal_robot.observations import Frames, Observations, observe

Array = NDArray[np.float64]

_STEPS = 12
_REVISIONS = 3
_MANY_ROWS = 5000  # above, a choice is revised once: it takes seconds, and so many rows hardly change it
_SETTLED = 1e-4  # last step of a fit, in standard deviations
_NEAR = 2.0  # of one of many rows that is chosen anew: the step after it would be a hundredth of it
_REFINEMENT = 1.6
_LARGE = 0.02  # rad or m
_NO_WORSE = 1.02
_SPARE = 6  # equations that must be left when the frames are fitted


@dataclass(frozen=True, eq=False)
class Fit:
    """What was fitted, at the two places that a diagnosis compares.

    Attributes
    ----------
    campaign
        The data.
    nominal
        Observations of the nominal robot with its unknown frames fitted and nothing else.
    before
        Linear problem there.
    corrected
        Observations of the corrected model.
    explanation
        Effects, outliers, noise; linearised at the corrected model.
    effects
        Each effect of the explanation with its (P,) values.
    families
        Name of the effect that each block of the explanation belongs to.
    needs
        Effects that cannot be tested, and what they would need.
    settings
        By name: the settings of each effect that were compared.
    rarity
        By name of a law that was discovered: what being picked out of many costs its log prior odds.
    """

    campaign: Campaign
    nominal: Observations
    before: Linear
    corrected: Observations
    explanation: Explanation
    effects: tuple[tuple[Effect, Array], ...]
    families: tuple[str, ...]
    needs: dict[str, tuple[str, ...]]
    settings: dict[str, tuple[Effect, ...]]
    rarity: dict[str, float]


def fit(campaign: Campaign, effects: Sequence[Effect], progress: Callable[[str], None] = lambda _: None) -> Fit:
    """Fit frames, choose effects, refit the choice exactly.

    Parameters
    ----------
    campaign
        With measurements.
    effects
        Candidates.
    progress
        Called with a few words at each stage.

    Returns
    -------
    Fit
        Converged: another Gauss-Newton step would move nothing that can be measured.

    Raises
    ------
    EstimationError
        If there are too few different poses for the unknown frames.
    """
    progress("unknown frames")
    _require_enough(campaign)
    nominal = observe(campaign, register(campaign))
    needs = {e.name: missing for e in effects if (missing := e.missing(nominal))}
    settings = {e.name: e.variants(nominal) for e in effects if e.name not in needs}
    groups = row_groups(campaign)
    settled = _settle(nominal, settings, groups, progress)
    if settled.second_order:
        # a container fits large errors of the effects inside it before they are linear: let those try without it
        inside = {n: v for n, v in settings.items() if n not in settled.containers}
        apart = _settle(nominal, inside, groups, progress)
        if apart.noise <= _NO_WORSE * settled.noise:
            again = _settle(apart.observations, settings, groups, progress, apart)
            settled = settled if set(again.names) & settled.containers else again
    return _fitted(campaign, settled, needs, settings, {})


def refit(
    known: Fit,
    laws: Mapping[str, tuple[Effect, ...]],
    begin: Sequence[str],
    rarity: Mapping[str, float],
    progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Fit again with laws that were discovered among the effects to choose from.

    Parameters
    ----------
    known
        The fit that left a remainder.
    laws
        By name: settings of each law.
    begin
        Names of the effects and laws with which the search starts.
    rarity
        By name: see :class:`Fit`.
    progress
        Called with a few words at each stage.
    """
    settings = {**known.settings, **laws}
    whole = {**known.rarity, **rarity}
    groups = row_groups(known.campaign)
    settled = _settle(known.nominal, settings, groups, progress, begin=begin, rarity=whole)
    return _fitted(known.campaign, settled, known.needs, settings, whole)


def _fitted(
    campaign: Campaign,
    settled: _Settled,
    needs: dict[str, tuple[str, ...]],
    settings: dict[str, tuple[Effect, ...]],
    rarity: dict[str, float],
) -> Fit:
    explanation = settled.explanation
    nominal = observe(campaign, register(campaign, ~explanation.outliers))
    before = Linear(nominal.gap, frame_columns(nominal)[0], ())
    corrected = settled.observations if settled.held else nominal
    return Fit(
        campaign, nominal, before, corrected, explanation, settled.held, settled.families, needs, settings, rarity
    )


def _require_enough(campaign: Campaign) -> None:
    """Refuse a campaign that leaves nothing to tell effects by once the frames are fitted and a fold is held out."""
    poses = len(np.unique(np.round(campaign.q, 6), axis=0))
    unknown, measures = (
        frame_columns(observe(campaign.take(np.arange(1))))[0].shape[2],
        campaign.orientation is not None,
    )
    fewest = -(-(unknown + _SPARE) // (6 if measures else 3)) + 2
    if poses < fewest:
        raise EstimationError(
            f"{poses} different poses are too few: {unknown} unknowns of the frames need at least {fewest} of them, "
            "and effects many more"
        )


@dataclass(frozen=True, eq=False)
class _Settled:
    """An explanation and the exact model at which it was found."""

    observations: Observations
    explanation: Explanation
    held: tuple[tuple[Effect, Array], ...]
    families: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(effect.name for effect, _ in self.held)

    @property
    def noise(self) -> float:
        """What remains per axis, m."""
        return float(self.explanation.whitening.noise[0] * self.explanation.best.noise)

    @property
    def containers(self) -> set[str]:
        """Effects of the explanation that contain others."""
        slices, pairs = self.explanation.problem.slices, contained(self.explanation.problem)
        larger = {max(pair, key=lambda b: slices[b].stop - slices[b].start) for pair in pairs}
        return {self.families[b] for b in larger} & set(self.names)

    @property
    def second_order(self) -> bool:
        """Whether a container holds so much that products of its parameters show."""
        moved_by, _ = displacement(self.observations, [h for h in self.held if h[0].name in self.containers])
        return bool(np.abs(np.asarray(moved_by.segment)).max(initial=0.0) > _LARGE)


def _settle(
    start: Observations,
    settings: dict[str, tuple[Effect, ...]],
    groups: Sequence[NDArray[np.int64]],
    progress: Callable[[str], None],
    known: _Settled | None = None,
    begin: Sequence[str] = (),
    rarity: Mapping[str, float] | None = None,
) -> _Settled:
    """Choose effects, refine their constants, refit exactly, and choose again there, until the choice stays."""
    campaign, observations, settings = start.campaign, start, dict(settings)
    noise = Noise(campaign.noise_position, campaign.noise_orientation)
    held: list[tuple[Effect, Array]] = []
    outliers = None
    if known is not None:
        held, outliers = list(known.held), known.explanation.outliers
        settings.update({effect.name: (effect,) for effect, _ in held})
    many = campaign.samples > _MANY_ROWS
    revisions = 1 if many else _REVISIONS
    for revision in range(revisions + 1):
        progress("combinations of effects" if revision == 0 else f"exact fit, revision {revision}")
        candidates, families = _listed(settings)
        chosen = [candidates.index(effect) for effect, _ in held]
        start_at = chosen if revision or not begin else [families.index(name) for name in begin]
        blocks = tuple(block(observations, c) for c in candidates)
        moved_by = (blocks[b].columns @ v for b, (_, v) in zip(chosen, held, strict=True))
        linear = Linear(
            observations.gap + sum(moved_by, np.zeros_like(observations.gap)), frame_columns(observations)[0], blocks
        )
        explanation = explain(
            linear, noise, families=families, start=start_at, outliers=outliers, groups=groups, rarity=rarity
        )
        factor = _REFINEMENT ** (1 / 2**revision)
        held = [(candidates[b], explanation.values[b][0]) for b in explanation.best.blocks]
        finer = refined(explanation, observations, factor) if revision < revisions else held
        stays = [e for e, _ in finer] == [e for e, _ in held] and set(explanation.best.blocks) == set(chosen)
        held, last = finer, revision == revisions or (revision > 0 and stays)
        least = _NEAR if many and not last else _SETTLED
        observations, held = _gauss_newton(campaign, observations.frames, explanation, held, least)
        if last:
            break
        outliers = explanation.outliers
        for effect, _ in held:
            settings[effect.name] = effect.nearby(factor)
    return _Settled(observations, explanation, tuple(held), families)


def row_groups(campaign: Campaign) -> tuple[NDArray[np.int64], ...]:
    """Return the groupings within which a remainder may be alike: spells of time and neighbourhoods of poses."""
    count = max(campaign.samples // 5, 2) if campaign.samples < 300 else 60
    return spells(campaign, count), neighbourhoods(campaign, count)


def _gauss_newton(
    campaign: Campaign,
    frames: Frames,
    explanation: Explanation,
    held: Sequence[tuple[Effect, Array]],
    settled: float,
) -> tuple[Observations, list[tuple[Effect, Array]]]:
    """Refit frames and the explanation's parameters with the exact model, the priors held at their scales."""
    whitening, best = explanation.whitening, explanation.best
    effects = [effect for effect, _ in held]
    sizes = [explanation.linear.blocks[b].sizes * best.scales[b] for b in best.blocks]
    ends = np.cumsum([len(size) for size in sizes])[:-1]
    prior = np.concatenate([*sizes, np.zeros(0)])
    state = np.concatenate([*(values for _, values in held), np.zeros(0)])
    used = np.flatnonzero(whitening.weights > 0)
    root = (np.sqrt(whitening.weights[used])[:, None] / (whitening.noise * best.noise)).ravel()

    def pairs() -> list[tuple[Effect, Array]]:
        return list(zip(effects, np.split(state, ends), strict=True)) if effects else []

    observations = corrected_observations(campaign, frames, pairs())
    for _ in range(_STEPS):
        flat, names = frame_columns(observations)
        columns = [block(observations, effect).columns for effect in effects]
        design = np.concatenate([flat, *columns], axis=2)[used].reshape(len(root), -1) * root[:, None]
        step, size = _ridge_step(design, observations.gap[used].ravel() * root, state, prior)
        frames = moved(frames, step[: len(names)], names)
        state = state + step[len(names) :]
        observations = corrected_observations(campaign, frames, pairs())
        if size < settled:
            break
    return observations, pairs()


def _ridge_step(design: Array, gap: Array, state: Array, prior: Array) -> tuple[Array, float]:
    """Return the step that minimises |gap − design step|² + |(state + step)/prior|², and what it moves, in noise.

    The first columns have no prior. Directions that nothing determines are not moved. A step along directions that do
    nearly the same moves little, however long it is.
    """
    flat = design.shape[1] - len(prior)
    matrix, vector = design.T @ design, design.T @ gap
    matrix[np.arange(flat, len(matrix)), np.arange(flat, len(matrix))] += 1.0 / prior**2
    vector[flat:] -= state / prior**2
    length = np.sqrt(np.diag(matrix)) + 1e-300
    value, basis = np.linalg.eigh(matrix / np.outer(length, length))
    seen = value > 1e-13 * value.max(initial=0.0)
    step = basis[:, seen] @ ((basis[:, seen].T @ (vector / length)) / value[seen])
    return step / length, float(np.sqrt((value[seen] * (basis[:, seen].T @ step) ** 2).sum()))


def corrected_observations(campaign: Campaign, frames: Frames, pairs: Sequence[tuple[Effect, Array]]) -> Observations:
    """Observe with the effects at work; their responses are read from the nominal robot, as prediction reads them."""
    moved_by, instrument = displacement(observe(campaign, frames), pairs)
    return observe(campaign, frames, displacement=moved_by, instrument=instrument)


def _listed(settings: dict[str, tuple[Effect, ...]]) -> tuple[list[Effect], tuple[str, ...]]:
    listed = [setting for own in settings.values() for setting in own]
    return listed, tuple(setting.name for setting in listed)
