"""Find the fault of the data that repairs a campaign, or the two: all candidates are judged in the same way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import attrgetter

import numpy as np

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults import of_joints, of_measurements, of_pairing, settings
from thermal_robot.diagnosis.data_faults.kind import Kind
from thermal_robot.diagnosis.data_faults.readings import Readings, rms
from thermal_robot.diagnosis.data_faults.screen import Screen
from thermal_robot.diagnosis.data_faults.struck import Struck, Tried, consensus, misfit, mixture, part_of
from thermal_robot.diagnosis.parts import DataFault

KINDS: tuple[Kind, ...] = (*of_joints.KINDS, *of_measurements.KINDS, *of_pairing.KINDS)


def data_fault(campaign: Campaign, progress: Callable[[str], None] = lambda _: None) -> DataFault | None:
    """Return the fault of the data without which robot and table fit; ``None`` where they fit, or none mends them.

    Parameters
    ----------
    campaign
        With measurements.
    progress
        Called with a few words where candidates are tried.
    """
    if campaign.samples <= settings.DRAWN:
        return None
    readings = Readings.of(campaign)
    every = Struck.whole(readings)
    apart = every.median > misfit(readings)
    if apart:
        progress("faults of the data")
    found = mended(every, KINDS) if apart else []
    part = None if found else part_of(readings, consensus(every.sample) if apart else every.sample.align(coarse=True))
    if part is None and apart and not found:
        part = mixture(every, KINDS)
    if part is not None:
        progress("faults of the data in some rows")
        every, found = part, mended(part, KINDS)
    return _told(campaign, every, found) if found else None


def mended(struck: Struck, kinds: Sequence[Kind]) -> list[Tried]:
    """Return the faults that mend the rows and cannot be told apart, in the order of their kinds; none if none does.

    Two faults at once are told where they leave so much less than one that it is no chance.
    """
    screen = Screen(struck, kinds)
    if struck.frames is not None:
        return _best(screen, screen.singly(), struck.median, kinds)
    tried = screen.both_sides()
    one = _best(screen, [t for t in tried if len(t.fault) == 1], struck.median, kinds)
    least, enough = min((t.median for t in one), default=struck.median), misfit(struck.readings)
    if one and least <= enough:
        return one
    pairs = [t for t in tried if len(t.fault) == 2]
    two = _best(screen, pairs, least, kinds)
    if not two or min(t.median for t in two) > enough:
        two = _best(screen, [*pairs, *screen.two_of_joints()], least, kinds)
    return two or one


def _best(screen: Screen, tried: Sequence[Tried], before: float, kinds: Sequence[Kind]) -> list[Tried]:
    """Return the faults that bring the gap, m, down by far, and as far as the best of them."""
    struck = screen.struck
    likely = sorted(tried, key=attrgetter("typical"))[: settings.FULLY]
    full = [own for t in likely if (own := struck.tried(t.fault, t.place)) is not None]
    full = [t for t in full if t.median < settings.STILL[len(t.fault) - 1] * t.still]
    if not full:
        return []
    scale = max(min(t.median for t in full), settings.LEAST_GAP)
    fall = before / scale
    if fall < settings.FALL or struck.count * np.log(fall) < np.log(screen.asked / settings.LEVEL):
        return []
    said = [_log_likelihood(t, scale) * struck.count for t in full]
    alike = [t for t, own in zip(full, said, strict=True) if own > max(said) - settings.TIE]
    return sorted(
        (t for t in alike if not any(_says_more(t, other) for other in alike)), key=lambda t: _usual(t, kinds)
    )


def _says_more(one: Tried, other: Tried) -> bool:
    """Tell whether a fault turns round joints that make no difference beside those of another one."""
    return (
        len(one.fault) == len(other.fault)
        and any(p.joints > o.joints for p, o in zip(one.fault, other.fault, strict=True))
        and all(p.joints >= o.joints for p, o in zip(one.fault, other.fault, strict=True))
        and [p.place for p in one.fault if not p.joints] == [o.place for o in other.fault if not o.joints]
    )


def _usual(tried: Tried, kinds: Sequence[Kind]) -> tuple[int, ...]:
    """Order of the kinds, then the fewest joints."""
    return (*(kinds.index(p.kind) for p in tried.fault), *(len(p.joints) for p in tried.fault))


def _log_likelihood(tried: Tried, scale: float) -> float:
    """Log likelihood a row, of Cauchy's law: few rows that nothing mends decide nothing."""
    return -float(np.mean(np.log1p((tried.distance / scale) ** 2)))


def _told(campaign: Campaign, struck: Struck, found: Sequence[Tried]) -> DataFault:
    alike: dict[tuple[Kind, ...], list[Tried]] = {}
    for tried in found:
        alike.setdefault(tuple(p.kind for p in tried.fault), []).append(tried)
    alike = dict([*alike.items()][: settings.TOLD])
    best = min(found, key=attrgetter("median"))
    hit = struck.hit(best)
    return DataFault(
        kinds=tuple(dict.fromkeys(kind.name for kinds in alike for kind in kinds)),
        what=", or ".join(_words(own) for own in alike.values()),
        remedy=", or ".join(
            dict.fromkeys(" and ".join(dict.fromkeys(kind.remedy for kind in kinds)) for kinds in alike)
        ),
        rms_before=rms(struck.distance[struck.rows]),
        rms_after=rms(best.distance[best.distance <= settings.STRAY * best.median]),
        rows=() if hit.all() else tuple(int(r) for r in campaign.rows[hit]),
    )


def _words(alike: Sequence[Tried]) -> str:
    """Say what is wrong, in one kind of place or another, and what else is."""
    parts = []
    for k, proposal in enumerate(alike[0].fault):
        places = list(dict.fromkeys(t.fault[k].place for t in alike))
        parts.append(proposal.kind.says.format(_one_of(places)))
    return " and ".join(parts)


def _one_of(places: Sequence[str]) -> str:
    return places[0] if len(places) == 1 else f"{', '.join(places[:-1])} or {places[-1]}"
