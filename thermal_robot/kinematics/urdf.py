"""URDF text to a Pinocchio model, quietly, and in plain words when it fails."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

import pinocchio as pin

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.markup import IS_XACRO, Edit, Tag, bare, changed, encoded, tags

# Redirecting the process's output streams is global: one thread at a time.
_STREAMS = threading.Lock()


@lru_cache(maxsize=1)
def parse_urdf(urdf: str, source: str) -> pin.Model:
    """Build the Pinocchio model of a whole URDF; meshes are not read.

    Parameters
    ----------
    urdf
        XML text.
    source
        What to call it in an error: its file, or "the robot description".

    Raises
    ------
    RobotError
        If the text is not a URDF, with the reason.
    """
    said: list[str] = []
    content = bare(encoded(urdf))
    whole = with_limits(content, tags(content, source))
    try:
        with _quiet(said):
            return pin.buildModelFromXML(whole)
    except (ValueError, RuntimeError) as error:
        reasons = re.findall(r"Error:\s+(.*)", "".join(said))
        why = IS_XACRO if b"<xacro:" in content else f"is not a valid URDF: {reasons[0] if reasons else error}"
        raise RobotError(f"{source} {why}", name=source) from error


def with_limits(content: bytes, found: Sequence[Tag]) -> str:
    """Give each joint the limits that urdfdom asks for and nobody here uses; bounds of 0 and 0 stand for none.

    Parameters
    ----------
    content
        XML without comments.
    found
        Its elements.
    """
    limits = {t.parent: t for t in found if t.path == ("robot", "joint", "limit")}
    edits: list[Edit] = []
    for number, tag in enumerate(found):
        if tag.path == ("robot", "joint") and number not in limits:
            edits.append((tag.close, tag.close, '<limit effort="0" velocity="0"/>'))
    for tag in limits.values():
        more = "".join(f' {name}="0"' for name in ("effort", "velocity") if name not in tag.attributes)
        edits.append((tag.start + len("<limit"), tag.start + len("<limit"), more))
    return changed(content, edits).lstrip()


def nearest(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """Up to five of the known names, the most similar first, whatever their case."""

    def similarity(candidate: str) -> float:
        return difflib.SequenceMatcher(None, name.lower(), candidate.lower()).ratio()

    return tuple(sorted(known, key=similarity, reverse=True)[:5])


@contextlib.contextmanager
def _quiet(said: list[str]) -> Iterator[None]:
    """Keep what urdfdom and Pinocchio print from C++ off the terminal, and hand it back."""
    with _STREAMS, tempfile.TemporaryFile() as sink:
        try:
            with contextlib.ExitStack() as restore:
                for stream, descriptor in ((sys.stdout, 1), (sys.stderr, 2)):
                    # What Python still holds back belongs on the terminal, before the stream is turned away.
                    with contextlib.suppress(AttributeError, OSError, ValueError):
                        stream.flush()
                    try:
                        saved = os.dup(descriptor)
                    except OSError:  # a process without this stream has nothing to protect
                        continue
                    restore.callback(os.close, saved)
                    restore.callback(os.dup2, saved, descriptor)
                    os.dup2(sink.fileno(), descriptor)
                yield
        finally:
            sink.seek(0)
            said.append(sink.read().decode(errors="replace"))
