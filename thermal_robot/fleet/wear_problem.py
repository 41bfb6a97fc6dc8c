"""Several campaigns of one robot as one linear problem: the same parameters in all, each campaign's frames its own.

Parameters are those of the effects that were named in any campaign, and what somebody could set anew
(:attr:`Effect.told_inside`): a collision shows in the zeros of joints, whether or not those were off before. All
campaigns are linearised about one common model, so that what is not linear is the same in all.

A campaign's own are its unknown frames, and effects that begin anew with it: those of the instrument, of a frame, of
its clock, and laws that nobody wrote down. They are taken off within it, the frames free, the others held by their
sizes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.effects import FRAMES, Effect, Parameter, gate, library
from thermal_robot.effects.apply import displacement
from thermal_robot.effects.law import PREFIX
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.inference import settings as inference
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.columns import Block, frame_columns, moved_by
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, Whitening, frame_step, whitened
from thermal_robot.inference.registration import moved
from thermal_robot.observations import Frames, Observations, observe

Key = tuple[str, str]
"""Names of an effect and of its parameter."""


@dataclass(frozen=True, eq=False)
class Problem:
    """K campaigns as products of the P parameters that they have in common, in units of their expected sizes.

    Attributes
    ----------
    keys, parameters, titles
        Of each parameter: effect and name; what it is, without responses; its effect in plain words.
    matrices, vectors
        (K, P, P) and (K, P): whitened, and what is a campaign's own taken off.
    has
        (K, P) whether a campaign can say anything of a parameter: it has the columns that its effect reads.
    """

    keys: tuple[Key, ...]
    parameters: tuple[Parameter, ...]
    titles: tuple[str, ...]
    matrices: Array
    vectors: Array
    has: NDArray[np.bool_]

    @property
    def sizes(self) -> Array:
        """(P,) expected size of each parameter, SI."""
        return np.array([parameter.size for parameter in self.parameters])


def require_alike(fits: Sequence[Fit]) -> None:
    """Refuse campaigns of different robots.

    Raises
    ------
    CampaignError
        Naming the campaign that is of another robot than the first.
    """
    first = fits[0].campaign
    for fit in fits[1:]:
        campaign, robot = fit.campaign, first.robot
        for what, found, expected in (
            ("joints", campaign.robot.joint_names, robot.joint_names),
            ("tool frame", campaign.robot.tool_frame, robot.tool_frame),
            ("root frame", campaign.robot.root_frame, robot.root_frame),
        ):
            if found != expected:
                raise CampaignError(
                    campaign.name, "is of another robot", column=what, found=str(found),
                    expected=f"{expected}, as in {first.name}",
                )  # fmt: skip
        if campaign.robot.urdf != robot.urdf:
            raise CampaignError(
                campaign.name, "has another URDF, so that its errors are counted from another model",
                expected=f"the text of {first.name}'s; name the same file in both",
            )  # fmt: skip


def problem(fits: Sequence[Fit]) -> Problem:
    """Put campaigns, each fitted by itself, into one problem.

    Parameters
    ----------
    fits
        Of K campaigns, in the order of time.

    Raises
    ------
    EstimationError
        If the unknown frames of one cannot be fitted.
    """
    shared = _shared([effect for fit in fits for effect, _ in fit.effects], fits[0].nominal)
    own = [[effect for effect, _ in fit.effects if _begins_anew(effect, fit.nominal)] for fit in fits]
    visits = [_Visit.of(fit, shared, mine) for fit, mine in zip(fits, own, strict=True)]
    listed: dict[Key, Parameter] = {}
    for visit in visits:
        listed |= {key: p for key, p in visit.shared.items() if key not in listed}
    titles = {effect.name: effect.title for effect in shared}
    keys, values = tuple(listed), np.zeros(len(listed))
    sizes = np.array([listed[key].size for key in keys])
    for _ in range(settings.ROUNDS):
        parts = [visit.products(keys, sizes, values) for visit in visits]
        matrices, vectors = (np.array(each) for each in zip(*parts, strict=True))
        total = matrices.sum(axis=0) + np.eye(len(keys)) / settings.WIDE**2
        values = sizes * np.linalg.solve(total, vectors.sum(axis=0))
        for visit in visits:
            visit.step(keys, values)
    return Problem(
        keys,
        tuple(replace(listed[key], responses=()) for key in keys),
        tuple(titles[name] for name, _ in keys),
        matrices,
        vectors,
        np.array([[key in visit.shared for key in keys] for visit in visits]),
    )


def _shared(named: Sequence[Effect], observations: Observations) -> tuple[Effect, ...]:
    """Return the effects that all campaigns are followed by, in their most frequent setting, in all places named."""
    kept = [effect for effect in named if not _begins_anew(effect, observations)]
    found = [e for e in library().values() if e.told_inside and not gate.missing(e, observations)]
    always = {effect.name for effect in found}
    for name in dict.fromkeys(e.name for e in kept if e.name not in always):
        own = [e for e in kept if e.name == name]
        bare = Counter(replace(e, places=(), excluded=()) for e in own).most_common(1)[0][0]
        everywhere = any(not e.places for e in own)
        places = () if everywhere else tuple(dict.fromkeys(place for e in own for place in e.places))
        found.append(replace(bare, places=places))
    return tuple(found)


def _begins_anew(effect: Effect, observations: Observations) -> bool:
    """Tell whether an effect is a campaign's own."""
    if effect.name in FRAMES or effect.name.startswith(PREFIX):
        return True
    try:
        kinds = {parameter.kind for parameter in gate.checked(effect, observations)}
        reads = gate.reads(effect, observations)
    except EffectError:
        return False
    return "instrument" in kinds or (bool(kinds & {"base", "tool"}) and bool({*CLOCK} & {*reads}))


@dataclass(frozen=True)
class _AsTold(Effect):
    """Parameters that are known with their responses, as one effect."""

    name: ClassVar[str] = "as told"
    told: tuple[Parameter, ...] = ()

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return them."""
        return self.told


@dataclass(eq=False)
class _Visit:
    """One campaign: what it says of the common parameters, about a model that is improved step by step.

    Attributes
    ----------
    fit
        Of it alone: its rows, weights and noise.
    shared, own
        Parameters with their responses in its rows: those of all campaigns, and its own.
    frames
        So far.
    linear, whitening
        The last linearisation.
    """

    fit: Fit
    shared: dict[Key, Parameter]
    own: tuple[Parameter, ...]
    frames: Frames
    whitening: Whitening
    linear: Linear | None = None

    @classmethod
    def of(cls, fit: Fit, shared: Sequence[Effect], own: Sequence[Effect]) -> _Visit:
        """Read the parameters' responses in the rows of a campaign; an effect whose columns it lacks has none."""
        listed = dict(_told([gate.elsewhere(effect, fit.nominal) for effect in shared], fit.nominal))
        mine = tuple(p for effect in own for p in _named(effect, gate.checked(effect, fit.nominal)))
        best, white = fit.explanation.best, fit.explanation.whitening
        return cls(fit, listed, mine, fit.nominal.frames, replace(white, noise=white.noise * best.noise))

    def products(self, keys: Sequence[Key], sizes: Array, values: Array) -> tuple[Array, Array]:
        """Return (P, P) and (P,) products about values of the common parameters."""
        here = np.array([key in self.shared for key in keys])
        told = [self.shared[key] for key in keys if key in self.shared]
        campaign = self.fit.campaign
        nominal = observe(campaign, self.frames)
        change, instrument = displacement(nominal, [(_AsTold(told=tuple(told)), values[here])])
        seen = observe(campaign, self.frames, displacement=change, instrument=instrument)
        columns = moved_by(seen, (*told, *self.own))
        gap = seen.gap + columns[:, :, : len(told)] @ values[here]
        scale = np.concatenate([sizes[here], [p.size for p in self.own]])
        block = Block(_AsTold(), (), columns, scale)
        self.linear = Linear(gap, frame_columns(seen)[0], (block,))
        stack = whitened(self.linear, self.whitening)
        matrix, vector = _without_own(stack.T @ stack, self.linear.frames.shape[2], scale, len(told))
        whole, along = np.zeros((len(keys), len(keys))), np.zeros(len(keys))
        whole[np.ix_(here, here)], along[here] = matrix, vector
        return whole, along

    def step(self, keys: Sequence[Key], values: Array) -> None:
        """Move the frames to where they fit best with new values of the common parameters."""
        if self.linear is None or not self.linear.frames.shape[2]:
            return
        here = np.array([values[k] for k, key in enumerate(keys) if key in self.shared])
        left = self.linear.gap - self.linear.blocks[0].columns[:, :, : len(here)] @ here
        step = frame_step(self.linear, self.whitening, left)
        self.frames = moved(self.frames, step, frame_columns(self.fit.nominal)[1])


def _told(effects: Sequence[Effect], observations: Observations) -> Iterator[tuple[Key, Parameter]]:
    """Yield the parameters of effects that these rows tell, those of a larger effect without the smaller ones in it."""
    names = {effect.name for effect in effects if effect.told_inside}
    for effect in effects:
        if gate.missing(effect, observations):
            continue
        parameters = gate.checked(effect, observations)
        if any(effect.name in other.contained_in for other in effects if other.name in names):
            parameters = gate.independent(effect, observations) or parameters
        for bare, parameter in zip(parameters, _named(effect, parameters), strict=True):
            yield (effect.name, bare.name), parameter


def _named(effect: Effect, parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Give parameters names that are unique among all effects."""
    return tuple(replace(p, label=f"{effect.name}: {p.label}") for p in parameters)


def _without_own(full: Array, flat: int, scale: Array, shared: int) -> tuple[Array, Array]:
    """Take frames and a campaign's own parameters off the products of all columns: frames, parameters, gap."""
    unit = np.concatenate([np.ones(flat), scale, [1.0]])
    full = full * np.outer(unit, unit)
    known = whitener(full[:flat, :flat])
    along = known.T @ full[:flat, flat:]
    rest = full[flat:, flat:] - along.T @ along
    own = slice(shared, len(scale))
    inner = rest[own, own] + np.eye(len(scale) - shared)
    used = [*range(shared), len(scale)]
    cross = rest[own][:, used]
    left = rest[np.ix_(used, used)] - cross.T @ np.linalg.solve(inner, cross)
    # what is left of an exact alias of the frames is rounding of what it was before they were projected out
    hidden = np.diag(left)[:-1] <= inference.PROJECTED_FLOOR * np.diag(full)[flat : flat + shared]
    left[:-1][hidden], left[:, :-1][:, hidden] = 0.0, 0.0
    left = 0.5 * (left + left.T)
    return left[:-1, :-1], left[:-1, -1]
