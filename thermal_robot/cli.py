"""The command line: arguments in, exit status out."""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from thermal_robot.errors import CampaignError, ThermalRobotError
from thermal_robot.files import require_free, write_one, write_text, written

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
_STAGES = 14
"""Stages that a diagnosis tells of: reading, frames, effects, up to three exact fits, five folds, remainder, places."""
_PATIENCE = 2.0
"""s after which a terminal shows the stages: what is over sooner needs no bar."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments
        Of the command line; ``sys.argv`` where absent.

    Returns
    -------
    int
        0 done, 1 a failure of the program or of what it prints to, 2 bad input, 130 interrupted; one line on stderr
        says which.
    """
    options = _parser().parse_args(arguments)
    try:
        options.run(options)
        sys.stdout.flush()  # a disk may be full only now
    except ThermalRobotError as error:
        return _complain(str(error), BAD_INPUT)
    except KeyboardInterrupt:
        return _complain("interrupted; nothing was left half written", INTERRUPTED)
    except BrokenPipeError:
        _let_go()
        return DONE
    except OSError as error:
        _let_go()
        return _complain(f"cannot print: {error.strerror or error}", FAILED)
    return DONE


def _complain(sentence: str, status: int) -> int:
    print(f"thermal-robot: {' '.join(sentence.split())}", file=sys.stderr)
    return status


def _let_go() -> None:
    """Let nothing more be printed: what waits for a reader that left, or for a full disk, would fail once more."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line, as all complaints of this program."""

    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {message}; see {self.prog} --help", file=sys.stderr)
        raise SystemExit(BAD_INPUT)


def _parser() -> argparse.ArgumentParser:
    from thermal_robot import __version__

    parser = _Parser(
        prog="thermal-robot",
        description="Say where the gap between robot and model lies, which effect causes it, how far it shrinks.",
    )
    parser.add_argument("-V", "--version", action="version", version=f"thermal-robot {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    demo = commands.add_parser("demo", help="diagnose a campaign that comes with the package")
    demo.add_argument("--report", metavar="F.html", default="demo.html", help="page to draw (default: %(default)s)")
    demo.set_defaults(run=_demo)

    check = commands.add_parser("check", help="validate and describe a campaign")
    check.add_argument("campaign", help="campaign.toml, or its folder")
    check.set_defaults(run=_check)

    effects = commands.add_parser("effects", help="the effects that are considered, and what each needs")
    effects.add_argument("campaign", nargs="?", help="campaign.toml, or its folder: what it has is not asked for")
    effects.set_defaults(run=_effects)

    _diagnose_arguments(commands.add_parser("diagnose", help="where the gap lies, what causes it, how far it shrinks"))
    _predict_arguments(commands.add_parser("predict", help="the corrected model's prediction for new commands"))
    _paper_arguments(commands.add_parser("paper", help="the paper's figures beside the computed ones"))

    from thermal_robot.blind import command  # light: it loads the trial once it is run

    blind = commands.add_parser("blind", help="the blind trial: effects withheld, then named")
    command.add_arguments(blind)
    blind.set_defaults(run=command.run)
    return parser


def _diagnose_arguments(diagnose: argparse.ArgumentParser) -> None:
    diagnose.add_argument("campaign", nargs="?", help="campaign.toml, or its folder")
    diagnose.add_argument("--json", metavar="F", help="write the diagnosis as JSON ('-' prints it instead of the text)")
    diagnose.add_argument("--report", metavar="F.html", help="write a page with figures")
    diagnose.add_argument("--model", metavar="F", help="save the corrected model for `predict`")
    diagnose.add_argument(
        "--without", metavar="EFFECT", nargs="+", action="extend", default=[], help="leave effects out"
    )
    diagnose.add_argument(
        "--only", metavar="EFFECT", nargs="+", action="extend", default=[], help="consider these only"
    )
    diagnose.set_defaults(run=_diagnose)


def _predict_arguments(predict: argparse.ArgumentParser) -> None:
    predict.add_argument("model", help="file that `diagnose --model` wrote")
    predict.add_argument("samples", help="table with the campaign's columns and units")
    predict.add_argument("-o", "--output", metavar="F", required=True, help="table to write")
    predict.add_argument("--noise", action="store_true", help="count the instrument's noise in std.x, std.y, std.z")
    predict.set_defaults(run=_predict)


def _paper_arguments(paper: argparse.ArgumentParser) -> None:
    paper.add_argument("--json", metavar="F", help="write the ledger as JSON ('-' prints it instead of the text)")
    paper.add_argument("--l5", metavar="M", type=float, help="wrist to tool point, m (default: 0.150, assumed)")
    paper.add_argument("--markdown", action="store_true", help="print the table of docs/paper.md instead of the text")
    paper.set_defaults(run=_paper)


def _demo(options: argparse.Namespace) -> None:
    from thermal_robot.datasets import demo_directory

    campaign = demo_directory()
    print(f"The demo's campaign is simulated; its answer lies in {campaign / 'truth.json'}.\n")
    found = _diagnosis(campaign, (), ())
    print(found)
    write_one(options.report, lambda path: _page(found, path))
    print(f"Drawn in {options.report}")


def _check(options: argparse.Namespace) -> None:
    from thermal_robot.campaign import describe, read_campaign

    print(describe(read_campaign(options.campaign)))


def _effects(options: argparse.Namespace) -> None:
    from dataclasses import replace

    from thermal_robot.campaign import read_campaign
    from thermal_robot.datasets import demo_campaign
    from thermal_robot.diagnosis import Finding
    from thermal_robot.effects import gate, library
    from thermal_robot.effects.catalogue import random_effects
    from thermal_robot.observations import observe
    from thermal_robot.report.words import needs

    bare = options.campaign is None  # poses and nothing else
    campaign = replace(demo_campaign(), covariates={}, labels={}) if bare else read_campaign(options.campaign)
    known, observations = (*library().values(), *random_effects()), observe(campaign)
    wide = max(len(effect.name) for effect in known)
    print("Effects that are considered, and what each needs beside measured poses:" if bare else campaign.name)
    for effect in known:
        missing = gate.missing(effect, observations)
        asked = needs(Finding(effect.name, "not_testable", needs=missing), campaign.robot.joint_names)
        print(f"  {effect.name:{wide}}  {effect.title}{f'; needs {asked}' if asked else ''}")


def _diagnose(options: argparse.Namespace) -> None:
    _take_back(options)
    require_free((options.json, options.model, options.report), _read_from(Path(options.campaign)))
    found = _diagnosis(Path(options.campaign), options.only, options.without)
    outputs: list[tuple[str | None, Callable[[Path], object]]] = [
        (None if options.json == "-" else options.json, found.to_json),
        (options.report, lambda path: _page(found, path)),
        (options.model if found.usable else None, lambda path: found.model.save(path)),
    ]
    # files come first: who reads what is printed may stop early
    failed = written(outputs)
    if options.json == "-":
        import json

        print(json.dumps(found.to_dict(), indent=2, ensure_ascii=False))
    else:
        print(found)
    if failed:
        raise CampaignError(", ".join(failed), "cannot be written", found="; ".join(dict.fromkeys(failed.values())))
    if not found.usable:
        raise CampaignError(str(options.campaign), found.reason)


def _predict(options: argparse.Namespace) -> None:
    from thermal_robot.campaign import read_table, write_predictions
    from thermal_robot.campaign.tabular import PARQUET
    from thermal_robot.correction import CorrectedModel

    require_free((options.output,), (options.model, options.samples))
    model = CorrectedModel.load(options.model)
    samples = model.samples(options.samples)
    if model.counts_anew(samples):
        print(
            f"thermal-robot: note: order in {options.samples} counts its own rows; predicted as after the campaign",
            file=sys.stderr,
        )
    prediction = model.prediction(samples, noise=options.noise)
    own = read_table(Path(options.samples)).frame(numbers=Path(options.output).suffix.lower() in PARQUET)
    table = model.predicted(own, prediction)
    write_one(options.output, lambda path: write_predictions(path, table))


def _paper(options: argparse.Namespace) -> None:
    import json

    from thermal_robot.paper import PaperInputs, ledger

    found = ledger(PaperInputs() if options.l5 is None else PaperInputs(l5=options.l5))
    written = json.dumps(found.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    if options.json and options.json != "-":
        write_one(options.json, lambda path: write_text(path, written + "\n"))
    print(written if options.json == "-" else found.markdown() if options.markdown else found.text())


def _diagnosis(campaign: Path, only: Sequence[str], without: Sequence[str]):  # type: ignore[no-untyped-def]
    from thermal_robot.diagnosis import diagnose

    with _progress() as progress:
        return diagnose(campaign, only=only, without=without, progress=progress)


def _page(found, path: Path) -> None:  # type: ignore[no-untyped-def]
    from thermal_robot.report import html

    write_text(path, html(found, generated=time.strftime("%Y-%m-%d %H:%M")))


def _take_back(options: argparse.Namespace) -> None:
    """Give back a campaign that `--only a b campaign.toml` took for the name of an effect."""
    for names in (options.only, options.without):
        if options.campaign is None and names and Path(names[-1]).exists():
            options.campaign = names.pop()
    if options.campaign is None:
        raise CampaignError("diagnose", "no campaign was named", expected="campaign.toml, or its folder")


def _read_from(campaign: Path) -> list[Path]:
    """Return the files that a campaign is read from."""
    from thermal_robot.campaign.declaration import read_declaration

    declaration = read_declaration(campaign)
    robot = [declaration.robot] if isinstance(declaration.robot, Path) else []
    return [declaration.file, declaration.table, *robot]


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Show the stages on a terminal once it has lasted; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    bar = Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task("", total=_STAGES)
    patience = threading.Timer(_PATIENCE, bar.start)
    patience.daemon = True
    patience.start()
    try:
        yield lambda stage: bar.update(task, description=stage, advance=1)
    finally:
        patience.cancel()
        bar.stop()


if __name__ == "__main__":
    sys.exit(main())
