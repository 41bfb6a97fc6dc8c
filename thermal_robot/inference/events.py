"""Events: from one row to another, or in one session, base, tool or a joint's zero stands elsewhere than in the others.

Every run of rows in the order of measurement is weighed at every place by a likelihood ratio (Page, *Biometrika* 42,
1955, for one change; Siegmund, *Annals of Statistics* 14, 1986, for a run between two), from cumulative sums, so that
none costs more than a small solution. Rows that were set aside near each other count fully here: they are what is to be
explained. What is found is a law like others: it has to beat them, and known effects, for its place.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import CLOCK
from thermal_robot.effects.law import Discovered
from thermal_robot.effects.quantities import quantity, unit
from thermal_robot.inference import settings
from thermal_robot.inference.columns import block
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import in_order
from thermal_robot.inference.target import Target, explained_by
from thermal_robot.observations import Observations

Rows = NDArray[np.bool_]
Runs = NDArray[np.int64]
"""(C, 2) first row of each run in the order of measurement, and the first behind it."""


@dataclass(frozen=True, eq=False)
class _Sums:
    """A place's moves in a remainder, row after row in the order of measurement, and their sums up to each row.

    ``own`` holds (N, ·) the flat products of a row: moves with themselves, with the design, and with the remainder.
    """

    own: Array
    summed: Array
    moves: Array
    white: Array
    rank: int
    total: float
    freedom: int

    @classmethod
    def of(cls, target: Target, moves: Array, order: NDArray[np.int64]) -> _Sums:
        """Sum the moves (N, m, d) of a place over a remainder."""
        whitened = (moves * target.root[:, :, None])[order]
        basis = target.basis.reshape(*target.root.shape, -1)[order]
        white = target.white.reshape(target.root.shape)[order]
        products = [
            np.einsum("nmd,nme->nde", whitened, whitened),
            np.einsum("nmr,nmd->nrd", basis, whitened),
            np.einsum("nmd,nm->nd", whitened, white),
        ]
        own = np.concatenate([p.reshape(len(order), -1) for p in products], axis=1)
        summed = np.concatenate([np.zeros((1, own.shape[1])), np.cumsum(own, axis=0)])
        total = max(float((white**2).sum()), settings.TINY)
        return cls(own, summed, whitened, white, basis.shape[2], total, target.freedom)

    def solved(self, sums: Array) -> tuple[Array, Array]:
        """Return (C,) squares that a move of some rows explains, and its ranks, from (C, ·) sums over these rows."""
        d, r = self.moves.shape[2], self.rank
        runs = len(sums)
        whole, design = sums[:, : d * d].reshape(runs, d, d), sums[:, d * d : d * (d + r)].reshape(runs, r, d)
        gram = whole - design.transpose(0, 2, 1) @ design
        return explained_by(gram, sums[:, d * (d + r) :], np.einsum("cii->ci", whole))

    def gains(self, sums: Array, total: float | None = None, freedom: int | None = None) -> Array:
        """Return (C,) log evidence gained (:class:`~thermal_robot.inference.target.Worth`)."""
        total, freedom = total or self.total, freedom or self.freedom
        explained, rank = self.solved(sums)
        rest = np.maximum(total - explained, settings.TINY)
        gain = 0.5 * freedom * np.log(total / rest) - 0.5 * rank * np.log(freedom)
        return np.where((rank == 0) | (freedom - rank < settings.FEWEST_LEFT), -np.inf, gain)

    def of_rows(self, rows: Rows) -> float:
        """Return the log evidence gained by a move of rows (N,), and by it in all but the few that are farthest off.

        It is the smaller of both: in an event all rows share, in gross errors side by side a few.
        """
        far = np.where(rows, (self.white**2).sum(axis=1), -1.0)
        few = max(int(np.ceil(settings.EVENT_CARRYING * rows.sum())), settings.FEWEST_ASIDE)
        out = np.argsort(-far)[:few]
        total = max(self.total - float(far[out].sum()), settings.TINY)
        freedom = max(self.freedom - few * self.white.shape[1], 1)
        whole = self.own[rows].sum(axis=0)
        fewer = self.gains((whole - self.own[out].sum(axis=0))[None], total, freedom)
        return float(min(self.gains(whole[None])[0], fewer[0]))


def events(fit: Fit) -> tuple[Discovered, ...]:
    """Events that may be at work in a fit: steps in time, runs, and sessions apart; the plainest first, one a place."""
    if fit.campaign.samples > settings.RIPPLE_ROWS or fit.campaign.samples < settings.FEWEST_WITH_EVENTS:
        return ()
    observations = fit.corrected
    order, labels = in_order(fit.campaign), fit.campaign.labels.get("session")
    sessions = {} if labels is None else {str(label): labels == label for label in np.unique(labels)}
    found: dict[tuple[str, str], tuple[float, Discovered]] = {}
    places = list(_places(observations))
    moves = [block(observations, place).columns for place in places]
    for target, instead in _targets(fit):
        for place, own in zip(places, moves, strict=True):
            sums = _Sums.of(target, own, order)
            for worth, law in _at_place(observations, place, sums, order, sessions, len(places)):
                key = (law.kind, law.place)
                if worth - instead > found.get(key, (0.0, law))[0]:
                    found[key] = (worth - instead, law)
    return tuple(law for _, law in sorted(found.values(), key=lambda item: -item[0]))


def _places(observations: Observations) -> Iterator[Discovered]:
    """Yield a constant move at each place where an event may be: the base, the tool, the zero of a joint."""
    plain = Discovered(quantity="none", shape="constant", turns=observations.campaign.measures == "pose")
    yield replace(plain, kind="base", place="base")
    yield replace(plain, kind="tool", place="tool")
    for joint in observations.robot.joint_names:
        yield replace(plain, kind="joint", place=joint)


def _targets(fit: Fit) -> Iterator[tuple[Target, float]]:
    """Yield what a fit leaves of all rows but single gross errors, and what an event in it has to gain at least.

    Once as these rows stand, once less of what is far off; and without each effect, which may stand in for an event:
    that has to gain more than the effect does.
    """
    e = fit.explanation
    single = e.outliers & ~gathered(fit, e.outliers)
    blocks = e.best.blocks

    def target(some: Iterable[int], trusted: Rows) -> Target:
        design = np.concatenate([e.linear.frames, *(e.linear.blocks[b].columns for b in some)], axis=2)
        return Target.of(e.linear.gap, design, trusted, fit.campaign.relative_noise)

    yield target(blocks, ~single), 0.0
    yield target(blocks, e.outliers & ~single), 0.0
    for out in blocks if len(blocks) <= settings.LEFT_OUT else ():
        rest = target([b for b in blocks if b != out], ~single)
        yield rest, rest.worth(e.linear.blocks[out].columns).gain


def gathered(fit: Fit, aside: Rows) -> Rows:
    """(N,) those rows set aside that have others near them in the order of measurement: more than chance puts there."""
    order = in_order(fit.campaign)
    near = np.convolve(aside[order], np.ones(2 * settings.NEAR_IN_ORDER + 1), "same")
    found = np.zeros_like(aside)
    found[order] = near >= settings.FEWEST_ASIDE
    return found & aside


def _at_place(
    observations: Observations,
    place: Discovered,
    sums: _Sums,
    order: NDArray[np.int64],
    sessions: dict[str, Rows],
    places: int,
) -> Iterator[tuple[float, Discovered]]:
    """Yield what the best step, the best run and the best session at a place are worth, and their laws."""
    rows, fewest = len(order), settings.FEWEST_ASIDE + -(-2 * sums.moves.shape[2] // sums.white.shape[1])
    kinds = 3 if len(sessions) > 1 else 2
    inner = np.arange(fewest, rows - fewest + 1)
    steps = np.concatenate([np.column_stack([0 * inner, inner]), np.column_stack([inner, 0 * inner + rows])])
    best = _plainest(sums, steps)
    yield from _told(observations, place, sums, best, order, float(kinds * places * len(inner)))
    best = _plainest(sums, _grid(rows, fewest))
    step = max(rows // settings.EVENT_MARKS, 1)
    while best is not None and step:
        near = best + step * np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)])
        good = (near[:, 0] >= fewest) & (near[:, 1] <= rows - fewest) & (near[:, 1] - near[:, 0] >= fewest)
        better = _plainest(sums, near[good])
        moved = better is not None and not np.array_equal(better, best)
        best, step = (better, step) if moved else (best, step // 2)
    yield from _told(observations, place, sums, best, order, float(kinds * places * len(inner) ** 2))
    tried = float(kinds * places * len(sessions))
    for number, own in sorted(enumerate(sessions.values()), key=lambda item: item[1].sum()):
        if kinds == 3 and fewest <= own.sum() < rows - fewest:
            law = replace(place, quantity="session", shape="apart", marks=(float(number),), labels=tuple(sessions))
            worth = _worth(sums.of_rows(own[order]), tried)
            if worth > 0.0:
                yield worth, replace(law, origin=0.0, span=len(sessions) - 1.0, tried=tried)


def _grid(rows: int, fewest: int) -> Runs:
    """Return runs between marks that are spread evenly, none at either end."""
    marks = np.unique(np.linspace(fewest, rows - fewest, settings.EVENT_MARKS).round().astype(np.int64))
    first, last = np.triu_indices(len(marks), 1)
    runs = np.column_stack([marks[first], marks[last]])
    return runs[runs[:, 1] - runs[:, 0] >= fewest]


def _plainest(sums: _Sums, runs: Runs) -> Runs | None:
    """Return (2,) the run that gains most; ``None`` where there is none."""
    return runs[int(np.argmax(sums.gains(sums.summed[runs[:, 1]] - sums.summed[runs[:, 0]])))] if len(runs) else None


def _worth(gain: float, tried: float) -> float:
    """Return what is left of a gain once the choice among all places and runs, and the law itself, are paid for."""
    return float(gain + np.log(settings.PRIOR_PROBABILITY / (1.0 - settings.PRIOR_PROBABILITY)) - np.log(tried))


def _told(
    observations: Observations, place: Discovered, sums: _Sums, run: Runs | None, order: NDArray[np.int64], tried: float
) -> Iterator[tuple[float, Discovered]]:
    """Yield a run as a law of the clock, and what it is worth; nothing where the rows do not share in it."""
    if run is None:
        return
    rows = np.zeros(len(order), dtype=bool)
    rows[run[0] : run[1]] = True
    worth = _worth(sums.of_rows(rows), tried)
    name = next((name for name in CLOCK if observations.varies(name)), "order")
    clock = quantity(observations, name)
    if worth <= 0.0 or clock is None:
        return
    ordered = clock[order]
    ends = [0.5 * (ordered[k - 1] + ordered[k]) for k in run if 0 < k < len(order)]
    if len(ends) > 1 and ends[0] == ends[1]:
        return  # all of it at one time
    law = replace(place, quantity=name, shape="step" if len(ends) == 1 else "run", marks=tuple(map(float, ends)))
    law = replace(law, origin=float(clock.min()), span=float(np.ptp(clock)), unit=unit(observations.robot, name))
    yield worth, replace(law, tried=tried)
