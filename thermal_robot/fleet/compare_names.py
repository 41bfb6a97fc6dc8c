"""Which effects keep their name once campaigns are seen together, and why others lose it.

A wrong name fits one campaign, and takes another size in the next. So an effect keeps its name if two campaigns agree
on most of it: the same size within half of the larger, which wear and re-adjustment leave alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_effects import Candidate
from thermal_robot.fleet.compare_joint import Joint
from thermal_robot.fleet.compare_sums import Sums
from thermal_robot.fleet.comparison import Status
from thermal_robot.inference import settings


def judged(
    number: int,
    item: Candidate,
    owners: Sequence[tuple[int, int]],
    found: Joint,
    said: Sequence[Sums],
    names: Sequence[str],
) -> tuple[Status, str]:
    """Return the status of an effect, and the reason where it loses its name or is not compared.

    Parameters
    ----------
    number, item
        Which effect.
    owners
        Per parameter that is compared: number of its effect, and of the parameter within that.
    found
        The joint fit.
    said
        What each campaign says.
    names
        What the campaigns are called.
    """
    own = [k for k, (effect, _) in enumerate(owners) if effect == number]
    tell = [c for c, one in enumerate(said) if np.diag(one.matrix)[own].max(initial=0.0) > settings.INFORMATION_FLOOR]
    if len(tell) < 2:
        if not any(item.named):
            return "absent", ""
        return (
            "not_compared",
            f"{names[tell[0]]} alone can tell it" if tell else "no campaign tells it beside the frames",
        )
    if not any(part.effect == number for part in found.parts):
        if not any(item.named):
            return "absent", ""
        return "not_needed", "the campaigns together do not need it"
    changed = any(change.part.effect == number for change in found.changes)
    if not changed:
        return "shared", ""
    sizes = _strengths(own, item, owners, found, said, tell)
    if _agreed(sizes) >= compare_settings.MOST:
        return "changed", ""
    needed = [c for c in tell if max(size[c] for size, _ in sizes) > 0.0]
    if len(tell) == 2 and len(needed) == 1:
        return "changed", ""  # a fault that began or was mended: two campaigns cannot say more
    return "contradicts", _why([names[c] for c in needed], [names[c] for c in tell if c not in needed])


def _strengths(
    own: Sequence[int],
    item: Candidate,
    owners: Sequence[tuple[int, int]],
    found: Joint,
    said: Sequence[Sums],
    tell: Sequence[int],
) -> list[tuple[dict[int, float], dict[tuple[int, int], float]]]:
    """Return for each place the size in each campaign, and that of the difference between any two, in deviations."""
    result = []
    for place in dict.fromkeys((p.kind, p.place) for p in item.told):
        inside = [k for k in own if (item.told[owners[k][1]].kind, item.told[owners[k][1]].place) == place]
        metric = np.sum([said[c].matrix[np.ix_(inside, inside)] for c in tell], axis=0) if inside else np.zeros((0, 0))
        values = {c: found.values[c, inside] for c in tell}
        size = {c: _length(values[c], metric) for c in tell}
        apart = {(a, b): _length(values[a] - values[b], metric) for a, b in combinations(tell, 2)}
        result.append((size, apart))
    return result


def _length(vector: Array, metric: Array) -> float:
    return float(np.sqrt(max(float(vector @ metric @ vector), 0.0)))


def _agreed(sizes: Sequence[tuple[dict[int, float], dict[tuple[int, int], float]]]) -> float:
    """Return the share of the strength on which two campaigns agree."""
    whole, agreed = 0.0, 0.0
    for size, apart in sizes:
        strength = max(size.values()) ** 2
        alike = any(0.0 < left <= compare_settings.AGREE * max(size[a], size[b]) for (a, b), left in apart.items())
        same = any(left == 0.0 and size[a] > 0.0 for (a, _), left in apart.items())
        whole, agreed = whole + strength, agreed + strength * (alike or same)
    return agreed / whole if whole else 1.0


def _why(needed: Sequence[str], others: Sequence[str]) -> str:
    if len(needed) == 1:
        verb = "excludes" if len(others) == 1 else "exclude"
        return f"{needed[0]} alone needs it, and {_listed(others)} {verb} it"
    if others:
        verb = "excludes" if len(others) == 1 else "exclude"
        return f"{_listed(needed)} need it in different sizes, and {_listed(others)} {verb} it"
    return f"{_listed(needed)} each need another size, with none in common"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
