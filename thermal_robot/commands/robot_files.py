"""Files of the calibrated robot that `thermal-robot correct` writes: URDF, MJCF, Denavit-Hartenberg, zero offsets."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import thermal_robot.correction as to
from thermal_robot.commands.shared import Output
from thermal_robot.console import note
from thermal_robot.correction import CorrectedModel
from thermal_robot.errors import CampaignError
from thermal_robot.files import write_text

OUTPUTS = ("urdf", "mjcf", "dh", "ur_kinematics", "offsets")
"""Options that name a file to write."""
_OF_USE_WITH = {"from_mjcf": ("mjcf",), "modified": ("dh",), "min_sigma": OUTPUTS, "temperature": OUTPUTS}
"""Options that bear on a file of the robot, and with which of :data:`OUTPUTS`."""


def require_of_use(options: argparse.Namespace) -> None:
    """Refuse an option that affects no requested file."""
    for name, outputs in _OF_USE_WITH.items():
        given = getattr(options, name)
        if given is not None and given is not False and not any(getattr(options, output) for output in outputs):
            *some, last = (f"--{output.replace('_', '-')}" for output in outputs)
            problem = f"is of use with {', '.join(some)} or {last} only" if some else f"is of use with {last} only"
            raise CampaignError(f"--{name.replace('_', '-')}", problem, expected="one of them, or this option left out")


def robot_files(options: argparse.Namespace, model: CorrectedModel) -> list[Output]:
    """Contents of the requested files of the calibrated robot."""
    how = {"temperature": options.temperature, "min_sigma": options.min_sigma}
    robot = to.calibrated(model, **how)
    if robot.beyond:
        note(robot.beyond, options.loudness)
    own = Path(options.from_mjcf) if options.from_mjcf else None
    units = model.settings.units
    made: dict[str, Callable[[], str]] = {
        "urdf": lambda: to.calibrated_urdf(robot),
        "mjcf": lambda: to.calibrated_mjcf(robot, own),
        "dh": lambda: to.dh_table(robot, "modified" if options.modified else "standard", units).to_csv(index=False),
        "ur_kinematics": lambda: to.ur_kinematics(robot),
        "offsets": lambda: to.zero_offsets(model, **how).to_csv(index=False),
    }
    texts = {name: make() for name, make in made.items() if getattr(options, name)}
    return [(getattr(options, name), partial(write_text, text=text)) for name, text in texts.items()]
