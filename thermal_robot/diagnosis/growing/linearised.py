"""Rows seen at a point: what is left of them, and what a unit of each frame and parameter does there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.growing.choice import Choice, Point
from thermal_robot.effects.gate import checked
from thermal_robot.inference.algebra import equations_of
from thermal_robot.inference.columns import Block, frame_columns, moved_by
from thermal_robot.inference.gauss_newton import corrected_observations
from thermal_robot.observations import Observations


@dataclass(frozen=True, eq=False)
class Seen:
    """N rows at a point.

    ``stack`` (N, m, K + 1): columns of the frames (``names``), the chosen effects, the rivals if asked for, and the
    gap.
    """

    campaign: Campaign
    stack: Array
    names: tuple[str, ...]

    @classmethod
    def at(cls, campaign: Campaign, point: Point, choice: Choice, *, rivals: bool = False) -> Seen:
        """Run the kinematics of some rows with the effects at work."""
        if not campaign.samples:
            return cls._nothing(campaign, point, choice, rivals)
        there = corrected_observations(campaign, point.frames, choice.split(point.values))
        flat, names = frame_columns(there)
        asked = (*choice.blocks, *(choice.rivals if rivals else ()))
        columns = [_columns(there, item) for item in asked]
        return cls(campaign, np.concatenate([flat, *columns, there.gap[:, :, None]], axis=2), names)

    @classmethod
    def _nothing(cls, campaign: Campaign, point: Point, choice: Choice, rivals: bool) -> Seen:
        asked = (*choice.blocks, *(choice.rivals if rivals else ()))
        names = frame_names(campaign)
        width = len(names) + sum(len(item.sizes) for item in asked) + 1
        return cls(campaign, np.zeros((0, choice.measures, width)), names)

    @property
    def gap(self) -> Array:
        """(N, m) measured − predicted at the point, m and rad."""
        return self.stack[:, :, -1]

    @property
    def alike(self) -> Array:
        """(N, m, K + 1) columns and gap, in units of each row's own noise over that of all."""
        relative = self.campaign.relative_noise
        return self.stack if relative is None else self.stack / relative[:, :, None]


def _columns(there: Observations, item: Block) -> Array:
    """(N, m, P) columns of an effect's parameters; zero for those of which these rows tell nothing."""
    known = {parameter.name: parameter for parameter in checked(item.effect, there)}
    told = [k for k, parameter in enumerate(item.bare) if parameter.name in known]
    found = np.zeros((there.campaign.samples, 6 if there.campaign.measures == "pose" else 3, len(item.bare)))
    found[:, :, told] = moved_by(there, [known[item.bare[k].name] for k in told])
    return found


def frame_names(campaign: Campaign) -> tuple[str, ...]:
    """Return what the columns of the unknown frames are (:func:`~thermal_robot.inference.columns.frame_columns`)."""
    measures = 6 if campaign.measures == "pose" else 3
    tool = not campaign.tool_known and campaign.simulated_position is None
    return (*("base",) * (0 if campaign.base_known else 6), *("tool",) * (measures if tool else 0))


def products(rows: Array, weights: Array) -> Array:
    """(G, K + 1, K + 1) products of weighed rows (N, m, K + 1), positions and orientations apart."""
    groups = rows.shape[1] // 3
    found = np.zeros((groups, rows.shape[2], rows.shape[2]))
    for own, part in zip(found, np.split(rows * np.sqrt(weights)[:, None, None], groups, axis=1), strict=True):
        flat = equations_of(part)
        own += flat.T @ flat
    return found


def carried(sums: Array, step: Array) -> Array:
    """Return products (…, K + 1, K + 1) with (k,) times the first columns taken from the last: the gap after a step."""
    change = np.eye(sums.shape[-1])
    change[: len(step), -1] = -step
    return np.asarray(change.T @ sums @ change)
