"""The command ``thermal-robot fleet``."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

from thermal_robot.commands.shared import deliver
from thermal_robot.console import counted
from thermal_robot.files import write_text
from thermal_robot.fleet import settings

DOES = "diagnose many campaigns: what is wrong with which robot, and what several share"
EXAMPLE = " campaigns --out fleet --labels hall robot"
PAGE, SUMMARY = "fleet.html", "fleet.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot fleet``."""
    parser.add_argument(
        "source", metavar="FOLDER|LIST", help="every campaign.toml below it; or CSV or TOML with paths and labels"
    )
    parser.add_argument("-o", "--out", metavar="DIR", required=True, help="folder of table and page, made if need be")
    parser.add_argument(
        "--labels", metavar="NAME", nargs="+", default=[], help="what the levels of folders are, from the top"
    )
    parser.add_argument("--workers", metavar="N", type=int, help="processes on this machine (default: one a core)")
    limit = settings.TIME_LIMIT / 60.0
    parser.add_argument(
        "--time-limit", metavar="MINUTES", type=float, default=limit, help=f"for each campaign (default: {limit:.0f})"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask on a cluster, instead of processes here")
    choice: dict[str, Any] = {"metavar": "EFFECT", "nargs": "+", "action": "extend"}
    parser.add_argument("--without", **choice, default=[], help="leave effects out")
    parser.add_argument("--only", **choice, help="consider these only")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Diagnose the campaigns, print what they have in common, and write table, page and summary."""
    from thermal_robot.fleet.many import diagnose_many
    from thermal_robot.report import fleet_html, fleet_text

    with counted(options.loudness) as progress:
        fleet = diagnose_many(
            options.source,
            options.out,
            labels=options.labels,
            only=options.only,
            without=options.without,
            workers=options.workers,
            scheduler=options.scheduler,
            time_limit=60.0 * options.time_limit,
            progress=progress,
        )
    found, folder = fleet.summary.to_dict(), Path(options.out)
    plain = json.dumps(found, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    page = fleet_html(found, time.strftime("%Y-%m-%d %H:%M"))
    deliver(
        options,
        [
            (str(folder / SUMMARY), lambda path: write_text(path, plain)),
            (str(folder / PAGE), lambda path: write_text(path, page)),
        ],
        fleet_text(found),
        fleet_text(found).splitlines()[0],
    )
