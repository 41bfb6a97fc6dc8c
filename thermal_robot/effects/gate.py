"""Validation of what effects return: all callers pass through here, and a breach of the contract is an error.

An effect may be anybody's code. What it raises, and an answer of the wrong type or content, end in an ``EffectError``
that names the effect and the method called.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import Channel, Driver, Effect, Parameter, Response
from thermal_robot.effects.settings import KEPT
from thermal_robot.errors import EffectError, OwnEffectError

if TYPE_CHECKING:
    from thermal_robot.observations import Observations
    from thermal_robot.robot import Robot

KINDS = ("joint", "link", "base", "tool", "instrument")
"""Kinds of place that a parameter may sit in."""
_LOCAL = ("joint", "link")
_FIELDS: tuple[tuple[str, Callable[[Any], bool], str], ...] = (
    *((name, lambda found: isinstance(found, str), "text") for name in ("label", "unit", "kind", "place")),
    ("kind", lambda found: found in KINDS, f"one of {', '.join(KINDS)}"),
    ("size", lambda found: isinstance(found, Real) and 0.0 < float(found) < np.inf, "a finite number above 0"),
    ("positive", lambda found: isinstance(found, bool), "True or False"),
)


def checked(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return the validated parameters of an effect in its ``places`` without the ``excluded`` ones.

    Each has a unique name, a kind of place, a place of that kind that the robot has (or none), a positive size, and
    finite responses of the shape that :class:`Response` states. Raises :class:`EffectError` otherwise, or if the effect
    raises anything: the effect, the parameter, what was found and what was expected. The last few answers are memoised
    with the observations.
    """
    if not _equal_by_fields(effect):
        return _kept(effect, _parameters(effect, observations), observations.robot)
    whole, asked = placed(effect), observations.parameters
    found = asked.pop(whole) if whole in asked else _parameters(whole, observations)
    asked[whole] = found
    while len(asked) > KEPT:
        del asked[next(iter(asked))]
    return _kept(effect, found, observations.robot)


def _equal_by_fields(effect: Any) -> bool:
    """Whether an effect can be hashed and its equality compares all of its fields, so that answers may be memoised."""
    try:
        hash(effect)
    except TypeError:
        return False
    return isinstance(effect, Effect) and vars(effect).keys() == {own.name for own in fields(effect) if own.compare}


def placed(effect: Effect, places: tuple[str, ...] = (), excluded: tuple[str, ...] = ()) -> Effect:
    """Copy of an effect with other ``places`` and ``excluded`` ones, without calling its constructor."""
    other = copy.copy(effect)
    object.__setattr__(other, "places", places)
    object.__setattr__(other, "excluded", excluded)
    return other


def declared(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return the parameters of an effect, checked for their type but not their responses, which may be of any rows."""
    with np.errstate(all="ignore"):
        answer = _asked(effect, "parameters", observations)
    if not isinstance(answer, (tuple, list)) or not all(isinstance(parameter, Parameter) for parameter in answer):
        raise _broken(effect, f" answers {type(answer).__name__}, expected a tuple of Parameter")
    return _kept(effect, tuple(answer), observations.robot)


def independent(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return the validated parameters for reporting (:meth:`Effect.independent`)."""
    return _seen(effect, _asked(effect, "independent", observations), observations)


def driver(effect: Effect, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
    """Return a validated driver (:meth:`Effect.driver`): name, unit, (N,) finite values; ``None`` without one."""
    answer = _asked(effect, "driver", observations, parameters, error)
    if answer is None:
        return None
    if isinstance(answer, tuple) and len(answer) == 3:
        name, unit, values = answer
        fits = isinstance(values, np.ndarray) and values.shape == error.shape and values.dtype.kind == "f"
        if isinstance(name, str) and isinstance(unit, str) and fits and np.isfinite(values).all():
            return name, unit, values
    raise _broken(effect, f": driver answers {answer!r}, expected name, unit and {len(error)} finite values")


def missing(effect: Effect, observations: Observations) -> tuple[str, ...]:
    """Return the validated columns that the campaign lacks for an effect (:meth:`Effect.missing`)."""
    if isinstance(effect, Effect):
        _texts(effect, "needs is", effect.needs)
    return _texts(effect, "missing answers", _asked(effect, "missing", observations))


def reads(effect: Effect, observations: Observations) -> tuple[str, ...]:
    """Return the validated covariates that an effect reads (:meth:`Effect.reads`)."""
    answer = _texts(effect, "reads answers", _asked(effect, "reads", observations))
    if any(column not in observations.covariates for column in answer):
        raise _broken(effect, f": reads answers {answer!r}, expected columns of the campaign")
    return answer


def delivered(effect: Effect, observations: Observations) -> Effect:
    """Return the validated effect for prediction at other rows (:meth:`Effect.delivered`)."""
    return _settings(effect, "delivered", (_asked(effect, "delivered", observations),))[0]


def elsewhere(effect: Effect, observations: Observations) -> Effect:
    """Return the validated effect in another campaign (:meth:`Effect.elsewhere`)."""
    return _settings(effect, "elsewhere", (_asked(effect, "elsewhere", observations),))[0]


def unfaded(effect: Effect) -> Effect:
    """Copy of an effect that does not fade beyond the range where it was found."""
    ends = getattr(effect, "fades", False) and getattr(effect, "found", ())
    return replace(effect, fades=False) if ends else effect  # type: ignore[call-arg]


def variants(effect: Effect, observations: Observations) -> tuple[Effect, ...]:
    """Return the validated settings of an effect (:meth:`Effect.variants`), at least one."""
    return _settings(effect, "variants", _asked(effect, "variants", observations))


def nearby(effect: Effect, factor: float) -> tuple[Effect, ...]:
    """Return the validated settings near an effect's own (:meth:`Effect.nearby`), itself among them."""
    answer = _settings(effect, "nearby", _asked(effect, "nearby", factor))
    if effect not in answer:
        raise _broken(effect, f": nearby answers {answer!r}, expected it to hold itself, {effect!r}")
    return answer


def at(effect: Effect, place: str, observations: Observations) -> Effect | None:
    """Copy of an effect in one joint or link; ``None`` if it has no parameters there, or has a prior ``share``."""
    has = effect.share is None and place in places_of(checked(effect, observations))
    return placed(effect, (place,), effect.excluded) if has else None


def alone(effect: Effect, observations: Observations) -> tuple[Effect, ...]:
    """Return the copies of an effect in each single joint or link; empty below two, or if it has a ``share``."""
    places = places_of(checked(effect, observations))
    single = places if len(places) > 1 and effect.share is None else ()
    return tuple(placed(effect, (place,), effect.excluded) for place in single)


def places_of(parameters: Sequence[Parameter]) -> tuple[str, ...]:
    """Joints and links of some parameters, in their order, without duplicates."""
    return tuple(dict.fromkeys(p.place for p in parameters if p.kind in _LOCAL and p.place))


def arguments(effect: Effect) -> dict[str, Any]:
    """Return the validated constructor arguments for saving (:meth:`Effect.arguments`), JSON values by name."""
    answer = _asked(effect, "arguments")
    try:
        json.dumps(answer)
        if isinstance(answer, dict) and all(isinstance(name, str) for name in answer):
            return answer
    except (TypeError, ValueError):
        pass
    raise _broken(effect, f": arguments answers {answer!r}, expected numbers, texts and tuples of them by name")


def _asked(effect: Effect, question: str, *about: Any) -> Any:
    """Call a method of an effect; errors name the effect and the method."""
    if not isinstance(effect, Effect):
        raise EffectError(f"{effect!r} is not an effect; expected an instance of a subclass of Effect")
    try:
        return getattr(effect, question)(*about)
    except Exception as error:  # somebody else's code may raise anything
        raise _broken(effect, f": {question}() raised {error!r}") from error


def _broken(effect: Effect, what: str) -> EffectError:
    """Make the error of a breach of contract: :class:`OwnEffectError` for the program's own effects."""
    own = type(effect).__module__.split(".")[0] == __package__.split(".")[0]
    return (OwnEffectError if own else EffectError)(f"effect {effect.name!r}{what}")


def _texts(effect: Effect, what: str, answer: Any) -> tuple[str, ...]:
    if isinstance(answer, (tuple, list)) and all(isinstance(text, str) and text for text in answer):
        return tuple(answer)
    raise _broken(effect, f": {what} {answer!r}, expected a tuple of texts")


def _settings(effect: Effect, question: str, answer: Any) -> tuple[Effect, ...]:
    if isinstance(answer, (tuple, list)) and answer:
        if all(isinstance(other, Effect) and other.name == effect.name for other in answer):
            return tuple(answer)
    expected = f"effects named {effect.name!r}, at least one"
    raise _broken(effect, f": {question} answers {answer!r}, expected a tuple of {expected}")


def _kept(effect: Effect, parameters: tuple[Parameter, ...], robot: Robot) -> tuple[Parameter, ...]:
    """Filter parameters: those in the effect's ``places`` (all if it names none) that are not ``excluded``.

    Raises :class:`EffectError` for a place that the robot does not have.
    """
    known = (*robot.joint_names, *places_of(parameters))
    # what an effect does not do in a place of the robot may be excluded from there
    for field, among in (("places", known), ("excluded", (*known, *robot.urdf_joints, *robot.urdf_links))):
        for place in _texts(effect, f"{field} is", getattr(effect, field)):
            if place not in among:
                expected = ", ".join(dict.fromkeys(among))
                raise EffectError(f"effect {effect.name!r}: {field} holds {place!r}, expected any of {expected}")
    left = (p for p in parameters if p.kind not in _LOCAL or p.place not in effect.excluded)
    return tuple(p for p in left if not effect.places or (p.kind in _LOCAL and p.place in effect.places))


def _parameters(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    answer = _asked(effect, "parameters", observations)
    spread: Any = effect.size_spread
    if not isinstance(spread, (int, float)) or not 0.0 < spread < np.inf:
        raise _broken(effect, f": size_spread is {spread!r}, expected a number above 0")
    return _seen(effect, answer, observations)


def _seen(effect: Effect, answer: Any, observations: Observations) -> tuple[Parameter, ...]:
    if not isinstance(answer, (tuple, list)):
        raise _broken(effect, f" answers {type(answer).__name__}, expected a tuple of Parameter")
    names: set[str] = set()
    for k, parameter in enumerate(answer):
        if not isinstance(parameter, Parameter):
            raise _broken(effect, f", parameter {k + 1}: found {type(parameter).__name__}, expected a Parameter")
        problem = _wrong(parameter, observations)
        if problem or parameter.name in names:
            raise _broken(effect, f", parameter {parameter.name!r}: {problem or 'the name is used twice'}")
        names.add(parameter.name)
    return tuple(answer)


def _wrong(parameter: Any, observations: Observations) -> str:
    """Describe the first breach of contract in a parameter; empty where there is none."""
    for field, fits, expected in _FIELDS:
        if not fits(found := getattr(parameter, field)):
            return f"{field} is {found!r}, expected {expected}"
    if not isinstance(parameter.responses, (tuple, list)):
        return f"responses are {type(parameter.responses).__name__}, expected a tuple of Response"
    for response in parameter.responses:
        if wrong := _wrong_response(response, observations):
            return wrong
    kind, place, robot = parameter.kind, parameter.place, observations.robot
    if not place or place in (robot.urdf_joints if kind == "joint" else robot.urdf_links):
        return ""
    if kind in _LOCAL:
        return f"place is {place!r}, expected a {kind} of the robot"
    return "" if place == kind else f"place is {place!r}, expected {kind!r} or a link of the robot"


def _wrong_response(response: Any, observations: Observations) -> str:
    if not isinstance(response, Response):
        return f"a response is {type(response).__name__}, expected a Response"
    channel, index, values = (getattr(response, field) for field in ("channel", "index", "values"))
    if channel not in get_args(Channel):
        return f"channel is {channel!r}, expected one of {', '.join(get_args(Channel))}"
    robot, rows = observations.robot, observations.campaign.samples
    places = {"joint": robot.n, "segment": len(robot.segments)}.get(channel, 1)
    if not isinstance(index, Integral) or not 0 <= int(index) < places:
        return f"{channel} index is {index!r}, expected 0 to {places - 1}"
    own: dict[str, tuple[tuple[int, ...], ...]] = {"joint": ((), (rows,)), "instrument": ((rows, 3),)}
    shapes = own.get(channel, ((6,), (rows, 6)))
    if not isinstance(values, np.ndarray) or values.dtype.kind != "f" or values.shape not in shapes:
        found = f"{values.dtype} {values.shape}" if isinstance(values, np.ndarray) else repr(values)
        return f"values of channel {channel} are {found}, expected float {' or '.join(map(str, shapes))}"
    if not np.isfinite(values).all():
        return f"values of channel {channel} are not finite in {int((~np.isfinite(values)).sum())} entries"
    return ""
