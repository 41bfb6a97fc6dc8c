"""Search for the one or two data faults whose repair makes robot and table match; all candidates compete alike.

A repair is worth how far it brings down the gap, its median over the rows, with the unknown frames fitted robustly and
nothing else. Thousands of candidates are screened side by side: with an affine map in place of a rigid motion
(``Readings.relaxed``), which tells what is wrong with the joints whatever unit and axes the instrument has; the best of
them with rigid frames on few rows; the best of these on many.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.faults import (
    AXES,
    JOINT_KINDS,
    KINDS,
    MEASUREMENT_KINDS,
    PAIRING_KINDS,
    TURNS,
    UNITS,
    Family,
    Fault,
    Kind,
    Proposal,
    Readings,
    Rows,
    stacked,
)
from thermal_robot.diagnosis.values import DataFault
from thermal_robot.inference.algebra import rms
from thermal_robot.inference.registration import BaseAndTarget, cauchy_weights, middle
from thermal_robot.inference.settings import LEVEL


def evenly(rows: NDArray[np.int64], count: int = settings.SAMPLED) -> NDArray[np.int64]:
    """Systematic sample of ``count`` rows, evenly spaced; rows repeat where there are fewer."""
    return np.asarray(rows[np.linspace(0, len(rows) - 1, count).round().astype(np.int64)])


def spread(rows: NDArray[np.int64], most: int = settings.SAMPLED) -> NDArray[np.int64]:
    """Systematic sample of at most ``most`` rows, evenly spaced."""
    return evenly(rows, min(len(rows), most))


def window(readings: Readings) -> Readings:
    """Consecutive rows in the middle of the campaign, on which clock offsets are compared."""
    rows = len(readings.q)
    order = np.arange(rows) if readings.clock is None else np.argsort(readings.clock, kind="stable")
    begin = max(rows - settings.WINDOW, 0) // 2
    return readings.take(np.sort(order[begin : begin + settings.WINDOW]))


def geometric_mean(distance: Array) -> float:
    """Geometric mean of distances, m: falls with every row that is repaired."""
    return float(np.exp(np.mean(np.log(np.maximum(distance, settings.LEAST_GAP)))))


@dataclass(frozen=True, eq=False)
class Repaired:
    """One repaired fault and the distances of a sample of rows after the repair, m."""

    fault: Fault  # what was mended
    distance: Array  # (K,) m
    place: Array  # (3,) where the target then sits on the tool frame, m
    still: float = np.inf  # m, the median distance that a robot which does not move would leave

    @property
    def median(self) -> float:
        """Median distance after the repair, m, by which the reduction of the gap is judged."""
        return float(np.median(self.distance))

    @property
    def typical(self) -> float:
        """The geometric mean of the distances, m."""
        return geometric_mean(self.distance)


@dataclass(frozen=True, eq=False)
class AffectedRows:
    """Rows that a data fault may concern, and their distances from the prediction."""

    readings: Readings  # all rows as they stand
    rows: Rows  # (N,) those in question
    distance: Array  # (N,) of all rows as they stand, m
    frames: (
        BaseAndTarget | None
    )  # where the other rows put them; ``None`` where all rows are in question, and the frames too

    @classmethod
    def whole(cls, readings: Readings) -> AffectedRows:
        """Regard all rows as in question: the frames are fitted anew to each candidate."""
        sample = readings.take(spread(np.arange(len(readings.q))))
        distance = readings.distance(sample.align(coarse=True))
        if np.median(distance) > readings.tolerance:
            distance = readings.distance(sample.align())
        return cls(readings, np.ones(len(distance), dtype=bool), distance, None)

    @property
    def sample(self) -> Readings:
        """Evenly spaced sample of the rows in question, unrepaired."""
        return self.readings.take(spread(np.flatnonzero(self.rows)))

    @property
    def median(self) -> float:
        """The median distance of these rows, m."""
        return float(np.median(self.distance[self.rows]))

    @property
    def count(self) -> int:
        """Effective number of rows on which candidates are compared: the sample's, less three if frames are fitted."""
        return max(min(int(self.rows.sum()), settings.SAMPLED) - (3 if self.frames is None else 0), 0)

    def is_chance(self, fall: float, asked: int) -> bool:
        """Bonferroni test: whether one of ``asked`` candidates may reduce the gap by the factor ``fall`` by chance."""
        return bool(self.count * np.log(fall) < np.log(asked / LEVEL))

    def mended(self, fault: Fault) -> Readings:
        """Return the readings after the repairs of a fault, one after the other, in these rows."""
        readings = self.readings
        for proposal in fault:
            readings = proposal.repair(readings, self.rows)
        return readings

    def sketch(self, fault: Fault, most: int) -> Readings | None:
        """Sample of these rows after a repair; ``None`` where the repair determines too few."""
        mended = self.mended(fault)
        own, asked = np.flatnonzero(self.rows & mended.known), int(self.rows.sum())
        # fewer than three rows determine no frame
        return mended.take(evenly(own, min(most, asked))) if len(own) >= max(3, asked / 2) else None

    def tried(self, fault: Fault, begun: Array) -> Repaired | None:
        """Repair a fault in these rows and register a sample, from ``begun`` and from the declared target."""
        part = self.sketch(fault, settings.SAMPLED)
        if part is None:
            return None
        frames = self.frames or part.align(begun=np.stack([begun, part.declared.tool[:3, 3]]))
        return Repaired(fault, part.distance(frames), frames.tool[:3, 3], float(part.still()))

    def improved_rows(self, found: Repaired) -> Rows:
        """Rows (N,) that fit better with the repair than without.

        All affected rows if nearly all of those that the repair determines fit better.
        """
        mended = self.mended(found.fault)
        frames = self.frames or mended.take(spread(np.flatnonzero(mended.known))).align(begun=found.place[None])
        known = self.rows & mended.known
        better = known & (mended.distance(frames) < self.readings.distance(frames))
        return self.rows if better.sum() > (1.0 - settings.FEW_STRAYS) * known.sum() else better


def part_of(readings: Readings, begun: BaseAndTarget) -> AffectedRows | None:
    """Outlying rows of a robust registration where they are many but a minority; else ``None``."""
    frames, distance = begun, readings.distance(begun)
    for _ in range(settings.PART_ROUNDS):
        near = np.flatnonzero(~_strays(readings, distance))
        if len(near) <= len(distance) / 2:
            return None
        frames = readings.take(spread(near)).align()
        distance = readings.distance(frames)
    away = _strays(readings, distance)
    many = max(3, settings.FEW_STRAYS * len(away)) <= away.sum() <= len(away) / 2
    return AffectedRows(readings, away, distance, frames) if many else None


def _strays(readings: Readings, distance: Array) -> Rows:
    """Mask (N,) of outliers: distances above ``STRAY`` times their ``NEAREST`` quantile."""
    near = float(np.quantile(distance, settings.NEAREST))
    return np.asarray(distance > settings.STRAY * max(near, settings.LEAST * readings.tolerance))


def consensus(sample: Readings) -> BaseAndTarget:
    """Random sample consensus (RANSAC): frames that bring many rows near where half of them may be wrong.

    Fischler and Bolles, *Communications of the ACM* 24 (1981). All draws go side by side.
    """
    rng = np.random.default_rng(0)
    rows = np.array([rng.choice(len(sample.q), settings.DRAWN, replace=False) for _ in range(settings.DRAWS)])
    best, least = sample.align(coarse=True), np.inf
    for _ in range(1 + settings.PART_ROUNDS):
        frames = sample.take(rows).align(coarse=True)
        distance = sample.distance(frames)
        reach = np.quantile(distance, settings.NEAREST, axis=1)
        first = int(reach.argmin())
        if reach[first] < least:
            best, least = BaseAndTarget(frames.base[first], frames.tool[first]), float(reach[first])
        # go on from the most promising draws, each with the rows that it brings near
        order = np.argsort(reach, kind="stable")[: max(len(reach) // settings.DRAWS_HALVED, 1)]
        near = max(int(settings.NEAREST * distance.shape[1]), settings.DRAWN)
        rows = np.argsort(distance[order], axis=1)[:, :near]
    return best


def mixture(struck: AffectedRows) -> AffectedRows | None:
    """Two-component mixture of unrepaired and repaired rows for each fault; returns the best one's repaired rows.

    It serves robots whose own errors are not small against the fault, so that no row is an outlier. Rows are classified
    anew in each round. ``None`` if the gap falls no more than chance allows; each row's choice counts as a factor of 2.
    """
    readings = window(struck.readings)
    rows, every = spread(np.arange(len(readings.q)), settings.RELAXED), np.ones(len(readings.q), dtype=bool)
    own, begun = readings.take(rows), struck.sample.align(coarse=True)
    proposals = [p for kind in KINDS for p in kind.proposed(readings)]
    proposals += [family.of(number) for kind in KINDS for family in kind.families(readings) for number in family.tried]
    best: list[tuple[float, Proposal, BaseAndTarget]] = []
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
        best.append((float(left[k]), some[k], BaseAndTarget(frames.base[k], frames.tool[k])))
    least, proposal, frames = min(best, key=lambda found: found[0])
    fall = struck.median / (2.0 * max(least, settings.LEAST_GAP))
    if fall < 1.0 or struck.is_chance(fall, len(proposals)):
        return None
    mended_all, distance = struck.mended((proposal,)), struck.readings.distance(frames)
    return AffectedRows(struck.readings, mended_all.known & (mended_all.distance(frames) < distance), distance, frames)


Chosen = list[tuple[Fault, Array, float]]
"""Faults, the target's place (3,) on the tool after repair, m, and a lower bound of the gap over a resting robot's."""


class Screen:
    """Search over candidate faults of some rows, screened on a few rows before the full comparison; counts them."""

    def __init__(self, struck: AffectedRows) -> None:
        self.struck, self.asked = struck, 0

    def singly(self) -> list[Repaired]:
        """Repair each single fault, with the known frames, and return its distances on a few rows."""
        parts = [((p,), self.struck.sketch((p,), settings.SKETCHED)) for p in self._proposals(KINDS)]
        frames = self.struck.frames
        assert frames is not None
        self.asked += len(parts)
        return [Repaired(own, part.distance(frames), frames.tool[:3, 3]) for own, part in parts if part is not None]

    def both_sides(self) -> list[Repaired]:
        """Distances on a few rows for faults of the joints, of the measurements, and pairs with one of each."""
        joints = self._prescreened([(), *((p,) for p in self._of_joints)])
        measured = [*self._proposals(MEASUREMENT_KINDS)]
        units, axes, turns = ([p for p in measured if p.kind in kinds] for kinds in (UNITS, AXES, TURNS))
        sides: list[Fault] = [(), *((p,) for p in (*units, *axes)), *product(units, axes)]
        asked = [((*own, *side), at, left) for own, at, left in joints for side in sides if len(own) + len(side) <= 2]
        looked = self._screened(asked)
        if self.struck.readings.orientation is None:
            return looked
        looked.sort(key=attrgetter("typical"))
        near = [
            t for two in (False, True) for t in [t for t in looked if (len(t.fault) > 1) is two][: settings.SURVIVORS]
        ]
        more = [((*t.fault, *turn), t.place, 0.0) for t in near for turn in ((), *((p,) for p in turns))]
        return self._screened([own for own in more if len(own[0]) <= 2], turns=True)

    def two_of_joints(self) -> list[Repaired]:
        """Distances on a few rows for pairs of faults of the joints, such as many sign reversals with another fault."""
        turned = [p for p in self._of_joints if p.joints][: settings.PAIRED_PATTERNS]
        others = [p for p in self._of_joints if not p.joints]
        scores: list[Array] = []
        made: list[Fault] = []
        for other in others:
            part = self.struck.sketch((other,), settings.RELAXED)
            if part is not None:
                every = np.ones(len(part.q), dtype=bool)
                seconds = [*turned, *(p for p in others if p is not other and p.kind not in PAIRING_KINDS)]
                made += [(other, p) for p in seconds]
                scores.append(middle(stacked([p.repair(part, every) for p in seconds]).relaxed()[0]))
        if not scores:
            return []
        self.asked += len(made)
        order = np.argsort(np.concatenate(scores), kind="stable")[: settings.MOST_SURVIVORS]
        return self._screened(self._prescreened([made[k] for k in order]), turns=True)

    @cached_property
    def _of_joints(self) -> list[Proposal]:
        return [*self._proposals((*JOINT_KINDS, *PAIRING_KINDS))]

    def _proposals(self, kinds: Sequence[Kind]) -> Iterator[Proposal]:
        """Yield the faults of some kinds, and the best of each family."""
        for kind in kinds:
            yield from kind.proposed(self.struck.readings)
            for family in kind.families(self.struck.readings):
                self.asked += len(family.tried)
                if (best := self._refined(family)) is not None:
                    yield best

    def _refined(self, family: Family) -> Proposal | None:
        """Best fault of a family by grid search, then bounded search; ``None`` if the gap hardly falls at the best."""
        if len(family.tried) < 3:
            return None
        struck = self.struck
        if struck.frames is None:
            part = window(struck.readings)
            struck = AffectedRows(part, np.ones(len(part.q), dtype=bool), np.zeros(len(part.q)), None)

        def left(*fault: Proposal) -> float:
            part = struck.sketch(fault, settings.RELAXED)
            if part is None:
                return np.inf
            return geometric_mean(part.distance(struck.frames) if struck.frames else part.relaxed()[0])

        found = [left(family.of(number)) for number in family.tried]
        k = int(np.argmin(found))
        if found[k] * settings.PROMISING > left():
            return None
        low, high = family.tried[max(k - 1, 0)], family.tried[min(k + 1, len(found) - 1)]
        least = minimize_scalar(
            lambda number: np.log(min(left(family.of(number)), found[k] * settings.WORSE)),
            bounds=(low, high),
            method="bounded",
            options={"xatol": settings.OFFSET_SETTLED * (high - low)},
        )
        return family.of(float(least.x) if least.fun < np.log(found[k]) else family.tried[k])

    def _prescreened(self, faults: Sequence[Fault]) -> Chosen:
        """Faults with the smallest median residual of an affine map, refitted once with Cauchy's weights."""
        own = [(fault, part) for fault in faults if (part := self.struck.sketch(fault, settings.RELAXED)) is not None]
        self.asked += len(faults)
        if not own:
            return []
        several = stacked([part for _, part in own])
        left, place = several.relaxed(cauchy_weights(several.relaxed()[0]))
        score = middle(left)
        order = np.argsort(score, kind="stable")[: settings.MOST_SURVIVORS]
        many = int((score <= settings.NEAR * max(score.min(), settings.LEAST_GAP)).sum())
        least = score * own[0][1].maps_place
        return [(own[k][0], place[k], float(least[k])) for k in order[: max(settings.SURVIVORS, many)]]

    def _screened(self, chosen: Chosen, *, turns: bool = False) -> list[Repaired]:
        """Faults with their rigid-registration residual on a few rows, if measured points extend as far as the motion.

        Faults of which even an affine map leaves more than a repair may are skipped.
        """
        self.asked += len(chosen)
        chosen = [own for own in chosen if own[2] <= settings.NEAR * settings.STILL[max(len(own[0]), 1) - 1]]
        parts = [(own, self.struck.sketch(own[0], settings.SKETCHED)) for own in chosen]
        extending = [(own, part) for own, part in parts if part is not None and _extends(part)]
        found: list[Repaired] = []
        for first in range(0, len(extending), settings.ABREAST):
            some, several = zip(*extending[first : first + settings.ABREAST], strict=True)
            side = stacked(several)
            frames = side.align(coarse=True, begun=np.stack([place for _, place, _ in some])[:, None, :])
            left = side.distance(frames, turns=turns)
            found += [Repaired(own[0], away, at[:3, 3]) for own, away, at in zip(some, left, frames.tool, strict=True)]
        return found


def _extends(readings: Readings) -> bool:
    """Whether measured points and predicted points have the same extent within the factor ``EXTENT``."""
    points = readings.poses[:, :3, 3] if readings.simulated_position is None else readings.simulated_position
    one, other = (float(np.abs(own - own.mean(axis=0)).sum()) for own in (readings.position, points))
    return max(one, other) <= settings.EXTENT * min(one, other)


def data_fault(campaign: Campaign, progress: Callable[[str], None] = lambda _: None) -> DataFault | None:
    """Return the data fault whose repair makes robot and table match; ``None`` where they match, or no repair does.

    ``progress`` is called with a few words where candidates are tried.
    """
    if campaign.samples <= settings.DRAWN:
        return None
    readings = Readings.of(campaign)
    every = AffectedRows.whole(readings)
    apart = every.median > readings.tolerance
    if apart:
        progress("faults of the data")
    found = repairs(every) if apart else []
    part = None if found else part_of(readings, consensus(every.sample) if apart else every.sample.align(coarse=True))
    if part is None and apart and not found:
        part = mixture(every)
    if part is not None:
        progress("faults of the data in some rows")
        every, found = part, repairs(part)
    return _data_fault(campaign, every, found) if found else None


def repairs(struck: AffectedRows) -> list[Repaired]:
    """Faults whose repair cannot be told apart by their residuals, in the order of their kinds; empty without any.

    Pairs of faults are returned where they leave significantly less than the best single fault.
    """
    screen = Screen(struck)
    if struck.frames is not None:
        return _best(screen, screen.singly(), struck.median)
    tried = screen.both_sides()
    one = _best(screen, [t for t in tried if len(t.fault) == 1], struck.median)
    least, enough = min((t.median for t in one), default=struck.median), struck.readings.tolerance
    if one and least <= enough:
        return one
    pairs = [t for t in tried if len(t.fault) == 2]
    two = _best(screen, pairs, least)
    if not two or min(t.median for t in two) > enough:
        two = _best(screen, [*pairs, *screen.two_of_joints()], least)
    return two or one


def _best(screen: Screen, tried: Sequence[Repaired], before: float) -> list[Repaired]:
    """Faults that reduce the gap from ``before``, m, significantly, with a log likelihood near that of the best."""
    struck = screen.struck
    likely = sorted(tried, key=attrgetter("typical"))[: settings.FULLY]
    full = [own for t in likely if (own := struck.tried(t.fault, t.place)) is not None]
    full = [t for t in full if t.median < settings.STILL[len(t.fault) - 1] * t.still]
    if not full:
        return []
    scale = max(min(t.median for t in full), settings.LEAST_GAP)
    if before / scale < settings.FALL or struck.is_chance(before / scale, screen.asked):
        return []
    # log likelihood of Cauchy's law: few rows that nothing mends decide nothing
    said = [-struck.count * float(np.mean(np.log1p((t.distance / scale) ** 2))) for t in full]
    alike = [t for t, own in zip(full, said, strict=True) if own > max(said) - settings.TIE]
    alike = [*{frozenset((p.kind.name, p.place) for p in t.fault): t for t in reversed(alike)}.values()][::-1]
    return sorted((t for t in alike if not any(_says_more(t, other) for other in alike)), key=_usual)


def _says_more(one: Repaired, other: Repaired) -> bool:
    """Whether a fault reverses further joints that do not improve the fit over another fault."""
    return (
        len(one.fault) == len(other.fault)
        and any(p.joints > o.joints for p, o in zip(one.fault, other.fault, strict=True))
        and all(p.joints >= o.joints for p, o in zip(one.fault, other.fault, strict=True))
        and [p.place for p in one.fault if not p.joints] == [o.place for o in other.fault if not o.joints]
    )


def _usual(tried: Repaired) -> tuple[int, ...]:
    """Sort key: the order of the kinds, then the fewest joints."""
    return (*(KINDS.index(p.kind) for p in tried.fault), *(len(p.joints) for p in tried.fault))


def _data_fault(campaign: Campaign, struck: AffectedRows, found: Sequence[Repaired]) -> DataFault:
    alike: dict[tuple[Kind, ...], list[Repaired]] = {}
    for tried in found:
        alike.setdefault(tuple(p.kind for p in tried.fault), []).append(tried)
    alike = dict([*alike.items()][: settings.TOLD])
    best = min(found, key=attrgetter("median"))
    hit = struck.improved_rows(best)
    remedies = (" and ".join(dict.fromkeys(kind.remedy for kind in kinds)) for kinds in alike)
    return DataFault(
        kinds=tuple(dict.fromkeys(kind.name for kinds in alike for kind in kinds)),
        what=", or ".join(_words(own) for own in alike.values()),
        remedy=", or ".join(dict.fromkeys(remedies)),
        rms_before=rms(struck.distance[struck.rows, None]),
        rms_after=rms(best.distance[best.distance <= settings.STRAY * best.median, None]),
        rows=() if hit.all() else tuple(int(r) for r in campaign.rows[hit]),
    )


def _words(alike: Sequence[Repaired]) -> str:
    """Describe alternatives of one kind, or pair of kinds, in words: what is wrong, and in which places."""
    parts = []
    for k, proposal in enumerate(alike[0].fault):
        *others, last = dict.fromkeys(t.fault[k].place for t in alike)
        parts.append(proposal.kind.says.format(f"{', '.join(others)} or {last}" if others else last))
    return " and ".join(parts)
