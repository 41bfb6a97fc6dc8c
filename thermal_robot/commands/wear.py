"""The command ``thermal-robot wear``."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from thermal_robot.commands.shared import deliver, read_from
from thermal_robot.console import stages
from thermal_robot.errors import CampaignError
from thermal_robot.files import checksum, require_free, write_text

DOES = "follow one robot over time: what moves, at once or steadily, how fast, and when it crosses a limit"
EXAMPLE = " january march june --dates 2026-01-12 2026-03-02 2026-06-08 --limit backlash=5e-4"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot wear``."""
    parser.add_argument(
        "campaigns", nargs="+", metavar="CAMPAIGN", help="campaign.toml or its folder, three or more, in order of time"
    )
    parser.add_argument(
        "--dates", nargs="+", metavar="DATE", help="of each campaign, 2026-03-01; without them no rate is told"
    )
    parser.add_argument(
        "--limit", action="append", default=[], metavar="EFFECT=VALUE", help="of its parameters, SI; may be repeated"
    )
    parser.add_argument("--only", nargs="+", metavar="EFFECT", help="consider these effects, and the zeros of joints")
    parser.add_argument(
        "--false-alarm", type=float, metavar="P", help="share of series without a change that may ring at all (0.01)"
    )
    parser.add_argument("--json", metavar="F", help="write the result as JSON ('-' prints it instead of the text)")
    parser.add_argument("--report", metavar="F.html", help="write a page with figures ('-' prints it)")
    parser.set_defaults(run=run, writes=("json", "report"))


def run(options: argparse.Namespace) -> None:
    """Follow the robot, print what moved and write what is asked for."""
    from thermal_robot.fleet.wear import wear
    from thermal_robot.report import wear_html

    files = [file for one in options.campaigns for file in read_from(_one(one))]
    require_free((options.json, options.report), files)
    asked = {} if options.false_alarm is None else {"false_alarm": options.false_alarm}
    with stages(options.loudness) as progress:
        found = wear(
            options.campaigns,
            dates=options.dates,
            limits=dict(_limit(text) for text in options.limit),
            effects=options.only,
            progress=progress,
            **asked,
        )

    def page(path: Path) -> None:
        sums = {str(file): checksum(file) for file in dict.fromkeys(files) if file.is_file()}
        write_text(path, wear_html(found, time.strftime("%Y-%m-%d %H:%M"), sums))

    outputs: list[tuple[str | None, Callable[[Path], object]]] = [(options.json, found.to_json), (options.report, page)]
    deliver(options, outputs, str(found), found.summary)


def _one(campaign: str) -> argparse.Namespace:
    return argparse.Namespace(campaign=campaign, piped=False)


def _limit(text: str) -> tuple[str, float]:
    effect, _, value = text.partition("=")
    try:
        return effect.strip(), float(value)
    except ValueError:
        raise CampaignError(
            "wear",
            "is no limit",
            column="--limit",
            found=repr(text),
            expected="EFFECT=VALUE, SI, such as backlash=5e-4",
        ) from None
