"""What is true of a case: how large each effect is, where it sits, what it follows, which answers are right."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import Case
from thermal_robot.blind.reality.fault import Fault, Place
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.sizes import Gauge, shares
from thermal_robot.blind.reality.world import World

Array = NDArray[np.float64]

_CLEAR = 0.25  # of what the largest place leaves: places that leave less are not asked for
_NEEDS = {"thermal_elongation": "temperature", "drift": "time", "backlash": "approach", "tracking_lag": "velocity"}


def truth(
    case: Case,
    gauge: Gauge,
    done: Sequence[tuple[Fault, Array]],
    background: Sequence[tuple[Fault, Array]],
    noise: float,
) -> dict[str, Any]:
    """Return the truth of :mod:`thermal_robot.blind.cases`, without the rows that are spoilt.

    Parameters
    ----------
    case
        What is asked.
    gauge
        Of the rows that are given.
    done, background
        Faults with their values: those that are asked for, and those that are always there.
    noise
        One sigma per axis, m.
    """
    parts: dict[str, Any] = {}
    answers: list[Place] = []
    quantities: list[str] = []
    parameters: dict[str, dict[str, float]] = {}
    for fault, values in [*done, *background]:
        sites = shares(gauge, fault, values)
        clear = [item for item in sites if item[2] > _CLEAR * sites[0][2]]
        where = [item[0] for item in clear]
        main = any(fault is other for other, _ in done)
        listed = _named(where if fault.few else [])
        parts[fault.name] = {"ratio": _ratio(gauge, fault, values, noise), "main": main, "places": listed}
        for other, columns in fault.also:
            part = np.zeros_like(values)
            part[:, list(columns)] = values[:, list(columns)]
            parts.setdefault(other, {"ratio": _ratio(gauge, fault, part, noise), "main": False, "places": listed})
        if main and (fault.name == case.unlisted or case.kind in ("removed", "hidden")):
            answers += [*where, *_joints_of(gauge.setting, fault, [item[1] for item in clear])]
            quantities += fault.quantities(gauge.setting, where)
        if fault.name in case.effects:
            parameters[fault.name] = dict(fault.known_as(gauge.setting, values))
    return {
        "effects": list(case.effects),
        "unlisted": case.unlisted,
        "parts": parts,
        "parameters": parameters,
        "places": _named(answers),
        "near": _named(near(gauge.setting.world, answers)),
        "quantities": list(dict.fromkeys(quantities)),
        "needs": [_NEEDS[name] for name in case.effects if case.hidden and name in _NEEDS],
    }


def near(world: World, places: Sequence[Place]) -> list[Place]:
    """Return places and those beside them: along the chain, base, link, joint, link, joint, ... link, tool.

    A joint's are the two links that it connects and the joint before and after; those of a link the joints at its ends
    and the links beyond them. Links that no joint moves against each other are one.
    """
    at: dict[Place, float] = {("base", "base"): 0.0, ("link", world.tree.root): 0.5}
    moved = 0
    for joint in world.chain:
        moved += joint.movable
        at[("joint", joint.name)] = float(moved) if joint.movable else moved + 0.5
        at[("link", joint.child)] = moved + 0.5
    at[("tool", "tool")] = moved + 1.0
    steps = [at[place] for place in places]
    return [place for place, here in at.items() if any(abs(here - step) <= 1.0 for step in steps)]


def _ratio(gauge: Gauge, fault: Fault, values: Array, noise: float) -> float:
    return gauge.rms(gauge.left(gauge.moved(fault, values))) / noise


def _joints_of(setting: Setting, fault: Fault, numbers: Sequence[int]) -> list[Place]:
    """Name the joints too: a displaced joint placement is as much the joint's as it is the link's that carries it."""
    chain = setting.world.chain
    if len(fault.places(setting)) != len(chain) or fault.places(setting)[0][0] != "link":
        return []
    return [("joint", chain[p].name) for p in numbers if chain[p].movable]


def _named(places: Sequence[Place]) -> list[dict[str, str]]:
    return [{"kind": kind, "name": name} for kind, name in dict.fromkeys(places)]
