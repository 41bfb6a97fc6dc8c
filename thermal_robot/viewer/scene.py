"""Scene data of a campaign: link poses, gap by row, share by place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis import Diagnosis
from thermal_robot.errors import CampaignError
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import chain_frames, link_poses, rotation_to_quaternion
from thermal_robot.observations import Observations, observe
from thermal_robot.report.units import round_down
from thermal_robot.robot import Robot
from thermal_robot.viewer import settings


@dataclass(frozen=True, eq=False)
class Scene:
    """Data of the three-dimensional view of a campaign's N rows; m, root frame.

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
    shares: Mapping[tuple[str, str], float]

    @cached_property
    def _box(self) -> tuple[Array, Array]:
        some = np.unique(np.linspace(0, len(self.q) - 1, min(len(self.q), settings.MOST_POSES)).astype(int))
        positions = chain_frames(self.robot, self.q[some]).positions.reshape(-1, 3)
        points = np.vstack([np.zeros((1, 3)), self.predicted[some], positions])
        return points.min(axis=0), points.max(axis=0)

    @property
    def size(self) -> float:
        """Diagonal, m, of the box about the root, the joints and the predicted points in up to 500 rows."""
        return float(np.linalg.norm(self._box[1] - self._box[0]))

    @property
    def centre(self) -> Array:
        """(3,) m, middle of the box whose diagonal is `size`."""
        return np.asarray(0.5 * (self._box[0] + self._box[1]))

    @property
    def up(self) -> Array:
        """(3,) unit vector against gravity."""
        strength = np.linalg.norm(self.robot.gravity)
        return np.asarray(-self.robot.gravity / strength) if strength > 0.0 else np.array([0.0, 0.0, 1.0])

    @property
    def eye(self) -> Array:
        """Camera position (3,), m: beside the direction in which the arm reaches, and above."""
        up, mean = self.up, self.predicted.mean(axis=0)
        ahead = mean - (mean @ up) * up
        reach = np.linalg.norm(ahead)
        if reach <= settings.SMALL_REACH * self.size:  # where the arm reaches all round, any direction will do
            ahead, reach = np.cross(np.eye(3)[np.argmin(np.abs(up))], up), np.float64(1.0)
        ahead = ahead / reach
        away = settings.ASIDE_OF * np.cross(ahead, up) + settings.BACK_BY * ahead + settings.ABOVE * up
        return np.asarray(self.centre + self.size * away)

    def links(self, row: int) -> Array:
        """Poses (L, 4, 4) of the URDF's links in one row, in the order of ``robot.urdf_links``."""
        return np.asarray(link_poses(self.robot, self.q[row])[0])

    def joints(self, row: int) -> tuple[Array, Array]:
        """Origins (n, 3) and unit axes (n, 3) of the driven joints in one row, or of their first followers."""
        chain, frames = self.robot.chain, chain_frames(self.robot, self.q[row])
        elements = chain.movable[chain.coupling.driving]
        axes = np.einsum("kij,kj->ki", frames.rotations[0, elements], chain.axes[elements])
        return frames.positions[0, elements], axes


def scene_of_campaign(campaign: Campaign) -> Scene:
    """Scene of a campaign that is not diagnosed: its gap after the unknown frames are fitted (registration).

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
    """Scene of a diagnosed campaign: gap, residual, share of each place.

    Raises
    ------
    ValueError
        If the diagnosis was made without its fit.
    """
    if diagnosis.fit is None:
        raise ValueError("this diagnosis was made without its fit")
    nominal, rows = diagnosis.fit.nominal, diagnosis.rows
    if not diagnosis.usable:
        return _scene(nominal, diagnosis.reason, None, rows.outliers, {})
    return _scene(nominal, diagnosis.summary, rows.remainder[:, :3], rows.outliers, diagnosis.where.places)


def _scene(
    nominal: Observations,
    summary: str,
    remainder: Array | None,
    aside: NDArray[np.bool_],
    shares: Mapping[tuple[str, str], float],
) -> Scene:
    of, gap, target = nominal.campaign, nominal.gap[:, :3], nominal.frames.tool[:3, 3]
    return Scene(of.name, summary, of.robot, of.rows, of.q, nominal.position, gap, remainder, aside, target, shares)


def arrows(displacements: Array, magnification: float, size: float, thicker: float = 1.0) -> tuple[Array, Array]:
    """Return the transforms of :func:`unit_arrow` that draw displacements (N, 3), m.

    Returns unit quaternions wxyz (N, 4) that turn the z axis along them; factors (N, 3) stretch the arrow along its own
    axes, the last of them to its length, m. The ``size`` of the scene, m, bounds how long it is, and how thick:
    ``thicker`` times as usual.
    """
    lengths = np.minimum(magnification * np.linalg.norm(displacements, axis=1), settings.LONGEST_ARROW * size)
    bounds = thicker * size * settings.NARROWEST, thicker * size * settings.WIDEST
    # an arrow as good as none is a point, not a disc
    widths = np.minimum(np.clip(thicker * settings.HEAD_RADIUS * lengths, *bounds), lengths)
    return rotation_to_quaternion(turned_along(displacements)), np.column_stack([widths, widths, lengths])


def unit_arrow() -> Any:
    """Arrow from the origin to (0, 0, 1), its head of radius 1, as a ``trimesh.Trimesh``."""
    import trimesh

    neck, foot = 1.0 - settings.HEAD_LENGTH, np.eye(4)
    foot[2, 3] = neck
    shaft: Any = trimesh.creation.cylinder(
        settings.SHAFT_RADIUS, segment=[[0.0, 0.0, 0.0], [0.0, 0.0, neck]], sections=16
    )
    return shaft + trimesh.creation.cone(1.0, settings.HEAD_LENGTH, sections=16, transform=foot)


def readable(displacements: Array, size: float) -> float:
    """Largest magnification, 1, 2 or 5 times a power of ten, that draws the gaps' 90 % quantile at most 0.08 ``size``.

    At least 1. Displacements (N, 3) and the ``size`` of the scene are in m.
    """
    lengths = np.linalg.norm(displacements, axis=1)
    large = float(np.quantile(lengths, settings.LARGE_GAP)) if len(lengths) else 0.0
    return round_down(max(settings.LONG_ARROW * size / large, 1.0)) if large > 0.0 else 1.0


def turned_along(directions: Array) -> Array:
    """Rotations (N, 3, 3) that turn the z axis to each of N directions; a zero vector counts as the z direction."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    z = np.where(lengths > 0.0, directions / np.where(lengths > 0.0, lengths, 1.0), [0.0, 0.0, 1.0])
    # the axis of the root frame that lies farthest from it, made perpendicular
    x = np.cross(np.eye(3)[np.argmin(np.abs(z), axis=1)], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)
