"""Unknown frames, fitted exactly before any effect: the tracker may stand anywhere, turned by any angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, solve
from thermal_robot.inference.alternation import alternate, middle, soft, starts
from thermal_robot.inference.columns import frame_columns
from thermal_robot.kinematics import exp6
from thermal_robot.observations import Frames, observe


def register(campaign: Campaign, keep: NDArray[np.bool_] | None = None) -> Frames:
    """Fit the unknown frames to the nominal robot, and nothing else; known ones stay as declared.

    Alternates the rigid alignment of the base with the linear fit of the target's place, from several starts (the
    target may sit 0.3 m from the tool frame), on a sample of the rows, robustly; then Gauss-Newton on all rows, or by
    least squares on those of ``keep`` (N,). Raises :class:`EstimationError` if fewer than three rows have weight.
    """
    if frames_known(campaign):
        return Frames.declared(campaign)
    used = campaign if keep is None or keep.all() else campaign.take(np.flatnonzero(keep))
    return refined_frames(used, found_frames(used), robust=keep is None)


def frames_known(campaign: Campaign) -> bool:
    """Tell whether no frame has to be fitted: both are declared, or a simulator holds the tool."""
    return campaign.base_known and (campaign.tool_known or campaign.simulated_position is not None)


def found_frames(campaign: Campaign) -> Frames:
    """Find the unknown frames to where they are nearly linear; :class:`EstimationError` below three rows."""
    frames, rows = Frames.declared(campaign), campaign.samples
    if rows < 3:
        raise EstimationError("at least three rows are needed to fit the unknown frames")
    some = np.linspace(0, rows - 1, min(rows, settings.START_ROWS)).astype(np.int64)
    return Frames(*alternate(campaign, frames, frames.tool[:3, 3] + starts(campaign), some=some)[1])


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


def refined_frames(campaign: Campaign, frames: Frames, robust: bool) -> Frames:
    """Gauss-Newton on position and orientation, each at the scale of its own median; noisier rows count less."""
    relative = np.ones((1, 1)) if campaign.relative_noise is None else campaign.relative_noise
    for _ in range(settings.REFINE_ROUNDS):
        observations = observe(campaign, frames)
        columns, names = frame_columns(observations)
        gap = observations.gap
        root_weight = np.zeros_like(gap)
        for part in (slice(0, 3), slice(3, 6))[: gap.shape[1] // 3]:
            distance = np.linalg.norm(gap[:, part], axis=1)
            weight = np.sqrt(soft(distance)) if robust else np.ones(len(distance))
            root_weight[:, part] = weight[:, None] / (middle(distance) + settings.NO_DISTANCE)
        root_weight = root_weight / relative
        design = equations_of(columns * root_weight[:, :, None])
        step = solve(design.T @ design, design.T @ (gap * root_weight).ravel())
        frames = moved(frames, step, names)
        if np.abs(step).max() < settings.REFINE_SETTLED:
            break
    return frames
