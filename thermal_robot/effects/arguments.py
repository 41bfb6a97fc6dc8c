"""The arguments of an effect as a file holds them: checked against what its class says of each, then the effect itself.

A class says it by annotations: a type, or a type with a kind of :mod:`thermal_robot.schema` for its range, as in
``lag: NotNegative = 0.0`` with one of the names below. Lists in a file are tuples in an effect.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import fields
from types import NoneType, UnionType
from typing import Annotated, Any, TypeAlias, Union, get_args, get_origin, get_type_hints

from thermal_robot.campaign.settings import TEMPERATURE
from thermal_robot.effects.effect import Effect
from thermal_robot.schema import (
    NOT_NEGATIVE,
    POSITIVE,
    Kind,
    MisfitError,
    boolean,
    either,
    increasing,
    listed,
    mapping,
    number,
    optional,
    plain,
    record,
    text,
    whole,
)

Positive: TypeAlias = Annotated[float, POSITIVE]
NotNegative: TypeAlias = Annotated[float, NOT_NEGATIVE]
Share: TypeAlias = Annotated[float, number(least=0.0, most=1.0, expected="a number from 0 to 1")]
Count: TypeAlias = Annotated[float, number(least=1.0, most=sys.float_info.max, expected="a number from 1 on")]
Index: TypeAlias = Annotated[int, whole(0)]
Order: TypeAlias = Annotated[int, whole(1)]
Celsius: TypeAlias = Annotated[float, TEMPERATURE]
Instants: TypeAlias = Annotated[tuple[float, ...], increasing(number())]
"""What an argument may be, for annotations: a number above 0, one that is not below 0, and so on.

A count is a product of choices: some twenty waves were picked among 1e45.
"""

_PLAIN: dict[Any, Kind] = {
    float: number(),
    int: whole(-(10**15)),
    str: text(empty=True),
    bool: boolean,
}


def with_arguments(effect: type[Effect], arguments: Any, path: str) -> Effect:
    """Return an effect with arguments from a file; :class:`MisfitError` for one that its class does not take."""
    kinds = _kinds(effect)
    found = mapping(plain)(arguments, path) if kinds is None else record(kinds, may_lack=kinds)(arguments, path)
    made: Callable[..., Effect] = effect
    try:
        return made(**found)
    except Exception as error:  # somebody else's constructor may raise anything
        raise MisfitError(path, arguments, f"the arguments of {effect.__name__}", f"does not fit ({error})") from None


def _kinds(effect: type[Effect]) -> dict[str, Kind] | None:
    """Return a kind for each argument of a dataclass; ``None`` where the class has a constructor of its own."""
    if "__dataclass_params__" not in vars(effect):
        return None
    try:
        hints = get_type_hints(effect, include_extras=True)
    except Exception:  # names that only a type checker knows
        hints = {}
    return {own.name: _kind(hints.get(own.name, Any)) for own in fields(effect) if own.init}


def _kind(annotation: Any) -> Kind:
    """Return the kind that an annotation says; anything that JSON holds where it says nothing of it."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return next((part for part in parts[1:] if callable(part)), _kind(parts[0]))
    if origin is tuple and len(parts) == 2 and parts[1] is Ellipsis:
        return listed(_kind(parts[0]))
    if origin in (Union, UnionType):
        kinds = [part for part in parts if part is not NoneType]
        lists = [part for part in kinds if get_origin(part) is tuple]
        single = [part for part in kinds if get_origin(part) is not tuple]
        if len(lists) > 1 or len(single) > 1:
            return plain
        both = [_kind(part) for part in (*single, *lists)]
        kind = either(*both) if len(both) == 2 else both[0]
        return optional(kind) if NoneType in parts else kind
    return _PLAIN.get(annotation, plain)
