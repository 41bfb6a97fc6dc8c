"""The command ``thermal-robot diagnose``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from thermal_robot.commands.shared import CAMPAIGN, deliver, diagnosis, page, read_from
from thermal_robot.errors import CampaignError
from thermal_robot.files import require_free

DOES = "say where the gap lies, what causes it, how far it shrinks"
EXAMPLE = " campaign.toml --report diagnosis.html --model model.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot diagnose``."""
    parser.add_argument("campaign", nargs="?", help=CAMPAIGN)
    parser.add_argument("--json", metavar="F", help="write the diagnosis as JSON ('-' prints it instead of the text)")
    parser.add_argument("--report", metavar="F.html", help="write a page with figures ('-' prints it)")
    parser.add_argument("--model", metavar="F", help="save the corrected model for `predict` ('-' prints it)")
    choice: dict[str, Any] = {"metavar": "EFFECT", "nargs": "+", "action": "extend"}
    parser.add_argument(
        "--without", **choice, default=[], help="leave effects out; `thermal-robot effects` lists their names"
    )
    parser.add_argument("--only", **choice, help="consider these only; both options take several names")
    parser.set_defaults(run=run, prepare=take_back, reads=("campaign",), writes=("json", "report", "model"))


def run(options: argparse.Namespace) -> None:
    """Diagnose a campaign, print the result and write what is asked for."""
    files = read_from(options)
    require_free((options.json, options.model, options.report), files)
    found = diagnosis(options)
    outputs: list[tuple[str | None, Callable[[Path], object]]] = [
        (options.json, found.to_json),
        (options.report, lambda path: page(found, path, files)),
        (options.model if found.usable else None, lambda path: found.model.save(path)),
    ]
    deliver(options, outputs, str(found), found.summary)
    if not found.usable:
        raise CampaignError(str(options.campaign), found.reason)


def take_back(options: argparse.Namespace) -> None:
    """Give back a campaign that `--only a b campaign.toml` took for the name of an effect."""
    for names in (options.only, options.without):
        if options.campaign is None and names and (names[-1] == "-" or Path(names[-1]).exists()):
            options.campaign = names.pop()
    if options.campaign is None:
        raise CampaignError("diagnose", "no campaign was named", expected="campaign.toml, or its folder")
