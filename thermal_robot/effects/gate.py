"""The one gate through which everybody gets an effect's answers: one that breaks the contract is refused.

An effect may be anybody's code. What it raises ends in an ``EffectError`` that names the effect and what was asked, and
so does an answer of the wrong type or content.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Sequence
from dataclasses import fields
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, get_args
from weakref import WeakKeyDictionary

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
_CHANNELS = get_args(Channel)
_CONSTANT: WeakKeyDictionary[Robot, dict[Effect, tuple[Parameter, ...]]] = WeakKeyDictionary()


def checked(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return the parameters of an effect, once they are seen to keep the contract.

    Each has a name of its own, a known kind of place, a place of that kind that the robot has (or none), a positive
    size, and responses of finite values in a channel and at an index that the robot has, of that channel's shape (see
    :class:`Response`); only those in ``places``, none in ``excluded`` ones. Raises :class:`EffectError` otherwise, or
    if the effect raises anything: the effect, the parameter, what was found and what was expected.
    """
    if not _is_what_it_holds(effect):
        return _kept(effect, _parameters(effect, observations), observations.robot)
    whole = copy.copy(effect)
    object.__setattr__(whole, "places", ())
    object.__setattr__(whole, "excluded", ())
    known = observations.parameters.pop(whole, None)
    known = observations.parameters[whole] = _first_asked(whole, observations) if known is None else known
    while len(observations.parameters) > KEPT:
        del observations.parameters[next(iter(observations.parameters))]
    return _kept(effect, known, observations.robot)


def declared(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return the parameters of an effect without a look at their responses, which may then be of any rows."""
    with np.errstate(all="ignore"):
        answer = _asked(effect, "parameters", observations)
    if not isinstance(answer, (tuple, list)) or not all(isinstance(parameter, Parameter) for parameter in answer):
        raise _broken(effect, f" answers {type(answer).__name__}, expected a tuple of Parameter")
    return _kept(effect, tuple(answer), observations.robot)


def _is_what_it_holds(effect: Any) -> bool:
    """Tell whether effects that compare as equal are equal: whether all that this one holds is compared, and hashed."""
    try:
        hash(effect)
    except TypeError:
        return False
    return isinstance(effect, Effect) and vars(effect).keys() == {own.name for own in fields(effect) if own.compare}


def _first_asked(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return all parameters of an effect, of one that is constant as they are known of the robot."""
    if vars(type(effect)).get("constant") is not True:
        return _parameters(effect, observations)
    of_robot = _CONSTANT.setdefault(observations.robot, {})
    if effect not in of_robot:
        found = _parameters(effect, observations)
        if any(r.values.shape not in ((), (6,)) for p in found for r in p.responses):
            raise _broken(effect, ": constant is True, and a response has a value for each row")
        of_robot[effect] = found
    return of_robot[effect]


def _parameters(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return all parameters of an effect, seen to keep the contract."""
    answer = _asked(effect, "parameters", observations)
    spread: Any = effect.size_spread
    if not isinstance(spread, (int, float)) or not 0.0 < spread < np.inf:
        raise _broken(effect, f": size_spread is {spread!r}, expected a number above 0")
    return _seen(effect, answer, observations)


def independent(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return the parameters in which an effect is told (:meth:`Effect.independent`), once they keep the contract."""
    return _seen(effect, _asked(effect, "independent", observations), observations)


def _seen(effect: Effect, answer: Any, observations: Observations) -> tuple[Parameter, ...]:
    if not isinstance(answer, (tuple, list)):
        raise _broken(effect, f" answers {type(answer).__name__}, expected a tuple of Parameter")
    names = set()
    for k, parameter in enumerate(answer):
        if not isinstance(parameter, Parameter):
            found = type(parameter).__name__
            raise _broken(effect, f", parameter {k + 1}: found {found}, expected a Parameter")
        problem = _wrong(parameter, observations)
        if not problem and parameter.name in names:
            problem = "the name is used twice"
        if problem:
            raise _broken(effect, f", parameter {parameter.name!r}: {problem}")
        names.add(parameter.name)
    return tuple(answer)


def driver(effect: Effect, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
    """Return what drives an effect at a place (:meth:`Effect.driver`): a name, a unit and (N,) finite values."""
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
    """Return what the campaign lacks for an effect (:meth:`Effect.missing`); it and ``needs`` are tuples of texts."""
    if isinstance(effect, Effect):
        _texts(effect, "needs is", effect.needs)
    return _texts(effect, "missing answers", _asked(effect, "missing", observations))


def reads(effect: Effect, observations: Observations) -> tuple[str, ...]:
    """Return the covariates that an effect reads (:meth:`Effect.reads`), names of columns that the campaign has."""
    answer = _texts(effect, "reads answers", _asked(effect, "reads", observations))
    if any(column not in observations.covariates for column in answer):
        raise _broken(effect, f": reads answers {answer!r}, expected columns of the campaign")
    return answer


def delivered(effect: Effect, observations: Observations) -> Effect:
    """Return an effect as a model holds it (:meth:`Effect.delivered`), one of the same name."""
    return _settings(effect, "delivered", (_asked(effect, "delivered", observations),))[0]


def elsewhere(effect: Effect, observations: Observations) -> Effect:
    """Return an effect as it is in another campaign (:meth:`Effect.elsewhere`); raises as :func:`delivered`."""
    return _settings(effect, "elsewhere", (_asked(effect, "elsewhere", observations),))[0]


def unfaded(effect: Effect) -> Effect:
    """Return an effect as it is where it does not fade (:meth:`Effect.unfaded`); raises as :func:`delivered`."""
    return _settings(effect, "unfaded", (_asked(effect, "unfaded"),))[0]


def variants(effect: Effect, observations: Observations) -> tuple[Effect, ...]:
    """Return the settings of an effect that are compared (:meth:`Effect.variants`), at least one, each of its name."""
    return _settings(effect, "variants", _asked(effect, "variants", observations))


def nearby(effect: Effect, factor: float) -> tuple[Effect, ...]:
    """Return settings near an effect's own (:meth:`Effect.nearby`), each of its name, itself among them."""
    answer = _settings(effect, "nearby", _asked(effect, "nearby", factor))
    if effect not in answer:
        raise _broken(effect, f": nearby answers {answer!r}, expected it to hold itself, {effect!r}")
    return answer


def at(effect: Effect, place: str, observations: Observations) -> Effect | None:
    """Return an effect in one joint or link alone (:meth:`Effect.at`); ``None`` where it has no parameters there."""
    return _one_setting(effect, "at", place) if place in places_of(checked(effect, observations)) else None


def alone(effect: Effect, observations: Observations) -> tuple[Effect, ...]:
    """Return the settings of an effect in each single joint or link; empty where it has parameters in one or none."""
    places = places_of(checked(effect, observations))
    single = (_one_setting(effect, "at", place) for place in places)
    return tuple(setting for setting in single if setting is not None) if len(places) > 1 else ()


def places_of(parameters: Sequence[Parameter]) -> tuple[str, ...]:
    """Return the joints and links that parameters sit in, in their order, each once."""
    return tuple(dict.fromkeys(p.place for p in parameters if p.kind in ("joint", "link") and p.place))


def _one_setting(effect: Effect, question: str, *about: Any) -> Effect | None:
    answer = _asked(effect, question, *about)
    if answer is None or _is_setting(effect, answer):
        return answer  # type: ignore[no-any-return]
    raise _broken(effect, f": {question} answers {answer!r}, expected None or an effect named {effect.name!r}")


def arguments(effect: Effect) -> dict[str, Any]:
    """Return the arguments of an effect, for saving (:meth:`Effect.arguments`): values by name that JSON can hold."""
    answer = _asked(effect, "arguments")
    try:
        json.dumps(answer)
        if isinstance(answer, dict) and all(isinstance(name, str) for name in answer):
            return answer
    except (TypeError, ValueError):
        pass
    expected = "numbers, texts and tuples of them by name"
    raise _broken(effect, f": arguments answers {answer!r}, expected {expected}")


def _asked(effect: Effect, question: str, *about: Any) -> Any:
    """Return what a method of an effect answers; whatever it raises names the effect and the method."""
    if not isinstance(effect, Effect):
        raise EffectError(f"{effect!r} is not an effect; expected an instance of a subclass of Effect")
    try:
        return getattr(effect, question)(*about)
    except Exception as error:  # somebody else's code may raise anything
        raise _broken(effect, f": {question}() raised {error!r}") from error


def _broken(effect: Effect, what: str) -> EffectError:
    """Return the error of an effect that breaks the contract: the program's own is no fault of who uses it."""
    own = type(effect).__module__.split(".")[0] == __package__.split(".")[0]
    return OwnEffectError(f"effect {effect.name!r}{what}") if own else EffectError(f"effect {effect.name!r}{what}")


def _kept(effect: Effect, parameters: tuple[Parameter, ...], robot: Robot) -> tuple[Parameter, ...]:
    """Return the parameters in the joints and links that the effect names, all where it names none; none excluded."""
    known = (*robot.joint_names, *places_of(parameters))
    # what an effect does not do in a place of the robot may be excluded from there
    for field, named, among in (
        ("places", effect.places, known),
        ("excluded", effect.excluded, (*known, *robot.urdf_joints, *robot.urdf_links)),
    ):
        for place in _texts(effect, f"{field} is", named):
            if place not in among:
                expected = ", ".join(dict.fromkeys(among))
                raise EffectError(f"effect {effect.name!r}: {field} holds {place!r}, expected any of {expected}")
    local = {p: p.kind in ("joint", "link") for p in parameters}
    left = (p for p in parameters if not (local[p] and p.place in effect.excluded))
    return tuple(p for p in left if not effect.places or (local[p] and p.place in effect.places))


def _texts(effect: Effect, what: str, answer: Any) -> tuple[str, ...]:
    if isinstance(answer, (tuple, list)) and all(isinstance(text, str) and text for text in answer):
        return tuple(answer)
    raise _broken(effect, f": {what} {answer!r}, expected a tuple of texts")


def _settings(effect: Effect, question: str, answer: Any) -> tuple[Effect, ...]:
    if isinstance(answer, (tuple, list)) and answer and all(_is_setting(effect, other) for other in answer):
        return tuple(answer)
    expected = f"effects named {effect.name!r}, at least one"
    raise _broken(effect, f": {question} answers {answer!r}, expected a tuple of {expected}")


def _is_setting(effect: Effect, answer: Any) -> bool:
    return isinstance(answer, Effect) and answer.name == effect.name


def _wrong(parameter: Any, observations: Observations) -> str:
    """Say what is wrong with a parameter; empty where nothing is."""
    for field in ("label", "unit", "kind", "place"):
        if not isinstance(found := getattr(parameter, field), str):
            return f"{field} is {found!r}, expected text"
    if parameter.kind not in KINDS:
        return f"kind is {parameter.kind!r}, expected one of {', '.join(KINDS)}"
    if not isinstance(parameter.size, Real) or not 0.0 < float(parameter.size) < np.inf:
        return f"size is {parameter.size!r}, expected a finite number above 0"
    if not isinstance(parameter.positive, bool):
        return f"positive is {parameter.positive!r}, expected True or False"
    if not isinstance(parameter.responses, (tuple, list)):
        return f"responses are {type(parameter.responses).__name__}, expected a tuple of Response"
    wrong = next((wrong for r in parameter.responses if (wrong := _wrong_response(r, observations))), "")
    return wrong or _wrong_place(parameter, observations.robot)


def _wrong_place(parameter: Parameter, robot: Robot) -> str:
    kind, place = parameter.kind, parameter.place
    known = robot.urdf_joints if kind == "joint" else robot.urdf_links
    own = kind in ("joint", "link")
    if not place or place in known or (place == kind and not own):
        return ""
    return f"place is {place!r}, expected {f'a {kind}' if own else f'{kind!r} or a link'} of the robot"


def _wrong_response(response: Any, observations: Observations) -> str:
    if not isinstance(response, Response):
        return f"a response is {type(response).__name__}, expected a Response"
    channel: Any = response.channel
    index: Any = response.index
    values: Any = response.values
    if channel not in _CHANNELS:
        return f"channel is {channel!r}, expected one of {', '.join(_CHANNELS)}"
    robot = observations.robot
    places = robot.n if channel == "joint" else len(robot.segments) if channel == "segment" else 1
    if not isinstance(index, Integral) or not 0 <= int(index) < places:
        return f"{channel} index is {index!r}, expected 0 to {places - 1}"
    rows = observations.campaign.samples
    shapes = ((), (rows,)) if channel == "joint" else ((rows, 3),) if channel == "instrument" else ((6,), (rows, 6))
    if not isinstance(values, np.ndarray) or values.dtype.kind != "f" or values.shape not in shapes:
        found = f"{values.dtype} {values.shape}" if isinstance(values, np.ndarray) else repr(values)
        return f"values of channel {channel} are {found}, expected float {' or '.join(map(str, shapes))}"
    if not np.isfinite(values).all():
        return f"values of channel {channel} are not finite in {int((~np.isfinite(values)).sum())} entries"
    return ""
