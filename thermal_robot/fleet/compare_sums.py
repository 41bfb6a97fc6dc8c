"""What each campaign says of the parameters that are compared: its sums of products, frames projected out.

With y the gap, X the columns of all parameters and F those of the unknown frames, whitened by the campaign's own noise,

    G = Xᵀ(1 − F F⁺)X,   b = Xᵀ(1 − F F⁺)y.

What an unknown frame takes up, such as the first joint's zero, is not in G: campaigns are compared without it. Where
what remains is no noise, rows say less than they seem to: along each axis of G the information is divided by as much as
the variance of the parameters exceeds what independent rows would give (:mod:`thermal_robot.diagnosis.uncertainty`).

A model file may stand in the place of a campaign. It holds the effects that were found with their values, the
covariance C of frames and parameters, the deviation π that each parameter was expected to have, and the ranges that
were measured. The frames marginalised, the rows alone say of its parameters θ, by Bayes' theorem for a linear model
with normal errors,

    G = C⁻¹ − π⁻²,   b = C⁻¹ θ.

Of all that the model does not hold the file says nothing: neither that it is there, nor that it is not.

Its parameters are those of its effects in its own setting and places. They become those that are compared by
what they do to the target: X_M = X A + F B over poses within the measured ranges, F the unknown frames, so that
θ = A θ_M. An effect that does what the compared parameters cannot do stays free: it is marginalised with the frames.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import LABELS
from thermal_robot.correction import CorrectedModel
from thermal_robot.diagnosis.result import Diagnosis
from thermal_robot.diagnosis.uncertainty import exceeding
from thermal_robot.effects import Effect, Parameter, gate
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.law_words import called
from thermal_robot.effects.position import OfPosition
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.files import is_file
from thermal_robot.fleet import compare_settings
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, whitener
from thermal_robot.inference.columns import Block, block, frame_columns, moved_by
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.inside import distinct
from thermal_robot.inference.problem import Linear, whitened
from thermal_robot.observations import Observations, observe
from thermal_robot.prediction import Spread
from thermal_robot.robot import Robot

Ranges = Mapping[str, tuple[float, float]]

_SUFFIX = ".json"


@dataclass(frozen=True, eq=False)
class Known:
    """A model file; what a comparison reads of a diagnosis and of its fit.

    Attributes
    ----------
    campaign
        What it is called.
    model
        The model.
    q
        (N, n) poses within the ranges that were measured: the rows themselves are gone.
    corrected
        Observations of the corrected model there.
    variants
        None: which other effects were compared the file does not say.
    samples
        None.
    """

    campaign: str
    model: CorrectedModel
    q: Array
    corrected: Observations
    variants: Mapping[str, tuple[Effect, ...]] = field(default_factory=dict)
    samples: int = 0

    @property
    def spread(self) -> Spread:
        """How far its predictions may be off."""
        assert self.model.spread is not None  # known() refuses others
        return self.model.spread

    @property
    def effects(self) -> tuple[tuple[Effect, Array], ...]:
        """Its effects with their values, SI."""
        return self.model.effects

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.model.robot.name

    @property
    def tool_frame(self) -> str:
        """Link that carries the target."""
        return self.model.robot.tool_frame

    @property
    def verdict(self) -> tuple[str, ...]:
        """Names of its effects."""
        return tuple(dict.fromkeys(effect.name for effect, _ in self.effects))

    @property
    def summary(self) -> str:
        """What it is, in one sentence."""
        held = ", ".join(dict.fromkeys(effect.title for effect, _ in self.effects))
        return f"A model file; it holds {held or 'no effect'}."

    def odds(self, name: str) -> float:
        """Odds of an effect, of which the file says no more than that it was found: those of a coin."""
        return 1.0

    def probability(self, name: str) -> float:
        """Return whether it holds an effect."""
        return float(name in self.verdict)


def is_model(path: object) -> bool:
    """Whether this is the path of a file that may be a model."""
    return isinstance(path, (str, Path)) and Path(path).suffix.lower() == _SUFFIX and is_file(Path(path))


def known(model: CorrectedModel, name: str) -> Known:
    """Return a model as something to compare.

    Parameters
    ----------
    model
        From a file.
    name
        What to call it.

    Raises
    ------
    CampaignError
        If it rests on a simulator, or does not say how sure it is.
    """
    if model.simulated:
        raise CampaignError(
            name, "this model corrects a simulator's predictions, which it does not hold", expected="its campaign"
        )
    spread = model.spread
    if spread is None or spread.prior is None or any(joint not in spread.ranges for joint in model.robot.joint_names):
        raise CampaignError(
            name,
            "this model does not say how sure it is: it was written by an older program",
            expected="its campaign, or a model that `diagnose --model` writes today",
        )
    q = poses(model.robot, spread.ranges)
    return Known(name, model, q, observed(model, q, spread.ranges))


def poses(robot: Robot, ranges: Ranges) -> Array:
    """(N, n) joint positions spread evenly over the ranges that were measured."""
    low, high = (np.array([ranges[name][end] for name in robot.joint_names]) for end in (0, 1))
    return np.asarray(np.random.default_rng(0).uniform(low, high, (compare_settings.POSES, robot.n)))


def observed(model: CorrectedModel, q: Array, common: Ranges) -> Observations:
    """Return the corrected model at (N, n) poses, every condition going once through its range."""
    covariates = {}
    for k, name in enumerate(model.needs):
        low, high = common.get(name, (0.0, 0.0))
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
    """An effect that is compared, in all its places.

    Attributes
    ----------
    name, title
        Of the effect; a law that was found in one campaign has that campaign's name with it.
    effect
        The effect in one setting.
    told
        Its P parameters without responses, as a comparison tells them.
    sizes
        (P,) their expected sizes.
    parameters
        Per campaign: the P parameters with their responses there; empty where the campaign lacks what it needs.
    named
        Per campaign: whether its diagnosis names the effect.
    """

    name: str
    title: str
    effect: Effect
    told: tuple[Parameter, ...]
    sizes: Array
    parameters: tuple[tuple[Parameter, ...], ...]
    named: tuple[bool, ...]

    @property
    def law(self) -> bool:
        """Whether nobody wrote it down before it was found."""
        return isinstance(self.effect, Discovered)


def candidates(
    found: Sequence[Diagnosis | Known], fits: Sequence[Fit | Known], names: Sequence[str]
) -> tuple[Candidate, ...]:
    """List the effects that are compared, those that can be set anew first.

    Every effect of a diagnosis is; every one that is probable enough in any of them; and those that somebody could set
    anew between campaigns, such as a joint's zero.

    Parameters
    ----------
    found, fits
        The diagnoses, and the fits behind them; a model file is both.
    names
        What the campaigns are called.
    """
    listed = []
    for key, effect in _settings(fits, names):
        parameters = tuple(_parameters(effect, fit) for fit in fits)
        known = next((c for c, own in enumerate(parameters) if own), None)
        if known is None:
            continue
        told = tuple(replace(p, responses=()) for p in parameters[known])
        kept = tuple(own if [p.name for p in own] == [p.name for p in told] else () for own in parameters)
        law = isinstance(effect, Discovered)
        named = tuple(_names(effect, diagnosis, fit) for diagnosis, fit in zip(found, fits, strict=True))
        title = f"{called(effect)} ({key.split(' of ')[1]})" if isinstance(effect, Discovered) else effect.title
        listed.append(Candidate(key, title, effect, told, _sizes(effect, fits[known], told), kept, named))
        if law and not any(named):
            listed.pop()
    return tuple(sorted(listed, key=lambda c: (c.law, not c.effect.told_inside, c.name)))


def _names(effect: Effect, diagnosis: Diagnosis | Known, fit: Fit | Known) -> bool:
    """Whether a diagnosis names an effect; a law it names only as it is."""
    if isinstance(effect, Discovered):
        return any(own == effect for own, _ in fit.effects)
    return effect.name in diagnosis.verdict


def _settings(fits: Sequence[Fit | Known], names: Sequence[str]) -> Iterator[tuple[str, Effect]]:
    """Yield each effect once, by its name, in all its places and in the setting that the surest fit has.

    A setting that reads more, such as a clock, goes before one that a campaign without it had to do with.
    """
    known: dict[str, tuple[tuple[int, float], Effect]] = {}
    for fit in fits:
        for effect, _ in fit.effects:
            sure = len(gate.reads(effect, fit.corrected)), fit.odds(effect.name)
            if not isinstance(effect, Discovered) and sure > known.get(effect.name, ((-1, 0.0), effect))[0]:
                known[effect.name] = sure, effect
    for fit in fits:
        for name, variants in fit.variants.items():
            first = variants[0] if variants else None
            if first is None or name in known or isinstance(first, Discovered):
                continue
            if first.told_inside or fit.probability(name) >= compare_settings.MAY_BE:
                known[name] = (0, 0.0), first
    yield from ((name, replace(effect, places=(), excluded=())) for name, (_, effect) in known.items())
    for fit, campaign in zip(fits, names, strict=True):
        yield from ((f"{e.name} of {campaign}", e) for e, _ in fit.effects if isinstance(e, Discovered))


def _parameters(effect: Effect, fit: Fit | Known) -> tuple[Parameter, ...]:
    """Return an effect's parameters in a campaign, as they are told; empty where the campaign lacks what it needs."""
    observations = fit.corrected
    try:
        effect = _there(effect, fit)
        if gate.missing(effect, observations):
            return ()
        return gate.independent(effect, observations) or gate.checked(effect, observations)
    except EffectError:
        if effect.name in fit.variants and not isinstance(effect, Discovered):
            raise
        return ()  # a law of what only another campaign recorded


def _there(effect: Effect, fit: Fit | Known) -> Effect:
    """Return an effect as it is in a campaign; a model has no record to take anything from."""
    recorded = isinstance(fit, Fit) or isinstance(effect, OfPosition)  # these have nothing of it but their range
    return gate.elsewhere(effect, fit.corrected) if recorded else effect


def _sizes(effect: Effect, fit: Fit | Known, told: Sequence[Parameter]) -> Array:
    own = block(fit.corrected, _there(effect, fit))
    alike = [p.name for p in own.bare] == [p.name for p in told]
    return own.sizes if alike else np.array([p.size for p in told])


@dataclass(frozen=True, eq=False)
class Sums:
    """What one campaign says, in units of its noise and of the expected sizes.

    Attributes
    ----------
    matrix, vector
        G (P, P) and b (P,).
    """

    matrix: Array
    vector: Array

    @property
    def inverse(self) -> tuple[Array, Array]:
        """(P, P) pseudo-inverse of G, and (P,) part of each parameter's direction that G sees."""
        value, axes = np.linalg.eigh(self.matrix)
        seen = value > settings.INFORMATION_FLOOR
        return (axes[:, seen] / value[seen]) @ axes[:, seen].T, np.asarray((axes[:, seen] ** 2).sum(axis=1))

    def some(self, kept: Sequence[int]) -> Sums:
        """Return what it says with the other parameters at zero."""
        return Sums(self.matrix[np.ix_(kept, kept)], self.vector[list(kept)])


def sums(found: Diagnosis, fit: Fit, listed: Sequence[Candidate], number: int) -> Sums:
    """Return what a campaign says of the listed effects.

    Parameters
    ----------
    found, fit
        Its diagnosis, and the fit behind it.
    listed
        Effects that are compared.
    number
        Which of the campaigns it is.
    """
    at, e = fit.corrected, fit.explanation
    gap = at.gap + sum((block(at, effect).columns @ values for effect, values in fit.effects), np.zeros_like(at.gap))
    measures = gap.shape[1]
    blocks = []
    for item in listed:
        own = item.parameters[number]
        columns = moved_by(at, own) if own else np.zeros((len(gap), measures, len(item.told)))
        blocks.append(Block(item.effect, item.told, columns * item.sizes, np.ones(len(item.told))))
    linear = Linear(gap, frame_columns(at)[0], tuple(blocks))
    stack = whitened(linear, e.whitening)
    matrix, vector = _projected(stack.T @ stack / e.best.noise**2, linear.frames.shape[2])
    left = found.unexplained if found.remaining is None else found.remaining
    value, axes = np.linalg.eigh(matrix)
    value = np.maximum(value, 0.0)
    times = exceeding(fit, linear, value, axes) if left.flagged else np.ones(len(value))
    return Sums((axes * (value / times)) @ axes.T, axes @ ((axes.T @ vector) / times))


def _projected(full: Array, flat: int) -> tuple[Array, Array]:
    """(P, P) and (P,) products without the first columns, what is left of their aliases set to zero.

    Rounding leaves something, and so does a base that rocks: a shift of the first link is then no more exactly one of
    the base, and a campaign would tell it to decimetres.
    """
    along = whitener(full[:flat, :flat]).T @ full[:flat, flat:]
    rest, before = full[flat:, flat:] - along.T @ along, np.diag(full)[flat:-1]
    matrix, vector = 0.5 * (rest + rest.T)[:-1, :-1], rest[:-1, -1]
    value, axes = np.linalg.eigh(matrix)
    floor = max(compare_settings.SAYS, settings.PROJECTED_FLOOR * float(before.max(initial=0.0)))
    seen = value > floor
    return (axes[:, seen] * value[seen]) @ axes[:, seen].T, axes[:, seen] @ (axes[:, seen].T @ vector)


def told(said: Sequence[Sums]) -> list[int]:
    """Return the parameters that are told: none that campaigns together do not see, or see as others before it."""
    together = np.sum([one.matrix for one in said], axis=0)
    value, axes = np.linalg.eigh(together)
    root = (axes * np.sqrt(np.maximum(value, 0.0))).T
    length = np.sqrt(np.maximum(np.diag(together), 0.0))
    seen = length > np.sqrt(settings.INFORMATION_FLOOR)
    return distinct(root / np.where(seen, length, 1.0), seen, compare_settings.DISTINCT)


def sums_of_model(known: Known, listed: Sequence[Candidate], number: int) -> Sums:
    """Return what a model file says of the listed effects.

    Parameters
    ----------
    known
        The model.
    listed
        Effects that are compared.
    number
        Which of the campaigns it is.
    """
    ends = np.cumsum([0, *(len(item.told) for item in listed)])
    matrix, vector = np.zeros((ends[-1],) * 2), np.zeros(ends[-1])
    if not known.effects:
        return Sums(matrix, vector)
    prior = np.asarray(known.spread.prior)
    starts = np.cumsum([0, *(len(values) for _, values in known.effects)])
    flat = _columns(known, listed, number)
    kept: list[int] = []
    across: list[Array] = []
    for (effect, _), start in zip(known.effects, starts, strict=False):
        own = block(known.corrected, effect).columns
        own = equations_of(own) * prior[start : start + own.shape[2]]
        told = _expressed(known, effect, own, listed, flat, number)
        if told is not None:
            kept += range(start, start + own.shape[1])
            across.append(told)
    if not kept:
        return Sums(matrix, vector)
    information, said = _alone(known, np.array(kept), prior)
    back = np.linalg.pinv(np.column_stack(across), rcond=compare_settings.SAME_PLACE)
    return Sums(back.T @ information @ back, back.T @ said)


def _columns(known: Known, listed: Sequence[Candidate], number: int) -> list[Array]:
    """Return (3N, P) columns of each listed effect, in expected sizes; zeros where the model lacks what it needs."""
    found = []
    for item in listed:
        own = item.parameters[number]
        columns = moved_by(known.corrected, own) * item.sizes if own else np.zeros((len(known.q), 3, len(item.told)))
        found.append(equations_of(columns))
    return found


def _expressed(
    known: Known, effect: Effect, own: Array, listed: Sequence[Candidate], flat: Sequence[Array], number: int
) -> Array | None:
    """(P, K) listed parameters for one prior deviation of each of an effect's K; ``None`` if they cannot do the same.

    Its own parameters first; then, of what contains joints' zeros, with those beside them.
    """
    name = f"{effect.name} of {known.campaign}" if isinstance(effect, Discovered) else effect.name
    alike = [k for k, item in enumerate(listed) if item.name == name and item.parameters[number]]
    inside = [k for k, item in enumerate(listed) if item.effect.told_inside and item.parameters[number]]
    frames = equations_of(frame_columns(known.corrected)[0])
    for chosen in (alike, sorted({*alike, *inside})) if alike else ():
        every = np.column_stack([*(flat[k] for k in chosen), frames])
        length = np.linalg.norm(every, axis=0)
        seen = length > compare_settings.ROUNDING * length.max()
        told = np.zeros((len(length), own.shape[1]))
        told[seen] = np.linalg.lstsq(every[:, seen] / length[seen], own, rcond=None)[0] / length[seen, None]
        left = np.linalg.norm(own - every @ told, axis=0)
        if (left <= compare_settings.DISTINCT * np.linalg.norm(own, axis=0)).all():
            return _among(told, chosen, [columns.shape[1] for columns in flat])
    return None


def _among(told: Array, chosen: Sequence[int], widths: Sequence[int]) -> Array:
    """(P, K) of all listed parameters, zero where an effect was not chosen; what the frames do is left out."""
    rows = [np.zeros((width, told.shape[1])) for width in widths]
    start = 0
    for k in chosen:
        rows[k] = told[start : start + widths[k]]
        start += widths[k]
    return np.concatenate(rows)


def _alone(known: Known, kept: NDArray[np.int64], prior: Array) -> tuple[Array, Array]:
    """Return G and b of some of the model's parameters, in prior deviations: what rows say without the prior."""
    spread = known.spread
    covariance = spread.covariance if spread.wider is None else spread.wider
    flat = len(covariance) - len(prior)
    values = np.concatenate([values for _, values in known.effects])[kept] / prior[kept]
    own = covariance[np.ix_(flat + kept, flat + kept)] / np.outer(prior[kept], prior[kept])
    # a parameter that is known as well as before has variance one, and the rows say nothing of it
    value, axes = np.linalg.eigh(0.5 * (own + own.T))
    tight = 1.0 / np.maximum(value, settings.TINY)
    seen = tight > 1.0 + compare_settings.SAYS
    return (axes[:, seen] * (tight[seen] - 1.0)) @ axes[:, seen].T, axes[:, seen] @ (
        tight[seen] * (axes[:, seen].T @ values)
    )
