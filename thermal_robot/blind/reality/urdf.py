"""A URDF as plain links and joints: a reading of its own, so that a mistake of the program's reader is seen."""

from __future__ import annotations

import re
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """One joint of the tree: ``origin`` (xyz, rpy) in its parent link, unit ``axis`` in its own frame, limits, type.

    ``mimic`` is the joint that it follows, with multiplier and offset; ``None`` for one that is commanded itself.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: Array
    rpy: Array
    axis: Array
    lower: float
    upper: float
    mimic: tuple[str, float, float] | None = None

    @property
    def movable(self) -> bool:
        """Whether it moves at all."""
        return self.kind in ("revolute", "continuous", "prismatic")

    @property
    def commanded(self) -> bool:
        """Whether it is commanded itself, instead of following another one or standing still."""
        return self.movable and self.mimic is None

    @property
    def held(self) -> float:
        """Where a joint that is not commanded stands: 0, or its limit nearest to 0."""
        return float(np.clip(0.0, self.lower, self.upper))


@dataclass(frozen=True)
class Tree:
    """Joints in order from the root, masses (kg) and centres of mass (3,) by link, and the root link."""

    root: str
    joints: tuple[Joint, ...]
    mass: dict[str, float]
    centre: dict[str, Array]

    def carried(self, link: str) -> float:
        """Return the mass of a link and of all that hangs on it, kg."""
        return self.mass[link] + sum(self.carried(j.child) for j in self.joints if j.parent == link)

    def chain(self, tool_frame: str) -> tuple[Joint, ...]:
        """Return the joints from the root to a link."""
        by_child = {j.child: j for j in self.joints}
        found: list[Joint] = []
        link = tool_frame
        while link != self.root:
            found.insert(0, by_child[link])
            link = found[0].parent
        return tuple(found)


def read(text: str) -> Tree:
    """Read URDF text; meshes and everything that has no part in statics are passed over."""
    text = re.sub(r"<\?xml[^>]*\?>", "", text)
    robot = ElementTree.fromstring(text.strip())
    mass, centre = {}, {}
    for link in robot.findall("link"):
        name, inertial = str(link.attrib["name"]), link.find("inertial")
        weight = None if inertial is None else inertial.find("mass")
        mass[name] = 0.0 if weight is None else float(weight.attrib["value"])
        centre[name] = np.zeros(3) if inertial is None else _numbers(inertial.find("origin"), "xyz")
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
    axis = _numbers(node.find("axis"), "xyz") if node.find("axis") is not None else np.array([1.0, 0, 0])
    limit, mimic, kind = node.find("limit"), node.find("mimic"), node.attrib["type"]
    bounded = limit is not None and kind in ("revolute", "prismatic")
    parent, child = node.find("parent"), node.find("child")
    assert parent is not None  # a URDF joint has both
    assert child is not None
    return Joint(
        name=node.attrib["name"],
        kind=kind,
        parent=parent.attrib["link"],
        child=child.attrib["link"],
        xyz=_numbers(node.find("origin"), "xyz"),
        rpy=_numbers(node.find("origin"), "rpy"),
        axis=axis / max(float(np.linalg.norm(axis)), 1e-12),
        lower=float(limit.get("lower", 0.0)) if bounded and limit is not None else -np.inf,
        upper=float(limit.get("upper", 0.0)) if bounded and limit is not None else np.inf,
        mimic=None if mimic is None else _coupling(mimic),
    )


def _coupling(node: ElementTree.Element) -> tuple[str, float, float]:
    return node.attrib["joint"], float(node.get("multiplier", 1.0)), float(node.get("offset", 0.0))


def _numbers(node: ElementTree.Element | None, name: str) -> Array:
    written = "0 0 0" if node is None else node.get(name, "0 0 0")
    return np.array(written.split(), dtype=float)
