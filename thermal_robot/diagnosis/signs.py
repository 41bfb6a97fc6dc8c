"""Quantities that count the other way: read with the other sign where all that can tell agree, before the search.

An elastic joint yields to its load, lost motion stops short, a warm link grows: such parameters have one side. They are
fitted once as if they could have either, beside all known effects. Where a quantity makes all of them that are beyond
three sigma negative, and the best explanation with that quantity turned round leaves clearly less than the best
without, it is turned round, and all that comes after reads it so. Where those that can tell disagree, nothing is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.campaign import GRAVITY, turned_round
from thermal_robot.diagnosis import settings
from thermal_robot.effects import Effect, Parameter, choose, gate
from thermal_robot.inference import settings as inference_settings
from thermal_robot.inference.columns import Block, block, frame_columns
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.explain import Explanation, explain, log_priors, settings_of_one
from thermal_robot.inference.frames import register
from thermal_robot.inference.problem import Linear, contained, gram
from thermal_robot.inference.refine import heard
from thermal_robot.inference.robust import Noise
from thermal_robot.inference.search import Search
from thermal_robot.kinematics import gravity_torques
from thermal_robot.observations import observe

Sides = tuple[NDArray[np.str_], ...]
SAID = {
    "torque": "torque.* counts the load, not the motor: it is read with the other sign",
    "approach": "approach.* tells whence each joint came, not which way it went: it is read with the other sign",
    "temperature": "temperature falls where links grow: its differences from reference_temperature are read with the "
    "other sign",
    GRAVITY: "gravity points the other way than stated, as of an arm that hangs: it is read with the other sign; write "
    "it under [robot]",
}
"""By quantity: what is told first where it is turned round."""
STRAIGHT = (
    "directions of approach that follow from the order of the rows have the wrong sign: where the robot does not go "
    'straight from the pose before to the next, write moves = "unknown" under [robot]'
)


def as_counted(campaign: Campaign, own: Sequence[Effect] = ()) -> Campaign:
    """Read with the other sign what counts the other way, and say so first; ``own`` are the user's effects."""
    tried: set[str] = set()
    while (quantity := _against(campaign, own, tried)) is not None:
        tried.add(quantity)
        derived = any(name.split(".")[0] == quantity for name in campaign.derived)
        said = STRAIGHT if derived else SAID[quantity]
        campaign = campaign if derived else turned_round(campaign, quantity)
        campaign = replace(campaign, warnings=(said, *campaign.warnings))
    return replace(campaign, warnings=(*campaign.warnings, *_against_gravity(campaign)))


def _against_gravity(campaign: Campaign) -> Iterator[str]:
    """Say where reported torques have the sign of none that hold the arm."""
    robot = campaign.robot
    columns = {j: f"torque.{name}" for j, name in enumerate(robot.joint_names)}
    joints = [j for j, column in columns.items() if column in campaign.covariates]
    if not joints or not robot.has_masses:
        return
    payload = campaign.covariates.get("payload")
    holding = gravity_torques(robot, campaign.q, payload=payload, payload_com=campaign.payload_com)[:, joints]
    read = np.column_stack([campaign.covariates[columns[j]] for j in joints])
    one, other = (values - values.mean(axis=0) for values in (holding, read))
    alike = float((one * other).sum() / max(np.linalg.norm(one) * np.linalg.norm(other), inference_settings.TINY))
    if alike < inference_settings.AGAINST_GRAVITY:
        yield (
            f"torque.* goes against the torques that hold the URDF's masses (correlation {alike:.2f}): the sign of "
            "torque.* is reversed, or gravity points up"
        )


@dataclass(frozen=True, eq=False)
class _Told:
    """All known effects at the nominal robot, each in its first setting, and by what each parameter has its side."""

    linear: Linear
    sides: Sides

    @classmethod
    def of(cls, campaign: Campaign, own: Sequence[Effect]) -> _Told:
        seen = observe(campaign, register(campaign))
        able = [effect for effect in choose((), (), own) if not gate.missing(effect, seen)]
        items = [block(seen, gate.variants(effect, seen)[0]) for effect in able]
        items = [item.held for item in items if len(item.sizes)]
        return cls(
            Linear(seen.gap, frame_columns(seen)[0], tuple(items)),
            tuple(np.array([_side(item.effect, p, campaign) for p in item.bare]) for item in items),
        )

    def turned(self, quantity: str) -> Linear:
        """Return the problem with what goes with a quantity turned round."""
        items = zip(self.linear.blocks, self.sides, strict=True)
        blocks = (replace(item, source=item.columns * np.where(own == quantity, -1.0, 1.0)) for item, own in items)
        return replace(self.linear, blocks=tuple(blocks))

    def either(self) -> Linear:
        """Return the problem as if every parameter could have either sign."""
        return replace(self.linear, blocks=tuple(_either(item) for item in self.linear.blocks))


def _side(effect: Effect, parameter: Parameter, campaign: Campaign) -> str:
    """Return the quantity by which a parameter has its side: the first that is there; empty where it has none."""
    known = (
        q
        for q in effect.sided_by
        if q == GRAVITY or q in campaign.covariates or f"{q}.{parameter.place}" in campaign.covariates
    )
    return next(known, "") if parameter.positive else ""


def _either(item: Block) -> Block:
    return replace(item, bare=tuple(replace(p, positive=False) for p in item.bare))


def _against(campaign: Campaign, own: Sequence[Effect], tried: set[str]) -> str | None:
    """Return the quantity of those not tried that counts the other way most clearly."""
    told = _Told.of(campaign, own)
    if not any((sides != "").any() for sides in told.sides):
        return None
    families = [item.effect.name for item in told.linear.blocks]
    free = explain(told.either(), Noise.of(campaign), families=families)
    votes = _votes(free, told.sides)
    against = [q for q, z in votes.items() if q not in tried and _agree(z)]
    if not against:
        return None
    read = _best(told.linear, free)
    turned = {q: _best(told.turned(q), free) for q in against}
    weight = bool([*_against_gravity(campaign)])  # that the URDF's masses say so, too, is a witness
    clear = [q for q, best in turned.items() if _clearly(best, read, q == "torque" and weight)]
    return max(clear, key=lambda q: turned[q].log_evidence, default=None)


def _votes(free: Explanation, sides: Sides) -> dict[str, Array]:
    """Return by quantity how many standard deviations each parameter that has its side by it is away from zero."""
    votes: dict[str, list[float]] = {}
    for b, (values, covariance) in free.values.items():
        deviation = np.sqrt(np.maximum(np.diag(covariance), inference_settings.TINY))
        for quantity, z in zip(sides[b].tolist(), (values / deviation).tolist(), strict=True):
            if quantity:
                votes.setdefault(quantity, []).append(z)
    return {quantity: np.array(own) for quantity, own in votes.items()}


def _agree(z: Array) -> bool:
    """Tell whether all parameters that can tell are negative: each for itself, or, where none can, all together."""
    sure = z[np.abs(z) > settings.WRONG_SIDE]
    if not len(sure):
        return bool(z.sum() < -settings.WRONG_SIDE * np.sqrt(len(z)))
    return bool((sure < 0.0).all())


def _clearly(turned: Combination, read: Combination, witnessed: bool) -> bool:
    """Tell whether a quantity turned round explains more, and leaves less unless something else says so, too."""
    more = turned.log_evidence - read.log_evidence
    return more > settings.INSISTS and (witnessed or turned.noise < settings.LEAVES_LESS * read.noise)


def _best(linear: Linear, free: Explanation) -> Combination:
    """Return the best explanation that keeps all sides; rows set aside are heard, as what is denied may do that."""
    problem = gram(linear, replace(heard(free), smooth=None))
    effects = [item.effect for item in linear.blocks]
    apart = contained(problem) | settings_of_one([effect.name for effect in effects])
    search = Search(problem, log_priors(effects), apart)
    return search.climb(free.best.blocks if search.allowed(free.best.blocks) else ())
