"""The scene in the browser: a thin layer over viser, which is loaded once a window opens."""

from __future__ import annotations

import io
import threading
from collections.abc import Sequence
from contextlib import redirect_stdout
from typing import Any

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.kinematics import rotation_to_quaternion
from thermal_robot.viewer import panel
from thermal_robot.viewer.scene import Cloud, Scene, readable, turned_along
from thermal_robot.viewer.settings import (
    CHOSEN,
    CHOSEN_AFTER,
    FAINT,
    GAP,
    GRID,
    HOST,
    MOST_ARROWS,
    REMAINDER,
    SKY,
    STRONGER,
    THICKER,
    Colour,
)
from thermal_robot.viewer.solids import Puppet, Solid

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
        gui.add_html(panel.of_campaign(scene))
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
        self._named = gui.add_checkbox("names of places", True, visible=bool(panel.names(scene)))
        gui.add_html(panel.of_arrows(scene))
        gui.add_html(panel.of_places(scene))
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
        self._told.content = panel.of_row(self.scene, self.row, self.magnification)
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
