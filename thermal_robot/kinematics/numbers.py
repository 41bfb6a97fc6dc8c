"""What a URDF says that its parser drops or takes as it is: unknown words, and numbers that no robot has.

urdfdom leaves out a link's inertia, without an error, where its mass is written ``3,42`` or is empty; takes a mass of
−3 kg as it is; and reads past ``<pose>`` or ``<orgin>``. Kinematics or torques are then wrong and nobody is told.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.markup import Tag, bare, encoded, tags

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_LARGEST = 1e9  # no figure of a robot is larger, in any unit
_NO_LIMIT = 1e100  # limits that are none are written as 1e16, or 1e30
MOST_JOINTS = 150
"""Joints that move, a floating one for six: Pinocchio's memory grows with their cube, 0.45 GB at 150, and ends the
process at 1000. A mobile robot with two arms and hands has 101."""
_ALIKE = 0.7
"""Likeness (0..1, by :mod:`difflib`) from which a word is taken for a typing error of one that URDF knows: ``orgin``
for ``origin`` has 0.91, ``axes`` for ``axis`` 0.75; extensions in use (``contact``, ``hardware``) stay below 0.6."""
_THREE = "three numbers"
_MOVABLE = ("revolute", "continuous", "prismatic")
_FREEDOMS = {**dict.fromkeys(_MOVABLE, 1), "planar": 3, "floating": 6}
_INERTIAS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_HARMLESS = ("calibration", "dynamics", "safety_controller", "visual", "collision")
_ELEMENTS: dict[tuple[str, ...], tuple[str, ...]] = {
    (): ("link", "joint"),
    ("joint",): ("origin", "parent", "child", "axis", "limit", "mimic"),
    ("link",): ("inertial",),
    ("link", "inertial"): ("origin", "mass", "inertia"),
}
"""Elements that say where things are and what they weigh, by what they stand in; others of any name are let pass."""
_ATTRIBUTES = {
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
    "mimic": ("joint", "multiplier", "offset"),
    "parent": ("link",),
    "child": ("link",),
    "mass": ("value",),
    "inertia": _INERTIAS,
}
_MEANT = {
    **dict.fromkeys(("pose", "transform", "frame", "position", "translation", "rotation", "xyz", "rpy"), "origin"),
    **dict.fromkeys(("min", "max", "range", "bounds"), "limit"),
    "direction": "axis",
    "inertia": "inertial",
    "mass": "inertial",
}
"""Elements of other formats, and what says the same in a URDF."""
_MEANT_OF_LIMIT = {"min": "lower", "low": "lower", "max": "upper", "high": "upper"}

Attributes = Mapping[str, str]


@lru_cache(maxsize=1)
def require_numbers(urdf: str, source: str) -> None:
    """Refuse a URDF with a word it does not know that places or moves something, a figure that is none, and too much.

    Parameters
    ----------
    urdf
        XML text.
    source
        What to call it in an error.

    Raises
    ------
    RobotError
        Naming the link or joint, what stands there, and what is meant or expected; or saying why it is no URDF.
    """
    content = bare(encoded(urdf))
    found = tags(content, source)
    inside: dict[int, list[Tag]] = {}
    owner, freedoms = 0, 0
    for number, tag in enumerate(found[1:], start=1):
        if len(tag.path) == 2:
            owner = number
        inside.setdefault(owner, []).append(tag)
    for first, *others in inside.values():
        kind, name = first.path[1], first.attributes.get("name", "")
        problem = next(_problems(content, first, others), "")
        if problem:
            known = f"{kind} {_short(name)}" if kind in _ELEMENTS[()] else "it"
            raise RobotError(f"{source}: {known}{problem}", name=name)
        freedoms += _FREEDOMS.get(first.attributes.get("type", ""), 0) if kind == "joint" else 0
    if freedoms > MOST_JOINTS:
        raise RobotError(f"{source} has {freedoms} joints that move, expected at most {MOST_JOINTS}: cut it to the arm")


def _problems(content: bytes, first: Tag, others: Sequence[Tag]) -> Iterator[str]:
    """Say what is wrong with a link or a joint, one thing after the other."""
    kind, seen = first.attributes.get("type", ""), set()
    yield from _unknown((), first)
    for tag in (first, *others):
        path = tag.path[1:]
        if path in _ONCE and path in seen:
            yield f": there are two <{path[-1]}>, expected one"
        seen.add(path)
        yield from _unknown(path[:-1], tag) if path[1:] else ()
        if path[:-1] in _ELEMENTS and path[-1] in _ATTRIBUTES:
            yield from _unread(content, tag)
        problem = _CHECKS[path](tag.attributes, kind) if path in _CHECKS else ""
        if problem:
            yield f": {problem}"
    if ("link", "inertial") in seen and ("link", "inertial", "mass") not in seen:
        yield ": its <inertial> has no <mass>, expected one"


def _unknown(place: tuple[str, ...], tag: Tag) -> Iterator[str]:
    """Say which element is meant by one that URDF does not know, where it would place or move something."""
    name = tag.path[-1]
    known = _ELEMENTS.get(place)
    if known is None or ":" in name or name in (*known, *_HARMLESS):
        return
    meant = _MEANT.get(name.lower()) if place in (("joint",), ("link",)) else None
    meant = meant if meant in known else _alike(name, known)
    if not meant and place == ("joint",) and {"xyz", "rpy"} & set(tag.attributes):
        meant = "origin"
    if meant:
        yield f" has a <{name}>, which URDF does not know: is <{meant}> meant?"


def _unread(content: bytes, tag: Tag) -> Iterator[str]:
    """Say what is written in an element that URDF does not read there."""
    name = tag.path[-1]
    known = _ATTRIBUTES[name]
    for key, value in tag.attributes.items():
        if key in known or ":" in key:
            continue
        if name == "limit":
            meant = _MEANT_OF_LIMIT.get(key.lower()) or _alike(key, known[:2])
        else:
            figures = all(_NUMBER.fullmatch(word) for word in value.split())
            meant = _alike(key, known) or (" or ".join(known) if figures else "")
        if meant:
            yield f" has {key}={_short(value)} in its <{name}>, which URDF does not know: is {meant} meant?"
    text = content[tag.stop : max(tag.close, tag.stop)].decode().strip()
    if text:
        yield f": its <{name}> holds {_short(text)}, expected attributes, as <{name} {known[0]}=…/>"


def _alike(name: str, known: Iterable[str]) -> str:
    return next(iter(difflib.get_close_matches(name.lower(), list(known), n=1, cutoff=_ALIKE)), "")


def _joint(attributes: Attributes, _: str) -> str:
    name = attributes.get("name", "")
    # a table's column has no blanks around its name
    return "" if name and name == name.strip() else "expected a name without blanks around it"


def _mass(attributes: Attributes, _: str) -> str:
    if "value" not in attributes:
        return "its <mass> has no value, expected a number of kg"
    return _wrong(attributes, "value", "mass", "a number of kg that is not negative", 1, lambda m: m[0] >= 0.0)


def _inertia(attributes: Attributes, _: str) -> str:
    # its sign plays no part in statics, and exporters write −5e-20 for nothing
    problems = (_wrong(attributes, name, f"inertia {name}", "a number of kg·m²", 1) for name in _INERTIAS)
    return next((problem for problem in problems if problem), "")


def _origin(attributes: Attributes, _: str) -> str:
    return _wrong(attributes, "xyz", "origin", f"{_THREE}, m", 3) or _wrong(
        attributes, "rpy", "origin", f"{_THREE}, rad", 3
    )


def _axis(attributes: Attributes, kind: str) -> str:
    if kind in _MOVABLE and "xyz" not in attributes:
        return f"its <axis> has no xyz, expected {_THREE}"
    expected = f"{_THREE} that are not all zero"
    return _wrong(attributes, "xyz", "axis", expected, 3, lambda v: any(v) or kind not in _MOVABLE)


def _limit(attributes: Attributes, kind: str) -> str:
    if kind not in ("revolute", "prismatic"):
        return ""
    for name in ("lower", "upper"):
        if problem := _wrong(attributes, name, f"limit {name}", "a number", 1, most=_NO_LIMIT):
            return problem
    low, high = float(attributes.get("lower", "0")), float(attributes.get("upper", "0"))
    return f"its limits are {low:g} and {high:g}, expected the lower one first" if low > high else ""


def _mimic(attributes: Attributes, _: str) -> str:
    problems = (_wrong(attributes, name, f"mimic {name}", "a number", 1) for name in ("multiplier", "offset"))
    return next((problem for problem in problems if problem), "")


_CHECKS: dict[tuple[str, ...], Callable[[Attributes, str], str]] = {
    ("link", "inertial", "mass"): _mass,
    ("link", "inertial", "inertia"): _inertia,
    ("link", "inertial", "origin"): _origin,
    ("joint",): _joint,
    ("joint", "origin"): _origin,
    ("joint", "axis"): _axis,
    ("joint", "mimic"): _mimic,
    ("joint", "limit"): _limit,
}
_ONCE = {
    ("link", "inertial"),
    ("link", "inertial", "mass"),
    *(("joint", part) for part in ("origin", "parent", "child", "axis", "limit", "mimic")),
}
"""Elements of which urdfdom reads the first alone."""


def _wrong(
    attributes: Attributes,
    name: str,
    what: str,
    expected: str,
    count: int,
    holds: Callable[[list[float]], bool] = lambda _: True,
    *,
    most: float = _LARGEST,
) -> str:
    """Return what is wrong with an attribute; empty where it is right, or absent and so its default."""
    text = attributes.get(name)
    if text is None:
        return ""
    words = text.split()
    if len(words) == count and all(_NUMBER.fullmatch(word) for word in words):
        values = [float(word) for word in words]
        if all(abs(value) <= most for value in values) and holds(values):
            return ""
    return f"{what} is {_short(text)}, expected {expected}"


def _short(text: str, most: int = 60) -> str:
    return repr(text if len(text) <= most else f"{text[:most]}…")
