"""The random gap: which joints scatter more than the instrument, anew at each visit or once a commanded pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import gammaln, logsumexp

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.explain import share_of_places

Component = tuple[str, int]  # "visit" or "pose", and the number of a joint

_LOWEST, _HIGHEST = settings.LOG_VARIANCE


@dataclass(frozen=True, eq=False)
class IndependentRows:
    """Remainder as R independent rows: contrasts within each pose and √k times its mean; in units of the noise.

    ``columns`` (R, m, n) are the effects of the joints, of unit mean square by division by ``lever`` (n,); ``repeats``
    (R,) is k for a mean, 0 for a contrast; ``weights`` (R,) those of the log likelihood.
    """

    values: Array
    columns: Array
    repeats: Array
    weights: Array
    lever: Array

    @property
    def contrasts(self) -> int:
        """Number of rows that compare visits of one pose."""
        return int((self.repeats == 0).sum())


def independent_rows(
    values: Array, columns: Array, pose: NDArray[np.int64], weights: Array, freedom: int
) -> IndependentRows:
    """Turn the visits of each pose into independent rows: contrasts among them, and their mean.

    With one Jacobian J for the k visits of a pose, Helmert's contrasts of them have the covariance
    Σ + J Λ_v Jᵀ, and √k times their mean has Σ + J (Λ_v + k Λ_u) Jᵀ (Searle, Casella, McCulloch, *Variance
    Components*, 1992, ch. 3). Parameters that were fitted have shrunk the means; these are enlarged again.
    """
    order = np.argsort(pose, kind="stable")
    _, first, count = np.unique(pose[order], return_index=True, return_counts=True)
    start, size = np.repeat(first, count), np.repeat(count, count)
    values, weights = values[order], weights[order]
    number = np.arange(len(order)) - start
    total = np.cumsum(values, axis=0)
    before = total - values - (total - values)[start]
    contrast = (before - number[:, None] * values) / np.sqrt(np.maximum(number * (number + 1), 1))[:, None]
    mean = (before + values) / np.sqrt(size)[:, None]
    common = np.add.reduceat(columns[order], first) / count[:, None, None]
    weight = np.add.reduceat(weights, first) / count
    later, last = number > 0, number == size - 1
    place = np.repeat(np.arange(len(first)), count)
    fitted = min(freedom / (len(first) * values.shape[1]), 1.0 - 1.0 / settings.MOST_INFLATION)
    stacked = np.concatenate([common[place[later]], common])
    lever = np.sqrt((common**2).mean(axis=(0, 1)))
    return IndependentRows(
        np.concatenate([contrast[later], mean[last] / np.sqrt(1.0 - fitted)]),
        stacked / np.where(lever > 0.0, lever, 1.0),
        np.concatenate([np.zeros(int(later.sum())), count.astype(float)]),
        np.concatenate([weight[place[later]], weight]),
        lever,
    )


@dataclass(frozen=True, eq=False)
class Fitted:
    """The likeliest variances of one set of components, and the log posterior density there (``value``).

    ``logs``: of variances over squares of the noise: instrument (one for every three components), what poses have in
    common from no joint (where there are repeats), then the components; ``spread`` is their covariance. ``covariance``
    (R, m, m) of each row.
    """

    logs: Array
    value: float
    covariance: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Restricted likelihood of rows; ``stated`` says for every three components whether the noise is stated.

    ``tails``: degrees of freedom of Student's law in m dimensions (infinite: normal), of the model's covariance.
    """

    rows: IndependentRows
    stated: tuple[bool, ...]
    tails: float = np.inf

    @property
    def nuisances(self) -> int:
        """Number of variances that every model has."""
        return len(self.stated) + int(self.rows.contrasts > 0)

    def fit(self, components: tuple[Component, ...], start: Array | None = None, held: int | None = None) -> Fitted:
        """Find the largest posterior density by Fisher's scoring on logarithms of variances, one of them held."""
        factor, counted = self._factors(components)
        logs = self._start(len(components)) if start is None else start.copy()
        free = np.arange(len(logs)) != held
        value, slope, information, covariance = self._at(logs, factor, counted)
        for _ in range(settings.SCATTER_STEPS):
            matrix = information[np.ix_(free, free)]
            step = np.zeros_like(logs)
            step[free] = np.clip(np.linalg.solve(matrix, slope[free]), -settings.SCATTER_STEP, settings.SCATTER_STEP)
            step = np.clip(logs + step, _LOWEST, _HIGHEST) - logs
            if held is not None:
                step[held] = 0.0
            promised = float(slope @ step)
            if promised < settings.SCATTER_SETTLED:
                break
            for _ in range(settings.SCATTER_HALVINGS):
                found = self._at(logs + step, factor, counted)
                if found[0] >= value - settings.BETTER:
                    break
                step = step / settings.SCATTER_CUT
            else:
                break
            gain, logs = found[0] - value, logs + step
            value, slope, information, covariance = found
            if gain < settings.SCATTER_SETTLED:
                break
        return Fitted(logs, value, covariance, np.asarray(np.linalg.inv(information), dtype=float))

    def log_widths(self, fitted: Fitted, components: tuple[Component, ...]) -> float:
        """Return the logarithm of posterior over prior width, summed over all variances but the instrument's.

        A priori the logarithm of each is anywhere on the grid. Laplace's width where the data determine it; where they
        but bound it, the mean of the likelihood over the grid, as what is far below the noise is seen by nothing.
        """
        grid, total = np.log(settings.VARIANCE_GRID)[::2], 0.0
        factor, counted = self._factors(components)
        for k in range(len(self.stated), len(fitted.logs)):
            deviation = float(np.sqrt(fitted.spread[k, k]))
            if deviation < settings.BOUNDED and fitted.logs[k] > grid[0]:
                total += np.log(min(np.sqrt(2.0 * np.pi) * deviation / np.ptp(grid), 1.0))
                continue
            others = np.tile(fitted.logs, (len(grid), 1))
            others[:, k] = grid
            values = [self._at(logs, factor, counted)[0] - fitted.value for logs in others]
            total += min(float(logsumexp(values)) - np.log(len(grid)), 0.0)
        return float(total)

    def screen(self, base: Fitted, candidates: tuple[Component, ...]) -> Array:
        """(G, C) posterior density with one more component of each variance of the grid, all else in proportion.

        A component adds a rank-one term to each covariance, so that inverse and determinant follow from those of
        ``base`` (Sherman and Morrison 1950).
        """
        rows = self.rows
        root = np.linalg.cholesky(base.covariance)
        kinds = np.array([kind == "pose" for kind, _ in candidates])
        columns = rows.columns[:, :, [j for _, j in candidates]]
        both = np.linalg.solve(root, np.concatenate([rows.values[:, :, None], columns], axis=2))
        multiple = np.where(kinds, rows.repeats[:, None], 1.0)
        along2 = multiple * np.einsum("rm,rmc->rc", both[:, :, 0], both[:, :, 1:]) ** 2
        length2 = multiple * (both[:, :, 1:] ** 2).sum(axis=1)
        own, w, m = (both[:, :, 0] ** 2).sum(axis=1), rows.weights, rows.values.shape[1]
        parts = len(self.stated)
        result = np.empty((len(settings.VARIANCE_GRID), len(candidates)))
        logdet = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
        for g, variance in enumerate(settings.VARIANCE_GRID):
            distance2 = own[:, None] - variance * along2 / (1.0 + variance * length2)
            scale = np.ones(len(candidates))
            for _ in range(1 if np.isinf(self.tails) else 4):
                pull = self._pull(distance2 / scale, m)
                scale = np.maximum((w[:, None] * pull * distance2).sum(axis=0) / (m * w.sum()), settings.TINY)
            volume = logdet[:, None] + np.log1p(variance * length2) + m * np.log(scale)
            each = self._density(distance2 / scale, volume, m)
            prior = sum(
                self._prior(base.logs[k] + np.log(scale), stated)[0]
                for k, stated in zip(range(parts), self.stated, strict=True)
            )
            result[g] = (w[:, None] * each).sum(axis=0) + prior
        return result

    def _start(self, components: int) -> Array:
        mean2 = np.log(max(float(np.median(self.rows.values**2)) / settings.MEDIAN_SQUARE, settings.ALIAS))
        return np.concatenate(
            [
                np.full(len(self.stated), np.clip(mean2, _LOWEST + 1, _HIGHEST - 4)),
                np.full(self.nuisances - len(self.stated), np.clip(mean2 - 2.0, _LOWEST + 1, _HIGHEST)),
                np.full(components, np.clip(mean2, _LOWEST + 1, _HIGHEST - 2)),
            ]
        )

    def _factors(self, components: tuple[Component, ...]) -> tuple[Array, NDArray[np.bool_]]:
        """Return what adds up to the covariance.

        (R, m, F) columns whose outer products, times the variance of their group, do so; and (groups, F) which of them
        each group counts.
        """
        rows = self.rows
        count, m = rows.values.shape
        often = np.sqrt(rows.repeats)[:, None, None]
        unit = np.broadcast_to(np.eye(m), (count, m, m))
        parts, groups = [unit], [np.repeat(np.arange(m // 3), 3)]
        if rows.contrasts:
            parts.append(unit * often)
            groups.append(np.full(m, m // 3))
        for k, (kind, joint) in enumerate(components):
            column = rows.columns[:, :, joint : joint + 1]
            parts.append(column * often if kind == "pose" else column)
            groups.append(np.array([self.nuisances + k]))
        group = np.concatenate(groups)
        return np.concatenate(parts, axis=2), np.arange(group.max() + 1)[:, None] == group

    def _at(self, logs: Array, factor: Array, counted: NDArray[np.bool_]) -> tuple[float, Array, Array, Array]:
        """Posterior density, its slope, Fisher's information, and the rows' covariances."""
        rows, m = self.rows, self.rows.values.shape[1]
        variance = np.exp(logs)
        member = counted.astype(float)
        turned = np.swapaxes(factor, 1, 2)
        covariance = (factor * (variance @ member)) @ turned
        # a joint that scatters a million times more than the instrument must not make it singular
        size = np.trace(covariance, axis1=1, axis2=2)
        covariance = covariance + (settings.SCATTER_ROUNDING * size)[:, None, None] * np.eye(m)
        inverse = np.linalg.inv(covariance)
        weighted = inverse @ factor
        shared = turned @ weighted
        along = np.einsum("rm,rmf->rf", rows.values, weighted)
        distance2 = np.einsum("rm,rmk,rk->r", rows.values, inverse, rows.values)
        pull = self._pull(distance2, m)
        each = self._density(distance2, np.linalg.slogdet(covariance)[1], m)
        inner = np.diagonal(shared, axis1=1, axis2=2)
        slope = 0.5 * variance * (member @ (rows.weights @ (pull[:, None] * along**2 - inner)))
        squares = np.tensordot(rows.weights, shared**2, axes=1)
        information = 0.5 * np.outer(variance, variance) * (member @ squares @ member.T)
        value = float(rows.weights @ each)
        for k, stated in enumerate(self.stated):
            prior, tilt, bend = self._prior(logs[k], stated)
            value, slope[k], information[k, k] = value + float(prior), slope[k] + tilt, information[k, k] + bend
        information[np.diag_indices(len(logs))] += settings.SCATTER_RIDGE
        return value, slope, information, covariance

    def _prior(self, log: float | Array, stated: bool) -> tuple[Array, float, float]:
        """Inverse χ² of the noise's variance about the stated one, bounded: it may have been stated wrongly."""
        log = np.asarray(log)
        if not stated:
            return np.zeros_like(log), 0.0, 0.0
        held = -0.5 * settings.GIVEN_NOISE_DOF * (log + np.exp(-log) - 1.0)
        if log.ndim or held < -settings.MISTRUST:
            return np.maximum(held, -settings.MISTRUST), 0.0, 0.0
        return (
            held,
            float(-0.5 * settings.GIVEN_NOISE_DOF * (1.0 - np.exp(-log))),
            float(0.5 * settings.GIVEN_NOISE_DOF),
        )

    def _pull(self, distance2: Array, m: int) -> Array:
        if np.isinf(self.tails):
            return np.ones_like(distance2)
        return np.asarray((self.tails + m) / (self.tails - 2.0 + distance2))

    def _density(self, distance2: Array, logdet: Array, m: int) -> Array:
        if np.isinf(self.tails):
            return np.asarray(-0.5 * (distance2 + logdet + m * np.log(2.0 * np.pi)))
        half = 0.5 * (self.tails + m)
        constant = gammaln(half) - gammaln(0.5 * self.tails) - 0.5 * m * np.log(np.pi * (self.tails - 2.0))
        return np.asarray(constant - 0.5 * logdet - half * np.log1p(distance2 / (self.tails - 2.0)))


@dataclass(frozen=True)
class JointScatter:
    """One component: what one joint scatters ``visit`` by visit, or once a commanded ``pose``, the same at its repeats.

    ``sigma`` with its 95 % interval (profile likelihood), rad or m, ``upper`` infinite for a joint that moves nothing;
    ``log_bayes_factor`` of the data alone, beside the chosen ones; ``chosen`` if in the most probable set.
    """

    kind: str
    joint: int
    sigma: float
    lower: float
    upper: float
    log_bayes_factor: float
    chosen: bool


@dataclass(frozen=True, eq=False)
class Scatter:
    """Variance components of a remainder; see :func:`variance_components`.

    ``kinds`` that could be asked for (without repeats ``pose`` alone, the sum of both); ``probability`` of each that
    any joint scatters so, the prior's where nothing can be said; ``noise`` (m,) of the instrument as estimated, m and
    rad; ``common``, standard deviation of what repeats of a pose share from no joint, in units of the stated noise;
    ``log_evidence_noise_only``, values in units of the noise; ``tails``, degrees of freedom of the law that fits: 4, or
    infinite; ``note``, why not everything could be said.
    """

    kinds: tuple[str, ...]
    components: tuple[JointScatter, ...]
    probability: Mapping[str, float]
    noise: Array
    common: float = 0.0
    log_evidence_noise_only: float = 0.0
    tails: float = np.inf
    note: str = ""

    def chosen(self, kind: str) -> tuple[JointScatter, ...]:
        """Return the components of one kind that belong to the most probable set."""
        return tuple(c for c in self.components if c.kind == kind and c.chosen)

    def covariance(self, sensitivity: Array, noise: Array | None = None) -> Array:
        """(N, m, m) covariance of single rows: N = diag(noise²) + Σ_j σ_j² J_j J_jᵀ over the chosen components.

        ``noise`` (m,), or (N, m) where it differs by row, takes the place of the estimated one.
        """
        variance = np.broadcast_to((self.noise if noise is None else noise) ** 2, (len(sensitivity), len(self.noise)))
        result = variance[:, :, None] * np.eye(len(self.noise))
        for c in self.components:
            if c.chosen:
                column = sensitivity[:, : len(self.noise), c.joint] * c.sigma
                result += column[:, :, None] * column[:, None, :]
        return result


def variance_components(
    remainder: Array,
    sensitivity: Array,
    noise: Array,
    pose: NDArray[np.int64] | None = None,
    *,
    stated: bool | Sequence[bool] = True,
    freedom: int = 0,
    weights: Array | None = None,
    start: Sequence[Component] = (),
) -> Scatter:
    """Estimate variance components (REML): how much each joint scatters, and how much the instrument.

    Row i of pose p is r_i = e_i + J_i (u_p + v_i): e is the instrument's noise, v (``visit``) comes anew at each visit
    and u (``pose``) once a commanded pose. Variances are those of largest restricted likelihood, as far as a common
    factor can restrict it. Evidence of a component is Laplace's in the logarithm of its standard deviation, which
    beforehand is anything between a tenth and a hundred times the noise, so that the bound at zero is infinitely far
    (Kass and Raftery, *Bayes Factors*, 1995, §4.1); BIC would count a joint that hardly moves the target as fully as
    others. Joints are added one by one while the posterior grows; whatever was compared shares the probability. Without
    repeats u and v cannot be told apart: only ``pose`` is asked for. Above 1500 rows, whole poses drawn at random stand
    for all.

    ``remainder`` (N, m), m and rad, m = 3 or 6; ``sensitivity`` (N, m or 6, n), Jacobian of the joints at the target,
    in the same axes; ``noise`` (m,), held near that where ``stated``, for all or for every three components; ``pose``
    (N,), number of the commanded pose; ``freedom``, number of parameters fitted before; ``weights`` (N,), 0 for rows to
    leave out; ``start``, components with which the search begins a second time. Raises :class:`EstimationError` if
    shapes do not fit, values are not finite, or a noise is not positive.
    """
    remainder, sensitivity, noise = (np.asarray(a, dtype=float) for a in (remainder, sensitivity, noise))
    parts = _checked(remainder, sensitivity, noise)
    held = (bool(stated),) * parts if isinstance(stated, (bool, np.bool_)) else tuple(map(bool, stated))
    weights = np.ones(len(remainder)) if weights is None else np.asarray(weights, dtype=float)
    labels = np.arange(len(remainder)) if pose is None else np.unique(pose, return_inverse=True)[1].ravel()
    kept = enough_rows(labels, weights > 0)
    if len(kept) < settings.FEWEST_ROWS:
        note = f"nothing can be said: {len(kept)} rows are fewer than {settings.FEWEST_ROWS}"
        return Scatter((), (), {k: settings.PRIOR_PROBABILITY for k in ("visit", "pose")}, noise, note=note)
    labels = labels[kept]
    if len(kept) - len(np.unique(labels)) < settings.FEWEST_CONTRASTS:
        labels = np.arange(len(kept))
    scale = noise[:, None]
    rows = independent_rows(
        remainder[kept] / noise, sensitivity[kept, : len(noise)] / scale, labels, weights[kept], freedom
    )
    search = _Search(Likelihood(rows, held)).run(start)
    heavy = Likelihood(rows, held, settings.TAILS)
    if heavy.fit(search.chosen).value > search.best.value + settings.WORTH_TAILS:
        search = _Search(heavy).run(start)
    notes = [] if rows.contrasts else ["without repeats, what comes anew at each visit counts as the pose's"]
    if len(kept) < int((weights > 0).sum()):
        notes.append(f"{len(kept)} rows drawn at random stand for all")
    return search.result(noise, "; ".join(notes))


def _checked(remainder: Array, sensitivity: Array, noise: Array) -> int:
    count, m = remainder.shape if remainder.ndim == 2 else (-1, 0)
    fits = m in (3, 6) and sensitivity.ndim == 3 and len(sensitivity) == count and sensitivity.shape[1] >= m
    if not fits or noise.shape != (m,):
        raise EstimationError(
            f"a remainder of shape {remainder.shape} does not fit sensitivities {sensitivity.shape} and noise "
            f"{noise.shape}: expected (N, 3 or 6), (N, m, n) and (m,)"
        )
    if not (np.isfinite(remainder).all() and np.isfinite(sensitivity).all() and (noise > 0.0).all()):
        raise EstimationError("remainder and sensitivity must be finite, and the noise positive")
    return int(noise.size // 3)


def enough_rows(labels: NDArray[np.int64], used: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the numbers of the used rows, or where they are above 1500 those of whole poses drawn at random."""
    rows = np.flatnonzero(used)
    if len(rows) <= settings.SCATTER_ROWS:
        return rows
    poses, number, count = np.unique(labels[rows], return_inverse=True, return_counts=True)
    drawn = np.random.default_rng(0).permutation(len(poses))
    taken = drawn[np.cumsum(count[drawn]) <= settings.SCATTER_ROWS]
    return rows[np.isin(number.ravel(), taken)]


@dataclass(eq=False)
class _Search:
    """Greedy search for the most probable set of components."""

    likelihood: Likelihood
    chosen: tuple[Component, ...] = ()
    fits: dict[frozenset[Component], tuple[Fitted, float, tuple[Component, ...]]] = field(default_factory=dict)

    @property
    def rows(self) -> IndependentRows:
        return self.likelihood.rows

    @property
    def kinds(self) -> tuple[str, ...]:
        return ("visit", "pose") if self.rows.contrasts else ("pose",)

    @property
    def best(self) -> Fitted:
        return self._fit(self.chosen)[0]

    def _fit(self, components: tuple[Component, ...]) -> tuple[Fitted, float, tuple[Component, ...]]:
        """Fit a set once; return it with its log evidence times prior, and the order of its variances."""
        key = frozenset(components)
        if key not in self.fits:
            fitted = self.likelihood.fit(components)
            widths = self.likelihood.log_widths(fitted, components)
            self.fits[key] = fitted, fitted.value + widths + self._prior(components), components
        return self.fits[key]

    def _prior(self, components: tuple[Component, ...]) -> float:
        """Log prior of joints, for each kind: that of an effect of joints (:func:`share_of_places`)."""
        n, at_work, total = self.rows.columns.shape[2], settings.PRIOR_PROBABILITY, 0.0
        for kind in self.kinds:
            joints = sum(k == kind for k, _ in components)
            share = share_of_places(joints, n) + (settings.IN_ALL if joints == n else 0.0)
            total += np.log(at_work * share if joints else 1.0 - at_work)
        return float(total)

    def _candidates(self) -> tuple[Component, ...]:
        seen = np.flatnonzero(self.rows.lever > settings.LEVER_FLOOR * self.rows.lever.max(initial=0.0))
        return tuple((kind, int(j)) for kind in self.kinds for j in seen if (kind, int(j)) not in self.chosen)

    def run(self, start: Sequence[Component] = ()) -> _Search:
        """Climb from nothing, from a start, and where a joint scatters beside too large a noise down from all joints.

        Of one variance alone, what visits have in common may pass for it; several that scatter alike may pass for a
        larger noise, beside which none of them alone brings much.
        """
        within = self._candidates()
        for begin in dict.fromkeys(((), tuple(c for c in start if c in within))):
            self._begun(begin)
        noises = zip(self.best.logs, self.likelihood.stated, strict=False)
        if any(stated and log > 2.0 * np.log(settings.NOISE_SLACK) for log, stated in noises):
            for kind in dict.fromkeys(kind for kind, _ in self.chosen):
                self._begun(tuple(dict.fromkeys([c for c in within if c[0] == kind] + list(self.chosen))))
        return self

    def _begun(self, begin: tuple[Component, ...]) -> None:
        before, self.chosen = self.chosen, begin
        self._climb()
        self.chosen = max(before, self.chosen, key=lambda found: self._fit(found)[1])

    def _climb(self) -> None:
        while len(self.chosen) < settings.MOST_COMPONENTS:
            candidates = self._candidates()
            if not candidates:
                break
            fitted, log_posterior, _ = self._fit(self.chosen)
            gain = self.likelihood.screen(fitted, candidates).max(axis=0) - fitted.value
            likely = [k for k in np.argsort(-gain)[: settings.FULLY_TRIED] if gain[k] > settings.HOPELESS]
            tried = [(*self.chosen, candidates[k]) for k in likely]
            if not tried:
                break
            best = max(tried, key=lambda t: self._fit(t)[1])
            if self._fit(best)[1] <= log_posterior:
                break
            self.chosen = best
        while self._revised():
            pass

    def _revised(self) -> bool:
        """Leave one component out, or move it to the other kind; keep the best of these sets if it is better."""
        others = [tuple(o for o in self.chosen if o != c) for c in self.chosen]
        moved = [(*rest, (k, c[1])) for rest, c in zip(others, self.chosen, strict=True) for k in self.kinds]
        others += [m for m in moved if len(set(m)) == len(m)]
        others += [tuple(c for c in self.chosen if c[0] != kind) for kind in self.kinds]
        best = max([self.chosen, *others], key=lambda o: self._fit(o)[1])
        better = self._fit(best)[1] > self._fit(self.chosen)[1] + settings.ALIAS
        self.chosen = best if better else self.chosen
        return better

    def result(self, noise: Array, note: str) -> Scatter:
        fitted, log_posterior, order = self._fit(self.chosen)
        none, smallest = self._fit(()), np.log(settings.VARIANCE_GRID[0])
        places = {c: k for k, c in enumerate(order, self.likelihood.nuisances) if fitted.logs[k] > smallest}
        candidates = self._candidates()
        screened = (
            self.likelihood.screen(fitted, candidates) if candidates else np.zeros((len(settings.VARIANCE_GRID), 0))
        )
        factors = logsumexp(screened - fitted.value, axis=0) - np.log(len(screened))
        probability = self._probability(candidates, factors)
        components = []
        for kind in self.kinds:
            for j, lever in enumerate(self.rows.lever):
                place = places.get((kind, j))
                if place is not None:
                    ends = np.exp(0.5 * np.array([fitted.logs[place], *self._interval(fitted, order, place)])) / lever
                    rest = tuple(c for c in self.chosen if c != (kind, j))
                    without = self._fit(rest)[1] - self._prior(rest)
                    factor = log_posterior - self._prior(self.chosen) - without
                    components.append(_estimate(kind, j, ends, factor, True))
                elif (kind, j) in candidates:
                    k = candidates.index((kind, j))
                    ends = np.array(_bounds(screened[:, k], fitted.value)) / lever
                    components.append(_estimate(kind, j, ends, factors[k], False))
                else:
                    components.append(JointScatter(kind, j, 0.0, 0.0, np.inf, 0.0, False))
        parts = len(self.likelihood.stated)
        estimated = noise * np.exp(0.5 * np.repeat(fitted.logs[:parts], 3))
        common = float(np.exp(0.5 * fitted.logs[parts])) if self.rows.contrasts else 0.0
        return Scatter(
            self.kinds,
            tuple(components),
            probability,
            estimated,
            common,
            none[1] - self._prior(()),
            self.likelihood.tails,
            note,
        )

    def _probability(self, candidates: tuple[Component, ...], factors: Array) -> dict[str, float]:
        """Share the probability among all sets that were compared, and those with one component more."""
        models = {key: posterior for key, (_, posterior, _) in self.fits.items()}
        own, prior = self._fit(self.chosen)[1], self._prior(self.chosen)
        for candidate, factor in zip(candidates, factors, strict=True):
            larger = (*self.chosen, candidate)
            models.setdefault(frozenset(larger), own + float(factor) + self._prior(larger) - prior)
        total = logsumexp(list(models.values()))
        return {
            kind: min(float(sum(np.exp(p - total) for key, p in models.items() if any(k == kind for k, _ in key))), 1.0)
            for kind in self.kinds
        }

    def _interval(self, fitted: Fitted, order: tuple[Component, ...], place: int) -> tuple[float, float]:
        """Logarithms of the variances at which the profile likelihood has dropped; −∞ where it does not drop."""
        estimate = fitted.logs[place]
        step = settings.SIGMAS_95 * float(np.sqrt(fitted.spread[place, place]))
        if len(self.rows.columns) > settings.NORMAL_ROWS and step < 1.0:
            return estimate - step, estimate + step

        def beyond(log: float) -> float:
            start = fitted.logs.copy()
            start[place] = log
            return fitted.value - self.likelihood.fit(order, start, held=place).value - settings.DROP_95

        ends = []
        for sign in (-1.0, 1.0):
            inner, reach = estimate, step
            while beyond(estimate + sign * reach) < 0.0 and reach < settings.PROFILE_REACH:
                inner, reach = estimate + sign * reach, 2.0 * reach
            outer = estimate + sign * reach
            ends.append(
                float(brentq(beyond, inner, outer, xtol=settings.PROFILE_ROOT))
                if beyond(outer) > 0.0
                else sign * np.inf
            )
        return ends[0], ends[1]


def _estimate(kind: str, joint: int, ends: Array, factor: float, chosen: bool) -> JointScatter:
    return JointScatter(kind, joint, float(ends[0]), float(ends[1]), float(ends[2]), float(factor), chosen)


def _bounds(values: Array, none: float) -> tuple[float, float, float]:
    """Likeliest standard deviation and 95 % interval from the log likelihood on the grid and at zero."""
    logs = np.log(settings.VARIANCE_GRID)
    best = int(np.argmax(values))
    most = max(float(values[best]), none)
    estimate = float(np.exp(0.5 * logs[best])) if values[best] > none else 0.0
    low, high = most - settings.DROP_95, len(logs) - 1
    above = np.flatnonzero(values > low)
    if not len(above):
        return 0.0, 0.0, float(np.exp(0.5 * logs[0]))
    last, first = int(above[-1]), int(above[0])
    upper = np.inf if last == high else np.interp(low, values[[last + 1, last]], logs[[last + 1, last]])
    lower = -np.inf if none > low or not first else np.interp(low, values[[first - 1, first]], logs[[first - 1, first]])
    return estimate, float(np.exp(0.5 * lower)), float(np.exp(0.5 * upper))


def joint_errors(scatter: Scatter, remainder: Array, sensitivity: Array, joint: int) -> tuple[Array, Array]:
    """(N,) error of one joint in each row, rad or m, and its standard deviation from everything else.

    Generalised least squares: (Jᵀ S⁻¹ r) / (Jᵀ S⁻¹ J) with S of the noise and the other chosen components.
    """
    apart = [c for c in scatter.components if c.joint != joint]
    others = Scatter(scatter.kinds, tuple(apart), scatter.probability, scatter.noise)
    column = sensitivity[:, : len(scatter.noise), joint]
    weighted = np.linalg.solve(others.covariance(sensitivity), column[:, :, None])[:, :, 0]
    known = (weighted * column).sum(axis=1) + settings.TINY
    return (weighted * remainder).sum(axis=1) / known, 1.0 / np.sqrt(known)
