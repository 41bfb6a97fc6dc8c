"""The values behind figures: what one effect of a diagnosis explains, place by place, and the arm in some rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.effects.effect import in_words
from thermal_robot.kinematics import link_poses
from thermal_robot.shapes.visuals import Solid, hulls

if TYPE_CHECKING:
    from thermal_robot.diagnosis.parts import Where
    from thermal_robot.robot import Robot


@dataclass(frozen=True, eq=False)
class Place:
    """One place where an effect acts: the error in n rows against the ``quantity`` that drives it.

    ``share`` 0..1 of the effect's contribution enters here. ``values`` (n,) are the quantity's, SI, a few only where it
    is ``levels``. ``before``, ``after`` and ``spread`` (n,): error with the effect left in, without it, and one sigma
    of noise of both, in ``unit``: rad or m at the place, ``m at the tool`` where it both shifts and turns. ``line``
    (2, k) is the fitted law. ``centred``: told less the mean, which unknown frames take up as well.
    """

    kind: str
    name: str
    share: float
    quantity: str
    quantity_unit: str
    values: Array
    levels: bool
    unit: str
    before: Array
    after: Array
    spread: Array
    line: Array
    centred: bool = False

    @property
    def words(self) -> str:
        """The place with its kind, unless its name says it already."""
        return in_words(self.kind, self.name)


@dataclass(frozen=True, eq=False)
class Explained:
    """What one effect explains: places with a share worth drawing, largest first, and how many more were left out."""

    effect: str
    places: tuple[Place, ...]
    left_out: int


@dataclass(frozen=True, eq=False)
class Arm:
    """L links of a chain in R postures, with the shares 0..1 of the gap's mean square that enter at each place.

    ``links`` are named from the root frame to the tool frame; ``poses`` (R, L, 4, 4) stand in the root frame, m, as the
    model has them at what was commanded; ``joints`` are the J movable ones, those that mimic another too; ``moves``
    (J,) is which link each moves first; ``hulls`` is what links look like, nothing of those without a shape. Besides
    link and joint shares (L,) and (J,): where the robot stands, between tool frame and target, and at the instrument.
    """

    links: tuple[str, ...]
    link_shares: Array
    poses: Array
    joints: tuple[str, ...]
    joint_shares: Array
    moves: NDArray[np.int64]
    hulls: tuple[Solid, ...]
    base_share: float = 0.0
    tool_share: float = 0.0
    instrument_share: float = 0.0


def arm(robot: Robot, q: ArrayLike, where: Where) -> Arm:
    """Return the arm in (R, n) joint positions, rad or m, with the shares of its places."""
    chain = robot.chain
    links = (*chain.parent_links, robot.tool_frame)
    joints = [chain.names[k] for k in chain.movable]
    for j, name in zip(chain.coupling.driving.tolist(), robot.joint_names, strict=True):
        joints[j] = name  # one beside the chain is seen at the first that follows it
    return Arm(
        links=links,
        link_shares=np.array([where.links.get(name, 0.0) for name in links]),
        poses=link_poses(robot, q)[:, [robot.urdf_links.index(name) for name in links]],
        joints=tuple(joints),
        joint_shares=np.array([where.joints.get(name, 0.0) for name in joints]),
        moves=np.asarray(chain.movable) + 1,
        hulls=hulls(robot),
        base_share=where.beyond.get("base", 0.0),
        tool_share=where.beyond.get("tool", 0.0),
        instrument_share=where.beyond.get("instrument", 0.0),
    )
