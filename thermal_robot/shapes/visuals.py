"""The visual shapes of a URDF's links, read by yourdfpy and trimesh."""

from __future__ import annotations

import io
import logging
import os
import re
import sysconfig
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.robot import Robot

PACKAGE, FILE = "package://", "file://"
SEARCHED = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")
"""Variables of the environment in which ROS lists its packages, or the folders above them."""


def find_mesh(named: str, folder: Path) -> Path | None:
    """Return the file of a mesh; nothing is fetched from another machine.

    Parameters
    ----------
    named
        As in the URDF: a path, absolute or from the folder of the URDF, ``file://`` and a path, or ``package://``,
        the name of a package and a path in it. A package is looked for in the folders above the URDF, then where
        ROS says that its packages are, then where this Python keeps those that were installed as wheels, such as
        example-robot-data.
    folder
        Of the URDF.

    Returns
    -------
    Path or None
        ``None`` where there is no such file.
    """
    return next((path for path in _places(named, folder) if path.is_file()), None)


def _places(named: str, folder: Path) -> Iterator[Path]:
    if named.startswith(FILE):
        yield Path(unquote(named.removeprefix(FILE)))
    elif named.startswith(PACKAGE):
        package, _, rest = named.removeprefix(PACKAGE).partition("/")
        for above in (folder.resolve(), *folder.resolve().parents):
            yield above / package / rest
            if above.name == package:
                yield above / rest
        # a URDF that was moved out of its package still stands beside its meshes
        yield folder / rest
        for variable in SEARCHED:
            for listed in filter(None, os.environ.get(variable, "").split(os.pathsep)):
                yield Path(listed) / package / rest
                yield Path(listed) / "share" / package / rest
                if Path(listed).name == package:
                    yield Path(listed) / rest
        for prefix in (Path(sysconfig.get_path("purelib")) / "cmeel.prefix", Path(sysconfig.get_path("data"))):
            yield prefix / "share" / package / rest
    elif "://" not in named:
        yield folder / named


_CORNERS = 80
"""Directions in which the outermost point of a mesh is kept: tubes look round, a page of ten links stays small."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A body fixed to a link.

    Attributes
    ----------
    link
        Name of the link.
    corners
        (V, 3) in the frame of the link, m.
    faces
        (F, 3) corners of each triangle, counterclockwise as seen from outside.
    """

    link: str
    corners: Array
    faces: NDArray[np.int64]


def hulls(robot: Robot) -> tuple[Solid, ...]:
    """Return the convex hulls of the visual shapes of the links between root frame and tool frame.

    Parameters
    ----------
    robot
        Its meshes are looked for from the folder of its URDF on, or from the current one where it came as text.

    Returns
    -------
    tuple of Solid
        In the order of the chain; none of a shape whose mesh is not there or cannot be read, or that is flat.
    """
    try:
        drawn, _ = visuals(parsed(robot.urdf), robot.folder or Path())
    except RobotError:  # Pinocchio has read it: it is drawn as sticks
        return ()
    on_chain = (*dict.fromkeys(robot.chain.parent_links), robot.tool_frame)
    found = ((link, hull(np.asarray(mesh.vertices, dtype=float))) for link in on_chain for mesh in drawn.get(link, ()))
    return tuple(Solid(link, *shape) for link, shape in found if shape is not None)


def hull(points: Array) -> tuple[Array, NDArray[np.int64]] | None:
    """Return corners and outward faces of the convex hull of (P, 3) points, coarsened; ``None`` where it is flat."""
    from scipy.spatial import ConvexHull, QhullError

    outermost = np.unique(np.argmax(points @ _directions().T, axis=0)) if len(points) > _CORNERS else slice(None)
    corners = points[outermost]
    try:
        whole = ConvexHull(corners)
    except (QhullError, ValueError):
        return None
    kept, faces = np.unique(whole.simplices, return_inverse=True)
    faces = faces.reshape(whole.simplices.shape)
    corners = corners[kept]
    first, second, third = (corners[faces[:, k]] for k in range(3))
    inward = np.einsum("fi,fi->f", np.cross(second - first, third - first), whole.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return corners, faces


def _directions() -> Array:
    """(D, 3) unit vectors spread evenly over a sphere: the golden spiral."""
    k = np.arange(_CORNERS) + 0.5
    height, turn = 1.0 - 2.0 * k / _CORNERS, np.pi * (1.0 + np.sqrt(5.0)) * k
    flat = np.sqrt(1.0 - height**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height])


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
