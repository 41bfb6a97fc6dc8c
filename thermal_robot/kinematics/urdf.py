"""URDF text: read, checked, changed in place, and parsed to a Pinocchio model.

XML is read once, and changed in a few places; it stays as it stands everywhere else, to the last blank: a parser that
writes a tree anew loses comments, the order of attributes or the digits of numbers. Of a URDF that nobody has read it
refuses what urdfdom takes without a word, or needs hours or all memory for: a text that is no XML, deep or wide.
urdfdom leaves out a link's inertia, without an error, where its mass is written ``3,42`` or is empty; takes a mass of
−3 kg as it is; and reads past ``<pose>`` or ``<orgin>``. Kinematics or torques are then wrong and nobody is told.
"""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import pinocchio as pin

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.lie import rotation_to_rpy

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

    ``path``: its name after those of the elements that it stands in, outermost first. ``start``, ``stop``: first byte
    of its first tag, and the byte behind that. ``close``: first byte of its last tag, ``start`` where it has but one.
    ``parent``: number of the element that it stands in; -1 for the outermost.
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

    With a ``source``, its name in errors, it is a URDF that nobody has read: it is refused if it is empty, no XML,
    another kind of file, or deeper or wider than any robot. Without, :class:`expat.ExpatError` tells what is no XML.
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


# Redirecting the process's output streams is global: one thread at a time.
_STREAMS = threading.Lock()


@lru_cache(maxsize=1)
def parse_urdf(urdf: str, source: str) -> pin.Model:
    """Build the Pinocchio model of a whole URDF, or say why ``source`` is none; meshes are not read."""
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
    """Give each joint the limits that urdfdom asks for and nobody here uses; bounds of 0 and 0 stand for none."""
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


_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_LARGEST = 1e9  # no figure of a robot is larger, in any unit
_NO_LIMIT = 1e100  # limits that are none are written as 1e16, or 1e30
MOST_MOVING = 150
"""Joints that move, a floating one for six: Pinocchio's memory grows with their cube, 0.45 GB at 150, and ends the
process at 1000. A mobile robot with two arms and hands has 101."""
_ALIKE = 0.7
"""Likeness (0..1, by :mod:`difflib`) from which a word is taken for a typing error of one that URDF knows: ``orgin``
for ``origin`` has 0.91, ``axes`` for ``axis`` 0.75; extensions in use (``contact``, ``hardware``) stay below 0.6."""
_THREE = "three numbers"
_MOVABLE = ("revolute", "continuous", "prismatic")
_FREEDOMS = {**dict.fromkeys(_MOVABLE, 1), "planar": 3, "floating": 6}
_INERTIAS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_HARMLESS = ("calibration", "dynamics", "safety_controller", "visual", "collision")
_ELEMENTS: dict[tuple[str, ...], tuple[str, ...]] = {
    (): ("link", "joint"),
    ("joint",): ("origin", "parent", "child", "axis", "limit", "mimic"),
    ("link",): ("inertial",),
    ("link", "inertial"): ("origin", "mass", "inertia"),
}
"""Elements that say where things are and what they weigh, by what they stand in; others of any name are let pass."""
_ATTRIBUTES = {
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
    "mimic": ("joint", "multiplier", "offset"),
    "parent": ("link",),
    "child": ("link",),
    "mass": ("value",),
    "inertia": _INERTIAS,
}
_MEANT = {
    **dict.fromkeys(("pose", "transform", "frame", "position", "translation", "rotation", "xyz", "rpy"), "origin"),
    **dict.fromkeys(("min", "max", "range", "bounds"), "limit"),
    "direction": "axis",
    "inertia": "inertial",
    "mass": "inertial",
}
"""Elements of other formats, and what says the same in a URDF."""
_MEANT_OF_LIMIT = {"min": "lower", "low": "lower", "max": "upper", "high": "upper"}

Attributes = Mapping[str, str]


@lru_cache(maxsize=1)
def require_numbers(urdf: str, source: str) -> None:
    """Refuse a URDF with a word it does not know that places or moves something, a figure that is none, and too much.

    The error names the link or joint, what stands there, and what is meant or expected; or says why it is no URDF.
    """
    content = bare(encoded(urdf))
    found = tags(content, source)
    inside: dict[int, list[Tag]] = {}
    owner, freedoms = 0, 0
    for number, tag in enumerate(found[1:], start=1):
        if len(tag.path) == 2:
            owner = number
        inside.setdefault(owner, []).append(tag)
    for first, *others in inside.values():
        kind, name = first.path[1], first.attributes.get("name", "")
        problem = next(_problems(content, first, others), "")
        if problem:
            known = f"{kind} {_short(name)}" if kind in _ELEMENTS[()] else "it"
            raise RobotError(f"{source}: {known}{problem}", name=name)
        freedoms += _FREEDOMS.get(first.attributes.get("type", ""), 0) if kind == "joint" else 0
    if freedoms > MOST_MOVING:
        raise RobotError(f"{source} has {freedoms} joints that move, expected at most {MOST_MOVING}: cut it to the arm")


def _problems(content: bytes, first: Tag, others: Sequence[Tag]) -> Iterator[str]:
    """Say what is wrong with a link or a joint, one thing after the other."""
    kind, seen = first.attributes.get("type", ""), set()
    yield from _unknown((), first)
    for tag in (first, *others):
        path = tag.path[1:]
        if path in _ONCE and path in seen:
            yield f": there are two <{path[-1]}>, expected one"
        seen.add(path)
        yield from _unknown(path[:-1], tag) if path[1:] else ()
        if path[:-1] in _ELEMENTS and path[-1] in _ATTRIBUTES:
            yield from _unread(content, tag)
        problem = _CHECKS[path](tag.attributes, kind) if path in _CHECKS else ""
        if problem:
            yield f": {problem}"
    if ("link", "inertial") in seen and ("link", "inertial", "mass") not in seen:
        yield ": its <inertial> has no <mass>, expected one"


def _unknown(place: tuple[str, ...], tag: Tag) -> Iterator[str]:
    """Say which element is meant by one that URDF does not know, where it would place or move something."""
    name = tag.path[-1]
    known = _ELEMENTS.get(place)
    if known is None or ":" in name or name in (*known, *_HARMLESS):
        return
    meant = _MEANT.get(name.lower()) if place in (("joint",), ("link",)) else None
    meant = meant if meant in known else _alike(name, known)
    if not meant and place == ("joint",) and {"xyz", "rpy"} & set(tag.attributes):
        meant = "origin"
    if meant:
        yield f" has a <{name}>, which URDF does not know: is <{meant}> meant?"


def _unread(content: bytes, tag: Tag) -> Iterator[str]:
    """Say what is written in an element that URDF does not read there."""
    name = tag.path[-1]
    known = _ATTRIBUTES[name]
    for key, value in tag.attributes.items():
        if key in known or ":" in key:
            continue
        if name == "limit":
            meant = _MEANT_OF_LIMIT.get(key.lower()) or _alike(key, known[:2])
        else:
            figures = all(_NUMBER.fullmatch(word) for word in value.split())
            meant = _alike(key, known) or (" or ".join(known) if figures else "")
        if meant:
            yield f" has {key}={_short(value)} in its <{name}>, which URDF does not know: is {meant} meant?"
    text = content[tag.stop : max(tag.close, tag.stop)].decode().strip()
    if text:
        yield f": its <{name}> holds {_short(text)}, expected attributes, as <{name} {known[0]}=…/>"


def _alike(name: str, known: Iterable[str]) -> str:
    return next(iter(difflib.get_close_matches(name.lower(), list(known), n=1, cutoff=_ALIKE)), "")


def _joint(attributes: Attributes, _: str) -> str:
    name = attributes.get("name", "")
    # a table's column has no blanks around its name
    return "" if name and name == name.strip() else "expected a name without blanks around it"


def _mass(attributes: Attributes, _: str) -> str:
    if "value" not in attributes:
        return "its <mass> has no value, expected a number of kg"
    return _wrong(attributes, "value", "mass", "a number of kg that is not negative", 1, lambda m: m[0] >= 0.0)


def _axis(attributes: Attributes, kind: str) -> str:
    if kind in _MOVABLE and "xyz" not in attributes:
        return f"its <axis> has no xyz, expected {_THREE}"
    expected = f"{_THREE} that are not all zero"
    return _wrong(attributes, "xyz", "axis", expected, 3, lambda v: any(v) or kind not in _MOVABLE)


def _limit(attributes: Attributes, kind: str) -> str:
    if kind not in ("revolute", "prismatic"):
        return ""
    for name in ("lower", "upper"):
        if problem := _wrong(attributes, name, f"limit {name}", "a number", 1, most=_NO_LIMIT):
            return problem
    low, high = float(attributes.get("lower", "0")), float(attributes.get("upper", "0"))
    return f"its limits are {low:g} and {high:g}, expected the lower one first" if low > high else ""


def _each(*checks: tuple[str, str, str, int]) -> Callable[[Attributes, str], str]:
    """Check several attributes alike; the first that is wrong is told."""
    return lambda attributes, _: next(filter(None, (_wrong(attributes, *check) for check in checks)), "")


_origin = _each(("xyz", "origin", f"{_THREE}, m", 3), ("rpy", "origin", f"{_THREE}, rad", 3))
_CHECKS: dict[tuple[str, ...], Callable[[Attributes, str], str]] = {
    ("link", "inertial", "mass"): _mass,
    # its sign plays no part in statics, and exporters write −5e-20 for nothing
    ("link", "inertial", "inertia"): _each(*((name, f"inertia {name}", "a number of kg·m²", 1) for name in _INERTIAS)),
    ("link", "inertial", "origin"): _origin,
    ("joint",): _joint,
    ("joint", "origin"): _origin,
    ("joint", "axis"): _axis,
    ("joint", "mimic"): _each(*((name, f"mimic {name}", "a number", 1) for name in ("multiplier", "offset"))),
    ("joint", "limit"): _limit,
}
_ONCE = {
    ("link", "inertial"),
    ("link", "inertial", "mass"),
    *(("joint", part) for part in ("origin", "parent", "child", "axis", "limit", "mimic")),
}
"""Elements of which urdfdom reads the first alone."""


def _wrong(
    attributes: Attributes,
    name: str,
    what: str,
    expected: str,
    count: int,
    holds: Callable[[list[float]], bool] = lambda _: True,
    *,
    most: float = _LARGEST,
) -> str:
    """Return what is wrong with an attribute; empty where it is right, or absent and so its default."""
    text = attributes.get(name)
    if text is None:
        return ""
    words = text.split()
    if len(words) == count and all(_NUMBER.fullmatch(word) for word in words):
        values = [float(word) for word in words]
        if all(abs(value) <= most for value in values) and holds(values):
            return ""
    return f"{what} is {_short(text)}, expected {expected}"


def _short(text: str, most: int = 60) -> str:
    return repr(text if len(text) <= most else f"{text[:most]}…")


def rewritten(
    urdf: str,
    origins: Mapping[str, Array],
    *,
    links: Mapping[str, tuple[str, Array]] | None = None,
    notes: Sequence[str] = (),
) -> str:
    """Return a URDF with the (4, 4) placements, m, of some joints written anew, with all digits, below notes.

    ``links`` are added: by their name the link that carries each by a fixed joint, and its (4, 4) placement there. The
    joint has the link's name and ``_joint``. A link that is carried so already is placed anew; it must have no other's
    name.
    """
    content = encoded(urdf)
    found = tags(content)
    robot = found[0]
    joints = {t.attributes.get("name", ""): k for k, t in enumerate(found) if t.path == ("robot", "joint")}
    edits: list[Edit] = [(robot.start, robot.start, comment(notes))] if notes else []
    placed, more = dict(origins), ""
    for link, (parent, pose) in (links or {}).items():
        joint = f"{link}_joint"
        if _is_carried(found, joints.get(joint), link, parent):
            placed[joint] = pose
            continue
        _require_new(found, link, joint)
        ends = f"<parent link={quoteattr(parent)}/><child link={quoteattr(link)}/>"
        made = f'<joint name={quoteattr(joint)} type="fixed">{ends}{_origin_tag(pose)}</joint>'
        more += f"  <link name={quoteattr(link)}/>\n  {made}\n"
    edits += [(robot.close, robot.close, more)] if more else []
    for name, pose in placed.items():
        if name not in joints:
            raise RobotError(f"there is no joint {name!r} to be placed", name=name)
        edits.append(_placed(content, found, joints[name], pose))
    return changed(content, edits)


def xyz_rpy(pose: Array) -> tuple[str, str]:
    """Return the translation (m) and the roll, pitch and yaw (rad) of a (4, 4) pose with all digits, as URDFs do."""
    return tuple(  # type: ignore[return-value]
        " ".join(repr(float(value)) for value in values) for values in (pose[:3, 3], rotation_to_rpy(pose[:3, :3]))
    )


def _origin_tag(pose: Array) -> str:
    xyz, rpy = xyz_rpy(pose)
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def _placed(content: bytes, found: Sequence[Tag], joint: int, pose: Array) -> Edit:
    """Return the change that gives a joint an origin, in the tag that it has or in one of its own."""
    inside = [t for t in found if t.parent == joint]
    own = next((t for t in inside if t.path[-1] == "origin"), None)
    if own is None:
        first = inside[0].start
        return first, first, _origin_tag(pose) + indent(content, first)
    xyz, rpy = xyz_rpy(pose)
    return with_values(content, own, {"xyz": xyz, "rpy": rpy})


def _is_carried(found: Sequence[Tag], joint: int | None, link: str, parent: str) -> bool:
    """Tell whether a fixed joint of this number carries the link on its parent already."""
    if joint is None or found[joint].attributes.get("type") != "fixed":
        return False
    ends = {t.path[-1]: t.attributes.get("link") for t in found if t.parent == joint}
    return (ends.get("parent"), ends.get("child")) == (parent, link)


def _require_new(found: Sequence[Tag], link: str, joint: str) -> None:
    for kind, name in (("link", link), ("joint", joint)):
        if any(t.path == ("robot", kind) and t.attributes.get("name") == name for t in found):
            raise RobotError(f"the robot has a {kind} {name!r} already, which would be added: rename it", name=name)
