"""Simulation models in MuJoCo: MJCF compiled, posed, and written with all digits.

A campaign is compared with the predictions of the user's own model; the calibrated robot is written into that model, or
converted from its URDF.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.correction.robot_files import Calibrated, calibrated_urdf, target_link
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import homogeneous, quaternion_to_rotation, rotation_to_quaternion
from thermal_robot.kinematics.model import PRISMATIC, mimics
from thermal_robot.kinematics.urdf import text_of, tree, unsound
from thermal_robot.robot import Robot

_NO_MASS = {"boundmass": 1e-9, "boundinertia": 1e-12, "balanceinertia": True, "fusestatic": False}
"""Of the compiler: links without masses are let be, and links that do not move stay bodies of their own."""


def mujoco_or_error() -> Any:
    """Import ``mujoco``, or say how to install it."""
    try:
        import mujoco
    except ImportError as error:
        raise CampaignError(
            "MJCF", "needs MuJoCo, which is not installed", expected='pip install "thermal-robot[blind]"'
        ) from error
    return mujoco


def compiled(mjcf: str | Path) -> tuple[str, Any, Path | None]:
    """Compile an MJCF, a path or a text: its name for messages, its ``mujoco.MjModel``, and its path or ``None``."""
    mujoco = mujoco_or_error()
    path = Path(mjcf) if isinstance(mjcf, Path) or not mjcf.lstrip().startswith("<") else None
    name, model = str(path or "the MJCF"), mujoco.MjModel
    try:
        return name, model.from_xml_path(str(path)) if path else model.from_xml_string(mjcf), path
    except (ValueError, mujoco.FatalError) as error:
        raise CampaignError(name, "MuJoCo does not take it", found=" ".join(str(error).split())) from None


def mjcf_of_urdf(urdf: str) -> str:
    """Convert a URDF by MuJoCo's compiler, with all digits; joints and links keep their names.

    Meshes are left out, as their files are named in ways that MuJoCo does not know; a joint that mimics another becomes
    an equality.

    Raises
    ------
    CampaignError
        If MuJoCo is not installed, or does not take the robot.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import mjcf_of_urdf
    >>> mjcf_of_urdf(tr.load_robot("builtin:rv_m2", "tool0").urdf)[:20]
    '<mujoco model="rv_m2'
    """
    mujoco = mujoco_or_error()
    root = tree(urdf)
    for part in root.xpath("//mimic | //visual[.//mesh] | //collision[.//mesh]"):
        part.getparent().remove(part)
    try:
        spec = mujoco.MjSpec.from_string(etree.tostring(root, encoding="unicode"))
        for name, value in _NO_MASS.items():
            setattr(spec.compiler, name, value)
        model = spec.compile()
        root = tree(spec.to_xml())
    except (ValueError, mujoco.FatalError) as error:
        raise CampaignError("the URDF", "MuJoCo does not take it", found=" ".join(str(error).split())) from None
    _with_all_digits(root, model)
    # MuJoCo 3.3.0 does not read from a URDF that joints follow others
    follows = etree.Element("equality")
    for joint, mimic in mimics(urdf).items():
        if None not in (known(model, "joint", joint), known(model, "joint", mimic.joint)):
            numbers = digits([mimic.offset, mimic.multiplier, 0, 0, 0])
            etree.SubElement(follows, "joint", joint1=joint, joint2=mimic.joint, polycoef=numbers)
    if len(follows):
        root.append(follows)
    etree.indent(root)
    return text_of(root, "")


def _with_all_digits(root: Any, model: Any) -> None:
    """Rewrite the poses of bodies and joints in a model saved by MuJoCo, whose six digits are too few."""
    usual = {"pos": [0.0, 0.0, 0.0], "quat": [1.0, 0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0], "range": [0.0, 0.0]}
    for kind, names in (("body", ("pos", "quat")), ("joint", ("axis", "range"))):
        for element in root.iterfind(f"worldbody//{kind}"):
            for name in names:
                values = getattr(getattr(model, kind)(element.get("name")), name)
                if values.tolist() != usual[name]:
                    element.set(name, digits(values))


def digits(values: Any) -> str:
    """Format numbers for MJCF and URDF, with all digits."""
    return " ".join(repr(float(value)) for value in values)


def moved(model: Any, data: Any, positions: Mapping[str, float]) -> None:
    """Set joints of a ``mujoco.MjData`` to positions (rad or m) by name and update its kinematics; the others stay."""
    for name, position in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = position
    mujoco_or_error().mj_kinematics(model, data)


def pose_of(placed: Any) -> Array:
    """World pose (4, 4), m, of a body or a site of a ``mujoco.MjData``."""
    return homogeneous(placed.xmat.reshape(3, 3), placed.xpos)


def known(model: Any, kind: str, name: str) -> int | None:
    """Index of a body, joint or site; ``None`` where a model has none of this name."""
    mujoco = mujoco_or_error()
    number = mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
    return None if number < 0 else int(number)


def set_damping(joint: Any, damping: float) -> None:
    """Set the viscous damping of a ``mujoco.MjsJoint``, N·m·s/rad; as a polynomial where MuJoCo's version has one."""
    joint.damping = damping if np.ndim(joint.damping) == 0 else [damping, 0.0, 0.0]


_BESIDE, _ASKEW = 0.02, 0.05
"""m and rad by which the axes of the two nominal robots may differ: more than any two models of one robot do, less than
those of another robot, or of one whose zeros stand elsewhere."""
_BEYOND = (
    "An MJCF could hold zero offsets as a joint's ref, which would move a simulation's start, too: they are in the",
    "places of bodies. A joint's stiffness is a spring beside its motor, and no compliance of a gear behind it.",
)


def calibrated_mjcf(robot: Calibrated, mjcf: str | Path | None = None) -> str:
    """Write the calibrated robot as MJCF.

    Parameters
    ----------
    robot
        The calibrated robot.
    mjcf
        A model of the nominal robot of your own, as a path or as its text, with the URDF's names of joints. The bodies
        of its joints are placed anew, what else it says stays as it stands, and a site ``<tool_frame>_target`` is
        added. Where absent, MuJoCo's compiler translates the URDF, without its meshes.

    Returns
    -------
    str
        XML text, with a comment that lists what is in it and what is not.

    Raises
    ------
    CampaignError
        If MuJoCo is not installed or does not take the model; if that has not the robot's joints, or not where the
        robot has them; or if a body's tag does not stand in the text alone: in an included file, in a ``<frame>``.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import calibrated, calibrated_mjcf
    >>> warm = calibrated(tr.diagnose(tr.demo_campaign()).model, temperature=26.0)
    >>> "tool0_target" in calibrated_mjcf(warm)
    True
    """
    notes = [*robot.notes("mjcf"), *_BEYOND]
    if mjcf is None:  # the translation drops all comments
        return text_of(tree(mjcf_of_urdf(calibrated_urdf(robot))), "", notes)
    patched = _Patched.of(robot, mjcf)
    patched.place()
    return text_of(patched.root, patched.text, notes)


@dataclass(frozen=True, eq=False)
class _Patched:
    """User's MJCF model and the calibrated robot to be written into it, both with all joints at zero.

    ``root`` is the root element of its ``text``; ``base`` (4, 4) the pose of the robot's root frame in its world.
    """

    robot: Calibrated
    name: str
    text: str
    root: Any
    model: Any
    data: Any
    base: Array

    @classmethod
    def of(cls, robot: Calibrated, mjcf: str | Path) -> _Patched:
        name, model, path = _own_model(mjcf, robot.robot)
        data = mujoco_or_error().MjData(model)
        moved(model, data, dict.fromkeys(_moving(robot.robot), 0.0))
        base = known(model, "body", robot.robot.root_frame)
        try:
            text = path.read_text(encoding="utf-8") if path else str(mjcf)
            problem = unsound(text)
        except UnicodeDecodeError as error:
            problem = str(error)
        if problem:
            raise CampaignError(name, "is no XML in UTF-8", found=problem)
        return cls(robot, name, text, tree(text), model, data, np.eye(4) if base is None else pose_of(data.body(base)))

    def place(self) -> None:
        """Write the calibrated poses of the joints' bodies and the tool frame to the XML, and the target as a site."""
        chain, placed = self.robot.robot.chain, self.robot.placements
        nominal = chain.placements
        at, before, after, last = self.base, np.eye(4), np.eye(4), 0
        for k, name in enumerate(chain.names):
            at, before, after = at @ nominal[k], before @ nominal[k], after @ placed[k]
            if k in chain.movable:
                last = self._carrier(name, at, k)
                self._move(name, last, _change(pose_of(self.data.body(last)), at, before, after))
                before, after = np.eye(4), np.eye(4)
        tool = self.robot.robot.tool_frame
        body, site = (known(self.model, kind, tool) for kind in ("body", "site"))
        # the tool frame stands where its body or site is in the model, else where the URDF has it
        found = self.data.body(body) if body is not None else None if site is None else self.data.site(site)
        stands = at if found is None else pose_of(found)
        change = _change(stands, at, before, after)
        if body is not None and body != last:
            self._move("", body, change)
        elif body is None and site is not None and not np.array_equal(change, np.eye(4)):
            for tag in self.root.xpath("(//site[@name=$tool])[1]", tool=tool):
                carrier = pose_of(self.data.body(int(self.model.site_bodyid[site])))
                _set_pose(tag, np.linalg.inv(carrier) @ stands @ change)
        target, was = self.robot.target, known(self.model, "site", target_link(tool))
        if was is not None and self.robot.compared is not None:
            # the campaign was compared with this target, wherever the declared one is
            seen = np.linalg.inv(stands) @ pose_of(self.data.site(was))
            target = target @ np.linalg.inv(self.robot.compared) @ seen
        self._set_target(last, np.linalg.inv(pose_of(self.data.body(last))) @ stands @ change @ target)

    def _carrier(self, joint: str, at: Array, k: int) -> int:
        """Index of a joint's body; ``CampaignError`` if its axis is over 20 mm or 0.05 rad away from the URDF's."""
        number = int(known(self.model, "joint", joint) or 0)
        chain, there = self.robot.robot.chain, self.data.joint(number)
        axis = at[:3, :3] @ chain.axes[k]
        askew = float(np.arctan2(np.linalg.norm(np.cross(axis, there.xaxis)), axis @ there.xaxis))
        beside = float(np.linalg.norm(np.cross(axis, at[:3, 3] - there.xanchor)))
        if askew > _ASKEW or (beside > _BESIDE and chain.kinds[k] != PRISMATIC):
            problem = f"with all joints at zero, the axis of {joint!r} is not where the URDF has it"
            found = f"it {1e3 * beside:.3g} mm beside and {np.degrees(askew):.3g}° askew"
            raise CampaignError(self.name, problem, found=found, expected="a model of the same robot")
        return int(self.model.jnt_bodyid[number])

    def _move(self, joint: str, body: int, change: Array) -> None:
        """Write a body's changed pose to the XML: N X N⁻¹ L replaces L, where X is the ``change`` in the body's frame.

        N is the body's pose in its parent while its joint is at zero, which is L only where the joint has no ``ref``.
        """
        if np.array_equal(change, np.eye(4)):
            return
        parent = pose_of(self.data.body(int(self.model.body_parentid[body])))
        inside = np.linalg.inv(parent) @ pose_of(self.data.body(body))
        own = homogeneous(quaternion_to_rotation(self.model.body_quat[body]), self.model.body_pos[body])
        _set_pose(self._tag(joint, body), inside @ change @ np.linalg.inv(inside) @ own)

    def _tag(self, joint: str, body: int) -> Any:
        """XML element of a body, by its name or by the joint in it; ``CampaignError`` where the text has none."""
        name = self.model.body(body).name
        found = self.root.xpath(
            "(//worldbody//joint[$joint and @name=$joint]/.. | //body[$name and @name=$name])"
            "[not(ancestor-or-self::frame or ancestor-or-self::replicate)]",
            joint=joint,
            name=name,
        )
        if not found:
            problem = f"the tag of body {name or body!r} is not in this file, or stands in a <frame>"
            raise CampaignError(self.name, problem, expected="a model in one file: save it by MuJoCo")
        first = self.model.joint(int(self.model.body_jntadr[body])).name if joint else ""
        if first != joint:
            problem = f"joint {joint!r} has no body of its own: it shares one with {first!r}"
            raise CampaignError(self.name, problem, expected="a body between the two")
        return found[0]

    def _set_target(self, body: int, pose: Array) -> None:
        """Add the target as a site to the last joint's body, or move it there; ``CampaignError`` if it is elsewhere."""
        joint, tool = _moving(self.robot.robot)[-1], target_link(self.robot.robot.tool_frame)
        carrier = self._tag(joint, body)
        for site in self.root.xpath("(//site[@name=$tool])[1]", tool=tool):
            if site.getparent() is not carrier:
                problem, expected = f"has a site {tool!r} already", f"it in the body of joint {joint!r}"
                raise CampaignError(self.name, problem, found="it elsewhere", expected=expected)
            return _set_pose(site, pose)
        site = etree.Element("site", name=tool)
        site.tail = carrier.text
        carrier.insert(0, site)
        return _set_pose(site, pose)


def _change(held: Array, at: Array, before: Array, after: Array) -> Array:
    """Change (4, 4) of a body's pose, in the body's frame, as its joint's frame moves from ``before`` to ``after``.

    X = C⁻¹ before⁻¹ after C, where C = at⁻¹ held is the body's pose in the joint's frame.
    """
    if np.array_equal(before, after):
        return np.eye(4)
    behind = np.linalg.inv(at) @ held
    return np.asarray(np.linalg.inv(behind) @ np.linalg.inv(before) @ after @ behind)


def _set_pose(element: Any, pose: Array) -> None:
    """Set position and quaternion of an element, in place of any other orientation attribute."""
    for name in ("euler", "axisangle", "xyaxes", "zaxis"):
        element.attrib.pop(name, None)
    element.set("pos", digits(pose[:3, 3]))
    element.set("quat", digits(rotation_to_quaternion(pose[:3, :3])))


def _moving(robot: Robot) -> list[str]:
    """Names of the joints of the chain that move, mimicking ones too."""
    return [robot.chain.names[k] for k in robot.chain.movable]


def _own_model(mjcf: str | Path, robot: Robot) -> tuple[str, Any, Path | None]:
    """Compile an MJCF (see :func:`compiled`); ``CampaignError`` if a moving joint of the robot's chain is missing."""
    name, model, path = compiled(mjcf)
    for joint in _moving(robot):
        if known(model, "joint", joint) is None:
            own = ", ".join(model.joint(j).name or "(unnamed)" for j in range(model.njnt)) or "no joint"
            raise CampaignError(name, f"has no joint {joint!r}", found=own, expected="the URDF's names of joints")
    return name, model, path


def with_simulator(campaign: Campaign, mjcf: str | Path) -> Campaign:
    """Add a MuJoCo model's prediction of the target's pose to a campaign, as ``sim.*`` columns.

    The model's joints are put where they were commanded, and those that mimic another where that one takes them; no
    motor and no gravity is at work. A diagnosis then compares the robot with this simulator, not with the URDF, and
    :func:`~thermal_robot.correction.calibrated_mjcf` writes into the simulator what of the difference is constant.

    Parameters
    ----------
    campaign
        Commands, with or without measurements.
    mjcf
        The simulator's model, as a path or as its text, with the URDF's names of joints. Its target is the site or
        body ``<tool_frame>_target`` of a calibrated model; else the declared one, on a body or site of the tool frame's
        name.

    Returns
    -------
    Campaign
        With the predicted positions, in the root frame: the body of its name, or else the world; and with orientations
        where the campaign measures poses.

    Raises
    ------
    CampaignError
        If MuJoCo is not installed or does not take the model, or that lacks a joint or the tool frame.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> from thermal_robot.correction import mjcf_of_urdf, with_simulator
    >>> sound = tr.simulate("builtin:rv_m2", tool_frame="tool0", rows=10)
    >>> seen = with_simulator(sound, mjcf_of_urdf(sound.robot.urdf))
    >>> bool(abs(seen.simulated_position - sound.position).max() < 1e-9)
    True
    """
    robot = campaign.robot
    name, model, _ = _own_model(mjcf, robot)
    kind, number, held = _target(name, model, campaign)
    data, root = mujoco_or_error().MjData(model), known(model, "body", robot.root_frame) or 0
    seen = np.empty((campaign.samples, 4, 4))
    for i, row in enumerate(robot.chain.coupling.positions(campaign.q).tolist()):
        moved(model, data, dict(zip(_moving(robot), row, strict=True)))
        carrier = pose_of(getattr(data, kind)(number))
        seen[i] = np.linalg.inv(pose_of(data.body(root))) @ carrier @ held
    turned = rotation_to_quaternion(seen[:, :3, :3]) if campaign.orientation is not None else None
    return replace(campaign, simulated_position=seen[:, :3, 3], simulated_orientation=turned)


def _target(name: str, model: Any, campaign: Campaign) -> tuple[str, int, Array]:
    """Kind and index of the element that carries the target, and the target's pose (4, 4) on it."""
    declared = homogeneous(np.eye(3), campaign.target)
    tool = campaign.robot.tool_frame
    for link, pose in ((target_link(tool), np.eye(4)), (tool, declared)):
        for kind in ("site", "body"):
            number = known(model, kind, link)
            if number is not None:
                return kind, number, pose
    raise CampaignError(name, f"has no tool frame {tool!r}", expected="a body or a site of that name")
