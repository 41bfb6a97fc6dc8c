"""One of several campaigns: other poses, another hall, the instrument elsewhere and the target mounted anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import Case
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.instrument import Instrument, measure
from thermal_robot.blind.reality.rigid import anywhere
from thermal_robot.blind.reality.setting import Setting, draw_setting
from thermal_robot.blind.reality.sizes import Gauge, place
from thermal_robot.blind.reality.tables import write_folder
from thermal_robot.blind.reality.world import World

Array = NDArray[np.float64]

_SENSORS = ("robot", "links")
"""What may be recorded of the links: where only the air is, their lag would be another wall's each day."""
_NOISE = (10e-6, 30e-6)  # m, one sigma per axis: as in campaigns of one day
_STATED = 0.85  # of cases: as there
_SPOILT = (0.0, 0.03)  # share of rows: as there


@dataclass(frozen=True)
class Habits:
    """What is alike in all campaigns of a case: the instrument's noise (m, per axis), what is recorded of the links."""

    noise: float
    stated: bool
    sensor: str


@dataclass(frozen=True, eq=False)
class Day:
    """One campaign: its day, its instrument, and the measure of displacements on its rows."""

    setting: Setting
    instrument: Instrument
    gauge: Gauge


def draw_habits(rng: np.random.Generator) -> Habits:
    """Draw what stays."""
    return Habits(float(rng.uniform(*_NOISE)), bool(rng.random() < _STATED), str(rng.choice(_SENSORS)))


def draw_day(case: Case, world: World, habits: Habits, rng: np.random.Generator) -> Day:
    """Draw a campaign of positions; where base and target are nobody knows."""
    samples = int(rng.integers(case.samples[0], case.samples[1] + 1))
    setting = draw_setting(world, samples, rng, sensor=habits.sensor)
    target = rng.uniform([-0.03, -0.03, 0.04], [0.03, 0.03, 0.16])
    instrument = Instrument(
        pose=anywhere(rng, 3.0),
        target=target,
        declared=target + rng.uniform(-0.01, 0.01, 3),
        base_known=False,
        tool_known=False,
        noise=habits.noise,
        turning=None,
        stated=habits.stated,
        tails=np.inf,
        spoilt=float(rng.choice(_SPOILT)),
    )
    return Day(setting, instrument, Gauge(setting, np.arange(samples), target, base=True, tool=True))


def write_day(
    folder: Path, case: Case, day: Day, faults: Sequence[tuple[Fault, Array]], rng: np.random.Generator
) -> int:
    """Measure a robot with these faults on that day, write its campaign, and return the number of rows."""
    rows = np.arange(day.setting.samples)
    seen, turned = place(day.setting, faults, day.instrument.target, day.instrument.pose)
    measured = measure(day.setting, seen, turned, rows, day.instrument, rng)
    write_folder(folder, case, day.setting, measured, rows, rows[:0], day.instrument)
    return len(rows)
