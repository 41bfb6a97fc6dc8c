"""Browser window of the scene, on viser, imported on first use."""

from __future__ import annotations

import io
import threading
import warnings
from collections.abc import Iterable, Mapping
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
from thermal_robot.shapes import parsed, placement, visuals
from thermal_robot.viewer import settings
from thermal_robot.viewer.scene import Scene, arrows, readable, turned_along, unit_arrow
from thermal_robot.viewer.settings import Colour, colours

_BOX = "display:inline-block;width:0.8em;height:0.8em;border-radius:0.2em;margin-right:0.5em;background:rgb{}"
_PART = "margin:0 0.8em 0.7em 0.8em;font-size:0.85em;line-height:1.5"


def of_campaign(scene: Scene) -> str:
    """HTML of the campaign's name and description."""
    return _panel([f"<b>{escape(scene.title)}</b>", escape(scene.summary)])


def of_row(scene: Scene, row: int, magnification: float) -> str:
    """HTML of one row, 0..N − 1: its gap, along the axes, after correction, and the magnification of the arrows."""
    gap, cut = scene.gap[row], settings.LONGEST_ARROW * scene.size
    size = float(np.linalg.norm(gap))
    along = ", ".join(f"{axis} {quantity(part, 'm')}" for axis, part in zip("xyz", gap.tolist(), strict=True))
    lines = [
        f"<b>row {scene.rows[row]}</b> of the file{', set aside as an outlier' if scene.aside[row] else ''}",
        f"{_mark(settings.CHOSEN)}gap {quantity(size, 'm')}",
        f"<span style='opacity:0.7'>{along}</span>",
    ]
    if scene.remainder is not None:
        left = quantity(float(np.linalg.norm(scene.remainder[row])), "m")
        lines.append(f"{_mark(settings.CHOSEN_AFTER)}after correction {left}")
    if magnification * size > cut:
        lines.append(f"its arrow is cut at {quantity(cut, 'm')}")
    return _panel([*lines, f"drawn {magnification:g} times as long: 100 µm as {quantity(1e-4 * magnification, 'm')}"])


def of_places(scene: Scene) -> str:
    """HTML legend of the places with colours and shares of the gap, from 0.5 % on, largest first."""
    lines = [
        f"{_mark(colour)}{escape(in_words(*place))}<span style='float:right'>{percent(scene.shares[place])}</span>"
        for place, colour in colours(scene.shares).items()
        if scene.shares[place] >= settings.TOLD
    ]
    return _panel(["<b>Share of the gap by place</b>", *lines]) if lines else ""


def of_arrows(scene: Scene) -> str:
    """HTML legend of the arrow colours."""
    lines = [f"{_mark(settings.CHOSEN)}{_mark(settings.GAP)}gap: measured − predicted, this row and others"]
    if scene.remainder is not None:
        marks = _mark(settings.CHOSEN_AFTER) + _mark(settings.REMAINDER)
        lines.append(f"{marks}after correction: measured − fitted")
    if scene.aside.any():
        lines.append(f"{_mark(settings.ASIDE)}row set aside")
    return _panel(lines)


def names_of_places(scene: Scene) -> dict[tuple[str, str], str]:
    """Labels of the places with a share of the gap of at least 0.5 %: ``joint_3 37.7 %``."""
    return {place: f"{in_words(*place)} {percent(s)}" for place, s in scene.shares.items() if s >= settings.TOLD}


def _panel(lines: Iterable[str]) -> str:
    return f'<div style="{_PART}">{"<br>".join(lines)}</div>'


def _mark(colour: Colour) -> str:
    return f'<span style="{_BOX.format(tuple(colour))}"></span>'


_SHORTEST = 1e-6
"""m: what is shorter has no direction."""


def solids(urdf: str, folder: Path, size: float) -> dict[str, Any]:
    """Geometry of each link, in the order of the URDF, as a ``trimesh.Trimesh`` in its frame, m.

    A link whose meshes are missing is a stick to each joint that it carries; so are all links where none has a shape.
    A :class:`~thermal_robot.errors.Note` names a file. Paths of meshes start from ``folder``; sticks are as thick as
    suits the ``size`` of the scene, m.

    Raises
    ------
    RobotError
        If what the URDF says of shapes cannot be read.
    """
    import trimesh

    robot = parsed(urdf)
    drawn, absent = visuals(robot, folder)
    thin = set(absent) if drawn else {link.name for link in robot.links}
    found = {}
    for link in robot.links:
        parts = drawn.get(link.name, []) + (_sticks(link.name, robot.joints, size) if link.name in thin else [])
        if parts:
            found[link.name] = trimesh.util.concatenate(parts)
    if absent:
        files = [file for named in absent.values() for file in named]
        more = f" and {len(files) - 1} more" if len(files) > 1 else ""
        warnings.warn(Note(f"no mesh can be read from {files[0]!r}{more}; sticks stand in their place"), stacklevel=2)
    return found


def _sticks(link: str, joints: Iterable[Any], size: float) -> list[Any]:
    """Stick figure of a link: knot at its origin, rod to each joint, rail of a slide."""
    import trimesh

    parts = [trimesh.creation.icosphere(subdivisions=2, radius=settings.KNOT * size)]
    for joint in joints:
        start, end = np.zeros(3), np.zeros(3)
        if joint.parent == link:
            end = placement(joint.origin)[:3, 3]
        elif joint.child == link and joint.type == "prismatic" and joint.limit is not None:
            axis = np.asarray(joint.axis, dtype=float) / np.linalg.norm(joint.axis)
            # where the joint's origin comes to lie behind the link, at either limit
            start, end = (-axis * (bound or 0.0) for bound in (joint.limit.lower, joint.limit.upper))
        if np.linalg.norm(end - start) > _SHORTEST:
            parts.append(trimesh.creation.cylinder(settings.STICK * size, segment=[start, end], sections=20))
    return parts


class Puppet:
    """Posable robot as nodes of a viser scene, coloured by the shares of its places (:func:`solids`)."""

    def __init__(self, nodes: Any, scene: Scene, shapes: Mapping[str, Any]) -> None:
        import trimesh

        self._nodes, self._scene, self._shapes, robot = nodes, scene, shapes, scene.robot
        known = colours(scene.shares)
        # what stands still below the first joint is the base, unless it has a share of its own
        standing = robot.chain.parent_links[: robot.chain.movable[0] + 1]
        known = {("link", link): known[("base", "base")] for link in standing if ("base", "base") in known} | known
        self._links = [nodes.add_frame(f"/links/{k}", show_axes=False) for k in range(len(robot.urdf_links))]
        for k, link in enumerate(robot.urdf_links):
            if link in shapes:
                self._add(f"/links/{k}/shape", shapes[link], known.get(("link", link)))
        self._joints = [nodes.add_frame(f"/joints/{j}", show_axes=False) for j in range(robot.n)]
        around = trimesh.creation.torus(settings.RING * scene.size, settings.RING_TUBE * scene.size, 48, 12)
        for j, name in enumerate(robot.joint_names):
            self._add(f"/joints/{j}/ring", around, known.get(("joint", name)))
        radius = settings.POINTER * scene.size
        if np.linalg.norm(scene.target) > radius:
            line = trimesh.creation.cylinder(radius, segment=[np.zeros(3), scene.target], sections=20)
            self._add(f"/links/{robot.urdf_links.index(robot.tool_frame)}/pointer", line, known.get(("tool", "tool")))
        self._names = [self._name(*place, text) for place, text in names_of_places(scene).items()]

    def pose(self, row: int) -> None:
        """Set links and joint rings to the pose of a row, 0..N − 1."""
        poses = self._scene.links(row)
        origins, axes = self._scene.joints(row)
        for node, position, rotation in zip(
            [*self._links, *self._joints],
            [*poses[:, :3, 3], *origins],
            [*poses[:, :3, :3], *turned_along(axes)],
            strict=True,
        ):
            node.position, node.wxyz = position, rotation_to_quaternion(rotation)

    def name(self, shown: bool) -> None:
        """Show or hide the labels of the places."""
        for label in self._names:
            label.visible = shown

    def _name(self, kind: str, name: str, text: str) -> Any:
        robot, at = self._scene.robot, np.zeros(3)
        link = {"link": name, "tool": robot.tool_frame}.get(kind, robot.root_frame)
        if kind == "tool":
            at = self._scene.target
        elif kind == "link" and name in self._shapes:
            at = self._shapes[name].bounds.mean(axis=0)
        joint = kind == "joint"
        node = f"/joints/{robot.joint_names.index(name)}" if joint else f"/links/{robot.urdf_links.index(link)}"
        # a joint lies where a link begins: one name to its left, the other to its right
        anchor = "center-right" if joint else "center-left"
        return self._nodes.add_label(f"{node}/name_{kind}", text, position=at, anchor=anchor)

    def _add(self, name: str, mesh: Any, colour: Colour | None) -> None:
        look = {"color": colour or settings.NO_SHARE, "flat_shading": False}
        self._nodes.add_mesh_simple(name, mesh.vertices, mesh.faces, **look)


class Cloud:
    """Arrows of displacements (N, 3), m, root frame, from the predicted positions: one viser node.

    Rows that were set aside are grey, the others of the ``colour``; all are so many times ``thicker`` than usual.
    """

    def __init__(
        self, nodes: Any, name: str, scene: Scene, vectors: Array, colour: Colour, thicker: float = 1.0
    ) -> None:
        self._nodes, self._name, self._scene, self._vectors, self._thicker = nodes, name, scene, vectors, thicker
        self._colours = settings.linear(np.where(scene.aside[:, None], settings.ASIDE, colour))
        self._node: Any = None

    def show(self, rows: NDArray[np.intp], magnification: float, visible: bool) -> None:
        """Draw the arrows of ``rows``, of which there are the same number at each call, or hide them."""
        scene = self._scene
        turns, stretches = arrows(self._vectors[rows], magnification, scene.size, self._thicker)
        drawn: dict[str, Any] = {"batched_positions": scene.predicted[rows], "batched_wxyzs": turns}
        drawn |= {"batched_scales": stretches, "batched_colors": self._colours[rows]}
        if self._node is None:
            mesh, flat = unit_arrow(), {"cast_shadow": False, "receive_shadow": False, "lod": "off"}
            self._node = self._nodes.add_batched_meshes_simple(self._name, mesh.vertices, mesh.faces, **drawn, **flat)
        for name, values in drawn.items():
            setattr(self._node, name, values)
        self._node.visible = visible


BACK, ON, WORST = "previous", "next", "largest gap"


class Window:
    """Server of a scene's browser view on the loopback address, with controls, until closed.

    Shapes of links are as :func:`solids` returns them. The next free port is taken where ``port`` is; 0 asks for any.
    """

    def __init__(self, scene: Scene, shapes: Mapping[str, Any], port: int) -> None:
        self.scene, self.row, self.magnification = scene, 0, readable(scene.gap, scene.size)
        count = len(scene.q)
        self._drawn = np.unique(np.linspace(0, count - 1, min(count, settings.MOST_ARROWS)).astype(int))
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
        """Address of the server."""
        return f"http://{settings.HOST}:{self._server.get_port()}"

    def close(self) -> None:
        """Stop the server."""
        with redirect_stdout(io.StringIO()):
            self._server.stop()

    def _look(self) -> None:
        """Set up direction, initial camera, light and floor grid."""
        scene, nodes = self.scene, self._server.scene
        nodes.set_up_direction(tuple(scene.up))
        camera = self._server.initial_camera
        camera.look_at, camera.position = tuple(scene.centre), tuple(scene.eye)
        nodes.configure_environment_map(environment_intensity=settings.SKY)
        wide, level = settings.GRID * scene.size, rotation_to_quaternion(turned_along(scene.up[None])[0])
        cells = {"cell_size": 0.5, "section_size": 1.0, "cell_color": settings.FAINT, "section_color": settings.FAINT}
        nodes.add_grid("/floor", width=wide, height=wide, wxyz=level, **cells)

    def _add_clouds(self) -> list[tuple[Cloud, Cloud]]:
        """Arrows of the current row and of all rows, before and after the correction."""
        scene, nodes = self.scene, self._server.scene
        kinds = [("/gap", scene.gap, settings.CHOSEN, settings.GAP)]
        if scene.remainder is not None:
            kinds.append(("/after", scene.remainder, settings.CHOSEN_AFTER, settings.REMAINDER))
        return [
            (
                Cloud(nodes, f"{name}/row", scene, vectors, dark, settings.THICKER),
                Cloud(nodes, f"{name}/all", scene, vectors, pale),
            )
            for name, vectors, dark, pale in kinds
        ]

    def _add_controls(self) -> None:
        gui, scene, count = self._server.gui, self.scene, len(self.scene.q)
        gui.add_html(of_campaign(scene))
        hint = "in the order of the table"
        self._slider = gui.add_slider("measurement", 1, max(count, 2), 1, 1, visible=count > 1, hint=hint)
        self._step = gui.add_button_group("step", (BACK, ON, WORST), visible=count > 1)
        start, least = self.magnification, self.magnification / settings.STRONGER
        self._magnify = gui.add_slider("magnified", least, settings.STRONGER * start, least, start)
        self._told = gui.add_html("")
        self._all = gui.add_checkbox("gaps of all rows", True)
        self._after = gui.add_checkbox("after correction", False, visible=scene.remainder is not None)
        self._named = gui.add_checkbox("names of places", True, visible=bool(names_of_places(scene)))
        gui.add_html(of_arrows(scene))
        gui.add_html(of_places(scene))
        for control in (self._slider, self._magnify, self._all, self._after):
            control.on_update(lambda _: self._changed())
        self._named.on_update(lambda _: self._puppet.name(self._named.value))
        self._step.on_click(lambda _: self._go(self._step.value))

    def _go(self, where: str) -> None:
        """Go to the previous or next row, or to the one with the largest gap that is no outlier."""
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


def _server(label: str, port: int) -> Any:
    """Start the server of an empty scene, on the loopback address."""
    import viser

    with redirect_stdout(io.StringIO()):  # where it says so in its own words
        server: Any = viser.ViserServer(host=settings.HOST, port=port, label=label, verbose=False)
    # viser hands a scene to a public address when a browser asks for it; this one stays here
    vars(server)["request_share_url"] = lambda verbose=True: None
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    return server
