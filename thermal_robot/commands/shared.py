"""What several commands have in common: a campaign that is named, a text that is printed, a page that is written."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from thermal_robot.console import QUIET, note, stages
from thermal_robot.errors import CampaignError
from thermal_robot.files import checksum, write_text, written

if TYPE_CHECKING:
    from thermal_robot.campaign import Campaign
    from thermal_robot.correction import CorrectedModel
    from thermal_robot.diagnosis import Diagnosis

CAMPAIGN = "campaign.toml, its folder, or - for standard input (paths in it are then those of the current folder)"


def tell(options: argparse.Namespace, text: str, brief: str = "") -> None:
    """Print the text, or what is left of it where little was asked for; nothing where a file takes its place."""
    said = brief if options.loudness == QUIET else text
    if said and not options.printed:
        print(said)


def deliver(
    options: argparse.Namespace, outputs: Sequence[tuple[str | None, Callable[[Path], object]]], text: str, brief: str
) -> None:
    """Write what was asked for, then tell the text: files come first, who reads what is printed may stop early.

    Raises
    ------
    CampaignError
        Naming the files that could not be written; the others are.
    """
    failed = written(outputs)
    tell(options, text, brief)
    if failed:
        raise CampaignError(", ".join(failed), "cannot be written", found="; ".join(dict.fromkeys(failed.values())))


def read(options: argparse.Namespace) -> Campaign:
    """Read the campaign that was named."""
    from thermal_robot.campaign import read_campaign

    return read_campaign(options.campaign, folder=folder(options))


def folder(options: argparse.Namespace) -> Path | None:
    """Return the folder that a campaign's paths start from where it is not that of its file."""
    return Path() if options.piped else None


def read_from(options: argparse.Namespace) -> list[Path]:
    """Return the files that a campaign is read from."""
    from thermal_robot.campaign.document import read_declaration

    declaration = read_declaration(Path(options.campaign), folder(options))
    robot = [declaration.robot] if isinstance(declaration.robot, Path) else []
    return [declaration.file, declaration.table, *robot]


def diagnosis(options: argparse.Namespace) -> Diagnosis:
    """Diagnose the campaign that was named, telling the stages."""
    from thermal_robot.diagnosis import diagnose

    with stages(options.loudness) as progress:
        progress("reading the campaign")
        return diagnose(read(options), only=options.only, without=options.without, progress=progress)


def page(found: Diagnosis, path: Path, files: Iterable[Path] = ()) -> None:
    """Write the page of a diagnosis; in its footer the hour, and checksums of the files that it was made from."""
    from thermal_robot.report import html

    made_from = {file.name: checksum(file) for file in files if file.is_file()}  # a pipe was read once
    write_text(path, html(found, time.strftime("%Y-%m-%d %H:%M"), made_from))


def told_later(options: argparse.Namespace, model: CorrectedModel, samples: Campaign, file: str) -> None:
    """Say so where the order of a table's rows counts anew, and where the model has not seen their session."""
    if model.counts_anew(samples):
        note(f"order in {Path(file).name} counts its own rows; predicted as after the campaign", options.loudness)
    left = model.spread.outside(samples, model.effects) if model.spread else ()
    for label in model.spread.levels if model.spread else ():
        if any(label in names for names in left):
            note(f"{label} in {Path(file).name}: {_unseen(model, samples, label)}", options.loudness)


def _unseen(model: CorrectedModel, samples: Campaign, label: str) -> str:
    """Say what a model does at labels that it has not seen."""
    known = model.spread.levels[label] if model.spread else ()
    new = sorted({str(own) for own in samples.labels.get(label, ())} - {*known, ""})
    there = f"the model has not seen {', '.join(map(repr, new))}" if new else f"rows do not say which {label} is theirs"
    apart = "std.x std.y std.z hold what these differ by" if len(known) > 1 else "nobody knows how others differ"
    return f"{there}, but {', '.join(map(repr, known))}; predicted as their mean, and {apart}"
