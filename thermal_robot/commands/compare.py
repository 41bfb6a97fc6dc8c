"""The command ``thermal-robot compare``."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from thermal_robot.commands.shared import deliver
from thermal_robot.console import stages
from thermal_robot.errors import CampaignError
from thermal_robot.files import checksum, require_free, write_text

DOES = "say what campaigns or models of one robot share, and what changed between them"
EXAMPLE = " january june december --report compared.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot compare``."""
    parser.add_argument(
        "campaigns",
        nargs="*",
        metavar="campaign",
        help="two or more in order of time: campaign.toml, its folder, or a model",
    )
    parser.add_argument("--json", metavar="F", help="write the comparison as JSON ('-' prints it instead of the text)")
    parser.add_argument("--report", metavar="F.html", help="write a page with figures ('-' prints it)")
    choice: dict[str, Any] = {"metavar": "EFFECT", "nargs": "+", "action": "extend"}
    parser.add_argument("--without", **choice, default=[], help="leave effects out")
    parser.add_argument("--only", **choice, help="consider these only")
    parser.set_defaults(run=run, prepare=take_back, writes=("json", "report"))


def run(options: argparse.Namespace) -> None:
    """Compare campaigns, print the result and write what is asked for."""
    from thermal_robot.campaign.document import read_declaration
    from thermal_robot.fleet.compare import compare
    from thermal_robot.fleet.compare_sums import is_model
    from thermal_robot.report import comparison_html

    files: list[Path] = []
    for campaign in options.campaigns:
        if is_model(campaign):
            files.append(Path(campaign))
            continue
        declaration = read_declaration(Path(campaign))
        robot = [declaration.robot] if isinstance(declaration.robot, Path) else []
        files += [declaration.file, declaration.table, *robot]
    require_free((options.json, options.report), files)
    with stages(options.loudness) as progress:
        found = compare(*options.campaigns, only=options.only, without=options.without, progress=progress)

    def page(path: Path) -> None:
        made_from = {str(file): checksum(file) for file in dict.fromkeys(files) if file.is_file()}
        write_text(path, comparison_html(found.to_dict(), time.strftime("%Y-%m-%d %H:%M"), made_from))

    outputs: list[tuple[str | None, Callable[[Path], object]]] = [(options.json, found.to_json), (options.report, page)]
    deliver(options, outputs, str(found), found.summary)


def take_back(options: argparse.Namespace) -> None:
    """Give back campaigns that `--only a b folder` took for names of effects."""
    for names in (options.only, options.without):
        while names and Path(names[-1]).exists():
            options.campaigns.append(names.pop())
    if len(options.campaigns) < 2:
        raise CampaignError(
            "compare", "nothing to compare with", found=f"{len(options.campaigns)}", expected="two campaigns or more"
        )
