"""Variance components of a residual (REML): scatter of the joints beside the instrument, by visit or by pose.

Errors that follow a smooth law are told apart by F tests, the steps of an encoder by their likelihood ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chdtrc, expit, gammaln, log_ndtr, logsumexp

from thermal_robot.arrays import Array
from thermal_robot.effects.quantities import quantities
from thermal_robot.errors import EstimationError
from thermal_robot.inference import settings
from thermal_robot.inference.algebra import equations_of, solve, total_probability, without
from thermal_robot.inference.explain import share_of_places
from thermal_robot.inference.fit import Fit
from thermal_robot.inference.grouping import repeated_poses
from thermal_robot.inference.problem import Linear, generalised
from thermal_robot.inference.screening import Target, smooth_columns
from thermal_robot.inference.weights import distance_limit
from thermal_robot.observables import of_model

Component = tuple[str, int]
"""Kind of a variance component, drawn per ``visit`` or per commanded ``pose``, and the number of its joint."""
_LOWEST, _HIGHEST = settings.LOG_VARIANCE
_GRID = np.log(settings.VARIANCE_GRID)


@dataclass(frozen=True, eq=False)
class IndependentRows:
    """Residual as R independent rows, in units of the noise: Helmert contrasts within each pose, √k times its mean.

    ``columns`` (R, m, n) are the effects of the joints, of unit mean square by division by ``lever`` (n,); ``repeats``
    (R,) is k for a mean, 0 for a contrast.
    """

    values: Array
    columns: Array
    repeats: Array
    lever: Array

    @property
    def contrasts(self) -> int:
        """Number of contrasts between visits of one pose."""
        return int((self.repeats == 0).sum())


def independent_rows(values: Array, columns: Array, pose: NDArray[np.int64], freedom: int) -> IndependentRows:
    """Helmert transform of the visits of each pose: contrasts among them, and their mean.

    With one Jacobian J for the k visits of a pose, the contrasts have the covariance Σ + J Λ_v Jᵀ, and √k times their
    mean has Σ + J (Λ_v + k Λ_u) Jᵀ (Searle, Casella, McCulloch, *Variance Components*, 1992, ch. 3). Parameters that
    were fitted (``freedom``) have shrunk the means; these are enlarged again.
    """
    order = np.argsort(pose, kind="stable")
    values = values[order]
    _, first, count = np.unique(pose[order], return_index=True, return_counts=True)
    start = np.repeat(first, count)
    number = (np.arange(len(order)) - start)[:, None]
    before = np.cumsum(values, axis=0) - values
    before = before - before[start]
    contrast = (before - number * values) / np.sqrt(np.maximum(number * (number + 1), 1))
    mean = (before + values)[first + count - 1] / np.sqrt(count)[:, None]
    left = max(1.0 - freedom / mean.size, 1.0 / settings.MOST_INFLATION)
    common = np.add.reduceat(columns[order], first) / count[:, None, None]
    lever = np.sqrt((common**2).mean(axis=(0, 1)))
    return IndependentRows(
        np.concatenate([contrast[number[:, 0] > 0], mean / np.sqrt(left)]),
        np.concatenate([np.repeat(common, count - 1, axis=0), common]) / np.where(lever > 0.0, lever, 1.0),
        np.concatenate([np.zeros(len(order) - len(first)), count]),
        lever,
    )


@dataclass(frozen=True, eq=False)
class Fitted:
    """Posterior mode of the variances of some components, and the log density there (``value``).

    ``logs``: of variances over squares of the noise: the instrument's (one for every three axes), that common to all
    visits of a pose but of no joint (where there are repeats), then the components; ``spread`` is their covariance.
    ``covariance`` (R, m, m) of each row.
    """

    components: tuple[Component, ...]
    logs: Array
    value: float
    covariance: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Restricted likelihood (REML) of rows; ``stated`` says for every three axes whether the noise is stated.

    ``tails``: degrees of freedom of Student's law in m dimensions (infinite: normal), of the model's covariance.
    """

    rows: IndependentRows
    stated: tuple[bool, ...]
    tails: float = np.inf

    @property
    def nuisances(self) -> int:
        """Number of variances in every model beside components: the instrument's, with repeats also that of poses."""
        return len(self.stated) + int(self.rows.contrasts > 0)

    def fit(self, components: tuple[Component, ...], start: Array | None = None, held: int | None = None) -> Fitted:
        """Maximise the posterior density by Fisher scoring in log variances, one of them ``held``."""
        at = self.density(components)
        logs = self._start(len(components)) if start is None else start
        free = np.arange(len(logs)) != held
        value, slope, information, covariance = at(logs)
        for _ in range(settings.EVIDENCE_STEPS):
            step = np.zeros_like(logs)
            step[free] = np.linalg.solve(information[np.ix_(free, free)], slope[free])
            step = np.clip(step, -settings.SCATTER_STEP, settings.SCATTER_STEP)
            step = np.where(free, np.clip(logs + step, _LOWEST, _HIGHEST) - logs, 0.0)
            if slope @ step < settings.SCATTER_SETTLED:
                break
            while (found := at(logs + step))[0] < value - settings.BETTER:
                step = step / settings.SCATTER_CUT
            gain, logs = found[0] - value, logs + step
            value, slope, information, covariance = found
            if gain < settings.SCATTER_SETTLED:
                break
        return Fitted(components, logs, value, covariance, np.asarray(np.linalg.inv(information), dtype=float))

    def density(self, components: tuple[Component, ...]) -> Callable[[Array], tuple[float, Array, Array, Array]]:
        """Return a function of log variances: their log posterior density, its gradient, information, covariances."""
        rows, (factor, member) = self.rows, self._factors(components)
        m, turned = rows.values.shape[1], np.swapaxes(factor, 1, 2)

        def at(logs: Array) -> tuple[float, Array, Array, Array]:
            variance = np.exp(logs)
            covariance = (factor * (variance @ member)) @ turned
            size = np.trace(covariance, axis1=1, axis2=2)
            covariance = covariance + (settings.SCATTER_ROUNDING * size)[:, None, None] * np.eye(m)
            inverse = np.linalg.inv(covariance)
            weighted = inverse @ factor
            shared = turned @ weighted
            along = np.einsum("rm,rmf->rf", rows.values, weighted)
            distance2 = np.einsum("rm,rmk,rk->r", rows.values, inverse, rows.values)
            each, pull = self._law(distance2, np.linalg.slogdet(covariance)[1])
            inner = np.diagonal(shared, axis1=1, axis2=2)
            slope = 0.5 * variance * (member @ (pull[:, None] * along**2 - inner).sum(axis=0))
            information = 0.5 * np.outer(variance, variance) * (member @ (shared**2).sum(axis=0) @ member.T)
            prior, tilt, bend = self._prior(logs[: len(self.stated)])
            slope[: len(tilt)] += tilt
            information[np.diag_indices(len(bend))] += bend
            information[np.diag_indices(len(logs))] += settings.SCATTER_RIDGE
            return float(each.sum() + prior), slope, information, covariance

        return at

    def log_widths(self, fitted: Fitted) -> float:
        """Log ratio of posterior to prior width, summed over all variances but the instrument's.

        The prior of each logarithm is uniform on the grid. Laplace's approximation where the data determine it to a
        factor of e; where they only bound it, the mean of the likelihood over the grid.
        """
        grid, total, at = _GRID[::2], 0.0, self.density(fitted.components)
        for k in range(len(self.stated), len(fitted.logs)):
            deviation = float(np.sqrt(fitted.spread[k, k]))
            if deviation < 1.0 and fitted.logs[k] > grid[0]:
                width = np.sqrt(2.0 * np.pi) * deviation / np.ptp(grid)
                total += min(float(np.log(width)), 0.0)
            else:
                others = np.tile(fitted.logs, (len(grid), 1))
                others[:, k] = grid
                values = [at(logs)[0] - fitted.value for logs in others]
                total += min(float(logsumexp(values)) - np.log(len(grid)), 0.0)
        return float(total)

    def screen(self, base: Fitted, candidates: tuple[Component, ...]) -> Array:
        """Log posterior densities (G, C) with one more component at each variance of a grid, all else in proportion.

        A component adds a rank-one term to each covariance, so that inverse and determinant follow from those of
        ``base`` (Sherman and Morrison 1950).
        """
        rows, m = self.rows, self.rows.values.shape[1]
        root = np.linalg.cholesky(base.covariance)
        columns = rows.columns[:, :, [j for _, j in candidates]]
        both = np.linalg.solve(root, np.concatenate([rows.values[:, :, None], columns], axis=2))
        white, along = both[:, :, 0], both[:, :, 1:]
        multiple = np.where([kind == "pose" for kind, _ in candidates], rows.repeats[:, None], 1.0)
        length2 = settings.VARIANCE_GRID[:, None, None] * multiple * (along**2).sum(axis=1)
        along2 = settings.VARIANCE_GRID[:, None, None] * multiple * np.einsum("rm,rmc->rc", white, along) ** 2
        distance2 = (white**2).sum(axis=1)[:, None] - along2 / (1.0 + length2)
        scale = np.ones((len(_GRID), 1, len(candidates)))
        for _ in range(1 if np.isinf(self.tails) else 4):
            pull = self._law(distance2 / scale, np.zeros(1))[1]
            scale = np.maximum((pull * distance2).mean(axis=1, keepdims=True) / m, settings.TINY)
        logdet = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
        each = self._law(distance2 / scale, logdet[:, None] + np.log1p(length2) + m * np.log(scale))[0]
        prior = self._prior(base.logs[: len(self.stated)] + np.log(scale).transpose(0, 2, 1))[0]
        return np.asarray(each.sum(axis=1) + prior)

    def _start(self, components: int) -> Array:
        mean2 = np.log(max(float(np.median(self.rows.values**2)) / settings.MEDIAN_SQUARE, settings.ALIAS))
        logs = np.clip(mean2 - np.array([0, 2, 0]), _LOWEST + 1, _HIGHEST - np.array([4, 0, 2]))
        return np.repeat(logs, [len(self.stated), self.nuisances - len(self.stated), components])

    def _factors(self, components: tuple[Component, ...]) -> tuple[Array, Array]:
        """Columns (R, m, F) whose outer products, times variances, sum to each row's covariance; and their groups.

        The mask (logs, F) says to which variance each column belongs.
        """
        rows = self.rows
        m, often = rows.values.shape[1], np.sqrt(rows.repeats)[:, None, None]
        unit = np.broadcast_to(np.eye(m), (len(rows.values), m, m))
        parts, groups = [unit], np.arange(m // 3).repeat(3).tolist()
        if rows.contrasts:
            parts.append(unit * often)
            groups += [m // 3] * m
        for k, (kind, joint) in enumerate(components):
            column = rows.columns[:, :, joint : joint + 1]
            parts.append(column * often if kind == "pose" else column)
            groups.append(self.nuisances + k)
        member = np.arange(self.nuisances + len(components))[:, None] == groups
        return np.concatenate(parts, axis=2), member.astype(float)

    def _prior(self, logs: Array) -> tuple[Array, Array, Array]:
        """Log inverse-χ² prior (...) of the noise variances (..., parts) about the stated ones; gradient, information.

        Bounded, as the noise may have been stated wrongly.
        """
        stated, half = np.array(self.stated), 0.5 * settings.GIVEN_NOISE_DOF
        held = -half * (logs + np.exp(-logs) - 1.0)
        near = stated & (held >= -settings.MISTRUST)
        value = np.where(stated, np.maximum(held, -settings.MISTRUST), 0.0).sum(axis=-1)
        return value, np.where(near, -half * (1.0 - np.exp(-logs)), 0.0), np.where(near, half, 0.0)

    def _law(self, distance2: Array, logdet: Array) -> tuple[Array, Array]:
        """Log density of squared distances (normal or Student's t), and each row's weight in the gradient."""
        m, dof = self.rows.values.shape[1], self.tails
        if np.isinf(dof):
            return -0.5 * (distance2 + logdet + m * np.log(2.0 * np.pi)), np.ones_like(distance2)
        half = 0.5 * (dof + m)
        constant = gammaln(half) - gammaln(0.5 * dof) - 0.5 * m * np.log(np.pi * (dof - 2.0))
        log = constant - 0.5 * logdet - half * np.log1p(distance2 / (dof - 2.0))
        return log, (dof + m) / (dof - 2.0 + distance2)


@dataclass(frozen=True)
class JointScatter:
    """Standard deviation of one joint's scatter, drawn anew at each ``visit`` or once a commanded ``pose``.

    ``sigma`` with its 95 % interval (profile likelihood), rad or m.
    """

    kind: str
    joint: int
    sigma: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Scatter:
    """Variance components of a residual; see :func:`variance_components`.

    ``kinds`` that could be asked for (without repeats ``pose`` alone, the sum of both); ``components`` of the most
    probable set; ``probability`` of each kind that any joint scatters so, the prior's where nothing can be said;
    ``noise`` (m,) of the instrument as estimated, ``common`` (m,) that of what visits of a pose share from no joint, m
    and rad; ``log_factors`` of the data for one more component; ``tails``, degrees of freedom of the law that fits: 4,
    or infinite; ``note``, why not everything could be said.
    """

    kinds: tuple[str, ...]
    components: tuple[JointScatter, ...]
    probability: Mapping[str, float]
    noise: Array
    common: Array
    log_factors: Mapping[Component, float] = field(default_factory=dict)
    tails: float = np.inf
    note: str = ""

    def chosen(self, kind: str) -> tuple[JointScatter, ...]:
        """Components of one kind."""
        return tuple(c for c in self.components if c.kind == kind)

    def covariance(
        self,
        sensitivity: Array,
        noise: Array | None = None,
        without: int | None = None,
        visits: Array | float = 1.0,
    ) -> Array:
        """Covariance (N, m, m) of rows, N = diag(noise²) + Σ_j σ_j² J_j J_jᵀ, over all joints or all but one.

        ``noise`` (m,), or (N, m) where it differs by row, takes the place of the estimated one. Of rows that are means
        over ``visits`` (N,) of a pose the variance of what comes anew at each visit is divided by their number.
        """
        m = len(self.noise)
        variance = np.broadcast_to((self.noise if noise is None else noise) ** 2, (len(sensitivity), m))
        result = variance[:, :, None] * np.eye(m)
        for c in self.components:
            if c.joint != without:
                column = sensitivity[:, :m, c.joint] * c.sigma
                over = np.reshape(visits if c.kind == "visit" else 1.0, (-1, 1, 1))
                result += column[:, :, None] * column[:, None, :] / over
        return result

    def errors(
        self, joint: int, residual: Array, sensitivity: Array, visits: NDArray[np.int64] | None = None
    ) -> tuple[Array, Array]:
        """Estimated error (N,) of one joint in each row, rad or m, and its variance from everything else.

        Generalised least squares: (Jᵀ S⁻¹ r) / (Jᵀ S⁻¹ J) with S of the noise and the other joints. Where rows are
        means over ``visits`` (N,) of a pose, what comes anew at each visit averages out, what a pose brings does not: S
        is (N + J Λ_v Jᵀ)/k + N₀ + J Λ_u Jᵀ, and the joint's own scatter by visit counts as an error of the mean.
        """
        noise, anew, over = self.noise, 0.0, np.ones(len(residual))
        if visits is not None:
            over = visits.astype(float)
            noise = np.sqrt(self.noise**2 / over[:, None] + self.common**2)
            anew = sum(c.sigma**2 for c in self.chosen("visit") if c.joint == joint)
        column = sensitivity[:, : len(self.noise), joint]
        weighted = np.linalg.solve(self.covariance(sensitivity, noise, joint, over), column[:, :, None])[:, :, 0]
        known = (weighted * column).sum(axis=1) + settings.TINY
        return (weighted * residual).sum(axis=1) / known, 1.0 / known + anew / over


def variance_components(
    residual: Array,
    sensitivity: Array,
    noise: Array,
    pose: NDArray[np.int64] | None = None,
    *,
    stated: bool | Sequence[bool] = True,
    freedom: int = 0,
    used: NDArray[np.bool_] | None = None,
    start: Sequence[Component] = (),
) -> Scatter:
    """Variance components (REML): scatter of each joint, and of the instrument.

    Row i of pose p is r_i = e_i + J_i (u_p + v_i): e is the instrument's noise, v (``visit``) comes anew at each visit
    and u (``pose``) once a commanded pose. Evidence of a component is Laplace's in the logarithm of its standard
    deviation, which beforehand is anything between a tenth and a hundred times the noise, so that the bound at zero is
    infinitely far (Kass and Raftery, *Bayes Factors*, 1995, §4.1). Joints are added one by one while the posterior
    grows; probabilities are over all sets compared. Without repeats u and v are confounded, and only ``pose`` is
    estimated. Very many rows are represented by a random sample of whole poses.

    ``residual`` (N, m), m and rad, m = 3 or 6; ``sensitivity`` (N, m or 6, n), Jacobian of the joints at the target, in
    the same axes; ``noise`` (m,), held near that where ``stated``, for all or for every three axes; ``pose`` (N,),
    number of the commanded pose; ``freedom``, number of parameters fitted before; ``used`` (N,) rows that count;
    ``start``, components with which the search begins a second time. Raises :class:`EstimationError` if shapes do not
    fit, values are not finite, or a noise is not positive.
    """
    residual, sensitivity, noise = (np.asarray(a, dtype=float) for a in (residual, sensitivity, noise))
    _check(residual, sensitivity, noise)
    held = tuple(np.broadcast_to(stated, len(noise) // 3).tolist())
    used = np.ones(len(residual), dtype=bool) if used is None else used
    labels = np.arange(len(residual)) if pose is None else np.unique(pose, return_inverse=True)[1].ravel()
    kept = enough_rows(labels, used)
    if len(kept) < settings.FEWEST_ROWS:
        note = f"nothing can be said: {len(kept)} rows are fewer than {settings.FEWEST_ROWS}"
        prior = dict.fromkeys(("visit", "pose"), settings.PRIOR_PROBABILITY)
        return Scatter((), (), prior, noise, 0.0 * noise, note=note)
    labels = labels[kept]
    if len(kept) - len(np.unique(labels)) < settings.FEWEST_CONTRASTS:
        labels = np.arange(len(kept))
    lever = sensitivity[kept, : len(noise)] / noise[:, None]
    rows = independent_rows(residual[kept] / noise, lever, labels, freedom)
    search = _Search(Likelihood(rows, held)).run(start)
    heavy = Likelihood(rows, held, settings.TAILS)
    if heavy.fit(search.chosen).value > search.fit(search.chosen)[0].value + settings.CONVINCING:
        search = _Search(heavy).run(start)
    notes = [] if rows.contrasts else ["without repeats, what comes anew at each visit counts as the pose's"]
    if len(kept) < int(used.sum()):
        notes.append(f"{len(kept)} rows drawn at random stand for all")
    return search.result(noise, "; ".join(notes))


def _check(residual: Array, sensitivity: Array, noise: Array) -> None:
    count, m = residual.shape if residual.ndim == 2 else (-1, 0)
    fits = m in (3, 6) and sensitivity.ndim == 3 and len(sensitivity) == count and sensitivity.shape[1] >= m
    if not fits or noise.shape != (m,):
        raise EstimationError(
            f"a remainder of shape {residual.shape} does not fit sensitivities {sensitivity.shape} and noise "
            f"{noise.shape}: expected (N, 3 or 6), (N, m, n) and (m,)"
        )
    if not (np.isfinite(residual).all() and np.isfinite(sensitivity).all() and (noise > 0.0).all()):
        raise EstimationError("remainder and sensitivity must be finite, and the noise positive")


def enough_rows(labels: NDArray[np.int64], used: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Row numbers of all used rows, or of a random sample of whole poses where there are very many."""
    rows = np.flatnonzero(used)
    if len(rows) <= settings.ENOUGH_ROWS:
        return rows
    poses, number, count = np.unique(labels[rows], return_inverse=True, return_counts=True)
    drawn = np.random.default_rng(0).permutation(len(poses))
    taken = drawn[np.cumsum(count[drawn]) <= settings.ENOUGH_ROWS]
    return rows[np.isin(number.ravel(), taken)]


@dataclass(eq=False)
class _Search:
    """Stepwise search for the most probable set of variance components; ``fits`` is the memo of the sets fitted."""

    likelihood: Likelihood
    chosen: tuple[Component, ...] = ()
    fits: dict[frozenset[Component], tuple[Fitted, float]] = field(default_factory=dict)

    @property
    def kinds(self) -> tuple[str, ...]:
        return ("visit", "pose") if self.likelihood.rows.contrasts else ("pose",)

    def fit(self, components: tuple[Component, ...]) -> tuple[Fitted, float]:
        """Fit a set of components, memoised; return the fit and its log evidence plus log prior."""
        key = frozenset(components)
        if key not in self.fits:
            fitted = self.likelihood.fit(components)
            self.fits[key] = fitted, fitted.value + self.likelihood.log_widths(fitted) + self._prior(components)
        return self.fits[key]

    def _posterior(self, components: tuple[Component, ...]) -> float:
        return self.fit(components)[1]

    def _prior(self, components: tuple[Component, ...]) -> float:
        """Log prior of a set of components: for each kind, that it is at work, and in exactly these joints."""
        n, at_work, total = len(self.likelihood.rows.lever), settings.PRIOR_PROBABILITY, 0.0
        for kind in self.kinds:
            joints = sum(k == kind for k, _ in components)
            share = share_of_places(joints, n) + (settings.IN_ALL if joints == n else 0.0)
            total += np.log(at_work * share if joints else 1.0 - at_work)
        return float(total)

    def _candidates(self) -> tuple[Component, ...]:
        lever = self.likelihood.rows.lever
        seen = np.flatnonzero(lever > settings.ALIAS * lever.max(initial=0.0)).tolist()
        return tuple((kind, j) for kind in self.kinds for j in seen if (kind, j) not in self.chosen)

    def run(self, start: Sequence[Component]) -> _Search:
        """Stepwise search from the empty set, from a start, and, if the noise stays too large, from all joints.

        The variance common to visits may imitate a single component; several similar ones may imitate a larger noise,
        with which no single one gains much.
        """
        within = self._candidates()
        for begin in dict.fromkeys(((), tuple(c for c in start if c in within))):
            self._begun(begin)
        noises = zip(self.fit(self.chosen)[0].logs, self.likelihood.stated, strict=False)
        if any(stated and log > 2.0 * np.log(settings.NOISE_SLACK) for log, stated in noises):
            for kind in dict.fromkeys(kind for kind, _ in self.chosen):
                self._begun(tuple(dict.fromkeys([c for c in within if c[0] == kind] + list(self.chosen))))
        return self

    def _begun(self, begin: tuple[Component, ...]) -> None:
        before, self.chosen = self.chosen, begin
        while len(self.chosen) < settings.MOST_COMPONENTS and self._added():
            pass
        while self._revised():
            pass
        self.chosen = max(before, self.chosen, key=self._posterior)

    def _added(self) -> bool:
        """Forward step: add the component with the largest log posterior if that grows; tell whether one was added."""
        candidates, (fitted, log_posterior) = self._candidates(), self.fit(self.chosen)
        gain = self.likelihood.screen(fitted, candidates).max(axis=0) - fitted.value
        likely = [k for k in np.argsort(-gain)[: settings.FULLY_TRIED] if gain[k] > settings.CONVINCING]
        best = max(((*self.chosen, candidates[k]) for k in likely), key=self._posterior, default=self.chosen)
        better = self._posterior(best) > log_posterior
        self.chosen = best if better else self.chosen
        return better

    def _revised(self) -> bool:
        """Backward or exchange step: drop a component or a whole kind, or change a kind; tell whether that improved."""
        others = [tuple(o for o in self.chosen if o != c) for c in self.chosen]
        moved = [(*rest, (k, c[1])) for rest, c in zip(others, self.chosen, strict=True) for k in self.kinds]
        others += [m for m in moved if len(set(m)) == len(m)]
        others += [tuple(c for c in self.chosen if c[0] != kind) for kind in self.kinds]
        best = max([self.chosen, *others], key=self._posterior)
        better = self._posterior(best) > self._posterior(self.chosen) + settings.ALIAS
        self.chosen = best if better else self.chosen
        return better

    def result(self, noise: Array, note: str) -> Scatter:
        law, (fitted, _) = self.likelihood, self.fit(self.chosen)
        candidates, lever = self._candidates(), law.rows.lever
        screened = law.screen(fitted, candidates)
        factors = logsumexp(screened - fitted.value, axis=0) - np.log(len(screened))
        parts, components = len(law.stated), []
        for place, (kind, joint) in enumerate(fitted.components, law.nuisances):
            if fitted.logs[place] > _GRID[0]:
                logs = np.array([fitted.logs[place], *self._interval(fitted, place)])
                components.append(JointScatter(kind, joint, *(np.exp(0.5 * logs) / lever[joint]).tolist()))
        return Scatter(
            self.kinds,
            tuple(sorted(components, key=lambda c: (self.kinds.index(c.kind), c.joint))),
            self._probability(candidates, factors),
            noise * np.exp(0.5 * np.repeat(fitted.logs[:parts], 3)),
            noise * (np.exp(0.5 * fitted.logs[parts]) if law.rows.contrasts else 0.0),
            dict(zip(candidates, factors.tolist(), strict=True)),
            law.tails,
            note,
        )

    def _probability(self, candidates: tuple[Component, ...], factors: Array) -> dict[str, float]:
        """Posterior probability of each kind, over all sets compared and those with one component more."""
        models = {key: posterior for key, (_, posterior) in self.fits.items()}
        own = self._posterior(self.chosen) - self._prior(self.chosen)
        for candidate, factor in zip(candidates, factors.tolist(), strict=True):
            larger = (*self.chosen, candidate)
            models.setdefault(frozenset(larger), own + factor + self._prior(larger))
        total = logsumexp(list(models.values()))
        return {
            kind: total_probability([np.exp(p - total) for key, p in models.items() if kind in dict(key)])
            for kind in self.kinds
        }

    def _interval(self, fitted: Fitted, place: int) -> tuple[float, float]:
        """Profile likelihood interval (95 %) of a log variance; ∓∞ where the likelihood does not drop."""
        estimate = fitted.logs[place]
        step = settings.SIGMAS_95 * float(np.sqrt(fitted.spread[place, place]))
        if len(self.likelihood.rows.columns) > settings.NORMAL_ROWS and step < 1.0:
            return estimate - step, estimate + step

        def beyond(log: float) -> float:
            start = fitted.logs.copy()
            start[place] = log
            return fitted.value - self.likelihood.fit(fitted.components, start, place).value - settings.DROP_95

        def end(sign: float) -> float:
            inner, reach = estimate, step
            while beyond(estimate + sign * reach) < 0.0 and reach < -_LOWEST:
                inner, reach = estimate + sign * reach, 2.0 * reach
            outer = estimate + sign * reach
            return (
                float(brentq(beyond, inner, outer, xtol=settings.PROFILE_ROOT))
                if beyond(outer) > 0.0
                else sign * np.inf
            )

        return end(-1.0), end(1.0)


Rows = NDArray[np.bool_]


def followed(errors: Array, weight: Array, recorded: Mapping[str, Array], pose: NDArray[np.int64] | None = None) -> str:
    """Name the recorded quantity that errors (K,) of weight 1/variance follow by an F test of a smooth law, or empty.

    The smallest p-value, times the number of quantities (Bonferroni), must be significant; a law must also explain a
    good part of the errors. ``pose`` (K,): where errors are those within a pose, the mean of each was taken out of
    them.
    """
    root = np.sqrt(weight)
    number = np.zeros(len(errors), dtype=np.int64) if pose is None else np.unique(pose, return_inverse=True)[1]
    means = np.eye(int(number.max()) + 1)[number] * root[:, None]
    means = means / np.linalg.norm(means, axis=0)
    target = Target(without(errors * root, means), root[:, None], means)
    vary = {name: values for name, values in recorded.items() if np.ptp(values) > settings.ROUNDING}
    scores = {name: target.score(smooth_columns(values)[:, None, :]) for name, values in vary.items()}
    p_values = {name: w.p_value for name, w in scores.items() if w.share > settings.SCATTER_LAW_SHARE}
    best = min(p_values, key=p_values.__getitem__, default="")
    return best if best and p_values[best] * len(recorded) < settings.LEVEL else ""


@dataclass(frozen=True)
class Steps:
    """Step of an encoder, rad or m, and the log Bayes factor of quantisation by it against a normal error.

    Without visible steps the step is that implied by the size of the errors; the factor is 0 where it cannot be
    computed.
    """

    step: float
    log_factor: float


def period(errors: Array, variance: Array, command: Array, step: float) -> Steps:
    """Marginal-likelihood periodogram of an encoder's step: spacing of the positions at which it lets a joint stand.

    The joint stands at the multiple of the step s, from a first position φ on, that is nearest to its command. Its
    error (K,) is then a sawtooth of the command, u s with u from -½ to ½, seen with its variance v and a slack of the
    steps; without steps it is normal with the variance v + s²/12. The Bayes factor is the ratio of these likelihoods,
    its mean over φ, over slacks, and over the frequencies 1/s near that which the size of the errors implies (``step``,
    rad or m). The logarithm of a row's likelihood is periodic in φ less the command: by its Fourier series the sum over
    rows is one of waves exp(2π i k command/s).
    """
    some = np.linspace(0.0, len(errors) - 1.0, min(len(errors), settings.STEP_POSES)).round().astype(np.int64)
    errors, variance, command = errors[some] / step, variance[some] / step**2, (command - command.mean())[some] / step
    without_steps = float(_normal(errors, 0.0, variance + 1.0 / 12).sum())
    tried = [_tried(errors, variance, command, slack) for slack in settings.STEP_SLACKS]
    if not all(len(frequency) for frequency, _ in tried):
        return Steps(step, 0.0)
    means = [float(logsumexp(each) - np.log(len(each))) for _, each in tried]
    factor = float(logsumexp(means) - np.log(len(means))) - without_steps
    frequency, each = tried[int(np.argmax(means))]
    return Steps(step / float(frequency[np.argmax(each)]) if factor > settings.CONVINCING else step, factor)


def _tried(errors: Array, variance: Array, command: Array, slack: float) -> tuple[Array, Array]:
    """Frequencies 1/s of steps near the implied one, and the log likelihood of each, averaged over phase.

    All are in implied steps; both arrays are empty where there are too many frequencies.
    """
    known = variance + slack**2
    width = 1.0 / (max(float(command.std()), 1.0) * np.sqrt(max(float((1.0 / known).sum()), (2.0 * np.pi) ** 2)))
    bands = np.geomspace(1.0 / settings.BAND, settings.BAND, settings.STEP_BANDS + 1)
    if (bands[-1] - bands[0]) / width > settings.MOST_FREQUENCIES:
        return np.zeros(0), np.zeros(0)
    frequencies, likelihoods = [], []
    for low, high in pairwise(bands):
        here, frequency = float(np.sqrt(low * high)), np.arange(low, high, width)
        series = _series(errors * here, known * here**2, slack)
        waves = _sums(series, command, low, width, len(frequency))
        of_phase = np.fft.irfft(waves, settings.STEP_PHASES, axis=0) + len(errors) * np.log(here)
        likelihoods.append(logsumexp(of_phase, axis=0) - np.log(settings.STEP_PHASES))
        frequencies.append(frequency)
    return np.concatenate(frequencies), np.concatenate(likelihoods)


def _normal(x: Array, mean: Array | float, variance: Array) -> Array:
    return np.asarray(-0.5 * ((x - mean) ** 2 / variance + np.log(2.0 * np.pi * variance)))


def _series(errors: Array, variance: Array, slack: float) -> NDArray[np.complex128]:
    """Fourier coefficients (K, H) of each row's log likelihood as a function of the phase of the first position.

    The joint is at the position nearest to its command, with a ``slack`` in steps for where the nearest one changes.
    """
    u = np.arange(settings.STEP_PHASES) / settings.STEP_PHASES
    near = np.stack([u - 1.0, u, u + 1.0]) - 0.5
    taken = log_ndtr((0.5 - np.abs(near)) / slack)
    taken = taken - logsumexp(taken, axis=0)
    each = taken + _normal(errors[:, None, None], near, variance[:, None, None])
    return np.asarray(np.fft.rfft(logsumexp(each, axis=1), axis=1)[:, : settings.STEP_HARMONICS + 1])


def _sums(weights: NDArray[np.complex128], place: Array, lowest: float, width: float, count: int) -> Array:
    """Fourier sums (H, count) Σ weight exp(−2π i k f place) of weights (K, H), k = 0…, at equidistant frequencies.

    A frequency is a coarse one and a fine one, so that the sums are a product of two small matrices.
    """
    fine = int(np.sqrt(count)) + 1
    coarse = lowest + width * fine * np.arange(-(-count // fine))
    first, second = (np.exp(-2j * np.pi * np.outer(f, place)) for f in (coarse, width * np.arange(fine)))
    found, own, beside = [], np.ones_like(first), np.ones_like(second)
    for weight in weights.T:
        found.append(((weight * own) @ beside.T).ravel()[:count])
        own, beside = own * first, beside * second
    return np.array(found)


def stepped(log_factors: Iterable[float]) -> float:
    """Posterior probability that per-pose errors of the joints are quantisation by their encoders.

    From the log Bayes factor of each joint, allowing for steps that stay hidden. Repeatable errors alone are no
    evidence of steps.
    """
    shown = np.log1p(-settings.STEPS_HIDDEN) + np.array(list(log_factors), dtype=float)
    return float(expit(np.logaddexp(shown, np.log(settings.STEPS_HIDDEN)).sum() - np.log(settings.RIVALS)))


@dataclass(frozen=True)
class Kept:
    """Variance component classified as scatter, and the step of an encoder that would cause it, rad or m."""

    component: JointScatter
    step: float


@dataclass(frozen=True, eq=False)
class RandomGap:
    """Random part of the gap beyond the instrument, by the variance components of ``scatter``.

    ``kept`` are its components that are scatter. ``explains_size``: the gap is no larger than instrument and scatter
    allow, by a χ² test (``p_value``); per-pose errors count where they are more probably an encoder's. By joint:
    ``steps``, the log Bayes factor of steps of the command against errors that follow nothing, and ``laws``, the
    quantity that its errors follow, so that they are no scatter. ``note`` says what limits the answer.
    """

    kept: tuple[Kept, ...]
    explains_size: bool
    p_value: float
    scatter: Scatter
    steps: Mapping[str, float]
    laws: Mapping[str, str]
    note: str = ""

    @property
    def stepped(self) -> float:
        """Posterior probability that the per-pose errors are quantisation by encoders (:func:`stepped`)."""
        return stepped(self.steps.values())


def nothing_random(fit: Fit) -> RandomGap:
    """Empty result, for a gap whose random part cannot be estimated: no components, and a p-value of 1."""
    noise = fit.explanation.whitening.noise
    return RandomGap((), False, 1.0, Scatter((), (), {}, noise, 0.0 * noise), {}, {})


def random_gap(fit: Fit) -> RandomGap:
    """Estimate the joints' scatter, per visit or per pose, as variance components beside the instrument's noise.

    Errors that follow a smooth law of a recorded quantity are no scatter. Encoder errors are a sawtooth of the command
    with the period √12 σ; without repeats, when visits and poses are one, only that separates steps from wear.
    """
    # what rows do not see would count as no scatter, and a model scatters nothing
    if fit.explanation.whitening.seen is not None or of_model(fit.campaign):
        return nothing_random(fit)
    e, observed, even = fit.explanation, fit.corrected, _even(fit)
    m = even.shape[1]
    gap, sensitivity = observed.gap / even, observed.joint_sensitivity[:, :m] / even[:, :, None]
    given = (fit.campaign.noise_position, fit.campaign.noise_orientation)[: m // 3]
    noise = np.repeat([g or e.whitening.noise[3 * k] for k, g in enumerate(given)], 3)
    pose, held = repeated_poses(fit.campaign), [bool(g) for g in given]
    asked = np.isin(np.arange(len(gap)), enough_rows(pose, ~e.outliers)) | e.outliers
    used = asked & ~e.outliers
    freedom = round(e.best.effective) + e.linear.frames.shape[2]
    estimate = partial(
        variance_components, sensitivity=sensitivity, noise=noise, pose=pose, stated=held, freedom=freedom
    )
    for _ in range(settings.SCATTER_PASSES):
        scatter = estimate(gap, used=used, start=_in_joints(fit))
        if not scatter.components:
            break
        gap = _refitted(fit, scatter, sensitivity, used, even)
        # rows set aside as gross errors may be no more than this scatter
        within = _distance2(scatter, gap, sensitivity) <= distance_limit(m, len(gap))
        if 2 * within.sum() < len(within):
            break  # most rows lie beyond any scatter: robot and table do not belong together
        used = within & asked
    scatter, used, carried = _without_influential_rows(partial(estimate, gap), scatter, gap, sensitivity, used)
    gap, sensitivity = gap[used], sensitivity[used]
    laws, steps, kept = _judge(fit, scatter, gap, sensitivity, pose, used, freedom)
    likely = stepped(steps.values()) >= settings.SCATTER_SURE
    real = tuple(k.component for k in kept if k.component.kind == "visit" or likely)
    known = replace(scatter, components=real, noise=np.where(np.repeat(held, 3), noise, scatter.noise))
    p_value, explains = _chance_of_size(_distance2(known, gap, sensitivity), m, freedom)
    few = ", ".join(fit.campaign.robot.joint_names[j] for j in carried)
    note = _note(scatter, laws, few, bool(steps) and not likely)
    return RandomGap(tuple(kept), bool(real) and explains, p_value, scatter, steps, laws, note)


def _without_influential_rows(
    estimate: Callable[..., Scatter], scatter: Scatter, gap: Array, sensitivity: Array, used: Rows
) -> tuple[Scatter, Rows, list[int]]:
    """Estimate the scatter again without its few most influential rows (deletion): real scatter is in all rows.

    Returns the scatter, the rows that count, and the joints whose scatter only a few rows supported; these rows are
    then left out.
    """
    if not scatter.components:
        return scatter, used, []
    rows = np.flatnonzero(used)
    told = [scatter.errors(c.joint, gap[rows], sensitivity[rows]) for c in scatter.components]
    most = np.argsort(-np.max([errors**2 / variance for errors, variance in told], axis=0), kind="stable")
    rest = used.copy()
    rest[rows[most[: int(np.ceil(settings.FEW_ASIDE * len(rows)))]]] = False
    start = [(c.kind, c.joint) for c in scatter.components]
    again = estimate(used=rest, start=start)
    speaks = {(c.kind, c.joint) for c in again.components} | {c for c, f in again.log_factors.items() if f > 0.0}
    carried = [joint for kind, joint in start if (kind, joint) not in speaks]
    return (again, rest, carried) if carried else (scatter, used, [])


def _in_joints(fit: Fit) -> list[Component]:
    """List the variance components, kind and joint, of a fit's per-pose or per-visit discrepancy; empty without one."""
    kernel, names = fit.explanation.discrepancy.kernel, fit.campaign.robot.joint_names
    if kernel is None:
        return []
    return [("visit" if kernel.kind == "visits" else "pose", names.index(joint)) for joint in kernel.joints]


def _means(values: Array, number: NDArray[np.int64], weight: Array | None = None) -> Array:
    """Weighted mean (P, ...) of the rows of each pose."""
    weight = np.ones(len(number)) if weight is None else weight
    total = np.bincount(number, weight)
    sums = np.zeros((len(total), *values.shape[1:]))
    np.add.at(sums, number, (weight * values.T).T)
    return np.asarray((sums.T / total).T)


def _even(fit: Fit) -> Array:
    """Scale factors (N, m) by which rows are divided to have equal noise variance.

    For repeats of a pose it is their root mean square, so that per-pose errors cancel in contrasts, whose mean square
    stays that of the noise.
    """
    relative = fit.campaign.relative_noise
    if relative is None:
        return np.ones_like(fit.corrected.gap)
    pose = repeated_poses(fit.campaign)
    return np.asarray(np.sqrt(_means(relative**2, pose))[pose])


def _refitted(fit: Fit, scatter: Scatter, sensitivity: Array, used: Rows, even: Array) -> Array:
    """Residual (N, m) of generalised least squares, with the scatter in the covariance.

    With the instrument's noise alone, a scattering joint would bias the frames, and their error would count as scatter
    of other joints.
    """
    e = fit.explanation
    blocks = [e.linear.blocks[b].columns * e.linear.blocks[b].sizes for b in e.best.blocks]
    design = np.concatenate([e.linear.frames, *blocks], axis=2) / even[:, :, None]
    gap = fit.corrected.gap / even
    if not design.shape[2]:
        return gap
    covariance = scatter.covariance(sensitivity[used])
    white = generalised(Linear(gap[used], design[used], ()), covariance, np.ones(gap.shape[1]))
    columns = equations_of(white.frames)
    return np.asarray(gap - design @ solve(columns.T @ columns, columns.T @ white.gap.ravel()))


def _distance2(scatter: Scatter, gap: Array, sensitivity: Array) -> Array:
    solved = np.linalg.solve(scatter.covariance(sensitivity), gap[:, :, None])[:, :, 0]
    return np.asarray((solved * gap).sum(axis=1))


def _judge(
    fit: Fit, scatter: Scatter, gap: Array, sensitivity: Array, pose: NDArray[np.int64], used: Rows, freedom: int
) -> tuple[dict[str, str], dict[str, float], list[Kept]]:
    """Classify components by an F test: those that follow a law, and scatter; with the log evidence for encoder steps.

    Returns laws and evidence by joint, and the components that are scatter. The fitted parameters absorb a share of the
    per-pose errors: their number over that of the measurements.
    """
    recorded = {name: values[used] for name, values in quantities(fit.corrected).items()}
    number = np.unique(pose[used], return_inverse=True)[1].ravel()
    visits = np.bincount(number)
    averaged = _means(gap, number), _means(sensitivity, number)
    laws: dict[str, str] = {}
    factors: dict[str, float] = {}
    kept: list[Kept] = []
    for c in scatter.components:
        name, step = fit.campaign.robot.joint_names[c.joint], float(np.sqrt(12) * c.sigma)
        if c.kind == "visit":
            law = _within_poses(*scatter.errors(c.joint, gap, sensitivity), c.sigma, recorded, number)
        else:
            errors, variance = scatter.errors(c.joint, *averaged, visits)
            law = followed(errors, 1.0 / (variance + c.sigma**2), {n: _means(v, number) for n, v in recorded.items()})
        if law:
            laws[name] = law
            continue
        if c.kind == "pose":
            taken, command = freedom / averaged[0].size, _means(fit.campaign.q[used, c.joint], number)
            found = period(errors, variance + taken * c.sigma**2, command, step)
            step, factors[name] = found.step, found.log_factor
        kept.append(Kept(c, step))
    return laws, factors, kept


def _within_poses(
    errors: Array, variance: Array, sigma: float, recorded: Mapping[str, Array], number: NDArray[np.int64]
) -> str:
    """Name the quantity that deviations (N,) of visits from their pose's mean follow, as :func:`followed`, or empty."""
    weight, repeated = 1.0 / (variance + sigma**2), np.bincount(number)[number] > 1

    def within(values: Array) -> Array:
        return np.asarray((values - _means(values, number, weight)[number])[repeated])

    inside = {name: within(values) for name, values in recorded.items()}
    return followed(within(errors), weight[repeated], inside, number[repeated])


def _chance_of_size(distance2: Array, m: int, freedom: int) -> tuple[float, bool]:
    """χ² test of squared distances (N,) in the rows' covariance; heavy tails reduce its degrees of freedom.

    Returns the p-value, and whether the size is explained: not significant, or hardly more than one.
    """
    left = max(m * len(distance2) - freedom, 1)
    ratio2 = float(distance2.sum()) / left
    spread = max(float((distance2**2).mean() / max(float(distance2.mean()) ** 2, settings.TINY) - 1.0), 2.0 / m)
    effective = left * (2.0 / m) / spread
    p = float(chdtrc(effective, ratio2 * effective))
    return p, p > settings.LEVEL or ratio2 < settings.MATERIAL_SCALE**2


def _note(scatter: Scatter, laws: Mapping[str, str], few: str, doubtful: bool) -> str:
    if few:
        return f"what looks like scatter of {few} is carried by a few rows: it is no scatter"
    if laws:
        joint, quantity = next(iter(laws.items()))
        return f"what looks like scatter of {joint} follows {quantity}: it is no scatter"
    if doubtful and len(scatter.kinds) == 1:
        return "the scatter shows no steps: repeats of each pose (column pose) would tell wear from what a pose brings"
    if doubtful:
        return "joints err from pose to pose without the steps of an encoder, and follow nothing that was recorded"
    return scatter.note
