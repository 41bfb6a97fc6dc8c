"""A campaign as columns of a table: what can be exchanged, turned round or shifted in it, and how well it then fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults.settings import COARSE_ROUNDS, FEWEST_RELAXED, LEAST_GAP, RIDGE, STRAY
from thermal_robot.inference import settings
from thermal_robot.inference.frames import Placed, alternate, middle, starts
from thermal_robot.kinematics import log3, quaternion_to_rotation, tool_poses
from thermal_robot.observations import Frames
from thermal_robot.robot import Robot

Rows = NDArray[np.bool_]
COLUMNS = ("q", "position", "orientation", "simulated_position")
"""Those that have a row a measurement and may be repaired."""


@dataclass(frozen=True, eq=False)
class Readings:
    """The columns that a fault of the data may have struck."""

    robot: Robot  # the robot
    q: Array  # (N, n) commanded joint positions, rad or m
    # position, orientation: (N, 3) m and (N, 4) wxyz as measured; the latter ``None`` where it was not
    position: Array
    orientation: Array | None
    simulated_position: Array | None  # (N, 3) m, what the user's own simulator predicts; ``None`` where it is not given
    clock: Array | None  # (N,) time, s; ``None`` where it was not recorded
    # base_known, tool_known, declared: which frames are known, and all as declared
    base_known: bool
    tool_known: bool
    declared: Frames
    length_unit: str  # in which the file gives positions
    known: Rows  # (N,) rows that are determined: a shifted column ends before the table does

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
        """Return some of the rows, by number; (S, K) numbers give readings side by side."""
        columns: dict[str, Any] = {
            name: None if (column := getattr(self, name)) is None else column[rows]
            for name in (*COLUMNS, "clock", "known")
        }
        return replace(self, **columns)

    def where(self, own: Rows, other: Readings) -> Readings:
        """Return the rows of these readings where told (..., N), and of other ones elsewhere."""
        columns: dict[str, Any] = {}
        for name in COLUMNS:
            mine, theirs = getattr(self, name), getattr(other, name)
            columns[name] = None if mine is None else np.where(own[..., None], mine, theirs)
        return replace(self, **columns)

    @cached_property
    def poses(self) -> Array:
        """(..., N, 4, 4) of the tool frame as commanded."""
        rows = tool_poses(self.robot, self.q.reshape(-1, self.robot.n))
        return np.ascontiguousarray(rows).reshape(*self.q.shape[:-1], 4, 4)

    def spread(self) -> float:
        """Return the diagonal of the volume over which the commands move the tool, m."""
        return float(np.linalg.norm(np.ptp(self.poses[:, :3, 3], axis=0)))

    def still(self) -> Array:
        """(...) m, the median distance that a robot which does not move leaves."""
        away2 = _norm2(self.position - np.median(self.position, axis=-2, keepdims=True))
        if self.orientation is not None:
            seen = quaternion_to_rotation(self.orientation)
            u, _, vt = np.linalg.svd(seen.sum(axis=-3))
            away2 = away2 + settings.LEVER**2 * _norm2(log3(seen @ (u @ vt)[..., None, :, :].swapaxes(-1, -2)))
        return np.asarray(np.sqrt(middle(away2)))

    def align(self, *, coarse: bool = False, begun: Array | None = None) -> Placed:
        """Return the frames as the rows put them, robustly; in few steps from one start only where that will do.

        ``begun`` (..., P, 3) are other places of the target to start from, m.
        """
        place = self.declared.tool[:3, 3]
        if begun is None or self.tool_known or self.simulated_position is not None:
            begun = place + (starts(self)[:1] if coarse else starts(self))
        rounds = COARSE_ROUNDS if coarse else settings.START_ROUNDS
        poses = self.poses if self.simulated_position is None else None
        return alternate(self, self.declared, begun, rounds, poses=poses)[1]

    def distance(self, frames: Placed, *, turns: bool = True) -> Array:
        """(..., N) distance between measured and predicted pose, m; a turn counts by what it moves at a lever's length.

        Without ``turns`` that of positions alone.
        """
        base, tool, poses = frames.base[..., None, :, :], frames.tool[..., None, :, :], self.poses
        predicted = self.simulated_position
        if predicted is None:
            predicted = (poses[..., :3, :] @ tool[..., :, 3:])[..., 0]
        away2 = _norm2(self.position - predicted @ frames.base[..., :3, :3].swapaxes(-1, -2) - base[..., :3, 3])
        if turns and self.orientation is not None and self.simulated_position is None:
            seen = base[..., :3, :3].swapaxes(-1, -2) @ quaternion_to_rotation(self.orientation)
            away = log3(seen @ (poses[..., :3, :3] @ tool[..., :3, :3]).swapaxes(-1, -2))
            away2 = away2 + settings.LEVER**2 * _norm2(away)
        return np.asarray(np.sqrt(away2))

    @property
    def maps_place(self) -> bool:
        """Whether :meth:`relaxed` fits the target's place, too, or it is known: no rigid motion then leaves less."""
        known = self.simulated_position is not None or self.tool_known
        return known or self.q.shape[-2] >= FEWEST_RELAXED

    def relaxed(self, weights: Array | None = None) -> tuple[Array, Array]:
        """Fit any affine map of place and turn of the tool frame instead of a rigid motion: one linear problem.

        Whatever it leaves no frames mend, nor another unit, an exchanged or a mirrored axis of the instrument.

        Parameters
        ----------
        weights
            (..., N) of the rows; alike where absent.

        Returns
        -------
        tuple
            (..., N) distances, of the median distance that a robot at rest leaves; (..., 3) the target on the tool, m.
        """
        poses = self.poses
        if self.simulated_position is not None:
            parts = self.simulated_position
        elif self.tool_known or self.q.shape[-2] < FEWEST_RELAXED:
            parts = (poses[..., :3, :] @ self.declared.tool[:, 3:])[..., 0]
        else:
            parts = np.concatenate([poses[..., :3, 3], poses[..., :3, :3].reshape(*poses.shape[:-2], 9)], axis=-1)
        measured = np.broadcast_to(self.position, (*parts.shape[:-1], 3))
        measured = measured - np.median(measured, axis=-2, keepdims=True)
        size = np.sqrt(_norm2(measured))
        share = size <= STRAY * middle(size)[..., None] if weights is None else weights
        share = (share / share.sum(axis=-1, keepdims=True))[..., None]
        parts, wanted = (own - (share * own).sum(axis=-2, keepdims=True) for own in (parts, measured))
        weighted = (share * parts).swapaxes(-1, -2)
        gram = weighted @ parts
        ridge = RIDGE * (np.trace(gram, axis1=-2, axis2=-1)[..., None, None] + LEAST_GAP**2)
        found = np.linalg.solve(gram + ridge * np.eye(parts.shape[-1]), weighted @ wanted)
        left = np.sqrt(_norm2(wanted - parts @ found)) / (middle(size)[..., None] + LEAST_GAP)
        place = np.array(np.broadcast_to(self.declared.tool[:3, 3], (*found.shape[:-2], 3)))  # one that is written to
        if parts.shape[-1] == 12:  # m = R o + Σ pₖ R A eₖ: the coefficients of A's entries are pₖ times those of o
            turn, times = found[..., :3, :], found[..., 3:, :].reshape(*found.shape[:-2], 3, 3, 3)
            place = np.einsum("...rkl,...rl->...k", times, turn) / (_norm2(turn).sum(axis=-1)[..., None] + LEAST_GAP**2)
        return left, place


def _norm2(vectors: Array) -> Array:
    """(...) squares of lengths (..., 3)."""
    return np.asarray((vectors * vectors).sum(axis=-1))


def stacked(several: Sequence[Readings]) -> Readings:
    """Return readings of as many rows side by side: each column has them in front."""
    columns: dict[str, Any] = {
        name: np.stack([getattr(own, name) for own in several])
        for name in COLUMNS
        if getattr(several[0], name) is not None
    }
    return replace(several[0], **columns)


def rms(distance: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(distance**2)))
