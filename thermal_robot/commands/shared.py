"""Shared parts of commands: reading a campaign, printing a text, writing a page."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from thermal_robot.campaign import Campaign, read_campaign
from thermal_robot.campaign.document import read_declaration
from thermal_robot.console import QUIET
from thermal_robot.errors import CampaignError
from thermal_robot.files import checksum, write_text, written
from thermal_robot.report.pdf import write_page

Output = tuple[str | None, Callable[[Path], object]]
"""A file that was asked for, if it was, and what writes it."""


def tell(options: argparse.Namespace, text: str, brief: str = "") -> None:
    """Print a text, or its short form under ``-q``; nothing where a requested file goes to standard output instead."""
    said = brief if options.loudness == QUIET else text
    if said and not options.printed:
        print(said)


def deliver(options: argparse.Namespace, outputs: Sequence[Output], text: str = "", brief: str = "") -> None:
    """Write the requested files, then print the text, as the reader of a pipe may stop early.

    Raises
    ------
    CampaignError
        Naming the files that could not be written; the others are.
    """
    failed = written(outputs)
    tell(options, text, brief)
    if failed:
        raise CampaignError(", ".join(failed), "cannot be written", found="; ".join(dict.fromkeys(failed.values())))


def as_json(target: str | None, plain: Any) -> Output:
    """Output (file name, writer) of plain values as indented JSON; ValueError for NaN or infinity."""
    text = json.dumps(plain, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    return target, lambda path: write_text(path, text)


def as_page(
    target: str | None,
    render: Callable[..., str],
    found: Any,
    files: Iterable[Path] = (),
    name: Callable[..., str] = str,
) -> Output:
    """Output (file name, writer) of an HTML or PDF page, with time and SHA-256 of its input files in the footer."""

    def write(path: Path) -> None:
        # a pipe was read once, and is no file
        made_from = {name(file): checksum(file) for file in dict.fromkeys(files) if file.is_file()}
        write_page(path, render(found, time.strftime("%Y-%m-%d %H:%M"), made_from), target)

    return target, write


def read(options: argparse.Namespace) -> Campaign:
    """Read the named campaign; on standard input its paths are relative to the current folder."""
    return read_campaign(options.campaign, folder=Path() if options.piped else None)


def read_from(campaign: str | Path, folder: Path | None = None) -> list[Path]:
    """Input files of a campaign: its declaration, its table and, where it names a file, its URDF."""
    return read_declaration(Path(campaign), folder).files
