"""What is asked to be at work: effects by name or as they are, and a value for each of their parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign.names import did_you_mean, listed
from thermal_robot.effects import Effect, RandomEffect, gate, named
from thermal_robot.effects.quantities import unit
from thermal_robot.errors import EffectError
from thermal_robot.observations import Observations
from thermal_robot.schema import LARGEST, MisfitError, number, shown

Array = NDArray[np.float64]
Values: TypeAlias = "float | Sequence[float] | Array | Mapping[str, float]"
"""One number for all parameters, one for each in their order, or some by name: the others are 0. SI."""
AtWork: TypeAlias = "Mapping[str | Effect, Values] | Mapping[str, Values] | Iterable[tuple[str | Effect, Values]]"
"""Effects with their values: by name, in the setting in which they are first looked for, or as they are."""

_EACH = "values by name of an effect, such as {'joint_gain': {'joint_2': 1e-3}}"


@dataclass(frozen=True)
class Place:
    """A parameter of which a value is asked.

    Attributes
    ----------
    name, label, joint, unit
        In full; without its place; the place alone; its unit.
    positive
        Whether it cannot be negative.
    """

    name: str
    label: str
    joint: str
    unit: str
    positive: bool


def at_work(effects: AtWork | None, seen: Observations) -> list[tuple[Effect, Array]]:
    """Return effects with the (P,) values of their parameters; one that scatters has one a joint.

    Parameters
    ----------
    effects
        As the user gave them; ``None`` for none.
    seen
        The commands and conditions at which they are to be at work.

    Raises
    ------
    EffectError
        A name that no effect or no parameter has, a value that is no number or has the wrong sign, an effect that these
        rows give nothing to follow.
    """
    return [_asked(kind, values, seen) for kind, values in _pairs(effects)]


def _pairs(effects: Any) -> list[tuple[Any, Any]]:
    if effects is None:
        return []
    if isinstance(effects, Mapping):
        return list(effects.items())
    if isinstance(effects, (list, tuple)) and all(isinstance(e, (list, tuple)) and len(e) == 2 for e in effects):
        return [(kind, values) for kind, values in effects]
    raise EffectError(f"these are no effects with values: {shown(effects)}; expected {_EACH}")


def _asked(kind: Any, values: Any, seen: Observations) -> tuple[Effect, Array]:
    if not isinstance(kind, (str, Effect)):
        raise EffectError(f"{shown(kind)} is neither the name of an effect nor an effect; expected {_EACH}")
    effect = named(kind) if isinstance(kind, str) else kind
    if isinstance(effect, RandomEffect):
        return effect, _values(effect, _scattering(effect, seen), values)
    _require_conditions(effect, seen)
    if isinstance(kind, str):
        effect = gate.variants(effect, seen)[0]
    places = [Place(p.name, p.label, p.place, p.unit, p.positive) for p in gate.checked(effect, seen)]
    if not places:
        settings = ", ".join(f"{argument}=…" for argument in gate.arguments(effect))
        raise EffectError(
            f"effect {effect.name!r} has no parameters here, so that nothing can be simulated; give it with the "
            f"settings that bring some, as {type(effect).__name__}({settings})"
        )
    return effect, _values(effect, places, values)


def _require_conditions(effect: Effect, seen: Observations) -> None:
    """Refuse an effect that has nothing to follow, by what would be needed."""
    # a condition may stand still, as on a robot that has warmed through
    lacks = [column for column in gate.missing(effect, seen) if column not in seen.covariates]
    if not lacks:
        return
    columns = [column for column in lacks if " " not in column and "<" not in column]
    how = f"; give one value, or one a row, as conditions={{{columns[0]!r}: [...]}}" if columns else ""
    raise EffectError(f"effect {effect.name!r} has nothing to follow: it needs {', '.join(lacks)}{how}")


def _scattering(effect: RandomEffect, seen: Observations) -> list[Place]:
    """Return the parameters of an effect that scatters, one a joint."""
    robot = seen.robot
    own = effect.joints(robot.joint_names)
    return [Place(f"{effect.label}, {j}", effect.label, j, unit(robot, j), True) for j in own]


def _values(effect: Effect, places: Sequence[Place], given: Any) -> Array:
    """Return (P,) the values of an effect's parameters."""
    found = np.zeros(len(places))
    if isinstance(given, Mapping):
        for name, value in given.items():
            k = _which(effect, places, name)
            found[k] = _number(effect, places[k], value)
        return found
    if isinstance(given, (list, tuple, np.ndarray)):
        each = list(given)
        if len(each) != len(places):
            names = listed([place.name for place in places])
            raise EffectError(f"effect {effect.name!r} has {len(places)} parameters, {len(each)} values given: {names}")
        return np.array([_number(effect, place, value) for place, value in zip(places, each, strict=True)])
    units = dict.fromkeys(place.unit for place in places)
    if len(units) > 1:
        raise EffectError(
            f"effect {effect.name!r}: one number cannot stand for parameters in {', '.join(units)}; "
            f"give values by name: {listed([place.name for place in places])}"
        )
    return np.array([_number(effect, place, given) for place in places])


def _which(effect: Effect, places: Sequence[Place], name: Any) -> int:
    """Return the index of the one parameter of a name, of a place, or of a label."""
    for candidates in ([p.name for p in places], [p.joint for p in places], [p.label for p in places]):
        found = [k for k, candidate in enumerate(candidates) if candidate == name]
        if len(found) == 1:
            return found[0]
        if found:
            meant = listed([places[k].name for k in found])
            raise EffectError(f"effect {effect.name!r}: {name!r} is {len(found)} parameters; name one of {meant}")
    names = [place.name for place in places]
    near = did_you_mean(str(name), dict.fromkeys((*names, *(place.joint for place in places))))
    raise EffectError(f"effect {effect.name!r} has no parameter {name!r} here{near}; there are {listed(names)}")


def _number(effect: Effect, place: Place, value: Any) -> float:
    """Return a value of a parameter, seen to be one."""
    least = 0.0 if place.positive else -LARGEST
    what = f"a number{', not negative,' if place.positive else ''} in {place.unit}"
    kind = number(least=least, expected=what)
    try:
        return float(kind(value, f"effect {effect.name!r}, parameter {place.name!r}"))
    except MisfitError as error:
        raise EffectError(str(error)) from None
