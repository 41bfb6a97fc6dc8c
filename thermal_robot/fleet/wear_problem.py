"""Joint least squares of several campaigns of one robot: common parameters, frames of each campaign its own.

The common parameters are those of the effects found in any campaign, and those that can be reset, such as joint zeros
(:attr:`Effect.told_inside`): a collision changes joint zeros, whether or not these were off before. All campaigns are
linearised about one common model, so that nonlinear terms are the same in all.

Each campaign has parameters of its own: its unknown frames, and effects of its instrument, frames and clock, and
discovered laws. They are projected out of its normal equations, frames without a prior, the others with their sizes.
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
from thermal_robot.fleet import settings
from thermal_robot.inference import settings as inference
from thermal_robot.inference.algebra import whitener
from thermal_robot.inference.columns import Block, frame_columns, moved_by
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.problem import Linear, Whitening, frame_step, products
from thermal_robot.inference.registration import moved
from thermal_robot.observations import Frames, Observations, observe

Key = tuple[str, str]
"""Names of an effect and of its parameter."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Normal equations of K campaigns in their P common parameters, in units of the expected sizes.

    ``keys`` are names of effect and parameter, ``parameters`` the same without responses, ``titles`` their effects in
    plain words; ``matrices`` (K, P, P) and ``vectors`` (K, P) are whitened, each campaign's own parameters projected
    out; ``has`` (K, P) is whether a campaign has the columns that the parameter's effect reads.
    """

    keys: tuple[Key, ...]
    parameters: tuple[Parameter, ...]
    titles: tuple[str, ...]
    matrices: Array
    vectors: Array
    has: NDArray[np.bool_]


def require_alike(fits: Sequence[Fit]) -> None:
    """Raise a CampaignError unless all campaigns have the joints, root and tool frame and URDF text of the first."""
    first, robot = fits[0].campaign, fits[0].campaign.robot
    for campaign in (fit.campaign for fit in fits[1:]):
        other = campaign.robot
        for what, found, wanted in (
            ("joints", other.joint_names, robot.joint_names),
            ("tool frame", other.tool_frame, robot.tool_frame),
            ("root frame", other.root_frame, robot.root_frame),
        ):
            if found != wanted:
                expected = f"{wanted}, as in {first.name}"
                raise CampaignError(
                    campaign.name, "is of another robot", column=what, found=str(found), expected=expected
                )
        if other.urdf != robot.urdf:
            problem = "has another URDF, so that its errors are counted from another model"
            expected = f"the text of {first.name}'s; name the same file in both"
            raise CampaignError(campaign.name, problem, expected=expected)


def problem(fits: Sequence[Fit]) -> Problem:
    """Build the joint normal equations of fitted campaigns in the order of time, by three Gauss-Newton linearisations.

    All are about common parameter values. Raises :class:`EstimationError` if unknown frames cannot be fitted.
    """
    shared = _shared([effect for fit in fits for effect, _ in fit.effects], fits[0].nominal)
    reported = [
        dict(_reported_parameters([gate.elsewhere(effect, fit.nominal) for effect in shared], fit.nominal))
        for fit in fits
    ]
    listed: dict[Key, Parameter] = {}
    for one in reported:
        listed |= {key: parameter for key, parameter in one.items() if key not in listed}
    keys, bare = tuple(listed), tuple(parameter.bare for parameter in listed.values())
    sizes, values = np.array([parameter.size for parameter in bare]), np.zeros(len(keys))
    visits = [_Visit.of(fit, keys, one) for fit, one in zip(fits, reported, strict=True)]
    for _ in range(settings.LINEARISATIONS):
        parts = [visit.products(sizes, values) for visit in visits]
        matrices, vectors = (np.array(each) for each in zip(*parts, strict=True))
        total = matrices.sum(axis=0) + np.eye(len(keys)) / settings.WIDE**2
        values = sizes * np.linalg.solve(total, vectors.sum(axis=0))
    titles = {effect.name: effect.title for effect in shared}
    has = np.array([visit.here for visit in visits])
    return Problem(keys, bare, tuple(titles[name] for name, _ in keys), matrices, vectors, has)


def _shared(named: Sequence[Effect], observations: Observations) -> tuple[Effect, ...]:
    """Effects with common parameters: all that can be reset, and others found, each in its most frequent setting."""
    kept = [effect for effect in named if not _independent_per_campaign(effect, observations)]
    found = [e for e in library().values() if e.told_inside and not gate.missing(e, observations)]
    always = {effect.name for effect in found}
    for name in dict.fromkeys(e.name for e in kept if e.name not in always):
        own = [e for e in kept if e.name == name]
        bare = Counter(replace(e, places=(), excluded=()) for e in own).most_common(1)[0][0]
        everywhere = any(not e.places for e in own)
        places = () if everywhere else tuple(dict.fromkeys(place for e in own for place in e.places))
        found.append(replace(bare, places=places))
    return tuple(found)


def _independent_per_campaign(effect: Effect, observations: Observations) -> bool:
    """Whether an effect is each campaign's own: of frames, instrument, a discovered law, or base or tool over time."""
    if effect.name in FRAMES or effect.name.startswith(PREFIX):
        return True
    try:
        kinds = {parameter.kind for parameter in gate.checked(effect, observations)}
        reads = gate.reads(effect, observations)
    except EffectError:
        return False
    return "instrument" in kinds or (bool(kinds & {"base", "tool"}) and bool({*CLOCK} & {*reads}))


@dataclass(frozen=True)
class _GivenParameters(Effect):
    """Pseudo-effect of given parameters and responses."""

    name: ClassVar[str] = "as told"
    given: tuple[Parameter, ...] = ()

    def parameters(self, observations: Observations) -> tuple[Parameter, ...]:
        """Return the given parameters."""
        return self.given


@dataclass(eq=False)
class _Visit:
    """One campaign, linearised about the common model.

    ``here`` (P,) masks the common parameters whose columns it has; ``common`` are these with their responses in its
    rows, ``own`` its own parameters; ``linear`` is the last linearisation, about ``frames``, ``None`` before the first.
    """

    fit: Fit
    here: NDArray[np.bool_]
    common: tuple[Parameter, ...]
    own: tuple[Parameter, ...]
    whitening: Whitening
    frames: Frames
    linear: Linear | None = None

    @classmethod
    def of(cls, fit: Fit, keys: Sequence[Key], given: dict[Key, Parameter]) -> _Visit:
        """Prepare a campaign for linearisation: its own parameters, its whitening, and the ``given`` common ones."""
        fresh = [effect for effect, _ in fit.effects if _independent_per_campaign(effect, fit.nominal)]
        own = tuple(p for effect in fresh for p in _named(effect, gate.checked(effect, fit.nominal)))
        white = fit.explanation.whitening
        white = replace(white, noise=white.noise * fit.explanation.best.noise)
        common = tuple(given[key] for key in keys if key in given)
        return cls(fit, np.array([key in given for key in keys]), common, own, white, fit.nominal.frames)

    def products(self, sizes: Array, values: Array) -> tuple[Array, Array]:
        """Linearise about common parameter values (P,), frames refitted; return normal equations (P, P) and (P,)."""
        here, campaign = self.here, self.fit.campaign
        if self.linear is not None:
            common = self.linear.blocks[0].columns[:, :, : here.sum()]
            step = frame_step(self.linear, self.whitening, self.linear.gap - common @ values[here])
            self.frames = moved(self.frames, step, frame_columns(self.fit.nominal)[1])
        nominal = observe(campaign, self.frames)
        change, instrument = displacement(nominal, [(_GivenParameters(given=self.common), values[here])])
        seen = observe(campaign, self.frames, displacement=change, instrument=instrument)
        columns = moved_by(seen, (*self.common, *self.own))
        gap = seen.gap + columns[:, :, : here.sum()] @ values[here]
        scale = np.concatenate([sizes[here], [p.size for p in self.own]])
        self.linear = Linear(gap, frame_columns(seen)[0], (Block(_GivenParameters(), (), columns, scale),))
        full = products(self.linear, self.whitening)
        matrix, vector = np.zeros((len(here), len(here))), np.zeros(len(here))
        flat = self.linear.frames.shape[2]
        matrix[np.ix_(here, here)], vector[here] = _without_own(full, flat, scale, int(here.sum()))
        return matrix, vector


def _reported_parameters(effects: Sequence[Effect], observations: Observations) -> Iterator[tuple[Key, Parameter]]:
    """Yield keys and parameters of the effects whose columns are there, contained effects taken out of larger ones."""
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
    """Prefix the parameters' labels with the effect's name, so that they are unique among all effects."""
    return tuple(replace(p, label=f"{effect.name}: {p.label}") for p in parameters)


def _without_own(full: Array, flat: int, scale: Array, shared: int) -> tuple[Array, Array]:
    """Project frames and a campaign's own parameters out of the Gram matrix of frames, parameters and gap."""
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
