"""Command ``thermal-robot blind``: plan a trial, run it, score it."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from thermal_robot.blind.cases import Case, Kind, RobotChoice
from thermal_robot.console import QUIET, counted, note
from thermal_robot.errors import CampaignError, ThermalRobotError
from thermal_robot.files import require_free, write_one, write_text
from thermal_robot.report.pdf import write_page

if TYPE_CHECKING:
    from thermal_robot.blind.real import RealCase

DOES = "run the blind trial: effects are withheld, then named"
EXAMPLE = " --seed 7 --report trial.html"
KINDS: tuple[str, ...] = get_args(Kind)
ALWAYS = ("single", "null")
"""Kinds of cases that any one effect suffices for."""
DATA = "THERMAL_ROBOT_DATA"
OWN_CASES = 6
"""Number of cases with each fault of the user's own."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the options of ``thermal-robot blind``."""
    parser.add_argument("--seed", metavar="N", type=int, help="everything is drawn from it (default: from the clock)")
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--size", choices=("short", "full"), help="how many cases (default: short)")
    size.add_argument(
        "--count", metavar="KIND=N", nargs="+", action="extend", help="these only; kinds: " + " ".join(KINDS)
    )
    motion = "the trial of motions instead: N servo arms of each fault; of use with --seed, --workers and --json"
    parser.add_argument("--motion", metavar="N", type=int, help=motion)
    parser.add_argument("--robot", metavar="URDF", action="append", default=[], help="your robot; may be repeated")
    parser.add_argument("--tool", metavar="LINK", action="append", default=[], help="link with the target, per --robot")
    several: dict[str, Any] = {"nargs": "+", "action": "extend", "default": []}
    these = "these faults only; without --count " + " and ".join(ALWAYS) + " cases"
    parser.add_argument("--effect", metavar="NAME", help=these, **several)
    parser.add_argument("--fault", metavar="F.py:NAME", help="faults of your own (docs/blind.md)", **several)
    parser.add_argument("--data", metavar="DIR", help=f"folder of real campaigns (default: what {DATA} names)")
    parser.add_argument("--directory", metavar="DIR", help="the trial's folder, to continue it too (default: blind-N)")
    parser.add_argument("--workers", metavar="N", type=int, default=os.cpu_count() or 1, help="(default: %(default)s)")
    parser.add_argument("--json", metavar="F", help="write the score as JSON ('-' prints it instead of the text)")
    parser.add_argument("--report", metavar="F.html", help="write a page with the score, PDF by its ending")
    parser.add_argument("--markdown", action="store_true", help="print the tables of the README instead of the text")
    parser.set_defaults(run=run, writes=("json", "report"), forms={"json": "json", "report": "page"})


def run(options: argparse.Namespace) -> None:
    """Run a trial, print its score and write the requested files.

    Raises
    ------
    ThermalRobotError
        If the options make no sense, or MuJoCo is missing.
    """
    _require("MuJoCo", "the blind trial needs")
    require_free((options.json, options.report))
    if options.workers < 1:
        raise ThermalRobotError("--workers must be at least 1")
    seed = int(time.time()) if options.seed is None else options.seed
    if options.motion is not None:
        _motions(options, seed)
        return
    directory = Path(options.directory or f"blind-{seed}")
    # what is printed instead of the text stands alone on stdout
    notes = sys.stderr if options.markdown or options.printed else sys.stdout

    def tell(text: str) -> None:
        if options.loudness != QUIET:
            print(text, file=notes, flush=True)

    cases = _cases(options, seed, tell)
    if any(case.kind == "fleet" for case in cases):  # it would fail after the last campaign
        _require("pyarrow", "fleets in the trial need")
    tell(f"Seed {seed}: {len(cases)} cases in {directory}")
    from thermal_robot.blind.trial import run_trial

    seal = "Answers sealed before the first diagnosis: sha256"
    try:
        with counted(options.loudness) as progress:
            told: dict[str, Any] = {"progress": progress, "sealed": lambda commitment: tell(f"{seal} {commitment}")}
            records = run_trial(cases, directory, workers=options.workers, **told)
    except KeyboardInterrupt:
        again = f"--seed {seed} --directory {directory}"
        print(f"thermal-robot: stopped; the same command with {again} continues", file=sys.stderr)
        raise SystemExit(1) from None
    _tell(records, options)


def _motions(options: argparse.Namespace, seed: int) -> None:
    from thermal_robot.blind.motions.trial import plan, run, text

    others = ("size", "count", "robot", "effect", "fault", "data", "directory", "report", "markdown")
    given = [f"--{name}" for name in others if getattr(options, name)]
    if options.motion < 1 or given:
        found = ", ".join(given) or str(options.motion)
        raise CampaignError("--motion", "cannot be run so", found=found, expected="a number from 1, and none of these")
    cases = plan(seed, options.motion)
    note(f"Seed {seed}: {len(cases)} arms", options.loudness)
    answers = run(cases, options.workers, lambda one: note(f"{one.case.fault}: {one.verdict}", options.loudness))
    if not options.printed:
        print(text(answers))
    if options.json:
        written = json.dumps([asdict(one) for one in answers], indent=2)
        write_one(options.json, lambda path: write_text(path, written + "\n"))


def _tell(records: list[dict[str, Any]], options: argparse.Namespace) -> None:
    from thermal_robot.blind.report.page import html
    from thermal_robot.blind.report.text import markdown, text
    from thermal_robot.blind.score import score

    withdrawn = [record for record in records if "withdrawn" in record]
    for record in withdrawn:
        note(f"{record['id']} ({record['kind']}) was not asked: {record['withdrawn']}", options.loudness)
    found = score([record for record in records if record not in withdrawn])
    written = json.dumps(found, indent=2, ensure_ascii=False)
    if not options.printed:
        print(markdown(found) if options.markdown else text(found))
    if options.json:
        write_one(options.json, lambda path: write_text(path, written + "\n"))
    if options.report:
        page = html(found, time.strftime("%Y-%m-%d %H:%M"))
        write_one(options.report, lambda path: write_page(path, page, options.report))


def _cases(options: argparse.Namespace, seed: int, tell: Callable[[str], None]) -> tuple[Case | RealCase, ...]:
    from thermal_robot.blind.plan import plan

    counts = _counts(options)
    most_real = counts.pop("real", 0 if options.count else None)
    chosen = _robots(options.robot, options.tool)
    drawn = plan(seed, counts, chosen, tuple(options.effect))
    drawn = _with_faults(drawn, options.fault, seed, chosen)
    if most_real == 0:
        return drawn
    data = options.data or os.environ.get(DATA)
    if not data:
        tell(f"No real campaigns: neither --data nor {DATA} names a folder")
        return drawn
    if not Path(data).is_dir():
        raise CampaignError(data, "there is no such folder of real campaigns")
    from thermal_robot.blind.real import real_cases

    real = real_cases(Path(data), seed, most_real)
    if not real:
        tell(f"No real campaigns: {data} holds none that the trial knows")
    return (*drawn, *real)


def _with_faults(
    cases: tuple[Case, ...], faults: Sequence[str], seed: int, robots: tuple[RobotChoice, ...]
) -> tuple[Case, ...]:
    """Append `OWN_CASES` cases of each user's fault, robots in turn: single if the library has it, else unlisted."""
    if not faults:
        return cases
    from thermal_robot.blind.reality.unlisted import load
    from thermal_robot.effects import library

    rng = np.random.default_rng([seed, 5])
    added: list[Case] = []
    for where in faults:
        name = load(where).name
        listed, (file, _, inside) = name in library(), where.rpartition(":")
        own = f"{Path(file).resolve()}:{inside}"
        for robot in (robots * OWN_CASES)[:OWN_CASES]:
            number, chance = f"o{len(added):04d}", int(rng.integers(2**62))
            case = Case(number, chance, "unlisted", robot, unlisted=name, own=own)
            added.append(replace(case, kind="single", effects=(name,), unlisted=None) if listed else case)
    return (*cases, *added)


def _counts(options: argparse.Namespace) -> dict[str, int]:
    """Return the number of cases by kind, from ``--count``, else of ``--size``; ``real`` only if ``--count`` has it."""
    from thermal_robot.blind.plan import FULL, SHORT

    if not options.count:
        size = FULL if options.size == "full" else SHORT
        return {kind: number for kind, number in size.items() if kind in ALWAYS or not options.effect}
    counts = {}
    for word in options.count:
        kind, _, number = word.partition("=")
        if kind not in KINDS or not number.isdecimal():
            raise ThermalRobotError(f"--count {word}: expected KIND=N, with one of the kinds {', '.join(KINDS)}")
        counts[kind] = int(number)
    return counts


def _robots(urdfs: Sequence[str], tools: Sequence[str]) -> tuple[RobotChoice, ...]:
    from thermal_robot.blind.plan import ROBOTS, robots

    if len(urdfs) != len(tools):
        raise ThermalRobotError(f"each --robot needs its --tool: found {len(urdfs)} and {len(tools)}")
    own = [(Path(urdf.rpartition(":")[2]).stem, urdf, tool) for urdf, tool in zip(urdfs, tools, strict=True)]
    return robots(own or ROBOTS)


def _require(module: str, who: str) -> None:
    from importlib.util import find_spec

    if find_spec(module.lower()) is None:
        raise ThermalRobotError(f'{who} {module}: pip install "thermal-robot[blind]"')
