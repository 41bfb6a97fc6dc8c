"""The command ``thermal-robot predict``."""

from __future__ import annotations

import argparse
from pathlib import Path

from thermal_robot.commands.shared import told_later
from thermal_robot.files import require_free, write_one

DOES = "say where the robot will really be, by the corrected model"
EXAMPLE = " model.json samples.csv -o predicted.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot predict``."""
    parser.add_argument("model", help="file that `diagnose --model` wrote, or - for standard input")
    parser.add_argument("samples", help="table with the campaign's columns and units, or - for standard input (CSV)")
    parser.add_argument(
        "-o",
        "--output",
        metavar="F",
        required=True,
        help="table to write, Parquet by its ending ('-' prints it as CSV)",
    )
    parser.add_argument("--noise", action="store_true", help="count the instrument's noise in std.x, std.y, std.z")
    parser.set_defaults(run=run, reads=("model", "samples"), writes=("output",))


def run(options: argparse.Namespace) -> None:
    """Predict a table of samples and write it."""
    from thermal_robot.campaign import read_table, write_predictions
    from thermal_robot.campaign.table import PARQUET
    from thermal_robot.correction import CorrectedModel

    require_free((options.output,), (options.model, options.samples))
    model = CorrectedModel.load(options.model)
    read = read_table(Path(options.samples))
    samples = model.samples(read)
    told_later(options, model, samples, options.samples)
    prediction = model.prediction(samples, noise=options.noise)
    own = read.frame(numbers=Path(options.output).suffix.lower() in PARQUET)
    table = model.predicted(own, prediction)
    write_one(options.output, lambda path: write_predictions(path, table))
