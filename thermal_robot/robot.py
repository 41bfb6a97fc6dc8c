"""The robot: one chain of a URDF, from a root frame to a tool frame, with the segments that can grow."""

from __future__ import annotations

import difflib
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.errors import RobotError
from thermal_robot.kinematics.model import SHORTEST_SEGMENT, Chain, build_chain_model, leaf_links
from thermal_robot.kinematics.numbers import require_numbers

if TYPE_CHECKING:
    from collections.abc import Callable

Array = NDArray[np.float64]

BUILTIN = "builtin:"
EXAMPLE_ROBOT_DATA = "example-robot-data:"

_DESCRIPTION = "the robot description"

_MOST_SHOWN = 12
"""Names in one message; a humanoid has dozens of fingers."""
STRONGEST_GRAVITY = 100.0
"""m/s²: four times that of any planet where a robot has been sent; a figure in mm/s² is above it."""
ENDS = ("tool_frame", "root_frame")
"""Names of the links between which the chain lies, as a robot, a campaign and a model call them."""
_LARGEST_FILE = 64 << 20
"""Bytes: a URDF is text about links, of a few kilobytes each."""

# The table of example-robot-data sends this name to the loader of another robot (5.1 and before).
_LOADER_BY_ITS_NAME = {"ur3": "UR3Loader"}


@runtime_checkable
class WritesUrdf(Protocol):
    """Anything that can write itself as URDF, such as a ``yourdfpy.URDF``."""

    def write_xml_string(self) -> bytes | str:
        """Return the XML text."""


@dataclass(frozen=True, eq=False)
class Segment:
    """The placement of a movable joint, or of a fixed frame with a length: where a link may be bent or grow.

    Parameters
    ----------
    name
        URDF joint, movable or fixed, whose origin it is.
    parent_link
        Link that carries it.
    length
        m.
    direction
        (3,) unit vector along which it grows, in its own frame (behind its placement's rotation), as a right
        perturbation wants it; zero where two joints' origins coincide.
    index
        Chain element that it belongs to.
    movable
        Whether the placement is a movable joint's.
    joint
        Name of the joint whose position moves what is behind it: its own, or the one that it mimics; ``None`` for a
        fixed frame, and for a joint that mimics one outside the chain.
    """

    name: str
    parent_link: str
    length: float
    direction: Array
    index: int
    movable: bool
    joint: str | None


@dataclass(frozen=True, eq=False, repr=False)
class Robot:
    """One kinematic chain with n joints that can be driven and S segments; made by :func:`load_robot`, then unchanged.

    Parameters
    ----------
    name
        Name in the URDF.
    urdf
        XML text.
    tool_frame, root_frame
        Links at its two ends; poses of the tool are expressed in the root frame.
    gravity
        (3,) m/s² in the root frame.
    joint_names, joint_types
        n names and types (``revolute``, ``continuous`` or ``prismatic``) of the movable joints, from the root
        on. A joint that mimics another is none of them: it follows.
    lower, upper
        (n,) limits, rad or m, narrowed to those of the joints that mimic it; infinite where the URDF gives none.
    has_masses
        Whether the URDF gives a mass to anything that the joints carry.
    segments
        S placements, of the movable joints and of the fixed frames with a length, from the root on.
    chain
        Constant arrays for the functions of :mod:`thermal_robot.kinematics`.
    model
        ``pinocchio.Model`` reduced to the movable joints, mimicking ones too.
    urdf_links, urdf_joints
        Names of all links and of all joints of the URDF, in the chain or not, fixed joints too.
    """

    name: str
    urdf: str
    tool_frame: str
    root_frame: str
    gravity: Array
    joint_names: tuple[str, ...]
    joint_types: tuple[str, ...]
    lower: Array
    upper: Array
    has_masses: bool
    segments: tuple[Segment, ...]
    chain: Chain
    model: Any
    urdf_links: tuple[str, ...]
    urdf_joints: tuple[str, ...]

    @property
    def n(self) -> int:
        """Number of joints that can be driven."""
        return len(self.joint_names)

    @property
    def mass(self) -> float:
        """Of all that the joints carry, kg; 0 where the URDF gives none."""
        return float(np.sum(self.chain.masses))

    def __repr__(self) -> str:
        ends = f"{self.root_frame!r} to {self.tool_frame!r}"
        return f"Robot({self.name!r}, {ends}, {self.n} joints, {len(self.segments)} segments)"

    def __reduce__(self) -> tuple[Callable[..., Robot], tuple[Any, ...]]:
        # Rebuilt from its text, so that a saved robot survives a change of Pinocchio's own format.
        return _build, (self.urdf, self.tool_frame, self.root_frame, self.gravity)


def load_robot(
    urdf: str | Path | WritesUrdf,
    tool_frame: str,
    *,
    root_frame: str | None = None,
    gravity: ArrayLike | None = None,
) -> Robot:
    """Load the chain of a robot from its URDF; meshes are not read.

    Joints outside the chain, and those between the root of the URDF and ``root_frame``, are held at 0, or at
    their limit nearest to 0. A joint with a ``<mimic>`` tag follows the joint that it names, and stands still where
    that one is held; outside the chain it is held in any case, where the held position of that one takes it.

    Parameters
    ----------
    urdf
        Path of a file, the XML text itself, a ``yourdfpy.URDF``, ``"builtin:rv_m2"``, or
        ``"example-robot-data:"`` and a name such as ``ur10``.
    tool_frame
        Link whose pose was measured, or is asked for.
    root_frame
        Link in which poses are expressed; the root link by default.
    gravity
        (3,) m/s² in the root frame; by default 9.81 down the z axis of the root link.

    Returns
    -------
    Robot
        The chain from the root frame to the tool frame.

    Raises
    ------
    RobotError
        If there is no such file, name or link, if it is not a URDF, if the chain has no movable joint, or one
        that is not revolute, continuous, prismatic or fixed, if one of its joints mimics one that does not exist, or
        in the end itself, if gravity is not three numbers of a planet, or if a mass, an inertia, an origin, an axis or
        a limit is no number, or one that no robot has.
    """
    text, source = _urdf_text(urdf)
    for frame in (tool_frame, root_frame):
        if frame is not None and not isinstance(frame, str):
            raise RobotError(f"a frame is the name of a link, not {type(frame).__name__}")
    require_numbers(text, source)
    if not tool_frame:
        leaves = leaf_links(text, source)
        more = f" and {len(leaves) - _MOST_SHOWN} more" if len(leaves) > _MOST_SHOWN else ""
        shown = ", ".join(leaves[:_MOST_SHOWN]) + more
        raise RobotError(
            f"no tool frame is given; the links at the ends of this robot are {shown}",
            candidates=leaves,
        )
    return _build(text, tool_frame, root_frame, _three_finite_numbers(gravity), source)


def _build(
    urdf: str, tool_frame: str, root_frame: str | None, gravity: Array | None, source: str = _DESCRIPTION
) -> Robot:
    built = build_chain_model(urdf, tool_frame, root_frame, gravity, source)
    chain = built.chain
    return Robot(
        name=built.model.name,
        urdf=urdf,
        tool_frame=tool_frame,
        root_frame=built.root_frame,
        gravity=built.gravity,
        joint_names=built.joint_names,
        joint_types=built.joint_types,
        lower=built.lower,
        upper=built.upper,
        has_masses=bool(np.any(chain.masses > 0.0)),
        segments=tuple(_segment(chain, built.joint_names, int(k)) for k in chain.placed),
        chain=chain,
        model=built.model,
        urdf_links=built.urdf_links,
        urdf_joints=built.urdf_joints,
    )


def _segment(chain: Chain, joints: tuple[str, ...], k: int) -> Segment:
    offset = chain.translations[k]
    length = float(np.linalg.norm(offset))
    direction = chain.rotations[k].T @ offset / length if length > SHORTEST_SEGMENT else np.zeros(3)
    direction.setflags(write=False)
    movable = np.flatnonzero(chain.movable == k)
    leader = chain.coupling.leader(int(movable[0])) if len(movable) else None
    joint = None if leader is None else joints[leader]
    return Segment(chain.names[k], chain.parent_links[k], length, direction, k, len(movable) > 0, joint)


def _three_finite_numbers(gravity: ArrayLike | None) -> Array | None:
    if gravity is None:
        return None
    try:
        vector = np.array(gravity, dtype=float)
    except (TypeError, ValueError, OverflowError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise RobotError(f"gravity must be three finite numbers in m/s², got {gravity!r}")
    if not np.all(np.abs(vector) <= STRONGEST_GRAVITY):
        raise RobotError(f"gravity must be at most {STRONGEST_GRAVITY:g} m/s² along each axis, got {gravity!r}")
    return vector


def _urdf_text(urdf: str | Path | WritesUrdf) -> tuple[str, str]:
    """XML text, and what to call it in an error."""
    if isinstance(urdf, str):
        text = urdf.lstrip("\ufeff \t\r\n")
        if not text or text.startswith("<"):
            return text, _DESCRIPTION
        if urdf.startswith(BUILTIN):
            return _read(_builtin_path(urdf.removeprefix(BUILTIN)))
        if urdf.startswith(EXAMPLE_ROBOT_DATA):
            return _read(_example_path(urdf.removeprefix(EXAMPLE_ROBOT_DATA)))
        return _read(Path(urdf))
    if isinstance(urdf, Path):
        return _read(urdf)
    if isinstance(urdf, WritesUrdf):
        return _written(urdf), _DESCRIPTION
    raise RobotError(f"a robot is a path, URDF text or a yourdfpy.URDF, not {type(urdf).__name__}")


def _written(urdf: WritesUrdf) -> str:
    """Text of a robot that writes itself, with the mimic tags that yourdfpy (to 0.0.60) reads but does not write."""
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


def _read(path: Path) -> tuple[str, str]:
    source = f"the robot file {str(path)!r}"
    try:
        if path.exists() and not path.is_dir():
            if not path.is_file():
                raise RobotError(f"{source} is a pipe or a device, not a file", name=str(path))
            if path.stat().st_size > _LARGEST_FILE:
                raise RobotError(f"{source} is larger than any URDF ({_LARGEST_FILE >> 20} MiB)", name=str(path))
        return _decoded(path.read_bytes()).lstrip(), source
    except IsADirectoryError:
        problem = "is a folder, not a URDF file"
    except FileNotFoundError:
        problem = "does not exist"
    except OSError as error:
        problem = f"cannot be read: {error.strerror}"
    except ValueError:  # a name that no file can have
        problem = "does not exist"
    raise RobotError(f"{source} {problem}", name=str(path))


def _decoded(content: bytes) -> str:
    """Text of a file, whatever it says of its encoding; bytes that are none become marks."""
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


def _builtin_path(name: str) -> Path:
    package = Path(__file__).parent
    # A wheel carries the folder inside the package, a checkout beside it.
    folder = next((f for f in (package / "robots", package.parent / "robots") if f.is_dir()), package / "robots")
    known = sorted(path.stem for path in folder.glob("*.urdf"))
    if name not in known:
        raise _unknown(name, known, "built-in robot")
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
        raise _unknown(name, sorted(robots_loader.ROBOTS), "robot of example-robot-data")
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


def _unknown(name: str, known: list[str], what: str) -> RobotError:
    near = tuple(difflib.get_close_matches(name, known, n=5, cutoff=0.3)) or tuple(known)
    return RobotError(f"there is no {what} {name!r}; nearest: {', '.join(near)}", name=name, candidates=near)
