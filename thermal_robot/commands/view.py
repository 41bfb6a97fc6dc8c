"""The command ``thermal-robot view``."""

from __future__ import annotations

import argparse
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from thermal_robot.commands.shared import CAMPAIGN, diagnosis, read, tell
from thermal_robot.errors import CampaignError
from thermal_robot.viewer.settings import PORT

if TYPE_CHECKING:
    from thermal_robot.viewer.scene import Scene

DOES = "show robot and gap in three dimensions, in the browser"
EXAMPLE = " campaign.toml"
WITH_VIEWER = 'pip install "thermal-robot[viewer]"'
_LAST_PORT = 65535


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot view``."""
    parser.add_argument("campaign", help=CAMPAIGN)
    parser.add_argument("--no-diagnosis", action="store_true", help="show the gap alone, at once")
    free = f"of this machine ({PORT}; the next free one)"
    parser.add_argument("--port", metavar="N", type=port, default=PORT, help=free)
    parser.add_argument("--open", action="store_true", help="open the page in the default browser")
    parser.set_defaults(run=run, reads=("campaign",), writes=(), only=None, without=())


def port(text: str) -> int:
    """Return the number of a port; 0 asks for any that is free."""
    if not text.isascii() or not text.isdigit() or int(text) > _LAST_PORT:
        raise argparse.ArgumentTypeError(f"{text!r} is no port; expected a number from 0, for any, to {_LAST_PORT}")
    return int(text)


def run(options: argparse.Namespace) -> None:
    """Serve the scene until it is interrupted."""
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise CampaignError("view", "the viewer needs viser, which is not installed", expected=WITH_VIEWER) from error
    from thermal_robot.viewer.window import Window, solids

    scene = _scene(options)
    robot = scene.robot
    window = Window(scene, solids(robot.urdf, robot.folder or Path(), scene.size), options.port)
    try:
        tell(options, f"{window.url} shows {scene.title}; Ctrl-C ends it", window.url)
        sys.stdout.flush()  # nothing more is printed for hours
        if options.open:
            import webbrowser

            webbrowser.open(window.url)
        threading.Event().wait()
    finally:
        window.close()


def _scene(options: argparse.Namespace) -> Scene:
    from thermal_robot.viewer.scene import scene_of_campaign, scene_of_diagnosis

    return scene_of_campaign(read(options)) if options.no_diagnosis else scene_of_diagnosis(diagnosis(options))
