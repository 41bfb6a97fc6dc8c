"""Judge by what a calibration has to move: lengths that no robot errs by are those of another model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.known_robots import fitting
from thermal_robot.diagnosis.data_faults.readings import Readings
from thermal_robot.diagnosis.data_faults.recalibrated import Recalibrated, arm_length
from thermal_robot.diagnosis.parts import AnotherModel, Misfit
from thermal_robot.robot import Robot


def another_robot(campaign: Campaign, progress: Callable[[str], None] = lambda _: None) -> Misfit | None:
    """Tell whether it takes another robot, or another motion, to bring commands and measurements together.

    Where frames alone leave a gap, every joint's placement is calibrated. Rows of one session, or a quarter of them in
    their order, may have frames of their own: a base that was moved is no other robot.

    Parameters
    ----------
    campaign
        With measurements.
    progress
        Called with a few words where a gap asks for it.

    Returns
    -------
    Misfit or None
        With the model that is meant, as far as it can be told; ``None`` where a robot of this kind can err so.
    """
    if campaign.simulated_position is not None or campaign.samples <= settings.DRAWN:
        return None  # another simulator is no other robot
    whole = Readings.of(campaign)
    rows = np.linspace(0, campaign.samples - 1, min(campaign.samples, settings.SAMPLED)).round().astype(np.int64)
    readings = replace(whole.take(rows), base_known=False, tool_known=False)
    near, gap = settings.MISFIT * readings.spread(), _left(readings)
    if gap <= near or near < settings.LEAST_GAP or sum(segment.movable for segment in campaign.robot.segments) < 2:
        return None
    progress("another robot")
    factor, longer = _lengthened(readings)
    shorter = gap > settings.FALL * _left(replace(readings, robot=longer))
    common = factor if shorter and abs(factor - 1.0) > settings.SCALE_ERROR else None
    misfit = None
    for parts in (np.zeros(len(rows), dtype=np.int64), _parts(campaign, rows)):
        misfit = _judged(Recalibrated.of(readings, parts, longer if shorter else readings.robot), common)
        if misfit is None:
            return None
    known = fitting(readings, near)
    if known is None or misfit is None:
        return misfit
    return replace(misfit, model=replace(misfit.model or AnotherModel(), fits=known[0], remains=known[1]))


def _judged(found: Recalibrated, factor: float | None) -> Misfit | None:
    (away, turned, both), (joint, far, times) = found.left(), found.farthest()
    if turned > settings.ANOTHER_TURN:
        places = Recalibrated.of(replace(found.readings, orientation=None), found.parts, found.robot)
        return _judged(places, factor) or Misfit(turned=turned)
    if away > settings.ANOTHER_MOTION * found.readings.spread():
        return Misfit(away=away, model=None if factor is None else AnotherModel(factor))
    most = settings.FARTHEST_ALONE if times > settings.ALONE else settings.FARTHEST
    off = far > max(most * arm_length(found.readings.robot), settings.CLEARLY * both)
    return Misfit(away=away, model=AnotherModel(factor, joint, far)) if off or factor is not None else None


def _parts(campaign: Campaign, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) the session of each row, or which quarter of them it belongs to."""
    sessions = campaign.labels.get("session")
    if sessions is not None:
        _, parts, counts = np.unique(sessions[rows], return_inverse=True, return_counts=True)
        if len(counts) > 1 and counts.min() >= settings.PART_ROWS:
            return parts
    count = min(settings.PARTS, len(rows) // settings.PART_ROWS) or 1
    return np.arange(len(rows)) * count // len(rows)


def _left(readings: Readings) -> float:
    """Return the median distance, m, that frames alone leave."""
    return float(np.median(readings.distance(readings.align())))


def _lengthened(readings: Readings) -> tuple[float, Robot]:
    """Return the common factor by which the links fit best, and the robot with such links."""
    robot = readings.robot
    measured = float(np.linalg.norm(np.ptp(readings.position, axis=0)))
    first = np.log(max(measured, settings.LEAST_GAP) / readings.spread())

    def longer(factor: float) -> Robot:
        return replace(robot, chain=replace(robot.chain, translations=factor * robot.chain.translations))

    def gap(exponent: float) -> float:
        there = replace(readings, robot=longer(float(np.exp(exponent))))
        return float(np.log(np.median(there.distance(there.align(coarse=True))) + settings.LEAST_GAP))

    bounds = (first - settings.FACTOR_OFF, first + settings.FACTOR_OFF)
    found = minimize_scalar(gap, bounds=bounds, method="bounded", options={"maxiter": settings.FACTOR_ROUNDS})
    factor = float(np.exp(found.x))
    return factor, longer(factor)
