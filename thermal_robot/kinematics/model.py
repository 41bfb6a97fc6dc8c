"""Pinocchio model and constant arrays of one kinematic chain, from URDF text.

The linear coupling of joints that mimic another is applied outside Pinocchio. Its own (``JointModelMimic``, as of 4.1)
has Jacobians and gravity torques, but no regressors, wants the driving joint to be nearer to the root, and cannot hold
it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.lie import homogeneous
from thermal_robot.kinematics.urdf import nearest, parse_urdf, read


@dataclass(frozen=True)
class Mimic:
    """Mimic relation of a joint: ``multiplier`` times the position, rad or m, of ``joint`` + ``offset``."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class Coupling:
    """Affine map from the n driving joints to the M movable joints of a chain: ``matrix @ q + offset``.

    A driving joint's row of ``matrix`` (M, n) is a unit vector, that of a joint which stands still is zero. ``driving``
    (n,) numbers, among the movable joints, those that stand for the driving ones ``names``: the joint itself, or, of
    one beside the chain, the first that mimics it.
    """

    names: tuple[str, ...]
    driving: NDArray[np.int64]
    matrix: Array
    offset: Array

    def __post_init__(self) -> None:
        _freeze(self.driving, self.matrix, self.offset)

    def positions(self, q: Array) -> Array:
        """Positions (N, M) of the movable joints at (N, n) positions of the driving ones."""
        return q @ self.matrix.T + self.offset

    def leader(self, joint: int) -> int | None:
        """Driving joint of a movable one; ``None`` where it stands still."""
        found = np.flatnonzero(self.matrix[joint])
        return int(found[0]) if len(found) else None


def mimics(urdf: str, source: str = "the robot description") -> dict[str, Mimic]:
    """Mimic relations of all joints, which Pinocchio's default parsing drops."""
    found = {}
    for joint in read(urdf, source).iterfind("joint[@name]"):
        for said in joint.iterfind("mimic"):
            times, offset = float(said.get("multiplier", 1.0)), float(said.get("offset", 0.0))
            found[joint.get("name")] = Mimic(said.get("joint", ""), times, offset)
    return found


def followed(found: Mapping[str, Mimic], joints: Collection[str], chain: Collection[str]) -> dict[str, Mimic]:
    """Resolve chains of mimicking joints to relations with a driving joint.

    A joint that follows a missing joint or itself is an error in the chain; outside it, as in many published hands, it
    is left out.
    """
    ends = {}
    for name in found:
        try:
            ends[name] = _end(name, found, joints)
        except RobotError:
            if name in chain:
                raise
    return ends


def _end(name: str, found: Mapping[str, Mimic], joints: Collection[str]) -> Mimic:
    seen, end = [name], found[name]
    while True:
        if end.joint not in joints:
            near = nearest(end.joint, joints)
            raise RobotError(
                f"joint {seen[-1]!r} mimics {end.joint!r}, which is not a joint of the robot; "
                f"nearest: {', '.join(near)}",
                name=seen[-1],
                candidates=near,
            )
        if end.joint in seen:
            circle = " mimics ".join(repr(joint) for joint in (*seen[seen.index(end.joint) :], end.joint))
            raise RobotError(f"joints mimic each other in a circle: {circle}", name=end.joint)
        if end.joint not in found:
            return end
        seen.append(end.joint)
        before = found[end.joint]
        end = Mimic(before.joint, end.multiplier * before.multiplier, end.multiplier * before.offset + end.offset)


def couple(names: Sequence[str], ends: Mapping[str, Mimic], beside: Collection[str] = ()) -> Coupling:
    """Coupling of the movable joints of a chain to their driving joints (:func:`followed`).

    A joint of the chain that mimics one of the movable joints ``beside`` it makes that one a driving joint, too; one
    that mimics a fixed joint stays at its offset.
    """
    driving: dict[str, int] = {}
    for j, name in enumerate(names):
        end = ends.get(name, Mimic(name))
        if end.joint == name or (end.joint in beside and end.joint not in names and end.multiplier):
            driving.setdefault(end.joint, j)
    column = {driver: i for i, driver in enumerate(driving)}
    matrix, offset = np.zeros((len(names), len(driving))), np.zeros(len(names))
    for j, name in enumerate(names):
        end = ends.get(name, Mimic(name))
        offset[j] = end.offset
        if end.joint in column:
            matrix[j, column[end.joint]] = end.multiplier
    return Coupling(tuple(driving), np.array(list(driving.values()), dtype=np.int64), matrix, offset)


def common_limits(
    coupling: Coupling, names: Sequence[str], lower: Array, upper: Array, own: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Lower and upper limits (n,) of the driving joints within which every joint that follows them is within its own.

    All (M,) limits, and the driving joints' ``own`` (n,), are in rad or m, infinite where there is none. Refused where
    a joint and one that follows it are never both within their limits.
    """
    low, high = (np.array(limits) for limits in own)
    for j, name in enumerate(names):
        i = coupling.leader(j)
        if i is None:
            continue
        with np.errstate(over="ignore"):  # a joint that hardly follows never comes to its limits
            ends = (np.array([lower[j], upper[j]]) - coupling.offset[j]) / coupling.matrix[j, i]
        low[i], high[i] = max(low[i], ends.min()), min(high[i], ends.max())
        if low[i] > high[i]:
            raise RobotError(
                f"joint {name!r} mimics {coupling.names[i]!r}, but the two are never both within their limits",
                name=name,
            )
    return low, high


def held_configuration(model: pin.Model, ends: Mapping[str, Mimic]) -> Array:
    """Neutral configuration (nq,) of the whole model: joints at 0 or the limit nearest to it, mimics following."""
    q = np.asarray(pin.neutral(model), dtype=float)
    for joint in list(model.joints)[1:]:
        if joint.nq == 1:
            low, high = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
            if low < high:
                q[joint.idx_q] = min(max(0.0, low), high)
    for name, end in ends.items():
        position = end.multiplier * held_position(model, q, end.joint) + end.offset
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 1:
            q[joint.idx_q] = position
        elif joint.nv == 1:
            q[joint.idx_q : joint.idx_q + 2] = np.cos(position), np.sin(position)
    return q


def held_position(model: pin.Model, q: Array, name: str) -> float:
    """Position of one joint in a configuration of the whole model, rad or m; 0 for a fixed one."""
    if not model.existJointName(name):
        return 0.0
    joint = model.joints[model.getJointId(name)]
    if joint.nv != 1:
        raise RobotError(f"joint {name!r}, which another one mimics, has no single position", name=name)
    if joint.nq == 1:
        return float(q[joint.idx_q])
    return float(np.arctan2(q[joint.idx_q + 1], q[joint.idx_q]))


_NO_MASS = 1e-12
"""kg; smallest mass of a body without the links fixed to it: less is the rounding error of that difference."""


def hanging_masses(full: pin.Model, elements: Sequence[int], held: Array) -> tuple[Array, Array]:
    """Mass (K,) kg and its centre (K, 3) m fixed to each element of a chain, up to its next movable joint.

    Pinocchio lumps the links between two joints into one body; a frame in its midst carries those behind it only.
    """
    data = full.createData()
    pin.framesForwardKinematics(full, data, held)
    place = {e: k for k, e in enumerate(elements)}
    masses, moments = np.zeros(len(elements)), np.zeros((len(elements), 3))
    for frame, mass, centre in _links(full, data):
        while frame:
            k = place.get(frame)
            if k is not None:
                if full.frames[frame].type == pin.FrameType.JOINT:
                    break
                masses[k] += mass
                moments[k] += mass * data.oMf[frame].actInv(centre)
            frame = full.frames[frame].parentFrame
    return masses, moments / np.where(masses > 0.0, masses, 1.0)[:, None]


def _links(full: pin.Model, data: pin.Data) -> list[tuple[int, float, Array]]:
    """List the frame of each link's mass, its mass (kg) and centre in the world (m); fixed links apart from bodies."""
    found = []
    joined = np.zeros(full.njoints)
    moment = np.zeros((full.njoints, 3))
    for f, frame in enumerate(full.frames):
        # Pinocchio keeps the inertia of a link behind a fixed joint with that joint's frame, too
        if frame.type == pin.FrameType.FIXED_JOINT and frame.inertia.mass > 0.0:
            mass, centre = frame.inertia.mass, data.oMf[f].act(frame.inertia.lever)
            found.append((f, float(mass), np.asarray(centre)))
            joined[frame.parentJoint] += mass
            moment[frame.parentJoint] += mass * centre
    for f, frame in enumerate(full.frames):
        if frame.type == pin.FrameType.JOINT:
            j, body = frame.parentJoint, full.inertias[frame.parentJoint]
            mass = body.mass - joined[j]
            if mass > _NO_MASS:
                centre = (body.mass * data.oMi[j].act(body.lever) - moment[j]) / mass
                found.append((f, float(mass), np.asarray(centre)))
    return found


STANDARD_GRAVITY = 9.81
"""m/s²; the value Pinocchio uses."""

SHORTEST_SEGMENT = 1e-9
"""m; a placement shorter than this has no direction along which it could grow."""

FIXED, REVOLUTE, PRISMATIC = 0, 1, 2
"""Kinds of chain element."""


@dataclass(frozen=True, eq=False)
class Chain:
    """Constant arrays of the chain, taken once from Pinocchio.

    It has K elements (URDF joints, fixed ones too), M movable joints and S segments. Of the movable joints n drive and
    the others mimic one: M = n unless the URDF has ``<mimic>`` tags.

    Parameters
    ----------
    names
        K names of URDF joints.
    parent_links
        K names of the links to which they are attached.
    rotations, translations
        (K, 3, 3) and (K, 3) m: placement of each element in the frame of its parent link.
    kinds
        (K,) ``FIXED``, ``REVOLUTE`` or ``PRISMATIC``.
    axes
        (K, 3) unit axis of motion in the element's frame; zero for a fixed one.
    movable
        (M,) elements of the movable joints, mimicking ones too.
    coupling
        Positions of the movable joints from those of the driving ones.
    placed
        (S,) segments: elements of the movable joints, and of fixed frames that have a length.
    masses
        (M,) kg carried by each movable joint up to the next one, held branches included.
    mass_centres
        (M, 3) m: centre of these masses in the frame of the element *after* the joint (the tool frame for the
        last), which is fixed to the same body.
    hanging, hanging_centres
        (K,) kg and (K, 3) m: the part of a body's mass that lies beyond a fixed element, and its centre in the
        element's frame; zero for a movable joint.
    """

    names: tuple[str, ...]
    parent_links: tuple[str, ...]
    rotations: Array
    translations: Array
    kinds: NDArray[np.int64]
    axes: Array
    movable: NDArray[np.int64]
    coupling: Coupling
    placed: NDArray[np.int64]
    masses: Array
    mass_centres: Array
    hanging: Array
    hanging_centres: Array

    def __post_init__(self) -> None:
        _freeze(*vars(self).values())

    @property
    def placements(self) -> Array:
        """Homogeneous matrices (K, 4, 4) of the elements in the frames of their parent links."""
        return homogeneous(self.rotations, self.translations)


def build_chain_model(
    urdf: str,
    tool_frame: str,
    root_frame: str | None,
    gravity: Array | None,
    source: str = "the robot description",
) -> dict[str, Any]:
    """Read a URDF and reduce it to the chain from root frame to tool frame; returns those fields of a robot.

    A joint that is not in the chain is held at 0, or at the limit nearest to 0; one that mimics another, where that one
    takes it. One outside that a joint of the chain mimics is no part of the chain and yet drives it: it is one of its
    joints. Without a root frame it is the root link of the URDF, without ``gravity`` (3,) 9.81 m/s² down its z axis.
    :class:`RobotError` if the text is not a URDF, a link is unknown, the tool is not below the root frame, the chain
    holds no movable joint or one of another kind, or one that mimics what does not exist, has no single position, or is
    in the end itself.
    """
    full = parse_urdf(urdf, source)
    links = {frame.name: i for i, frame in enumerate(full.frames) if frame.type == pin.FrameType.BODY}
    root = min(links.values()) if root_frame is None else _find_link(full, links, root_frame, "root frame")
    elements = _elements_between(full, root, _find_link(full, links, tool_frame, "tool frame"))
    joints = [f.name for i, f in enumerate(full.frames) if i > 0 and f.type in _JOINTS]  # the first is the world
    # a fixed joint stays where it is, whatever it is said to mimic
    found = {name: mimic for name, mimic in mimics(urdf, source).items() if full.existJointName(name)}
    ends = followed(found, joints, [full.frames[e].name for e in elements])
    held = held_configuration(full, ends)
    moving = [full.frames[e] for e in elements if full.frames[e].type == pin.FrameType.JOINT]
    for frame in moving:
        _joint_type(full, frame.name)
    in_chain = {frame.parentJoint for frame in moving}
    model = held_at(full, [j for j in range(1, full.njoints) if j not in in_chain], held)
    names = tuple(model.names)[1:]
    coupling = couple(names, ends, tuple(full.names)[1:])
    if not len(coupling.driving):
        raise RobotError("the chain has no movable joint between its root frame and its tool frame")
    data = full.createData()
    pin.framesForwardKinematics(full, data, held)
    root_rotation = data.oMf[root].rotation
    if gravity is None:
        gravity = root_rotation.T @ np.array([0.0, 0.0, -STANDARD_GRAVITY])
    model.gravity.linear = root_rotation @ gravity
    lower, upper = common_limits(coupling, names, *_limits(model, names), _limits(full, coupling.names))
    _freeze(gravity, lower, upper)
    return {
        "name": model.name,
        "root_frame": full.frames[root].name,
        "gravity": gravity,
        "joint_names": coupling.names,
        "joint_types": tuple(_joint_type(full, name) for name in coupling.names),
        "lower": lower,
        "upper": upper,
        "chain": _chain_arrays(full, model, elements, held, coupling),
        "model": model,
        "urdf_links": tuple(links),
        "urdf_joints": tuple(joints),
    }


_JOINTS = (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT)


def leaf_links(urdf: str, source: str = "the robot description") -> tuple[str, ...]:
    """Names of the leaf links of a URDF, which carry no further joint: the usual tool frames."""
    model = parse_urdf(urdf, source)
    parents = {frame.parentFrame for frame in model.frames}
    ends = [f for i, f in enumerate(model.frames) if f.type == pin.FrameType.BODY and i not in parents]
    return tuple(frame.name for frame in ends)


def held_at(full: pin.Model, held_joints: list[int], held: Array) -> pin.Model:
    """Reduce a Pinocchio model by fixing joints (indices) at a configuration; a link may have the name of a joint."""
    # Pinocchio's reduction asks for frames by name alone, and stops where a link and a joint share one.
    mark = "link "
    renamed = full.copy()
    for i, frame in enumerate(renamed.frames):
        if frame.type == pin.FrameType.BODY:
            frame.name = mark + frame.name
        elif i > 0 and frame.name == full.names[0]:
            raise RobotError(
                f"a joint is called {frame.name!r}, Pinocchio's name for the world: rename it",
                name=frame.name,
            )
    model = pin.buildReducedModel(renamed, held_joints, held)
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY:
            frame.name = frame.name.removeprefix(mark)
    return model


def _chain_arrays(full: pin.Model, model: pin.Model, elements: list[int], held: Array, coupling: Coupling) -> Chain:
    frames = [full.frames[e] for e in elements]
    placements = []
    for frame in frames:  # of a URDF joint, in the frame of its parent link
        moves = frame.type == pin.FrameType.JOINT
        placed = full.jointPlacements[frame.parentJoint] if moves else frame.placement
        placements.append(full.frames[frame.parentFrame].placement.actInv(placed))
    kinds, axes = _kinds_and_axes(full, frames)
    movable = np.flatnonzero(kinds)
    bodies = list(model.inertias)[1:]
    centres = np.empty((len(movable), 3))
    for j, k in enumerate(movable.tolist()):
        centres[j] = placements[k + 1].actInv(bodies[j].lever) if k + 1 < len(elements) else bodies[j].lever
    translations = np.array([p.translation for p in placements])
    long = np.linalg.norm(translations, axis=1) > SHORTEST_SEGMENT
    long[movable] = True
    hanging, hanging_centres = hanging_masses(full, elements, held)
    return Chain(
        names=tuple(frame.name for frame in frames),
        parent_links=tuple(full.frames[frame.parentFrame].name for frame in frames),
        rotations=np.array([p.rotation for p in placements]),
        translations=translations,
        kinds=kinds,
        axes=axes,
        movable=movable,
        coupling=coupling,
        placed=np.flatnonzero(long),
        masses=np.array([body.mass for body in bodies]),
        mass_centres=centres,
        hanging=hanging,
        hanging_centres=hanging_centres,
    )


def _kinds_and_axes(full: pin.Model, frames: list[pin.Frame]) -> tuple[NDArray[np.int64], Array]:
    kinds, axes = np.zeros(len(frames), dtype=np.int64), np.zeros((len(frames), 3))
    for k, frame in enumerate(frames):
        if frame.type == pin.FrameType.JOINT:
            motion = unit_motion(full, full.joints[frame.parentJoint])
            kinds[k] = PRISMATIC if np.any(motion[:3]) else REVOLUTE
            axes[k] = motion[:3] + motion[3:]
            if not np.isclose(np.linalg.norm(axes[k]), 1.0):
                raise RobotError(f"the axis of joint {frame.name!r} has no direction", name=frame.name)
    return kinds, axes


def unit_motion(model: pin.Model, joint: pin.JointModel) -> Array:
    """Twist (6,) of a joint with one degree of freedom, in its own frame, for a unit speed."""
    data = joint.createData()
    # Pinocchio reads at the joint's place in the whole configuration; past the end of a shorter vector.
    joint.calc(data, pin.neutral(model))
    return np.asarray(data.S, dtype=float).reshape(6)


def _elements_between(model: pin.Model, root: int, tool: int) -> list[int]:
    """Frame indices of the URDF joints from a root link to a tool link, in order; an error if that is no descendant."""
    elements: list[int] = []
    frame = tool
    while frame != root:
        if frame == 0:
            raise RobotError(
                f"tool frame {model.frames[tool].name!r} is not below root frame {model.frames[root].name!r}",
                name=model.frames[tool].name,
            )
        if model.frames[frame].type in _JOINTS:
            elements.append(frame)
        frame = model.frames[frame].parentFrame
    return elements[::-1]


def _joint_type(model: pin.Model, name: str) -> str:
    kind = model.joints[model.getJointId(name)].shortname()
    if kind.startswith("JointModelRUB") or kind == "JointModelRevoluteUnboundedUnaligned":
        return "continuous"
    if kind.startswith("JointModelR"):
        return "revolute"
    if kind.startswith("JointModelPrismatic") or kind in ("JointModelPX", "JointModelPY", "JointModelPZ"):
        return "prismatic"
    named = {"JointModelFreeFlyer": "floating", "JointModelPlanar": "planar"}.get(kind, kind)
    raise RobotError(
        f"joint {name!r} of the chain is {named}; only revolute, continuous, prismatic and fixed joints are supported",
        name=name,
    )


def _limits(model: pin.Model, names: Sequence[str]) -> tuple[Array, Array]:
    """Lower and upper position limits of some joints; infinite for continuous ones and where the URDF gives none."""
    lower, upper = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    for i, name in enumerate(names):
        joint = model.joints[model.getJointId(name)]
        low, high = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        # A URDF <limit> without its bounds reads as 0 and 0: an absent limit, not a joint that cannot move.
        if joint.nq == 1 and low < high:
            lower[i], upper[i] = low, high
    return lower, upper


def _find_link(model: pin.Model, links: dict[str, int], name: str, role: str) -> int:
    if name in links:
        return links[name]
    near = nearest(name, links)
    raise RobotError(
        f"{role} {name!r} is not a link of robot {model.name!r}; nearest: {', '.join(near)}",
        name=name,
        candidates=near,
    )


def _freeze(*values: Any) -> None:
    for value in values:
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
