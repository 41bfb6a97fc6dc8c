"""The visual shapes of a URDF's links, read by yourdfpy and trimesh."""

from __future__ import annotations

import io
import logging
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import RobotError
from thermal_robot.shapes.meshes import find_mesh

Array = NDArray[np.float64]

_DECLARATION = re.compile(r"^\s*<\?xml.*?\?>", re.DOTALL)


def parsed(urdf: str) -> Any:
    """Return the robot that a URDF's text describes, as a ``yourdfpy.Robot``, without its meshes.

    Raises
    ------
    RobotError
        If what it says of shapes cannot be read.
    """
    import yourdfpy

    # it tells programmers what it does not know; what matters of that was said when the robot was loaded
    logging.getLogger("yourdfpy").setLevel(logging.CRITICAL)
    # the text is decoded already, whatever it says of its encoding
    file = io.BytesIO(_DECLARATION.sub("", urdf, count=1).encode())
    try:
        return yourdfpy.URDF.load(file, build_scene_graph=False, load_meshes=False).robot
    except Exception as error:  # of the XML, of numbers, of elements that are missing: each in its own way
        raise RobotError(f"the shapes of the robot's links, its <visual> elements, cannot be read: {error}") from error


def visuals(robot: Any, folder: Path) -> tuple[dict[str, list[Any]], dict[str, list[str]]]:
    """Return by link its shapes, and the names of meshes that cannot be read.

    Parameters
    ----------
    robot
        As :func:`parsed` returns it.
    folder
        From which paths of meshes start.

    Returns
    -------
    drawn
        By name of a link: a ``trimesh.Trimesh`` for each visual shape, m, in the link's frame.
    absent
        By name of a link: files that are not there, or hold no mesh.
    """
    drawn: dict[str, list[Any]] = {}
    absent: dict[str, list[str]] = {}
    for link in robot.links:
        for visual in link.visuals:
            shape = _shape(visual.geometry, folder)
            if shape is not None:
                drawn.setdefault(link.name, []).append(shape.apply_transform(placement(visual.origin)))
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


def placement(origin: Any) -> Array:
    """Return an origin as (4, 4); the identity where a URDF gives none."""
    return np.eye(4) if origin is None else np.asarray(origin, dtype=float)
