"""Several campaigns become a folder with one for each, a list of them, and the answers that stay outside it.

Of one robot: it errs alike on all days, but for one number that is another from a day on, or grows in a straight line
of time. Of a fleet: :mod:`thermal_robot.blind.reality.fleets`. Other poses, another hall, the instrument elsewhere and
the target mounted anew each time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import LISTED, Case, Several
from thermal_robot.blind.reality.days import Day, draw_day, draw_habits, write_day
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.fleets import draw_fleet
from thermal_robot.blind.reality.moved import GROWS_ONLY, Spot, deviation, draw_spot
from thermal_robot.blind.reality.sizes import Unseen, sized
from thermal_robot.blind.reality.truth import truth
from thermal_robot.blind.reality.world import World
from thermal_robot.files import write_text

Array = NDArray[np.float64]
AtWork = list[tuple[Fault, Array]]

_FIRST = date(2026, 1, 5)
_EVERY, _LATE = 30, 10  # days from one campaign to the next, and by how much one is early or late
_LARGEST = 10.0  # × noise: a change that must leave more to be told is not asked for


def make_several(case: Case, world: World, rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    """Write the campaigns of a case into a folder, and return its answers.

    Raises
    ------
    Unseen
        If this draw hides what is asked.
    """
    several = _asked(case)
    count = int(rng.integers(several.campaigns[0], several.campaigns[1] + 1))
    habits = draw_habits(rng)
    days = [draw_day(case, world, habits, rng) for _ in range(count)]
    if case.kind == "fleet":
        labels, at_work, told = draw_fleet(case, several, days, rng)
    else:
        labels, at_work, told = _followed(case, several, days, rng)
    names = [f"{number + 1:02d}" for number in range(count)]
    samples = 0
    for name, day, faults in zip(names, days, at_work, strict=True):
        samples += write_day(folder / name, case, day, faults, rng)
    write_text(folder / LISTED, _list(names, labels))
    whole = {**told, "campaigns": count, "outliers": []}
    return {"truth": whole, "noise": habits.noise, "samples": samples, "measures": "position"}


def _asked(case: Case) -> Several:
    if case.several is None:
        raise ValueError(f"case {case.id} is one of a single campaign")
    return case.several


def _list(names: Sequence[str], labels: Mapping[str, Sequence[str]]) -> str:
    rows = zip(names, *labels.values(), strict=True)
    return "".join(",".join(row) + "\n" for row in (("campaign", *labels), *rows))


def _followed(
    case: Case, several: Several, days: Sequence[Day], rng: np.random.Generator
) -> tuple[dict[str, list[str]], list[AtWork], dict[str, Any]]:
    """Return dates, what is at work on each day, and the truth."""
    first, noise = days[0].gauge, days[0].instrument.noise
    done: AtWork = []
    for name in case.effects:
        fault = FAULTS[name]
        values = fault.draw(first.setting, rng)
        if several.how == "begins" and name == several.moves:
            values[:, 0] = 0.0
        else:
            wanted = noise * np.exp(rng.uniform(*np.log(case.ratio)))
            values = sized(first, fault, values, wanted, lambda moved: first.rms(first.left(moved)))
        done.append((fault, values))
    passed = np.cumsum([0, *rng.integers(_EVERY - _LATE, _EVERY + _LATE + 1, len(days) - 1)])
    dates = [(_FIRST + timedelta(days=int(day))).isoformat() for day in passed]
    at_work, changes = [done] * len(days), []
    if several.moves:
        at_work, change = _moving(several, days, done, passed / passed[-1], rng)
        changes.append(change)
    last = truth(case, days[-1].gauge, at_work[-1], [], noise)
    return {"date": dates}, at_work, {**last, "changes": changes}


def _moving(
    several: Several, days: Sequence[Day], done: AtWork, time: Array, rng: np.random.Generator
) -> tuple[list[AtWork], dict[str, Any]]:
    """Let one number of a fault change; return what is at work on each day, and what changed."""
    own = next(k for k, (fault, _) in enumerate(done) if fault.name == several.moves)
    fault, values = done[own]
    others = [item for k, item in enumerate(done) if k != own]
    spot, setting = draw_spot(fault, values, rng), days[0].setting
    after = None if several.how == "grows" else int(rng.integers(len(days) - 1))
    shape = time if after is None else (np.arange(len(days)) > after).astype(float)
    times = float(np.exp(rng.uniform(*np.log(several.change))))
    by = times * _tells(several, days, spot, values, others)
    by *= 1.0 if fault.name in GROWS_ONLY else float(rng.choice([-1.0, 1.0]))
    at_work = [[*done[:own], (fault, spot.moved(values, by * share)), *done[own + 1 :]] for share in shape.tolist()]
    name, amount = spot.told(setting, values, by)
    kind, where = spot.place(setting)
    return at_work, {
        "effect": fault.name,
        "place": {"kind": kind, "name": where},
        "parameter": name,
        "how": several.how,
        "after": after,
        "amount": amount,
        "deviations": times,
    }


def _tells(several: Several, days: Sequence[Day], spot: Spot, values: Array, others: AtWork) -> float:
    """Return the deviation in which a change is counted: of a difference, or of the first campaign."""
    noise = days[0].instrument.noise
    told = days[:2] if several.how == "changes" else days[:1]
    found = [deviation(day.gauge, spot, values, others, noise) for day in told]
    one = float(np.sqrt(sum(std**2 for std, _ in found)))
    if several.change[1] * one * max(leaves for _, leaves in found) > _LARGEST * noise:
        raise Unseen(f"a change of {spot.fault.name} would have to be large to be told from what else is at work")
    return one
