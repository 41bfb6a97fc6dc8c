"""The numbers of a URDF that its parser drops or takes as they are: masses, inertias, origins, axes, limits.

urdfdom leaves out a link's inertia, without an error, where its mass is written ``3,42`` or is empty; and takes a mass
of −3 kg as it is. Torques are then wrong and nobody is told.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from xml.parsers import expat

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.urdf import without_comments

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_LARGEST = 1e100  # no figure of a robot is larger, in any unit
MOST_JOINTS = 150
"""Joints that move: Pinocchio's memory grows with their cube, 0.45 GB at 150, and ends the process at 1000. A mobile
robot with two arms and hands has 101."""
_THREE = "three numbers"
_MOVABLE = ("revolute", "continuous", "prismatic")
_INERTIAS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

Attributes = Mapping[str, str]


def require_numbers(urdf: str, source: str) -> None:
    """Refuse a URDF with a figure that is no number, or one that no robot has, or with too many joints.

    Parameters
    ----------
    urdf
        XML text that Pinocchio takes.
    source
        What to call it in an error.

    Raises
    ------
    RobotError
        Naming the link or joint, the figure, what stands there and what is expected.
    """
    moving = 0
    path: list[str] = []
    names: list[str] = []
    kinds: list[str] = []

    def begin(tag: str, attributes: Attributes) -> None:
        nonlocal moving
        path.append(tag)
        names.append(attributes.get("name", ""))
        kinds.append(attributes.get("type", ""))
        moving += path == ["robot", "joint"] and kinds[1] in _MOVABLE
        check = _CHECKS.get(tuple(path[1:]))
        if path[0] == "robot" and check and (problem := check(attributes, kinds[1])):
            raise RobotError(f"{source}: {path[1]} {names[1]!r}: {problem}", name=names[1])

    def end(_: str) -> None:
        del path[-1], names[-1], kinds[-1]

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    try:
        parser.Parse(without_comments(urdf).encode(), True)
    except expat.ExpatError:
        pass  # urdfdom takes what this parser does not
    if moving > MOST_JOINTS:
        raise RobotError(f"{source} has {moving} joints that move, expected at most {MOST_JOINTS}: cut it to the arm")


def _mass(attributes: Attributes, _: str) -> str:
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
        if problem := _wrong(attributes, name, f"limit {name}", "a number", 1):
            return problem
    low, high = float(attributes.get("lower", "0")), float(attributes.get("upper", "0"))
    return f"its limits are {low:g} and {high:g}, expected the lower one first" if low > high else ""


_CHECKS: dict[tuple[str, ...], Callable[[Attributes, str], str]] = {
    ("link", "inertial", "mass"): _mass,
    ("link", "inertial", "inertia"): _inertia,
    ("link", "inertial", "origin"): _origin,
    ("joint", "origin"): _origin,
    ("joint", "axis"): _axis,
    ("joint", "limit"): _limit,
}


def _wrong(
    attributes: Attributes,
    name: str,
    what: str,
    expected: str,
    count: int,
    holds: Callable[[list[float]], bool] = lambda _: True,
) -> str:
    """Return what is wrong with an attribute; empty where it is right, or absent and so its default."""
    text = attributes.get(name)
    if text is None:
        return ""
    words = text.split()
    if len(words) == count and all(_NUMBER.fullmatch(word) for word in words):
        values = [float(word) for word in words]
        if all(abs(value) <= _LARGEST for value in values) and holds(values):
            return ""
    return f"{what} is {_short(text)}, expected {expected}"


def _short(text: str, most: int = 60) -> str:
    return repr(text if len(text) <= most else f"{text[:most]}…")
