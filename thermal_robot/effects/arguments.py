"""Validation of the constructor arguments of an effect in a file, from its annotations.

An annotation is a type, or a type with a kind of :mod:`thermal_robot.schema` for its range, as in ``lag: NotNegative =
0.0`` with one of the names below. Lists in a file are tuples in an effect.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import fields
from types import NoneType, UnionType
from typing import Annotated, Any, TypeAlias, Union, get_args, get_origin, get_type_hints

import thermal_robot.schema as schema
from thermal_robot.campaign.settings import TEMPERATURE
from thermal_robot.effects.effect import Effect
from thermal_robot.schema import Kind, MisfitError, number

Positive: TypeAlias = Annotated[float, schema.POSITIVE]
NotNegative: TypeAlias = Annotated[float, schema.NOT_NEGATIVE]
Share: TypeAlias = Annotated[float, number(least=0.0, most=1.0, expected="a number from 0 to 1")]
Count: TypeAlias = Annotated[float, number(least=1.0, most=sys.float_info.max, expected="a number from 1 on")]
Index: TypeAlias = Annotated[int, schema.whole(0)]
Order: TypeAlias = Annotated[int, schema.whole(1)]
Celsius: TypeAlias = Annotated[float, TEMPERATURE]
Instants: TypeAlias = Annotated[tuple[float, ...], schema.increasing(number())]
"""Ranges of arguments, for annotations: a number above 0, one that is not below 0, and so on.

A count is a product of choices: some twenty waves were picked among 1e45.
"""

_PLAIN: dict[Any, Kind] = {
    float: number(),
    int: schema.whole(-(10**15)),
    str: schema.text(empty=True),
    bool: schema.boolean,
}


def with_arguments(effect: type[Effect], arguments: Any, path: str) -> Effect:
    """Make an effect from the arguments in a file; :class:`MisfitError` for one that its class does not take."""
    if "__dataclass_params__" in vars(effect):
        try:
            hints = get_type_hints(effect, include_extras=True)
        except Exception:  # names that only a type checker knows
            hints = {}
        kinds = {own.name: _kind(hints.get(own.name, Any)) for own in fields(effect) if own.init}
        found = schema.record(kinds, may_lack=kinds)(arguments, path)
    else:  # a constructor of its own
        found = schema.mapping(schema.plain)(arguments, path)
    made: Callable[..., Effect] = effect
    try:
        return made(**found)
    except Exception as error:  # somebody else's constructor may raise anything
        raise MisfitError(path, arguments, f"the arguments of {effect.__name__}", f"does not fit ({error})") from None


def _kind(annotation: Any) -> Kind:
    """Return the validator that an annotation stands for; one of any JSON value where it says nothing."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return next((part for part in parts[1:] if callable(part)), _kind(parts[0]))
    if origin is tuple and len(parts) == 2 and parts[1] is Ellipsis:
        return schema.listed(_kind(parts[0]))
    if origin not in (Union, UnionType):
        return _PLAIN.get(annotation, schema.plain)
    single = [_kind(part) for part in parts if part is not NoneType and get_origin(part) is not tuple]
    lists = [_kind(part) for part in parts if get_origin(part) is tuple]
    if len(lists) > 1 or len(single) > 1:
        return schema.plain
    kind = schema.either(single[0], lists[0]) if single and lists else (*single, *lists)[0]
    return schema.optional(kind) if NoneType in parts else kind
