"""The command ``thermal-robot iso9283``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from thermal_robot.commands.shared import CAMPAIGN, deliver, read, read_from
from thermal_robot.files import require_free, write_text

DOES = "tell the performance criteria of ISO 9283 from repeats"
EXAMPLE = " campaign.toml --csv criteria.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot iso9283``."""
    parser.add_argument("campaign", help=CAMPAIGN)
    parser.add_argument("--json", metavar="F", help="write the criteria as JSON ('-' prints it instead of the text)")
    parser.add_argument("--csv", metavar="F", help="write a table, one row a figure, in m and rad ('-' prints it)")
    parser.set_defaults(run=run, reads=("campaign",), writes=("json", "csv"))


def run(options: argparse.Namespace) -> None:
    """Compute the criteria, print them and write what is asked for."""
    import json

    from thermal_robot.campaign import write_predictions
    from thermal_robot.iso9283 import performance

    require_free((options.json, options.csv), read_from(options))
    found = performance(read(options))
    plain = json.dumps(found.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    outputs: list[tuple[str | None, Callable[[Path], object]]] = [
        (options.json, lambda path: write_text(path, plain + "\n")),
        (options.csv, lambda path: write_predictions(path, found.to_frame())),
    ]
    deliver(options, outputs, str(found), found.summary)
