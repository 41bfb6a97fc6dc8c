"""The numbers of a URDF that its parser drops or takes as they are: masses, inertias, origins, axes, limits.

urdfdom leaves out a link's inertia, without an error, where its mass is written ``3,42`` or is empty; and takes a mass
of −3 kg as it is. Torques are then wrong and nobody is told.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.elements import read_elements, without_comments

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_LARGEST = 1e9  # no figure of a robot is larger, in any unit
_NO_LIMIT = 1e100  # limits that are none are written as 1e16, or 1e30
MOST_JOINTS = 150
"""Joints that move, a floating one for six: Pinocchio's memory grows with their cube, 0.45 GB at 150, and ends the
process at 1000. A mobile robot with two arms and hands has 101."""
_THREE = "three numbers"
_MOVABLE = ("revolute", "continuous", "prismatic")
_FREEDOMS = {**dict.fromkeys(_MOVABLE, 1), "planar": 3, "floating": 6}
_INERTIAS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

Attributes = Mapping[str, str]


def require_numbers(urdf: str, source: str) -> None:
    """Refuse a URDF with a figure that is no number, or one that no robot has, or with too many joints.

    Parameters
    ----------
    urdf
        XML text.
    source
        What to call it in an error.

    Raises
    ------
    RobotError
        Naming the link or joint, the figure, what stands there and what is expected; or saying why it is no URDF.
    """
    freedoms = 0
    seen: set[tuple[int, tuple[str, ...]]] = set()
    for element in read_elements(without_comments(urdf), source):
        kind, name, path = element.owner.get("type", ""), element.owner.get("name", ""), element.path
        if path == ("joint",):
            freedoms += _FREEDOMS.get(kind, 0)
        check = _CHECKS.get(path)
        problem = check(element.attributes, kind) if check else ""
        if path == ("link", "inertial") and (element.number, (*path, "mass")) not in seen:
            problem = "its <inertial> has no <mass>, expected one"
        if path in _ONCE and (element.number, path) in seen:
            problem = f"there are two <{path[-1]}>, expected one"
        if problem:
            raise RobotError(f"{source}: {path[0]} {_short(name)}: {problem}", name=name)
        seen.add((element.number, path))
    if freedoms > MOST_JOINTS:
        raise RobotError(f"{source} has {freedoms} joints that move, expected at most {MOST_JOINTS}: cut it to the arm")


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
