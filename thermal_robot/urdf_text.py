"""Sources of URDF text: a file, the package, example-robot-data, or an object that exports URDF."""

from __future__ import annotations

import difflib
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Protocol, runtime_checkable

from thermal_robot.errors import RobotError

BUILTIN = "builtin:"
EXAMPLE_ROBOT_DATA = "example-robot-data:"

DESCRIPTION = "the robot description"

_LARGEST_FILE = 64 << 20
"""Bytes: largest URDF file that is read; a link takes a few kilobytes."""

# The table of example-robot-data sends this name to the loader of another robot (5.1 and before).
_LOADER_BY_ITS_NAME = {"ur3": "UR3Loader"}


@runtime_checkable
class WritesUrdf(Protocol):
    """Protocol of objects that export URDF, such as a ``yourdfpy.URDF``."""

    def write_xml_string(self) -> bytes | str:
        """Return the robot's URDF as XML text."""


class Source(NamedTuple):
    """URDF text, its name in errors, and the folder to which mesh paths are relative; ``None`` without a file."""

    text: str
    called: str
    folder: Path | None = None


def urdf_text(urdf: str | Path | WritesUrdf) -> Source:
    """Read the URDF text of a robot from text, path, shipped name or exporting object; errors as for ``load_robot``."""
    if isinstance(urdf, str):
        text = urdf.lstrip("\ufeff \t\r\n")
        if not text or text.startswith("<"):
            return Source(text, DESCRIPTION)
        if urdf.startswith(BUILTIN):
            return _read(_builtin_path(urdf.removeprefix(BUILTIN)))
        if urdf.startswith(EXAMPLE_ROBOT_DATA):
            return _read(_example_path(urdf.removeprefix(EXAMPLE_ROBOT_DATA)))
        return _read(Path(urdf))
    if isinstance(urdf, Path):
        return _read(urdf)
    if isinstance(urdf, WritesUrdf):
        return Source(_written(urdf), DESCRIPTION)
    raise RobotError(f"a robot is a path, URDF text or a yourdfpy.URDF, not {type(urdf).__name__}")


def _written(urdf: WritesUrdf) -> str:
    """Return the exported text of a robot, with the mimic tags that yourdfpy (to 0.0.60) reads but does not write."""
    written = urdf.write_xml_string()
    text = written.decode() if isinstance(written, bytes) else written
    joints = getattr(getattr(urdf, "robot", None), "joints", ())
    known = {joint.name: joint.mimic for joint in joints if getattr(joint, "mimic", None) is not None}
    if not known or "<mimic" in text:
        return text
    tree = ElementTree.fromstring(text)
    for joint in tree.iter("joint"):
        mimic = known.get(joint.get("name"))
        if mimic is not None:
            values = {"joint": mimic.joint, "multiplier": str(mimic.multiplier), "offset": str(mimic.offset)}
            ElementTree.SubElement(joint, "mimic", values)
    return ElementTree.tostring(tree, encoding="unicode")


def _read(path: Path) -> Source:
    source = f"the robot file {str(path)!r}"
    try:
        if path.is_dir():
            problem = "is a folder, not a URDF file"
        elif path.exists() and not path.is_file():
            problem = "is a pipe or a device, not a file"
        elif path.exists() and path.stat().st_size > _LARGEST_FILE:
            problem = f"is larger than any URDF ({_LARGEST_FILE >> 20} MiB)"
        else:
            return Source(_decoded(path.read_bytes()).lstrip(), source, path.resolve().parent)
    except (FileNotFoundError, ValueError):  # or a name that no file can have
        problem = "does not exist"
    except OSError as error:
        problem = f"cannot be read: {error.strerror}"
    raise RobotError(f"{source} {problem}", name=str(path))


def _decoded(content: bytes) -> str:
    """Text of a file, whatever encoding it declares; invalid bytes become replacement characters."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        declared = re.match(rb"\s*<\?xml[^>]*\sencoding\s*=\s*[\"']([\w.-]+)", content)
        try:
            return content.decode(declared[1].decode() if declared else "cp1252", errors="replace")
        except LookupError:
            return content.decode(errors="replace")


def shipped() -> Iterator[str]:
    """Yield the names of the robots of the package and, where installed, of example-robot-data."""
    yield from (BUILTIN + path.stem for path in sorted(_builtin_folder().glob("*.urdf")))
    try:
        from example_robot_data.robots_loader import ROBOTS
    except ImportError:
        return
    yield from (EXAMPLE_ROBOT_DATA + name for name in ROBOTS)


def _builtin_folder() -> Path:
    package = Path(__file__).parent
    # A wheel carries the folder inside the package, a checkout beside it.
    return next((f for f in (package / "robots", package.parent / "robots") if f.is_dir()), package / "robots")


def _builtin_path(name: str) -> Path:
    folder = _builtin_folder()
    known = sorted(path.stem for path in folder.glob("*.urdf"))
    if name not in known:
        raise unknown(name, known, "built-in robot")
    return folder / f"{name}.urdf"


def _example_path(name: str) -> Path:
    try:
        from example_robot_data import robots_loader
    except ImportError as error:
        raise RobotError(
            f"robot {name!r} is in the package example-robot-data, which is not installed: "
            'pip install "thermal-robot[robots]"',
            name=name,
        ) from error
    if name not in robots_loader.ROBOTS:
        raise unknown(name, sorted(robots_loader.ROBOTS), "robot of example-robot-data")
    loader = getattr(robots_loader, _LOADER_BY_ITS_NAME.get(name, ""), robots_loader.ROBOTS[name])
    # The path only: an instance of the loader would read every mesh.
    below = Path(loader.path, loader.urdf_subpath, loader.urdf_filename)
    if not loader.urdf_filename:
        raise RobotError(f"robot {name!r} of example-robot-data has no URDF file", name=name)
    try:
        return Path(loader.model_path or robots_loader.getModelPath(str(below))) / below
    except OSError as error:
        raise RobotError(
            f"robot {name!r} of example-robot-data has no URDF file where its loader says", name=name
        ) from error


def unknown(name: str, known: list[str], what: str) -> RobotError:
    """Return an error that no ``what`` has this name, with the most similar of the ``known`` names."""
    near = tuple(difflib.get_close_matches(name, known, n=5, cutoff=0.3)) or tuple(known)
    return RobotError(f"there is no {what} {name!r}; nearest: {', '.join(near)}", name=name, candidates=near)
