"""The command line: arguments in, exit status out."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thermal_robot.console import NORMAL, QUIET, add_loudness, heard, note, stages
from thermal_robot.errors import CampaignError, ThermalRobotError
from thermal_robot.files import require_free, write_one, write_text, written
from thermal_robot.parser import BAD_INPUT, DONE, FAILED, INTERRUPTED, STATUSES, Parser
from thermal_robot.streams import piped

if TYPE_CHECKING:
    from thermal_robot.campaign import Campaign
    from thermal_robot.diagnosis import Diagnosis

_CAMPAIGN = "campaign.toml, its folder, or - for standard input (paths in it are then those of the current folder)"


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
    with suppress(AttributeError):  # a terminal without this letter or that is no reason to stop
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        if options.run is _diagnose:
            _take_back(options)
        with heard(options.loudness), piped(options):
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


def _parser() -> Parser:
    from thermal_robot import __version__
    from thermal_robot.blind import command as trial  # light: it loads the trial once it is run

    parser = Parser(
        prog="thermal-robot",
        description="Say where the gap between robot and model lies, which effect causes it, how far it shrinks.\n"
        "Begin with the demo. With a campaign of your own: check it, diagnose it, predict with the corrected model.",
        epilog="`thermal-robot COMMAND --help` prints the options of a command.\n"
        f"A file that is `-` is standard input or output; one of that name is `./-`.\n\n{STATUSES}",
    )
    parser.add_argument("-V", "--version", action="version", version=f"thermal-robot {__version__}")
    add_loudness(parser, NORMAL)
    commands = parser.add_subparsers(metavar="COMMAND")
    parser.set_defaults(run=lambda _: parser.bare(commands.choices), reads=(), writes=())

    def command(name: str, does: str, example: str = "") -> Parser:
        again = f"{does[0].upper()}{does[1:]}.\n\nexample:\n  thermal-robot {name}{example}"
        made: Parser = commands.add_parser(name, help=does, description=again)
        add_loudness(made, argparse.SUPPRESS)
        return made

    _demo_arguments(command("demo", "diagnose a campaign that comes with the package, and draw it"))
    _check_arguments(command("check", "validate and describe a campaign; nothing is fitted", " campaign.toml"))
    _effects_arguments(command("effects", "list the effects that are considered, and what each needs"))
    files = " campaign.toml --report diagnosis.html --model model.json"
    _diagnose_arguments(command("diagnose", "say where the gap lies, what causes it, how far it shrinks", files))
    files = " model.json samples.csv -o predicted.csv"
    _predict_arguments(command("predict", "say where the robot will really be, by the corrected model", files))
    _paper_arguments(command("paper", "print the figures of the paper beside the computed ones"))
    blind = command("blind", "run the blind trial: effects are withheld, then named", " --seed 7 --report trial.html")
    trial.add_arguments(blind)
    blind.set_defaults(run=trial.run, writes=("json", "report"))
    return parser


def _demo_arguments(demo: argparse.ArgumentParser) -> None:
    demo.add_argument("--report", metavar="F.html", default="demo.html", help="page to draw (default: %(default)s)")
    demo.set_defaults(run=_demo, writes=("report",), only=(), without=())


def _check_arguments(check: argparse.ArgumentParser) -> None:
    check.add_argument("campaign", help=_CAMPAIGN)
    check.set_defaults(run=_check, reads=("campaign",))


def _effects_arguments(effects: argparse.ArgumentParser) -> None:
    effects.add_argument("campaign", nargs="?", help=f"{_CAMPAIGN}; what it recorded is then not asked for")
    effects.set_defaults(run=_effects, reads=("campaign",))


def _diagnose_arguments(diagnose: argparse.ArgumentParser) -> None:
    diagnose.add_argument("campaign", nargs="?", help=_CAMPAIGN)
    diagnose.add_argument("--json", metavar="F", help="write the diagnosis as JSON ('-' prints it instead of the text)")
    diagnose.add_argument("--report", metavar="F.html", help="write a page with figures ('-' prints it)")
    diagnose.add_argument("--model", metavar="F", help="save the corrected model for `predict` ('-' prints it)")
    choice: dict[str, Any] = {"metavar": "EFFECT", "nargs": "+", "action": "extend", "default": []}
    diagnose.add_argument("--without", **choice, help="leave effects out; `thermal-robot effects` lists their names")
    diagnose.add_argument("--only", **choice, help="consider these only; both options take several names")
    diagnose.set_defaults(run=_diagnose, reads=("campaign",), writes=("json", "report", "model"))


def _predict_arguments(predict: argparse.ArgumentParser) -> None:
    predict.add_argument("model", help="file that `diagnose --model` wrote, or - for standard input")
    predict.add_argument("samples", help="table with the campaign's columns and units, or - for standard input (CSV)")
    predict.add_argument(
        "-o",
        "--output",
        metavar="F",
        required=True,
        help="table to write, Parquet by its ending ('-' prints it as CSV)",
    )
    predict.add_argument("--noise", action="store_true", help="count the instrument's noise in std.x, std.y, std.z")
    predict.set_defaults(run=_predict, reads=("model", "samples"), writes=("output",))


def _paper_arguments(paper: argparse.ArgumentParser) -> None:
    paper.add_argument("--json", metavar="F", help="write the ledger as JSON ('-' prints it instead of the text)")
    paper.add_argument("--l5", metavar="M", type=float, help="wrist to tool point, m (default: 0.150, assumed)")
    paper.add_argument("--markdown", action="store_true", help="print the table of docs/paper.md instead of the text")
    paper.set_defaults(run=_paper, writes=("json",))


def _demo(options: argparse.Namespace) -> None:
    from thermal_robot.datasets import demo_directory

    options.campaign = demo_directory()
    intro = f"The demo's campaign is simulated; its answer lies in {options.campaign / 'truth.json'}."
    found = _diagnosis(options)
    _tell(options, f"{intro}\n\n{found}", found.summary)
    write_one(options.report, lambda path: _page(found, path))
    _tell(options, f"Drawn in {options.report}")


def _check(options: argparse.Namespace) -> None:
    from thermal_robot.campaign import describe

    _tell(options, describe(_read(options)))


def _effects(options: argparse.Namespace) -> None:
    from dataclasses import replace

    from thermal_robot.datasets import demo_campaign
    from thermal_robot.diagnosis import Finding
    from thermal_robot.effects import gate, library
    from thermal_robot.effects.catalogue import random_effects
    from thermal_robot.observations import observe
    from thermal_robot.report.words import needs

    bare = options.campaign is None  # poses and nothing else
    campaign = replace(demo_campaign(), covariates={}, labels={}) if bare else _read(options)
    known, observations = (*library().values(), *random_effects()), observe(campaign)
    wide = max(len(effect.name) for effect in known)
    print("Effects that are considered, and what each needs beside measured poses:" if bare else campaign.name)
    for effect in known:
        missing = gate.missing(effect, observations)
        asked = needs(Finding(effect.name, "not_testable", needs=missing), campaign.robot.joint_names)
        print(f"  {effect.name:{wide}}  {effect.title}{f'; needs {asked}' if asked else ''}")


def _diagnose(options: argparse.Namespace) -> None:
    require_free((options.json, options.model, options.report), _read_from(options))
    found = _diagnosis(options)
    outputs: list[tuple[str | None, Callable[[Path], object]]] = [
        (options.json, found.to_json),
        (options.report, lambda path: _page(found, path)),
        (options.model if found.usable else None, lambda path: found.model.save(path)),
    ]
    # files come first: who reads what is printed may stop early
    failed = written(outputs)
    _tell(options, str(found), found.summary)
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
    read = read_table(Path(options.samples))
    samples = model.samples(read)
    if model.counts_anew(samples):
        note(
            f"order in {Path(options.samples).name} counts its own rows; predicted as after the campaign",
            options.loudness,
        )
    prediction = model.prediction(samples, noise=options.noise)
    own = read.frame(numbers=Path(options.output).suffix.lower() in PARQUET)
    table = model.predicted(own, prediction)
    write_one(options.output, lambda path: write_predictions(path, table))


def _paper(options: argparse.Namespace) -> None:
    import json

    from thermal_robot.paper import PaperInputs, ledger

    found = ledger(PaperInputs() if options.l5 is None else PaperInputs(l5=options.l5))
    if options.json:
        plain = json.dumps(found.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
        write_one(options.json, lambda path: write_text(path, plain + "\n"))
    if not options.printed:
        print(found.markdown() if options.markdown else found.text())


def _tell(options: argparse.Namespace, text: str, brief: str = "") -> None:
    """Print the text, or what is left of it where little was asked for; nothing where a file takes its place."""
    said = brief if options.loudness == QUIET else text
    if said and not options.printed:
        print(said)


def _read(options: argparse.Namespace) -> Campaign:
    from thermal_robot.campaign import read_campaign

    return read_campaign(options.campaign, folder=_folder(options))


def _folder(options: argparse.Namespace) -> Path | None:
    """Return the folder that a campaign's paths start from where it is not that of its file."""
    return Path() if options.piped else None


def _diagnosis(options: argparse.Namespace) -> Diagnosis:
    from thermal_robot.diagnosis import diagnose

    with stages(options.loudness) as progress:
        progress("reading the campaign")
        return diagnose(_read(options), only=options.only, without=options.without, progress=progress)


def _page(found: Diagnosis, path: Path) -> None:
    from thermal_robot.report import html

    write_text(path, html(found, generated=time.strftime("%Y-%m-%d %H:%M")))


def _take_back(options: argparse.Namespace) -> None:
    """Give back a campaign that `--only a b campaign.toml` took for the name of an effect."""
    for names in (options.only, options.without):
        if options.campaign is None and names and (names[-1] == "-" or Path(names[-1]).exists()):
            options.campaign = names.pop()
    if options.campaign is None:
        raise CampaignError("diagnose", "no campaign was named", expected="campaign.toml, or its folder")


def _read_from(options: argparse.Namespace) -> list[Path]:
    """Return the files that a campaign is read from."""
    from thermal_robot.campaign.declaration import read_declaration

    declaration = read_declaration(Path(options.campaign), _folder(options))
    robot = [declaration.robot] if isinstance(declaration.robot, Path) else []
    return [declaration.file, declaration.table, *robot]


if __name__ == "__main__":
    sys.exit(main())
