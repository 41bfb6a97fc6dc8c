"""What the links of a chain look like, coarsely: a convex hull of each visual shape of the URDF, for drawings."""

from __future__ import annotations

import io
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.robot import Robot

Array = NDArray[np.float64]

_CORNERS = 80
"""Directions in which the outermost point of a mesh is kept: tubes look round, a page of ten links stays small."""
_AROUND = 16
"""Corners of the circle that stands for that of a cylinder."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex body fixed to a link.

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


def solids(robot: Robot) -> tuple[Solid, ...]:
    """Return the convex hulls of the visual shapes of the links between root frame and tool frame.

    Parameters
    ----------
    robot
        Its meshes are looked for where its URDF was read, and above, as ``package://`` names want it.

    Returns
    -------
    tuple of Solid
        In the order of the chain; nothing of a shape whose mesh is not there or cannot be read, and of a robot that
        yourdfpy cannot read.
    """
    on_chain = (*dict.fromkeys(robot.chain.parent_links), robot.tool_frame)
    shapes = _visuals(robot)
    found = [(link, _points(visual, robot.folder)) for link in on_chain for visual in shapes.get(link, ())]
    hulls = [(link, hull(points)) for link, points in found if points is not None]
    return tuple(Solid(link, *shape) for link, shape in hulls if shape is not None)


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


def _visuals(robot: Robot) -> dict[str, list[Any]]:
    import yourdfpy

    quiet = logging.getLogger("yourdfpy")
    level = quiet.level
    quiet.setLevel(logging.CRITICAL)  # it warns of all that a drawing does not need
    try:
        read = yourdfpy.URDF.load(
            io.BytesIO(robot.urdf.encode()), build_scene_graph=False, load_meshes=False, load_collision_meshes=False
        )
    except Exception:  # a robot that Pinocchio reads and yourdfpy does not: it is drawn as sticks
        return {}
    finally:
        quiet.setLevel(level)
    return {link.name: link.visuals for link in read.robot.links}


def _points(visual: Any, folder: Path | None) -> Array | None:
    """(P, 3) points of a visual's surface in the link's frame; ``None`` where there is no such mesh."""
    shape = visual.geometry
    if shape is None:
        return None
    points: Array | None = None
    if shape.box is not None:
        points = 0.5 * np.asarray(shape.box.size, dtype=float) * _signs()
    elif shape.cylinder is not None:
        points = _tube(shape.cylinder.radius, shape.cylinder.length)
    elif shape.sphere is not None:
        points = shape.sphere.radius * _directions()
    elif shape.mesh is not None and folder is not None:
        points = _mesh(shape.mesh, folder)
    if points is None or not len(points) or not np.isfinite(points).all():
        return None
    origin = np.eye(4) if visual.origin is None else np.asarray(visual.origin, dtype=float)
    return np.asarray(points @ origin[:3, :3].T + origin[:3, 3])


def _signs() -> Array:
    return np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T


def _tube(radius: float, length: float) -> Array:
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    circle = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.vstack([np.column_stack([circle, np.full(_AROUND, z * length)]) for z in (-0.5, 0.5)])


def _mesh(mesh: Any, folder: Path) -> Array | None:
    import trimesh
    from yourdfpy.urdf import filename_handler_magic

    try:
        whole: Any = trimesh.load(filename_handler_magic(mesh.filename, dir=str(folder)), force="mesh")
        scale = np.ones(3) if mesh.scale is None else np.asarray(mesh.scale, dtype=float)
        return np.asarray(np.asarray(whole.vertices, dtype=float) * scale)
    except Exception:  # whatever a reader of a dozen formats raises: without its mesh a link is drawn as a stick
        return None
