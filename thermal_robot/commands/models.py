"""Commands that take a corrected model: predict, correct."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from thermal_robot.campaign import Campaign, read_table, write_predictions
from thermal_robot.campaign.table import TYPED
from thermal_robot.commands.robot_files import OUTPUTS, require_of_use, robot_files
from thermal_robot.commands.shared import Output, deliver
from thermal_robot.console import note
from thermal_robot.correction import CorrectedModel
from thermal_robot.errors import CampaignError
from thermal_robot.files import require_free

if TYPE_CHECKING:
    import pandas as pd


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
    require_of_use(options)
    given = (options.model, options.poses, options.from_mjcf, options.from_pal, options.from_lerobot)
    require_free(named, [file for file in given if file])
    model = CorrectedModel.load(options.model)

    def filled(own: pd.DataFrame, poses: Campaign) -> pd.DataFrame:
        return model.commanded(own, model.corrected_commands(poses))

    table = [_table(options, model, options.poses, filled)] if options.poses else []
    files, said = robot_files(options, model) if any(named[1:]) else ([], "")
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
