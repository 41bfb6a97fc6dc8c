"""Commands that take several campaigns: compare, wear, fleet."""

from __future__ import annotations

import argparse
from pathlib import Path

from thermal_robot.commands.shared import as_json, as_page, deliver, read_from
from thermal_robot.console import counted, stages
from thermal_robot.errors import CampaignError
from thermal_robot.files import require_free
from thermal_robot.report import comparison_html, fleet_html, fleet_text, wear_html

PAGE, SUMMARY = "fleet.html", "fleet.json"


def compare(options: argparse.Namespace) -> None:
    """Run ``compare``: compare campaigns, models or logs of motion, print the result and write the requested files."""
    from thermal_robot.diagnosing import compare
    from thermal_robot.fleet.compare_sums import is_model
    from thermal_robot.motion.read import declares_motion, files_of

    motion = [declares_motion(Path(one)) for one in options.campaigns]
    if any(motion) and options.report:
        raise CampaignError("compare", "there is no page of motion compared", column="--report", expected="--json")
    inputs = files_of if all(motion) else lambda one: [Path(one)] if is_model(one) else read_from(one)
    files = [file for one in options.campaigns for file in inputs(one)]
    require_free((options.json, options.report), files)
    with stages(options.loudness) as progress:
        found = compare(*options.campaigns, only=options.only, without=options.without, progress=progress)
    page = as_page(options.report, comparison_html, found.to_dict(), files)
    deliver(options, [(options.json, found.to_json), page], str(found), found.summary)


def wear(options: argparse.Namespace) -> None:
    """Run ``wear``: find changes of one robot's parameters over campaigns in order of time, print and write them."""
    from thermal_robot.fleet.wear import wear

    files = [file for one in options.campaigns for file in read_from(one)]
    require_free((options.json, options.report), files)
    asked = {} if options.false_alarm is None else {"false_alarm": options.false_alarm}
    limits = dict(_limit(text) for text in options.limit)
    with stages(options.loudness) as progress:
        told = {"dates": options.dates, "limits": limits, "effects": options.only, "progress": progress}
        found = wear(options.campaigns, **told, **asked)
    page = as_page(options.report, wear_html, found, files)
    deliver(options, [(options.json, found.to_json), page], str(found), found.summary)


def _limit(text: str) -> tuple[str, float]:
    effect, _, value = text.partition("=")
    try:
        return effect.strip(), float(value)
    except ValueError:
        kind = "EFFECT=VALUE, SI, such as backlash=5e-4"
        raise CampaignError("wear", "is no limit", column="--limit", found=repr(text), expected=kind) from None


def fleet(options: argparse.Namespace) -> None:
    """Run ``fleet``: diagnose the campaigns, print the summary, and write table, page and summary."""
    from thermal_robot.fleet.many import diagnose_many

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
    text = fleet_text(found)
    page = as_page(str(folder / PAGE), lambda told, when, _: fleet_html(told, when), found)
    deliver(options, [as_json(str(folder / SUMMARY), found), page], text, text.splitlines()[0])
