"""Tell whether the residual is noise: tests with Bonferroni correction; where it enters and what it follows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtrc, chdtrc, chdtri, fdtrc, fdtri, gammaln, ndtr, pdtr

from thermal_robot.arrays import Array
from thermal_robot.diagnosis.values import Dependence, Location, Unexplained
from thermal_robot.effects.effect import in_words
from thermal_robot.effects.quantities import quantities
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import orthonormal, without
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.laws import harmonics, smooth_columns
from thermal_robot.inference.robust import distance_limit
from thermal_robot.inference.rows import in_a_row, in_order
from thermal_robot.inference.target import Target, Worth
from thermal_robot.observations import Observations
from thermal_robot.percents import percent


@dataclass(frozen=True, eq=False)
class Remainder:
    """Residual of the rows that are no outliers, in units of the estimated noise, all fitted columns projected out."""

    rows: NDArray[np.int64]
    target: Target

    @property
    def white(self) -> Array:
        """(N, m) residual over the noise."""
        return self.target.white.reshape(len(self.rows), -1)

    @property
    def freedom(self) -> int:
        """Degrees of freedom: equations less fitted columns."""
        return self.target.freedom

    @property
    def scale2(self) -> float:
        """Sum of squares over the degrees of freedom, in squares of the noise."""
        return float((self.white**2).sum() / self.freedom)

    def some(self, count: int) -> Remainder:
        """Return a random subset of rows with the fitted columns projected out again; all rows if there are fewer."""
        if len(self.rows) <= count:
            return self
        drawn = np.sort(np.random.default_rng(settings.TEST_SEED).choice(len(self.rows), count, replace=False))
        m = self.white.shape[1]
        basis, _ = np.linalg.qr(self.target.basis.reshape(len(self.rows), m, -1)[drawn].reshape(count * m, -1))
        white = without(self.white[drawn].ravel(), basis)
        return Remainder(self.rows[drawn], Target(white, self.target.root[drawn], basis))


def remainder(fit: Fit) -> Remainder:
    """Return the residual of a fit of frames and effects without priors, so that tests on it are exact."""
    e = fit.explanation
    rows = np.flatnonzero(~e.outliers)
    columns = [e.linear.frames[rows]]
    for b in e.best.blocks:
        columns.append(e.linear.blocks[b].columns[rows] * e.linear.blocks[b].sizes)
    root = np.broadcast_to(1.0 / e.whitening.sigma(rows), (len(rows), len(e.whitening.noise)))
    design = np.concatenate(columns, axis=2) * root[:, :, None]
    basis = orthonormal(design.reshape(root.size, design.shape[2]))
    # of the exact model, not the linear one: where effects are large and noise is small they differ
    gap = (fit.corrected.gap[rows] * root).ravel()
    return Remainder(rows, Target(without(gap, basis), root, basis))


@dataclass(frozen=True)
class Repeats:
    """Noise from near-repeats: number of pairs, mean square over the estimated noise², sigma of position, m."""

    pairs: int
    scale2: float
    position: float


def repeats(fit: Fit, left: Remainder) -> Repeats | None:
    """Estimate the noise from pairs of nearest commands within ``settings.NEAR``; ``None`` with too few pairs."""
    q = fit.campaign.q[left.rows]
    distance, neighbour = nearest(q, 1)
    close = np.flatnonzero(distance[:, 0] < settings.NEAR)
    pairs = np.unique(np.sort(np.column_stack([close, neighbour[close, 0]]), axis=1), axis=0)
    # the remainder of both: their commands may differ by a little, and their conditions by much
    difference = left.white[pairs[:, 0]] - left.white[pairs[:, 1]]
    if len(pairs) < settings.FEWEST_PAIRS:
        return None
    place = (difference[:, :3] * fit.explanation.whitening.noise[0]) ** 2 / 2.0
    return Repeats(len(pairs), float((difference**2).mean() / 2.0), float(np.sqrt(place.mean())))


def nearest(points: Array, count: int) -> tuple[Array, NDArray[np.int64]]:
    """Return distances and indices (N, count) of the nearest other points; a point is never its own neighbour."""
    from scipy.spatial import cKDTree

    distance, number = cKDTree(points).query(points, k=count + 1)
    own = number == np.arange(len(points))[:, None]
    own[~own.any(axis=1), -1] = True  # others at the same place came first: drop the last of them
    shape = (len(points), count)
    return distance[~own].reshape(shape), number[~own].reshape(shape)


def too_many(fit: Fit, left: Remainder) -> tuple[float, str]:
    """Return the p-value that so many rows are gross errors, which are few and do not care for pose or load; and why.

    Instruments spoil :data:`~thermal_robot.inference.settings.SPOILT` of the rows at most. Where the tails of the other
    rows are heavier than normal, the share that Student's law sets aside is added.
    """
    aside = fit.explanation.outliers
    count, samples = int(aside.sum()), len(aside)
    share = settings.SPOILT + (_of_tails(left, samples) if _heavy(left) else 0.0)
    if count <= share * samples:
        return 1.0, ""
    p = float(bdtrc(count - 1, samples, share))
    told = f"{count} of {samples} rows were set aside ({percent(count / samples, 0)})"
    return p, f"{told}: more than gross errors account for"


def _heavy(left: Remainder) -> bool:
    """Tell whether the rows that are left have tails heavier than normal, by their kurtosis."""
    squares = left.white**2
    excess = float((squares**2).mean() / max(float(squares.mean()) ** 2, settings.TINY)) - 3.0
    # variance of the kurtosis of a normal sample: 24/n
    return excess > settings.HEAVY_SIGMAS * float(np.sqrt(24 / squares.size))


def _of_tails(left: Remainder, samples: int) -> float:
    """Share of the rows that are set aside where noise has a multivariate Student law of the same median distance."""
    measures = left.white.shape[1]
    normal, student = float(chdtri(measures, 0.5)) / measures, float(fdtri(measures, settings.TAILS, 0.5))
    limit = distance_limit(measures, samples) / measures
    return float(fdtrc(measures, settings.TAILS, limit * student / normal))


def alike(fit: Fit) -> tuple[float, str]:
    """Return the p-value that the rows set aside have nothing in common, and the reason.

    Asked is for each quantity whether they lie together: beyond a value, or between two. Given that the ends of such a
    range are rows set aside, how many of the others lie within has a hypergeometric law where rows are set aside
    whatever their quantity. Both the ranges and the quantities are counted (Bonferroni).
    """
    aside = fit.explanation.outliers
    count, samples = int(aside.sum()), len(aside)
    if count < settings.FEWEST_ASIDE or samples - count < count:
        return 1.0, ""
    asked = _asked(fit.corrected)
    found = {name: together(values, aside) for name, values in asked.items()}
    name = min(found, key=lambda n: found[n])
    p = min(1.0, found[name] * len(asked))
    return p, f"the {count} rows that were set aside are no gross errors: they lie together in {name}"


def together(values: Array, aside: NDArray[np.bool_]) -> float:
    """Return the p-value, all ranges counted, that the rows set aside lie together in a quantity (N,) by chance."""
    own = np.sort(values[aside])
    count, samples = len(own), len(values)
    ordered = np.sort(values)
    marks = own[np.unique(np.linspace(0, count - 1, min(count, settings.ASIDE_MARKS)).round().astype(int))]
    # a quantity that takes few values has many rows at each: an end includes all of them
    below, up_to = np.searchsorted(ordered, marks, "left"), np.searchsorted(ordered, marks, "right")
    before, until = np.searchsorted(own, marks, "left"), np.searchsorted(own, marks, "right")
    first, last = np.triu_indices(len(marks), 1)
    low = _tail(until - 1, count - 1, up_to - 1, samples - 1)
    high = _tail(count - before - 1, count - 1, samples - below - 1, samples - 1)
    inside = _tail(until[last] - before[first] - 2, count - 2, up_to[last] - below[first] - 2, samples - 2)
    ranges = 0.5 * count * (count - 1) + 2.0 * count
    return float(min(1.0, ranges * min(low.min(), high.min(), inside.min(initial=1.0))))


def _tail(held: NDArray[np.int64], drawn: int, good: NDArray[np.int64], total: int) -> Array:
    """Probability that of ``drawn`` of ``total`` rows at least ``held`` are among ``good`` ones (hypergeometric)."""
    k = np.arange(drawn + 1)[:, None]
    possible = (k <= good) & (drawn - k <= total - good)
    log = _choose(good, np.minimum(k, good)) + _choose(total - good, np.clip(drawn - k, 0, total - good))
    chance = np.where(possible & (k >= held), np.exp(log - _choose(np.array(total), np.array(drawn))), 0.0)
    return np.asarray(np.minimum(chance.sum(axis=0), 1.0))


def _choose(total: NDArray[np.int64], some: NDArray[np.int64]) -> Array:
    """Natural logarithm of the number of ways to take some of a total."""
    return np.asarray(gammaln(total + 1.0) - gammaln(some + 1.0) - gammaln(total - some + 1.0))


def _asked(observations: Observations) -> dict[str, Array]:
    """Return by name, in words, what rows may be set aside for: all quantities, torques, and approach times torque.

    The last tells where a joint is pressed against the side from which it came, and where against the other.
    """
    found = quantities(observations)
    if observations.torque is None:
        return found
    for joint, torque in zip(observations.robot.joint_names, observations.torque.T, strict=True):
        approach = observations.covariates.get(f"approach.{joint}")
        if np.ptp(torque) > settings.ROUNDING:
            found.setdefault(f"torque.{joint}", torque)
            if approach is not None:
                found[f"approach.{joint} × torque.{joint}"] = approach * torque
    return found


@dataclass(frozen=True)
class Examined:
    """Whether the residual is noise, and where it enters and what it follows.

    ``floor``: one sigma per axis of instrument and repeatability together, m, by its ``source``: ``stated``,
    ``repeats``, ``scatter`` or ``remainder``.
    """

    unexplained: Unexplained
    floor: float
    source: str


def examine(fit: Fit, progress: Callable[[str], None] = lambda _: None) -> Examined:
    """Test whether the residual is noise.

    The tests are its size against the stated noise, lack of fit against repeats, correlation of neighbours, smooth laws
    of recorded quantities, and whether the rows set aside are too many, follow each other, or have something in common.
    Only the first asks for more than the stated noise by a margin. Rows set aside count in the unexplained rms where
    they are no gross errors.
    """
    e, left = fit.explanation, remainder(fit)
    stated, again = fit.campaign.noise_position, repeats(fit, left)
    rms = float(
        np.sqrt(
            3.0 * (left.white[:, :3] ** 2).sum() * e.whitening.noise[0] ** 2 / (left.freedom * 3 / left.white.shape[1])
        )
    )
    if stated is not None:
        floor, source = stated, "stated"
    elif again is not None:
        floor, source = again.position, "repeats"
    else:
        floor, source = rms / np.sqrt(3.0), "remainder"
    progress("remainder: size and neighbours")
    near, likeness = _neighbours(fit, left)
    progress("remainder: places and quantities")
    law, locations, depends, share = _scan(fit, left)
    rest = [_too_large(fit, left), _lack_of_fit(left, again), near, law]
    aside = [_in_a_row(fit), too_many(fit, left), alike(fit)]
    count = len(rest) + len(aside)
    p_value = min(1.0, count * min(p for p, _ in (*rest, *aside)))
    told, of_aside = (tuple(reason for p, reason in tests if count * p < settings.LEVEL) for tests in (rest, aside))
    flagged = bool(told or of_aside) and rms > settings.ROUNDING
    if not flagged:
        return Examined(Unexplained(False, 0.0, p_value), floor, source)
    likeness = min(max(likeness, share, 0.0), 1.0)
    # what neighbours or a law have in common is no noise, however small beside the stated one
    beyond2 = max(rms**2 - 3.0 * floor**2, likeness * rms**2)
    if source == "remainder":
        # nothing tells the noise but the remainder itself: at most what neighbours do not have in common, if that
        floor, beyond2 = floor * float(np.sqrt(1.0 - likeness)), rms**2
    if of_aside:
        every2 = float((fit.corrected.gap[:, :3] ** 2).sum(axis=1).mean())
        beyond2 = max(beyond2, every2 - 3.0 * floor**2)
    # what the rest follows is said only where the rest is no noise
    followed = (locations, depends) if told else ((), ())
    return Examined(
        Unexplained(True, float(np.sqrt(beyond2)), p_value, (*told, *of_aside), *followed), float(floor), source
    )


def _too_large(fit: Fit, left: Remainder) -> tuple[float, str]:
    """Chi-square test of the residual against the stated noise; heavy tails reduce the degrees of freedom."""
    noise, worst = fit.explanation.whitening.noise, (1.0, "")
    stated = (fit.campaign.noise_position, fit.campaign.noise_orientation)
    for part, sigma in enumerate(stated[: left.white.shape[1] // 3]):
        if sigma is None:
            continue
        white = left.white[:, 3 * part : 3 * part + 3] * (noise[3 * part] / sigma)
        freedom = left.freedom * 3.0 / left.white.shape[1]
        ratio2 = float((white**2).sum() / freedom)
        tails = max(float((white**4).mean() / (white**2).mean() ** 2) - 1.0, 2.0)
        effective = freedom * 2.0 / tails
        p = float(chdtrc(effective, ratio2 * effective))
        what = "position" if part == 0 else "orientation"
        if p < worst[0] and ratio2 > settings.MATERIAL_SCALE**2:
            worst = (p, f"what remains in {what} is {np.sqrt(ratio2):.2g} times the stated noise")
    return worst


def _lack_of_fit(left: Remainder, again: Repeats | None) -> tuple[float, str]:
    """F test of the residual against the differences of near-repeats (lack of fit)."""
    if again is None:
        return 1.0, ""
    m = left.white.shape[1]
    ratio2 = left.scale2 / max(again.scale2, settings.TINY)
    p = float(fdtrc(left.freedom, again.pairs * m, ratio2))
    if ratio2 < settings.MATERIAL_REPEATS**2:
        return 1.0, ""
    times = np.sqrt(ratio2)
    return p, f"what remains is {times:.2g} times what {again.pairs} pairs of repeated commands differ by"


def _in_a_row(fit: Fit) -> tuple[float, str]:
    """P-value that so many outliers are consecutive by chance, as rows after a change are and gross errors are not."""
    aside = fit.explanation.outliers[in_order(fit.campaign)]
    count, samples = int(aside.sum()), len(aside)
    if count < settings.FEW_ASIDE * samples:
        return 1.0, ""
    follow = int((aside[1:] & aside[:-1]).sum())
    # what chance gives has a Poisson law
    p = 1.0 - float(pdtr(follow - 1, count * (count - 1) / samples)) if follow else 1.0
    together = int(in_a_row(fit.campaign, fit.explanation.outliers).sum())
    return p, f"{together} of the {count} rows that were set aside follow each other: something changed there"


def _neighbours(fit: Fit, left: Remainder) -> tuple[tuple[float, str], float]:
    """Permutation test whether neighbours' residuals are correlated: p-value, reason, and the largest one that is."""
    q = fit.campaign.q[left.rows]
    spread = q.std(axis=0)
    used = spread > settings.ROUNDING
    white = left.white / np.sqrt((left.white**2).mean(axis=0) + settings.TINY)
    white = np.clip(white, -settings.CLIPPED, settings.CLIPPED)
    pairs = []
    if used.any() and len(q) > settings.FEWEST_NEIGHBOURS:
        _, near = nearest(q[:, used] / spread[used], settings.NEIGHBOURS)
        pairs.append(
            ("joint space", np.column_stack([np.repeat(np.arange(len(q)), settings.NEIGHBOURS), near.ravel()]))
        )
    order = np.argsort(np.argsort(in_order(fit.campaign))[left.rows], kind="stable")
    pairs.append(("the order of measurement", np.column_stack([order[:-1], order[1:]])))
    rng = np.random.default_rng(0)
    worst, most = (1.0, ""), 0.0
    for where, pair in pairs:
        statistic = float((white[pair[:, 0]] * white[pair[:, 1]]).sum(axis=1).mean())
        chance = np.empty(settings.SHUFFLES if len(white) < settings.SHUFFLED_ROWS else settings.FEW_SHUFFLES)
        for k in range(len(chance)):
            shuffled = white[rng.permutation(len(white))]
            chance[k] = (shuffled[pair[:, 0]] * shuffled[pair[:, 1]]).sum(axis=1).mean()
        p = float(2.0 * ndtr(-max(statistic - chance.mean(), 0.0) / (chance.std() + settings.TINY)))
        likeness = statistic / white.shape[1]
        if p < settings.LEVEL and likeness > settings.MATERIAL_SHARE:
            most = max(most, likeness)
        if p < worst[0] and likeness > settings.MATERIAL_SHARE:
            worst = (p, f"what remains is alike for neighbours in {where} (correlation {likeness:.2f})")
    return worst, most


@dataclass(frozen=True)
class _Tested:
    """A smooth law of one quantity at one place, and how much of the residual it explains."""

    kind: str
    place: str
    quantity: str
    worth: Worth


def _scan(fit: Fit, left: Remainder) -> tuple[tuple[float, str], tuple[Location, ...], tuple[Dependence, ...], float]:
    """F tests of smooth laws of quantities at places (Bonferroni): p-value, reason, places, quantities, share."""
    all_tests = _tests(fit.corrected, left.some(settings.ENOUGH_REMAINDER))
    tested = sorted((t for t in all_tests if np.isfinite(t.worth.gain)), key=lambda t: -t.worth.gain)
    if not tested:
        return (1.0, ""), (), (), 0.0
    locations = _locations(tested)[: settings.NAMED]
    material = [
        t
        for t in tested
        if t.worth.share > settings.MATERIAL_SHARE and t.worth.p_value * len(tested) < settings.LAW_LEVEL
    ]
    if not material:
        return (1.0, ""), locations, (), 0.0
    depends: dict[str, float] = {}
    for t in material:
        depends.setdefault(t.quantity, min(1.0, t.worth.p_value * len(tested)))
    first = material[0]
    at = in_words("joint", first.place) if first.kind == "joint" else f"the {first.place}"
    reason = f"a law of {first.quantity} at {at} explains {percent(first.worth.share, 0)} of what remains"
    named = tuple(Dependence(q, p) for q, p in list(depends.items())[: settings.NAMED])
    return (depends[first.quantity], reason), locations, named, first.worth.share


def _tests(observations: Observations, left: Remainder) -> Iterator[_Tested]:
    m, names = left.white.shape[1], observations.robot.joint_names
    places = [("joint", name, observations.joint_sensitivity[left.rows, :m, j, None]) for j, name in enumerate(names)]
    places.append(("base", "base", observations.base_sensitivity[left.rows, :m, :]))
    places.append(("tool", "tool", observations.tool_sensitivity[left.rows, :m, :m]))
    laws = {name: smooth_columns(values[left.rows]) for name, values in quantities(observations).items()}
    for kind, place, sensitivity in places:
        # five knots do not follow a wheel that turns more than once
        turns = [(place, _turns(observations, place)[left.rows])] if place in laws else []
        for quantity, law in [*laws.items(), *turns]:
            if not law.shape[1] or (law.shape[1] * sensitivity.shape[2]) > left.freedom // 3:
                continue
            columns = (sensitivity[:, :, :, None] * law[:, None, None, :]).reshape(len(left.rows), m, -1)
            yield _Tested(kind, place, quantity, left.target.worth(columns))


def _locations(tested: Sequence[_Tested]) -> tuple[Location, ...]:
    """Return the places with the posterior probability of the best law at each, largest first."""
    best: dict[tuple[str, str], float] = {}
    for t in tested:
        best[(t.kind, t.place)] = max(best.get((t.kind, t.place), -np.inf), t.worth.gain)
    gains = np.array(list(best.values()))
    weight = np.exp(gains - gains.max())
    found = [Location(kind, place, float(w)) for (kind, place), w in zip(best, weight / weight.sum(), strict=True)]
    return tuple(sorted(found, key=lambda place: -place.share))


def _turns(observations: Observations, joint: str) -> Array:
    """(N, 2k) harmonics of a joint's position."""
    angle = observations.q[:, observations.robot.joint_names.index(joint)]
    return np.column_stack([f(k * angle) for k in harmonics(observations, joint) for f in (np.sin, np.cos)])
