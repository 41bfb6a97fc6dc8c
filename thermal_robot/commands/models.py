"""Commands that take a corrected model: predict, correct; the files of the calibrated robot."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import thermal_robot.correction as to
from thermal_robot.campaign import Campaign, read_table, write_predictions
from thermal_robot.campaign.table import TYPED
from thermal_robot.commands.shared import Output, deliver
from thermal_robot.console import note
from thermal_robot.correction import CorrectedModel
from thermal_robot.correction.holding import FORMATS, WORTH, at_poses, expectation
from thermal_robot.correction.zero_files import Motors
from thermal_robot.errors import CampaignError
from thermal_robot.files import require_free, write_text
from thermal_robot.percents import percent
from thermal_robot.prediction import FileGap

if TYPE_CHECKING:
    import pandas as pd

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


def predict(options: argparse.Namespace) -> None:
    """Run ``predict``: write a table of samples with the positions that a corrected model predicts."""
    require_free((options.output,), (options.model, options.samples))
    model = CorrectedModel.load(options.model)

    def filled(own: pd.DataFrame, samples: Campaign) -> pd.DataFrame:
        return model.predicted(own, model.prediction(samples, noise=options.noise))

    deliver(options, [_table(options, model, options.samples, filled)])


def correct(options: argparse.Namespace) -> None:
    """Run ``correct``: write corrected commands and files of the calibrated robot."""
    if bool(options.poses) != bool(options.output):
        raise CampaignError("correct", "poses and -o go together", expected="both, as in poses.csv -o commands.csv")
    named = [options.output, *(getattr(options, name) for name in OUTPUTS)]
    if not any(named):
        wanted = "poses.csv -o commands.csv, --urdf, --offsets or another file of the robot"
        raise CampaignError("correct", "nothing to write was named", expected=wanted)
    _require_of_use(options)
    given = (options.model, options.poses, options.from_mjcf, options.from_pal, options.from_lerobot)
    require_free(named, [file for file in given if file])
    model = CorrectedModel.load(options.model)
    there: tuple[tuple[FileGap, ...], str] = (), ""

    def filled(own: pd.DataFrame, poses: Campaign) -> pd.DataFrame:
        nonlocal there
        if model.spread and any(named[1:]):
            away = sum(map(bool, model.spread.outside(poses, model.effects))) / poses.samples
            there = at_poses(model, poses), f"{options.poses}, {percent(away)} of them outside what was measured"
        return model.commanded(own, model.corrected_commands(poses))

    table = [_table(options, model, options.poses, filled)] if options.poses else []
    files, said = _robot_files(options, model, there) if any(named[1:]) else ([], "")
    deliver(options, [*table, *files], said)


def _table(
    options: argparse.Namespace,
    model: CorrectedModel,
    file: str,
    filled: Callable[[pd.DataFrame, Campaign], pd.DataFrame],
) -> Output:
    """Return the output that writes a file's table completed by ``filled`` with predictions or commands."""
    read = read_table(Path(file))
    samples = model.samples(read)
    _tell_unseen(options, model, samples, Path(file).name)
    own = read.frame(numbers=Path(options.output).suffix.lower() in TYPED)
    return options.output, partial(write_predictions, predictions=filled(own, samples))


def _tell_unseen(options: argparse.Namespace, model: CorrectedModel, samples: Campaign, file: str) -> None:
    """Print a note if samples restart the order of rows, follow it, or lack or have new levels of a label."""
    if model.counts_anew(samples):
        note(f"order in {file} counts its own rows; predicted as after the campaign", options.loudness)
    if model.follows_rows(samples):
        note("a law follows the order of the campaign's rows; predicted as after the campaign", options.loudness)
    left = model.spread.outside(samples, model.effects) if model.spread else ()
    for label, levels in model.spread.levels.items() if model.spread else ():
        if not any(label in names for names in left):
            continue
        new = sorted({str(own) for own in samples.labels.get(label, ())} - {*levels, ""})
        unseen = f"the model has not seen {', '.join(map(repr, new))}"
        there = unseen if new else f"rows do not say which {label} is theirs"
        apart = "std.x std.y std.z hold what these differ by" if len(levels) > 1 else "nobody knows how others differ"
        known = ", ".join(map(repr, levels))
        note(f"{label} in {file}: {there}, but {known}; predicted as their mean, and {apart}", options.loudness)


def _require_of_use(options: argparse.Namespace) -> None:
    """Raise CampaignError for an option that affects no requested file, naming those that it is of use with."""
    for name, outputs in _OF_USE_WITH.items():
        given = getattr(options, name)
        if given is not None and given is not False and not any(getattr(options, output) for output in outputs):
            *some, last = (f"--{output.replace('_', '-')}" for output in outputs)
            problem = f"is of use with {', '.join(some)} or {last} only" if some else f"is of use with {last} only"
            raise CampaignError(f"--{name.replace('_', '-')}", problem, expected="one of them, or this option left out")


def _robot_files(
    options: argparse.Namespace, model: CorrectedModel, there: tuple[Sequence[FileGap], str]
) -> tuple[list[Output], str]:
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
    return outputs, "\n".join([*_of_files(options, robot, texts, there), *_of_parameters(robot)])


def _min_sigma(options: argparse.Namespace, model: CorrectedModel) -> float | None:
    """Return how many standard deviations from zero a parameter must be to be written; ``None`` writes all.

    As ``--min-sigma`` says, 0 for all; else 2 if the model has covariances; with ``--alone`` always all.
    """
    if options.alone:
        return None
    if options.min_sigma is None:
        return WORTH if model.spread is not None else None
    return options.min_sigma or None


def _of_files(
    options: argparse.Namespace, robot: to.Calibrated, names: Iterable[str], there: tuple[Sequence[FileGap], str]
) -> Iterator[str]:
    for name in names:
        own = FORMATS[name]
        lacks = f"; it cannot hold {own.lacks}" if own.lacks else ""
        yield f"{getattr(options, name)}: {own.title}, holds {own.holds}{lacks}"
        yield from (f"  {said}" for said in expectation(robot.gaps, name, robot.min_sigma, robot.alone))
        yield from (f"  {said}" for said in expectation(there[0], name, robot.min_sigma, robot.alone, there[1]))


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
