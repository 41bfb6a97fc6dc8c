"""A campaign as the standard looks at it: attained and commanded poses in the axes of the base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.plausible import SAME_COMMAND
from thermal_robot.errors import CampaignError, require
from thermal_robot.inference.frames import register
from thermal_robot.iso9283.criteria import Accuracy, Attained, accuracy
from thermal_robot.kinematics import quaternion_to_rotation
from thermal_robot.observations import Frames, observe

Rows = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Seen:
    """A campaign in the axes of the base.

    Attributes
    ----------
    campaign
        Whose rows these are.
    attained
        What was measured, row by row.
    commanded
        The nominal robot's poses; ``None`` where the frames take up all figures, so that AP would be zero by itself.
    corrected
        What a corrected model predicts; ``None`` without one.
    fitted, unknowns, figures
        The frames that were fitted to the same rows, how many numbers that took, and how many figures of different
        poses there are.
    """

    campaign: Campaign
    attained: Attained
    commanded: Attained | None
    corrected: Attained | None
    fitted: tuple[str, ...]
    unknowns: int
    figures: int

    @classmethod
    def of(cls, campaign: Campaign, frames: Frames | None, predicted: tuple[Array, Array | None] | None) -> Seen:
        """See a campaign; arguments as of :func:`~thermal_robot.iso9283.measure.performance`."""
        each = 3 if campaign.orientation is None else 6
        held = campaign.tool_known or campaign.simulated_position is not None
        unknown = {"base": 0 if campaign.base_known else 6, "tool": 0 if held else each}
        taken = sum(unknown.values())
        figures = each * len(np.unique(np.round(campaign.q / SAME_COMMAND), axis=0))
        told = taken < figures
        if frames is None:
            # by least squares, as surveyors align two systems: the standard sets no cycle aside
            every = np.ones(campaign.samples, dtype=bool)
            frames = register(campaign, every) if told else Frames.declared(campaign)
        base = frames.base
        should = None
        if told:
            found = observe(campaign, frames)
            should = Attained(found.position, found.rotation)
        fitted = tuple(name for name, count in unknown.items() if count)
        is_ = _in_base(base, np.asarray(campaign.position), campaign.orientation)
        after = None if predicted is None else _in_base(base, *_checked(campaign, predicted))
        return cls(campaign, is_, should, after, fitted, taken, figures)

    def accuracy(self, rows: Rows) -> Accuracy | None:
        """Return AP of some rows."""
        if self.commanded is None:
            return None
        return accuracy(self.attained.take(rows), self.commanded.take(rows))

    def after(self, rows: Rows) -> Accuracy | None:
        """Return AP of some rows against the corrected model."""
        if self.corrected is None:
            return None
        rows = rows[np.isfinite(self.corrected.position[rows]).all(axis=1)]
        return accuracy(self.attained.take(rows), self.corrected.take(rows)) if len(rows) else None


def _in_base(base: Array, position: Array, orientation: Array | None) -> Attained:
    """Turn what stands in the measurement frame into the axes of the base."""
    turn, origin = base[:3, :3], base[:3, 3]
    rotation = None if orientation is None else turn.T @ quaternion_to_rotation(orientation)
    return Attained((position - origin) @ turn, rotation)


def _checked(campaign: Campaign, predicted: tuple[Array, Array | None]) -> tuple[Array, Array | None]:
    """Refuse predictions of other rows."""
    kind = "positions (N, 3) and orientations (N, 4) or None, as predict() returns them"
    require("performance(), predicted", predicted, (tuple, list), kind)
    position, orientation = (None if part is None else np.asarray(part, dtype=float) for part in predicted)
    wrong = position is None or position.shape != (campaign.samples, 3)
    if wrong or (orientation is not None and orientation.shape != (campaign.samples, 4)):
        found = " and ".join("None" if part is None else str(part.shape) for part in (position, orientation))
        expected = f"{kind}, with N = {campaign.samples}"
        raise CampaignError("performance(), predicted", "other rows were predicted", found=found, expected=expected)
    return np.asarray(position), None if campaign.orientation is None else orientation
