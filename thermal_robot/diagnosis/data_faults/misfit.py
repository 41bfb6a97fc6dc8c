"""Mismatch of robot and table: tests after which no effect is reported.

Lengths that no robot errs by are those of another model: every placement of a joint is calibrated as freely as the
commands allow, and the robots at hand are tried.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import minimize_scalar

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.plausible import another_unit
from thermal_robot.diagnosis import settings as diagnosis_settings
from thermal_robot.diagnosis.answer import Conclusion
from thermal_robot.diagnosis.data_faults import data_fault, settings
from thermal_robot.diagnosis.data_faults.faults import Readings
from thermal_robot.diagnosis.data_faults.find import spread
from thermal_robot.diagnosis.residual_tests import analyse_residual
from thermal_robot.diagnosis.values import AnotherModel, Misfit
from thermal_robot.effects import Effect
from thermal_robot.errors import RobotError
from thermal_robot.inference import settings as inference
from thermal_robot.inference.algebra import rms
from thermal_robot.inference.fit import Fit, fit
from thermal_robot.inference.registration import cauchy_weights, middle
from thermal_robot.inference.scatter import nothing_random
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
from thermal_robot.robot import Robot, load_robot
from thermal_robot.urdf_text import shipped, urdf_text


@dataclass(frozen=True, eq=False)
class Recalibrated:
    """Kinematic calibration of all joint placements, with frames of their own for each part of the rows.

    The first joint's placement is the base's, and what lies behind the last joint the target's. What the readings do
    not determine stays as the URDF has it: each of the J joints behind the first has a normal prior of a size that no
    robot reaches (regularised Gauss-Newton, robust by Cauchy's weights).
    """

    readings: Readings  # commands and measurements, and the robot as the URDF has it
    parts: NDArray[np.int64]  # (N,) to which part of the rows each belongs, from 0 on
    robot: Robot  # the calibrated robot
    bases: Array  # (B, 4, 4) base of each part
    points: Array  # (B, 3) place of the target on the tool
    turns: Array  # (B, 3, 3) turn of the target on the tool
    prior: Array  # (6 J, 6 J) precision of shift and turn

    @classmethod
    def of(cls, readings: Readings, parts: NDArray[np.int64], begun: Robot) -> Recalibrated:
        """Calibrate by Gauss-Newton from a robot ``begun``, with base and target of each part registered to it."""
        own = [replace(readings.take(np.flatnonzero(parts == part)), robot=begun).align() for part in np.unique(parts)]
        bases, tools = np.stack([frames.base for frames in own]), np.stack([frames.tool for frames in own])
        found = cls(readings, parts, begun, bases, tools[:, :3, 3], tools[:, :3, :3], _prior(readings.robot))
        for _ in range(inference.FIT_STEPS):
            found, settled = found._stepped()
            if settled:
                break
        return found

    @cached_property
    def _segments(self) -> list[int]:
        """Segment (J,) of each joint behind the first."""
        return [s for s, segment in enumerate(self.robot.segments) if segment.movable][1:]

    @cached_property
    def _elements(self) -> list[int]:
        """Chain element (J,) of each joint behind the first."""
        return [self.robot.segments[s].index for s in self._segments]

    @cached_property
    def moved(self) -> tuple[Array, Array]:
        """Translations (J, 3) m and rotations (J, 3) rad of each joint behind the first, in its own URDF frame."""
        was, own, index = self.readings.robot.chain, self.robot.chain, self._elements
        back = was.rotations[index].transpose(0, 2, 1)
        shift = (back @ (own.translations[index] - was.translations[index])[:, :, None])[:, :, 0]
        return shift, log3(back @ own.rotations[index])

    def farthest(self) -> tuple[str, float, float, float]:
        """Joint displaced most from the URDF, by how much and its standard deviation, m, and over the median of all.

        Displacement along the axis of a prismatic joint is its zero, and does not count.
        """
        (shift, _), index, chain = self.moved, self._elements, self.robot.chain
        axes = chain.axes[index] * (chain.kinds[index] == PRISMATIC)[:, None]
        across = shift - axes * (shift * axes).sum(axis=1)[:, None]
        far = np.linalg.norm(across, axis=1)
        j = int(np.argmax(far))
        matrix, first = self._normal_equations[0], -len(self.prior) + 6 * j
        covariance = np.linalg.inv(matrix)[first:, first:][:3, :3]
        deviation = np.sqrt(across[j] @ covariance @ across[j]) / max(far[j], settings.LEAST_GAP)
        return (
            chain.names[index[j]],
            float(far[j]),
            float(deviation),
            float(far[j] / max(np.median(far), settings.LEAST_GAP)),
        )

    def left(self) -> tuple[float, float]:
        """Robust residual size, corrected for the unknowns: distance, m, and rotation, rad.

        From medians over the rows, so that few rows that nothing explains do not count.
        """
        gap = self._seen[2]
        unknown = 6 * len(self._segments) + len(self.bases) * (6 + gap.shape[1])
        scale = np.sqrt(3.0 * gap.size / max(gap.size - unknown, len(gap))) / settings.MEDIAN
        parts = (gap[:, :3], gap[:, 3:] / inference.LEVER)
        away, turned = (float(scale * np.median(np.linalg.norm(part, axis=1))) for part in parts)
        return away, turned

    @cached_property
    def _seen(self) -> tuple[ChainFrames, Array, Array]:
        """Frames of the chain, (N, 3) target and (N, m) measured − predicted in the root frame's axes.

        The latter in m; rotations are multiplied by the lever ``LEVER``.
        """
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

    @cached_property
    def _scale(self) -> float:
        """Robust standard deviation of the gap, m, from its median distance."""
        return max(float(middle(np.linalg.norm(self._seen[2], axis=1))) / settings.MEDIAN, settings.LEAST_GAP)

    @cached_property
    def _normal_equations(self) -> tuple[Array, Array]:
        """Normal equations of frames and joints with their prior, in units of the gap's standard deviation."""
        gap = self._seen[2]
        weight = np.sqrt(cauchy_weights(np.linalg.norm(gap, axis=1)))[:, None] / self._scale
        design = (self._columns() * weight[:, :, None]).reshape(gap.size, -1)
        matrix, vector = design.T @ design, design.T @ (gap * weight).ravel()
        frames = len(matrix) - len(self.prior)
        own = np.arange(frames)
        matrix[own, own] += settings.ROUNDED * matrix.diagonal()[:frames].max()
        matrix[frames:, frames:] += self.prior
        vector[frames:] -= self.prior @ np.hstack(self.moved).ravel()
        return matrix, vector

    def _stepped(self) -> tuple[Recalibrated, bool]:
        """Calibration after one descent step, and whether it has converged or no step descends."""
        scale, (matrix, vector) = self._scale, self._normal_equations
        frames = len(matrix) - len(self.prior)
        step, cost = np.linalg.solve(matrix, vector), self._cost(scale)
        for share in settings.STEP_SHARES:
            ahead = self._ahead(share * np.asarray(step, dtype=float), frames)
            if (after := ahead._cost(scale)) < cost:
                return ahead, cost - after < settings.CALIBRATED * cost
        return self, True

    def _cost(self, scale: float) -> float:
        """Cauchy cost of the gap at a scale plus the penalty of the priors."""
        wide, state = (inference.CAUCHY_SCALE * settings.MEDIAN) ** 2, np.hstack(self.moved).ravel()
        away = (self._seen[2] ** 2).sum(axis=1) / scale**2
        return float(wide * np.log1p(away / wide).sum() + state @ self.prior @ state)

    def _columns(self) -> Array:
        """Jacobian (N, m, B (6 + m) + 6 J) of the prediction by base and target of each part, and by each joint."""
        frames, point, gap = self._seen
        rows, measures = gap.shape
        columns = np.zeros((rows, measures, len(self.bases), 6 + measures))
        for part in range(len(self.bases)):
            own = self.parts == part
            columns[own, :3, part, :3], columns[own, :3, part, 3:6] = np.eye(3), -skew(point[own])
            for first in range(0, measures, 3):
                columns[own, first : first + 3, part, 6 + first : 9 + first] = frames.tool_rotation[own]
            columns[own, 3:, part, 3:6] = np.eye(3)[: measures - 3]
        moved = placement_sensitivities(self.robot, self.readings.q, frames=frames, point=self.points[self.parts])
        moved, index = moved[:, :measures, self._segments], self._elements
        turned = self.robot.chain.rotations[index].transpose(0, 2, 1) @ self.readings.robot.chain.rotations[index]
        moved[..., :3] = np.einsum("nmji,jik->nmjk", moved[..., :3], turned)
        both = [columns.reshape(rows, measures, -1), moved.reshape(rows, measures, -1)]
        lever = np.where(np.arange(measures) < 3, 1.0, inference.LEVER)
        return np.concatenate(both, axis=2) * lever[:, None]

    def _ahead(self, step: Array, frames: int) -> Recalibrated:
        """Calibration after a step (frames, then 6 J) of bases, targets and joint placements."""
        by_part, by_joint = step[:frames].reshape(len(self.bases), -1), step[frames:].reshape(-1, 6)
        index = self._elements
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


def _prior(robot: Robot) -> Array:
    """Prior precision (6 J, 6 J) of translations, axis rotations and joint zeros.

    A shift of a joint along the axis of the joint before it is an equivalent shift of that one; it is held at zero.
    """
    chain, frames = robot.chain, chain_frames(robot, np.zeros((1, robot.n)))
    index = [segment.index for segment in robot.segments if segment.movable]
    length = settings.FARTHEST * arm_length(robot)
    looser = settings.PRIOR_TURN**-2 - settings.PRIOR_ZERO**-2
    blocks = []
    for before, k in pairwise(index):
        axis = chain.axes[k] * (chain.kinds[k] != PRISMATIC)
        along = frames.rotations[0, k].T @ frames.rotations[0, before] @ chain.axes[before]
        shifts = (np.eye(3) + settings.ANOTHERS * np.outer(along, along)) / length**2
        blocks += [shifts, np.eye(3) / settings.PRIOR_TURN**2 - looser * np.outer(axis, axis)]
    return np.asarray(block_diag(*blocks))


def arm_length(robot: Robot) -> float:
    """Sum of all segment lengths, m, prismatic joints retracted: a bound on the reach."""
    return float(sum(segment.length for segment in robot.segments))


def fitting(readings: Readings, near: float) -> tuple[str, float] | None:
    """Shipped robot that fits the readings best, and its median distance, m, after registration.

    Those with the joints' names come first. None is returned where none fits within the distance ``near``, m.
    """
    own, best = readings.robot, None
    for name in sorted(shipped(), key=lambda name: not set(own.joint_names) <= _movable(name)):
        alike = set(own.joint_names) <= _movable(name)
        if best is not None and not alike:
            break
        robot = _chain(name, own.joint_names, own.joint_types, own.root_frame, own.tool_frame)
        if robot is None:
            continue
        by_name = set(robot.joint_names) == set(own.joint_names)
        q = readings.q[:, [own.joint_names.index(joint) for joint in robot.joint_names]] if by_name else readings.q
        other = replace(readings, robot=robot, q=q)
        left = _left(other)
        if left < min(near if best is None else settings.LIKE_ANOTHER * best[1], other.tolerance):
            best = name, left
    return best


@cache
def _movable(name: str) -> frozenset[str]:
    """Names of the movable joints in a shipped robot's URDF; empty where it cannot be read."""
    try:
        joints = ElementTree.fromstring(urdf_text(name).text).iter("joint")
    except (RobotError, ElementTree.ParseError):
        return frozenset()
    return frozenset(j.get("name", "") for j in joints if j.get("type") in ("revolute", "continuous", "prismatic"))


@cache
def _chain(name: str, joints: tuple[str, ...], kinds: tuple[str, ...], root: str, tool: str) -> Robot | None:
    """First chain of a shipped robot whose joints turn and slide in this order, with these names if it has them all.

    ``None`` without one: between the given end links, or from its root to a leaf.
    """
    alike = set(joints) <= _movable(name)
    if not alike and not len(joints) <= len(_movable(name)) <= len(joints) + settings.HAND_JOINTS:
        return None
    slides = [kind == "prismatic" for kind in kinds]
    found = (robot for robot in _loaded(name, root, tool) if [k == "prismatic" for k in robot.joint_types] == slides)
    return next((robot for robot in found if not alike or set(robot.joint_names) == set(joints)), None)


def _loaded(name: str, root: str, tool: str) -> Iterator[Robot]:
    """Yield chains of a robot: between links of these names, then from its root to each leaf."""
    ends: tuple[str, ...] = ()
    for tool_frame, root_frame in ((tool, root), (tool, None), ("", None)):
        try:
            yield load_robot(name, tool_frame, root_frame=root_frame)
        except RobotError as error:
            ends = error.candidates
    for end in ends if len(ends) <= settings.HAND_JOINTS else ():
        with suppress(RobotError):
            yield load_robot(name, end)


def another_robot(campaign: Campaign, progress: Callable[[str], None] = lambda _: None) -> Misfit | None:
    """Mismatch if only another robot, or another motion, makes commands and measurements match; else ``None``.

    Where frames alone leave a gap, every joint's placement is calibrated. Rows of one session, or a quarter of them in
    their order, may have frames of their own: a base that was moved is no other robot. The model that is meant is told
    as far as it can be; ``None`` where a robot of this kind can err so. ``progress`` is called with a few words where a
    gap asks for it.
    """
    if campaign.simulated_position is not None or campaign.samples <= settings.DRAWN:
        return None  # another simulator is no other robot
    rows = spread(np.arange(campaign.samples))
    readings = replace(Readings.of(campaign).take(rows), base_known=False, tool_known=False)
    near, gap = readings.tolerance, _left(readings)
    if gap <= near or near < settings.LEAST_GAP or sum(segment.movable for segment in campaign.robot.segments) < 2:
        return None
    progress("another robot")
    factor, longer = _lengthened(readings)
    shorter = gap > settings.FALL * _left(replace(readings, robot=longer))
    common = factor if shorter and abs(factor - 1.0) > settings.SCALE_ERROR else None
    begun = longer if shorter else readings.robot
    misfit = _judged(Recalibrated.of(readings, np.zeros(len(rows), dtype=np.int64), begun), common)
    if misfit is not None:
        misfit = _judged(Recalibrated.of(readings, _parts(campaign, rows), begun), common)
    known = fitting(readings, near) if misfit is not None else None
    if known is None or misfit is None:
        return misfit
    return replace(misfit, model=replace(misfit.model or AnotherModel(), fits=known[0], remains=known[1]))


def _judged(found: Recalibrated, factor: float | None) -> Misfit | None:
    """Verdict of a calibration by residual, displacement and length factor: another motion or model; else ``None``."""
    (away, turned), (joint, far, deviation, times) = found.left(), found.farthest()
    if turned > settings.ANOTHER_TURN:
        places = Recalibrated.of(replace(found.readings, orientation=None), found.parts, found.robot)
        return _judged(places, factor) or Misfit(turned=turned)
    if away > settings.ANOTHER_MOTION * found.readings.spread:
        return Misfit(away=away, model=None if factor is None else AnotherModel(factor))
    most = settings.FARTHEST * (0.5 if times > settings.ALONE else 1.0) * arm_length(found.readings.robot)
    off = far - settings.CLEARLY * deviation > most
    return Misfit(away=away, model=AnotherModel(factor, joint, far)) if off or factor is not None else None


def _parts(campaign: Campaign, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Part (N,) of each row: its session if all have enough rows, else its quarter (or larger part) of the campaign."""
    sessions = campaign.labels.get("session")
    if sessions is not None:
        _, parts, counts = np.unique(sessions[rows], return_inverse=True, return_counts=True)
        if len(counts) > 1 and counts.min() >= settings.PART_ROWS:
            return parts
    count = min(settings.PARTS, len(rows) // settings.PART_ROWS) or 1
    return np.arange(len(rows)) * count // len(rows)


def _left(readings: Readings) -> float:
    """Median distance, m, of measured from predicted positions after registration of base and target alone."""
    return float(np.median(readings.distance(readings.align())))


def _lengthened(readings: Readings) -> tuple[float, Robot]:
    """Scale of all links with the least median distance after registration, by bounded search, and the scaled robot."""
    robot = readings.robot
    measured = float(np.linalg.norm(np.ptp(readings.position, axis=0)))
    first = np.log(max(measured, settings.LEAST_GAP) / readings.spread)

    def longer(factor: float) -> Robot:
        return replace(robot, chain=replace(robot.chain, translations=factor * robot.chain.translations))

    def gap(exponent: float) -> float:
        there = replace(readings, robot=longer(float(np.exp(exponent))))
        return float(np.log(np.median(there.distance(there.align(coarse=True))) + settings.LEAST_GAP))

    # the ratio of the two volumes tells the factor to within e
    bounds, options = (first - 1.0, first + 1.0), {"maxiter": settings.FACTOR_ROUNDS}
    factor = float(np.exp(minimize_scalar(gap, bounds=bounds, method="bounded", options=options).x))
    return factor, longer(factor)


def mismatch(campaign: Campaign, progress: Callable[[str], None] = lambda _: None) -> Misfit | None:
    """Test before any effect whether robot and table match: unit of the URDF, data faults, another robot.

    A data fault whose repair leaves more than the tolerance gives way to another robot that leaves clearly less.
    """
    if campaign.position is None:  # every question below is about the columns of an instrument
        return None
    factor = another_unit(campaign)
    if factor is not None:
        return Misfit(model=AnotherModel(factor))
    fault = data_fault(campaign, progress)
    if fault is not None and fault.rms_after < Readings.of(campaign).tolerance:
        return Misfit(fault)
    other = another_robot(campaign, progress)
    if fault is None or (other is not None and settings.FALL * _leaves(other) < fault.rms_after):
        return other
    return Misfit(fault)


def _leaves(other: Misfit) -> float:
    """Residual of another robot, m: of a shipped one that fits, else of the calibration; infinite without a model."""
    if other.model is None:
        return np.inf
    return other.model.remains if other.model.fits else other.away or 0.0


def another_motion(fitted: Fit) -> Misfit | None:
    """Mismatch if the residual of a fit exceeds what any robot errs: the motions differ; else ``None``."""
    left = fitted.corrected.gap[~fitted.explanation.outliers]
    away, turned = rms(left[:, :3]), rms(left[:, 3:])
    if away > settings.ANOTHER_MOTION * fitted.campaign.reach:
        return Misfit(away=away)
    return Misfit(turned=turned) if turned > settings.ANOTHER_TURN else None


def delivered(last: Conclusion, candidates: Sequence[Effect]) -> Conclusion:
    """Return a conclusion if its Gauss-Newton fit converged; else that of the frames alone, with a note why."""
    note = unconverged(last.fit)
    return replace(frames_alone(last.fit.campaign, candidates, "a fit that settles"), notes=(note,)) if note else last


def frames_alone(
    campaign: Campaign, candidates: Sequence[Effect], needed: str = "a table that fits the robot"
) -> Conclusion:
    """Conclusion with the unknown frames alone, where no effect can be tested without the columns in ``needed``."""
    bare = replace(fit(campaign, ()), needs={effect.name: (needed,) for effect in candidates})
    left = analyse_residual(bare)
    return Conclusion(bare, (), left.unexplained, left, nothing_random(bare), {})


def unconverged(fit: Fit) -> str:
    """Sentence if Gauss-Newton ended away from the linearised model that was compared; else empty.

    Combinations are compared, and rows held out, with the model linearised at the exact one. Where Gauss-Newton ends
    elsewhere, as with errors so large that nothing is linear, their figures are not those of the model that is saved.
    """
    kept = ~fit.explanation.outliers
    exact, linear = rms(fit.corrected.gap[kept, :3]), rms(fit.explanation.remainder[kept, :3])
    if not fit.effects or exact <= diagnosis_settings.UNSETTLED * max(linear, inference.ROUNDING):
        return ""
    names = ", ".join(effect.name for effect, _ in fit.effects)
    return (
        f"the fit of {names} did not settle: its exact model leaves {exact:.3g} m where {linear:.3g} m were expected; "
        "nothing of it is told, and the model holds the frames alone"
    )
