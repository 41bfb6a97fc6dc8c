"""What `thermal-robot correct` writes of the calibrated robot itself: URDF, MJCF, Denavit-Hartenberg, zero offsets."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from thermal_robot.console import note
from thermal_robot.errors import CampaignError
from thermal_robot.files import write_text

if TYPE_CHECKING:
    from thermal_robot.correction import CorrectedModel

OUTPUTS = ("urdf", "mjcf", "dh", "ur_kinematics", "offsets")
"""Options that name a file to write."""
READS = ("from_mjcf",)
"""Options that name a file to read."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options that name files of the calibrated robot, and those that bear on them."""
    parser.add_argument("--urdf", metavar="F", help="write the calibrated robot as a URDF ('-' prints it)")
    parser.add_argument("--mjcf", metavar="F.xml", help="write it as an MJCF for MuJoCo; needs the extra `blind`")
    parser.add_argument("--from-mjcf", metavar="F.xml", help="MJCF of the nominal robot to write --mjcf from")
    parser.add_argument("--dh", metavar="F.csv", help="write its parameters of Denavit and Hartenberg")
    parser.add_argument("--ur-kinematics", metavar="F.yaml", help="write it as Universal Robots' kinematics.yaml")
    parser.add_argument("--modified", action="store_true", help="those of Craig's modified convention")
    parser.add_argument("--offsets", metavar="F.csv", help="write what to add to the commands of each joint's zero")
    parser.add_argument(
        "--min-sigma", metavar="K", type=float, help="leave out what is less than K standard deviations from zero"
    )
    parser.add_argument(
        "--temperature", metavar="C", type=float, help="°C at which lengths hold (default: the campaign's reference)"
    )


_OF_USE_WITH = {
    "from_mjcf": ("mjcf",),
    "modified": ("dh",),
    "min_sigma": OUTPUTS,
    "temperature": OUTPUTS,
}
"""Options that bear on a file of the robot, and with which of :data:`OUTPUTS`."""


def require_of_use(options: argparse.Namespace) -> None:
    """Refuse an option that bears on no file that was asked for.

    Raises
    ------
    CampaignError
        Naming the option, and those with which it is of use.
    """
    for name, outputs in _OF_USE_WITH.items():
        given = getattr(options, name)
        if given is not None and given is not False and not any(getattr(options, output) for output in outputs):
            *some, last = (f"--{output.replace('_', '-')}" for output in outputs)
            listed = f"{', '.join(some)} or {last}" if some else last
            problem = f"is of use with {listed} only"
            raise CampaignError(f"--{name.replace('_', '-')}", problem, expected="one of them, or this option left out")


def outputs(options: argparse.Namespace, model: CorrectedModel) -> list[tuple[str | None, Callable[[Path], object]]]:
    """Return each file that was asked for and what writes it; what they hold is computed here.

    Parameters
    ----------
    options
        Of :func:`add_arguments`.
    model
        The corrected model.

    Raises
    ------
    CampaignError, RobotError
        If one of them cannot be made.
    """
    from thermal_robot import correction as to

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
