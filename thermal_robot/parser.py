"""How a command line is taken apart: complaints of one line that propose what was meant, and help for a newcomer."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterable
from typing import Any, NoReturn

from thermal_robot.campaign.names import did_you_mean

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
STATUSES = """\
exit status:
  0    done; a diagnosis that finds nothing, or leaves a remainder, is done, too
  1    the program failed, or what it prints to: a full disk
  2    bad input; one line on stderr names file, row and column, what was found and what was expected
  130  interrupted"""
_CHOICE = re.compile(r"invalid choice: '(?P<found>[^']*)' \(choose from (?P<known>.*)\)")


class Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line, as all complaints of this program, and whose texts keep their lines."""

    def __init__(self, **options: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **options)

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and what was probably meant."""
        message = " ".join(message.split())
        meant = _CHOICE.search(message)
        meant_by = did_you_mean(meant["found"], re.findall(r"[\w-]+", meant["known"])) if meant else ""
        raise self._stopped(f"{self.prog}: {message}{meant_by}; see {self.prog} --help")

    def bare(self, commands: Iterable[str]) -> NoReturn:
        """Answer a command line that says nothing."""
        raise self._stopped(
            f"usage: {self.prog} COMMAND ...\nCOMMAND is one of {', '.join(commands)}.\n"
            f"Begin with `{self.prog} demo`; `{self.prog} --help` says more."
        )

    @staticmethod
    def _stopped(text: str) -> SystemExit:
        print(text, file=sys.stderr)
        return SystemExit(BAD_INPUT)
