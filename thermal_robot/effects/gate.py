"""The one gate through which everybody gets an effect's answers: one that breaks the contract is refused."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from thermal_robot.effects.effect import Array, Channel, Driver, Effect, Parameter, Response
from thermal_robot.errors import EffectError

if TYPE_CHECKING:
    from thermal_robot.observations import Observations

KINDS = ("joint", "link", "base", "tool", "instrument")
"""Kinds of place that a parameter may sit in."""


def checked(effect: Effect, observations: Observations) -> tuple[Parameter, ...]:
    """Return the parameters of an effect, once they are seen to keep the contract.

    Parameters
    ----------
    effect
        The effect, its arguments set.
    observations
        N rows that its responses are read from.

    Returns
    -------
    tuple of Parameter
        Each with a name of its own, a known kind of place, a positive size, and responses of finite values in a
        channel and at an index that the robot has, of that channel's shape (see :class:`Response`).

    Raises
    ------
    EffectError
        Otherwise; names the effect, the parameter, what was found and what was expected.
    """
    if not isinstance(effect, Effect):
        raise EffectError(f"{effect!r} is not an effect; expected an instance of a subclass of Effect")
    answer: Any = effect.parameters(observations)
    if not isinstance(answer, (tuple, list)):
        raise EffectError(f"effect {effect.name!r} answers {type(answer).__name__}, expected a tuple of Parameter")
    names = set()
    for k, parameter in enumerate(answer):
        if not isinstance(parameter, Parameter):
            raise EffectError(
                f"effect {effect.name!r}, parameter {k + 1}: found {type(parameter).__name__}, expected a Parameter"
            )
        problem = _wrong(parameter, observations)
        if not problem and parameter.name in names:
            problem = "the name is used twice"
        if problem:
            raise EffectError(f"effect {effect.name!r}, parameter {parameter.name!r}: {problem}")
        names.add(parameter.name)
    return tuple(answer)


def driver(effect: Effect, observations: Observations, parameters: Sequence[Parameter], error: Array) -> Driver | None:
    """Return what drives an effect at a place (:meth:`Effect.driver`), once it is seen to keep the contract.

    Raises
    ------
    EffectError
        If it is not a name, a unit and (N,) finite values.
    """
    answer: Any = effect.driver(observations, parameters, error)
    if answer is None:
        return None
    if isinstance(answer, tuple) and len(answer) == 3:
        name, unit, values = answer
        fits = isinstance(values, np.ndarray) and values.shape == error.shape and values.dtype.kind == "f"
        if isinstance(name, str) and isinstance(unit, str) and fits and np.isfinite(values).all():
            return name, unit, values
    raise EffectError(
        f"effect {effect.name!r}: driver answers {answer!r}, expected name, unit and {len(error)} finite values"
    )


def _wrong(parameter: Any, observations: Observations) -> str:
    """Say what is wrong with a parameter; empty where nothing is."""
    for field in ("label", "unit", "kind", "place"):
        if not isinstance(found := getattr(parameter, field), str):
            return f"{field} is {found!r}, expected text"
    if parameter.kind not in KINDS:
        return f"kind is {parameter.kind!r}, expected one of {', '.join(KINDS)}"
    if not isinstance(parameter.size, Real) or not 0.0 < float(parameter.size) < np.inf:
        return f"size is {parameter.size!r}, expected a finite number above 0"
    if not isinstance(parameter.responses, (tuple, list)):
        return f"responses are {type(parameter.responses).__name__}, expected a tuple of Response"
    return next((wrong for r in parameter.responses if (wrong := _wrong_response(r, observations))), "")


def _wrong_response(response: Any, observations: Observations) -> str:
    if not isinstance(response, Response):
        return f"a response is {type(response).__name__}, expected a Response"
    channel: Any = response.channel
    index: Any = response.index
    values: Any = response.values
    if channel not in get_args(Channel):
        return f"channel is {channel!r}, expected one of {', '.join(get_args(Channel))}"
    places = {"joint": observations.robot.n, "segment": len(observations.robot.segments)}.get(channel, 1)
    if not isinstance(index, Integral) or not 0 <= int(index) < places:
        return f"{channel} index is {index!r}, expected 0 to {places - 1}"
    rows = observations.campaign.samples
    shapes = {"joint": ((), (rows,)), "instrument": ((rows, 3),)}.get(channel, ((6,), (rows, 6)))
    if not isinstance(values, np.ndarray) or values.dtype.kind != "f" or values.shape not in shapes:
        found = f"{values.dtype} {values.shape}" if isinstance(values, np.ndarray) else repr(values)
        return f"values of channel {channel} are {found}, expected float {' or '.join(map(str, shapes))}"
    if not np.isfinite(values).all():
        return f"values of channel {channel} are not finite in {int((~np.isfinite(values)).sum())} entries"
    return ""
