"""The shape of each link: as its URDF draws it, or a stick figure where it draws none."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import Note
from thermal_robot.kinematics import rotation_to_quaternion
from thermal_robot.shapes.visuals import parsed, placement, visuals
from thermal_robot.viewer import panel
from thermal_robot.viewer.scene import Scene, turned_along
from thermal_robot.viewer.settings import KNOT, NO_SHARE, POINTER, RING, RING_TUBE, STICK, Colour, colours

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


class Puppet:
    """Nodes of a scene in the browser that take the pose of a row.

    Parameters
    ----------
    nodes
        What adds them: the ``scene`` of a viser server.
    scene
        What to show.
    shapes
        Of its links.
    """

    def __init__(self, nodes: Any, scene: Scene, shapes: Sequence[Solid]) -> None:
        self._nodes, self._scene = nodes, scene
        self._colours = colours(scene.shares)
        chain = scene.robot.chain
        self._standing = chain.parent_links[: chain.movable[0] + 1]
        self._links = {}
        for k, link in enumerate(scene.robot.urdf_links):
            self._links[k] = nodes.add_frame(f"/links/{k}", show_axes=False)
            for shape in (s for s in shapes if s.link == link):
                self._mesh(f"/links/{k}/shape", shape.vertices, shape.faces, self._colour_of_link(link))
        self._joints = [self._joint(j, name) for j, name in enumerate(scene.robot.joint_names)]
        if np.linalg.norm(scene.target) > POINTER * scene.size:
            tool = scene.robot.urdf_links.index(scene.robot.tool_frame)
            pointer = rod(np.zeros(3), scene.target, POINTER * scene.size)
            self._mesh(f"/links/{tool}/pointer", pointer.vertices, pointer.faces, self._colour("tool", "tool"))
        self._names = [self._name(place, text, shapes) for place, text in panel.names(scene).items()]

    def pose(self, row: int) -> None:
        """Take the pose of a row, 0..N − 1."""
        poses = self._scene.links(row)
        for k, node in self._links.items():
            _put(node, poses[k, :3, 3], poses[k, :3, :3])
        origins, axes = self._scene.joints(row)
        for node, origin, turn in zip(self._joints, origins, turned_along(axes), strict=True):
            _put(node, origin, turn)

    def name(self, shown: bool) -> None:
        """Show the names of the places, or hide them."""
        for label in self._names:
            label.visible = shown

    def _joint(self, j: int, name: str) -> Any:
        node = self._nodes.add_frame(f"/joints/{j}", show_axes=False)
        around = ring(RING * self._scene.size, RING_TUBE * self._scene.size)
        self._mesh(f"/joints/{j}/ring", around.vertices, around.faces, self._colour("joint", name))
        return node

    def _name(self, place: tuple[str, str], text: str, shapes: Sequence[Solid]) -> Any:
        kind, name = place
        robot, at = self._scene.robot, np.zeros(3)
        if kind == "joint":
            node = f"/joints/{robot.joint_names.index(name)}"
        elif kind == "tool":
            node, at = f"/links/{robot.urdf_links.index(robot.tool_frame)}", self._scene.target
        elif kind == "link":
            node = f"/links/{robot.urdf_links.index(name)}"
            shape = next((s for s in shapes if s.link == name), None)
            at = at if shape is None else 0.5 * (shape.vertices.min(axis=0) + shape.vertices.max(axis=0))
        else:
            node = f"/links/{robot.urdf_links.index(robot.root_frame)}"
        # a joint lies where a link begins: one name to its left, the other to its right
        anchor = "center-right" if kind == "joint" else "center-left"
        return self._nodes.add_label(f"{node}/name_{kind}", text, position=at, anchor=anchor)

    def _mesh(self, name: str, vertices: Array, faces: NDArray[np.int64], colour: Colour) -> None:
        self._nodes.add_mesh_simple(name, vertices, faces, color=colour, flat_shading=False)

    def _colour_of_link(self, link: str) -> Colour:
        """Return the colour of a link; what stands still below the first joint is the base, unless it has its own."""
        if link in self._standing and ("link", link) not in self._colours:
            return self._colour("base", "base")
        return self._colour("link", link)

    def _colour(self, kind: str, name: str) -> Colour:
        return self._colours.get((kind, name), NO_SHARE)


def _put(node: Any, position: Array, rotation: Array) -> None:
    node.position, node.wxyz = position, rotation_to_quaternion(rotation)
