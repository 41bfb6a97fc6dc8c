"""Calibrated robot as URDF, kinematics.yaml and Denavit-Hartenberg table: the constant part of a corrected model.

A kinematics.yaml of Universal Robots is read by ur_description and the driver for ROS; many controllers hold Denavit
and Hartenberg's parameters instead of a URDF. From the axis of a joint to the next one four numbers lead where the two
are not parallel: a turn θ about the axis, a shift d along it, the distance a along the common normal and the twist α
about it (Denavit and Hartenberg, *J. Appl. Mech.* 22, 1955). Of nearly parallel axes the common normal lies anywhere;
there d is left out and a turn β across both comes after α (Hayati and Mirmirani, *Journal of Robotic Systems* 2, 1985):

    base · Π_i [Rz(θ_i + q_i) Tz(d_i) Tx(a_i) Rx(α_i) Ry(β_i)] · tool

with q_i added to d_i where the joint slides. In Craig's modified convention a, α and β stand in the row of the joint
that they lead to: base · Π_i [Tx(a_i) Rx(α_i) Ry(β_i) Rz(θ_i + q_i) Tz(d_i)] · tool, which is the same product.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Units
from thermal_robot.campaign.names import PER_LINK, split_name
from thermal_robot.campaign.ur_kinematics import FIGURES, elements
from thermal_robot.correction.constant import FittedParameter, constant, determined, fitted_alone
from thermal_robot.correction.holding import FORMATS, PLACEMENTS, expectation
from thermal_robot.correction.model import CorrectedModel
from thermal_robot.effects import settings
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import Displacement, exp3, exp6, homogeneous, rotation_to_quaternion, rotation_to_rpy
from thermal_robot.kinematics.model import PRISMATIC
from thermal_robot.kinematics.urdf import rewritten, xyz_rpy
from thermal_robot.prediction import FileGap
from thermal_robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Nominal robot displaced by the constant part of a corrected model, at one temperature.

    Attributes
    ----------
    robot
        The nominal one.
    displacement
        Displacement of joints (n,) and segments (S, 6); base and tool are not displaced.
    base
        (4, 4) pose of the root frame in the measurement frame.
    target
        (4, 4) pose of the measured target in the tool frame.
    temperature
        °C at which its lengths hold; ``None`` where the model does not tell how they grow.
    held, undetermined, kept
        Parameters of the model that are in it; that were left out, as the data do not determine them; and that no robot
        file can hold, so that they stay in the model.
    min_sigma
        Standard deviations that those in it are away from zero at least; ``None`` where nobody asked.
    compared
        (4, 4) the target on the tool frame as the campaign declares it, where the robot was compared with a simulator
        of the user's own, which has it; ``None`` where it was compared with the URDF.
    beyond
        Warning if the temperature is outside the measured range; else empty.
    gaps
        Expected gap with robot files; empty where it is not known, as at another temperature.
    alone
        Whether what is in it was fitted without the rest of the model.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> warm.temperature, len(warm.held), {told.effect for told in warm.kept}
    (26.0, 5, {'backlash'})
    """

    robot: Robot
    displacement: Displacement
    base: Array
    target: Array
    temperature: float | None
    held: tuple[FittedParameter, ...]
    undetermined: tuple[FittedParameter, ...]
    kept: tuple[FittedParameter, ...]
    min_sigma: float | None = None
    compared: Array | None = None
    beyond: str = ""
    gaps: tuple[FileGap, ...] = ()
    alone: bool = False

    @property
    def joints(self) -> Array:
        """Zero offset (M,) of each movable joint, rad or m; a mimicking one follows its leader."""
        return np.asarray(self.robot.chain.coupling.matrix @ np.asarray(self.displacement.joint))

    @property
    def placements(self) -> Array:
        """Calibrated poses (K, 4, 4) of the chain's joints in their parent links: nominal · exp(ξ) exp(axis · zero)."""
        chain, segments = self.robot.chain, np.asarray(self.displacement.segment)
        placed = chain.placements
        for s, k in enumerate(chain.placed):
            placed[k] = placed[k] @ exp6(segments[s])
        for j, k in enumerate(chain.movable):
            along = np.zeros((2, 3))
            along[0 if chain.kinds[k] == PRISMATIC else 1] = chain.axes[k] * self.joints[j]
            placed[k] = placed[k] @ exp6(along.ravel())
        return placed

    @property
    def origins(self) -> Mapping[str, Array]:
        """Calibrated poses (4, 4) by joint name, of the joints that differ from the nominal robot."""
        chain = self.robot.chain
        moved = {*chain.placed[np.asarray(self.displacement.segment).any(axis=1)], *chain.movable[self.joints != 0.0]}
        placed = enumerate(zip(chain.names, self.placements, strict=True))
        return {name: pose for k, (name, pose) in placed if k in moved}

    @property
    def links(self) -> Mapping[str, tuple[str, Array]]:
        """Link of the target by name: its parent, the tool frame, and its pose there; empty where they coincide."""
        tool = self.robot.tool_frame
        return {target_link(tool): (tool, self.target)} if (self.target != np.eye(4)).any() else {}

    def notes(self, name: str) -> list[str]:
        """Remarks for the reader of a robot file, in lines; ``name`` is one of :data:`FORMATS`."""
        xyz, rpy = xyz_rpy(self.base)
        warm = "" if self.temperature is None else f", its lengths at {self.temperature:g} °C"
        lines = [
            f"Calibrated by thermal_robot: the robot {self.robot.name!r} from {self.robot.root_frame!r} to "
            f"{self.robot.tool_frame!r} as it was measured{warm}. All in m, rad, K and s.",
            f"In the measurement frame {self.robot.root_frame!r} stands at xyz=({xyz}) rpy=({rpy}).",
            *(f"The measured target is the link {link!r}." for link in self.links),
            "Joint positions are those that are commanded, and so are the limits: they stay as they were.",
        ]
        parts = {"Written here:": self.held}
        lines += expectation(self.gaps, name, self.min_sigma, self.alone)
        if self.alone:
            lines.append(
                "Fitted anew without what stays in the model: the values below are not those that are written."
            )
        if self.beyond:
            lines.append(f"{self.beyond[:1].upper()}{self.beyond[1:]}.")
        if self.compared is not None:
            lines.append("It was compared with your simulator (sim.*), not with the URDF: correct that one by this.")
        if self.min_sigma is not None:
            small = f"Left out, as they are less than {self.min_sigma:g} standard deviations from zero:"
            parts[small] = self.undetermined
        own = FORMATS[name]
        parts[f"Not written, as {own.title} cannot hold them; they stay in the model:"] = self.kept
        for title, told in parts.items():
            lines += [title, *(f"  {each}" for each in told)] if told else [f"{title} nothing"]
        return [*lines, f"It cannot hold {own.lacks}."] if own.lacks else lines


def calibrated(
    model: CorrectedModel,
    *,
    temperature: float | None = None,
    min_sigma: float | None = None,
    alone: bool = False,
) -> Calibrated:
    """Apply the constant part of a corrected model to the nominal robot.

    Parameters
    ----------
    model
        The corrected model.
    temperature
        °C at which lengths are to hold, where the model tells how they grow; by default the campaign's reference
        temperature, at which those of the nominal robot hold.
    min_sigma
        Keep only what is so many standard deviations from zero (:func:`~thermal_robot.correction.determined`); all
        where absent.
    alone
        Take what a file can hold as it was fitted without the rest of the model, for a robot that is used without that:
        then it takes up what it can of compliance and the like. Neither of the others is then of use.

    Raises
    ------
    CampaignError
        If the temperature is impossible, or one is given and the model does not tell how the robot grows; or if
        ``min_sigma`` is given and the model has no standard deviations.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> print(warm.notes("urdf")[0])
    Calibrated by thermal_robot: the robot 'rv_m2' from 'base_link' to 'tool0' as it was measured, ...
    """
    gone: tuple[FittedParameter, ...] = ()
    if alone:
        min_sigma, temperature = None, None
    if min_sigma is not None:
        model, gone = determined(model, min_sigma, temperature)
    found = constant(model, temperature)
    if temperature is not None and not found.grows:
        problem = "the model does not tell how the robot grows"
        raise CampaignError("temperature", problem, found=f"{temperature:g} °C", expected="none")
    moved = found.displacement
    joint, segment = np.asarray(moved.joint), np.asarray(moved.segment)
    if alone:
        joint, segment = np.split(fitted_alone(model, PLACEMENTS), [model.robot.n])
    left_out = {(told.effect, told.parameter) for told in gone}
    held = [told for told, own in zip(found.parameters, found.held, strict=True) if own]
    return Calibrated(
        robot=model.robot,
        displacement=Displacement(joint, segment.reshape(-1, 6)),
        base=model.frames.base @ exp6(np.asarray(moved.base)),
        target=exp6(np.asarray(moved.tool)) @ model.frames.tool,
        temperature=found.temperature if found.grows else None,
        held=tuple(told for told in held if (told.effect, told.parameter) not in left_out),
        undetermined=gone,
        kept=tuple(told for told, own in zip(found.parameters, found.held, strict=True) if not own),
        min_sigma=min_sigma,
        compared=model.frames.tool if model.simulated else None,
        beyond="" if temperature is None else _beyond(model, found.temperature),
        gaps=model.files if temperature is None else (),
        alone=alone,
    )


def _beyond(model: CorrectedModel, temperature: float) -> str:
    """Warning where a temperature is outside the measured range by more than a margin; else empty."""
    ranges = {} if model.spread is None else model.spread.ranges
    known = [ends for column, ends in ranges.items() if split_name(column)[0] in PER_LINK]
    low, high = min((low for low, _ in known), default=-np.inf), max((high for _, high in known), default=np.inf)
    beside = settings.BESIDE * (high - low) if known else 0.0
    if low - beside <= temperature <= high + beside:
        return ""
    return f"lengths at {temperature:g} °C are extrapolated: it was measured at {low:.3g} to {high:.3g} °C"


def target_link(tool_frame: str) -> str:
    """Name of the link (body, site) of the measured target in a robot file."""
    return f"{tool_frame}_target"


def calibrated_urdf(robot: Calibrated) -> str:
    """Write the calibrated robot as URDF.

    Zeros and placements are put into the origins of the joints between root and tool frame, by which all that follows
    moves with them. The measured target becomes a link of its own, ``<tool_frame>_target``, where it is not the tool
    frame itself. Everything else stands as in the nominal robot's text: meshes, masses, limits, branches, comments. A
    joint outside the chain that mimics one of it is not displaced.

    Parameters
    ----------
    robot
        The calibrated robot.

    Returns
    -------
    str
        XML text, with a comment that lists what is in it and what is not.

    Raises
    ------
    RobotError
        If the robot has another link of the target's name.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, calibrated_urdf
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> tr.load_robot(calibrated_urdf(warm), "tool0_target").n
    5
    """
    return rewritten(robot.robot.urdf, robot.origins, links=robot.links, notes=robot.notes("urdf"))


def ur_kinematics(robot: Calibrated) -> str:
    """Write a calibrated Universal Robots arm as kinematics.yaml: all errors go into its six joint origins.

    A fixed frame before a joint that is displaced counts to that joint's origin. Where the frames behind the last joint
    are displaced, or the target sits elsewhere, the file cannot hold it: the controller's tool does.

    Parameters
    ----------
    robot
        The calibrated robot, of a URDF that is made of ur_description for ROS 2.

    Returns
    -------
    str
        YAML, with a comment that lists what is in it and what is not. Its ``hash`` is that of no robot: the driver says
        that it differs, unless the robot's own takes its place.

    Raises
    ------
    CampaignError
        If the robot is not one of Universal Robots with the frames of ur_description.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, ur_kinematics
    >>> ur_kinematics(calibrated(tr.diagnose(tr.demo_campaign()).model))
    Traceback (most recent call last):
    thermal_robot.errors.CampaignError: kinematics.yaml: is for robots of Universal Robots, and 'rv_m2' has no ...
    """
    chain, placed = robot.robot.chain, robot.placements
    joints = {k: link for link, k in elements(robot.robot, "kinematics.yaml").items()}
    origins, nominal, real = {}, np.eye(4), np.eye(4)
    for k, pose in enumerate(placed):
        real = real @ pose
        if k in joints:
            origins[joints[k]] = np.linalg.solve(nominal, real)
            nominal, real = np.eye(4), np.eye(4)
            continue
        nominal = nominal @ chain.placements[k]
    notes = robot.notes("ur_kinematics")
    if not np.allclose(nominal, real, rtol=0, atol=1e-9):
        notes.append("Frames behind the last joint are displaced as well, which only a URDF holds.")
    lines = [*(f"# {note}" for note in notes), "kinematics:"]
    for link, pose in origins.items():
        # no exponents: YAML takes 1e-05 for text
        figures = (np.format_float_positional(float(figure), trim="0") for figure in " ".join(xyz_rpy(pose)).split())
        lines += [f"  {link}:", *(f"    {key}: {figure}" for key, figure in zip(FIGURES, figures, strict=True))]
    return "\n".join([*lines, "  hash: calib_thermal_robot", ""])


def joint_parameters(robot: Calibrated) -> str:
    """Frames of joints as JSON, to be set in a running simulator: MuJoCo's bodies, Isaac's USD joints.

    Parameters
    ----------
    robot
        The calibrated robot.

    Returns
    -------
    str
        JSON. ``joints``: by name, those that move and those that are displaced, with ``parent`` and ``child`` link,
        ``pos`` (m) and ``quat`` (w, x, y, z) of the joint's frame in the parent link, with its zero in them; and
        ``change_pos``, ``change_quat``: the same pose times the inverse of the nominal one. Whatever frame a simulator
        has for that joint in the same parent, this change from the left calibrates it: ``body_pos`` and ``body_quat``
        of the child in MuJoCo, ``physics:localPos0`` and ``physics:localRot0`` of a USD joint. ``notes`` say what is
        in it and what is not.

    Examples
    --------
    >>> import json
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, joint_parameters
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> sorted(json.loads(joint_parameters(warm))["joints"]["joint_2"])
    ['change_pos', 'change_quat', 'child', 'parent', 'pos', 'quat']
    """
    chain, joints = robot.robot.chain, {}
    moved = {*robot.origins, *(chain.names[k] for k in chain.movable)}
    links = [*chain.parent_links, robot.robot.tool_frame]
    for k, (name, pose) in enumerate(zip(chain.names, robot.placements, strict=True)):
        if name not in moved:
            continue
        change = pose @ np.linalg.inv(chain.placements[k])
        held = {"parent": links[k], "child": links[k + 1]}
        joints[name] = {**held, **_pos_quat(pose), **_pos_quat(change, "change_")}
    told = {"schema": JOINT_PARAMETERS, "notes": robot.notes("joints"), "joints": joints}
    return json.dumps(told, indent=1, ensure_ascii=False) + "\n"


JOINT_PARAMETERS = "thermal-robot/joint-parameters/1"


def _pos_quat(pose: Array, before: str = "") -> dict[str, list[float]]:
    """Position, m, and quaternion (w, x, y, z) of a pose (4, 4)."""
    return {f"{before}pos": pose[:3, 3].tolist(), f"{before}quat": rotation_to_quaternion(pose[:3, :3]).tolist()}


Convention: TypeAlias = Literal["standard", "modified"]

CONVENTIONS = ("standard", "modified")
"""Of the table: Denavit and Hartenberg's own, and Craig's (*Introduction to Robotics*, 1986)."""
NEARLY_PARALLEL = 0.1
"""Sine of the angle of two axes below which β takes the place of d: as where the errors of axes are told."""
_DUST = 1e-14
"""rad, m."""
_JOINT, _POSE = ("theta", "d", "a", "alpha", "beta"), ("x", "y", "z", "roll", "pitch", "yaw")
_ANGLES = ("theta", "alpha", "beta", "roll", "pitch", "yaw")
"""Figures of a joint and of a pose; the other ones are lengths."""


def dh_table(robot: Calibrated, convention: Convention = "standard", units: Units | None = None) -> pd.DataFrame:
    """Denavit-Hartenberg-Hayati parameters of the calibrated robot.

    Parameters
    ----------
    robot
        The calibrated robot.
    convention
        ``standard`` or ``modified``; the module's docstring has the equation of each.
    units
        Units of angles and lengths; rad and m by default.

    Returns
    -------
    pandas.DataFrame
        A row for the base, one for each joint that moves, from the root on, and one for the tool, which leads to the
        measured target. ``joint`` is its name; ``type`` is ``base``, ``tool``, ``revolute`` or ``prismatic``;
        ``follows`` and ``multiplier`` say of which joint's command q is how many times, a joint that mimics another
        included. Angles ``theta``, ``alpha``, ``beta`` and lengths ``d``, ``a`` belong to joints, ``x y z`` and ``roll
        pitch yaw`` (about fixed axes, as in a URDF) to base and tool. Each name has its unit, as ``a [mm]``.

    Raises
    ------
    CampaignError
        If there is no such convention.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, dh_table
    >>> table = dh_table(calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0))
    >>> list(table["joint"])
    ['base_link', 'joint_1', 'joint_2', 'joint_3', 'joint_4', 'joint_5', 'tool0']
    """
    import pandas as pd

    if convention not in CONVENTIONS:
        raise CampaignError("convention", "is unknown", found=repr(convention), expected=" or ".join(CONVENTIONS))
    units = units or Units()
    nominal = replace(
        robot, displacement=Displacement(np.zeros(robot.robot.n), np.zeros((len(robot.robot.segments), 6)))
    )
    base, joints, tool = _parameters(robot, _parameters(nominal)[1])
    if convention == "modified":
        # (a, α, β) lead to the next joint; nothing leads to the first one, and nothing comes behind the last
        joints[:, 2:] = np.vstack([np.zeros(3), joints[:-1, 2:]])
    chain, coupling = robot.robot.chain, robot.robot.chain.coupling
    rows: list[dict[str, object]] = [{"joint": robot.robot.root_frame, "type": "base", **_as_pose(base)}]
    for j, k in enumerate(chain.movable):
        leader = coupling.leader(j)
        kind = "prismatic" if chain.kinds[k] == PRISMATIC else "revolute"
        follows = "" if leader is None else robot.robot.joint_names[leader]
        times = 0.0 if leader is None else float(coupling.matrix[j, leader])
        numbers = dict(zip(_JOINT, joints[j].tolist(), strict=True))
        rows.append({"joint": chain.names[k], "type": kind, "follows": follows, "multiplier": times, **numbers})
    rows.append({"joint": robot.robot.tool_frame, "type": "tool", **_as_pose(tool)})
    table = pd.DataFrame(rows)[["joint", "type", "follows", "multiplier", *_JOINT, *_POSE]]
    told = {}
    for name in (*_JOINT, *_POSE):
        angle = name in _ANGLES
        # what rounding leaves of a zero is no figure of a robot
        table[name] = table[name].where(~(table[name].abs() < _DUST), 0.0)
        table[name] /= units.angle_scale if angle else units.length_scale
        told[name] = f"{name} [{units.angle if angle else units.length}]"
    table.insert(0, "convention", convention)
    return table.rename(columns=told)


def _parameters(robot: Calibrated, like: Array | None = None) -> tuple[Array, Array, Array]:
    """Return the base pose (4, 4), θ, d, a, α, β of each joint (M, 5), and tool pose (4, 4); m and rad.

    A common normal has two senses: that of the table ``like``, or that with the distance a not negative.
    """
    chain, rest = robot.robot.chain, robot.robot.chain.coupling.offset
    poses, pose = [], np.eye(4)
    for placement in robot.placements:
        pose = pose @ placement
        poses.append(pose)
    end = pose @ robot.target
    lines = [(poses[k][:3, 3], poses[k][:3, :3] @ chain.axes[k]) for k in chain.movable]
    frame = _first(*lines[0])
    base, rows = frame, []
    for j in range(len(lines)):
        slides = chain.kinds[chain.movable[j]] == PRISMATIC
        offset = np.array([0.0 if slides else rest[j], rest[j] if slides else 0.0, 0.0, 0.0, 0.0])
        if j + 1 == len(lines):
            row = _last(frame, end)
        else:
            row = _to_next(frame, lines[j + 1])
            if like is not None and np.cos(row[0] + offset[0] - like[j, 0]) < 0.0:
                # the same link by the other sense of the common normal
                row = np.array([row[0] + np.pi, row[1], -row[2], -row[3], -row[4]])
        frame = frame @ link(*row)
        rows.append(row + offset)
    return base, np.array(rows), np.linalg.inv(frame) @ end


def link(theta: float, d: float, a: float, alpha: float, beta: float) -> Array:
    """Denavit-Hartenberg-Hayati transform (4, 4) between consecutive axes: Rz(θ) Tz(d) Tx(a) Rx(α) Ry(β)."""
    turned = _turned(2, theta)
    return homogeneous(turned @ _turned(0, alpha) @ _turned(1, beta), turned @ np.array([a, 0.0, d]))


def _turned(axis: int, angle: float) -> Array:
    """Rotation (3, 3) about the x, y or z axis (0, 1, 2)."""
    return exp3(angle * np.eye(3)[axis])


def _first(point: Array, axis: Array) -> Array:
    """Frame (4, 4) of the first axis: z along it, origin nearest to the root's, x by projection of a root axis."""
    along = np.eye(3)[0] if abs(axis[0]) < 1.0 - NEARLY_PARALLEL else np.eye(3)[1]
    x = along - (along @ axis) * axis
    x /= np.linalg.norm(x)
    return homogeneous(np.column_stack([x, np.cross(axis, x), axis]), point - (point @ axis) * axis)


def _to_next(frame: Array, line: tuple[Array, Array]) -> Array:
    """Denavit-Hartenberg (nearly parallel: Hayati) parameters (5,) θ, d, a, α, β from a frame to the next axis.

    ``line``: a point of that axis and its direction.
    """
    origin = frame[:3, :3].T @ (line[0] - frame[:3, 3])
    axis = frame[:3, :3].T @ line[1]
    across = float(np.hypot(axis[0], axis[1]))
    if across < NEARLY_PARALLEL:
        # where the axis goes through the plane across this one; then α and β turn z to it
        foot = origin - axis * (origin[2] / axis[2])
        a = float(np.hypot(foot[0], foot[1]))
        theta = float(np.arctan2(foot[1], foot[0])) if a > 0.0 else 0.0
        seen = _turned(2, theta).T @ axis
        # Rx(α) Ry(β) z = (sin β, −sin α cos β, cos α cos β)
        alpha = float(np.arctan2(-seen[1], seen[2]))
        beta = float(np.arctan2(seen[0], np.hypot(seen[1], seen[2])))
        return np.array([theta, 0.0, a, alpha, beta])
    # the common normal is along z × axis; of its two senses that with the distance a not negative
    normal = np.array([-axis[1], axis[0], 0.0]) / across
    a = float(origin @ normal)
    normal, a = (-normal, -a) if a < 0.0 else (normal, a)
    theta = float(np.arctan2(normal[1], normal[0]))
    d = float(origin[2] - axis[2] * (origin[:2] @ axis[:2]) / across**2)
    seen = _turned(2, theta).T @ axis
    return np.array([theta, d, a, float(np.arctan2(-seen[1], seen[2])), 0.0])


def _last(frame: Array, end: Array) -> Array:
    """Parameters (5,) of the last joint: d to the target's foot on the axis, θ to its x direction; the others zero."""
    seen = np.linalg.inv(frame) @ end
    across = seen[:2, 0] if np.linalg.norm(seen[:2, 0]) > NEARLY_PARALLEL else seen[:2, 1]
    return np.array([float(np.arctan2(across[1], across[0])), seen[2, 3], 0.0, 0.0, 0.0])


def _as_pose(pose: Array) -> dict[str, float]:
    numbers = [*pose[:3, 3].tolist(), *rotation_to_rpy(pose[:3, :3]).tolist()]
    return dict(zip(_POSE, numbers, strict=True))
