"""Joints that mimic another: linear couplings between the positions of the joints of a chain.

The coupling is applied outside Pinocchio. Its own (``JointModelMimic``, as of 4.1) has Jacobians and gravity torques,
but no regressors, wants the driving joint to be nearer to the root, and cannot hold it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.markup import bare, encoded, tags
from thermal_robot.kinematics.urdf import nearest


@dataclass(frozen=True)
class Mimic:
    """What a mimicking joint follows: its position is ``multiplier`` times that of ``joint``, plus ``offset``.

    Parameters
    ----------
    joint
        Name of the joint that is followed.
    multiplier
        Own unit (rad or m) per unit of the joint that is followed.
    offset
        rad or m.
    """

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0

    def after(self, before: Mimic) -> Mimic:
        """Return what is followed in the end, where ``joint`` itself follows as ``before`` says."""
        return Mimic(before.joint, self.multiplier * before.multiplier, self.multiplier * before.offset + self.offset)


@dataclass(frozen=True, eq=False)
class Coupling:
    """Positions of the M movable joints of a chain, from those of the n that drive them: ``matrix @ q + offset``.

    Parameters
    ----------
    names
        (n,) of the driving joints. One that stands beside the chain drives it by those of the chain that mimic it.
    driving
        (n,) numbers, among the movable joints, of those that stand for them: the driving joint itself, or the first
        that mimics it.
    matrix
        (M, n); a driving joint's row is a unit vector, that of a joint which stands still is zero.
    offset
        (M,) rad or m.
    """

    names: tuple[str, ...]
    driving: NDArray[np.int64]
    matrix: Array
    offset: Array

    def positions(self, q: Array) -> Array:
        """Return the (N, M) positions of the movable joints at (N, n) positions of the driving ones."""
        return q @ self.matrix.T + self.offset

    def leader(self, joint: int) -> int | None:
        """Return which driving joint moves a movable one; ``None`` where it stands still."""
        found = np.flatnonzero(self.matrix[joint])
        return int(found[0]) if len(found) else None


def mimics(urdf: str, source: str = "the robot description") -> dict[str, Mimic]:
    """Read what every joint with a ``<mimic>`` tag follows, which Pinocchio's default parsing drops."""
    found, every = {}, tags(bare(encoded(urdf)), source)
    for tag in every:
        if tag.path == ("robot", "joint", "mimic") and (name := every[tag.parent].attributes.get("name")):
            said = tag.attributes
            times, offset = float(said.get("multiplier", 1.0)), float(said.get("offset", 0.0))
            found[name] = Mimic(said.get("joint", ""), times, offset)
    return found


def followed(found: Mapping[str, Mimic], joints: Collection[str], chain: Collection[str]) -> dict[str, Mimic]:
    """Follow each mimicking joint, over others that mimic, to one that does not.

    Outside the chain a joint that follows nothing, or in the end itself, is left out: as many a hand in use is written,
    and it moves nothing that was measured.

    Parameters
    ----------
    found
        From :func:`mimics`.
    joints
        Names of all joints of the robot.
    chain
        Names of those of the chain.

    Raises
    ------
    RobotError
        If a joint of the chain follows one that does not exist, or in the end itself; both are named.
    """
    ends = {}
    for name in found:
        try:
            ends[name] = _end(name, found, joints)
        except RobotError:
            if name in chain:
                raise
    return ends


def _end(name: str, found: Mapping[str, Mimic], joints: Collection[str]) -> Mimic:
    seen, end = [name], found[name]
    while True:
        if end.joint not in joints:
            near = nearest(end.joint, joints)
            raise RobotError(
                f"joint {seen[-1]!r} mimics {end.joint!r}, which is not a joint of the robot; "
                f"nearest: {', '.join(near)}",
                name=seen[-1],
                candidates=near,
            )
        if end.joint in seen:
            circle = " mimics ".join(repr(joint) for joint in (*seen[seen.index(end.joint) :], end.joint))
            raise RobotError(f"joints mimic each other in a circle: {circle}", name=end.joint)
        if end.joint not in found:
            return end
        seen.append(end.joint)
        end = end.after(found[end.joint])


def couple(names: Sequence[str], ends: Mapping[str, Mimic], beside: Collection[str] = ()) -> Coupling:
    """Couple the movable joints of a chain.

    Parameters
    ----------
    names
        M names of the movable joints, from the root on.
    ends
        From :func:`followed`.
    beside
        Names of movable joints outside the chain: what mimics another one of those is at the offset, as one that
        mimics a fixed joint is.
    """
    driving: dict[str, int] = {}
    for j, name in enumerate(names):
        end = ends.get(name, Mimic(name))
        if end.joint == name or (end.joint in beside and end.joint not in names and end.multiplier):
            driving.setdefault(end.joint, j)
    column = {driver: i for i, driver in enumerate(driving)}
    matrix, offset = np.zeros((len(names), len(driving))), np.zeros(len(names))
    for j, name in enumerate(names):
        end = ends.get(name, Mimic(name))
        offset[j] = end.offset
        if end.joint in column:
            matrix[j, column[end.joint]] = end.multiplier
    numbers = np.array(list(driving.values()), dtype=np.int64)
    for array in (numbers, matrix, offset):
        array.setflags(write=False)
    return Coupling(tuple(driving), numbers, matrix, offset)


def common_limits(
    coupling: Coupling, names: Sequence[str], lower: Array, upper: Array, own: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Limits of the driving joints within which every joint that follows them is within its own.

    Parameters
    ----------
    coupling
        Of M movable joints, n of them driving.
    names
        M names of the movable joints.
    lower, upper
        (M,) limits of each, rad or m; infinite where there is none.
    own
        (n,) and (n,) those of the driving joints.

    Returns
    -------
    lower, upper
        (n,) rad or m.

    Raises
    ------
    RobotError
        If a joint and one that follows it are never both within their limits.
    """
    low, high = (np.array(limits) for limits in own)
    for j, name in enumerate(names):
        i = coupling.leader(j)
        if i is None:
            continue
        with np.errstate(over="ignore"):  # a joint that hardly follows never comes to its limits
            ends = (np.array([lower[j], upper[j]]) - coupling.offset[j]) / coupling.matrix[j, i]
        low[i], high[i] = max(low[i], ends.min()), min(high[i], ends.max())
        if low[i] > high[i]:
            raise RobotError(
                f"joint {name!r} mimics {coupling.names[i]!r}, but the two are never both within their limits",
                name=name,
            )
    return low, high
