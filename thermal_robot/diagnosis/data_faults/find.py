"""Find the one fault of the data that repairs a campaign: every candidate is tried and judged in the same way.

What a repair is worth is how far it brings down the gap, its median over the rows, with the unknown frames fitted
exactly and robustly: faults of a table are large, and nothing else is fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults import of_joints, of_measurements, of_pairing, settings
from thermal_robot.diagnosis.data_faults.kind import Kind, Offsets, Proposal
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows, rms
from thermal_robot.diagnosis.parts import DataFault
from thermal_robot.observations import Frames

Array = NDArray[np.float64]

KINDS: tuple[Kind, ...] = (*of_joints.KINDS, *of_measurements.KINDS, *of_pairing.KINDS)


@dataclass(frozen=True, eq=False)
class Tried:
    """A proposal with what it leaves: the distance of each row of a sample that it determines, m."""

    proposal: Proposal
    distance: Array

    @property
    def median(self) -> float:
        """The median distance, m: what the fall of the gap is told by."""
        return float(np.median(self.distance))

    @property
    def typical(self) -> float:
        """The geometric mean of the distances, m: less the more rows are mended, and the better."""
        return float(np.exp(np.mean(np.log(np.maximum(self.distance, settings.LEAST_GAP)))))


@dataclass(frozen=True, eq=False)
class Struck:
    """The rows that a fault may have struck, and how far they are from the prediction.

    Attributes
    ----------
    readings
        All rows as they stand.
    rows
        (N,) those in question.
    distance
        (N,) of all rows as they stand, m.
    frames
        Where the other rows put the frames; ``None`` where all are in question, and the frames with them.
    """

    readings: Readings
    rows: Rows
    distance: Array
    frames: Frames | None

    @classmethod
    def whole(cls, readings: Readings) -> Struck:
        """All rows; the frames are fitted to whatever is proposed."""
        rows = np.ones(len(readings.q), dtype=bool)
        struck = cls(readings, rows, np.zeros(len(rows)), None)
        frames = struck.sample.align(coarse=True)
        if np.median(readings.distance(frames)) > misfit(readings):
            frames = struck.sample.align()
        return replace(struck, distance=readings.distance(frames))

    @property
    def sample(self) -> Readings:
        """A sample of the rows in question, as they stand."""
        return self.readings.take(spread(np.flatnonzero(self.rows)))

    @property
    def median(self) -> float:
        """The median distance of these rows, m."""
        return float(np.median(self.distance[self.rows]))

    @property
    def count(self) -> int:
        """How many rows candidates are compared on, less those that the frames take up."""
        rows = min(int(self.rows.sum()), settings.SAMPLED)
        return max(rows - (settings.FEWEST_STRAYS if self.frames is None else 0), 0)

    def sketched(self, proposal: Proposal) -> Tried:
        """Mend a fault in these rows; take a first look at what is left."""
        mended = proposal.repair(self.readings, self.rows)
        own = np.flatnonzero(self.rows & mended.known)
        if 2 * len(own) < self.rows.sum() or len(own) < settings.FEWEST_STRAYS:
            return Tried(proposal, np.full(1, np.inf))
        part = mended.take(spread(own, settings.SKETCHED))
        return Tried(proposal, part.distance(self.frames or part.align(coarse=True)))

    def tried(self, proposal: Proposal) -> Tried:
        """Mend a fault in these rows; see what is left on a sample of them, aligned from every start."""
        mended = proposal.repair(self.readings, self.rows)
        part = mended.take(spread(np.flatnonzero(self.rows & mended.known)))
        return Tried(proposal, part.distance(self.frames or part.align()))

    def hit(self, proposal: Proposal) -> Rows:
        """(N,) those of these rows that a fault has struck: they fit better mended than as they stand.

        Rows that nothing mends, and those that are not determined, count as the others.
        """
        mended = proposal.repair(self.readings, self.rows)
        frames = self.frames or mended.take(spread(np.flatnonzero(mended.known))).align()
        before, after = self.readings.distance(frames), mended.distance(frames)
        better = self.rows & mended.known & (after < before)
        return self.rows if better.sum() > settings.NEARLY_ALL * (self.rows & mended.known).sum() else better


def spread(rows: NDArray[np.int64], most: int = settings.SAMPLED) -> NDArray[np.int64]:
    """Return so many of the rows that candidates can be compared, evenly."""
    if len(rows) <= most:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, most).round().astype(int)])


def misfit(readings: Readings) -> float:
    """Return the gap, m, above which robot and table are not taken to fit."""
    return settings.MISFIT * readings.spread()


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
    part = None if found else part_of(readings, _begun(every.sample) if apart else every.sample.align(coarse=True))
    if part is None and apart and not found:
        part = mixture(every, KINDS)
    if part is not None:
        progress("faults of the data in some rows")
        every, found = part, mended(part, KINDS)
    return _told(campaign, every, found) if found else None


def part_of(readings: Readings, begun: Frames) -> Struck | None:
    """Return the rows that stray from the others, which are many; ``None`` where few stray, or most."""
    distance = readings.distance(begun)
    for _ in range(settings.PART_ROUNDS):
        near = np.flatnonzero(~_strays(readings, distance))
        if len(near) <= (1.0 - settings.MOST_STRAYS) * len(distance):
            return None
        frames = readings.take(spread(near)).align()
        distance = readings.distance(frames)
    away = _strays(readings, distance)
    least = max(settings.FEWEST_STRAYS, settings.FEW_STRAYS * len(away))
    if least <= away.sum() <= settings.MOST_STRAYS * len(away):
        return Struck(readings, away, distance, frames)
    return None


def mixture(struck: Struck, kinds: Sequence[Kind]) -> Struck | None:
    """Return the rows that fit better mended than as they stand, by the fault beside which all rows fit best so.

    For a robot whose own errors are not small beside the fault: no row strays far. Frames are fitted to the rows as
    they stand and to the others mended, which are told anew in each round. Each row may choose, which counts against
    the fault as one bit.
    """
    readings, rows = struck.readings, spread(np.arange(len(struck.rows)))
    own, begun = readings.take(rows), struck.sample.align(coarse=True)
    best, least, asked = None, struck.median, 0
    for proposal in (p for kind in kinds for p in (*kind.proposed(readings), *_numbered(kind, readings))):
        repaired, frames = proposal.repair(readings, struck.rows).take(rows), begun
        for _ in range(settings.MIXTURE_ROUNDS):
            better = repaired.known & (repaired.distance(frames) < own.distance(frames))
            mixed = own.where(~better, repaired)
            frames = mixed.align(coarse=True)
        left, asked = float(np.median(mixed.distance(frames))), asked + 1
        if left < least and better.any() and not better.all():
            best, least = (proposal, frames), left
    if best is None or struck.count * np.log(struck.median / (2.0 * least)) < np.log(asked / settings.LEVEL):
        return None
    proposal, frames = best
    repaired, distance = proposal.repair(readings, struck.rows), readings.distance(frames)
    return Struck(readings, repaired.known & (repaired.distance(frames) < distance), distance, frames)


def _numbered(kind: Kind, readings: Readings) -> Iterator[Proposal]:
    """Yield the faults that differ by a number, for each number that is tried."""
    for family in kind.families(readings):
        yield from (family.of(number) for number in family.tried)


def _strays(readings: Readings, distance: Array) -> Rows:
    """(N,) rows that are far off, for those whose gap is near enough."""
    near = float(np.quantile(distance, settings.NEAREST))
    return np.asarray(distance > settings.STRAY * max(near, settings.LEAST * misfit(readings)))


def _begun(sample: Readings) -> Frames:
    """Return frames that bring many rows near where half of them may be wrong: the best of few rows drawn at random.

    Fischler and Bolles, *Communications of the ACM* 24 (1981).
    """
    rng = np.random.default_rng(settings.SEED)
    best, least = sample.declared, np.inf
    for _ in range(settings.DRAWS):
        frames = sample.take(rng.choice(len(sample.q), settings.DRAWN, replace=False)).align(coarse=True)
        for _ in range(settings.PART_ROUNDS):
            distance = sample.distance(frames)
            reach = float(np.quantile(distance, settings.NEAREST))
            if reach >= least:
                break
            best, least = frames, reach
            frames = sample.take(np.flatnonzero(distance <= reach)).align(coarse=True)
    return best


def mended(struck: Struck, kinds: Sequence[Kind]) -> list[Tried]:
    """Return the faults that mend the rows and cannot be told apart, in the order of their kinds; none if none does."""
    readings = struck.readings
    tried = [struck.sketched(p) for kind in kinds for p in kind.proposed(readings)]
    families = [family for kind in kinds for family in kind.families(readings)]
    asked = len(tried) + sum(len(family.tried) for family in families)
    tried += [best for family in families if (best := _refined(struck, family)) is not None]
    likely = sorted(tried, key=attrgetter("typical"))[: settings.FULLY]
    full = [struck.tried(t.proposal) for t in tried if t in likely and np.isfinite(t.median)]
    if not full:
        return []
    scale = max(min(t.median for t in full), settings.LEAST_GAP)
    fall = struck.median / scale
    if fall < settings.FALL or struck.count * np.log(fall) < np.log(asked / settings.LEVEL):
        return []
    said = [_log_likelihood(t, scale) * struck.count for t in full]
    return [t for t, own in zip(full, said, strict=True) if own > max(said) - settings.TIE]


def _log_likelihood(tried: Tried, scale: float) -> float:
    """Log likelihood a row, of Cauchy's law: few rows that nothing mends decide nothing."""
    return -float(np.mean(np.log1p((tried.distance / scale) ** 2)))


def _refined(struck: Struck, family: Offsets) -> Tried | None:
    """Return the best of a family: the best of those that are tried, then between its neighbours."""
    if len(family.tried) < 3:
        return None
    coarse = [struck.sketched(family.of(number)) for number in family.tried]
    k = int(np.argmin([t.typical for t in coarse]))
    if coarse[k].median * settings.PROMISING > struck.median:
        return None
    low, high = family.tried[max(k - 1, 0)], family.tried[min(k + 1, len(coarse) - 1)]
    found = minimize_scalar(
        lambda number: np.log(min(struck.sketched(family.of(number)).typical, struck.median)),
        bounds=(low, high),
        method="bounded",
        options={"maxiter": settings.OFFSET_ROUNDS, "xatol": settings.OFFSET_SETTLED * (high - low)},
    )
    return min(coarse[k], struck.sketched(family.of(float(found.x))), key=attrgetter("typical"))


def _told(campaign: Campaign, struck: Struck, found: Sequence[Tried]) -> DataFault:
    kinds = dict.fromkeys(t.proposal.kind for t in found)
    places = {k: list(dict.fromkeys(t.proposal.place for t in found if t.proposal.kind is k)) for k in kinds}
    best = min(found, key=attrgetter("median"))
    hit = struck.hit(best.proposal)
    return DataFault(
        kinds=tuple(kind.name for kind in kinds),
        what=", or ".join(kind.says.format(_one_of(own)) for kind, own in places.items()),
        remedy=", or ".join(dict.fromkeys(kind.remedy for kind in kinds)),
        rms_before=rms(struck.distance[struck.rows]),
        rms_after=rms(best.distance[best.distance <= settings.STRAY * best.median]),
        rows=() if hit.all() else tuple(int(r) for r in campaign.rows[hit]),
    )


def _one_of(places: Sequence[str]) -> str:
    return places[0] if len(places) == 1 else f"{', '.join(places[:-1])} or {places[-1]}"
