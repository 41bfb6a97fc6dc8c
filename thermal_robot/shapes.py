"""Visual geometry of a URDF: meshes, and coarse convex hulls posed by forward kinematics."""

from __future__ import annotations

import io
import logging
import os
import re
import sysconfig
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import link_poses
from thermal_robot.robot import Robot

_PACKAGE, _FILE = "package://", "file://"
_SEARCHED = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")
"""Variables of the environment in which ROS lists its packages, or the folders above them."""
_DECLARATION = re.compile(r"^\s*<\?xml.*?\?>", re.DOTALL)
_FLAT = 1e-9
"""Relative thickness below which points count as flat and have no hull."""
_CORNERS = 80
"""Number of directions in which a hull keeps a mesh's outermost point: tubes look round, and pages stay small."""


def find_mesh(named: str, folder: Path) -> Path | None:
    """Find the file of a mesh named in a URDF; ``None`` where it is missing; nothing is downloaded.

    Parameters
    ----------
    named
        As in the URDF: a path, absolute or from the folder of the URDF, ``file://`` and a path, or ``package://``,
        the name of a package and a path in it. A package is looked for in the folders above the URDF, then where
        ROS says that its packages are, then where this Python keeps those that were installed as wheels, such as
        example-robot-data.
    folder
        Of the URDF.
    """
    return next((path for path in _places(named, folder) if path.is_file()), None)


def _places(named: str, folder: Path) -> Iterator[Path]:
    if named.startswith(_FILE):
        yield Path(unquote(named.removeprefix(_FILE)))
    elif named.startswith(_PACKAGE):
        package, _, rest = named.removeprefix(_PACKAGE).partition("/")
        listed = [Path(p) for name in _SEARCHED for p in os.environ.get(name, "").split(os.pathsep) if p]
        installed = [Path(sysconfig.get_path("purelib")) / "cmeel.prefix", Path(sysconfig.get_path("data"))]
        for place in (folder.resolve(), *folder.resolve().parents, folder, *listed):
            yield place / package / rest
            # a URDF that was moved out of its package still stands beside its meshes
            if place.name == package or place is folder:
                yield place / rest
        for prefix in (*listed, *installed):
            yield prefix / "share" / package / rest
    elif "://" not in named:
        yield folder / named


def parsed(urdf: str) -> Any:
    """URDF text parsed to a ``yourdfpy.Robot``, without its meshes.

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
    """Visual shapes by link, and the names of unreadable meshes.

    Parameters
    ----------
    robot
        As :func:`parsed` returns it.
    folder
        Folder to which mesh paths are relative.

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
        for visual in (visual for visual in link.visuals if visual.geometry is not None):
            shape = _shape(visual.geometry, folder)
            if shape is not None:
                drawn.setdefault(link.name, []).append(shape.apply_transform(placement(visual.origin)))
            elif visual.geometry.mesh is not None:
                absent.setdefault(link.name, []).append(visual.geometry.mesh.filename)
    return drawn, absent


def _shape(geometry: Any, folder: Path) -> Any:
    """Mesh (``trimesh``) of one visual's geometry in its own frame; ``None`` without one or without a readable file."""
    import trimesh

    if geometry.box is not None:
        return trimesh.creation.box(geometry.box.size)
    if geometry.cylinder is not None:
        return trimesh.creation.cylinder(geometry.cylinder.radius, geometry.cylinder.length, sections=48)
    if geometry.sphere is not None:
        return trimesh.creation.icosphere(subdivisions=3, radius=geometry.sphere.radius)
    file = find_mesh(geometry.mesh.filename, folder) if geometry.mesh is not None else None
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
    """Origin as a (4, 4) pose; identity where a URDF gives none."""
    return np.eye(4) if origin is None else np.asarray(origin, dtype=float)


def hulls(robot: Robot) -> list[tuple[str, Any]]:
    """Coarse convex hulls of the visual shapes between root frame and tool frame.

    Parameters
    ----------
    robot
        Its meshes are looked for from the folder of its URDF on, or from the current one where it came as text.

    Returns
    -------
    list
        Name of a link and a ``trimesh.Trimesh`` in its frame, m, in the order of the chain; none of a shape whose
        mesh is not there or cannot be read, or that is flat.
    """
    try:
        drawn, _ = visuals(parsed(robot.urdf), robot.folder or Path())
    except RobotError:  # Pinocchio has read it: it is drawn as sticks
        return []
    on_chain = (*dict.fromkeys(robot.chain.parent_links), robot.tool_frame)
    found = ((link, hull(np.asarray(mesh.vertices))) for link in on_chain for mesh in drawn.get(link, ()))
    return [(link, shape) for link, shape in found if shape is not None]


def hull(points: Array) -> Any:
    """Coarse convex hull of (P, 3) points as a ``trimesh.Trimesh``; ``None`` where it is flat.

    Of many points those are kept that lie farthest in directions spread evenly over a sphere, the golden spiral.
    """
    from scipy.spatial import QhullError
    from trimesh.convex import convex_hull

    if len(points) > _CORNERS:
        k = np.arange(_CORNERS) + 0.5
        height, turn = 1.0 - 2.0 * k / _CORNERS, np.pi * (1.0 + np.sqrt(5.0)) * k
        level = np.sqrt(1.0 - height**2)
        directions = np.stack([level * np.cos(turn), level * np.sin(turn), height])
        points = points[np.unique(np.argmax(points @ directions, axis=0))]
    try:
        flat = np.linalg.matrix_rank(points - points.mean(axis=0), rtol=_FLAT) < 3
        return None if flat else convex_hull(points)
    except (QhullError, ValueError):  # of coordinates that are no numbers
        return None


@dataclass(frozen=True, eq=False)
class Arm:
    """Poses of L links in R postures, and the share 0..1 of the gap's mean square by place.

    ``links`` are named from the root frame to the tool frame; ``poses`` (R, L, 4, 4) stand in the root frame, m, as the
    model has them at what was commanded; ``joints`` are the J movable ones, those that mimic another too; ``moves``
    (J,) is which link each moves first; ``hulls`` is what links look like, nothing of those without a shape. Besides
    link and joint shares (L,) and (J,): where the robot stands, between tool frame and target, and at the instrument.
    """

    links: tuple[str, ...]
    link_shares: Array
    poses: Array
    joints: tuple[str, ...]
    joint_shares: Array
    moves: NDArray[np.int64]
    hulls: list[tuple[str, Any]]
    base_share: float = 0.0
    tool_share: float = 0.0
    instrument_share: float = 0.0


def arm(robot: Robot, q: ArrayLike, shares: Mapping[tuple[str, str], float]) -> Arm:
    """Forward kinematics of the chain's links at (R, n) joint positions, rad or m, with the ``shares`` of places."""
    chain = robot.chain
    links = (*chain.parent_links, robot.tool_frame)
    joints = [chain.names[k] for k in chain.movable]
    for j, name in zip(chain.coupling.driving.tolist(), robot.joint_names, strict=True):
        joints[j] = name  # one beside the chain is seen at the first that follows it
    return Arm(
        links,
        np.array([shares.get(("link", name), 0.0) for name in links]),
        link_poses(robot, q)[:, [robot.urdf_links.index(name) for name in links]],
        tuple(joints),
        np.array([shares.get(("joint", name), 0.0) for name in joints]),
        np.asarray(chain.movable) + 1,
        hulls(robot),
        *(shares.get((end, end), 0.0) for end in ("base", "tool", "instrument")),
    )
