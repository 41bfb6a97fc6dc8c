"""The shape of each link: as its URDF draws it, or a stick figure where it draws none."""

from __future__ import annotations

import io
import logging
import re
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import Note, RobotError
from thermal_robot.viewer.meshes import find_mesh
from thermal_robot.viewer.settings import KNOT, STICK

Array = NDArray[np.float64]

_DECLARATION = re.compile(r"^\s*<\?xml.*?\?>", re.DOTALL)
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

    robot = _parsed(urdf)
    drawn, absent = _drawn(robot, folder)
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


def _parsed(urdf: str) -> Any:
    import yourdfpy

    # it tells programmers what it does not know; what matters of that was said when the robot was loaded
    logging.getLogger("yourdfpy").setLevel(logging.CRITICAL)
    # the text is decoded already, whatever it says of its encoding
    file = io.BytesIO(_DECLARATION.sub("", urdf, count=1).encode())
    try:
        return yourdfpy.URDF.load(file, build_scene_graph=False, load_meshes=False).robot
    except Exception as error:  # of the XML, of numbers, of elements that are missing: each in its own way
        raise RobotError(f"the shapes of the robot's links, its <visual> elements, cannot be read: {error}") from error


def _drawn(robot: Any, folder: Path) -> tuple[dict[str, list[Any]], dict[str, list[str]]]:
    """Return by link its shapes, and the meshes that cannot be read."""
    drawn: dict[str, list[Any]] = {}
    absent: dict[str, list[str]] = {}
    for link in robot.links:
        for visual in link.visuals:
            shape = _shape(visual.geometry, folder)
            if shape is not None:
                drawn.setdefault(link.name, []).append(shape.apply_transform(_pose(visual.origin)))
            elif visual.geometry is not None and visual.geometry.mesh is not None:
                absent.setdefault(link.name, []).append(visual.geometry.mesh.filename)
    return drawn, absent


def _shape(geometry: Any, folder: Path) -> Any:
    """Return the shape of one visual in its own frame; ``None`` where there is none, or no file that can be read."""
    import trimesh

    if geometry is None:
        return None
    if geometry.box is not None:
        return trimesh.creation.box(geometry.box.size)
    if geometry.cylinder is not None:
        return trimesh.creation.cylinder(geometry.cylinder.radius, geometry.cylinder.length, sections=48)
    if geometry.sphere is not None:
        return trimesh.creation.icosphere(subdivisions=3, radius=geometry.sphere.radius)
    if geometry.mesh is None:
        return None
    file = find_mesh(geometry.mesh.filename, folder)
    if file is None:
        return None
    try:
        mesh: Any = trimesh.load(file, force="mesh")
    except Exception:  # each format fails in its own way, some in those of the libraries that read it
        return None
    if not len(getattr(mesh, "faces", ())):
        return None
    return mesh.apply_scale(1.0 if geometry.mesh.scale is None else geometry.mesh.scale)


def _sticks(link: str, joints: Iterable[Any], size: float) -> list[Any]:
    """Return a knot at the link's origin, a rod to each joint that it carries, and the rail on which it slides."""
    import trimesh

    parts = [trimesh.creation.icosphere(subdivisions=2, radius=KNOT * size)]
    for joint in joints:
        start, end = np.zeros(3), np.zeros(3)
        if joint.parent == link:
            end = _pose(joint.origin)[:3, 3]
        elif joint.child == link and joint.type == "prismatic" and joint.limit is not None:
            axis = np.asarray(joint.axis, dtype=float) / np.linalg.norm(joint.axis)
            # where the joint's origin comes to lie behind the link, at either limit
            start, end = (-axis * (bound or 0.0) for bound in (joint.limit.lower, joint.limit.upper))
        if np.linalg.norm(end - start) > _SHORTEST:
            parts.append(rod(start, end, STICK * size))
    return parts


def _pose(origin: Any) -> Array:
    return np.eye(4) if origin is None else np.asarray(origin, dtype=float)
