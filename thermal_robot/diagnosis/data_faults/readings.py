"""A campaign as columns of a table: what can be exchanged, turned round or shifted in it, and how well it then fits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults.settings import COARSE_ROUNDS
from thermal_robot.inference import settings
from thermal_robot.inference.alternation import alternate, starts
from thermal_robot.kinematics import log3, quaternion_to_rotation, tool_poses
from thermal_robot.observations import Frames
from thermal_robot.robot import Robot

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Readings:
    """The columns that a fault of the data may have struck.

    Attributes
    ----------
    robot
        The robot.
    q
        (N, n) commanded joint positions, rad or m.
    position, orientation
        (N, 3) m and (N, 4) wxyz as measured; the latter ``None`` where it was not.
    simulated_position
        (N, 3) m, what the user's own simulator predicts; ``None`` where it is not given.
    clock
        (N,) time, s; ``None`` where it was not recorded.
    base_known, tool_known, declared
        Which frames are known, and all as declared.
    length_unit
        In which the file gives positions.
    known
        (N,) rows that are determined: a shifted column ends before the table does.
    """

    robot: Robot
    q: Array
    position: Array
    orientation: Array | None
    simulated_position: Array | None
    clock: Array | None
    base_known: bool
    tool_known: bool
    declared: Frames
    length_unit: str
    known: Rows

    @classmethod
    def of(cls, campaign: Campaign) -> Readings:
        """Take the columns of a campaign with measurements."""
        return cls(
            campaign.robot,
            campaign.q,
            np.asarray(campaign.position),
            # what axes do to several targets they do to the turn that these tell: their middle says enough
            campaign.orientation if campaign.targets is None else None,
            campaign.simulated_position,
            campaign.covariates.get("time"),
            campaign.base_known,
            campaign.tool_known,
            Frames.declared(campaign),
            campaign.units.length,
            np.ones(campaign.samples, dtype=bool),
        )

    def take(self, rows: NDArray[np.int64]) -> Readings:
        """Return some of the rows, by number."""
        columns: dict[str, Any] = {
            name: None if (column := getattr(self, name)) is None else column[rows]
            for name in ("q", "position", "orientation", "simulated_position", "clock", "known")
        }
        return replace(self, **columns)

    def where(self, own: Rows, other: Readings) -> Readings:
        """Return the rows of these readings where told (N,), and of other ones elsewhere."""
        columns: dict[str, Any] = {}
        for name in ("q", "position", "orientation", "simulated_position"):
            mine, theirs = getattr(self, name), getattr(other, name)
            columns[name] = None if mine is None else np.where(own[:, None], mine, theirs)
        return replace(self, **columns)

    def spread(self) -> float:
        """Return the diagonal of the volume over which the commands move the tool, m."""
        return float(np.linalg.norm(np.ptp(tool_poses(self.robot, self.q)[:, :3, 3], axis=0)))

    def align(self, *, coarse: bool = False) -> Frames:
        """Return the frames as the rows put them, robustly; in few steps from one start only where that will do."""
        target = self.declared.tool[:3, 3]
        begun = starts(self)[:1] if coarse else starts(self)
        rounds = COARSE_ROUNDS if coarse else settings.START_ROUNDS
        return alternate(self, self.declared, target + begun, rounds)[1]

    def distance(self, frames: Frames) -> Array:
        """(N,) distance between measured and predicted pose, m; a turn counts by what it moves at a lever's length."""
        poses = tool_poses(self.robot, self.q)
        point = frames.tool[:3, 3]
        predicted = (
            poses[:, :3, 3] + poses[:, :3, :3] @ point if self.simulated_position is None else self.simulated_position
        )
        away2 = ((self.position - predicted @ frames.base[:3, :3].T - frames.base[:3, 3]) ** 2).sum(axis=1)
        if self.orientation is not None and self.simulated_position is None:
            seen = frames.base[:3, :3].T @ quaternion_to_rotation(self.orientation)
            turned = log3(seen @ (poses[:, :3, :3] @ frames.tool[:3, :3]).transpose(0, 2, 1))
            away2 = away2 + settings.LEVER**2 * (turned**2).sum(axis=1)
        return np.asarray(np.sqrt(away2))


def rms(distance: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(distance**2)))
