"""Which rows a fault of the data may have struck: all, those that stray, or those that fit better mended.

What a repair is worth is how far it brings down the gap, its median over the rows, with the unknown frames fitted
exactly and robustly: faults of a table are large, and nothing else is fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.kind import Fault, Kind, Proposal, repaired
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows, stacked
from thermal_robot.inference.frames import Placed, middle


@dataclass(frozen=True, eq=False)
class Tried:
    """A fault with what is left once it is mended: the distance of each row of a sample that it determines, m.

    Attributes
    ----------
    fault
        What was mended.
    distance
        (K,) m.
    place
        (3,) where the target then sits on the tool frame, m.
    still
        m, the median distance that a robot which does not move would leave.
    """

    fault: Fault
    distance: Array
    place: Array
    still: float = np.inf

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
    frames: Placed | None

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

    def sketch(self, fault: Fault, most: int) -> Readings | None:
        """Return so many of these rows, mended; ``None`` where the repair determines too few."""
        mended = repaired(fault, self.readings, self.rows)
        own = np.flatnonzero(self.rows & mended.known)
        if 2 * len(own) < self.rows.sum() or len(own) < settings.FEWEST_STRAYS:
            return None
        return mended.take(own[np.linspace(0, len(own) - 1, min(most, self.rows.sum())).round().astype(np.int64)])

    def tried(self, fault: Fault, begun: Array | None = None) -> Tried | None:
        """Mend a fault in these rows; see what a sample of them leaves, aligned from a place and the declared one."""
        part = self.sketch(fault, settings.SAMPLED)
        if part is None:
            return None
        own = part.declared.tool[:3, 3]
        frames = self.frames or part.align(begun=None if begun is None else np.stack([begun, own]))
        return Tried(fault, part.distance(frames), frames.tool[:3, 3], float(part.still()))

    def hit(self, found: Tried) -> Rows:
        """(N,) those of these rows that a fault has struck: they fit better mended than as they stand.

        Rows that nothing mends, and those that are not determined, count as the others.
        """
        mended = repaired(found.fault, self.readings, self.rows)
        some = mended.take(spread(np.flatnonzero(mended.known)))
        frames = self.frames or some.align(begun=found.place[None])
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


def window(readings: Readings) -> Readings:
    """Return the rows in the middle of the campaign, one after the other in time, on which clocks are compared."""
    rows = len(readings.q)
    if rows <= settings.WINDOW:
        return readings
    order = np.arange(rows) if readings.clock is None else np.argsort(readings.clock, kind="stable")
    begin = (rows - settings.WINDOW) // 2
    return readings.take(np.sort(order[begin : begin + settings.WINDOW]))


def part_of(readings: Readings, begun: Placed) -> Struck | None:
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


def _strays(readings: Readings, distance: Array) -> Rows:
    """(N,) rows that are far off, for those whose gap is near enough."""
    near = float(np.quantile(distance, settings.NEAREST))
    return np.asarray(distance > settings.STRAY * max(near, settings.LEAST * misfit(readings)))


def consensus(sample: Readings) -> Placed:
    """Return frames that bring many rows near where half of them may be wrong: the best of few rows drawn at random.

    Fischler and Bolles, *Communications of the ACM* 24 (1981). All draws go side by side.
    """
    rng = np.random.default_rng(settings.SEED)
    rows = np.array([rng.choice(len(sample.q), settings.DRAWN, replace=False) for _ in range(settings.DRAWS)])
    best, least = sample.align(coarse=True), np.inf
    for _ in range(1 + settings.PART_ROUNDS):
        frames = sample.take(rows).align(coarse=True)
        distance = sample.distance(frames)
        reach = np.quantile(distance, settings.NEAREST, axis=1)
        first = int(reach.argmin())
        if reach[first] < least:
            best, least = Placed(frames.base[first], frames.tool[first]), float(reach[first])
        # go on from the most promising draws, each with the rows that it brings near
        order = np.argsort(reach, kind="stable")[: max(len(reach) // settings.DRAWS_HALVED, 1)]
        near = max(int(settings.NEAREST * distance.shape[1]), settings.DRAWN)
        rows = np.argsort(distance[order], axis=1)[:, :near]
    return best


def mixture(struck: Struck, kinds: Sequence[Kind]) -> Struck | None:
    """Return the rows that fit better mended than as they stand, by the fault beside which all rows fit best so.

    For a robot whose own errors are not small beside the fault: no row strays far. Frames are fitted to the rows as
    they stand and to the others mended, which are told anew in each round. Each row may choose, which counts against
    the fault as one bit.
    """
    readings = window(struck.readings)
    rows, every = spread(np.arange(len(readings.q)), settings.RELAXED), np.ones(len(readings.q), dtype=bool)
    own, begun = readings.take(rows), struck.sample.align(coarse=True)
    proposals = [p for kind in kinds for p in (*kind.proposed(readings), *_numbered(kind, readings))]
    best: list[tuple[float, Proposal, Placed]] = []
    for first in range(0, len(proposals), settings.ABREAST):
        some = proposals[first : first + settings.ABREAST]
        mended = [p.repair(readings, every).take(rows) for p in some]
        known, repair = np.stack([m.known for m in mended]), stacked(mended)
        frames = begun
        for _ in range(settings.MIXTURE_ROUNDS):
            better = known & (repair.distance(frames) < own.distance(frames))
            mixed = own.where(~better, repair)
            frames = mixed.align(coarse=True, begun=np.atleast_2d(frames.tool[..., :3, 3])[:, None, :])
        left = np.where(better.any(axis=1) & ~better.all(axis=1), middle(mixed.distance(frames)), np.inf)
        k = int(left.argmin())
        best.append((float(left[k]), some[k], Placed(frames.base[k], frames.tool[k])))
    least, proposal, frames = min(best, key=lambda found: found[0])
    fall = struck.median / (2.0 * max(least, settings.LEAST_GAP))
    if fall < 1.0 or struck.count * np.log(fall) < np.log(len(proposals) / settings.LEVEL):
        return None
    mended_all, distance = proposal.repair(struck.readings, struck.rows), struck.readings.distance(frames)
    return Struck(struck.readings, mended_all.known & (mended_all.distance(frames) < distance), distance, frames)


def _numbered(kind: Kind, readings: Readings) -> list[Proposal]:
    """Return the faults that differ by a number, for each number that is tried."""
    return [family.of(number) for family in kind.families(readings) for number in family.tried]
