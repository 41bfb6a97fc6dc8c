"""Atomic file writes: written beside their place, flushed to disk, then renamed."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from thermal_robot.errors import CampaignError

_BESIDE = ".thermal-robot-"


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path that replaces ``path`` at the end: an atomic replace.

    Whoever reads ``path`` sees the file as it was or as it became, whatever happens in between. What is no file, such
    as ``/dev/stdout`` or a pipe, is written to directly; a link stays a link, and a file keeps its permissions.

    Yields
    ------
    Path
        Where to write, with the same suffix.

    Raises
    ------
    OSError
        If the folder or the disk does not take it, naming ``path``, which is then as it was.
    """
    asked = Path(path)
    if asked.is_relative_to("/dev") or (asked.exists() and not asked.is_file()):
        yield asked
        return
    target = asked.resolve()
    beside = target.with_name(f"{_BESIDE}{secrets.token_hex(8)}{target.suffix}")
    try:
        beside.touch(exist_ok=False)
        yield beside
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        if target.exists():
            beside.chmod(target.stat().st_mode & 0o7777)
        beside.replace(target)
    except BaseException as error:
        with suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError) and str(beside) in (error.filename, error.filename2):
            error.filename, error.filename2 = str(path), None  # whoever reads this never heard of the other file
        raise
    with suppress(OSError):  # the folder's new entry reaches the disk, where folders can be opened
        number = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text by an atomic replace; raises as :func:`whole`."""
    with whole(path) as place:
        place.write_text(text, encoding="utf-8")


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write bytes by an atomic replace; raises as :func:`whole`."""
    with whole(path) as place:
        place.write_bytes(content)


def is_file(path: Path) -> bool:
    """Whether a regular file exists there; False where the name is invalid or the system refuses to look."""
    with suppress(OSError, ValueError):
        return path.is_file()
    return False


def is_folder(path: Path) -> bool:
    """Whether a folder exists there; False where the name is invalid or the system refuses, as in :func:`is_file`."""
    with suppress(OSError, ValueError):
        return path.is_dir()
    return False


def require_free(targets: Sequence[str | None], inputs: Sequence[str | Path] = ()) -> None:
    """Refuse, before writing, an output that is a folder or in none that exists, is also an input, or is named twice.

    Raises
    ------
    CampaignError
        Naming the file; none and ``-`` are no files.
    """
    read, taken = {Path(file).resolve() for file in inputs}, set()
    for target in targets:
        if not target or target == "-":
            continue
        try:
            file = Path(target).resolve()
            fits = file.parent.is_dir() and not file.is_dir()
        except (OSError, ValueError, RuntimeError):  # a name too long, one with a NUL, a circle of links
            fits = False
        if not fits:
            raise CampaignError(target, "cannot be written", expected="a file in a folder that exists")
        if file in read:
            raise CampaignError(target, "is read from, and would be overwritten", expected="another file to write")
        if file in taken:
            raise CampaignError(target, "is named for two outputs", expected="a file for each")
        taken.add(file)


def written(outputs: Sequence[tuple[str | None, Callable[[Path], object]]]) -> dict[str, str]:
    """Write all outputs (path, writer) even if some fail; return the system's error messages by path."""
    failed = {}
    for target, write in outputs:
        try:
            if target:
                write(Path(target))
        except OSError as error:
            failed[target or ""] = error.strerror or str(error)
    return failed


def write_one(target: str, write: Callable[[Path], object]) -> None:
    """Write one output; :class:`CampaignError` if it cannot be written."""
    for file, reason in written([(target, write)]).items():
        raise CampaignError(file, "cannot be written", found=reason)


def checksum(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
