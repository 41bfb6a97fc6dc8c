"""Change points: from one row to another, or in one session, base, tool or a joint's zero stands elsewhere.

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
from thermal_robot.inference.explain import log_odds
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.rows import in_order
from thermal_robot.inference.target import Target, explained_by
from thermal_robot.observations import Observations

Rows = NDArray[np.bool_]
Runs = NDArray[np.int64]
"""(C, 2) first row of each run in the order of measurement, and the first behind it."""


@dataclass(frozen=True, eq=False)
class _Sums:
    """Products of a place's d moves in each row (N, ·), in the order of measurement, and their cumulative sums.

    They are those with each other, with the r columns of the design, and with the residual, of which ``squares`` (N,)
    are the squared lengths; ``total`` and ``freedom`` as of a :class:`~thermal_robot.inference.target.Seat`.
    """

    products: Array
    summed: Array
    squares: Array
    size: tuple[int, int, int]
    total: float
    freedom: int

    @classmethod
    def of(cls, target: Target, moves: Array, order: NDArray[np.int64]) -> _Sums:
        """Sum the moves (N, m, d) of a place over a residual."""
        (rows, m, d), seat = moves.shape, target.seat(moves)
        parts = (seat.weight, seat.design.transpose(2, 0, 1), seat.remainder)
        products = np.concatenate([part.reshape(rows, -1) for part in parts], axis=1)[order]
        summed = np.concatenate([np.zeros((1, products.shape[1])), np.cumsum(products, axis=0)])
        squares = (target.white.reshape(rows, m) ** 2).sum(axis=1)[order]
        return cls(products, summed, squares, (m, d, len(seat.design)), seat.total, seat.freedom)

    @property
    def fewest(self) -> int:
        """Number of rows that a run has at least, and leaves at either end."""
        m, d, _ = self.size
        return settings.FEWEST_ASIDE + -(-2 * d // m)

    def gains(self, sums: Array, total: float, freedom: int) -> Array:
        """(C,) log evidence gained by a move of some rows (:attr:`Worth.gain`), from (C, ·) sums over these rows."""
        (_, d, r), runs = self.size, len(sums)
        whole, design = sums[:, : d * d].reshape(runs, d, d), sums[:, d * d : d * (d + r)].reshape(runs, r, d)
        gram = whole - design.transpose(0, 2, 1) @ design
        explained, rank = explained_by(gram, sums[:, d * (d + r) :], np.einsum("cii->ci", whole))
        rest = np.maximum(total - explained, settings.TINY)
        gain = 0.5 * freedom * np.log(total / rest) - 0.5 * rank * np.log(freedom)
        return np.where((rank == 0) | (freedom - rank < settings.FEWEST_LEFT), -np.inf, gain)

    def best(self, runs: Runs) -> Runs:
        """Return (2,) the run that gains most, or the empty one where there is none."""
        if not len(runs):
            return np.zeros(2, dtype=np.int64)
        sums = self.summed[runs[:, 1]] - self.summed[runs[:, 0]]
        return np.asarray(runs[int(np.argmax(self.gains(sums, self.total, self.freedom)))])

    def best_step(self) -> Runs:
        """Return the best run from the first row, or to the last."""
        rows = len(self.products)
        inner = np.arange(self.fewest, rows - self.fewest + 1)
        steps = [np.column_stack([0 * inner, inner]), np.column_stack([inner, 0 * inner + rows])]
        return self.best(np.concatenate(steps))

    def best_run(self) -> Runs:
        """Return the best run between two changes: between marks that are spread evenly, then by pattern search."""
        rows, least = len(self.products), self.fewest

        def best(runs: Runs) -> Runs:
            inside = (runs[:, 0] >= least) & (runs[:, 1] <= rows - least) & (runs[:, 1] - runs[:, 0] >= least)
            return self.best(runs[inside])

        marks = np.unique(np.linspace(least, rows - least, settings.EVENT_MARKS).round().astype(np.int64))
        run, step = best(marks[np.column_stack(np.triu_indices(len(marks), 1))]), max(rows // settings.EVENT_MARKS, 1)
        while step and run.any():
            near = np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)])
            better = best(run + step * near)
            step = step if (better != run).any() else step // 2
            run = better
        return run

    def shared(self, rows: Rows) -> float:
        """Log evidence gained by a move of rows (N,), or if it is less by it in all but the few that are farthest off.

        In an event all rows share, in gross errors side by side a few.
        """
        few, far = max(int(np.ceil(settings.EVENT_CARRYING * rows.sum())), settings.FEWEST_ASIDE), self.squares * rows
        out = np.argsort(-far)[:few]
        total = max(self.total - float(far[out].sum()), settings.TINY)
        whole = self.products[rows].sum(axis=0)
        less, freedom = whole - self.products[out].sum(axis=0), max(self.freedom - few * self.size[0], 1)
        gain = self.gains(whole[None], self.total, self.freedom)[0]
        return float(min(gain, self.gains(less[None], total, freedom)[0]))


def events(fit: Fit) -> tuple[Discovered, ...]:
    """Events that may be at work in a fit: steps in time, runs, and sessions apart; the plainest first, one a place."""
    if fit.campaign.samples > settings.RIPPLE_ROWS or fit.campaign.samples < settings.FEWEST_WITH_EVENTS:
        return ()
    observations, order = fit.corrected, in_order(fit.campaign)
    turns, joints = fit.campaign.measures == "pose", fit.campaign.robot.joint_names
    plain = Discovered(quantity="none", shape="constant", turns=turns)
    where = [("base", "base"), ("tool", "tool"), *(("joint", joint) for joint in joints)]
    places = [replace(plain, kind=kind, place=place) for kind, place in where]
    moves = [block(observations, place).columns for place in places]
    found: dict[tuple[str, str], tuple[float, Discovered]] = {}
    for target, instead in _targets(fit):
        for place, own in zip(places, moves, strict=True):
            for gain, law in _at_place(observations, place, _Sums.of(target, own, order), order):
                # the choice among all places and runs, and the law itself, are paid for
                law = replace(law, tried=law.tried * len(places))
                worth, key = gain + log_odds() - float(np.log(law.tried)), (law.kind, law.place)
                if worth > 0.0 and worth - instead > found.get(key, (0.0, law))[0]:
                    found[key] = (worth - instead, law)
    return tuple(law for _, law in sorted(found.values(), key=lambda item: -item[0]))


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
    observations: Observations, place: Discovered, sums: _Sums, order: NDArray[np.int64]
) -> Iterator[tuple[float, Discovered]]:
    """Yield what the best step, run and session at a place gain, and their laws, with how many were tried there."""
    rows, labels = len(order), observations.campaign.labels.get("session")
    sessions = {} if labels is None else {str(label): labels == label for label in np.unique(labels)}
    kinds, inner = 3 if len(sessions) > 1 else 2, max(rows - 2 * sums.fewest + 1, 0)
    name = next((name for name in CLOCK if observations.varies(name)), "order")
    clock = np.asarray(quantity(observations, name), dtype=float)
    for run, tried in ((sums.best_step(), inner), (sums.best_run(), inner**2)):
        inside, ordered = np.zeros(rows, dtype=bool), clock[order]
        inside[run[0] : run[1]] = True
        ends = tuple(float(0.5 * (ordered[k - 1] + ordered[k])) for k in run if 0 < k < rows)
        if ends[:1] != ends[1:]:  # there is a run, and not all of it at one time
            law = replace(place, quantity=name, shape="step" if len(ends) == 1 else "run", marks=ends)
            law = replace(
                law, origin=float(clock.min()), span=float(np.ptp(clock)), unit=unit(observations.robot, name)
            )
            yield sums.shared(inside), replace(law, tried=float(kinds * tried))
    for number, own in sorted(enumerate(sessions.values()), key=lambda item: item[1].sum()):
        if kinds == 3 and sums.fewest <= own.sum() < rows - sums.fewest:
            law = replace(place, quantity="session", shape="apart", marks=(float(number),), labels=tuple(sessions))
            law = replace(law, origin=0.0, span=len(sessions) - 1.0, tried=float(kinds * len(sessions)))
            yield sums.shared(own[order]), law
