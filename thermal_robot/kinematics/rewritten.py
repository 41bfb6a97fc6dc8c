"""A URDF with other origins of some joints, a further link, a comment; everything else of its text stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

from thermal_robot.arrays import Array
from thermal_robot.errors import RobotError
from thermal_robot.kinematics.lie import rotation_to_rpy
from thermal_robot.kinematics.markup import Edit, Tag, changed, comment, encoded, indent, tags, with_values


def rewritten(
    urdf: str,
    origins: Mapping[str, Array],
    *,
    links: Mapping[str, tuple[str, Array]] | None = None,
    notes: Sequence[str] = (),
) -> str:
    """Return a URDF with some joints placed anew.

    Parameters
    ----------
    urdf
        XML text that :func:`thermal_robot.robot.load_robot` takes.
    origins
        (4, 4) placement of each joint that is placed anew in the frame of its parent link, m.
    links
        By the name of a link to add: the link that carries it by a fixed joint, and its (4, 4) placement there. The
        joint has the link's name and ``_joint``. A link of that name that is carried so already is placed anew.
    notes
        Lines of a comment that is put before the robot.

    Returns
    -------
    str
        XML text; numbers with all digits.

    Raises
    ------
    RobotError
        If it has no such joint, or a link or joint to add has the name of another one.
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
        made = f'<joint name={quoteattr(joint)} type="fixed">{ends}{_origin(pose)}</joint>'
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


def _origin(pose: Array) -> str:
    xyz, rpy = xyz_rpy(pose)
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def _placed(content: bytes, found: Sequence[Tag], joint: int, pose: Array) -> Edit:
    """Return the change that gives a joint an origin, in the tag that it has or in one of its own."""
    inside = [t for t in found if t.parent == joint]
    own = next((t for t in inside if t.path[-1] == "origin"), None)
    if own is None:
        first = inside[0].start
        return first, first, _origin(pose) + indent(content, first)
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
