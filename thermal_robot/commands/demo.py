"""The command ``thermal-robot demo``."""

from __future__ import annotations

import argparse

from thermal_robot.commands.shared import diagnosis, page, tell
from thermal_robot.files import write_one

DOES = "diagnose a campaign that comes with the package, and draw it"
EXAMPLE = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot demo``."""
    parser.add_argument("--report", metavar="F.html", default="demo.html", help="page to draw (default: %(default)s)")
    parser.set_defaults(run=run, writes=("report",), only=None, without=())


def run(options: argparse.Namespace) -> None:
    """Diagnose the demo's campaign, print it and draw it."""
    from thermal_robot.datasets import demo_directory

    options.campaign = demo_directory()
    intro = f"The demo's campaign is simulated; its answer lies in {options.campaign / 'truth.json'}."
    found = diagnosis(options)
    tell(options, f"{intro}\n\n{found}", found.summary)
    write_one(options.report, lambda path: page(found, path))
    tell(options, f"Drawn in {options.report}")
