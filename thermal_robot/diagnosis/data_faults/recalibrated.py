"""Calibrate a chain as freely as its commands allow: every placement of a joint, and the frames, robustly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.readings import Readings
from thermal_robot.inference import settings as inference
from thermal_robot.inference.frames import middle, soft
from thermal_robot.kinematics import (
    ChainFrames,
    chain_frames,
    exp6,
    log3,
    placement_sensitivities,
    quaternion_to_rotation,
)
from thermal_robot.kinematics.lie import exp3, skew
from thermal_robot.kinematics.model import PRISMATIC
from thermal_robot.robot import Robot


@dataclass(frozen=True, eq=False)
class Recalibrated:
    """A robot whose joints sit where readings put them, with frames of its own for each part of the rows.

    The first joint's placement is the base's, and what lies behind the last joint the target's. What the readings do
    not determine stays as the URDF has it (Levenberg-Marquardt with prior sizes that no robot reaches).

    Attributes
    ----------
    readings
        Commands and measurements, and the robot as the URDF has it.
    parts
        (N,) to which part of the rows each belongs, from 0 on.
    robot
        The calibrated robot.
    bases, points, turns
        (B, 4, 4), (B, 3) and (B, 3, 3): of each part the base, the target's place on the tool and its turn.
    held
        (6 J, 6 J) precision to which shift and turn of the J joints behind the first are held.
    """

    readings: Readings
    parts: NDArray[np.int64]
    robot: Robot
    bases: Array
    points: Array
    turns: Array
    held: Array

    @classmethod
    def of(cls, readings: Readings, parts: NDArray[np.int64], begun: Robot) -> Recalibrated:
        """Calibrate, beginning with another robot of the same joints, such as one with longer links."""
        own = [replace(readings.take(np.flatnonzero(parts == part)), robot=begun).align() for part in np.unique(parts)]
        bases, tools = np.stack([frames.base for frames in own]), np.stack([frames.tool for frames in own])
        found = cls(readings, parts, begun, bases, tools[:, :3, 3], tools[:, :3, :3], _held(readings.robot))
        for _ in range(settings.CALIBRATION_STEPS):
            after, settled = found._stepped()
            if after is None:
                break
            found = after
            if settled:
                break
        return found

    @property
    def _placed(self) -> tuple[list[int], list[int]]:
        """Segments and chain elements of the joints behind the first."""
        moving = [s for s, segment in enumerate(self.robot.segments) if segment.movable][1:]
        return moving, [self.robot.segments[s].index for s in moving]

    @property
    def moved(self) -> tuple[Array, Array]:
        """(J, 3) m and (J, 3) rad: shift and turn of each joint behind the first, in its own frame as in the URDF."""
        was, own, (_, index) = self.readings.robot.chain, self.robot.chain, self._placed
        back = was.rotations[index].transpose(0, 2, 1)
        shift = (back @ (own.translations[index] - was.translations[index])[:, :, None])[:, :, 0]
        return shift, log3(back @ own.rotations[index])

    def farthest(self) -> tuple[str, float, float]:
        """Return the joint that sits farthest from its place in the URDF, how far, m, and over the median of all.

        A slide's own way is its zero and does not count.
        """
        (shift, _), (_, index), chain = self.moved, self._placed, self.robot.chain
        slides = (chain.kinds[index] == PRISMATIC)[:, None]
        axes = chain.axes[index]
        far = np.linalg.norm(shift - slides * axes * (shift * axes).sum(axis=1)[:, None], axis=1)
        j = int(np.argmax(far))
        return chain.names[index[j]], float(far[j]), float(far[j] / max(np.median(far), settings.LEAST_GAP))

    @property
    def gap(self) -> Array:
        """(N, m) measured − predicted in the root frame's axes: m, and turns times the length of a lever."""
        return self._seen()[2]

    def left(self) -> tuple[float, float, float]:
        """Return the rms distance, m, the rms turn, rad, and the rms of both, m, that so many unknowns leave of one.

        As medians tell them: few rows that nothing explains do not count.
        """
        unknown = 6 * len(self._placed[0]) + len(self.bases) * (6 + self.gap.shape[1])
        freedom = self.gap.size / max(self.gap.size - unknown, len(self.gap))
        parts = (self.gap[:, :3], self.gap[:, 3:] / inference.LEVER, self.gap)
        away, turned, both = (np.median(np.linalg.norm(part, axis=1)) for part in parts)
        scale = np.sqrt(3.0 * freedom) / settings.MEDIAN
        return float(scale * away), float(scale * turned), float(scale * both)

    def _seen(self) -> tuple[ChainFrames, Array, Array]:
        readings, parts = self.readings, self.parts
        frames = chain_frames(self.robot, readings.q)
        point = frames.tool_position + (frames.tool_rotation @ self.points[parts][:, :, None])[:, :, 0]
        bases = self.bases[parts]
        gap = ((readings.position - bases[:, :3, 3])[:, None] @ bases[:, :3, :3])[:, 0] - point
        if readings.orientation is not None:
            measured = bases[:, :3, :3].transpose(0, 2, 1) @ quaternion_to_rotation(readings.orientation)
            turned = log3(measured @ (frames.tool_rotation @ self.turns[parts]).transpose(0, 2, 1))
            gap = np.hstack([gap, inference.LEVER * turned])
        return frames, point, gap

    def _stepped(self) -> tuple[Recalibrated | None, bool]:
        """Return the calibration after one step downhill, ``None`` where there is none, and whether it settled."""
        frames, point, gap = self._seen()
        rows, measures = gap.shape
        scale = max(float(middle(np.linalg.norm(gap, axis=1))) / settings.MEDIAN, settings.LEAST_GAP)
        weight = np.sqrt(soft(np.linalg.norm(gap, axis=1))) / scale
        _, index = self._placed
        flat = self._frame_columns(frames, point, measures)
        moved = placement_sensitivities(self.robot, self.readings.q, frames=frames, point=self.points[self.parts])
        moved = moved[:, :measures, self._placed[0]]
        turned = self.robot.chain.rotations[index].transpose(0, 2, 1) @ self.readings.robot.chain.rotations[index]
        moved[..., :3] = np.einsum("nmji,jik->nmjk", moved[..., :3], turned)
        moved = moved.reshape(rows, measures, -1)
        lever = np.where(np.arange(measures) < 3, 1.0, inference.LEVER)
        design = np.concatenate([flat, moved], axis=2) * (lever[:, None] * weight[:, None, None])
        design, known = design.reshape(rows * measures, -1), np.arange(flat.shape[2])
        matrix, vector = design.T @ design, design.T @ (gap * weight[:, None]).ravel()
        held = np.arange(len(known), len(matrix))
        matrix[known, known] += settings.ROUNDED * matrix.diagonal()[known].max()
        matrix[np.ix_(held, held)] += self.held
        vector[held] -= self.held @ self._state
        step, cost = np.linalg.solve(matrix, vector), self._cost(scale)
        for share in settings.STEP_SHARES:
            taken = np.asarray(share * step, dtype=float)
            ahead = self._ahead(taken[known], taken[held])
            if (after := ahead._cost(scale)) < cost:
                return ahead, cost - after < settings.CALIBRATED * cost
        return None, True

    @property
    def _state(self) -> Array:
        return np.hstack(self.moved).ravel()

    def _cost(self, scale: float) -> float:
        """Return Cauchy's cost of the gap at a scale, and what the prior sizes cost."""
        wide = (inference.CAUCHY_SCALE * settings.MEDIAN) ** 2
        away = (self.gap**2).sum(axis=1) / scale**2
        return float(wide * np.log1p(away / wide).sum() + self._state @ self.held @ self._state)

    def _frame_columns(self, frames: ChainFrames, point: Array, measures: int) -> Array:
        """(N, m, F) derivative of the prediction by base and target of each part."""
        columns = np.zeros((len(point), measures, len(self.bases), 6 + measures))
        for part in range(len(self.bases)):
            own = self.parts == part
            columns[own, :3, part, :3], columns[own, :3, part, 3:6] = np.eye(3), -skew(point[own])
            for first in range(0, measures, 3):
                columns[own, first : first + 3, part, 6 + first : 9 + first] = frames.tool_rotation[own]
            columns[own, 3:, part, 3:6] = np.eye(3)[: measures - 3]
        return columns.reshape(len(point), measures, -1)

    def _ahead(self, frames: Array, twists: Array) -> Recalibrated:
        """Move frames and joints by a step."""
        by_part, by_joint, (_, index) = frames.reshape(len(self.bases), -1), twists.reshape(-1, 6), self._placed
        chain = self.robot.chain
        rotations, translations = chain.rotations.copy(), chain.translations.copy()
        translations[index] += (self.readings.robot.chain.rotations[index] @ by_joint[:, :3, None])[:, :, 0]
        rotations[index] = chain.rotations[index] @ exp3(by_joint[:, 3:])
        return replace(
            self,
            robot=replace(self.robot, chain=replace(chain, rotations=rotations, translations=translations)),
            bases=self.bases @ exp6(by_part[:, :6]),
            points=self.points + by_part[:, 6:9],
            turns=exp3(by_part[:, 9:]) @ self.turns if by_part.shape[1] > 9 else self.turns,
        )


def _held(robot: Robot) -> Array:
    """(6 J, 6 J) precision to which shifts, turns of the axes and zeros are held.

    Where a joint is shifted along the axis before it that axis' own joint may as well be: the shift is that one's.
    """
    chain, frames = robot.chain, chain_frames(robot, np.zeros((1, robot.n)))
    index = [segment.index for segment in robot.segments if segment.movable]
    length = settings.PRIOR_LENGTH * arm_length(robot)
    looser = settings.PRIOR_TURN**-2 - settings.PRIOR_ZERO**-2
    blocks = []
    for before, k in pairwise(index):
        axis = chain.axes[k] * (chain.kinds[k] != PRISMATIC)
        along = frames.rotations[0, k].T @ frames.rotations[0, before] @ chain.axes[before]
        shifts = (np.eye(3) + settings.ANOTHERS * np.outer(along, along)) / length**2
        blocks += [shifts, np.eye(3) / settings.PRIOR_TURN**2 - looser * np.outer(axis, axis)]
    return np.asarray(block_diag(*blocks))


def arm_length(robot: Robot) -> float:
    """Return the length of all segments together, m: as far as the tool can be from the root, slides drawn in."""
    return float(sum(segment.length for segment in robot.segments))
