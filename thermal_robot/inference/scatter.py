"""The random gap: which joints scatter more than the instrument, anew at each visit or once a commanded pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import logsumexp

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.explain import share_of_places
from thermal_robot.inference.scatter_likelihood import Component, Fitted, IndependentRows, Likelihood, independent_rows


@dataclass(frozen=True)
class JointScatter:
    """One component: what one joint scatters.

    Attributes
    ----------
    kind
        ``visit``: anew at each visit; ``pose``: once a commanded pose, the same at its repeats.
    joint
        Its number.
    sigma, lower, upper
        Standard deviation and its 95 % interval (profile likelihood), rad or m; ``upper`` is infinite for a joint that
        moves nothing.
    log_bayes_factor
        Natural logarithm of the odds that the data alone give for it, beside the chosen ones.
    chosen
        Whether it belongs to the most probable set.
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
    """The variance components of a remainder; see :func:`variance_components`.

    Attributes
    ----------
    kinds
        Kinds that could be asked for: without repeats ``pose`` alone, which then stands for the sum of both.
    components
        Every joint of every kind.
    probability
        By kind: posterior probability that any joint scatters so; the prior's where nothing can be said.
    noise
        (m,) one sigma of the instrument, as estimated, m and rad.
    common
        Standard deviation of what repeats of a pose have in common from no joint, in units of the stated noise.
    log_evidence_noise_only
        Of the model without any joint, natural logarithm; values in units of the noise.
    tails
        Degrees of freedom of the law that fits: 4, or infinite for the normal one.
    note
        Why nothing, or not everything, could be said; empty otherwise.
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
    """Estimate variance components: how much each joint scatters, and how much the instrument.

    Row i of pose p is r_i = e_i + J_i (u_p + v_i): e is the instrument's noise, v (``visit``) comes anew at each visit
    and u (``pose``) once a commanded pose. Variances are those of largest restricted likelihood, as far as a common
    factor can restrict it. Evidence of a component is Laplace's in the logarithm of its standard deviation, which
    beforehand is anything between a tenth and a hundred times the noise, so that the bound at zero is infinitely far
    (Kass and Raftery, *Bayes Factors*, 1995, §4.1); BIC would count a joint that hardly moves the target as fully as
    others. Joints are added one by one while the posterior grows; whatever was compared shares the probability.

    Parameters
    ----------
    remainder
        (N, m) what a systematic explanation left, m and rad; m = 3 or 6.
    sensitivity
        (N, m or 6, n) Jacobian of the joints at the target, in the same axes.
    noise
        (m,) the instrument's one sigma.
    pose
        (N,) number of the commanded pose; ``None`` where none was repeated.
    stated
        Whether the noise is stated, and then held near that, or free; one for all or one for every three components.
    freedom
        Number of parameters that were fitted before.
    weights
        (N,) of each row, 0 for rows to leave out.
    start
        Components with which the search begins a second time; those that are not asked for are left out.

    Returns
    -------
    Scatter
        Without repeats u and v cannot be told apart: only ``pose`` is asked for. Above 1500 rows, whole poses drawn
        at random stand for all.

    Raises
    ------
    EstimationError
        If shapes do not fit, values are not finite, or a noise is not positive.
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
