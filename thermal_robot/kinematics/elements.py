"""The elements of a URDF, read once by a parser that can be stopped, before urdfdom reads the text.

urdfdom takes what is no XML, drops what it does not know without a word, and needs hours or all memory for a text that
is deep or wide enough. What is refused here it never sees.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from xml.parsers import expat

from thermal_robot.errors import RobotError

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


@dataclass(frozen=True)
class Element:
    """An element of a URDF.

    Attributes
    ----------
    path
        Its tag after those that it stands in, the outermost left out: ``("joint", "limit")``.
    attributes, owner
        Its own attributes, and those of the link or joint that it stands in.
    start, end
        Bytes of the text, in UTF-8, at which its first tag begins and its last one.
    number
        Of the element of the outermost one that it stands in, or is.
    """

    path: tuple[str, ...]
    attributes: Mapping[str, str]
    owner: Mapping[str, str]
    start: int
    end: int
    number: int


def without_comments(urdf: str) -> str:
    """Blank comments and raw text, keeping their lines: urdfdom takes ``--`` in a comment, which XML forbids."""
    spans = r"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)"
    return re.sub(spans, lambda span: "\n" * span[0].count("\n"), urdf, flags=re.DOTALL).lstrip()


def read_elements(text: str, source: str) -> list[Element]:
    """Read the elements of a URDF's links and joints, in their order; whether prefixes were declared is not asked.

    Parameters
    ----------
    text
        XML without comments, from :func:`without_comments`.
    source
        What to call it in an error.

    Raises
    ------
    RobotError
        If the text is empty, no XML, another kind of file, or deeper or wider than any robot.
    """
    if not text:
        raise RobotError(f"{source} is empty", name=source)
    reader = _Reader(source)
    try:
        reader.parser.Parse(text.encode(errors="replace"), True)
    except expat.ExpatError as problem:
        raise RobotError(f"{source} is not XML: {problem}", name=source) from problem
    return reader.found


class _Reader:
    """What expat calls."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.found: list[Element] = []
        self.open: list[tuple[str, Mapping[str, str], int]] = []
        self.number = self.joints = 0
        # a text in Python has left its encoding behind, whatever it declares
        self.parser = expat.ParserCreate("utf-8")
        self.parser.StartElementHandler, self.parser.EndElementHandler = self.begin, self.finish
        self.parser.EntityDeclHandler = self.entity

    def refuse(self, problem: str) -> RobotError:
        return RobotError(f"{self.source} {problem}", name=self.source)

    def entity(self, name: str, *_: object) -> None:
        raise self.refuse(
            f"declares the XML entity {name!r}, which no URDF reader expands; write its text in its place"
        )

    def begin(self, tag: str, attributes: Mapping[str, str]) -> None:
        # a tag of xacro whose prefix is not declared is left over from an expanded file
        if tag.startswith("xacro:") and self.open and "xmlns:xacro" in self.open[0][1]:
            raise self.refuse(IS_XACRO)
        if not self.open and tag != "robot":
            kind = _FOREIGN.get(tag, "is XML")
            raise self.refuse(f"{kind} but not a URDF: its root element is <{tag}>, expected <robot>")
        if len(self.open) == _DEEPEST or len(attributes) > _MOST_ATTRIBUTES:
            what = "elements within each other" if len(self.open) == _DEEPEST else "attributes of one element"
            raise self.refuse(f"has more than 100 {what}, which no URDF has")
        self.number += len(self.open) == 1
        self.joints += len(self.open) == 1 and tag == "joint"
        if self.joints > MOST_JOINTS:
            raise self.refuse(f"has more than {MOST_JOINTS} joints: cut it to the arm")
        self.open.append((tag, attributes, self.parser.CurrentByteIndex))

    def finish(self, _: str) -> None:
        end, (_, attributes, start) = self.parser.CurrentByteIndex, self.open[-1]
        if 2 <= len(self.open) <= 4:
            path = tuple(tag for tag, _, _ in self.open[1:])
            self.found.append(Element(path, attributes, self.open[1][1], start, end, self.number))
        del self.open[-1]
