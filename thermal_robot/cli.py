"""Command-line interface: parse the arguments, run one command, return the exit status."""

from __future__ import annotations

import argparse
import os
import re
import sys
import traceback
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from thermal_robot.campaign.names import did_you_mean
from thermal_robot.commands.endings import require_endings
from thermal_robot.commands.table import COMMANDS
from thermal_robot.console import NORMAL, VERBOSE, add_loudness, warnings_as_notes
from thermal_robot.errors import OwnEffectError, ThermalRobotError, ours
from thermal_robot.streams import piped

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
STATUSES = """\
exit status:
  0    done; a diagnosis that finds nothing, or leaves a remainder, is done, too
  1    the program failed, or what it prints to: a full disk
  2    bad input; one line on stderr names file, row and column, what was found and what was expected
  130  interrupted"""
_CHOICE = re.compile(r"invalid choice: '(?P<found>[^']*)' \(choose from (?P<known>.*)\)")


class Parser(argparse.ArgumentParser):
    """Argument parser whose errors are one line, with the choice that was probably meant."""

    def __init__(self, **options: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **options)

    def error(self, message: str) -> NoReturn:
        """Exit with one line: what is wrong, and what was probably meant."""
        message = " ".join(message.split())
        meant = _CHOICE.search(message)
        meant_by = did_you_mean(meant["found"], re.findall(r"[\w-]+", meant["known"])) if meant else ""
        self.exit(BAD_INPUT, f"{self.prog}: {message}{meant_by}; see {self.prog} --help\n")

    def bare(self, commands: Iterable[str]) -> NoReturn:
        """Exit with status 2 and a list of the ``commands``, where the command line names none."""
        usage = f"usage: {self.prog} COMMAND ...\nCOMMAND is one of {', '.join(commands)}.\n"
        self.exit(BAD_INPUT, f"{usage}Begin with `{self.prog} demo`; `{self.prog} --help` says more.\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse a command line, run its command, and return the exit status.

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
        require_endings(options)
        with warnings_as_notes(options.loudness), piped(options):
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
    """Redirect standard output to the null device after a broken pipe or a full disk, so that no later flush fails."""
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
    parser.set_defaults(run=lambda _: parser.bare(COMMANDS), prepare=lambda _: None, reads=(), writes=(), forms={})
    for name, command in COMMANDS.items():
        does = f"{command.does[0].upper()}{command.does[1:]}.\n\nexample:\n  thermal-robot {name}{command.example}"
        made: Parser = commands.add_parser(name, help=command.does, description=does)
        add_loudness(made, argparse.SUPPRESS)
        command.add_arguments(made)
    return parser


if __name__ == "__main__":
    sys.exit(main())
