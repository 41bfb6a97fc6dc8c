"""A small fleet of one make: a fault that all its robots share, or those of one hall, and faults of single robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import Case, Several
from thermal_robot.blind.reality.days import Day
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.moved import SIZE, Spot, draw_spot
from thermal_robot.blind.reality.sizes import Unseen, sized

Array = NDArray[np.float64]
AtWork = list[tuple[Fault, Array]]

_HALLS = ("hall 1", "hall 2")
_ALIKE = 0.1
"""Scatter of a shared fault among robots, of its size: what one jig, one batch or one floor does to all is alike."""
_DRAWS = 20


def draw_fleet(
    case: Case, several: Several, days: Sequence[Day], rng: np.random.Generator
) -> tuple[dict[str, list[str]], list[AtWork], dict[str, Any]]:
    """Draw which robot has what.

    Parameters
    ----------
    case, several
        What is asked.
    days
        A campaign of each robot.
    rng
        Everything follows from it.

    Returns
    -------
    tuple
        Labels by name, a value for each robot; what is at work in each; the truth.

    Raises
    ------
    Unseen
        If this draw hides a fault.
    """
    count = len(days)
    robots = [f"r{number + 1:02d}" for number in range(count)]
    # halls of equal size, but for one
    halls = [_HALLS[k % 2] for k in rng.permutation(count)]
    at_work: list[AtWork] = [[] for _ in days]
    taken: list[Spot] = []
    shared, own = [], []
    if several.moves:
        group = str(rng.choice(_HALLS)) if several.how == "hall" else None
        members = [k for k in range(count) if group in (None, halls[k])]
        spot, values = _drawn(case, days[members[0]], several.moves, taken, rng)
        for k in members:
            at_work[k].append((spot.fault, _resized(values, float(np.exp(_ALIKE * rng.normal())))))
        shared.append({**_named(spot, days[0], values), "group": group})
    # one robot each, whichever hall it stands in
    for name, k in zip(several.apart, rng.permutation(count).tolist(), strict=False):
        spot, values = _drawn(case, days[k], name, taken, rng)
        at_work[k].append((spot.fault, values))
        own.append({"robot": robots[k], **_named(spot, days[k], values)})
    told: dict[str, Any] = {
        "effects": list(dict.fromkeys((*case.effects, *several.apart))),
        "unlisted": None,
        "parts": {},
    }
    return {"robot": robots, "hall": halls}, at_work, {**told, "shared": shared, "own": own}


def _drawn(case: Case, day: Day, name: str, taken: list[Spot], rng: np.random.Generator) -> tuple[Spot, Array]:
    """Draw a fault at one place where no fault of its kind is yet, as large as the case asks."""
    fault, gauge = FAULTS[name], day.gauge
    for _ in range(_DRAWS):
        values = fault.draw(gauge.setting, rng)
        spot = draw_spot(fault, np.zeros_like(values), rng)
        if all((spot.fault.name, spot.number) != (other.fault.name, other.number) for other in taken):
            break
    else:
        raise Unseen(f"{name} has no place left")
    taken.append(spot)
    size = float(np.abs(values[:, SIZE]).max()) * (np.sign(values[:, SIZE].sum()) or 1.0)
    values[:, SIZE] = 0.0
    wanted = day.instrument.noise * np.exp(rng.uniform(*np.log(case.ratio)))
    return spot, sized(gauge, fault, spot.moved(values, size), wanted, lambda moved: gauge.rms(gauge.left(moved)))


def _resized(values: Array, factor: float) -> Array:
    result = values.copy()
    result[:, SIZE] *= factor
    return result


def _named(spot: Spot, day: Day, values: Array) -> dict[str, Any]:
    kind, where = spot.place(day.setting)
    name, _ = spot.told(day.setting, np.where(np.arange(values.shape[1]) == SIZE, 0.0, values), 1.0)
    return {"effect": spot.fault.name, "place": {"kind": kind, "name": where}, "parameter": name}
