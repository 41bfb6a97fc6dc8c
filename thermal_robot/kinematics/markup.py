"""XML that is read once, and changed in a few places; it stays as it stands everywhere else, to the last blank.

A parser that writes a tree anew loses comments, the order of attributes or the digits of numbers. Here it only tells
where the tags stand; the text between the changes is copied. Of a URDF that nobody has read it refuses what urdfdom
takes without a word, or needs hours or all memory for: a text that is no XML, deep or wide.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias
from xml.parsers import expat

from thermal_robot.errors import RobotError

Edit: TypeAlias = "tuple[int, int, str]"
"""First byte, byte behind the last one, and the text in its place; an insertion where the two are the same."""

_HIDDEN = re.compile(rb"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?\?>", re.DOTALL)
_START = re.compile(rb"<[^\s/>]+(?:\s+[^\s=>]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*\s*/?>")
_DEEPEST = 100
"""Elements within each other: no robot has more than ten, and urdfdom refuses 500."""
_MOST_ATTRIBUTES = 100
"""Of one element: a dozen at most are in use, and urdfdom's time grows with their square."""
MOST_JOINTS = 1000
"""Joints, fixed ones too: the largest humanoids have 220, and Pinocchio's stack ends between 3000 and 4000."""
IS_XACRO = "is a xacro file; expand it to URDF first (xacro robot.xacro > robot.urdf)"
_FOREIGN = {
    "sdf": "is an SDF file",
    "mujoco": "is an MJCF file (MuJoCo)",
    "COLLADA": "is a mesh (COLLADA)",
}
_ENCODING = re.compile(rb"(\A\s*<\?xml[^>]*?\sencoding\s*=\s*)(\"[^\"]*\"|'[^']*')")


@dataclass(frozen=True)
class Tag:
    """An element where it begins.

    Attributes
    ----------
    path
        Its name after those of the elements that it stands in, the outermost first.
    attributes
        As the parser reads them.
    start, stop
        First byte of its first tag, and the byte behind that tag.
    close
        First byte of its last tag; ``start`` where it has but one, ``<origin/>``.
    parent
        Number of the element that it stands in; -1 for the outermost.
    """

    path: tuple[str, ...]
    attributes: Mapping[str, str]
    start: int
    stop: int
    close: int
    parent: int

    @property
    def empty(self) -> bool:
        """Whether it has but one tag."""
        return self.close == self.start


def encoded(text: str) -> bytes:
    """Return the bytes whose places are counted: UTF-8, and a declaration that says so."""
    return _ENCODING.sub(rb'\1"utf-8"', text.encode(errors="replace"), count=1)


def bare(content: bytes) -> bytes:
    """Blank comments, raw text and declarations, all else in its place: urdfdom takes ``--`` in a comment, XML not."""
    return _HIDDEN.sub(lambda span: re.sub(rb"[^\n]", b" ", span[0]), content)


@lru_cache(maxsize=1)  # a robot is read, checked and cut out of the same text
def tags(content: bytes, source: str = "") -> tuple[Tag, ...]:
    """Return the elements in the order in which they begin; comments are not read, so they may hold anything.

    Parameters
    ----------
    content
        From :func:`encoded`.
    source
        What to call it in an error, where it is a URDF that nobody has read; whether prefixes were declared is not
        asked.

    Raises
    ------
    expat.ExpatError
        If it is no XML, and there is no ``source``.
    RobotError
        If it is empty, no XML, another kind of file, or deeper or wider than any robot, and there is one.
    """
    reader = _Reader(bare(content), source)
    if source and not content.strip():
        raise reader.refused("is empty")
    try:
        reader.parser.Parse(reader.seen, True)
    except expat.ExpatError as problem:
        if not source:
            raise
        raise reader.refused(f"is not XML: {problem}") from problem
    return tuple(reader.found)


class _Reader:
    """What expat calls."""

    def __init__(self, seen: bytes, source: str) -> None:
        self.seen, self.source = seen, source
        self.found: list[Tag] = []
        self.open: list[int] = []
        self.joints = 0
        # a text in Python has left its encoding behind, whatever it declares
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler, self.parser.EndElementHandler = self.begin, self.finish
        if source:
            self.parser.EntityDeclHandler = self.entity

    def refused(self, problem: str) -> RobotError:
        return RobotError(f"{self.source} {problem}", name=self.source)

    def entity(self, name: str, *_: object) -> None:
        raise self.refused(
            f"declares the XML entity {name!r}, which no URDF reader expands; write its text in its place"
        )

    def begin(self, name: str, attributes: dict[str, str]) -> None:
        if self.source:
            self.guard(name, attributes)
        start = self.parser.CurrentByteIndex
        tag = _START.match(self.seen, start)
        parent = self.open[-1] if self.open else -1
        path = (*(self.found[parent].path if self.open else ()), name)
        self.open.append(len(self.found))
        self.found.append(Tag(path, attributes, start, tag.end() if tag else start, start, parent))

    def guard(self, name: str, attributes: dict[str, str]) -> None:
        # a tag of xacro whose prefix is not declared is left over from an expanded file
        if name.startswith("xacro:") and self.open and "xmlns:xacro" in self.found[0].attributes:
            raise self.refused(IS_XACRO)
        if not self.open and name != "robot":
            kind = _FOREIGN.get(name, "is XML")
            raise self.refused(f"{kind} but not a URDF: its root element is <{name}>, expected <robot>")
        if len(self.open) == _DEEPEST or len(attributes) > _MOST_ATTRIBUTES:
            what = "elements within each other" if len(self.open) == _DEEPEST else "attributes of one element"
            raise self.refused(f"has more than 100 {what}, which no URDF has")
        self.joints += len(self.open) == 1 and name == "joint"
        if self.joints > MOST_JOINTS:
            raise self.refused(f"has more than {MOST_JOINTS} joints: cut it to the arm")

    def finish(self, _: str) -> None:
        number = self.open.pop()
        tag = self.found[number]
        if self.seen[tag.stop - 2 : tag.stop] != b"/>":
            self.found[number] = replace(tag, close=self.parser.CurrentByteIndex)


def with_values(content: bytes, tag: Tag, values: Mapping[str, str | None]) -> Edit:
    """Return the change that gives a tag other attributes; ``None`` takes one away, the others stay as they stand."""
    text = content[tag.start : tag.stop].decode()
    for name, value in values.items():
        known = re.search(rf"\s+{re.escape(name)}\s*=\s*(?:\"[^\"]*\"|'[^']*')", text)
        said = "" if value is None else f' {name}="{value}"'
        if known:
            text = text[: known.start()] + said + text[known.end() :]
        elif said:
            end = re.search(r"\s*/?>\Z", text)
            at = end.start() if end else len(text)
            text = text[:at] + said + text[at:]
    return tag.start, tag.stop, text


def changed(content: bytes, edits: Iterable[Edit]) -> str:
    """Return the text with all changes, which do not overlap; those of one place in their order."""
    parts, last = [], 0
    for start, stop, text in sorted(edits, key=lambda edit: edit[:2]):
        parts += [content[last:start], text.encode()]
        last = stop
    return b"".join([*parts, content[last:]]).decode()


def comment(lines: Iterable[str]) -> str:
    """Return lines as an XML comment, which may hold no two hyphens in succession."""
    return "<!--\n" + "\n".join(re.sub(r"-(?=-)", "- ", line) for line in lines).rstrip("-") + "\n-->\n"


def indent(content: bytes, start: int) -> str:
    """Return the blanks before a place in its line, as text that begins a new line there."""
    before = content[content.rfind(b"\n", 0, start) + 1 : start]
    return "\n" + before.decode() if not before.strip() else ""
