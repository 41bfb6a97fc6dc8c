"""Normal equations of each campaign in the compared parameters, its frames projected out.

With y the gap, X the columns of all parameters and F those of the unknown frames, whitened by the campaign's own noise,

    G = Xᵀ(1 − F F⁺)X,   b = Xᵀ(1 − F F⁺)y.

Parameters that an unknown frame absorbs, such as the first joint's zero, are not in G. With a structured residual, the
information along each axis of G is divided by the variance inflation of :mod:`thermal_robot.diagnosis.uncertainty`.

A model file may replace a campaign. It holds the values θ of the effects found, the covariance C of frames and
parameters, their prior standard deviations π, and the measured ranges. The information of the rows alone is, by Bayes'
theorem for a linear model with normal errors,

    G = C⁻¹ − π⁻²,   b = C⁻¹ θ.

Its parameters θ_M are expressed in the compared ones by their displacement of the target: X_M = X A + F B over poses
within the measured ranges, so that θ = A θ_M. An effect outside the span of the compared parameters is marginalised
with the frames. A model carries no information on effects outside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import LABELS
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.uncertainty import variance_inflation
from thermal_robot.effects import Effect, Parameter, gate
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.law_words import called
from thermal_robot.effects.position import OfPosition
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.files import is_file
from thermal_robot.fleet import settings
from thermal_robot.inference import settings as inference
from thermal_robot.inference.algebra import equations_of, whitener
from thermal_robot.inference.columns import Block, block, frame_columns, moved_by
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.inside import distinct
from thermal_robot.inference.problem import Linear, products
from thermal_robot.observations import Observations, observe
from thermal_robot.prediction import Spread

Ranges = Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class ModelAsFit:
    """Model file in place of a diagnosis and of its fit, named ``campaign``.

    ``corrected`` are observations of the corrected model at random poses within the measured ranges, as the file has no
    rows. ``samples`` is 0, and effects that are not in the file carry no information.
    """

    campaign: str
    model: CorrectedModel
    spread: Spread
    corrected: Observations
    samples: int = 0

    @classmethod
    def of(cls, model: CorrectedModel, name: str) -> ModelAsFit:
        """Wrap a model under a name; a :class:`CampaignError` if it corrects a simulator or lacks its uncertainty."""
        if model.simulated:
            problem = "this model corrects a simulator's predictions, which it does not hold"
            raise CampaignError(name, problem, expected="its campaign")
        spread = model.spread
        if spread is None or spread.prior is None or not {*model.robot.joint_names} <= {*spread.ranges}:
            problem = "this model does not say how sure it is: it was written by an older program"
            raise CampaignError(name, problem, expected="its campaign, or a model that `diagnose --model` writes today")
        return cls(name, model, spread, observed(model, poses(model, spread.ranges), spread.ranges))

    @property
    def effects(self) -> tuple[tuple[Effect, Array], ...]:
        """Effects with their values, SI."""
        return self.model.effects

    @property
    def verdict(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(dict.fromkeys(effect.name for effect, _ in self.effects))

    @property
    def summary(self) -> str:
        """Description of the model in one sentence."""
        held = ", ".join(dict.fromkeys(effect.title for effect, _ in self.effects))
        return f"A model file; it holds {held or 'no effect'}."

    def odds(self, name: str) -> float:
        """Even odds of any effect, since a file has no odds."""
        return 1.0


def is_model(path: object) -> bool:
    """Whether a value is the path of an existing file whose name ends in .json."""
    return isinstance(path, (str, Path)) and Path(path).suffix.lower() == ".json" and is_file(Path(path))


def poses(model: CorrectedModel, ranges: Ranges) -> Array:
    """Draw 400 joint positions (N, n), rad or m, uniformly within the measured ranges, with a fixed seed."""
    low, high = np.array([ranges[name] for name in model.robot.joint_names]).T
    return np.asarray(np.random.default_rng(0).uniform(low, high, (settings.POSES, model.robot.n)))


def observed(model: CorrectedModel, q: Array, ranges: Ranges) -> Observations:
    """Observations of the corrected model at joint positions (N, n), conditions spread evenly over their ranges.

    Each condition follows a golden-ratio sequence of its own; directions of approach take the ends of their range.
    """
    covariates = {}
    for k, name in enumerate(model.needs):
        low, high = ranges.get(name, (0.0, 0.0))
        if high < low:  # none in common: halfway between the two
            low = high = 0.5 * (low + high)
        # a golden step for each, so that conditions do not run together
        turn = np.modf(np.arange(len(q)) * 0.6180339887498949 * (k + 1))[0]
        covariates[name] = np.where(turn < 0.5, low, high) if name.startswith("approach") else low + turn * (high - low)
    samples = model.samples_at(q, covariates)
    samples = replace(samples, labels={label: np.full(len(q), "one to come") for label in LABELS})
    moved, _ = displacement(observe(samples, model.frames), model.effects)
    return observe(samples, model.frames, displacement=moved)


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect to be compared between campaigns, in all its places and in one setting.

    ``compared`` are its P parameters without responses, ``sizes`` (P,) their expected sizes in SI, ``at`` their indices
    among all compared parameters. Per campaign, ``parameters`` are the same with their responses in its rows, empty
    where it lacks the columns; ``named`` is whether its diagnosis names the effect. A discovered law has its campaign's
    name appended to its name and title.
    """

    name: str
    title: str
    effect: Effect
    compared: tuple[Parameter, ...]
    sizes: Array
    parameters: tuple[tuple[Parameter, ...], ...]
    named: tuple[bool, ...]
    at: tuple[int, ...] = ()

    @property
    def places(self) -> dict[tuple[str, str], list[int]]:
        """Indices of the compared parameters by kind and name of their place."""
        found: dict[tuple[str, str], list[int]] = {}
        for number, parameter in zip(self.at, self.compared, strict=True):
            found.setdefault((parameter.kind, parameter.place), []).append(number)
        return found


def candidates(
    found: Sequence[Diagnosis | ModelAsFit], fits: Sequence[Fit | ModelAsFit], names: Sequence[str]
) -> tuple[Candidate, ...]:
    """List the effects to compare: those found in any campaign, with a probability of 0.1 in one, or that can be reset.

    Effects that can be reset between campaigns, such as joint zeros, come first. A model file is both a diagnosis
    (``found``) and its fit.
    """
    listed: list[Candidate] = []
    for key, effect in _settings(fits, names):
        if isinstance(effect, Discovered):  # a diagnosis names a law only as it is
            named = tuple(any(own == effect for own, _ in fit.effects) for fit in fits)
        else:
            named = tuple(effect.name in diagnosis.verdict for diagnosis in found)
        parameters = [_parameters(effect, fit) for fit in fits]
        known = next((c for c, own in enumerate(parameters) if own), None)
        if known is None:
            continue
        compared = tuple(p.bare for p in parameters[known])
        kept = tuple(own if [p.name for p in own] == [p.name for p in compared] else () for own in parameters)
        title = f"{called(effect)} ({key.split(' of ')[1]})" if isinstance(effect, Discovered) else effect.title
        listed.append(Candidate(key, title, effect, compared, _sizes(effect, fits[known], compared), kept, named))
    return tuple(sorted(listed, key=lambda c: (isinstance(c.effect, Discovered), not c.effect.told_inside, c.name)))


def _settings(fits: Sequence[Fit | ModelAsFit], names: Sequence[str]) -> Iterator[tuple[str, Effect]]:
    """Yield each effect to compare once, in all its places and in the setting of the fit with the highest odds for it.

    A setting that reads more columns, such as a clock, takes precedence. Laws come once for each campaign.
    """
    known: dict[str, tuple[tuple[int, float], Effect]] = {}
    for fit in fits:
        for effect, _ in fit.effects:
            sure = len(gate.reads(effect, fit.corrected)), fit.odds(effect.name)
            if not isinstance(effect, Discovered) and sure > known.get(effect.name, ((-1, 0.0), effect))[0]:
                known[effect.name] = sure, effect
    for fit in (one for one in fits if isinstance(one, Fit)):
        for name, variants in fit.variants.items():
            if name in known or not variants or isinstance(variants[0], Discovered):
                continue
            if variants[0].told_inside or fit.probability(name) >= settings.MAY_BE:
                known[name] = (0, 0.0), variants[0]
    yield from ((name, replace(effect, places=(), excluded=())) for name, (_, effect) in known.items())
    for fit, campaign in zip(fits, names, strict=True):
        yield from ((f"{e.name} of {campaign}", e) for e, _ in fit.effects if isinstance(e, Discovered))


def _parameters(effect: Effect, fit: Fit | ModelAsFit) -> tuple[Parameter, ...]:
    """Parameters of an effect with their responses in a campaign, as reported; empty where it lacks the columns."""
    observations = fit.corrected
    try:
        effect = _there(effect, fit)
        if gate.missing(effect, observations):
            return ()
        return gate.independent(effect, observations) or gate.checked(effect, observations)
    except EffectError:
        if isinstance(fit, Fit) and effect.name in fit.variants and not isinstance(effect, Discovered):
            raise
        return ()  # a law of what only another campaign recorded


def _there(effect: Effect, fit: Fit | ModelAsFit) -> Effect:
    """Adapt an effect to another campaign's record (``Effect.elsewhere``); unchanged for a model file, without one."""
    recorded = isinstance(fit, Fit) or isinstance(effect, OfPosition)  # these have nothing of it but their range
    return gate.elsewhere(effect, fit.corrected) if recorded else effect


def _sizes(effect: Effect, fit: Fit | ModelAsFit, compared: Sequence[Parameter]) -> Array:
    own = block(fit.corrected, _there(effect, fit))
    alike = [p.name for p in own.bare] == [p.name for p in compared]
    return own.sizes if alike else np.array([p.size for p in compared])


@dataclass(frozen=True, eq=False)
class Sums:
    """Normal equations of one campaign, in units of its noise and of the expected sizes: G (P, P) and b (P,)."""

    matrix: Array
    vector: Array

    @property
    def inverse(self) -> tuple[Array, Array]:
        """Pseudo-inverse (P, P) of G, and the squared length (P,) of each parameter's axis projected on G's range."""
        value, axes = np.linalg.eigh(self.matrix)
        seen = value > inference.INFORMATION_FLOOR
        return (axes[:, seen] / value[seen]) @ axes[:, seen].T, np.asarray((axes[:, seen] ** 2).sum(axis=1))

    def some(self, kept: Sequence[int]) -> Sums:
        """Return the normal equations of the parameters ``kept``, the others being fixed at zero."""
        return Sums(self.matrix[np.ix_(kept, kept)], self.vector[list(kept)])

    def informs(self, own: Sequence[int]) -> bool:
        """Whether G has information on any of the parameters ``own``: a diagonal element above the rounding floor."""
        return bool(np.diag(self.matrix)[list(own)].max(initial=0.0) > inference.INFORMATION_FLOOR)


def sums(found: Diagnosis | ModelAsFit, fit: Fit | ModelAsFit, listed: Sequence[Candidate], number: int) -> Sums:
    """Return the normal equations of campaign ``number`` in all parameters of the listed effects, frames projected out.

    With an unexplained residual the information is divided by its variance inflation.
    """
    columns = [_columns(fit.corrected, item, number) for item in listed]
    if isinstance(found, ModelAsFit) or isinstance(fit, ModelAsFit):
        assert isinstance(fit, ModelAsFit)
        return _of_model(fit, listed, number, [equations_of(own) for own in columns])
    at, e = fit.corrected, fit.explanation
    gap = at.gap + sum((block(at, effect).columns @ values for effect, values in fit.effects), np.zeros_like(at.gap))
    blocks = (
        Block(i.effect, i.compared, own, np.ones(len(i.compared))) for i, own in zip(listed, columns, strict=True)
    )
    linear = Linear(gap, frame_columns(at)[0], tuple(blocks))
    matrix, vector = _projected(products(linear, e.whitening) / e.best.noise**2, linear.frames.shape[2])
    left = found.unexplained if found.remaining is None else found.remaining
    value, axes = np.linalg.eigh(matrix)
    value = np.maximum(value, 0.0)
    times = variance_inflation(fit, linear, value, axes) if left.flagged else np.ones(len(value))
    return Sums((axes * (value / times)) @ axes.T, axes @ ((axes.T @ vector) / times))


def _columns(at: Observations, item: Candidate, number: int) -> Array:
    """Design-matrix columns (N, m, P) of an effect in expected sizes; zeros where the campaign lacks its conditions."""
    if not item.parameters[number]:
        return np.zeros((*moved_by(at, ()).shape[:2], len(item.compared)))
    return moved_by(at, item.parameters[number]) * item.sizes


def _projected(full: Array, flat: int) -> tuple[Array, Array]:
    """Schur complement: G (P, P) and b (P,) with the first ``flat`` columns projected out, small eigenvalues zeroed.

    Without that, rounding or a moving base would leave a tiny component of an alias of the frames, such as a shift of
    the first link, and estimate it to decimetres.
    """
    along = whitener(full[:flat, :flat]).T @ full[:flat, flat:]
    rest, before = full[flat:, flat:] - along.T @ along, np.diag(full)[flat:-1]
    matrix, vector = 0.5 * (rest + rest.T)[:-1, :-1], rest[:-1, -1]
    value, axes = np.linalg.eigh(matrix)
    floor = max(settings.SAYS, inference.PROJECTED_FLOOR * float(before.max(initial=0.0)))
    seen = value > floor
    return (axes[:, seen] * value[seen]) @ axes[:, seen].T, axes[:, seen] @ (axes[:, seen].T @ vector)


def identifiable(statistics: Sequence[Sums]) -> list[int]:
    """Return the indices of the parameters that all campaigns together determine, without aliases of earlier ones."""
    together = np.sum([one.matrix for one in statistics], axis=0)
    value, axes = np.linalg.eigh(together)
    root = (axes * np.sqrt(np.maximum(value, 0.0))).T
    length = np.sqrt(np.maximum(np.diag(together), 0.0))
    seen = length > np.sqrt(inference.INFORMATION_FLOOR)
    return distinct(root / np.where(seen, length, 1.0), seen, settings.DISTINCT)


def _of_model(known: ModelAsFit, listed: Sequence[Candidate], number: int, columns: Sequence[Array]) -> Sums:
    """Return the normal equations from a model file's covariance, with the (3N, P) columns of each listed effect."""
    width = sum(own.shape[1] for own in columns)
    prior, start = np.asarray(known.spread.prior), 0
    kept: list[int] = []
    across: list[Array] = []
    for effect, values in known.effects:
        which = range(start, start + len(values))
        start += len(values)
        own = equations_of(block(known.corrected, effect).columns) * prior[which]
        compared = _expressed(known, effect, own, listed, columns, number)
        if compared is not None:
            kept += which
            across.append(compared)
    if not kept:
        return Sums(np.zeros((width, width)), np.zeros(width))
    information, statistics = _without_prior(known, np.array(kept), prior)
    back = np.linalg.pinv(np.column_stack(across), rcond=settings.SAME_PLACE)
    return Sums(back.T @ information @ back, back.T @ statistics)


def _expressed(
    known: ModelAsFit, effect: Effect, own: Array, listed: Sequence[Candidate], columns: Sequence[Array], number: int
) -> Array | None:
    """Express an effect's K parameters, per prior deviation, in the listed ones (P, K) by least squares over poses.

    Tried are its own parameters, then joint zeros and the like as well; ``None`` if residuals exceed 1e-3 in both.
    """
    name = f"{effect.name} of {known.campaign}" if isinstance(effect, Discovered) else effect.name
    owner = np.repeat(np.arange(len(listed)), [c.shape[1] for c in columns])
    alike = [k for k, item in enumerate(listed) if item.name == name and item.parameters[number]]
    inside = [k for k, item in enumerate(listed) if item.effect.told_inside and item.parameters[number]]
    frames = equations_of(frame_columns(known.corrected)[0])
    for chosen in (alike, [*alike, *inside]) if alike else ():
        used = np.isin(owner, chosen)
        every = np.column_stack([np.column_stack(columns)[:, used], frames])
        length = np.linalg.norm(every, axis=0)
        seen = length > settings.ROUNDING * length.max()
        found = np.zeros((len(length), own.shape[1]))
        found[seen] = np.linalg.lstsq(every[:, seen] / length[seen], own, rcond=None)[0] / length[seen, None]
        left = np.linalg.norm(own - every @ found, axis=0)
        if (left <= settings.DISTINCT * np.linalg.norm(own, axis=0)).all():
            compared = np.zeros((len(owner), own.shape[1]))
            compared[used] = found[: used.sum()]
            return compared
    return None


def _without_prior(known: ModelAsFit, kept: NDArray[np.int64], prior: Array) -> tuple[Array, Array]:
    """Information matrix G and b of the parameters ``kept`` of a model, in prior deviations, with the prior removed."""
    covariance = known.spread.covariance if known.spread.wider is None else known.spread.wider
    flat = len(covariance) - len(prior)
    values = np.concatenate([values for _, values in known.effects])[kept] / prior[kept]
    own = covariance[np.ix_(flat + kept, flat + kept)] / np.outer(prior[kept], prior[kept])
    # a parameter that is known as well as before has variance one, and the rows say nothing of it
    value, axes = np.linalg.eigh(0.5 * (own + own.T))
    tight = 1.0 / np.maximum(value, inference.TINY)
    seen = tight > 1.0 + settings.SAYS
    axes, tight = axes[:, seen], tight[seen]
    return (axes * (tight - 1.0)) @ axes.T, axes @ (tight * (axes.T @ values))
