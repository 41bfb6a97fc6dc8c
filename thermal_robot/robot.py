"""Robot model: one chain of a URDF, from a root frame to a tool frame, with the segments that can grow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.model import SHORTEST_SEGMENT, Chain, build_chain_model, leaf_links
from thermal_robot.kinematics.urdf import require_numbers
from thermal_robot.tables import html_table
from thermal_robot.urdf_text import DESCRIPTION, WritesUrdf, urdf_text

if TYPE_CHECKING:
    from collections.abc import Callable


_MOST_SHOWN = 12
"""Largest number of names in one message; a humanoid has dozens of fingers."""
STRONGEST_GRAVITY = 100.0
"""m/s²: four times that of any planet where a robot has been sent; a figure in mm/s² is above it."""
WIDE = 2.4
"""rad: range, to either side, in which poses of a joint that can turn fully are planned; nearly once round."""
ENDS = ("tool_frame", "root_frame")
"""Names of the links between which the chain lies, as a robot, a campaign and a model call them."""


@dataclass(frozen=True, eq=False)
class Segment:
    """Fixed transform to a movable joint's origin, or to a fixed frame at a distance: where a link may bend or grow.

    Parameters
    ----------
    name
        URDF joint, movable or fixed, whose origin it is.
    parent_link
        Link that carries it.
    length
        m.
    direction
        (3,) unit vector along which it grows, in its own frame (behind its placement's rotation), for a right
        perturbation; zero where two joints' origins coincide.
    index
        Chain element that it belongs to.
    movable
        Whether the placement is a movable joint's.
    joint
        Name of the joint whose position moves what is behind it: its own, or the one that it mimics; ``None`` for a
        fixed frame, and for a joint that mimics a fixed one.
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
    """Kinematic chain with n driven joints and S segments; made by :func:`load_robot`, immutable.

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
        on. A joint that mimics another is none of them: it follows. One beside the chain that a joint of the chain
        mimics is among them, where the first that follows it is.
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
    folder
        Folder of the URDF's file, to which mesh paths are relative; ``None`` where it came as text.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
    >>> robot
    Robot('rv_m2', 'base_link' to 'tool0', 5 joints, 7 segments)
    >>> robot.n, robot.joint_names[0], round(robot.mass, 1)
    (5, 'joint_1', 20.0)
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
    folder: Path | None = None

    @property
    def n(self) -> int:
        """Number of driven joints."""
        return len(self.joint_names)

    @property
    def mass(self) -> float:
        """Moving mass, kg; 0 where the URDF gives none."""
        return float(np.sum(self.chain.masses))

    def __repr__(self) -> str:
        ends = f"{self.root_frame!r} to {self.tool_frame!r}"
        return f"Robot({self.name!r}, {ends}, {self.n} joints, {len(self.segments)} segments)"

    def _repr_html_(self) -> str:
        bounds = zip(self.joint_names, self.joint_types, self.lower, self.upper, strict=True)
        rows = [(name, kind, _limit_text(kind, low), _limit_text(kind, high)) for name, kind, low, high in bounds]
        weight = f", {self.mass:.3g} kg" if self.has_masses else ", no masses"
        heading = f"{self.name}: {self.root_frame} to {self.tool_frame}, {len(self.segments)} segments{weight}"
        return html_table(rows, head=("joint", "type", "lower limit", "upper limit"), heading=heading)

    def forward(self, q: ArrayLike) -> Array:
        """Forward kinematics: pose of the tool frame in the root frame.

        Parameters
        ----------
        q
            (n,) joint positions of one configuration, or (N, n) of many; rad, m where a joint slides.

        Returns
        -------
        ndarray
            (4, 4), or (N, 4, 4): homogeneous matrices, lengths in m.

        Raises
        ------
        RobotError
            Another shape, or a position that is no finite number.

        Examples
        --------
        >>> import thermal_robot as tr
        >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
        >>> robot.forward([0.0] * 5).shape, robot.forward([[0.0] * 5] * 3).shape
        ((4, 4), (3, 4, 4))
        """
        from thermal_robot.kinematics.frames import tool_poses

        return self._at(tool_poses, q)

    def jacobian(self, q: ArrayLike) -> Array:
        """Geometric Jacobian of the tool frame: linear, then angular velocity, in root frame axes.

        Pinocchio calls it ``LOCAL_WORLD_ALIGNED``.

        Parameters
        ----------
        q
            (n,) or (N, n), as for :meth:`forward`.

        Returns
        -------
        ndarray
            (6, n), or (N, 6, n): m and rad a rad, or a m where a joint slides.

        Raises
        ------
        RobotError
            Another shape, or a position that is no finite number.

        Examples
        --------
        >>> import thermal_robot as tr
        >>> robot = tr.load_robot("builtin:rv_m2", "tool0")
        >>> robot.jacobian([0.0] * 5).shape
        (6, 5)
        """
        from thermal_robot.kinematics.frames import frame_jacobians

        return self._at(frame_jacobians, q)

    def _at(self, function: Callable[[Robot, Array], Array], q: ArrayLike) -> Array:
        """Apply a batch function to many configurations, or to a single one."""
        rows = self._configurations(q)
        found = function(self, np.atleast_2d(rows))
        return found if rows.ndim == 2 else np.asarray(found[0])

    def _configurations(self, q: ArrayLike) -> Array:
        try:
            rows = np.asarray(q, dtype=float)
        except (TypeError, ValueError) as error:
            raise RobotError(f"joint positions are numbers, got {q!r:.60}", name=self.name) from error
        if rows.ndim not in (1, 2) or rows.shape[-1] != self.n:
            expected = f"expected ({self.n},) or (N, {self.n})"
            raise RobotError(
                f"joint positions of shape {rows.shape} do not fit {self.name!r}: {expected}", name=self.name
            )
        if not np.isfinite(rows).all():
            raise RobotError("joint positions are finite numbers, got NaN or an infinite one", name=self.name)
        return rows

    def __reduce__(self) -> tuple[Callable[..., Robot], tuple[Any, ...]]:
        # Rebuilt from its text, so that a saved robot survives a change of Pinocchio's own format.
        return _build, (self.urdf, self.tool_frame, self.root_frame, self.gravity, DESCRIPTION, self.folder)


def load_robot(
    urdf: str | Path | WritesUrdf,
    tool_frame: str,
    *,
    root_frame: str | None = None,
    gravity: ArrayLike | None = None,
) -> Robot:
    """Load the chain of a robot from its URDF; meshes are not read.

    Joints outside the chain, and those between the root of the URDF and ``root_frame``, are held at 0, or at
    their limit nearest to 0. A joint of the chain with a ``<mimic>`` tag follows the joint that it names, wherever that
    one is: one beside the chain is a joint of the robot, too, its own link being held. Outside the chain a joint with
    such a tag is held, where the held position of the other one takes it.

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

    Examples
    --------
    >>> import thermal_robot as tr
    >>> tr.load_robot("builtin:rv_m2", "tool0").joint_names
    ('joint_1', 'joint_2', 'joint_3', 'joint_4', 'joint_5')

    Without a tool frame, those that there are get named:

    >>> tr.load_robot("builtin:rv_m2", "")
    Traceback (most recent call last):
    thermal_robot.errors.RobotError: no tool frame is given; the links at the ends of this robot are tool0
    """
    text, source, folder = urdf_text(urdf)
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
    return _build(text, tool_frame, root_frame, _three_finite_numbers(gravity), source, folder)


def joint_range(robot: Robot) -> tuple[Array, Array]:
    """Lower and upper joint limits (n,), rad or m; of a full turn cut to ±2.4 rad; infinite for an unlimited slide."""
    turns = np.array([kind != "prismatic" for kind in robot.joint_types])
    round_ = turns & (robot.upper - robot.lower >= 2.0 * np.pi)
    low = np.where(round_, np.maximum(robot.lower, -WIDE), robot.lower)
    return low, np.where(round_, np.minimum(robot.upper, WIDE), robot.upper)


def _limit_text(kind: str, limit: float) -> str:
    if not np.isfinite(limit):
        return "none"
    return f"{limit:.4g} m" if kind == "prismatic" else f"{np.degrees(limit):.4g}°"


def _build(
    urdf: str,
    tool_frame: str,
    root_frame: str | None,
    gravity: Array | None,
    source: str = DESCRIPTION,
    folder: Path | None = None,
) -> Robot:
    built = build_chain_model(urdf, tool_frame, root_frame, gravity, source)
    chain, joints = built["chain"], built["joint_names"]
    return Robot(
        urdf=urdf,
        tool_frame=tool_frame,
        has_masses=bool(np.any(chain.masses > 0.0)),
        segments=tuple(_segment(chain, joints, int(k)) for k in chain.placed),
        folder=folder,
        **built,
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
