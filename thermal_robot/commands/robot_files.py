"""Files of the calibrated robot that `thermal-robot correct` writes, and what is said of them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

import thermal_robot.correction as to
from thermal_robot.commands.shared import Output
from thermal_robot.console import note
from thermal_robot.correction import CorrectedModel
from thermal_robot.correction.holding import FORMATS, WORTH, expectation
from thermal_robot.correction.zero_files import Motors
from thermal_robot.errors import CampaignError
from thermal_robot.files import write_text

OUTPUTS = tuple(FORMATS)
"""Options that name a file to write."""
_AT_ONE = tuple(name for name in OUTPUTS if name not in ("pal", "lerobot"))
"""Files whose lengths hold at one temperature."""
_OF_USE_WITH = {
    "from_mjcf": ("mjcf",),
    "modified": ("dh",),
    "from_pal": ("pal",),
    "from_lerobot": ("lerobot",),
    "dynamixel": ("lerobot",),
    "min_sigma": OUTPUTS,
    "alone": OUTPUTS,
    "temperature": _AT_ONE,
}
"""Options that bear on a file of the robot, and with which of :data:`OUTPUTS`."""


_MOST = 12
"""Parameters of a kind that are printed: half a screen."""


def require_of_use(options: argparse.Namespace) -> None:
    """Raise CampaignError for an option that affects no requested file, naming those that it is of use with."""
    for name, outputs in _OF_USE_WITH.items():
        given = getattr(options, name)
        if given is not None and given is not False and not any(getattr(options, output) for output in outputs):
            *some, last = (f"--{output.replace('_', '-')}" for output in outputs)
            problem = f"is of use with {', '.join(some)} or {last} only" if some else f"is of use with {last} only"
            raise CampaignError(f"--{name.replace('_', '-')}", problem, expected="one of them, or this option left out")


def robot_files(options: argparse.Namespace, model: CorrectedModel) -> tuple[list[Output], str]:
    """Compute the requested files of the calibrated robot; returns their outputs, and the text that describes them.

    :class:`CampaignError` for options that exclude each other, or without the file that ``--lerobot`` needs.
    """
    if options.alone and (options.min_sigma is not None or options.temperature is not None):
        problem = "takes what was fitted alone, all of it and at the reference temperature"
        raise CampaignError("--alone", problem, expected="neither --min-sigma nor --temperature beside it")
    if options.lerobot and not options.from_lerobot:
        raise CampaignError("--lerobot", "needs the arm's own calibration", expected="--from-lerobot F.json")
    how = {"temperature": options.temperature, "min_sigma": _min_sigma(options, model), "alone": options.alone}
    least = {"min_sigma": how["min_sigma"], "alone": options.alone}
    robot = to.calibrated(model, **how)
    if robot.beyond:
        note(robot.beyond, options.loudness)
    own = Path(options.from_mjcf) if options.from_mjcf else None
    units = model.settings.units
    motors: Motors = "dynamixel" if options.dynamixel else "feetech"
    made: dict[str, Callable[[], str]] = {
        "urdf": lambda: to.calibrated_urdf(robot),
        "mjcf": lambda: to.calibrated_mjcf(robot, own),
        "dh": lambda: to.dh_table(robot, "modified" if options.modified else "standard", units).to_csv(index=False),
        "ur_kinematics": lambda: to.ur_kinematics(robot),
        "joints": lambda: to.joint_parameters(robot),
        "offsets": lambda: to.zero_offsets(model, **how).to_csv(index=False),
        "pal": lambda: to.pal_calibration(model, options.from_pal, **least),
        "lerobot": lambda: to.lerobot_calibration(model, options.from_lerobot, motors=motors, **least),
    }
    texts = {name: make() for name, make in made.items() if getattr(options, name)}
    outputs: list[Output] = [(getattr(options, name), partial(write_text, text=text)) for name, text in texts.items()]
    return outputs, "\n".join([*_of_files(options, robot, texts), *_of_parameters(robot)])


def _min_sigma(options: argparse.Namespace, model: CorrectedModel) -> float | None:
    """Return how many standard deviations from zero a parameter must be to be written; ``None`` writes all.

    As ``--min-sigma`` says, 0 for all; else 2 if the model has covariances; with ``--alone`` always all.
    """
    if options.alone:
        return None
    if options.min_sigma is None:
        return WORTH if model.spread is not None else None
    return options.min_sigma or None


def _of_files(options: argparse.Namespace, robot: to.Calibrated, names: Iterable[str]) -> Iterator[str]:
    for name in names:
        own = FORMATS[name]
        lacks = f"; it cannot hold {own.lacks}" if own.lacks else ""
        yield f"{getattr(options, name)}: {own.title}, holds {own.holds}{lacks}"
        yield from (f"  {said}" for said in expectation(robot.gaps, name, robot.min_sigma, robot.alone))


def _of_parameters(robot: to.Calibrated) -> Iterator[str]:
    """Yield the lines that list parameters worth applying, those left out as too weak, and those no file can hold."""
    if robot.alone:
        return
    worth = f", {robot.min_sigma:g} standard deviations from zero" if robot.min_sigma else ""
    for title, told in (
        (f"worth applying{worth}", robot.held),
        ("left out as too weak (--min-sigma 0 writes them)", robot.undetermined),
        ("in no robot file, but in the model (predict, correct)", robot.kept),
    ):
        if told:
            yield f"{title}: {len(told)}"
            yield from (f"  {each}" for each in told[:_MOST])
            if len(told) > _MOST:
                yield f"  and {len(told) - _MOST} more, which the comment of a URDF lists"
