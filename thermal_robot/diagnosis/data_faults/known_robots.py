"""Robots that are at hand, one of which may be the one that was measured."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np

from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.readings import Readings
from thermal_robot.errors import RobotError
from thermal_robot.robot import Robot, load_robot
from thermal_robot.urdf_text import shipped, urdf_text

_JOINT = re.compile(r"<joint\b[^>]*>")
_NAME = re.compile(r"\bname\s*=\s*[\"']([^\"']+)")
_MOVES = re.compile(r"\btype\s*=\s*[\"'](revolute|continuous|prismatic)")


def fitting(readings: Readings, near: float) -> tuple[str, float] | None:
    """Return the shipped robot that fits readings best, and the median distance that it leaves, m.

    Parameters
    ----------
    readings
        Commands and measurements; both frames are fitted.
    near
        Distance, m, within which a robot fits; ``None`` is returned where none does.
    """
    own = readings.robot
    alike = [name for name in shipped() if set(own.joint_names) <= _movable(name)]
    best = None
    for name in (*alike, *(name for name in shipped() if name not in alike)):
        if best is not None and name not in alike:
            break
        for robot in _chains(name, own.joint_names, own.joint_types, own.root_frame, own.tool_frame):
            other = replace(readings, robot=robot, q=readings.q[:, _order(robot, own)])
            left = float(np.median(other.distance(other.align())))
            least = near if best is None else settings.LIKE_ANOTHER * best[1]
            if left < min(least, settings.MISFIT * other.spread()):
                best = name, left
    return best


def _order(robot: Robot, own: Robot) -> list[int]:
    """Return which column of the table drives each joint: that of its name, else that of its place in the chain."""
    if set(robot.joint_names) == set(own.joint_names):
        return [own.joint_names.index(name) for name in robot.joint_names]
    return list(range(robot.n))


@cache
def _movable(name: str) -> frozenset[str]:
    """Return the movable joints of a shipped robot; none where it cannot be read."""
    try:
        joints = _JOINT.findall(urdf_text(name).text)
    except RobotError:
        return frozenset()
    return frozenset(found[1] for joint in joints if _MOVES.search(joint) and (found := _NAME.search(joint)))


@cache
def _chains(name: str, joints: tuple[str, ...], kinds: tuple[str, ...], root: str, tool: str) -> tuple[Robot, ...]:
    """Return the chains of a shipped robot that the joints may drive: those of the same ends, else those to a hand."""
    alike = set(joints) <= _movable(name)
    if not alike and not len(joints) <= len(_movable(name)) <= len(joints) + settings.HAND_JOINTS:
        return ()
    slides = [kind == "prismatic" for kind in kinds]
    found = (robot for robot in _loaded(name, root, tool) if [k == "prismatic" for k in robot.joint_types] == slides)
    return tuple(islice((robot for robot in found if not alike or set(robot.joint_names) == set(joints)), 1))


def _loaded(name: str, root: str, tool: str) -> Iterator[Robot]:
    """Yield chains of a robot: between links of these names, then from its root to each of its ends."""
    ends: tuple[str, ...] = ()
    for tool_frame, root_frame in ((tool, root), (tool, None), ("", None)):
        try:
            yield load_robot(name, tool_frame, root_frame=root_frame)
        except RobotError as error:
            ends = error.candidates
    for end in ends if len(ends) <= settings.ENDS else ():
        try:
            yield load_robot(name, end)
        except RobotError:
            continue
