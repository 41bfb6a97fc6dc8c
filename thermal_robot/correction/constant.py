"""What of a model is constant: the same in all configurations and conditions, so that a robot file can hold it.

No effect is asked for by name. Each parameter's unit responses are read in rows whose configurations and conditions are
all different. Those that are one number, or one twist, in all of them are constant. Others become constant once the
temperature is fixed: they are read again in rows of one temperature that has lasted, and must change with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK, LABELS, PER_LINK, split_name
from thermal_robot.campaign.settings import ABSOLUTE_ZERO
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.effects import Parameter, gate
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import Displacement
from thermal_robot.observations import Observations, observe
from thermal_robot.robot import Robot

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
class Told:
    """One parameter of a model.

    Attributes
    ----------
    effect, parameter
        Names of both.
    value, std, unit
        What was fitted, and its standard deviation, NaN where the model does not tell; in the parameter's own unit.
    """

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
    """The part of a model that is the same in all configurations, at one temperature.

    Attributes
    ----------
    temperature
        °C of the robot, at which lengths hold.
    parameters
        All P parameters of the model, effect by effect, in the order of their values.
    held
        (P,) which of them are constant.
    responses
        (P, n + 6 S + 12) what one unit of each does in the chain: in the joints, the segments, the base and the tool;
        zero where it is not constant.
    joints
        n.
    grows
        Whether any of it follows the temperature.
    """

    temperature: float
    parameters: tuple[Told, ...]
    held: NDArray[np.bool_]
    responses: Array
    joints: int
    grows: bool

    @property
    def displacement(self) -> Displacement:
        """What all of it does in the chain: each channel for one row."""
        moved = np.array([told.value for told in self.parameters]) @ self.responses
        joint, segment, base, tool = np.split(moved, [self.joints, -12, -6])
        return Displacement(joint, segment.reshape(-1, 6), base, tool)


def constant(model: CorrectedModel, temperature: float | None = None) -> Constant:
    """Find what of a model is constant.

    Parameters
    ----------
    model
        The corrected model. Of an effect in one place all is constant or nothing is.
    temperature
        °C of all links, for long enough that they have it; by default that at which the URDF's lengths hold. What a
        model takes for settled in all rows to come (a law of the session, or of the row's number) counts as it was at
        the end of the campaign.

    Raises
    ------
    CampaignError
        If the temperature is none.
    EffectError
        If an effect of the model breaks its contract.
    """
    degrees = float(model.settings.reference_temperature if temperature is None else temperature)
    if not ABSOLUTE_ZERO <= degrees < np.inf:
        raise CampaignError("temperature", "no robot is so warm", found=f"{degrees:g}", expected="a number of °C")
    kinds = [rows_of_every_kind(model, warmth) for warmth in (None, degrees, degrees + _WARMER)]
    told: list[Told] = []
    found: list[tuple[str, Array | None, Array | None]] = []
    grows = False
    std = _deviations(model)
    for effect, values in model.effects:
        for value, *read in zip(values, *(gate.checked(effect, each) for each in kinds), strict=True):
            first = read[0]
            told.append(Told(effect.name, first.name, float(value), float(std[len(told)]), first.unit))
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
    """Return rows in which everything differs but, where it is given, a temperature that has lasted.

    Joints and conditions are drawn where the model was measured; within the joints' limits where it does not say.
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
    """(n + 6 S + 12,) what a parameter does in every row; ``None`` where rows differ, or it acts outside the chain."""
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
    """(P,) standard deviation of each parameter; NaN where the model does not tell."""
    count = sum(len(values) for _, values in model.effects)
    if model.spread is None or len(model.spread.covariance) < count:
        return np.full(count, np.nan)
    return np.asarray(np.sqrt(model.spread.covariance.diagonal()[len(model.spread.covariance) - count :]))
