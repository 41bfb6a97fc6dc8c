"""What the links of a chain look like, coarsely: a convex hull of each visual shape of the URDF, for drawings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import RobotError
from thermal_robot.robot import Robot
from thermal_robot.shapes.visuals import parsed, visuals

Array = NDArray[np.float64]

_CORNERS = 80
"""Directions in which the outermost point of a mesh is kept: tubes look round, a page of ten links stays small."""


@dataclass(frozen=True, eq=False)
class Hull:
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


def hulls(robot: Robot) -> tuple[Hull, ...]:
    """Return the convex hulls of the visual shapes of the links between root frame and tool frame.

    Parameters
    ----------
    robot
        Its meshes are looked for from the folder of its URDF on, or from the current one where it came as text.

    Returns
    -------
    tuple of Hull
        In the order of the chain; none of a shape whose mesh is not there or cannot be read, or that is flat.
    """
    try:
        drawn, _ = visuals(parsed(robot.urdf), robot.folder or Path())
    except RobotError:  # Pinocchio has read it: it is drawn as sticks
        return ()
    on_chain = (*dict.fromkeys(robot.chain.parent_links), robot.tool_frame)
    found = ((link, hull(np.asarray(mesh.vertices, dtype=float))) for link in on_chain for mesh in drawn.get(link, ()))
    return tuple(Hull(link, *shape) for link, shape in found if shape is not None)


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
