"""The shape of each link: as its URDF draws it, or a stick figure where it draws none."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import Note
from thermal_robot.shapes.visuals import parsed, placement, visuals
from thermal_robot.viewer.settings import KNOT, STICK

Array = NDArray[np.float64]

_SHORTEST = 1e-6
"""m: what is shorter has no direction."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A shape that is fixed to a link.

    Attributes
    ----------
    link
        Name of the link.
    vertices
        (V, 3) m, in the link's frame.
    faces
        (F, 3) numbers of vertices.
    """

    link: str
    vertices: Array
    faces: NDArray[np.int64]


def solids(urdf: str, folder: Path, size: float) -> tuple[Solid, ...]:
    """Return the shape of each link that has one.

    Parameters
    ----------
    urdf
        XML text.
    folder
        From which paths of meshes start.
    size
        Of the scene, m: sticks are as thick as suits it.

    Returns
    -------
    tuple
        At most one solid a link, in the order of the URDF. A link whose meshes are missing is a stick to each joint
        that it carries; so are all links where none has a shape. A :class:`~thermal_robot.errors.Note` names a file.

    Raises
    ------
    RobotError
        If what the URDF says of shapes cannot be read.
    """
    import trimesh

    robot = parsed(urdf)
    drawn, absent = visuals(robot, folder)
    thin = set(absent) if drawn else {link.name for link in robot.links}
    found = []
    for link in robot.links:
        parts = drawn.get(link.name, []) + (_sticks(link.name, robot.joints, size) if link.name in thin else [])
        if parts:
            whole: Any = trimesh.util.concatenate(parts)
            found.append(Solid(link.name, np.asarray(whole.vertices, dtype=float), np.asarray(whole.faces)))
    if absent:
        files = [file for named in absent.values() for file in named]
        more = f" and {len(files) - 1} more" if len(files) > 1 else ""
        warnings.warn(Note(f"no mesh can be read from {files[0]!r}{more}; sticks stand in their place"), stacklevel=2)
    return tuple(found)


def rod(start: Array, end: Array, radius: float) -> Any:
    """Return a rod between two points of a link, (3,) m each, as a ``trimesh.Trimesh``."""
    import trimesh

    return trimesh.creation.cylinder(radius, segment=[start, end], sections=20)


def ring(radius: float, tube: float) -> Any:
    """Return a ring about the z axis, m, as a ``trimesh.Trimesh``."""
    import trimesh

    return trimesh.creation.torus(radius, tube, major_sections=48, minor_sections=12)


def _sticks(link: str, joints: Iterable[Any], size: float) -> list[Any]:
    """Return a knot at the link's origin, a rod to each joint that it carries, and the rail on which it slides."""
    import trimesh

    parts = [trimesh.creation.icosphere(subdivisions=2, radius=KNOT * size)]
    for joint in joints:
        start, end = np.zeros(3), np.zeros(3)
        if joint.parent == link:
            end = placement(joint.origin)[:3, 3]
        elif joint.child == link and joint.type == "prismatic" and joint.limit is not None:
            axis = np.asarray(joint.axis, dtype=float) / np.linalg.norm(joint.axis)
            # where the joint's origin comes to lie behind the link, at either limit
            start, end = (-axis * (bound or 0.0) for bound in (joint.limit.lower, joint.limit.upper))
        if np.linalg.norm(end - start) > _SHORTEST:
            parts.append(rod(start, end, STICK * size))
    return parts
