"""What is shown of a campaign, as numbers: poses of all links, the gap row by row, each place's share of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
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
from thermal_robot.viewer.settings import (
    ABOVE,
    ASIDE,
    ASIDE_OF,
    BACK_BY,
    HEAD_LENGTH,
    HEAD_RADIUS,
    LARGE_GAP,
    LONG_ARROW,
    LONGEST_ARROW,
    MOST_POSES,
    NARROWEST,
    SHAFT_RADIUS,
    SMALL_REACH,
    WIDEST,
    Colour,
    linear,
)


class Cloud:
    """The arrows of some rows.

    Parameters
    ----------
    nodes
        What adds them: the ``scene`` of a viser server.
    name
        Of the node.
    scene
        What is shown.
    vectors
        (N, 3) displacements of all rows, m, root frame.
    colour
        Of rows that were not set aside.
    thicker
        How many times as thick as usual they are.
    """

    def __init__(
        self, nodes: Any, name: str, scene: Scene, vectors: Array, colour: Colour, thicker: float = 1.0
    ) -> None:
        self._nodes, self._name, self._scene, self._vectors, self._thicker = nodes, name, scene, vectors, thicker
        self._colours = linear(np.where(scene.aside[:, None], ASIDE, colour).astype(np.uint8))
        self._node: Any = None

    def show(self, rows: NDArray[np.intp], magnification: float, visible: bool) -> None:
        """Draw the arrows of k rows, the same number each time, or hide them."""
        scene = self._scene
        drawn = arrows(scene.predicted[rows], self._vectors[rows], magnification, scene.size, self._thicker)
        if self._node is None:
            self._node = self._nodes.add_batched_meshes_simple(
                self._name,
                *unit_arrow(),
                drawn.turns,
                drawn.starts,
                batched_scales=drawn.stretches,
                batched_colors=self._colours[rows],
                cast_shadow=False,
                receive_shadow=False,
                lod="off",
            )
        self._node.batched_positions, self._node.batched_wxyzs = drawn.starts, drawn.turns
        self._node.batched_scales, self._node.batched_colors = drawn.stretches, self._colours[rows]
        self._node.visible = visible


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


_SIDES = 16


@dataclass(frozen=True, eq=False)
class Arrows:
    """N copies of one arrow that goes from the origin to (0, 0, 1), each turned, stretched and moved.

    Attributes
    ----------
    starts
        (N, 3) where they begin, m.
    turns
        (N, 4) unit quaternions wxyz that turn the z axis along them.
    stretches
        (N, 3) factors along the arrow's own axes; the last is the length, m.
    """

    starts: Array
    turns: Array
    stretches: Array


def arrows(starts: Array, displacements: Array, magnification: float, size: float, thicker: float = 1.0) -> Arrows:
    """Return the arrows of displacements.

    Parameters
    ----------
    starts, displacements
        (N, 3) m each.
    magnification
        How many times longer than the displacements they are.
    size
        Of the scene, m: bounds how thick and how long they are.
    thicker
        By how much those bounds on the thickness are wider.
    """
    lengths = np.minimum(magnification * np.linalg.norm(displacements, axis=1), longest(size))
    widths = np.clip(thicker * HEAD_RADIUS * lengths, thicker * NARROWEST * size, thicker * WIDEST * size)
    # an arrow as good as none is a point, not a disc
    widths = np.minimum(widths, lengths)
    return Arrows(
        starts, rotation_to_quaternion(turned_along(displacements)), np.column_stack([widths, widths, lengths])
    )


def longest(size: float) -> float:
    """Return the length, m, at which arrows are cut in a scene of a size, m."""
    return LONGEST_ARROW * size


def unit_arrow() -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (V, 3) and faces (F, 3) of the arrow to (0, 0, 1), whose head has the radius 1."""
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    radii, heights = (SHAFT_RADIUS, SHAFT_RADIUS, 1.0), (0.0, 1.0 - HEAD_LENGTH, 1.0 - HEAD_LENGTH)
    rings = [np.column_stack([r * circle, np.full(_SIDES, z)]) for r, z in zip(radii, heights, strict=True)]
    vertices = np.vstack([*rings, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    here = np.arange(_SIDES)
    there = (here + 1) % _SIDES
    foot, tip = 3 * _SIDES, 3 * _SIDES + 1
    faces = [np.column_stack([np.full(_SIDES, foot), there, here])]
    for low in (0, _SIDES):
        high = low + _SIDES
        faces += [np.column_stack([low + here, low + there, high + there])]
        faces += [np.column_stack([low + here, high + there, high + here])]
    faces += [np.column_stack([2 * _SIDES + here, 2 * _SIDES + there, np.full(_SIDES, tip)])]
    return vertices, np.vstack(faces)


def readable(displacements: Array, size: float) -> float:
    """Return the magnification, 1, 2 or 5 times a power of ten, at which large ones are as long as settings say.

    Parameters
    ----------
    displacements
        (N, 3) m.
    size
        Of the scene, m.
    """
    large = float(np.quantile(np.linalg.norm(displacements, axis=1), LARGE_GAP)) if len(displacements) else 0.0
    if large <= 0.0:
        return 1.0
    return round_down(max(LONG_ARROW * size / large, 1.0))


def turned_along(directions: Array) -> Array:
    """Return (N, 3, 3): rotations that turn the z axis along each of N directions, and leave it where there is none."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    z = np.where(lengths > 0.0, directions / np.where(lengths > 0.0, lengths, 1.0), [0.0, 0.0, 1.0])
    # the axis of the root frame that lies farthest from it, made perpendicular
    helper = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)
