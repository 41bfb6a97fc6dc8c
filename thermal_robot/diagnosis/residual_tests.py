"""Residual analysis: tests whether the residual is noise, with Bonferroni correction; where it enters, what it follows.

A test is a p-value with the sentence that it fails with.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtrc, betaln, chdtrc, chdtri, fdtrc, fdtri, ndtr, pdtr, softmax

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import Dependence, Location, Unexplained
from thermal_robot.effects.effect import in_words
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import consecutive_outliers, in_order
from thermal_robot.inference.registration import rows_of_artefacts
from thermal_robot.inference.screening import Score, Target, harmonics, smooth_columns
from thermal_robot.inference.weights import distance_limit
from thermal_robot.observables import figures_of_a_row
from thermal_robot.observations import Observations
from thermal_robot.percents import percent


class Outcome(NamedTuple):
    """Result of a test: p-value, sentence if it fails, and the ``share`` of the residual that is not noise."""

    p: float = 1.0
    reason: str = ""
    share: float = 0.0


@dataclass(frozen=True, eq=False)
class Residual:
    """Studentised residual without outliers: divided by the noise, all fitted columns projected out."""

    rows: NDArray[np.int64]
    target: Target

    @property
    def white(self) -> Array:
        """Residual (N, m) divided by the noise, with the fitted columns projected out."""
        return self.target.white.reshape(len(self.rows), -1)

    def some(self, count: int) -> Residual:
        """Random subset of the rows with the fitted columns projected out again; all rows if there are fewer."""
        if len(self.rows) <= count:
            return self
        drawn = np.sort(np.random.default_rng(settings.TEST_SEED).choice(len(self.rows), count, replace=False))
        m = self.white.shape[1]
        basis, _ = np.linalg.qr(self.target.basis.reshape(len(self.rows), m, -1)[drawn].reshape(count * m, -1))
        white = without(self.white[drawn].ravel(), basis)
        return Residual(
            self.rows[drawn],
            Target(white, self.target.root[drawn], basis, round(self.target.unseen * count / len(self.rows))),
        )


def residual(fit: Fit) -> Residual:
    """Least-squares residual of frames and effects without priors, so that tests on it are exact."""
    e = fit.explanation
    rows = np.flatnonzero(~e.outliers)
    own = (e.linear.blocks[b] for b in e.best.blocks)
    columns = [e.linear.frames[rows], *(block.columns[rows] * block.sizes for block in own)]
    root = np.broadcast_to(1.0 / e.whitening.sigma(rows), (len(rows), len(e.whitening.noise)))
    design = np.concatenate(columns, axis=2) * root[:, :, None]
    basis = orthonormal(design.reshape(root.size, design.shape[2]))
    # of the exact model, not the linear one: where effects are large and noise is small they differ
    gap = (fit.corrected.gap[rows] * root).ravel()
    unseen = 0 if e.whitening.seen is None else int((3 - e.whitening.seen[rows]).sum())
    return Residual(rows, Target(without(gap, basis), root, basis, unseen))


@dataclass(frozen=True)
class Repeats:
    """Pure error from near-repeats: number of pairs and of their figures, and mean square over the estimated noise².

    ``position`` is one sigma of position, m; ``kinds`` that of each kind of measurement with enough pairs of its own.
    """

    pairs: int
    figures: float
    scale2: float
    position: float
    kinds: Mapping[str, float]


def repeats(fit: Fit, left: Residual) -> Repeats | None:
    """Pure error from pairs of nearest commands within ``settings.NEAR``; ``None`` with too few pairs.

    Both rows of a pair are of one kind of measurement, and of one artefact: only these see the same of an error.
    """
    found, of_kind = [np.empty((0, 2), dtype=np.int64)], list[str]()
    for observable, rows in rows_of_artefacts(fit.campaign):
        some = np.flatnonzero(np.isin(left.rows, rows))
        if len(some) > 1:
            found.append(some[_pairs(fit.campaign.q[left.rows[some]])])
            of_kind += [observable.kind] * len(found[-1])
    pairs, e = np.concatenate(found), fit.explanation
    if len(pairs) < settings.FEWEST_PAIRS:
        return None
    # the residuals of both: their commands may differ by a little, and their conditions by much
    half = (left.white[pairs[:, 0]] - left.white[pairs[:, 1]]) ** 2 / 2.0
    every = (
        np.full((len(left.rows), half.shape[1] // 3), 3) if e.whitening.seen is None else e.whitening.seen[left.rows]
    )
    seen = every[pairs[:, 0]]
    sigma = np.broadcast_to(e.whitening.sigma(left.rows), left.white.shape)[pairs[:, 0], :3]
    kinds = {}
    for kind in dict.fromkeys(of_kind):
        mine = np.array(of_kind) == kind
        if mine.sum() >= settings.FEWEST_PAIRS:
            kinds[kind] = float(np.sqrt((half[mine, :3] * sigma[mine] ** 2).sum() / seen[mine, 0].sum()))
    place = float(half[:, :3].sum() / seen[:, 0].sum()) * e.whitening.noise[0] ** 2
    figures = float(seen.sum())
    return Repeats(len(pairs), figures, float(half.sum()) / figures, float(np.sqrt(place)), kinds)


def _pairs(q: Array) -> NDArray[np.int64]:
    """Pairs (P, 2) of commands (N, n), each with its nearest within ``settings.NEAR``, as row numbers."""
    distance, neighbour = nearest(q, 1)
    close = np.flatnonzero(distance[:, 0] < settings.NEAR)
    return np.unique(np.sort(np.column_stack([close, neighbour[close, 0]]), axis=1), axis=0)


def nearest(points: Array, count: int) -> tuple[Array, NDArray[np.int64]]:
    """Distances and indices (N, count) of the nearest neighbours, without the point itself."""
    from scipy.spatial import cKDTree

    distance, number = cKDTree(points).query(points, k=count + 1)
    own = number == np.arange(len(points))[:, None]
    own[~own.any(axis=1), -1] = True  # others at the same place came first: drop the last of them
    shape = (len(points), count)
    return distance[~own].reshape(shape), number[~own].reshape(shape)


@dataclass(frozen=True)
class ResidualAnalysis:
    """Residual analysis: whether the residual is noise, where it enters and what it follows.

    ``floor``: one sigma per axis of instrument and repeatability together, m, by its ``source``: ``stated``,
    ``repeats``, ``scatter`` or ``remainder``; ``kinds``: that of a kind of measurement whose own repeats tell it.
    """

    unexplained: Unexplained
    floor: float
    source: str
    kinds: Mapping[str, float] = field(default_factory=dict)


def analyse_residual(fit: Fit, progress: Callable[[str], None] = lambda _: None) -> ResidualAnalysis:
    """Residual analysis of a fit: several tests for noise with Bonferroni correction.

    The tests are its size against the stated noise, lack of fit against repeats, correlation of neighbours, smooth laws
    of recorded quantities, and whether the rows set aside are too many, follow each other, or have something in common.
    Only the first has a margin over the stated noise. Outliers count in the unexplained rms unless they are gross
    errors.
    """
    left, noise = residual(fit), float(fit.explanation.whitening.noise[0])
    again, (places, figures) = repeats(fit, left), figures_of_a_row(fit.campaign)
    rms = noise * float(np.sqrt(figures * (left.white[:, :3] ** 2).sum() / left.target.freedom))
    of_repeats = again.position if again else None
    known = {"stated": fit.campaign.noise_position, "repeats": of_repeats, "remainder": rms / float(np.sqrt(places))}
    source, floor = next((name, sigma) for name, sigma in known.items() if sigma is not None)
    kinds = again.kinds if again and source == "repeats" else {}
    progress("remainder: size and neighbours")
    rest = [_too_large(fit, left), _lack_of_fit(left, again), _autocorrelation(fit, left)]
    progress("remainder: places and quantities")
    law, locations, depends = _laws(fit, left)
    rest, aside = [*rest, law], [_in_a_row(fit), too_many(fit, left), alike(fit)]
    count = len(rest) + len(aside)
    p_value = min(1.0, count * min(test.p for test in (*rest, *aside)))
    told, of_aside = (tuple(t.reason for t in tests if count * t.p < settings.LEVEL) for tests in (rest, aside))
    if not (told or of_aside) or rms <= settings.ROUNDING:
        return ResidualAnalysis(Unexplained(False, 0.0, p_value), floor, source, kinds)
    likeness = min(max(test.share for test in rest), 1.0)
    # what neighbours or a law have in common is no noise, however small beside the stated one
    beyond2 = max(rms**2 - places * floor**2, likeness * rms**2)
    if source == "remainder":
        # nothing tells the noise but the residual itself: at most what neighbours do not have in common, if that
        floor, beyond2 = floor * float(np.sqrt(1.0 - likeness)), rms**2
    if of_aside:
        beyond2 = max(beyond2, float((fit.corrected.gap[:, :3] ** 2).sum(axis=1).mean()) - places * floor**2)
    # what the rest follows is said only where the rest is no noise
    followed = (locations, depends) if told else ((), ())
    left_over = Unexplained(True, float(np.sqrt(beyond2)), p_value, (*told, *of_aside), *followed)
    return ResidualAnalysis(left_over, floor, source, kinds)


def _too_large(fit: Fit, left: Residual) -> Outcome:
    """Chi-square test of the residual against the stated noise; heavy tails reduce the degrees of freedom."""
    found, noise, measures = [Outcome()], fit.explanation.whitening.noise, left.white.shape[1]
    stated = {"position": fit.campaign.noise_position, "orientation": fit.campaign.noise_orientation}
    freedom = left.target.freedom * 3.0 / measures
    for what, start in zip(stated, range(0, measures, 3), strict=False):
        if (sigma := stated[what]) is not None:
            white = left.white[:, start : start + 3] * (noise[start] / sigma)
            ratio2 = float((white**2).sum() / freedom)
            effective = freedom * 2.0 / max(float((white**4).mean() / (white**2).mean() ** 2) - 1.0, 2.0)
            if ratio2 > settings.MATERIAL_SCALE**2:
                told = f"what remains in {what} is {np.sqrt(ratio2):.2g} times the stated noise"
                found.append(Outcome(float(chdtrc(effective, ratio2 * effective)), told))
    return min(found, key=lambda test: test.p)


def _lack_of_fit(left: Residual, again: Repeats | None) -> Outcome:
    """F test of the residual against the differences of near-repeats (lack of fit)."""
    if again is None:
        return Outcome()
    ratio2 = float((left.white**2).sum()) / left.target.freedom / max(again.scale2, settings.TINY)
    if ratio2 < settings.NOISE_SLACK**2:
        return Outcome()
    p = float(fdtrc(left.target.freedom, again.figures, ratio2))
    times = f"{np.sqrt(ratio2):.2g} times"
    return Outcome(p, f"what remains is {times} what {again.pairs} pairs of repeated commands differ by")


def _autocorrelation(fit: Fit, left: Residual) -> Outcome:
    """Permutation test of the residual's correlation between neighbours in joint space, and in order of measurement."""
    q = fit.campaign.q[left.rows]
    q = q[:, q.std(axis=0) > settings.ROUNDING]
    white = left.white / np.sqrt((left.white**2).mean(axis=0) + settings.TINY)
    white = np.clip(white, -settings.CLIPPED, settings.CLIPPED)
    pairs = {}
    if q.size and len(q) > settings.FEWEST_NEIGHBOURS:
        near = nearest(q / q.std(axis=0), settings.NEIGHBOURS)[1]
        pairs["joint space"] = np.repeat(np.arange(len(q)), settings.NEIGHBOURS), near.ravel()
    order = np.argsort(np.argsort(in_order(fit.campaign))[left.rows], kind="stable")
    pairs["the order of measurement"] = order[:-1], order[1:]
    rng, found = np.random.default_rng(0), [Outcome()]
    shuffles = settings.SHUFFLES if len(white) < settings.SHUFFLED_ROWS else settings.FEW_SHUFFLES
    for where, (one, other) in pairs.items():
        orders = (np.arange(len(white)), *(rng.permutation(len(white)) for _ in range(shuffles)))
        statistic, *chance = [float((white[o[one]] * white[o[other]]).sum(axis=1).mean()) for o in orders]
        p = float(2.0 * ndtr(-max(statistic - float(np.mean(chance)), 0.0) / (np.std(chance) + settings.TINY)))
        likeness = statistic / white.shape[1]
        if likeness > settings.MATERIAL_SHARE:
            told = f"what remains is alike for neighbours in {where} (correlation {likeness:.2f})"
            found.append(Outcome(p, told, likeness if p < settings.LEVEL else 0.0))
    return min(found, key=lambda test: test.p)._replace(share=max(test.share for test in found))


class LawTest(NamedTuple):
    """F test of a smooth law of one quantity at one place, with the share of the residual that it explains."""

    place: tuple[str, str]
    quantity: str
    score: Score


def _laws(fit: Fit, left: Residual) -> tuple[Outcome, tuple[Location, ...], tuple[Dependence, ...]]:
    """F tests of smooth laws of quantities at places (Bonferroni); places and quantities, most probable first."""
    every = _smooth_laws(fit.corrected, left.some(settings.ENOUGH_REMAINDER))
    tested = sorted((law for law in every if np.isfinite(law.score.gain)), key=lambda law: -law.score.gain)
    if not tested:
        return Outcome(), (), ()
    best: dict[tuple[str, str], float] = {}
    depends: dict[str, tuple[float, LawTest]] = {}
    for law in tested:
        best.setdefault(law.place, law.score.gain)
        p = law.score.p_value * len(tested)
        if law.score.share > settings.MATERIAL_SHARE and p < 2.0 * settings.INTERVAL[0]:
            depends.setdefault(law.quantity, (min(1.0, p), law))
    # posterior probability of the best law at each place
    shares = zip(best, softmax(list(best.values())), strict=True)
    locations = tuple(Location(*place, float(share)) for place, share in shares)[: settings.NAMED]
    if not depends:
        return Outcome(), locations, ()
    p, first = next(iter(depends.values()))
    kind, name = first.place
    at = in_words("joint", name) if kind == "joint" else f"the {name}"
    told = f"a law of {first.quantity} at {at} explains {percent(first.score.share, 0)} of what remains"
    followed = tuple(Dependence(quantity, p) for quantity, (p, _) in depends.items())[: settings.NAMED]
    return Outcome(p, told, first.score.share), locations, followed


def _smooth_laws(observations: Observations, left: Residual) -> Iterator[LawTest]:
    m, names = left.white.shape[1], observations.robot.joint_names
    moves = {("joint", name): observations.joint_sensitivity[left.rows, :m, j, None] for j, name in enumerate(names)}
    moves["base", "base"] = observations.base_sensitivity[left.rows, :m, :]
    moves["tool", "tool"] = observations.tool_sensitivity[left.rows, :m, :m]
    smooth = [(name, smooth_columns(values[left.rows])) for name, values in quantities(observations).items()]
    for place, sensitivity in moves.items():
        laws = list(smooth)
        if place[1] in dict(smooth):  # five knots do not follow a wheel that turns more than once
            angle = observations.q[left.rows, names.index(place[1])]
            waves = [f(k * angle) for k in harmonics(observations, place[1]) for f in (np.sin, np.cos)]
            laws.append((place[1], np.column_stack(waves)))
        for quantity, law in laws:
            if law.shape[1] and law.shape[1] * sensitivity.shape[2] <= left.target.freedom // 3:
                columns = (sensitivity[:, :, :, None] * law[:, None, None, :]).reshape(len(left.rows), m, -1)
                yield LawTest(place, quantity, left.target.score(columns))


def _in_a_row(fit: Fit) -> Outcome:
    """Poisson test of the number of consecutive outliers: a change gives runs of them, gross errors do not."""
    aside = fit.explanation.outliers[in_order(fit.campaign)]
    count, samples = int(aside.sum()), len(aside)
    follow = int((aside[1:] & aside[:-1]).sum())
    if count < settings.FEW_ASIDE * samples or not follow:
        return Outcome()
    # what chance gives has a Poisson law
    p = 1.0 - float(pdtr(follow - 1, count * (count - 1) / samples))
    together = int(consecutive_outliers(fit.campaign, fit.explanation.outliers).sum())
    return Outcome(p, f"{together} of the {count} rows that were set aside follow each other: something changed there")


def too_many(fit: Fit, left: Residual) -> Outcome:
    """Binomial test of the number of outliers against the rate of gross errors.

    The rate of gross errors is at most :data:`~thermal_robot.inference.settings.SPOILT`. Where the tails of the other
    rows are heavier than normal, the share that Student's law sets aside is added.
    """
    count, samples = int(fit.explanation.outliers.sum()), len(fit.explanation.outliers)
    share = settings.SPOILT + _share_of_tails(left, samples)
    if count <= share * samples:
        return Outcome()
    told = f"{count} of {samples} rows were set aside ({percent(count / samples, 0)})"
    return Outcome(float(bdtrc(count - 1, samples, share)), f"{told}: more than gross errors account for")


def _share_of_tails(left: Residual, samples: int) -> float:
    """Share of rows beyond the outlier limit under a multivariate Student law; 0 where the kurtosis is normal."""
    squares = left.white**2
    excess = float((squares**2).mean() / max(float(squares.mean()) ** 2, settings.TINY)) - 3.0
    # variance of the kurtosis of a normal sample: 24/n
    if excess <= settings.HEAVY_SIGMAS * float(np.sqrt(24 / squares.size)):
        return 0.0
    m = squares.shape[1]
    # of the same median distance
    normal, student = float(chdtri(m, 0.5)) / m, float(fdtri(m, settings.TAILS, 0.5))
    return float(fdtrc(m, settings.TAILS, distance_limit(m, samples) / m * student / normal))


def alike(fit: Fit) -> Outcome:
    """Scan test whether the outliers cluster in a quantity: beyond a value, or between two.

    Given that a range ends at two outliers, the number of other outliers within is hypergeometric under the null
    hypothesis. Both the ranges and the quantities are counted (Bonferroni).
    """
    aside = fit.explanation.outliers
    count = int(aside.sum())
    if count < settings.FEWEST_ASIDE or len(aside) - count < count:
        return Outcome()
    found = {name: scan_test(values, aside) for name, values in _asked(fit.corrected).items()}
    name = min(found, key=lambda n: found[n])
    told = f"the {count} rows that were set aside are no gross errors: they lie together in {name}"
    return Outcome(min(1.0, found[name] * len(found)), told)


def scan_test(values: Array, aside: NDArray[np.bool_]) -> float:
    """P-value of the scan statistic, corrected for all ranges, of outliers that cluster in a quantity (N,)."""
    own = np.sort(values[aside])
    count, samples = len(own), len(values)
    ordered = np.sort(values)
    marks = own[np.unique(np.linspace(0, count - 1, min(count, settings.ASIDE_MARKS)).round().astype(int))]
    # a quantity that takes few values has many rows at each: an end includes all of them
    below, up_to = np.searchsorted(ordered, marks, "left"), np.searchsorted(ordered, marks, "right")
    before, until = np.searchsorted(own, marks, "left"), np.searchsorted(own, marks, "right")
    first, last = np.triu_indices(len(marks), 1)
    # the ends of a range are rows set aside; of the others so many or more lie within
    low = _tail(until - 1, count - 1, up_to - 1, samples - 1)
    high = _tail(count - before - 1, count - 1, samples - below - 1, samples - 1)
    inside = _tail(until[last] - before[first] - 2, count - 2, up_to[last] - below[first] - 2, samples - 2)
    ranges = 0.5 * count * (count - 1) + 2.0 * count
    return float(min(1.0, ranges * min(low.min(), high.min(), inside.min(initial=1.0))))


def _tail(held: NDArray[np.int64], drawn: int, good: NDArray[np.int64], total: int) -> Array:
    """Hypergeometric upper tail: at least ``held`` of ``drawn`` from ``total`` rows are among the ``good`` ones."""

    def log_choose(n: Any, k: Any) -> Any:
        return -np.log1p(n) - betaln(n - k + 1.0, k + 1.0)

    every = np.arange(drawn + 1)[:, None]
    k = np.clip(every, drawn - (total - good), good)  # what can be
    log = log_choose(good, k) + log_choose(total - good, drawn - k) - log_choose(total, drawn)
    return np.asarray(np.minimum(np.where((k == every) & (k >= held), np.exp(log), 0.0).sum(axis=0), 1.0))


def _asked(observations: Observations) -> dict[str, Array]:
    """Quantities (N,) by name over which outliers may cluster: all recorded, joint torques, approach times torque.

    The product's sign tells whether gravity presses a joint towards the side from which it came.
    """
    found = quantities(observations)
    torques = () if observations.torque is None else observations.torque.T
    for joint, torque in zip(observations.robot.joint_names, torques, strict=False):
        if np.ptp(torque) > settings.ROUNDING:
            found.setdefault(f"torque.{joint}", torque)
            if (approach := observations.covariates.get(f"approach.{joint}")) is not None:
                found[f"approach.{joint} × torque.{joint}"] = approach * torque
    return found
