"""What varies by more than it is read to: the rest is rounding and rest, and nothing can be seen to follow it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.effects import settings

_ROUNDING = 1e-9  # relative: how far sums of floats are off


def resolution(values: Array, unit: str) -> float:
    """Return the smallest step of a quantity that means something, in its unit.

    It is the smallest step between two of its values (N,), as far as that is what an instrument of this kind reads to:
    digits beyond that say nothing, and two values that are further apart were meant. 0 for what is no reading, such as
    a payload, a label or a direction of approach.
    """
    if unit not in settings.READS_TO:
        return 0.0
    levels = np.unique(values)
    step = float(np.diff(levels).min(initial=np.inf))
    return float(np.clip(step, *settings.READS_TO[unit]))


def varies(values: Array, least: float = 0.0) -> bool:
    """Tell whether values (N,) differ by more than a resolution."""
    return bool(np.ptp(values) > least * (1.0 + _ROUNDING)) if len(values) else False


def without_twins(readings: Mapping[str, Array], joints: tuple[str, ...]) -> dict[str, Array]:
    """Leave out readings of what another quantity says already: the coarser one stays.

    An encoder's reading goes where it says what was commanded, the temperature of a link where it is that of the robot.
    """
    return {name: v for name, v in readings.items() if not _twin(v, readings.get(_said_by(name, joints)))}


def _said_by(name: str, joints: tuple[str, ...]) -> str:
    column, _, place = name.partition(".")
    if column == "encoder" and place in joints:
        return place
    return "temperature" if column == "temperature" and place else ""


def _twin(values: Array, other: Array | None) -> bool:
    return other is not None and float(np.std(values - other)) < settings.TWIN * float(np.std(other))
