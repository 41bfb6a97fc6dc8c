"""URDF parser (lxml): validation, edits in place, and the Pinocchio model.

Comments, the order of attributes and the digits of numbers stay where nothing is changed. Of a URDF that nobody has
read it refuses what urdfdom takes without a word, or needs hours or all memory for: a text that is no XML, deep or
wide. urdfdom leaves out a link's inertia, without an error, where its mass is written ``3,42`` or is empty; takes a
mass of −3 kg as it is; and reads past ``<pose>`` or ``<orgin>``. Kinematics or torques are then wrong and nobody is
told.
"""

from __future__ import annotations

import contextlib
import copy
import difflib
import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias
from xml.parsers import expat

import pinocchio as pin
from lxml import etree

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.lie import rotation_to_rpy

Element: TypeAlias = Any
"""An element of lxml, which has no types."""

_HIDDEN = re.compile(r"<!--.*?(?:-->|\Z)|<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?\?>", re.DOTALL)
_ENTITY = re.compile(r"<!ENTITY\s+(?:%\s+)?(\S+)")
_DEEPEST = 100
"""Elements within each other: no robot has more than ten, and urdfdom refuses 500."""
_MOST_ATTRIBUTES = 100
"""Of one element: a dozen at most are in use, and urdfdom's time grows with their square."""
MOST_JOINTS = 1000
"""Joints, fixed ones too: the largest humanoids have 220, and Pinocchio's stack ends between 3000 and 4000."""
IS_XACRO = "is a xacro file; expand it to URDF first (xacro robot.xacro > robot.urdf)"
_FOREIGN = {"sdf": "is an SDF file", "mujoco": "is an MJCF file (MuJoCo)", "COLLADA": "is a mesh (COLLADA)"}


def tree(text: str) -> Element:
    """Parse XML leniently: ``--`` in comments, undeclared prefixes and a default namespace are accepted."""
    # a text in Python has left its encoding behind, whatever it declares; a smaller tree would be cut at 10 MB of text
    parser = etree.XMLParser(encoding="utf-8", recover=True, resolve_entities=False, huge_tree=True)
    root = etree.fromstring(text.encode(errors="replace"), parser)
    for element in () if root is None else root.xpath("//*[namespace-uri() and not(contains(name(), ':'))]"):
        element.tag = etree.QName(element).localname
    return root


def text_of(root: Element, before: str, notes: Sequence[str] = ()) -> str:
    """Serialise XML, with notes as a comment before its root, and the declaration of the text ``before``."""
    parts = [*reversed(list(root.itersiblings(preceding=True))), root, *root.itersiblings()]
    if notes:  # a comment may hold no two hyphens in succession
        lines = "\n".join(re.sub(r"-(?=-)", "- ", line) for line in notes).rstrip("-")
        parts.insert(parts.index(root), etree.Comment(f"\n{lines}\n"))
    declared = ["<?xml version='1.0' encoding='utf-8'?>"] if before.lstrip().startswith("<?xml") else []
    declared += filter(None, [root.getroottree().docinfo.doctype])
    return "\n".join([*declared, *(etree.tostring(p, encoding="unicode", with_tail=False) for p in parts), ""])


def unsound(text: str) -> str:
    """XML syntax error of a text in expat's words, but for what :func:`tree` accepts; empty if valid."""
    try:
        expat.ParserCreate("utf-8").Parse(_seen(text).encode(errors="replace"), True)
    except expat.ExpatError as error:
        return str(error)
    return ""


def _seen(text: str) -> str:
    """Text with comments, CDATA and instructions blanked, positions kept; urdfdom accepts ``--`` in a comment."""
    return _HIDDEN.sub(lambda span: re.sub(r"[^\n]", " ", span[0]), text)


@lru_cache(maxsize=1)  # a robot is read, checked and cut out of the same text
def read(urdf: str, source: str) -> Element:
    """Parse and validate a URDF, without comments; the tree is cached and must not be changed.

    Refused, by the name ``source``, is what is empty, no XML, another kind of file, or deeper or wider than any robot.
    """
    seen, root, problem = _seen(urdf), None, ""
    if not seen.strip():
        raise RobotError(f"{source} is empty", name=source)
    if entity := _ENTITY.search(seen):  # before libxml2 expands it
        problem = f"declares the XML entity {entity[1]!r}, which no URDF reader expands; write its text in its place"
        raise RobotError(f"{source} {problem}", name=source)
    with contextlib.suppress(etree.XMLSyntaxError):  # whose words are not expat's
        root = tree(seen)
    if root is not None:
        problem = _foreign(root)
    if not problem and (reason := unsound(urdf)):
        problem = f"is not XML: {reason}"
    if problem:
        raise RobotError(f"{source} {problem}", name=source)
    return root


def _foreign(root: Element) -> str:
    """Reason why a document is no URDF: another root, xacro tags, too deep, wide or many joints; empty if it is one."""
    if root.tag != "robot":
        return f"{_FOREIGN.get(root.tag, 'is XML')} but not a URDF: its root element is <{root.tag}>, expected <robot>"
    # a tag of xacro whose prefix is not declared is left over from an expanded file
    if "xacro" in root.nsmap and any(element.prefix == "xacro" for element in root.iter()):
        return IS_XACRO
    for what, found in (
        (f"{_DEEPEST} elements within each other", f"//*[count(ancestor::*) = {_DEEPEST}]"),
        (f"{_MOST_ATTRIBUTES} attributes of one element", f"//*[count(@*) > {_MOST_ATTRIBUTES}]"),
    ):
        if root.xpath(found):
            return f"has more than {what}, which no URDF has"
    return f"has more than {MOST_JOINTS} joints: cut it to the arm" if len(root.findall("joint")) > MOST_JOINTS else ""


# Redirecting the process's output streams is global: one thread at a time.
_STREAMS = threading.Lock()


@lru_cache(maxsize=1)
def parse_urdf(urdf: str, source: str) -> pin.Model:
    """Pinocchio model of a whole URDF, or an error with the reason; meshes are not read."""
    said: list[str] = []
    root = copy.deepcopy(read(urdf, source))
    for joint in root.iterfind("joint"):
        # urdfdom asks for limits that nobody here uses; bounds of 0 and 0 stand for none
        limit = joint.find("limit")
        limit = etree.SubElement(joint, "limit") if limit is None else limit
        for name in ("effort", "velocity"):
            limit.set(name, limit.get(name, "0"))
    try:
        with _quiet(said):
            return pin.buildModelFromXML(etree.tostring(root, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        reasons = re.findall(r"Error:\s+(.*)", "".join(said))
        left = any(str(element.tag).startswith("xacro:") for element in root.iter())
        why = IS_XACRO if left else f"is not a valid URDF: {reasons[0] if reasons else error}"
        raise RobotError(f"{source} {why}", name=source) from error


def nearest(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """Up to five of the known names, the most similar first, whatever their case."""

    def similarity(candidate: str) -> float:
        return difflib.SequenceMatcher(None, name.lower(), candidate.lower()).ratio()

    return tuple(sorted(known, key=similarity, reverse=True)[:5])


@contextlib.contextmanager
def _quiet(said: list[str]) -> Iterator[None]:
    """Capture what urdfdom and Pinocchio print from C++."""
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
_MOVABLE = ("revolute", "continuous", "prismatic")
_FREEDOMS = {**dict.fromkeys(_MOVABLE, 1), "planar": 3, "floating": 6}
_HARMLESS = ("calibration", "dynamics", "safety_controller", "visual", "collision")
_ELEMENTS = {
    "": ("link", "joint"),
    "joint": ("origin", "parent", "child", "axis", "limit", "mimic"),
    "link": ("inertial",),
    "link/inertial": ("origin", "mass", "inertia"),
}
"""Known elements that place or weigh something, by the path of their parent; the names are checked only there."""


class _Figures(NamedTuple):
    """Validity of a numeric attribute: name, expectation, count, and largest value."""

    what: str
    expected: str
    many: int = 1
    most: float = _LARGEST


_LIMIT = {name: _Figures(f"limit {name}", "a number", most=_NO_LIMIT) for name in ("lower", "upper")}
_ATTRIBUTES: dict[str, dict[str, _Figures | None]] = {
    "origin": {"xyz": _Figures("origin", "three numbers, m", 3), "rpy": _Figures("origin", "three numbers, rad", 3)},
    "axis": {"xyz": _Figures("axis", "three numbers that are not all zero", 3)},
    "limit": {**_LIMIT, "effort": None, "velocity": None},
    "mimic": {"joint": None, **{n: _Figures(f"mimic {n}", "a number") for n in ("multiplier", "offset")}},
    "parent": {"link": None},
    "child": {"link": None},
    "mass": {"value": _Figures("mass", "a number of kg that is not negative")},
    # the sign of an inertia plays no part in statics, and exporters write −5e-20 for nothing
    "inertia": {n: _Figures(f"inertia {n}", "a number of kg·m²") for n in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")},
}
"""Known attributes by element, with the requirement on their numbers; ``None`` for text."""
_MEANT = {
    **dict.fromkeys(("pose", "transform", "frame", "position", "translation", "rotation", "xyz", "rpy"), "origin"),
    **dict.fromkeys(("min", "max", "range", "bounds"), "limit"),
    "direction": "axis",
    "inertia": "inertial",
    "mass": "inertial",
}
"""Names of elements in other formats, and the URDF element of the same meaning."""
_MEANT_OF_LIMIT = {"min": "lower", "low": "lower", "max": "upper", "high": "upper"}
_ONCE = {"link/inertial", "link/inertial/mass", *(f"joint/{name}" for name in _ELEMENTS["joint"])}
"""Elements of which urdfdom reads the first alone."""


@lru_cache(maxsize=1)
def require_numbers(urdf: str, source: str) -> None:
    """Refuse a URDF with unknown elements that place something, or invalid numbers.

    The error names the link or joint, what stands there, and what is meant or expected; or says why it is no URDF.
    """
    freedoms = 0
    for owner in read(urdf, source).iterchildren("*"):
        kind, name = owner.tag, owner.get("name", "")
        problem = next(_problems(owner), "")
        if problem:
            known = f"{kind} {_short(name)}" if kind in _ELEMENTS[""] else "it"
            raise RobotError(f"{source}: {known}{problem}", name=name)
        freedoms += _FREEDOMS.get(owner.get("type", ""), 0) if kind == "joint" else 0
    if freedoms > MOST_MOVING:
        raise RobotError(f"{source} has {freedoms} joints that move, expected at most {MOST_MOVING}: cut it to the arm")


def _descendants(element: Element, place: str) -> Iterator[tuple[str, Element]]:
    """Yield an element and its descendants depth first, each with the path of its parent, starting from ``place``."""
    yield place, element
    for child in element.iterchildren("*"):
        yield from _descendants(child, f"{place}/{element.tag}".lstrip("/"))


def _problems(owner: Element) -> Iterator[str]:
    """Yield a message for each fault of a link or joint: name, repeated or unknown elements, numbers, missing mass."""
    seen, name = set(), owner.get("name", "")
    if owner.tag == "joint" and (not name or name != name.strip()):
        yield ": expected a name without blanks around it"  # a table's column has none
    for place, element in _descendants(owner, ""):
        path = f"{place}/{element.tag}".lstrip("/")
        if path in _ONCE and path in seen:
            yield f": there are two <{element.tag}>, expected one"
        seen.add(path)
        yield from _unknown(place, element)
        if element.tag in _ELEMENTS.get(place, ()) and element.tag in _ATTRIBUTES:
            yield from _unread(element)
            yield from (f": {problem}" for problem in _wrong(element, owner.get("type", "")))
    if "link/inertial" in seen and "link/inertial/mass" not in seen:
        yield ": its <inertial> has no <mass>, expected one"


def _unknown(place: str, element: Element) -> Iterator[str]:
    """Yield a message if URDF does not know an element that seems to place or move something, with the one meant."""
    name, known = element.tag, _ELEMENTS.get(place)
    if known is None or ":" in name or element.prefix or name in (*known, *_HARMLESS):
        return
    meant = _MEANT.get(name.lower()) if place in ("joint", "link") else None
    meant = meant if meant in known else _alike(name, known)
    if not meant and place == "joint" and {"xyz", "rpy"} & set(element.attrib):
        meant = "origin"
    if meant:
        yield f" has a <{name}>, which URDF does not know: is <{meant}> meant?"


def _unread(element: Element) -> Iterator[str]:
    """Yield a message for each attribute of an element, or text in it, that URDF ignores but that seems to be meant."""
    name, known = element.tag, list(_ATTRIBUTES[element.tag])
    for key, value in element.attrib.items():
        if key in known or ":" in key or key.startswith("{"):
            continue
        if name == "limit":
            meant = _MEANT_OF_LIMIT.get(key.lower()) or _alike(key, known[:2])
        else:
            figures = all(_NUMBER.fullmatch(word) for word in value.split())
            meant = _alike(key, known) or (" or ".join(known) if figures else "")
        if meant:
            yield f" has {key}={_short(value)} in its <{name}>, which URDF does not know: is {meant} meant?"
    text = (element.text or "") + "".join(etree.tostring(child, encoding="unicode") for child in element)
    if text.strip():
        yield f": its <{name}> holds {_short(text.strip())}, expected attributes, as <{name} {known[0]}=…/>"


def _alike(name: str, known: Iterable[str]) -> str:
    return next(iter(difflib.get_close_matches(name.lower(), list(known), n=1, cutoff=_ALIKE)), "")


def _wrong(element: Element, kind: str) -> Iterator[str]:
    """Yield a message for each missing or invalid number of an element; ``kind`` is the type of its joint."""
    name, found = element.tag, {}
    if name == "mass" and "value" not in element.attrib:
        yield "its <mass> has no value, expected a number of kg"
    if name == "axis" and "xyz" not in element.attrib and kind in _MOVABLE:
        yield "its <axis> has no xyz, expected three numbers"
    if name == "limit" and kind not in ("revolute", "prismatic"):
        return
    for key, figures in _ATTRIBUTES[name].items():
        if figures is None or key not in element.attrib:
            continue
        words = element.get(key).split()
        values = [float(word) for word in words if _NUMBER.fullmatch(word)]
        found[key] = values
        sound = len(values) == len(words) == figures.many and all(abs(value) <= figures.most for value in values)
        nothing = (name == "mass" and min(values, default=0.0) < 0.0) or (
            name == "axis" and kind in _MOVABLE and not any(values)
        )
        if not sound or nothing:
            yield f"{figures.what} is {_short(element.get(key))}, expected {figures.expected}"
    if name == "limit":
        (low,), (high,) = found.get("lower", [0.0]), found.get("upper", [0.0])
        if low > high:
            yield f"its limits are {low:g} and {high:g}, expected the lower one first"


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:60]}…")


def rewritten(
    urdf: str,
    origins: Mapping[str, Array],
    *,
    links: Mapping[str, tuple[str, Array]] | None = None,
    notes: Sequence[str] = (),
) -> str:
    """Edit a URDF: replace the origins (4, 4), m, of some joints, with all digits; ``notes`` become a comment on top.

    ``links`` are added: by their name the link that carries each by a fixed joint, and its (4, 4) placement there. The
    joint has the link's name and ``_joint``. A link that is carried so already is placed anew; it must have no other's
    name.
    """
    root, placed = tree(urdf), dict(origins)
    joints = {joint.get("name", ""): joint for joint in root.iterfind("joint")}
    for link, (parent, pose) in (links or {}).items():
        name = f"{link}_joint"
        placed[name] = pose
        if _carries(joints.get(name), link, parent):
            continue
        for kind, new in (("link", link), ("joint", name)):
            if any(element.get("name") == new for element in root.iterfind(kind)):
                raise RobotError(f"the robot has a {kind} {new!r} already, which would be added: rename it", name=new)
        etree.SubElement(root, "link", name=link).tail = "\n"
        joints[name] = etree.SubElement(root, "joint", name=name, type="fixed")
        joints[name].tail = "\n"
        etree.SubElement(joints[name], "parent", link=parent)
        etree.SubElement(joints[name], "child", link=link)
    for name, pose in placed.items():
        if name not in joints:
            raise RobotError(f"there is no joint {name!r} to be placed", name=name)
        origin = joints[name].find("origin")
        if origin is None:
            origin = etree.Element("origin")
            origin.tail = joints[name].text
            joints[name].insert(0, origin)
        for key, value in zip(("xyz", "rpy"), xyz_rpy(pose), strict=True):
            origin.set(key, value)
    return text_of(root, urdf, notes)


def _carries(joint: Element | None, link: str, parent: str) -> bool:
    """Whether this fixed joint attaches the link to the parent already."""
    if joint is None or joint.get("type") != "fixed":
        return False
    return [end.get("link") for name in ("parent", "child") for end in joint.iterfind(name)] == [parent, link]


def xyz_rpy(pose: Array) -> tuple[str, str]:
    """Return the translation (m) and roll, pitch, yaw (rad) of a pose (4, 4), as text with all digits."""
    xyz, rpy = (
        " ".join(repr(float(value)) for value in values) for values in (pose[:3, 3], rotation_to_rpy(pose[:3, :3]))
    )
    return xyz, rpy
