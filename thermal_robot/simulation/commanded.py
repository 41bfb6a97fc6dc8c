"""What the simulated robot is told to do, and when: rows drawn, given, or those of a campaign; and their conditions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign import names as columns
from thermal_robot.campaign.checked import checked_mapping
from thermal_robot.campaign.names import did_you_mean, listed, split_name, tilted
from thermal_robot.campaign.read import arrived
from thermal_robot.campaign.recognise import TYPING_ERROR
from thermal_robot.effects import Effect, RandomEffect, gate, named
from thermal_robot.effects.quantities import unit
from thermal_robot.errors import CampaignError, EffectError
from thermal_robot.observations import Observations
from thermal_robot.robot import Robot, joint_range
from thermal_robot.schema import LARGEST, MisfitError, fitted, matrix, number, shown, whole
from thermal_robot.simulation import schedule, settings

CALL = "simulate()"
"""What messages call the file that there is none of."""


def commanded(
    robot: Robot, rows: Any, repeats: Any, commands: Any, conditions: Any, rng: np.random.Generator
) -> Campaign:
    """Return the rows that are simulated, with their conditions and nothing measured.

    Parameters
    ----------
    robot, rows, repeats, commands, conditions
        As for :func:`thermal_robot.simulate`.
    rng
        Source of the poses, where they are drawn.

    Raises
    ------
    CampaignError
        Rows, positions or conditions that no campaign has.
    """
    if isinstance(commands, Campaign):
        plan = _of_campaign(robot, rows, repeats, commands)
    else:
        poses, times = _poses(robot, rows, repeats, commands, rng)
        q, which = schedule.in_turn(poses, schedule.visits(len(poses) * times, times))
        labels = {"pose": np.array([str(k + 1) for k in which])} if times > 1 else {}
        given = schedule.conditions(len(q), settings.RISE)
        plan = Campaign("simulated", robot, q, covariates=given, labels=labels, base_known=True, tool_known=True)
    return arrived(_under(plan, conditions))


def _of_campaign(robot: Robot, rows: Any, repeats: Any, commands: Campaign) -> Campaign:
    """Return the rows of a campaign, without what was measured."""
    if rows is not None or repeats != 1:
        expected = "neither rows nor repeats beside a campaign, which has its own"
        raise CampaignError(CALL, "too much is said of the rows", expected=expected)
    if commands.robot.joint_names != robot.joint_names:
        found, expected = listed(commands.robot.joint_names), f"the robot's {listed(robot.joint_names)}"
        raise CampaignError(
            CALL, "the campaign commands other joints", column="commands", found=found, expected=expected
        )
    return replace(
        commands, robot=robot, position=None, orientation=None, targets=None, noise_of_rows=None, warnings=()
    )


def _poses(robot: Robot, rows: Any, repeats: Any, commands: Any, rng: np.random.Generator) -> tuple[Array, int]:
    """Return (P, n) different poses, and how often each is measured."""
    times = fitted(whole(1), repeats, CALL, "repeats")
    if commands is not None:
        if rows is not None:
            raise CampaignError(CALL, "too much is said of the rows", expected="either rows or commands")
        return _given(robot, commands), times
    count = fitted(whole(1), settings.ROWS if rows is None else rows, CALL, "rows")
    if count % times:
        expected = f"a number of rows of which {times} visit each pose"
        raise CampaignError(CALL, "does not divide into poses", column="rows", found=str(count), expected=expected)
    low, high = joint_range(robot)
    for joint, width in zip(robot.joint_names, high - low, strict=True):
        if not np.isfinite(width):
            expected = "a <limit> in the URDF for a joint that slides, or commands of your own"
            raise CampaignError(CALL, "no poses can be drawn", column=joint, found="no limits", expected=expected)
    return rng.uniform(low, high, (count // times, robot.n)), times


def _given(robot: Robot, commands: Any) -> Array:
    """Return (P, n) positions that a user gave; (n,) counts as one row."""
    rows = f"rows of {robot.n} joint positions, or a campaign, which read_samples makes of a table"
    if not isinstance(commands, (list, tuple, np.ndarray)):
        raise CampaignError(CALL, "no positions", column="commands", found=type(commands).__name__, expected=rows)
    if len(commands) == robot.n and not any(isinstance(each, (list, tuple, np.ndarray)) for each in commands):
        commands = [commands]
    plain = [each.tolist() if isinstance(each, np.ndarray) else each for each in commands]
    poses: Array = fitted(matrix((None, robot.n)), plain, CALL, "commands")
    if not len(poses):
        raise CampaignError(CALL, "there is no row", column="commands", expected=rows)
    return poses


def _under(plan: Campaign, conditions: Any) -> Campaign:
    """Return the rows under conditions that are given, beside those that they had."""
    given: Mapping[str, Any] = checked_mapping(CALL, "conditions", {} if conditions is None else conditions)
    covariates, labels, extra = dict(plan.covariates), dict(plan.labels), list(plan.extra)
    for name, values in given.items():
        own = _known(name, plan.robot)
        held: dict[str, Any] = labels if name in columns.LABELS else covariates
        held.pop(name, None)
        if values is not None:
            held[name] = _of_rows(name, values, plan.samples)
            extra += [name] if not own and name not in extra else []
    kept = {name: gaps for name, gaps in plan.missing.items() if name not in given}
    # what followed from an order follows anew from another
    followed = tuple(name for name in plan.derived if name not in given)
    if {*columns.CLOCK, "session"} & set(given):
        covariates = {name: values for name, values in covariates.items() if name not in followed}
    left = tuple(name for name in followed if name in covariates)
    named = tuple(name for name in extra if name in covariates)
    return replace(plan, covariates=covariates, labels=labels, extra=named, missing=kept, derived=left, travelled={})


def _of_rows(name: str, values: Any, rows: int) -> NDArray[Any]:
    """Return (N,) values of a condition; one stands for all rows."""
    try:
        found = np.asarray(values, dtype=np.str_ if name in columns.LABELS else np.float64)
        return np.broadcast_to(found, rows).copy()
    except (TypeError, ValueError):
        expected = f"one value for all rows, or one for each of {rows}"
        raise CampaignError(CALL, "no condition", column=name, found=shown(values), expected=expected) from None


def _known(name: str, robot: Robot) -> bool:
    """Tell whether the format defines a column; refuse one that is no condition, and typing errors."""
    if name in robot.joint_names or name in (*columns.MEASURED, *columns.SIMULATED):
        what = "is commanded, no condition" if name in robot.joint_names else "is no condition"
        raise CampaignError(CALL, what, column=name, expected="positions in commands; poses are what is simulated")
    places = {
        **dict.fromkeys(columns.PER_JOINT, robot.joint_names),
        **dict.fromkeys(columns.PER_LINK, robot.urdf_links),
    }
    known = columns.conditions(robot.joint_names, robot.urdf_links)
    quantity, place = split_name(name)
    if name in known or name in columns.LABELS:
        return True
    if place and quantity in places:
        what = "the chain has no such joint" if quantity in columns.PER_JOINT else "the robot has no such link"
        near = did_you_mean(place, places[quantity])
        raise CampaignError(
            CALL, f"{what}{near}", column=name, expected=f"{quantity}. and one of {listed(places[quantity])}"
        )
    # a tilt of what is no link is a column of the user's own
    offered = [*(column for column in known if not tilted(column)), *columns.LABELS]
    meant = did_you_mean(name, offered, cutoff=TYPING_ERROR)
    if meant:
        raise CampaignError(CALL, f"there is no such condition{meant}", column=name)
    return False


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
