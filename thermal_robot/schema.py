"""Validation of plain values from JSON, TOML or a caller: type, shape, range.

A kind is a function of a value and its path that returns the value as the program wants it, or raises
:class:`MisfitError` with the path. Kinds are put together: ``record({"noise": optional(number(least=0.0))})``. Who
reads a file or takes an argument turns the misfit into a sentence with :func:`fitted`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from typing import Any, TypeAlias

import numpy as np

from thermal_robot.errors import CampaignError

Kind: TypeAlias = Callable[[Any, str], Any]

LARGEST = 1e20
"""Largest number that is accepted, in any unit: nanoseconds since 1970, the largest in a robot's log, are 2e18."""
_MOST_SHOWN = 60
"""Number of letters of an invalid value that an error message shows."""


class MisfitError(ValueError):
    """Error: a value does not match its schema; holds its path, the value, what is expected, and the reason."""

    def __init__(self, path: str, value: Any, expected: str, problem: str = "") -> None:
        super().__init__(f"{path}: {problem or shown(value)}, expected {expected}")
        self.path, self.value, self.expected, self.problem = path, value, expected, problem


def fitted(kind: Kind, value: Any, file: str, path: str = "") -> Any:
    """Return a value of a file as validated and converted by its schema, ``kind``.

    Raises
    ------
    CampaignError
        Naming the file, the path of the value in it, what stands there and what is expected.
    """
    try:
        return kind(value, path)
    except MisfitError as error:
        problem = error.problem or f"is {shown(error.value)}"
        raise CampaignError(file, problem, key=error.path, expected=error.expected) from None


def shown(value: Any) -> str:
    """Write a value as it stands in a JSON file, cut to ``_MOST_SHOWN`` letters, for a message."""
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    try:
        text = repr(value)
    except Exception:  # a caller's object may raise anything, and Python writes no whole number of 5000 digits
        return f"a value of type {type(value).__name__}"
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}…"


def text(expected: str = "text", *, empty: bool = False) -> Kind:
    """Return a validator of UTF-8 text without NUL, not empty unless stated."""

    def kind(value: Any, path: str) -> str:
        if not isinstance(value, str) or not (empty or value.strip()) or "\0" in value:
            raise MisfitError(path, value, expected)
        try:
            value.encode()
        except UnicodeEncodeError:
            raise MisfitError(path, value, f"{expected} in Unicode") from None
        return value

    return kind


def word(allowed: Iterable[str], problem: str = "") -> Kind:
    """Return a validator of text that must be one of the ``allowed`` words."""
    words = tuple(allowed)
    expected = alternatives(words)

    def kind(value: Any, path: str) -> str:
        if not isinstance(value, str) or value not in words:
            raise MisfitError(path, value, expected, problem)
        return value

    return kind


def alternatives(words: Iterable[str]) -> str:
    """Join the allowed words for a message, as ``"a" or "b"``."""
    return " or ".join(f'"{word}"' for word in words)


def boolean(value: Any, path: str) -> bool:
    """Validate true or false."""
    if not isinstance(value, (bool, np.bool_)):
        raise MisfitError(path, value, "true or false")
    return bool(value)


def number(
    *,
    least: float = -LARGEST,
    most: float = LARGEST,
    above: float = -math.inf,
    expected: str = "a finite number",
    problem: str = "",
) -> Kind:
    """Return a validator of a finite number in a range; ``problem`` is the message for one outside it."""

    def kind(value: Any, path: str) -> float:
        try:
            found = float(value) if isinstance(value, Real) and value is not True and value is not False else math.nan
        except OverflowError:
            found = math.inf
        if not math.isfinite(found) or abs(found) > max(LARGEST, most):
            raise MisfitError(path, value, expected)
        if not (least <= found <= most and found > above):
            raise MisfitError(path, value, expected, problem)
        return found

    return kind


NOT_NEGATIVE = number(least=0.0, expected="a number that is not negative")
POSITIVE = number(above=0.0, expected="a number above 0")


def whole(least: int) -> Kind:
    """Return a validator of a whole number of at least ``least``."""

    def kind(value: Any, path: str) -> int:
        if not isinstance(value, Integral) or value is True or value is False or not least <= int(value) <= LARGEST:
            raise MisfitError(path, value, f"a whole number from {least} on")
        return int(value)

    return kind


def listed(item: Kind, count: int | None = None, expected: str = "") -> Kind:
    """Return a validator of a list, ``count`` items where given; it returns a tuple."""
    expected = expected or (f"a list of {count} values" if count is not None else "a list")

    def kind(value: Any, path: str) -> tuple[Any, ...]:
        found = value.tolist() if isinstance(value, np.ndarray) else value
        if not isinstance(found, (list, tuple)) or count not in (None, len(found)):
            raise MisfitError(path, value, expected)
        return tuple(item(each, f"{path}[{k}]") for k, each in enumerate(found))

    return kind


def matrix(shape: tuple[int | None, int | None] = (None, None)) -> Kind:
    """Return a validator of rows of finite numbers of equal length; it returns an array."""
    rows, columns = shape

    def kind(value: Any, path: str) -> Any:
        found = listed(listed(number(), columns), rows)(value, path)
        for k, row in enumerate(found):
            if len(row) != len(found[0]):
                raise MisfitError(f"{path}[{k}]", row, f"a list of {len(found[0])} values, as in the rows before")
        return np.array(found, dtype=float)

    return kind


def increasing(item: Kind) -> Kind:
    """Return a validator of a strictly increasing list of numbers."""

    def kind(value: Any, path: str) -> tuple[float, ...]:
        found: tuple[float, ...] = listed(item)(value, path)
        for k in range(1, len(found)):
            if not found[k] > found[k - 1]:
                raise MisfitError(f"{path}[{k}]", found[k], f"a number above the one before, {found[k - 1]!r}")
        return found

    return kind


def optional(item: Kind) -> Kind:
    """Return a validator of a value, or None."""

    def kind(value: Any, path: str) -> Any:
        return None if value is None else item(value, path)

    return kind


def either(one: Kind, lists: Kind) -> Kind:
    """Return a validator that uses ``lists`` for lists, ``one`` for other values."""

    def kind(value: Any, path: str) -> Any:
        return (lists if isinstance(value, (list, tuple)) else one)(value, path)

    return kind


def mapping(item: Kind) -> Kind:
    """Return a validator of an object with arbitrary keys and values of one kind."""

    def kind(value: Any, path: str) -> dict[str, Any]:
        if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
            raise MisfitError(path, value, "values by name")
        return {key: item(each, below(path, key)) for key, each in value.items()}

    return kind


def record(known: Mapping[str, Kind], may_lack: Iterable[str] = ()) -> Kind:
    """Return a validator of an object with known keys; all are required but those that ``may_lack``."""
    spare = frozenset(may_lack)

    def kind(value: Any, path: str) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise MisfitError(path, value, f"an object with the keys {', '.join(known)}")
        for key in value:
            if key not in known:
                raise MisfitError(below(path, str(key)), None, f"no other key than {', '.join(known)}", "is not known")
        for key in known:
            if key not in value and key not in spare:
                raise MisfitError(below(path, key), None, "a value", "is missing")
        return {key: item(value[key], below(path, key)) for key, item in known.items() if key in value}

    return kind


def plain(value: Any, path: str) -> Any:
    """Validate any JSON value with finite numbers; lists become tuples."""
    if isinstance(value, Mapping):
        return mapping(plain)(value, path)
    if isinstance(value, (list, tuple)):
        return listed(plain)(value, path)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, str):
        return text(empty=True)(value, path)
    number(least=-sys.float_info.max, most=sys.float_info.max)(value, path)
    return value


def below(path: str, key: str) -> str:
    """Path of a key inside an object, as ``effects[2].arguments.span``."""
    return f"{path}.{key}".lstrip(".") if key.isidentifier() else f"{path}[{key!r}]"
