"""The command ``thermal-robot correct``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from thermal_robot.commands import robot_files
from thermal_robot.commands.shared import told_later
from thermal_robot.errors import CampaignError
from thermal_robot.files import require_free, written

if TYPE_CHECKING:
    from thermal_robot.correction import CorrectedModel

DOES = "correct commands, so that the real tool reaches the nominal poses; write the calibrated robot"
EXAMPLE = " model.json poses.csv -o commands.csv --urdf calibrated.urdf"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot correct``."""
    parser.add_argument("model", help="file that `diagnose --model` wrote, or - for standard input")
    parser.add_argument(
        "poses", nargs="?", help="table of nominal joint positions and conditions, as the campaign's; or - (CSV)"
    )
    parser.add_argument(
        "-o", "--output", metavar="F", help="table to write, with commands in the place of joint positions ('-': CSV)"
    )
    robot_files.add_arguments(parser)
    outputs = ("output", *robot_files.OUTPUTS)
    parser.set_defaults(run=run, reads=("model", "poses", *robot_files.READS), writes=outputs)


def run(options: argparse.Namespace) -> None:
    """Write the corrected commands, and what is asked for of the calibrated robot."""
    from thermal_robot.correction import CorrectedModel

    if bool(options.poses) != bool(options.output):
        raise CampaignError("correct", "poses and -o go together", expected="both, as in poses.csv -o commands.csv")
    named = [options.output, *(getattr(options, name) for name in robot_files.OUTPUTS)]
    if not any(named):
        wanted = "poses.csv -o commands.csv, --urdf, --mjcf, --dh or --offsets"
        raise CampaignError("correct", "nothing to write was named", expected=wanted)
    robot_files.require_of_use(options)
    read = [options.poses, *(getattr(options, name) for name in robot_files.READS)]
    require_free(named, [options.model, *(file for file in read if file)])
    model = CorrectedModel.load(options.model)
    files = robot_files.outputs(options, model) if any(named[1:]) else []
    failed = written([*_commands(options, model), *files])
    if failed:
        raise CampaignError(", ".join(failed), "cannot be written", found="; ".join(dict.fromkeys(failed.values())))


def _commands(options: argparse.Namespace, model: CorrectedModel) -> list[tuple[str | None, Callable[[Path], object]]]:
    """Return the table of commands, where one was asked for, and what writes it."""
    if not options.poses:
        return []
    from thermal_robot.campaign import read_table, write_predictions
    from thermal_robot.campaign.table import PARQUET

    read = read_table(Path(options.poses))
    poses = model.samples(read)
    told_later(options, model, poses, options.poses)
    own = read.frame(numbers=Path(options.output).suffix.lower() in PARQUET)
    table = model.commanded(own, model.corrected_commands(poses))
    return [(options.output, partial(write_predictions, predictions=table))]
