"""Everyday mistakes that single figures tell: another unit, figures that were rounded, another robot's simulator."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from thermal_robot.campaign.campaign import Campaign, FloatArray
from thermal_robot.kinematics import align, tool_poses

WARMEST, HOTTEST = 55.0, 150.0
"""°C that the median temperature of a robot does not exceed, whose motors run at 50: a hall of 20 °C has 68 °F; and
that no robot reaches, whose grease ends at 120: 20 °C are 293 K."""
HEAVIEST, HEAVIEST_ALONE = 3.0, 1000.0
"""Payload over the arm's own mass, which no arm carries: the strongest carry as much as they weigh, and grams are a
thousand; and in kg where the URDF has no masses: the largest robots carry as much."""
COARSEST_TURN, FINEST = 0.1, 1e-7
"""rad that no instrument's one-sigma exceeds, 6 degrees; and m, a tenth of a micrometre, that none that measures robots
reaches: a laser tracker has some ten micrometres."""
FEWEST_ROWS = 10
"""Rows from which figures that all end alike were rounded, and are no accident."""
ROUNDED_TO = 5e-4
"""m: positions that are read to no better are told of where no noise is stated: every arm repeats to better."""
GRID = 5e-5
"""m: what rounded commands move the tool, rms, from which that is told: half the repeatability of good arms."""
SLIDES = 10.0
"""Times its farther limit: a slide that is commanded beyond is read in a wrong unit, the next one being a thousand."""
ANOTHER_ROBOT = 0.02
"""Of the reach: a simulator of the same robot, however its lengths were measured, is nearer to the URDF than that."""


def mistakes(campaign: Campaign, reach: float) -> Iterator[str]:
    """Yield one sentence for each mistake that the figures suggest.

    Parameters
    ----------
    campaign
        As read.
    reach
        Of the arm, m; infinite where it has no end.
    """
    yield from _temperature(campaign)
    yield from _payload(campaign)
    yield from _noise(campaign)
    yield from _slides(campaign)
    yield from _rounded(campaign)
    yield from _grid(campaign, reach)
    yield from _simulator(campaign, reach)


def _temperature(campaign: Campaign) -> Iterator[str]:
    names = [n for n in campaign.covariates if n.split(".")[0] == "temperature" and n not in campaign.extra]
    told = [(f"column {n!r} has a median of", float(np.median(campaign.covariates[n]))) for n in names]
    for what, value in (*told, ("the reference temperature is", campaign.reference_temperature)):
        if value > WARMEST:
            unit = "kelvin" if value > HOTTEST else "degrees Fahrenheit"
            yield f"{what} {value:.4g} °C: are these {unit}?"


def _payload(campaign: Campaign) -> Iterator[str]:
    payload = campaign.covariates.get("payload")
    if payload is None:
        return
    heaviest, arm = float(payload.max()), campaign.robot.mass
    if heaviest > (HEAVIEST * arm if campaign.robot.has_masses else HEAVIEST_ALONE):
        beside = f", and the arm weighs {arm:.3g} kg" if campaign.robot.has_masses else ""
        yield f"the payload is up to {heaviest:.4g} kg{beside}: are these grams?"


def _noise(campaign: Campaign) -> Iterator[str]:
    turn, place = campaign.noise_orientation, campaign.noise_position
    if turn is not None and turn > COARSEST_TURN:
        yield f"the noise of orientation is {turn:.3g} rad, {math.degrees(turn):.3g} degrees: is it in rad?"
    if place is not None and place < FINEST:
        yield (
            f"the noise of position is {1e6 * place:.3g} µm, finer than any instrument that measures robots: "
            f"is it in {campaign.units.length}, as length_unit says?"
        )


def _slides(campaign: Campaign) -> Iterator[str]:
    robot = campaign.robot
    for j, (name, kind) in enumerate(zip(robot.joint_names, robot.joint_types, strict=True)):
        limit = max(abs(float(robot.lower[j])), abs(float(robot.upper[j])))
        farthest = float(np.abs(campaign.q[:, j]).max())
        if kind == "prismatic" and math.isfinite(limit) and farthest > SLIDES * limit:
            yield (
                f"joint {name!r} slides, is commanded to {farthest:.4g} m and its limit is {limit:.4g} m: "
                f"is its column in {campaign.units.length}, as length_unit says?"
            )


def step_of(values: FloatArray) -> float:
    """Return the largest power of ten, 1000 at most, of which all figures are multiples; 0 where there is none."""
    for power in range(3, -7, -1):
        parts = values * 10.0**-power
        if np.abs(parts - np.round(parts)).max() < 1e-6 * max(1.0, float(np.abs(parts).max()) * 1e-6):
            return 10.0**power
    return 0.0


def _rounded(campaign: Campaign) -> Iterator[str]:
    if campaign.position is None or campaign.samples < FEWEST_ROWS or not np.ptp(campaign.position) > 0.0:
        return
    step = step_of(campaign.position / campaign.units.length_scale) * campaign.units.length_scale
    noise = campaign.noise_position
    if step and (step / math.sqrt(12.0) > noise if noise else step > ROUNDED_TO):
        stated = f", and the noise is stated as {1e3 * noise:.3g} mm" if noise else ""
        yield (
            f"the measured positions are rounded to {1e3 * step:.3g} mm, "
            f"which alone is a noise of {1e3 * step / math.sqrt(12.0):.2g} mm{stated}"
        )


def _grid(campaign: Campaign, reach: float) -> Iterator[str]:
    robot, units = campaign.robot, campaign.units
    turning = [j for j, kind in enumerate(robot.joint_types) if kind != "prismatic"]
    values = campaign.q[:, turning] / units.angle_scale
    if not turning or campaign.samples < FEWEST_ROWS or not math.isfinite(reach):
        return
    # who types commands takes few of them again and again
    if min(len(np.unique(column)) for column in values.T) <= campaign.samples / 2:
        return
    step = step_of(values)
    moved = step * units.angle_scale / math.sqrt(12.0) * reach
    if moved > max(GRID, campaign.noise_position or 0.0):
        yield (
            f"all joint commands are multiples of {step:g} {units.angle}: if they were rounded in writing, "
            f"that alone moves the tool by about {1e3 * moved:.2g} mm"
        )


def _simulator(campaign: Campaign, reach: float) -> Iterator[str]:
    predicted = campaign.simulated_position
    if predicted is None or campaign.samples < FEWEST_ROWS or not math.isfinite(reach):
        return
    poses = tool_poses(campaign.robot, campaign.q)
    own = poses[:, :3, 3] + poses[:, :3, :3] @ campaign.target
    motion = align(own, predicted, np.ones(len(own)))
    away = float(np.sqrt(((own @ motion[:3, :3].T + motion[:3, 3] - predicted) ** 2).sum(axis=1).mean()))
    if away > ANOTHER_ROBOT * reach:
        yield (
            f"sim.x, sim.y, sim.z are of another robot, tool or units than the URDF: aligned as well as can be, "
            f"they are {away:.3g} m away from it"
        )
