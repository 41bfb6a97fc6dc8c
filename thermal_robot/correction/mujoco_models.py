"""MuJoCo as somebody's simulator: models are compiled, asked where their bodies are, written with all digits.

A campaign is compared with what the user's own model predicts; the calibrated robot is written back to it, or as an
MJCF of its own, translated from its URDF.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.parsers.expat import ExpatError
from xml.sax.saxutils import quoteattr

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.correction.robot_files import Calibrated, calibrated_urdf, target_link
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import quaternion_to_rotation, rotation_to_quaternion
from thermal_robot.kinematics.model import PRISMATIC, Mimic, mimics
from thermal_robot.kinematics.urdf import Edit, Tag, changed, comment, encoded, indent, tags, with_values

_NO_MASS = {"boundmass": 1e-9, "boundinertia": 1e-12, "balanceinertia": True, "fusestatic": False}
"""Of the compiler: links without masses are let be, and links that do not move stay bodies of their own."""
_MIMIC = re.compile(r"<mimic\b[^>]*>(\s*</mimic>)?")
_MESH = re.compile(r"<(visual|collision)\b(?:(?!</\1>).)*?<mesh\b.*?</\1>", re.DOTALL)


def mujoco_or_error() -> Any:
    """Return the package ``mujoco``, or say how to install it."""
    try:
        import mujoco
    except ImportError as error:
        raise CampaignError(
            "MJCF", "needs MuJoCo, which is not installed", expected='pip install "thermal-robot[blind]"'
        ) from error
    return mujoco


def compiled(mjcf: str | Path) -> Any:
    """Return the ``mujoco.MjModel`` of an MJCF: a file, with what it includes, or its text."""
    mujoco = mujoco_or_error()
    try:
        if isinstance(mjcf, Path):
            return mujoco.MjModel.from_xml_path(str(mjcf))
        return mujoco.MjModel.from_xml_string(mjcf)
    except (ValueError, mujoco.FatalError) as error:
        name = str(mjcf) if isinstance(mjcf, Path) else "the MJCF"
        raise CampaignError(name, "MuJoCo does not take it", found=" ".join(str(error).split())) from None


def mjcf_of_urdf(urdf: str) -> str:
    """Translate a URDF by MuJoCo's compiler, with all digits; joints and links keep their names.

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
    try:
        spec = mujoco.MjSpec.from_string(_MIMIC.sub("", _MESH.sub("", urdf)))
        for name, value in _NO_MASS.items():
            setattr(spec.compiler, name, value)
        model = spec.compile()
        text = spec.to_xml()
    except (ValueError, mujoco.FatalError) as error:
        raise CampaignError("the URDF", "MuJoCo does not take it", found=" ".join(str(error).split())) from None
    return _exact(text, model, "".join(_equalities(model, mimics(urdf))))


def _equalities(model: Any, found: Mapping[str, Mimic]) -> Iterator[str]:
    """Yield what makes joints that move follow others: MuJoCo 3.3.0 does not read that from a URDF."""
    for joint, mimic in found.items():
        if None not in (known(model, "joint", joint), known(model, "joint", mimic.joint)):
            numbers = digits([mimic.offset, mimic.multiplier, 0, 0, 0])
            yield f'    <joint joint1={quoteattr(joint)} joint2={quoteattr(mimic.joint)} polycoef="{numbers}"/>\n'


def _exact(text: str, model: Any, equalities: str) -> str:
    """Give a model that MuJoCo wrote, in six digits, all of them; and its equalities."""
    content = encoded(text)
    found = tags(content)
    end = found[0].close
    edits: list[Edit] = [(end, end, f"\n  <equality>\n{equalities}  </equality>\n")] if equalities else []
    for tag in found:
        values: dict[str, tuple[Array, Sequence[float]]] = {}
        if tag.path[-1] == "body":
            body = model.body(tag.attributes["name"])
            values = {"pos": (body.pos, (0.0, 0.0, 0.0)), "quat": (body.quat, (1.0, 0.0, 0.0, 0.0))}
        elif tag.path[-1] == "joint":
            joint = model.joint(tag.attributes["name"])
            values = {"axis": (joint.axis, (0.0, 0.0, 1.0)), "range": (joint.range, (0.0, 0.0))}
        new = {name: digits(value) for name, (value, usual) in values.items() if value.tolist() != list(usual)}
        edits += [with_values(content, tag, new)] if new else []
    return changed(content, edits)


def digits(values: Any) -> str:
    """Return numbers as MJCF has them, with all digits."""
    return " ".join(repr(float(value)) for value in values)


@dataclass(frozen=True, eq=False)
class Bodies:
    """Where the bodies of a ``mujoco.MjModel`` are while its joints stand somewhere; ``data`` changes with them."""

    model: Any
    data: Any

    @classmethod
    def of(cls, model: Any) -> Bodies:
        """Return those of a model, its joints where it starts."""
        bodies = cls(model, mujoco_or_error().MjData(model))
        bodies.move({})
        return bodies

    def move(self, positions: Mapping[str, float]) -> None:
        """Put joints to positions (rad or m) by name; the others stay."""
        for name, position in positions.items():
            self.data.qpos[self.model.joint(name).qposadr[0]] = position
        mujoco_or_error().mj_kinematics(self.model, self.data)

    def pose(self, body: int) -> Array:
        """(4, 4) of a body in the world, m."""
        return _pose(self.data.xpos[body], self.data.xmat[body].reshape(3, 3))

    def site(self, site: int) -> Array:
        """(4, 4) of a site in the world, m."""
        return _pose(self.data.site_xpos[site], self.data.site_xmat[site].reshape(3, 3))

    def line(self, joint: int) -> tuple[Array, Array]:
        """Return a point (3,) of a joint's axis, m, and its direction (3,), in the world."""
        return np.array(self.data.xanchor[joint]), np.array(self.data.xaxis[joint])


def known(model: Any, kind: str, name: str) -> int | None:
    """Return the number of a body, joint or site; ``None`` where a model has none of this name."""
    mujoco = mujoco_or_error()
    number = mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
    return None if number < 0 else int(number)


def _pose(position: Array, rotation: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


_BESIDE, _ASKEW = 0.02, 0.05
"""m and rad by which the axes of the two nominal robots may differ: more than any two models of one robot do, less than
those of another robot, or of one whose zeros stand elsewhere."""
_OTHER_WAYS = dict.fromkeys(("euler", "axisangle", "xyaxes", "zaxis"))
"""In which a body may be turned; a quaternion takes the place of each."""
_BEYOND = (
    "An MJCF could hold zero offsets as a joint's ref, which would move a simulation's start, too: they are in the",
    "places of bodies. A joint's stiffness is a spring beside its motor, and no compliance of a gear behind it.",
)


def calibrated_mjcf(robot: Calibrated, mjcf: str | Path | None = None) -> str:
    """Return the MJCF of the calibrated robot.

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
    notes = [*robot.notes("an MJCF"), *_BEYOND]
    if mjcf is None:
        # the translation drops all comments
        content = encoded(mjcf_of_urdf(calibrated_urdf(robot)))
        start = tags(content)[0].start
        return changed(content, [(start, start, comment(notes))])
    patched = _Patched.of(robot, mjcf)
    start = patched.tags[0].start
    return changed(patched.content, [(start, start, comment(notes)), *patched.edits()])


@dataclass(frozen=True, eq=False)
class _Patched:
    """A model of the user's own beside the robot, both with all joints at zero.

    ``content`` is its text in bytes, ``tags`` where its elements stand; ``root`` (4, 4) the pose of the robot's root
    frame in the model's world.
    """

    robot: Calibrated
    name: str
    content: bytes
    tags: tuple[Tag, ...]
    model: Any
    bodies: Bodies
    root: Array

    @classmethod
    def of(cls, robot: Calibrated, mjcf: str | Path) -> _Patched:
        path = Path(mjcf) if isinstance(mjcf, Path) or not mjcf.lstrip().startswith("<") else None
        model = compiled(path or mjcf)
        name = str(path or "the MJCF")
        chain = robot.robot.chain
        moving = [chain.names[k] for k in chain.movable]
        for joint in moving:
            if known(model, "joint", joint) is None:
                own = ", ".join(model.joint(j).name or "(unnamed)" for j in range(model.njnt))
                raise CampaignError(
                    name, f"has no joint {joint!r}", found=own or "no joint", expected="the URDF's names"
                )
        bodies = Bodies.of(model)
        bodies.move(dict.fromkeys(moving, 0.0))
        base = known(model, "body", robot.robot.root_frame)
        root = np.eye(4) if base is None else bodies.pose(base)
        try:
            content = encoded(path.read_text(encoding="utf-8") if path else str(mjcf))
            return cls(robot, name, content, tags(content), model, bodies, root)
        except (UnicodeDecodeError, ExpatError) as error:
            raise CampaignError(name, "is no XML in UTF-8", found=str(error)) from None

    def edits(self) -> list[Edit]:
        """Return the changes: bodies of joints and of the tool frame that are placed anew, and the target."""
        chain, placed = self.robot.robot.chain, self.robot.placements
        nominal = np.tile(np.eye(4), (len(placed), 1, 1))
        nominal[:, :3, :3], nominal[:, :3, 3] = chain.rotations, chain.translations
        found: list[Edit] = []
        at, before, after, last = self.root, np.eye(4), np.eye(4), 0
        for k, name in enumerate(chain.names):
            at, before, after = at @ nominal[k], before @ nominal[k], after @ placed[k]
            if k in chain.movable:
                last = self._carrier(name, at, k)
                found += self._moved(name, last, self._change(self.bodies.pose(last), at, before, after))
                before, after = np.eye(4), np.eye(4)
        stands = self._tool(at)
        change = self._change(stands, at, before, after)
        found += self._tool_moved(last, stands, change)
        target, was = self.robot.target, known(self.model, "site", target_link(self.robot.robot.tool_frame))
        if was is not None and self.robot.compared is not None:
            # the campaign was compared with this target, wherever the declared one is
            target = target @ np.linalg.inv(self.robot.compared) @ np.linalg.inv(stands) @ self.bodies.site(was)
        return [*found, self._site(last, np.linalg.inv(self.bodies.pose(last)) @ stands @ change @ target)]

    def _tool(self, at: Array) -> Array:
        """(4, 4) pose of the tool frame: that of its body or site in the model, else where the URDF has it."""
        name = self.robot.robot.tool_frame
        body, site = (known(self.model, kind, name) for kind in ("body", "site"))
        return self.bodies.pose(body) if body is not None else at if site is None else self.bodies.site(site)

    def _tool_moved(self, last: int, stands: Array, change: Array) -> list[Edit]:
        """Return the edit that places the tool frame anew, where it is a body or a site of its own."""
        name = self.robot.robot.tool_frame
        body, site = (known(self.model, kind, name) for kind in ("body", "site"))
        if body is not None:
            return [] if body == last else self._moved("", body, change)
        tag = next((t for t in self.tags if t.path[-1] == "site" and t.attributes.get("name") == name), None)
        if site is None or tag is None or np.array_equal(change, np.eye(4)):
            return []
        pose = np.linalg.inv(self.bodies.pose(int(self.model.site_bodyid[site]))) @ stands @ change
        return [with_values(self.content, tag, {**_placed(pose), **_OTHER_WAYS})]

    @staticmethod
    def _change(held: Array, at: Array, before: Array, after: Array) -> Array:
        """(4, 4) X = C⁻¹ R⁻¹ R' C: how what a joint's frame holds moves, in its own frame, as R becomes R'."""
        if np.array_equal(before, after):
            return np.eye(4)
        behind = np.linalg.inv(at) @ held
        return np.asarray(np.linalg.inv(behind) @ np.linalg.inv(before) @ after @ behind)

    def _carrier(self, joint: str, at: Array, k: int) -> int:
        """Return the body of a joint, whose axis must lie where the robot has it."""
        number = int(known(self.model, "joint", joint) or 0)
        point, direction = self.bodies.line(number)
        axis = at[:3, :3] @ self.robot.robot.chain.axes[k]
        askew = float(np.arctan2(np.linalg.norm(np.cross(axis, direction)), axis @ direction))
        beside = float(np.linalg.norm(np.cross(axis, at[:3, 3] - point)))
        slides = self.robot.robot.chain.kinds[k] == PRISMATIC
        if askew > _ASKEW or (beside > _BESIDE and not slides):
            problem = f"with all joints at zero, the axis of {joint!r} is not where the URDF has it"
            found = f"it {1e3 * beside:.3g} mm beside and {np.degrees(askew):.3g}° askew"
            raise CampaignError(self.name, problem, found=found, expected="a model of the same robot")
        return int(self.model.jnt_bodyid[number])

    def _moved(self, joint: str, body: int, change: Array) -> list[Edit]:
        """Return the edit that places a body anew: N X N⁻¹ L takes the place of L.

        N is the body's pose in its parent while its joint is at zero, which is L only where the joint has no ``ref``.
        """
        if np.array_equal(change, np.eye(4)):
            return []
        inside = np.linalg.inv(self.bodies.pose(int(self.model.body_parentid[body]))) @ self.bodies.pose(body)
        own = np.eye(4)
        own[:3, :3] = quaternion_to_rotation(self.model.body_quat[body])
        own[:3, 3] = self.model.body_pos[body]
        pose = inside @ change @ np.linalg.inv(inside) @ own
        return [with_values(self.content, self._tag(joint, body), {**_placed(pose), **_OTHER_WAYS})]

    def _tag(self, joint: str, body: int) -> Tag:
        """Return where a body stands in the text: by its name, or by the joint in it."""
        name = self.model.body(body).name
        for tag in self.tags:
            own = tag.path[-1] == "joint" and joint and tag.attributes.get("name") == joint and "worldbody" in tag.path
            named = tag.path[-1] == "body" and name and tag.attributes.get("name") == name
            found = self.tags[tag.parent] if own else tag if named else None
            if found is not None and not {"frame", "replicate"} & set(found.path):
                self._require_first(joint, body)
                return found
        problem = f"the tag of body {name or body!r} is not in this file, or stands in a <frame>"
        raise CampaignError(self.name, problem, expected="a model in one file: save it by MuJoCo")

    def _require_first(self, joint: str, body: int) -> None:
        first = self.model.joint(int(self.model.body_jntadr[body])).name if joint else ""
        if first != joint:
            problem = f"joint {joint!r} has no body of its own: it shares one with {first!r}"
            raise CampaignError(self.name, problem, expected="a body between the two")

    def _site(self, body: int, pose: Array) -> Edit:
        """Return the insertion of the target into the body of the last joint."""
        chain, tool = self.robot.robot.chain, target_link(self.robot.robot.tool_frame)
        carrier = self._tag(chain.names[int(chain.movable[-1])], body)
        for tag in self.tags:
            if tag.path[-1] == "site" and tag.attributes.get("name") == tool:
                if self.tags[tag.parent] != carrier:
                    expected = f"it in the body of joint {chain.names[int(chain.movable[-1])]!r}"
                    raise CampaignError(
                        self.name, f"has a site {tool!r} already", found="it elsewhere", expected=expected
                    )
                return with_values(self.content, tag, {**_placed(pose), **_OTHER_WAYS})
        values = "".join(f' {name}="{value}"' for name, value in _placed(pose).items())
        return (
            carrier.stop,
            carrier.stop,
            f"{indent(self.content, carrier.start)}  <site name={quoteattr(tool)}{values}/>",
        )


def _placed(pose: Array) -> Mapping[str, str]:
    return {"pos": digits(pose[:3, 3]), "quat": digits(rotation_to_quaternion(pose[:3, :3]))}


def with_simulator(campaign: Campaign, mjcf: str | Path) -> Campaign:
    """Return a campaign with what a MuJoCo model predicts of its target, as ``sim.*`` columns would bring it.

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
    path = Path(mjcf) if isinstance(mjcf, Path) or not mjcf.lstrip().startswith("<") else None
    name, model, robot = str(path or "the MJCF"), compiled(path or mjcf), campaign.robot
    moving = [robot.chain.names[k] for k in robot.chain.movable]
    for joint in moving:
        if known(model, "joint", joint) is None:
            raise CampaignError(name, f"has no joint {joint!r}", expected="the URDF's names of joints")
    kind, number, held = _target(name, model, campaign)
    root = known(model, "body", robot.root_frame) or 0
    seen = np.empty((campaign.samples, 4, 4))
    bodies = Bodies.of(model)
    for i, row in enumerate(robot.chain.coupling.positions(campaign.q).tolist()):
        bodies.move(dict(zip(moving, row, strict=True)))
        carrier = bodies.site(number) if kind == "site" else bodies.pose(number)
        seen[i] = np.linalg.inv(bodies.pose(root)) @ carrier @ held
    turned = rotation_to_quaternion(seen[:, :3, :3]) if campaign.orientation is not None else None
    return replace(campaign, simulated_position=seen[:, :3, 3], simulated_orientation=turned)


def _target(name: str, model: Any, campaign: Campaign) -> tuple[str, int, Array]:
    """Return the kind and number of what carries the target, and (4, 4) the target's pose on it."""
    declared = np.eye(4)
    declared[:3, 3] = campaign.target
    tool = campaign.robot.tool_frame
    for link, pose in ((target_link(tool), np.eye(4)), (tool, declared)):
        for kind in ("site", "body"):
            number = known(model, kind, link)
            if number is not None:
                return kind, number, pose
    raise CampaignError(name, f"has no tool frame {tool!r}", expected="a body or a site of that name")
