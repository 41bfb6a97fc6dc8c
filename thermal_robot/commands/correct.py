"""The command ``thermal-robot correct``."""

from __future__ import annotations

import argparse

from thermal_robot.commands import robot_files
from thermal_robot.errors import CampaignError
from thermal_robot.files import require_free, written

DOES = "write the calibrated robot: URDF, MJCF, Denavit-Hartenberg, zero offsets"
EXAMPLE = " model.json --urdf calibrated.urdf --offsets offsets.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot correct``."""
    parser.add_argument("model", help="file that `diagnose --model` wrote, or - for standard input")
    robot_files.add_arguments(parser)
    parser.set_defaults(run=run, reads=("model", *robot_files.READS), writes=robot_files.OUTPUTS)


def run(options: argparse.Namespace) -> None:
    """Write what is asked for of the calibrated robot."""
    from thermal_robot.correction import CorrectedModel

    named = [getattr(options, name) for name in robot_files.OUTPUTS]
    if not any(named):
        raise CampaignError("correct", "nothing to write was named", expected="--urdf, --mjcf, --dh or --offsets")
    read = [getattr(options, name) for name in robot_files.READS]
    require_free(named, [options.model, *(file for file in read if file)])
    model = CorrectedModel.load(options.model)
    failed = written(robot_files.outputs(options, model))
    if failed:
        raise CampaignError(", ".join(failed), "cannot be written", found="; ".join(dict.fromkeys(failed.values())))
