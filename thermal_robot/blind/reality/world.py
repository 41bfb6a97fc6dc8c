"""Multibody model of the robot in MuJoCo: stretched, bent, on springs under gravity and payload."""

from __future__ import annotations

import re
from copy import copy
from dataclasses import dataclass, replace
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def from_vector(twists: Array) -> Array:
    """Homogeneous transforms (N, 4, 4) from translations (m) and rotation vectors (rad), (N, 6)."""
    motion = np.tile(np.eye(4), (len(twists), 1, 1))
    motion[:, :3, :3] = Rotation.from_rotvec(twists[:, 3:]).as_matrix()
    motion[:, :3, 3] = twists[:, :3]
    return motion


def rpy_matrix(rpy: Array) -> Array:
    """Rotation matrix (3, 3) of roll, pitch, yaw (rad) about the fixed axes x, y, z, in this order."""
    return np.asarray(Rotation.from_euler("xyz", rpy).as_matrix())


def quaternion(rotation: Array) -> Array:
    """Quaternion (..., 4), scalar first, of rotation matrices."""
    return np.roll(Rotation.from_matrix(rotation).as_quat(), 1, axis=-1)


def anywhere(rng: np.random.Generator, reach: float) -> Array:
    """Draw a homogeneous transform (4, 4): uniform rotation, translation uniform within ±``reach`` (m) on each axis."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.random(rng=rng).as_matrix()
    motion[:3, 3] = rng.uniform(-reach, reach, 3)
    return motion


def free_columns(reference: Array, rotation: Array, base: bool, tool: bool) -> Array:
    """Jacobian (3N, K) of positions ``reference`` (N, 3) by the unknown frames; K is 0, 3, 6 or 9.

    ``base``: three translations, and three rotations about the centroid; ``tool``: three coordinates of the target.
    """
    n, centred = len(reference), reference - reference.mean(axis=0)
    parts = []
    if base:
        turn = np.zeros((n, 3, 3))
        for axis in range(3):
            turn[:, :, axis] = np.cross(np.eye(3)[axis], centred)
        parts += [np.tile(np.eye(3), (n, 1, 1)), turn]
    if tool:
        parts.append(rotation)
    return np.concatenate(parts, axis=2).reshape(3 * n, -1) if parts else np.zeros((3 * n, 0))


@dataclass(frozen=True)
class Joint:
    """Joint of a URDF: origin (``xyz``, ``rpy``) in its parent link, unit ``axis`` in its own frame, limits, type.

    ``mimic`` is the joint that it follows, with multiplier and offset; ``None`` for one that follows no other.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: Array
    rpy: Array
    axis: Array
    lower: float = -np.inf
    upper: float = np.inf
    mimic: tuple[str, float, float] | None = None

    @property
    def movable(self) -> bool:
        """Whether the joint is revolute, continuous or prismatic."""
        return self.kind in ("revolute", "continuous", "prismatic")

    @property
    def commanded(self) -> bool:
        """Whether the joint is movable and mimics no other."""
        return self.movable and self.mimic is None

    @property
    def held(self) -> float:
        """Position of a joint that is not commanded: 0, clipped to its limits."""
        return float(np.clip(0.0, self.lower, self.upper))

    def displaced(self, error: Array) -> tuple[Array, Array]:
        """Shift (3,), m, and whole rotation (3, 3) of the joint's frame in its parent link, if its placement errs.

        ``error`` (6,) is a translation (m) and a rotation vector (rad) in the joint's own frame.
        """
        rotation, motion = rpy_matrix(self.rpy), from_vector(error[None])[0]
        return rotation @ motion[:3, 3], rotation @ motion[:3, :3]


@dataclass(frozen=True)
class Tree:
    """Kinematic tree of a URDF: its root link, joints from there on, masses (kg), centres of mass (3,), m, by link."""

    root: str
    joints: tuple[Joint, ...]
    mass: dict[str, float]
    centre: dict[str, Array]

    def carried(self, link: str) -> float:
        """Mass of a link and its descendants, kg."""
        return self.mass[link] + sum(self.carried(j.child) for j in self.joints if j.parent == link)

    def chain(self, tool_frame: str) -> tuple[Joint, ...]:
        """Joints on the path from the root to a link, fixed ones too."""
        by_child = {j.child: j for j in self.joints}
        found: list[Joint] = []
        link = tool_frame
        while link != self.root:
            found.insert(0, by_child[link])
            link = found[0].parent
        return tuple(found)


def read(text: str) -> Tree:
    """Parse the kinematic tree, masses and centres of mass of a URDF's text."""
    robot = ElementTree.fromstring(re.sub(r"<\?xml[^>]*\?>", "", text).strip())
    mass, centre = {}, {}
    for link in robot.findall("link"):
        name, weight = link.attrib["name"], link.find("inertial/mass")
        mass[name] = 0.0 if weight is None else float(weight.attrib["value"])
        centre[name] = _numbers(link.find("inertial/origin"), "xyz")
    joints = {j.child: j for j in map(_joint, robot.findall("joint"))}
    root = next(name for name in mass if name not in joints)
    ordered: list[Joint] = []
    reached = [root]
    while reached:
        at = reached.pop()
        below = [j for j in joints.values() if j.parent == at]
        ordered += below
        reached += [j.child for j in below]
    return Tree(root, tuple(ordered), mass, centre)


def _joint(node: ElementTree.Element) -> Joint:
    told = {child.tag: child.attrib for child in node}
    kind, axis = node.attrib["type"], _numbers(told.get("axis"), "xyz", "1 0 0")
    limit, mimic = told.get("limit") if kind in ("revolute", "prismatic") else None, told.get("mimic")
    return Joint(
        name=node.attrib["name"],
        kind=kind,
        parent=told["parent"]["link"],
        child=told["child"]["link"],
        xyz=_numbers(told.get("origin"), "xyz"),
        rpy=_numbers(told.get("origin"), "rpy"),
        axis=axis / max(float(np.linalg.norm(axis)), 1e-12),
        mimic=(mimic["joint"], float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0))) if mimic else None,
        **({} if limit is None else {side: float(limit.get(side, 0.0)) for side in ("lower", "upper")}),
    )


def _numbers(node: ElementTree.Element | dict[str, str] | None, name: str, absent: str = "0 0 0") -> Array:
    written = absent if node is None else node.get(name, "0 0 0")
    return np.array(written.split(), dtype=float)


NODES = 3  # hinges into which a beam's bending is lumped
_SHORTEST = 1e-6  # m
_SETTLED = 1e-13  # rad
_ROUNDS = 60
_ROTOR = 1.0  # kg m², kg: MuJoCo wants inertia in every freedom; where nothing is accelerated it plays no part


@dataclass
class Body:
    """Deviations of a robot from its URDF over N measurements; zeros and identities in a sound robot.

    Attributes
    ----------
    joints, springs
        (N, n) by how much each joint stands elsewhere than commanded, rad or m; (n,) its compliance, rad/(N·m).
    beams, bow
        (S, 2) bending compliance 1/(E I) of each segment about its two cross axes, 1/(N·m²); (N, S, 2) curvature that
        it has by itself about the same axes, 1/m.
    growth
        (N, S) relative growth of each segment.
    placements
        (N, S', 6) or (S', 6) displacement of the placements of the S' joints of the chain (m, then rotation vector), in
        their own frames.
    base, tool
        (N, 4, 4) motion of the base as seen by the instrument, of the target on the tool frame.
    scale
        Of the instrument: measured = (1 + scale) · true.
    """

    joints: Array
    springs: Array
    beams: Array
    bow: Array
    growth: Array
    placements: Array
    base: Array
    tool: Array
    scale: float = 0.0

    def take(self, rows: NDArray[np.int64]) -> Body:
        """Copy of the body for a subset of the measurements, by their indices."""
        each = {name: getattr(self, name)[rows] for name in ("joints", "bow", "growth", "base", "tool")}
        return replace(self, **each, placements=self.placements[rows] if self.placements.ndim == 3 else self.placements)

    def move(self, where: str, twists: Array) -> None:
        """Compose the motion of ``base`` or ``tool`` on the right with translations (m) and rotation vectors (N, 6)."""
        setattr(self, where, getattr(self, where) @ from_vector(twists))


class World:
    """Statics of a robot in MuJoCo, from its URDF: rigid, or with springs, beams and growth; gravity and payload act.

    Parameters
    ----------
    urdf, tool_frame
        XML text, and the link that carries the target.
    payload_com
        (3,) centre of mass of what it carries, in the tool frame, m.

    Attributes
    ----------
    joints, chain
        The n joints of the chain that are commanded; all its joints, fixed ones and those that follow another one too.
    coupling, rest
        (m, n) and (m,) where the m movable joints of the chain stand, those that follow another one among them:
        coupling · q + rest.
    segments, pieces
        Indices into ``chain`` of placements with a length, S of them, and length of the pieces of each one's beam, m.
    slides
        (n,) whether a joint slides, so that its position is in m, instead of turning.
    """

    def __init__(self, urdf: str, tool_frame: str, payload_com: tuple[float, float, float] = (0.0, 0.0, 0.05)):
        self.tree = read(urdf)
        self.tool_frame = tool_frame
        self.chain = self.tree.chain(tool_frame)
        self.joints: tuple[Joint, ...] = tuple(j for j in self.chain if j.commanded)
        self.moving = tuple(j for j in self.chain if j.movable)
        self.names = tuple(j.name for j in self.joints)
        self.slides = np.array([j.kind == "prismatic" for j in self.joints])
        self.segments = tuple(k for k, j in enumerate(self.chain) if np.linalg.norm(j.xyz) > _SHORTEST)
        self.grown = tuple(self.chain[k] for k in self.segments)
        self.links = tuple(joint.parent for joint in self.grown)
        self.lower = np.array([j.lower for j in self.joints])
        self.upper = np.array([j.upper for j in self.joints])
        self.n = len(self.joints)
        self.pieces = np.array([np.linalg.norm(joint.xyz) for joint in self.grown]) / NODES
        self.coupling, self.rest = self._coupling()
        self._com = payload_com
        self._sound: dict[bool, mujoco.MjModel] = {}

    def _coupling(self) -> tuple[Array, Array]:
        joints = {j.name: j for j in self.tree.joints}
        coupling, rest = np.zeros((len(self.moving), self.n)), np.zeros(len(self.moving))
        for row, joint in enumerate(self.moving):
            factor = 1.0
            while joint.mimic is not None:  # one may follow one that follows another
                driver, multiplier, offset = joint.mimic
                rest[row] += factor * offset
                factor, joint = factor * multiplier, joints[driver]
            if joint.name in self.names:
                coupling[row, self.names.index(joint.name)] = factor
            else:
                rest[row] += factor * joint.held
        return coupling, rest

    def sound(self, samples: int) -> Body:
        """Body of the sound robot, without any deviation, for a number of measurements."""
        s = len(self.segments)
        return Body(
            joints=np.zeros((samples, self.n)),
            springs=np.zeros(self.n),
            beams=np.zeros((s, 2)),
            bow=np.zeros((samples, s, 2)),
            growth=np.zeros((samples, s)),
            placements=np.zeros((len(self.chain), 6)),
            base=np.tile(np.eye(4), (samples, 1, 1)),
            tool=np.tile(np.eye(4), (samples, 1, 1)),
        )

    def poses(self, q: Array, payload: Array, body: Body) -> tuple[Array, Array]:
        """Solve forward kinematics in static equilibrium: tool poses (N, 4, 4) in the root frame, joint torques (N, n).

        In each row springs and beams of the body yield until they balance gravity and payload (kg). Torques in N·m.
        """
        bending = bool(np.any(body.beams) or np.any(body.bow))
        # a copy: rows stretch it
        model = copy(self.compile(bending, body.placements if body.placements.ndim == 2 else None))
        data = mujoco.MjData(model)
        tool = model.body(f"link:{self.tool_frame}").id
        address = self.address(model)
        pieces_of = [[f"{j.name}/{node}" for node in range(NODES * bending)] + [f"link:{j.child}"] for j in self.grown]
        steps = [[int(model.body(name).id) for name in names] for names in pieces_of]
        rest = model.body_pos.copy()
        nodes = self.nodes(model) if bending else np.zeros((0, 2, NODES), dtype=int)
        pieces = self.pieces[: len(nodes)]
        free, compliance = np.zeros(model.nv), np.zeros((model.nv, model.nv))
        # a spring turns a joint, and with it all that follow it
        compliance[np.ix_(address, address)] = (self.coupling * body.springs) @ self.coupling.T
        compliance[nodes, nodes] = (body.beams[: len(nodes)] * pieces[:, None])[:, :, None]
        poses, torque = np.tile(np.eye(4), (len(q), 1, 1)), np.zeros((len(q), self.n))
        each = body.placements if body.placements.ndim == 3 else None
        for i in range(len(q)):
            _carry(model, data, payload[i])
            model.body_pos[:] = rest
            for s, ids in enumerate(steps):
                model.body_pos[ids] = rest[ids] * (1.0 + body.growth[i, s])
            if each is not None:
                self._place(model, each[i])
            free[address] = self.coupling @ (q[i] + body.joints[i]) + self.rest
            free[nodes] = (body.bow[i, : len(nodes)] * pieces[:, None])[:, :, None]
            torque[i] = _static_torques(model, data, free, compliance)[address] @ self.coupling
            poses[i] = _pose(data, tool)
        return poses, torque

    def overturning(self, q: Array, payload: Array) -> Array:
        """Overturning moment (N, 3) of all links and the payload about the root frame's origin, N·m."""
        model = copy(self.compile(False, None))  # its payload changes
        data = mujoco.MjData(model)
        address = self.address(model)
        moments = np.empty((len(q), 3))
        for i in range(len(q)):
            _carry(model, data, payload[i])
            data.qpos[address] = self.coupling @ q[i] + self.rest
            mujoco.mj_kinematics(model, data)
            moments[i] = np.cross(model.body_mass @ data.xipos, model.opt.gravity)
        return moments

    def address(self, model: mujoco.MjModel) -> list[int]:
        """Return the indices of the chain's m movable joints in MuJoCo's generalised coordinates (``qpos``)."""
        return [int(model.joint(joint.name).qposadr[0]) for joint in self.moving]

    def compile(self, bending: bool, placements: Array | None) -> mujoco.MjModel:
        """Compile the MuJoCo model: ``bending`` makes beams of the segments, ``placements`` (S', 6) displace joints."""
        plain = placements is None or not placements.any()
        if plain and bending in self._sound:
            return self._sound[bending]
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        spec.compiler.fusestatic = False
        spec.compiler.boundmass = 1e-12
        spec.compiler.boundinertia = 1e-12
        spec.option.gravity = [0.0, 0.0, -9.81]
        in_chain = {j.name: k for k, j in enumerate(self.chain)}
        bodies = {self.tree.root: self._body(spec.worldbody, self.tree.root, np.zeros(3), np.eye(3))}
        for joint in self.tree.joints:
            k = in_chain.get(joint.name)
            offset, rotation = joint.xyz, rpy_matrix(joint.rpy)
            if k is not None and placements is not None:
                shift, rotation = joint.displaced(placements[k])
                offset = offset + shift
            parent = bodies[joint.parent]
            if bending and k in self.segments:
                parent = self._beam(parent, joint, offset)
                offset = offset / (2 * NODES)
            body = self._body(parent, joint.child, offset, rotation)
            if joint.movable and k is not None:
                slide = joint.kind == "prismatic"
                kind = mujoco.mjtJoint.mjJNT_SLIDE if slide else mujoco.mjtJoint.mjJNT_HINGE
                body.add_joint(name=joint.name, type=kind, axis=joint.axis, armature=_ROTOR)
            elif joint.movable and joint.held:
                self._hold(body, joint, rotation)
            bodies[joint.child] = body
        self._mass(bodies[self.tool_frame].add_body(name="payload"), 0.0, np.array(self._com))
        model = spec.compile()
        if plain:
            self._sound[bending] = model
        return model

    def _body(self, parent: mujoco.MjsBody, link: str, offset: Array, rotation: Array) -> mujoco.MjsBody:
        body = parent.add_body(name=f"link:{link}", pos=offset, quat=quaternion(rotation))
        return self._mass(body, self.tree.mass[link], self.tree.centre[link])

    @staticmethod
    def _mass(body: mujoco.MjsBody, mass: float, centre: Array) -> mujoco.MjsBody:
        # statics: how the mass is spread about its centre plays no part
        body.explicitinertial = True
        body.mass, body.ipos, body.inertia = mass, centre, np.full(3, 1e-3 * mass)
        return body

    @staticmethod
    def _hold(body: mujoco.MjsBody, joint: Joint, rotation: Array) -> None:
        if joint.kind == "prismatic":
            body.pos = body.pos + rotation @ joint.axis * joint.held
        else:
            turn = Rotation.from_rotvec(joint.axis * joint.held).as_matrix()
            body.quat = quaternion(rotation @ turn)

    def _beam(self, parent: mujoco.MjsBody, joint: Joint, offset: Array) -> mujoco.MjsBody:
        """Insert a beam along a joint's offset, as bodies with two hinges at each node; returns the last body."""
        first, second = cross_axes(offset)
        for node in range(NODES):
            step = offset / NODES * (0.5 if node == 0 else 1.0)
            parent = parent.add_body(name=f"{joint.name}/{node}", pos=step)
            self._mass(parent, 0.0, np.zeros(3))
            for axis, vector in enumerate((first, second)):
                name, kind = f"{joint.name}/{node}/{axis}", mujoco.mjtJoint.mjJNT_HINGE
                parent.add_joint(name=name, type=kind, axis=vector, armature=_ROTOR)
        return parent

    def nodes(self, model: mujoco.MjModel) -> NDArray[np.int64]:
        """Return the indices (S, 2, NODES) of the beams' hinges in MuJoCo's generalised coordinates (``qpos``)."""
        names = [[[f"{j.name}/{node}/{axis}" for node in range(NODES)] for axis in (0, 1)] for j in self.grown]
        return np.array([[[int(model.joint(n).qposadr[0]) for n in line] for line in pair] for pair in names])

    def _place(self, model: mujoco.MjModel, placements: Array) -> None:
        """Displace the joints' placements in a compiled model by the errors (S', 6) of one row."""
        for joint, error in zip(self.chain, placements, strict=True):
            body, (shift, rotation) = model.body(f"link:{joint.child}").id, joint.displaced(error)
            model.body_pos[body] += shift
            model.body_quat[body] = quaternion(rotation)


def _carry(model: mujoco.MjModel, data: mujoco.MjData, payload: float) -> None:
    """Set the payload's mass, kg, in a compiled model, and update its constants."""
    carried = model.body("payload").id
    if model.body_mass[carried] != payload:
        model.body_mass[carried] = payload
        mujoco.mj_setConst(model, data)


def _held(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the generalised forces (nv,) that hold the model against gravity at rest, by inverse dynamics."""
    held = np.zeros(model.nv)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_rne(model, data, 0, held)
    return held


def _static_torques(model: mujoco.MjModel, data: mujoco.MjData, free: Array, compliance: Array) -> Array:
    """Solve the static equilibrium of springs against gravity by fixed-point iteration; returns forces (nv,), N·m or N.

    ``free`` (nv,) are the coordinates without load, ``compliance`` (nv, nv) the springs'; ``data`` keeps the solution.
    """
    yields = bool(compliance.any())
    data.qpos[:] = free
    for _ in range(_ROUNDS):
        held = _held(model, data)
        settled = free - compliance @ held
        change = float(np.abs(settled - data.qpos).max())
        data.qpos[:] = settled
        if not yields or change < _SETTLED:
            break
    mujoco.mj_kinematics(model, data)
    return held


def cross_axes(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors perpendicular to a direction and to each other."""
    along = direction / np.linalg.norm(direction)
    least = np.eye(3)[np.argmin(np.abs(along))]
    first = np.cross(along, least)
    first /= np.linalg.norm(first)
    return first, np.cross(along, first)


@dataclass(frozen=True, eq=False)
class Slopes:
    """Jacobians of the target's position in the root frame by the deviations of a :class:`Body`, about the sound robot.

    Attributes
    ----------
    poses, target
        (M, 4, 4) of the tool frame, and (3,) the target in it, m.
    joints, torque
        (M, 3, n) by each joint that is commanded, with all that follow it; (M, n) what holds them, N·m.
    placements, growth
        (M, 3, S', 6) by the placement of each joint of the chain, in its own frame; (M, 3, S) by the relative growth
        of each segment.
    bow, sag
        (M, 3, S, 2) by the curvature of each segment, 1/m, and by its bending compliance, 1/(N·m²).
    """

    poses: Array
    target: Array
    joints: Array
    torque: Array
    placements: Array
    growth: Array
    bow: Array
    sag: Array

    def place(self, body: Body) -> Array:
        """First-order position (M, 3) of the target in the root frame for a faulty body."""
        tool = body.tool[:, :3, :3] @ self.target + body.tool[:, :3, 3]
        seen = np.einsum("mij,mj->mi", self.poses[:, :3, :3], tool) + self.poses[:, :3, 3]
        seen += np.einsum("mij,mj->mi", self.joints, body.joints - body.springs * self.torque)
        seen += np.einsum("mis,ms->mi", self.growth, body.growth)
        seen += np.einsum("misk,msk->mi", self.bow, body.bow)
        seen += np.einsum("misk,sk->mi", self.sag, body.beams)
        twists = "sk" if body.placements.ndim == 2 else "msk"
        seen += np.einsum(f"misk,{twists}->mi", self.placements, body.placements)
        seen = np.einsum("mij,mj->mi", body.base[:, :3, :3], seen) + body.base[:, :3, 3]
        return np.asarray(seen * (1.0 + body.scale))


def slopes(world: World, q: Array, payload: Array, target: Array) -> Slopes:
    """Compute the target's Jacobians at commands (M, n) with payloads (M,), kg; ``target`` (3,), tool frame, m."""
    model = copy(world.compile(True, None))  # its payload changes
    data = mujoco.MjData(model)
    address, nodes = world.address(model), world.nodes(model)
    tool, rows = model.body(f"link:{world.tool_frame}").id, []
    for command, weight in zip(q, payload, strict=True):
        _carry(model, data, weight)
        data.qpos[:] = 0.0
        data.qpos[address] = world.coupling @ command + world.rest
        held = _held(model, data)
        point = data.xpos[tool] + data.xmat[tool].reshape(3, 3) @ target
        turn = np.empty((3, model.nv))
        mujoco.mj_jac(model, data, turn, None, point, tool)
        hinges = turn[:, nodes]
        rows.append(
            (
                _pose(data, tool),
                turn[:, address] @ world.coupling,
                held[address] @ world.coupling,
                *_placed(world, model, data, point),
                hinges.sum(axis=3) * world.pieces[:, None],
                -(hinges * held[nodes]).sum(axis=3) * world.pieces[:, None],
            )
        )
    poses, joints, torque, placements, growth, bow, sag = (np.stack(part) for part in zip(*rows, strict=True))
    return Slopes(poses, target, joints, torque, placements, growth, bow, sag)


def _pose(data: mujoco.MjData, body: int) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
    return pose


def _placed(world: World, model: mujoco.MjModel, data: mujoco.MjData, point: Array) -> tuple[Array, Array]:
    """Jacobians of a point (root frame, m) by the joints' placements (3, S', 6) and by the segments' growth (3, S)."""
    placements, growth = np.empty((3, len(world.chain), 6)), np.empty((3, len(world.segments)))
    for k, joint in enumerate(world.chain):
        carrier = _pose(data, model.body(f"link:{joint.parent}").id)
        frame = carrier[:3, :3] @ rpy_matrix(joint.rpy)
        lever = point - carrier[:3, 3] - carrier[:3, :3] @ joint.xyz
        placements[:, k, :3] = frame
        placements[:, k, 3:] = np.cross(frame.T, lever).T
        if k in world.segments:
            growth[:, world.segments.index(k)] = carrier[:3, :3] @ joint.xyz
    return placements, growth
