"""The scene in the browser: a thin layer over viser, which is loaded once a window opens."""

from __future__ import annotations

import io
import threading
import warnings
from collections.abc import Iterable, Sequence
from contextlib import redirect_stdout
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import in_words
from thermal_robot.errors import Note
from thermal_robot.kinematics import rotation_to_quaternion
from thermal_robot.report.units import percent, quantity
from thermal_robot.shapes.visuals import Solid, parsed, placement, visuals
from thermal_robot.viewer.scene import Cloud, Scene, longest, readable, turned_along
from thermal_robot.viewer.settings import (
    ASIDE,
    CHOSEN,
    CHOSEN_AFTER,
    FAINT,
    GAP,
    GRID,
    HOST,
    KNOT,
    MOST_ARROWS,
    NO_SHARE,
    POINTER,
    REMAINDER,
    RING,
    RING_TUBE,
    SKY,
    STICK,
    STRONGER,
    THICKER,
    TOLD,
    Colour,
    colours,
)

_BOX = "display:inline-block;width:0.8em;height:0.8em;border-radius:0.2em;margin-right:0.5em;background:rgb{}"
_PART = "margin:0 0.8em 0.7em 0.8em;font-size:0.85em;line-height:1.5"


def of_campaign(scene: Scene) -> str:
    """Return the name of the campaign and what is said of it, as HTML."""
    return f'<div style="{_PART}"><b>{escape(scene.title)}</b><br>{escape(scene.summary)}</div>'


def of_row(scene: Scene, row: int, magnification: float) -> str:
    """Return what is measured in one row, 0..N − 1, as HTML."""
    gap = scene.gap[row]
    along = ", ".join(f"{axis} {quantity(part, 'm')}" for axis, part in zip("xyz", gap.tolist(), strict=True))
    aside = ", set aside as an outlier" if scene.aside[row] else ""
    lines = [
        f"<b>row {scene.rows[row]}</b> of the file{aside}",
        f"{_mark(CHOSEN)}gap {_length(gap)}",
        f"<span style='opacity:0.7'>{along}</span>",
    ]
    if scene.remainder is not None:
        lines.append(f"{_mark(CHOSEN_AFTER)}after correction {_length(scene.remainder[row])}")
    cut = longest(scene.size)
    if magnification * np.linalg.norm(gap) > cut:
        lines.append(f"its arrow is cut at {quantity(cut, 'm')}")
    lines.append(f"drawn {magnification:g} times as long: 100 µm as {quantity(1e-4 * magnification, 'm')}")
    return f'<div style="{_PART}">{"<br>".join(lines)}</div>'


def of_places(scene: Scene) -> str:
    """Return the places with their colours and shares, largest first, as HTML."""
    lines = [
        f"{_mark(colour)}{escape(in_words(*place))}<span style='float:right'>{percent(scene.shares[place])}</span>"
        for place, colour in colours(scene.shares).items()
        if scene.shares[place] >= TOLD
    ]
    if not lines:
        return ""
    return f'<div style="{_PART}"><b>Share of the gap by place</b><br>{"<br>".join(lines)}</div>'


def of_arrows(scene: Scene) -> str:
    """Return what the colours of the arrows mean, as HTML."""
    lines = [f"{_mark(CHOSEN)}{_mark(GAP)}gap: measured − predicted, this row and others"]
    if scene.remainder is not None:
        lines.append(f"{_mark(CHOSEN_AFTER)}{_mark(REMAINDER)}after correction: measured − fitted")
    if scene.aside.any():
        lines.append(f"{_mark(ASIDE)}row set aside")
    return f'<div style="{_PART}">{"<br>".join(lines)}</div>'


def names_of_places(scene: Scene) -> dict[tuple[str, str], str]:
    """Return what is written at each place that is named: ``joint_3 37.7 %``."""
    return {place: f"{in_words(*place)} {percent(s)}" for place, s in scene.shares.items() if s >= TOLD}


def _length(vector: NDArray[np.float64]) -> str:
    return quantity(float(np.linalg.norm(vector)), "m")


def _mark(colour: Colour) -> str:
    return f'<span style="{_BOX.format(tuple(colour))}"></span>'


_SHORTEST = 1e-6
"""m: what is shorter has no direction."""


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
                self._mesh(f"/links/{k}/shape", shape.corners, shape.faces, self._colour_of_link(link))
        self._joints = [self._joint(j, name) for j, name in enumerate(scene.robot.joint_names)]
        if np.linalg.norm(scene.target) > POINTER * scene.size:
            tool = scene.robot.urdf_links.index(scene.robot.tool_frame)
            pointer = rod(np.zeros(3), scene.target, POINTER * scene.size)
            self._mesh(f"/links/{tool}/pointer", pointer.vertices, pointer.faces, self._colour("tool", "tool"))
        self._names = [self._name(place, text, shapes) for place, text in names_of_places(scene).items()]

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
            at = at if shape is None else 0.5 * (shape.corners.min(axis=0) + shape.corners.max(axis=0))
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


BACK, ON, WORST = "previous", "next", "largest gap"


class Window:
    """A scene that is served on the loopback address until it is closed.

    Parameters
    ----------
    scene
        What to show.
    shapes
        Of its links.
    port
        Where to listen; the next free one where it is taken, 0 for any.
    """

    def __init__(self, scene: Scene, shapes: Sequence[Solid], port: int) -> None:
        self.scene, self.row, self.magnification = scene, 0, readable(scene.gap, scene.size)
        count = len(scene.q)
        self._drawn = np.unique(np.linspace(0, count - 1, min(count, MOST_ARROWS)).astype(int))
        self._lock = threading.RLock()
        self._server = _server(f"thermal-robot: {scene.title}", port)
        with self._server.atomic():
            self._look()
            self._puppet = Puppet(self._server.scene, scene, shapes)
            self._clouds = self._add_clouds()
            self._add_controls()
            self._show()

    @property
    def url(self) -> str:
        """Where it is served."""
        return f"http://{HOST}:{self._server.get_port()}"

    def close(self) -> None:
        """Serve no longer."""
        with redirect_stdout(io.StringIO()):
            self._server.stop()

    def _look(self) -> None:
        """Look at the whole robot from a little above, its own up being up."""
        scene, nodes = self.scene, self._server.scene
        nodes.set_up_direction(tuple(scene.up))
        camera = self._server.initial_camera
        camera.look_at = tuple(scene.centre)
        camera.position = tuple(scene.eye)
        nodes.configure_environment_map(environment_intensity=SKY)
        nodes.add_grid(
            "/floor",
            width=GRID * scene.size,
            height=GRID * scene.size,
            cell_size=0.5,
            cell_color=FAINT,
            section_size=1.0,
            section_color=FAINT,
            wxyz=rotation_to_quaternion(turned_along(scene.up[None])[0]),
        )

    def _add_controls(self) -> None:
        gui, scene = self._server.gui, self.scene
        gui.add_html(of_campaign(scene))
        count = len(scene.q)
        self._slider = gui.add_slider(
            "measurement", 1, max(count, 2), 1, 1, visible=count > 1, hint="in the order of the table"
        )
        self._step = gui.add_button_group("step", (BACK, ON, WORST), visible=count > 1)
        start = self.magnification
        self._magnify = gui.add_slider("magnified", start / STRONGER, STRONGER * start, start / STRONGER, start)
        self._told = gui.add_html("")
        self._all = gui.add_checkbox("gaps of all rows", True)
        self._after = gui.add_checkbox("after correction", False, visible=scene.remainder is not None)
        self._named = gui.add_checkbox("names of places", True, visible=bool(names_of_places(scene)))
        gui.add_html(of_arrows(scene))
        gui.add_html(of_places(scene))
        self._slider.on_update(lambda _: self._changed())
        self._magnify.on_update(lambda _: self._changed())
        self._all.on_update(lambda _: self._changed())
        self._after.on_update(lambda _: self._changed())
        self._named.on_update(lambda _: self._puppet.name(self._named.value))
        self._step.on_click(lambda _: self._go(self._step.value))

    def _go(self, where: str) -> None:
        """Go to the row before, to the one behind, or to the one with the largest gap of those not set aside."""
        size = np.where(self.scene.aside, -1.0, np.linalg.norm(self.scene.gap, axis=1))
        row = {BACK: self.row - 1, ON: self.row + 1, WORST: int(np.argmax(size))}[where]
        self._slider.value = min(max(row, 0), len(self.scene.q) - 1) + 1
        self._changed()

    def _changed(self) -> None:
        with self._lock, self._server.atomic():
            self.row, self.magnification = int(self._slider.value) - 1, float(self._magnify.value)
            self._show()

    def _show(self) -> None:
        self._puppet.pose(self.row)
        self._told.content = of_row(self.scene, self.row, self.magnification)
        here, everywhere, after = np.array([self.row]), self._all.value, self._after.value
        for (one, many), shown in zip(self._clouds, (True, after), strict=False):
            one.show(here, self.magnification, shown)
            many.show(self._drawn, self.magnification, shown and everywhere)

    def _add_clouds(self) -> list[tuple[Cloud, Cloud]]:
        """Return the arrows of the row that is shown and those of all rows: before the correction, and after it."""
        scene, nodes = self.scene, self._server.scene
        kinds: list[tuple[str, Array | None, Colour, Colour]] = [
            ("/gap", scene.gap, CHOSEN, GAP),
            ("/after", scene.remainder, CHOSEN_AFTER, REMAINDER),
        ]
        return [
            (
                Cloud(nodes, f"{name}/row", scene, vectors, dark, THICKER),
                Cloud(nodes, f"{name}/all", scene, vectors, pale),
            )
            for name, vectors, dark, pale in kinds
            if vectors is not None
        ]


def _server(label: str, port: int) -> Any:
    """Start to serve an empty scene, to this machine alone."""
    import viser

    with redirect_stdout(io.StringIO()):  # where it says so in its own words
        server: Any = viser.ViserServer(host=HOST, port=port, label=label, verbose=False)
    # viser hands a scene to a public address when a browser asks for it; this one stays here
    vars(server)["request_share_url"] = lambda verbose=True: None
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    return server
