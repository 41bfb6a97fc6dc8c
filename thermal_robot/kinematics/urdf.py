"""URDF text to a Pinocchio model, quietly, and in plain words when it fails."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator
from xml.parsers import expat

import pinocchio as pin

from thermal_robot.errors import RobotError

# Redirecting the process's output streams is global: one thread at a time.
_STREAMS = threading.Lock()


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
    try:
        with _quiet(said):
            return pin.buildModelFromXML(urdf)
    except (ValueError, RuntimeError) as error:
        raise RobotError(f"{source} {_why_not_urdf(urdf, said, str(error))}", name=source) from error


def without_comments(urdf: str) -> str:
    """Blank the comments, keeping their lines: urdfdom takes ``--`` within them, which XML forbids."""
    return re.sub(r"<!--.*?-->", lambda comment: "\n" * comment[0].count("\n"), urdf, flags=re.DOTALL)


def nearest(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """Up to five of the known names, the most similar first, whatever their case."""

    def similarity(candidate: str) -> float:
        return difflib.SequenceMatcher(None, name.lower(), candidate.lower()).ratio()

    return tuple(sorted(known, key=similarity, reverse=True)[:5])


def _why_not_urdf(urdf: str, said: list[str], error: str) -> str:
    text = without_comments(urdf.strip())
    if not text.strip():
        return "is empty"
    if "<xacro:" in text:
        return "is a xacro file; expand it to URDF first (xacro robot.xacro > robot.urdf)"
    try:
        tag = _root_tag(text)
    except expat.ExpatError as problem:
        return f"is not XML: {problem}"
    if tag != "robot":
        return f"is XML but not a URDF: its root element is <{tag}>, expected <robot>"
    reasons = re.findall(r"Error:\s+(.*)", "".join(said))
    return f"is not a valid URDF: {reasons[0] if reasons else error}"


def _root_tag(text: str) -> str:
    """Name of the outermost element; whether the prefixes of names were declared is not asked, as urdfdom does not."""
    tags: list[str] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, _: tags.append(tag)
    parser.Parse(text.encode(), True)
    return tags[0]


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
