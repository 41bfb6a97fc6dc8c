"""Damage to a saved model: every value of it replaced, taken away, or of another shape; its bytes cut and flipped."""

import copy
import math
import random

from thermal_robot.model_file import checksum

_FOR_ANY = {
    "null": None,
    "text": "wrong",
    "empty": "",
    "NaN": math.nan,
    "infinite": math.inf,
    "enormous": 1e300,
    "four hundred digits": 10**400,
    "negative": -1,
    "zero": 0,
    "true": True,
    "list": [],
    "nested": [[1.0]],
    "object": {},
    "half a letter": "\ud800",
    "NUL": "a\0b",
}
_FEW = 8  # of a long list the ends and the middle are spoilt


def spoilt(document):
    """Yield a name and the document, for each value and each damage to it."""
    for path, value in _values(document):
        if path:
            yield f"{path}: deleted", _with(document, path, None, delete=True)
        for name, other in (*_FOR_ANY.items(), *_of_its_kind(value)):
            yield f"{path}: {name}", _with(document, path, other)


def broken(content, flips=50, cuts=50, seed=0):
    """Yield bytes cut at so many places, and with so many bits flipped, one at a time."""
    for k in range(cuts):
        yield f"cut at {k}/{cuts}", content[: len(content) * k // cuts]
    drawn = random.Random(seed)
    for _ in range(flips):
        at, bit = drawn.randrange(len(content)), drawn.randrange(8)
        yield f"bit {bit} of byte {at}", content[:at] + bytes([content[at] ^ 1 << bit]) + content[at + 1 :]


def summed(document):
    """Return the document with the checksum that it should have, where it has a place for one."""
    if not isinstance(document, dict) or not isinstance(document.get("checksum"), str):
        return document
    try:
        return {**document, "checksum": checksum(document)}
    except (OverflowError, ValueError):  # what has no checksum
        return document


def _values(node, path=()):
    yield path, node
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _values(value, (*path, key))
    elif isinstance(node, list):
        many = range(len(node)) if len(node) <= _FEW else sorted({0, 1, len(node) // 2, len(node) - 1})
        for k in many:
            yield from _values(node[k], (*path, k))


def _of_its_kind(value):
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        yield from {"in quotes": str(value), "times a thousand": 1e3 * value + 1.0}.items()
    elif isinstance(value, list):
        yield from {"longer": [*value, 0.0], "shorter": value[:-1]}.items()
    elif isinstance(value, dict):
        yield "richer", {**value, "surplus": 1}
    elif isinstance(value, str):
        yield from {"half": value[: len(value) // 2], "capitals": value.upper() + "X"}.items()


def _with(document, path, value, delete=False):
    if not path:
        return value
    again = copy.deepcopy(document)
    at = again
    for step in path[:-1]:
        at = at[step]
    if delete:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return again
