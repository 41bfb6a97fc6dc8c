"""Unknown frames, fitted exactly before any effect: the tracker may stand anywhere, turned by any angle."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from thermal_robot.campaign import Campaign
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import solve
from thermal_robot.inference.columns import frame_columns
from thermal_robot.kinematics import align, exp6, quaternion_to_rotation, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import Robot

Array = NDArray[np.float64]


class Paired(Protocol):
    """Commands paired with measurements, as a campaign holds them; see :class:`~thermal_robot.campaign.Campaign`."""

    @property
    def robot(self) -> Robot: ...  # noqa: D102
    @property
    def q(self) -> Array: ...  # noqa: D102
    @property
    def position(self) -> Array | None: ...  # noqa: D102
    @property
    def orientation(self) -> Array | None: ...  # noqa: D102
    @property
    def simulated_position(self) -> Array | None: ...  # noqa: D102
    @property
    def base_known(self) -> bool: ...  # noqa: D102
    @property
    def tool_known(self) -> bool: ...  # noqa: D102


def register(campaign: Campaign, keep: NDArray[np.bool_] | None = None) -> Frames:
    """Fit the unknown frames to the nominal robot, and nothing else.

    Alternates the rigid alignment of the base with the linear fit of the target's place, from several starts (the
    target may sit 0.3 m from the tool frame), on a sample of the rows and with weights that let gross errors go; then
    Gauss-Newton on all rows.

    Parameters
    ----------
    campaign
        With measurements.
    keep
        (N,) True for the rows to fit by least squares, False for those set aside; where absent all are fitted,
        robustly.

    Returns
    -------
    Frames
        Known frames as declared, unknown ones fitted.

    Raises
    ------
    EstimationError
        If fewer than three rows have weight.
    """
    frames = Frames.declared(campaign)
    if campaign.base_known and (campaign.tool_known or campaign.simulated_position is not None):
        return frames
    used = np.arange(campaign.samples) if keep is None else np.flatnonzero(keep)
    if len(used) < 3:
        raise EstimationError("at least three rows are needed to fit the unknown frames")
    sample = campaign.take(used[np.linspace(0, len(used) - 1, min(len(used), settings.START_ROWS)).astype(int)])
    fits = [alternate(sample, frames, frames.tool[:3, 3] + start) for start in starts(campaign)]
    _, best = min(fits, key=lambda fit: fit[0])
    return _refine(campaign.take(used), best, robust=keep is None)


def starts(campaign: Paired) -> Array:
    """(K, 3) shifts of the target, m, from which :func:`alternate` begins; the first is none."""
    fixed = campaign.tool_known or campaign.simulated_position is not None
    return settings.TARGET_STARTS[:1] if fixed else settings.TARGET_STARTS


def _soft(distance: Array) -> Array:
    """Cauchy weights at the scale of the median distance: a third of the rows may be grossly wrong."""
    return np.asarray(
        1.0 / (1.0 + (distance / (settings.CAUCHY_SCALE * np.median(distance) + settings.NO_DISTANCE)) ** 2)
    )


def alternate(
    campaign: Paired, declared: Frames, target: Array, rounds: int = settings.START_ROUNDS
) -> tuple[float, Frames]:
    """Alternate the rigid alignment of the base with the linear fit of the target's place, robustly.

    Parameters
    ----------
    campaign
        With measurements.
    declared
        Frames as declared; known ones stay.
    target
        (3,) where the target may sit on the tool frame, m.
    rounds
        Alternations at most.

    Returns
    -------
    tuple
        Median distance that is left, m, and the frames.
    """
    measured = np.asarray(campaign.position)
    if campaign.simulated_position is not None:
        origin, turns = np.asarray(campaign.simulated_position), None
    else:
        poses = tool_poses(campaign.robot, campaign.q)
        origin, turns = poses[:, :3, 3], poses[:, :3, :3]
    base, weights, cost = declared.base, np.ones(len(measured)), np.inf
    place = declared.tool[:3, 3] if campaign.tool_known else target
    for _ in range(rounds):
        predicted = origin if turns is None else origin + turns @ place
        if not campaign.base_known:
            base = align(predicted, measured, weights)
        if turns is not None and not campaign.tool_known:
            # (measured in the root frame − origin) = R t: the mean over rows of Rᵀ(…), since each R is orthogonal
            local = np.einsum("nji,nj->ni", turns, (measured - base[:3, 3]) @ base[:3, :3] - origin)
            place = weights @ local / weights.sum()
            predicted = origin + turns @ place
        distance = np.linalg.norm(measured - predicted @ base[:3, :3].T - base[:3, 3], axis=1)
        weights = _soft(distance)
        previous, cost = cost, float(np.median(distance))
        if abs(previous - cost) < settings.START_SETTLED * cost:
            break
    tool = declared.tool.copy()
    tool[:3, 3] = place
    if campaign.orientation is not None and turns is not None and not campaign.tool_known:
        seen = turns.transpose(0, 2, 1) @ base[:3, :3].T @ quaternion_to_rotation(campaign.orientation)
        u, _, vt = np.linalg.svd(np.einsum("n,nij->ij", weights, seen))
        tool[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return cost, Frames(base, tool)


def moved(frames: Frames, step: Array, names: tuple[str, ...]) -> Frames:
    """Return the frames after a step along :func:`~thermal_robot.inference.columns.frame_columns`."""
    base_step = step[[k for k, name in enumerate(names) if name == "base"]]
    tool_step = step[[k for k, name in enumerate(names) if name == "tool"]]
    base, tool = frames.base, frames.tool
    if base_step.size:
        base = base @ exp6(base_step)
    if tool_step.size:
        tool = exp6(np.concatenate([tool_step, np.zeros(6 - tool_step.size)])) @ tool
    return Frames(base, tool)


def _refine(campaign: Campaign, frames: Frames, robust: bool) -> Frames:
    """Gauss-Newton on position and orientation, each at the scale of its own median; noisier rows count less."""
    relative = np.ones((1, 1)) if campaign.relative_noise is None else campaign.relative_noise
    for _ in range(settings.REFINE_ROUNDS):
        observations = observe(campaign, frames)
        columns, names = frame_columns(observations)
        gap = observations.gap
        root_weight = np.zeros_like(gap)
        for part in (slice(0, 3), slice(3, 6))[: gap.shape[1] // 3]:
            distance = np.linalg.norm(gap[:, part], axis=1)
            weight = np.sqrt(_soft(distance)) if robust else np.ones(len(distance))
            root_weight[:, part] = weight[:, None] / (np.median(distance) + settings.NO_DISTANCE)
        root_weight = root_weight / relative
        design = (columns * root_weight[:, :, None]).reshape(-1, len(names))
        step = solve(design.T @ design, design.T @ (gap * root_weight).ravel())
        frames = moved(frames, step, names)
        if np.abs(step).max() < settings.REFINE_SETTLED:
            break
    return frames
