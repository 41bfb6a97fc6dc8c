"""A diagnosis as plain values, ready for JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from thermal_robot.diagnosis.parts import Gap


def gap_as_json(gap: Gap) -> dict[str, Any]:
    """Return the object that stands in the JSON under ``gap``."""
    orientation = None
    if gap.orientation_before is not None:
        orientation = {"rms_before": gap.orientation_before, "rms_after": gap.orientation_after}
    return {
        "rms_before": gap.rms_before,
        "rms_after": gap.rms_after,
        "noise_floor": gap.noise_floor,
        "noise_source": gap.noise_source,
        "orientation": orientation,
        "held_out": asdict(gap.held_out),
        "schemes": [asdict(scheme) for scheme in gap.schemes],
        "hardest": None if gap.hardest is None else gap.hardest.name,
    }


def jsonable(value: Any) -> Any:
    """Return what JSON can hold: lists for tuples, numbers of Python for those of NumPy, ``None`` for infinite ones."""
    if isinstance(value, Mapping):
        return {str(k): jsonable(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [jsonable(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
