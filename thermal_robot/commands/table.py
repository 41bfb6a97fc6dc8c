"""Table of all commands: description, example, options, action.

The table is light: what a command computes with is imported once it runs.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from thermal_robot.blind import command as blind
from thermal_robot.campaign.importers.plan import Format
from thermal_robot.campaign.importers.run import FORMATS
from thermal_robot.campaign.names import BESIDE
from thermal_robot.campaign.units import ANGLE_UNITS, LENGTH_UNITS
from thermal_robot.errors import CampaignError
from thermal_robot.fleet.settings import TIME_LIMIT
from thermal_robot.motion.importers import MOTION_FORMATS, MotionFormat
from thermal_robot.viewer.settings import PORT

_LAST_PORT = 65535


class Option(NamedTuple):
    """Arguments of ``add_argument`` for one option; ``stream`` ``in`` or ``out`` for a file that may be ``-``."""

    names: tuple[str, ...]
    how: dict[str, Any]
    stream: str = ""
    form: str = ""
    """One of :data:`~thermal_robot.commands.endings.FORMS`; empty for what is not written."""


@dataclass(frozen=True)
class Command:
    """One command of the program: its help text, its options and the function that it runs.

    Attributes
    ----------
    does, example, epilog
        What its help says; the example follows the command's name.
    run
        ``"module:function"`` of this room, called with the options.
    options
        In the order of the help.
    prepare
        Called with the options before streams are opened.
    fixed
        Values of options that the command line does not have, but the action reads.
    define
        Adds the arguments and sets the action, instead of ``run``, ``options``, ``prepare`` and ``fixed``.
    """

    does: str
    example: str
    run: str = ""
    options: Sequence[Option] = ()
    prepare: Callable[[argparse.Namespace], None] = lambda _: None
    fixed: Mapping[str, Any] = field(default_factory=dict)
    epilog: str | None = None
    define: Callable[[argparse.ArgumentParser], None] | None = None

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the command's options to its parser; set its action, and which options name files to read or write."""
        if self.define:
            self.define(parser)
            return
        parser.epilog = self.epilog
        files = [(parser.add_argument(*o.names, **o.how).dest, o) for o in self.options]
        reads, writes = ([name for name, option in files if option.stream == way] for way in ("in", "out"))
        forms = {name: option.form for name, option in files if option.form}
        parser.set_defaults(run=self._run, prepare=self.prepare, reads=reads, writes=writes, forms=forms, **self.fixed)

    def _run(self, options: argparse.Namespace) -> None:
        module, _, function = self.run.partition(":")
        getattr(import_module(f"{__package__}.{module}"), function)(options)


def _taken_back(options: argparse.Namespace) -> Iterator[str]:
    """Remove from ``--only`` and ``--without`` and yield trailing names that are files or ``-``, the last first."""
    for names in (options.only, options.without):
        while names and (names[-1] == "-" or Path(names[-1]).exists()):
            yield names.pop()


def _need_one(options: argparse.Namespace) -> None:
    if options.campaign is None:
        options.campaign = next(_taken_back(options), None)
    if options.campaign is None:
        raise CampaignError("diagnose", "no campaign was named", expected="campaign.toml, or its folder")


def _need_two(options: argparse.Namespace) -> None:
    options.campaigns.extend(_taken_back(options))
    if len(options.campaigns) < 2:
        found = str(len(options.campaigns))
        raise CampaignError("compare", "nothing to compare with", found=found, expected="two campaigns or more")


def _port(text: str) -> int:
    """Parse a port number, 0 (any free port) to 65535; ArgumentTypeError for anything else."""
    if not text.isascii() or not text.isdigit() or int(text) > _LAST_PORT:
        raise argparse.ArgumentTypeError(f"{text!r} is no port; expected a number from 0, for any, to {_LAST_PORT}")
    return int(text)


def _option(*names: str, **how: Any) -> Option:
    return Option(names, how)


def _value(metavar: str, *names_and_help: str, **how: Any) -> Option:
    """Option with a value; its help comes last."""
    *names, text = names_and_help
    return Option(tuple(names), {"metavar": metavar, "help": text, **how})


def _file(name: str, text: str, **how: Any) -> Option:
    return Option((name,), {"help": text, **how}, "in")


def _output(form: str, metavar: str, *names_and_help: str, **how: Any) -> Option:
    return _value(metavar, *names_and_help, **how)._replace(stream="out", form=form)


def _folder(form: str, metavar: str, *names_and_help: str, **how: Any) -> Option:
    return _value(metavar, *names_and_help, **how)._replace(form=form)


def _flag(name: str, text: str) -> Option:
    return _option(name, action="store_true", help=text)


def _json(what: str) -> Option:
    return _output("json", "F.json", "--json", f"write the {what} as JSON ('-' prints it instead of the text)")


def _triple(metavar: str, name: str, text: str, *default: float) -> Option:
    return _value(metavar, name, text, nargs=3, type=float, default=list(default))


def _effects(name: str, text: str, **how: Any) -> Option:
    return _value("EFFECT", name, text, nargs="+", action="extend", **how)


_NAMED = "campaign.toml, its folder, or - for standard input (paths in it are then those of the current folder)"
_CAMPAIGN = _file("campaign", _NAMED)
_MODEL = _file("model", "file that `diagnose --model` wrote, or - for standard input")
_REPORT = _output("page", "F.html", "--report", "write a page with figures, PDF by its ending ('-' prints it)")
_CHOICE = (_effects("--without", "leave effects out", default=[]), _effects("--only", "consider these only"))
_ROBOT = "its file, or a robot that comes along, as in campaign.toml"
_ROOT = _value("LINK", "--root", "where the chain starts; the root of the URDF where left out")
_TARGET = "the link that carries the target"
_TABLE = "CSV, Parquet, .xlsx or .ods by its ending"
ALL_FORMATS: dict[str, Format | MotionFormat] = {**FORMATS, **MOTION_FORMATS}
_WIDE = max(map(len, ALL_FORMATS))
_ALL = {"only": None, "without": ()}

COMMANDS = {
    "demo": Command(
        "diagnose a campaign that comes with the package, and draw it",
        "",
        "campaigns:demo",
        [
            _output(
                "page",
                "F.html",
                "--report",
                "page to draw, PDF by its ending (default: %(default)s)",
                default="demo.html",
            )
        ],
        fixed=_ALL,
    ),
    "plan": Command(
        "plan the first campaign: poses that tell effects apart, and what accuracy to expect",
        " robot.urdf --tool tool0 --rows 60 -o campaign",
        "making:plan",
        [
            _value("URDF", "robot", _ROBOT),
            _folder("plan", "DIR", "-o", "--output", "folder of the campaign to measure; a table if F.csv"),
            _value("LINK", "--tool", _TARGET, default=""),
            _ROOT,
            _value("N", "--rows", "of the campaign, repeats included (60; after a crash 40)", type=int),
            _value("K", "--repeats", "how often each pose is measured (1)", type=int, default=1),
            _value("EFFECT", "--effects", "those to tell; all where left out", nargs="+"),
            _value("MM", "--noise", "one sigma per axis, mm (0.02)", type=float, default=0.02),
            _flag("--after-crash", "ten minutes that tell which zero moved: 40 poses, neither load nor warming"),
            _flag("--orientation", "orientations will be measured, too"),
            _triple("MM", "--target", "in the tool, mm", 0.0, 0.0, 0.0),
            _value("KG", "--loads", "payloads beside none", nargs="+", type=float, default=[]),
            _value("K", "--warming", "by how much the robot warms (6)", type=float, default=6.0),
            _option("--known", choices=("base", "tool"), nargs="+", default=[], help="frames that will be known"),
            _option("--angle-unit", choices=ANGLE_UNITS, default="rad", help="of the joints in the table (rad)"),
            _option("--length-unit", choices=LENGTH_UNITS, default="mm", help="of lengths in the table (mm)"),
            _option(
                "--measures",
                choices=BESIDE,
                help="without an instrument: what rows say",
            ),
            _value("N", "--seed", "of the candidates (0)", type=int, default=0),
            _json("plan"),
        ],
    ),
    "check": Command(
        "validate and describe a campaign, or a motion.toml; nothing is fitted",
        " campaign.toml",
        "campaigns:check",
        [_CAMPAIGN],
    ),
    "effects": Command(
        "list the effects that are considered, and what each needs",
        "",
        "campaigns:effects",
        [_file("campaign", f"{_NAMED}; what it recorded is then not asked for", nargs="?")],
    ),
    "diagnose": Command(
        "say where the gap lies, what causes it, how far it shrinks",
        " campaign.toml --report diagnosis.html --model model.json",
        "campaigns:diagnose",
        [
            _file("campaign", _NAMED, nargs="?"),
            _json("diagnosis"),
            _REPORT,
            _output("model", "F.json", "--model", "save the corrected model for `predict` ('-' prints it)"),
            _output("mjcf", "F.xml", "--mjcf", "of a log of motion: write your MJCF with the causes in it"),
            _output("urdf", "F.urdf", "--urdf", "of a log of motion: write your URDF with the causes in it"),
            _value("F.xml", "--from-mjcf", "your own MJCF, where the log names a URDF"),
            _value("LOG", "--unseen", "another motion.toml: how far MuJoCo's own rollout shrinks its gap"),
            _effects("--without", "leave effects out; `thermal-robot effects` lists their names", default=[]),
            _effects("--only", "consider these only; both options take several names"),
        ],
        prepare=_need_one,
    ),
    "crash": Command(
        "say which joint's zero moved in a crash, or whether it is the URDF or a bent link",
        " campaign.toml",
        "campaigns:crash",
        [_CAMPAIGN, _json("result")],
        epilog="what to measure: thermal-robot plan robot.urdf --tool tool0 --after-crash -o campaign",
    ),
    "compare": Command(
        "say what campaigns or models of one robot share, and what changed between them",
        " january june december --report compared.html",
        "several:compare",
        [
            _value(
                "campaign",
                "campaigns",
                "two or more in order of time: campaign.toml, its folder, or a model",
                nargs="*",
            ),
            _json("comparison"),
            _REPORT,
            *_CHOICE,
        ],
        prepare=_need_two,
    ),
    "view": Command(
        "show robot and gap in three dimensions, in the browser",
        " campaign.toml",
        "campaigns:view",
        [
            _CAMPAIGN,
            _flag("--no-diagnosis", "show the gap alone, at once"),
            _value("N", "--port", f"of this machine ({PORT}; the next free one)", type=_port, default=PORT),
            _flag("--open", "open the page in the default browser"),
        ],
        fixed=_ALL,
    ),
    "predict": Command(
        "say where the robot will really be, by the corrected model",
        " model.json samples.csv -o predicted.csv",
        "models:predict",
        [
            _MODEL,
            _file("samples", "table with the campaign's columns and units, or - for standard input (CSV)"),
            _output("table", "F", "-o", "--output", f"table to write, {_TABLE} ('-': CSV)", required=True),
            _flag("--noise", "count the instrument's noise in std.x, std.y, std.z"),
        ],
    ),
    "correct": Command(
        "correct commands, so that the real tool reaches the nominal poses; write the calibrated robot",
        " model.json poses.csv -o commands.csv --urdf calibrated.urdf",
        "models:correct",
        [
            _MODEL,
            _file("poses", "table of nominal joint positions and conditions, as the campaign's; or - (CSV)", nargs="?"),
            _output("table", "F", "-o", "--output", f"table of commands to write, {_TABLE} ('-': CSV)"),
            _output("urdf", "F.urdf", "--urdf", "write the calibrated robot as a URDF ('-' prints it)"),
            _output("mjcf", "F.xml", "--mjcf", "write it as an MJCF for MuJoCo; needs the extra `blind`"),
            _file("--from-mjcf", "MJCF of the nominal robot to write --mjcf from", metavar="F.xml"),
            _output("csv", "F.csv", "--dh", "write its parameters of Denavit and Hartenberg"),
            _output("yaml", "F.yaml", "--ur-kinematics", "write it as Universal Robots' kinematics.yaml"),
            _flag("--modified", "those of Craig's modified convention"),
            _output("json", "F.json", "--joints", "write the frames of its joints for a simulator (MuJoCo, Isaac)"),
            _output("csv", "F.csv", "--offsets", "write what to add to the commands of each joint's zero"),
            _output("yaml", "F.yaml", "--pal", "write zeros as master_calibration.yaml of PAL Robotics (TIAGo)"),
            _file("--from-pal", "the robot's master_calibration.yaml, to which they are added", metavar="F.yaml"),
            _output("json", "F.json", "--lerobot", "write zeros as homing offsets of LeRobot"),
            _file("--from-lerobot", "the arm's calibration, to write --lerobot from", metavar="F.json"),
            _flag("--dynamixel", "its motors are Dynamixel's, not Feetech's"),
            _value("K", "--min-sigma", "leave out what is less than K standard deviations from zero (2)", type=float),
            _flag(
                "--alone", "write what was fitted without the rest of the model, for a robot that is used without it"
            ),
            _value("C", "--temperature", "°C at which lengths hold (default: the campaign's reference)", type=float),
        ],
    ),
    "wear": Command(
        "follow one robot over time: what moves, at once or steadily, how fast, and when it crosses a limit",
        " january march june --dates 2026-01-12 2026-03-02 2026-06-08 --limit backlash=5e-4",
        "several:wear",
        [
            _value("CAMPAIGN", "campaigns", "campaign.toml or its folder, three or more, in order of time", nargs="+"),
            _value("DATE", "--dates", "of each campaign, 2026-03-01; without them no rate is told", nargs="+"),
            _value("EFFECT=VALUE", "--limit", "of its parameters, SI; may be repeated", action="append", default=[]),
            _value("EFFECT", "--only", "consider these effects, and the zeros of joints", nargs="+"),
            _value("P", "--false-alarm", "share of series without a change that may ring at all (0.01)", type=float),
            _json("result"),
            _REPORT,
        ],
    ),
    "iso9283": Command(
        "tell the performance criteria of ISO 9283 from repeats",
        " campaign.toml --csv criteria.csv",
        "campaigns:iso9283",
        [
            _CAMPAIGN,
            _json("criteria"),
            _output("table", "F", "--csv", f"write a table, one row a figure, in m and rad, {_TABLE} ('-': CSV)"),
        ],
    ),
    "fleet": Command(
        "diagnose many campaigns: what is wrong with which robot, and what several share",
        " campaigns --out fleet --labels hall robot",
        "several:fleet",
        [
            _value("FOLDER|LIST", "source", "every campaign.toml below it; or CSV or TOML with paths and labels"),
            _folder("folder", "DIR", "-o", "--out", "folder of table and page, made if need be", required=True),
            _value("NAME", "--labels", "what the levels of folders are, from the top", nargs="+", default=[]),
            _value("N", "--workers", "processes on this machine (default: one a core)", type=int),
            _value(
                "MINUTES",
                "--time-limit",
                f"for each campaign (default: {TIME_LIMIT / 60.0:.0f})",
                type=float,
                default=TIME_LIMIT / 60.0,
            ),
            _value("ADDRESS", "--scheduler", "of Dask on a cluster, instead of processes here"),
            *_CHOICE,
        ],
    ),
    "import": Command(
        "make a campaign, or a log of motion, of other programs' files",
        " table log.csv --mapping mapping.toml -o campaign",
        "making:import_files",
        [
            _value("FORMAT", "format", "what the files are, see below", choices=ALL_FORMATS),
            _value("FILES", "files", "to read, as many as the format has", nargs="+"),
            _folder("folder", "DIR", "-o", "--output", "folder of the campaign, made if need be", required=True),
            _value("URDF", "--robot", _ROBOT),
            _value("LINK", "--tool", _TARGET),
            _ROOT,
            _value("F.yaml", "--kinematics", "calibration of a robot of Universal Robots (ROS)"),
            _option("--angle-unit", choices=ANGLE_UNITS, help="of the joints, where the format does not say"),
            _option("--length-unit", choices=LENGTH_UNITS, help="of the positions, where the format does not say"),
            _value("F.toml", "--mapping", "what the columns are, and the campaign's declarations"),
        ],
        epilog="formats:\n"
        + "\n".join(
            f"  {name:{_WIDE}}  {each.does}\n  {'':{_WIDE}}  {each.files}" for name, each in ALL_FORMATS.items()
        ),
    ),
    "map": Command(
        "map the workspace: scatter, thermal displacement, probability of joining, C_p, clearance",
        " robot.urdf --tool tool0 -o map.parquet --x -0.8 0.8 41 --y -0.8 0.8 41 --z 0.2 0.2 1 --figure map.png",
        "workspace:run",
        [
            _value("URDF", "robot", _ROBOT),
            _value("F", "-o", "--output", "F.parquet or F.zarr; gone on with if it is there", required=True),
            _value("LINK", "--tool", "the link that holds the part", default=""),
            _ROOT,
            *(
                _option(f"--{a}", nargs=3, metavar=("FROM", "TO", "N"), help=f"places along {a} of the root frame, m")
                for a in "xyz"
            ),
            _value("N", "--joints", "instead of places: N joint positions that fill the limits", type=int),
            _value("S", "--sigma", "1 sigma, rad or m: one, or JOINT=S … (5e-5)", nargs="+", default=["5e-5"]),
            _value("A", "--expansion", "1/K: one, or SEGMENT=A … (1.2e-5)", nargs="+", default=["1.2e-5"]),
            _value("K", "--rise", "of temperature: one, or SEGMENT=K … (3)", nargs="+", default=["3"]),
            _option(
                "--law",
                choices=("shift", "uniform"),
                default="shift",
                help="the rise has happened; or is within ± (shift)",
            ),
            _value("MM", "--clearance", "diameter for the probability, mm (0.2)", type=float, default=0.2),
            _value("CP", "--capability", "for the required clearance (1.33)", type=float, default=1.33),
            _triple("X", "--approach", "where the tool points, root frame (0 0 -1)", 0.0, 0.0, -1.0),
            _triple("X", "--axis", "the tool's direction, tool frame (0 0 1)", 0.0, 0.0, 1.0),
            _triple("MM", "--point", "the tip in the tool frame, mm (0 0 0)", 0.0, 0.0, 0.0),
            _value("COLUMN", "--by", "what tells the best places (required_warm)", default="required_warm"),
            _value("RULE", "--where", "what they must have, such as 'capability_warm>=1.33'", nargs="+", default=[]),
            _value("N", "--count", "of them (5)", type=int, default=5),
            _output("picture", "F.png", "--figure", "draw the column of --by: contours in a plane, else points"),
            _json("best places"),
            _flag("--replace", "begin anew where another map stands there"),
        ],
    ),
    "paper": Command(
        "print the figures of the paper beside the computed ones",
        "",
        "making:paper",
        [
            _json("ledger"),
            _value("M", "--l5", "wrist to tool point, m (default: 0.150, assumed)", type=float),
            _flag("--markdown", "print the table of docs/paper.md instead of the text"),
        ],
    ),
    "blind": Command(blind.DOES, blind.EXAMPLE, define=blind.add_arguments),
}
"""Commands in the order of the help."""
