"""Constant part of a corrected model, which a robot file can hold.

No effect is known by name: the unit responses of each parameter are evaluated in rows in which everything varies, and
are constant where they are equal in all. Others are constant at a steady temperature: they are evaluated again in rows
at that temperature, and must depend on it.

**Undetermined** constants can be taken out: each is set to zero as a piece of knowledge. What the posterior of frames
and parameters, N(m, C), says of the others once θ_k = 0 is their conditional mean m − C_k m_k / C_kk and covariance
C − C_k C_kᵀ / C_kk: what a fit without θ_k finds, as far as the model is linear in its errors. The least significant
goes first, and significance is judged anew each time: of two of which only the sum is known, one stays.

**Zeros** to enter in a controller are a model's zero offsets. Where it holds geometry instead, a part of that is zeros:
it is told in other coordinates, the zeros first and then the errors of the axes after Denavit and Hartenberg, as the
diagnosis tells it (:mod:`thermal_robot.inference.inside`). What the unknown frames can take up is not told.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK, LABELS, PER_LINK, split_name
from thermal_robot.campaign.settings import ABSOLUTE_ZERO
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.effects import Parameter, at_joint, at_segment, gate
from thermal_robot.errors import CampaignError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.columns import frame_columns, moved_by
from thermal_robot.inference.inside import distinct, identified
from thermal_robot.inference.registration import moved
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Observations, observe
from thermal_robot.prediction import moves
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd


ROWS = 12
"""Of configurations and conditions: what is the same in so many that were drawn at random is constant."""
_ALIKE = 1e-9
"""Share of a response by which rounding makes it vary from row to row."""
_WIDEST = 3.0
"""rad, m: how far joints without limits are moved."""
_ANY = {"temperature": (10.0, 40.0), "approach": (-1.0, 1.0), "speed": (0.1, 1.0)}
"""Ranges of conditions where a model does not say in which it was measured; (0, 10) of others."""
_LATE = 1e8
"""s (or rows): three years after the campaign, when every link has the temperature that lasts."""
_WARMER = 1.0
"""K: what follows the temperature differs between two of them."""


@dataclass(frozen=True)
class FittedParameter:
    """Fitted value of one parameter of a model, in its own unit, with the standard deviation (NaN where unknown)."""

    effect: str
    parameter: str
    value: float
    std: float
    unit: str

    def __str__(self) -> str:
        known = f" ± {self.std:.2g}" if np.isfinite(self.std) else ""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.effect}: {self.parameter} = {self.value:.6g}{known}{unit}"


@dataclass(frozen=True, eq=False)
class Constant:
    """Part of a model that displaces the chain equally in all configurations and conditions, at one temperature.

    Of the P parameters, effect by effect, ``held`` (P,) are constant. ``responses`` (P, n + 6 S + 12): unit response of
    each in the joints, the segments, the base and the tool; zero where it is not constant. ``temperature``, °C of the
    robot, is that of the lengths; ``grows`` if any of it depends on that.
    """

    temperature: float
    parameters: tuple[FittedParameter, ...]
    held: NDArray[np.bool_]
    responses: Array
    joints: int
    grows: bool

    @property
    def displacement(self) -> Displacement:
        """Displacement of joints, segments, base and tool by all constants together, one row."""
        moved = np.array([told.value for told in self.parameters]) @ self.responses
        joint, segment, base, tool = np.split(moved, [self.joints, -12, -6])
        return Displacement(joint, segment.reshape(-1, 6), base, tool)


def constant(model: CorrectedModel, temperature: float | None = None) -> Constant:
    """Constant part of a model: parameters whose response in the chain is the same in all random test rows.

    ``temperature``, °C, is the steady temperature of all links; by default that of the URDF's lengths. An effect at one
    place is constant as a whole or not at all. Laws of session, time or row number count as after the campaign's end.
    """
    degrees = float(model.settings.reference_temperature if temperature is None else temperature)
    if not ABSOLUTE_ZERO <= degrees < np.inf:
        raise CampaignError("temperature", "no robot is so warm", found=f"{degrees:g}", expected="a number of °C")
    kinds = [rows_of_every_kind(model, warmth) for warmth in (None, degrees, degrees + _WARMER)]
    told: list[FittedParameter] = []
    found: list[tuple[str, Array | None, Array | None]] = []
    grows = False
    std = _deviations(model)
    for effect, values in model.effects:
        for value, *read in zip(values, *(gate.checked(effect, each) for each in kinds), strict=True):
            first = read[0]
            told.append(FittedParameter(effect.name, first.name, float(value), float(std[len(told)]), first.unit))
            always, now, warmer = (_one_for_all(model.robot, parameter) for parameter in read)
            follows = always is None and now is not None and warmer is not None and bool((now != warmer).any())
            grows |= follows
            found.append((f"{effect.name} {first.kind} {first.place}", now if follows else always, now))
    # the constant of a law that begins somewhere is nothing without the rest of it
    changing = {of for of, held, now in found if held is None and (now is None or now.any())}
    nothing = np.zeros(_size(model.robot))
    used = [held if of not in changing else None for of, held, _ in found]
    matrix = np.array([nothing if held is None else held for held in used]).reshape(len(told), len(nothing))
    is_held = np.array([held is not None for held in used], dtype=bool)
    return Constant(degrees, tuple(told), is_held, matrix, model.robot.n, grows)


def rows_of_every_kind(model: CorrectedModel, temperature: float | None = None, rows: int = ROWS) -> Observations:
    """Random rows in which joints and all conditions vary, except a steady ``temperature`` of the links, if given, °C.

    They are drawn uniformly from the measured range, or within the joints' limits where it is unknown.
    """
    robot, rng = model.robot, np.random.default_rng(0)
    ranges = {} if model.spread is None else model.spread.ranges
    limits = zip(np.maximum(robot.lower, -_WIDEST), np.minimum(robot.upper, _WIDEST), strict=True)
    ends = [ranges.get(name, limit) for name, limit in zip(robot.joint_names, limits, strict=True)]
    q = np.column_stack([rng.uniform(low, high if high > low else low + 1.0, rows) for low, high in ends])
    covariates = {}
    for name in model.needs:
        quantity = split_name(name)[0]
        low, high = ranges.get(name, _ANY.get(quantity, (0.0, 10.0)))
        values = rng.uniform(low, high if high > low else low + 1.0, rows)
        values = np.where(values > (low + high) / 2.0, 1.0, -1.0) if quantity == "approach" else values
        if temperature is not None and quantity in PER_LINK:
            values = np.full(rows, temperature)
        elif temperature is not None and name in CLOCK:
            values = values + _LATE
        covariates[name] = values
    campaign = replace(
        model.samples_at(q, covariates),
        orientation=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)) if model.measures == "pose" else None,
        labels={label: np.full(rows, "one to come") for label in LABELS},
        simulated_position=np.zeros((rows, 3)) if model.simulated else None,
    )
    return observe(campaign, model.frames)


def _size(robot: Robot) -> int:
    return robot.n + 6 * len(robot.segments) + 12


def _one_for_all(robot: Robot, parameter: Parameter) -> Array | None:
    """Constant response (n + 6 S + 12,) of a parameter; ``None`` where rows differ, or it acts outside the chain."""
    first = {"joint": 0, "segment": robot.n, "base": _size(robot) - 12, "tool": _size(robot) - 6}
    found = np.zeros(_size(robot))
    for r in parameter.responses:
        if r.channel == "instrument":
            return None
        width = 1 if r.channel == "joint" else 6
        each = r.values.reshape(-1, width)
        if np.ptp(each, axis=0).max() > _ALIKE * np.abs(each).max():
            return None
        start = first[r.channel] + width * r.index
        found[start : start + width] += each[0]
    return found


def _deviations(model: CorrectedModel) -> Array:
    """Return the standard deviation (P,) of each parameter; NaN where unknown."""
    count = sum(len(values) for _, values in model.effects)
    if model.spread is None or len(model.spread.covariance) < count:
        return np.full(count, np.nan)
    return np.asarray(
        np.sqrt(np.maximum(model.spread.covariance.diagonal()[len(model.spread.covariance) - count :], 0.0))
    )


def determined(
    model: CorrectedModel, min_sigma: float, temperature: float | None = None
) -> tuple[CorrectedModel, tuple[FittedParameter, ...]]:
    """Set a model's insignificant constants to zero, the least significant first (backward elimination).

    Parameters
    ----------
    model
        The corrected model; what is not constant in it is kept, whatever is known of it.
    min_sigma
        A constant is kept if it is so many standard deviations from zero, given those that are already removed.
    temperature
        °C, as for :func:`~thermal_robot.correction.constant.constant`.

    Returns
    -------
    CorrectedModel
        Model with these parameters at zero, and all others conditional on that.
    tuple of FittedParameter
        Removed parameters with their fitted values.

    Raises
    ------
    CampaignError
        If the model does not say how far its parameters may be off, or ``min_sigma`` is no number of deviations.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import determined
    >>> model, left_out = determined(tr.diagnose(tr.demo_campaign()).model, min_sigma=2.0)
    >>> left_out
    ()
    """
    if not 0.0 <= min_sigma < np.inf:
        raise CampaignError(
            "min_sigma", "is no number of standard deviations", found=f"{min_sigma:g}", expected="a number such as 2"
        )
    known, spread = constant(model, temperature), model.spread
    frames = frame_columns(rows_of_every_kind(model))[1]
    names = tuple(name for name, own in zip(frames, moves(frames), strict=True) if own)
    if spread is None or len(spread.covariance) != len(names) + len(known.parameters):
        raise CampaignError(
            "min_sigma", "the model does not say how sure its parameters are", expected="one of this version: diagnose"
        )
    state = np.concatenate([np.zeros(len(names)), [told.value for told in known.parameters]])
    covariance, wider = spread.covariance, spread.wider
    left, gone = (len(names) + np.flatnonzero(known.held)).tolist(), []
    while left:
        std = np.sqrt(np.maximum(covariance.diagonal(), settings.TINY))
        weakest = min(left, key=lambda k: abs(state[k]) / std[k])
        if abs(state[weakest]) >= min_sigma * std[weakest]:
            break
        left.remove(weakest)
        gone.append(weakest)
        wider = None if wider is None else _known(state, wider, weakest)[1]
        state, covariance = _known(state, covariance, weakest)
    ends = np.cumsum([len(names), *(len(values) for _, values in model.effects)])
    kept = replace(
        model,
        effects=tuple((e, state[a:b]) for (e, _), a, b in zip(model.effects, ends, ends[1:], strict=False)),
        frames=moved(model.frames, state[: len(names)], names),
        spread=replace(spread, covariance=covariance, wider=wider),
    )
    return kept, tuple(known.parameters[k - len(names)] for k in sorted(gone))


def _known(state: Array, covariance: Array, k: int) -> tuple[Array, Array]:
    """Conditional mean (K,) and covariance (K, K) of a normal distribution, given that parameter ``k`` is zero."""
    variance, along = covariance[k, k], covariance[:, k]
    share = along / variance if variance > 0.0 else np.zeros(len(along))
    mean, rest = state - share * state[k], covariance - np.outer(share, along)
    mean[k], rest[k], rest[:, k] = 0.0, 0.0, 0.0
    return mean, rest


_ROWS = 100
"""Of poses in which zeros are told from the rest of the geometry: as many as a good campaign has."""
_SEEN = settings.SEEN**0.5
"""Of the largest singular value: a direction below is an exact alias of the unknown frames, or of others."""
TOLD, UNSEEN, NONE = "determined", "not determined", "not in the model"
"""What may be said of a zero."""


def zero_offsets(
    model: CorrectedModel, *, temperature: float | None = None, min_sigma: float | None = None, alone: bool = False
) -> pd.DataFrame:
    """Joint zero offsets of a corrected model, to be added to commands or entered in a controller.

    Parameters
    ----------
    model
        The corrected model.
    temperature, min_sigma, alone
        As for :func:`~thermal_robot.correction.calibrated`; alone, zeros are fitted without anything else.

    Returns
    -------
    pandas.DataFrame
        A row for each joint that is commanded. ``joint``; ``add_to_command``: the joint is where it was meant to be
        once this is added to its command (it stands at its command minus this); ``std``, one standard deviation, empty
        where the model does not tell; ``unit``, that of the joint's column in the campaign; ``zero``: ``determined``,
        ``not determined`` (the unknown base or tool can take it up, or the data leave half or more of the deviation
        that was expected before them: the rule by which a diagnosis calls a parameter identified) or
        ``not in the model``, both with an offset of 0.

    Raises
    ------
    CampaignError
        As :func:`~thermal_robot.correction.calibrated`.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import zero_offsets
    >>> off = {"joint_offset": {"joint_2": 1e-3}}
    >>> campaign = tr.simulate("builtin:rv_m2", off, tool_frame="tool0", rows=40, noise=1e-5, base_known=False)
    >>> table = zero_offsets(tr.diagnose(campaign).model)
    >>> table["zero"][1], round(float(table["add_to_command"][1]), 4)
    ('determined', -0.001)
    """
    import pandas as pd

    zeros = zeros_in(model, temperature, min_sigma, alone)
    units, robot = model.settings.units, model.robot
    scales = np.array([units.joint_scale(kind) for kind in robot.joint_types])
    return pd.DataFrame(
        {
            "joint": robot.joint_names,
            "add_to_command": -zeros.values / scales + 0.0,
            "std": zeros.std / scales,
            "unit": [units.joint_unit(kind) for kind in robot.joint_types],
            "zero": zeros.said,
        }
    )


@dataclass(frozen=True, eq=False)
class Zeros:
    """Zeros of a model's joints: q_actual = q_command + zero.

    ``matrix`` (n, P): zero of each joint per unit of each parameter, 0 unless determined; ``values``, ``std`` (n,) rad
    or m, the latter NaN where unknown or undetermined; ``said``: status of each joint, one of :data:`TOLD`,
    :data:`UNSEEN`, :data:`NONE`.
    """

    matrix: Array
    values: Array
    std: Array
    said: tuple[str, ...]


def zeros_in(
    model: CorrectedModel, temperature: float | None = None, min_sigma: float | None = None, alone: bool = False
) -> Zeros:
    """Joint zeros for a file: the model's, without insignificant parameters if asked; or those fitted ``alone``."""
    if not alone:
        return joint_zeros(model if min_sigma is None else determined(model, min_sigma, temperature)[0], temperature)
    known = constant(model, temperature)
    _, said = _coordinates(model, known, np.zeros(0, dtype=np.int64))
    told = np.array([word != UNSEEN for word in said])
    values = np.where(told, fitted_alone(model, "zeros")[: model.robot.n], 0.0)
    words = tuple(TOLD if own else UNSEEN for own in told)
    return Zeros(np.zeros((len(said), len(known.parameters))), values, np.full(len(said), np.nan), words)


def fitted_alone(model: CorrectedModel, holds: str) -> Array:
    """Displacement (n + 6 S,) of joints and segments that was fitted without the rest of the model; else an error."""
    for gap in model.files:
        if gap.holds == holds and gap.alone:
            return np.array(gap.alone)
    raise CampaignError("alone", "the model does not hold a fit of the file alone", expected="a model of this version")


def joint_zeros(model: CorrectedModel, temperature: float | None = None) -> Zeros:
    """Joint zeros of a model's constant part, with those that its geometric parameters amount to; 0 if undetermined."""
    known = constant(model, temperature)
    used = np.flatnonzero(
        known.responses[:, :-12].any(axis=1) & np.array([t.value != 0.0 for t in known.parameters], dtype=bool)
    )
    change, said = _coordinates(model, known, used)
    std, expected = _zero_spread(model, known, used, change)
    told = np.array([word == TOLD for word in said]) & (np.isnan(std) | identified(std, expected))
    said = [UNSEEN if word == TOLD and not own else word for word, own in zip(said, told, strict=True)]
    matrix = np.zeros((model.robot.n, len(known.parameters)))
    matrix[:, used] = np.where(told[:, None], change, 0.0)
    values = matrix @ np.array([told.value for told in known.parameters])
    return Zeros(matrix, values, np.where(told, std, np.nan), tuple(said))


def _zero_spread(model: CorrectedModel, known: Constant, used: NDArray[np.int64], change: Array) -> tuple[Array, Array]:
    """Posterior standard deviation (n,) of each joint's zero, NaN where unknown, and the prior one.

    For models without prior deviations, the effects' expected sizes are used.
    """
    spread, count = model.spread, len(known.parameters)
    if spread is None or len(spread.covariance) < count:
        return np.full(len(change), np.nan), np.full(len(change), np.nan)
    numbers = len(spread.covariance) - count + used
    variance = (change @ spread.covariance[np.ix_(numbers, numbers)] * change).sum(axis=1)
    prior = spread.prior
    if prior is None or len(prior) != count:
        seen = rows_of_every_kind(model)
        prior = np.array([p.size for effect, _ in model.effects for p in gate.checked(effect, seen)])
    return np.sqrt(np.maximum(variance, 0.0)), np.linalg.norm(change * prior[used], axis=1)


def _coordinates(model: CorrectedModel, known: Constant, used: NDArray[np.int64]) -> tuple[Array, list[str]]:
    """Express the U ``used`` constants as joint zeros where possible: zeros (n, U) per unit of each, status of zeros.

    A zero is not determined if the unknown base and tool can take up its response. Solved by SVD and pseudo-inverse.
    """
    robot, observations = model.robot, rows_of_every_kind(model, rows=_ROWS)
    own = [_acting(robot, known, int(k)) for k in used]
    zeros = [Parameter("zero", "", 1.0, "joint", name, (at_joint(j, 1.0),)) for j, name in enumerate(robot.joint_names)]
    rest = [p for effect, _ in model.effects for p in gate.independent(effect, observations)]
    frames = frame_columns(observations)[0]
    equations = frames.shape[0] * frames.shape[1]
    frames = frames.reshape(equations, -1) if frames.size else np.zeros((equations, 0))
    whole = moved_by(observations, [*zeros, *rest, *own]).reshape(equations, -1)
    length = np.linalg.norm(whole, axis=0) + settings.TINY
    left = (without(whole, orthonormal(frames)) if frames.size else whole) / length
    # what moves the target by rounding alone is hidden, too: a joint on whose axis it sits
    hidden = (np.linalg.norm(left, axis=0) < _SEEN) | (length < _SEEN * length.max(initial=0.0))
    change, said = np.zeros((robot.n, len(own))), [UNSEEN if unseen else NONE for unseen in hidden[: robot.n]]
    if not own or hidden[-len(own) :].all():
        return change, said
    basis, size, turn = np.linalg.svd(left[:, -len(own) :], full_matrices=False)
    seen = size > _SEEN * size[0]
    # what each is in the directions of the constants that can be seen, if it is nothing beside them
    inside = basis[:, seen].T @ left
    within = ~hidden & (np.linalg.norm(left - basis[:, seen] @ inside, axis=0) < _SEEN)
    across = inside / size[seen, None]
    chosen = distinct(across / (np.linalg.norm(across, axis=0) + settings.TINY), within)
    of_each = np.linalg.pinv(across[:, chosen]) @ turn[seen] * length[-len(own) :] / length[chosen, None]
    for row, j in zip(of_each, chosen, strict=True):
        if j < robot.n:
            change[j], said[j] = row, TOLD
    return change, said


def _acting(robot: Robot, known: Constant, k: int) -> Parameter:
    """Response in joints and segments of constant ``k``, without base and tool, as a parameter."""
    joints, twists = known.responses[k, : robot.n], known.responses[k, robot.n : -12].reshape(-1, 6)
    turned = [at_joint(int(j), joints[j]) for j in np.flatnonzero(joints)]
    placed = [at_segment(int(s), twists[s]) for s in np.flatnonzero(twists.any(axis=1))]
    return Parameter(known.parameters[k].parameter, "", 1.0, "link", "", (*turned, *placed))
