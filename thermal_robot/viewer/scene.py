"""What is shown of a campaign, as numbers: poses of all links, the gap row by row, each place's share of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis import Diagnosis
from thermal_robot.errors import CampaignError
from thermal_robot.inference.frames import register
from thermal_robot.kinematics import chain_frames, link_poses
from thermal_robot.observations import Observations, observe
from thermal_robot.robot import Robot
from thermal_robot.viewer.settings import ABOVE, ASIDE_OF, BACK_BY, MOST_POSES, SMALL_REACH

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """N rows of a campaign, ready to be drawn; m, root frame.

    Attributes
    ----------
    title, summary
        Name of the campaign, and what is said of it in a sentence.
    robot
        Nominal, as its URDF describes it.
    rows
        (N,) row numbers in the file.
    q
        (N, n) commanded joint positions.
    predicted
        (N, 3) where the nominal robot has the measured point, with the unknown frames fitted.
    gap
        (N, 3) measured − predicted.
    remainder
        (N, 3) measured − fitted; ``None`` where nothing was diagnosed.
    aside
        (N,) whether a row was set aside.
    target
        (3,) the measured point in the tool frame.
    shares
        Share of the gap's mean square by place, its kind and name, largest first; empty where nothing was diagnosed.
    size, centre
        Diagonal of the box about all poses, and its middle, (3,).
    """

    title: str
    summary: str
    robot: Robot
    rows: NDArray[np.int64]
    q: Array
    predicted: Array
    gap: Array
    remainder: Array | None
    aside: NDArray[np.bool_]
    target: Array
    shares: Mapping[tuple[str, str], float] = field(default_factory=dict)
    size: float = field(init=False)
    centre: Array = field(init=False)

    def __post_init__(self) -> None:
        some = np.unique(np.linspace(0, len(self.q) - 1, min(len(self.q), MOST_POSES)).astype(int))
        frames = chain_frames(self.robot, self.q[some])
        points = np.vstack([np.zeros((1, 3)), self.predicted[some], frames.positions.reshape(-1, 3)])
        low, high = points.min(axis=0), points.max(axis=0)
        object.__setattr__(self, "size", float(np.linalg.norm(high - low)))
        object.__setattr__(self, "centre", 0.5 * (low + high))

    @property
    def up(self) -> Array:
        """(3,) unit vector against gravity."""
        strength = np.linalg.norm(self.robot.gravity)
        return np.asarray(-self.robot.gravity / strength) if strength > 0.0 else np.array([0.0, 0.0, 1.0])

    @property
    def eye(self) -> Array:
        """(3,) where the scene is looked at from, m: across the arm, so that it does not point there."""
        up = self.up
        reach = self.predicted.mean(axis=0)
        reach = reach - (reach @ up) * up
        length = np.linalg.norm(reach)
        # where the arm reaches all round, any direction will do
        ahead = reach / length if length > SMALL_REACH * self.size else np.cross(np.eye(3)[np.argmin(np.abs(up))], up)
        return np.asarray(self.centre + self.size * (ASIDE_OF * np.cross(ahead, up) + BACK_BY * ahead + ABOVE * up))

    def links(self, row: int) -> Array:
        """Return (L, 4, 4): poses of the links of the URDF in one row, in the order of ``robot.urdf_links``."""
        return np.asarray(link_poses(self.robot, self.q[row])[0])

    def joints(self, row: int) -> tuple[Array, Array]:
        """Return (n, 3) origins and (n, 3) unit axes of the driven joints in one row, or of what first follows them."""
        chain, frames = self.robot.chain, chain_frames(self.robot, self.q[row])
        elements = chain.movable[chain.coupling.driving]
        axes = np.einsum("kij,kj->ki", frames.rotations[0, elements], chain.axes[elements])
        return frames.positions[0, elements], axes


def scene_of_campaign(campaign: Campaign) -> Scene:
    """Return the gap of a campaign, with the unknown frames fitted and nothing else.

    Raises
    ------
    CampaignError
        If nothing was measured.
    EstimationError
        If there are too few rows for the unknown frames.
    """
    if campaign.position is None or not campaign.samples:
        raise CampaignError(campaign.name, "nothing was measured", expected="a campaign with measured positions")
    nominal = observe(campaign, register(campaign))
    said = "Not diagnosed: the gap alone, with the unknown frames fitted."
    return _scene(nominal, said, None, np.zeros(campaign.samples, dtype=bool), {})


def scene_of_diagnosis(diagnosis: Diagnosis) -> Scene:
    """Return the gap of a diagnosed campaign, what remains of it, and each place's share.

    Raises
    ------
    ValueError
        If the diagnosis was made without its fit.
    """
    if diagnosis.fit is None:
        raise ValueError("this diagnosis was made without its fit")
    rows = diagnosis.rows
    if not diagnosis.usable:
        return _scene(diagnosis.fit.nominal, diagnosis.reason, None, rows.outliers, {})
    return _scene(
        diagnosis.fit.nominal, diagnosis.summary, rows.remainder[:, :3], rows.outliers, diagnosis.where.places
    )


def _scene(
    nominal: Observations,
    summary: str,
    remainder: Array | None,
    aside: NDArray[np.bool_],
    shares: Mapping[tuple[str, str], float],
) -> Scene:
    campaign = nominal.campaign
    return Scene(
        title=campaign.name,
        summary=summary,
        robot=campaign.robot,
        rows=campaign.rows,
        q=campaign.q,
        predicted=nominal.position,
        gap=nominal.gap[:, :3],
        remainder=remainder,
        aside=aside,
        target=nominal.frames.tool[:3, 3],
        shares=shares,
    )
