"""The command line: arguments in, exit status out."""

from __future__ import annotations

import argparse
import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from thermal_robot.blind import command as blind
from thermal_robot.commands import (
    check,
    compare,
    correct,
    demo,
    diagnose,
    effects,
    fleet,
    import_files,
    iso9283,
    paper,
    plan,
    predict,
    view,
    wear,
)
from thermal_robot.commands import (
    map as workspace,
)
from thermal_robot.console import NORMAL, VERBOSE, add_loudness, heard
from thermal_robot.errors import OwnEffectError, ThermalRobotError, ours
from thermal_robot.parser import BAD_INPUT, DONE, FAILED, INTERRUPTED, STATUSES, Parser
from thermal_robot.streams import piped

COMMANDS = {
    "demo": demo,
    "plan": plan,
    "check": check,
    "effects": effects,
    "diagnose": diagnose,
    "compare": compare,
    "view": view,
    "predict": predict,
    "correct": correct,
    "wear": wear,
    "iso9283": iso9283,
    "fleet": fleet,
    "import": import_files,
    "map": workspace,
    "paper": paper,
    "blind": blind,
}
"""Modules by command, in the order of the help: what each does, an example, its options. All are light: what a command
computes with is imported once it runs."""


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
        says which. Of a failure of the program ``-v`` prints the traceback, too.
    """
    options = _parser().parse_args(arguments)
    with suppress(AttributeError):  # a terminal without this letter or that is no reason to stop
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        options.prepare(options)
        with heard(options.loudness), piped(options):
            options.run(options)
        sys.stdout.flush()  # a disk may be full only now
    except OwnEffectError as error:
        return _complain(str(error), FAILED)
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
    except Exception as error:
        if options.loudness == VERBOSE:
            traceback.print_exc()
        last = traceback.extract_tb(error.__traceback__)[-1]
        return _complain(ours(f"{error!r} in {Path(last.filename).name}, line {last.lineno}"), FAILED)
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
    parser.set_defaults(run=lambda _: parser.bare(commands.choices), prepare=lambda _: None, reads=(), writes=())
    for name, module in COMMANDS.items():
        again = f"{module.DOES[0].upper()}{module.DOES[1:]}.\n\nexample:\n  thermal-robot {name}{module.EXAMPLE}"
        made: Parser = commands.add_parser(name, help=module.DOES, description=again)
        add_loudness(made, argparse.SUPPRESS)
        module.add_arguments(made)
    return parser


if __name__ == "__main__":
    sys.exit(main())
