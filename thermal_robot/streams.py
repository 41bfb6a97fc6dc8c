"""``-`` for standard input and output, copied to and from temporary files at the command line."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from thermal_robot.campaign.settings import MOST_PIPED
from thermal_robot.errors import CampaignError, ThermalRobotError

STDIN, STDOUT = "standard input", "standard output"
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


@contextmanager
def piped(options: argparse.Namespace) -> Iterator[None]:
    """Replace ``-`` among a command's files by temporary ones, fed from standard input or copied to standard output.

    Parameters
    ----------
    options
        Of a command; ``reads`` and ``writes`` name those that are files. One that is ``-`` becomes a path. ``piped``
        says whether standard input is read, ``printed`` whether a file is printed instead of the text.

    Raises
    ------
    CampaignError
        If ``-`` stands twice for the same stream, or standard input holds no text. Errors raised within speak of the
        streams by name.
    """
    source, target = _named(options, options.reads, STDIN), _named(options, options.writes, STDOUT)
    options.piped, options.printed = bool(source), bool(target)
    if not source and not target:
        yield
        return
    with TemporaryDirectory(prefix="thermal-robot-") as made:
        folder = Path(made).resolve()
        for name, file in ((source, STDIN), (target, STDOUT)):
            if name:
                setattr(options, name, str(folder / file))
        if source:
            (folder / STDIN).write_bytes(_read())
        try:
            yield
        except ThermalRobotError as error:
            error.args = (str(error).replace(f"{folder}{os.sep}", ""),)
            raise
        finally:
            if (folder / STDOUT).exists():
                _print((folder / STDOUT).read_bytes())


def _named(options: argparse.Namespace, names: Sequence[str], stream: str) -> str:
    """Name of the one option, of some, whose value is ``-``; empty without one, an error if there are several."""
    found = [name for name in names if getattr(options, name) == "-"]
    if len(found) > 1:
        said = f"- as {' and as '.join(found)}"
        raise CampaignError("-", f"there is one {stream}", found=said, expected="one of them")
    return "".join(found)


def _read() -> bytes:
    """Read all of standard input; :class:`CampaignError` if it is a terminal, empty, too long, or no text."""
    source = "text from a file or another program"
    if sys.stdin is None or sys.stdin.closed:
        raise CampaignError(STDIN, "is closed", expected=source)
    if sys.stdin.isatty():
        raise CampaignError(STDIN, "is a terminal", expected=f"{source}: `- < FILE`")
    try:
        content = sys.stdin.buffer.read(MOST_PIPED + 1)
    except OSError as error:
        raise CampaignError(STDIN, "cannot be read", found=error.strerror) from None
    if not content.strip():
        raise CampaignError(STDIN, "is empty", expected=source)
    if len(content) > MOST_PIPED:
        raise CampaignError(STDIN, "is too long", expected=f"at most {MOST_PIPED / 1e6:.0f} MB; name a file instead")
    if b"\0" in content and not content.startswith(_UTF_16):
        found, expected = "a byte that no text has", "a table as CSV, TOML or JSON"
        raise CampaignError(STDIN, "is not text", found=found, expected=expected)
    return content


def _print(content: bytes) -> None:
    """Write bytes to standard output; as text where there is no binary stream."""
    sys.stdout.flush()
    if hasattr(sys.stdout, "buffer"):
        sys.stdout.buffer.write(content)
    else:
        sys.stdout.write(content.decode("utf-8"))
