"""Likelihood of scatter that enters at the joints: independent rows, their covariances, variances and law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, logsumexp

from thermal_robot.arrays import Array
from thermal_robot.inference import settings

Component = tuple[str, int]  # "visit" or "pose", and the number of a joint

_LOWEST, _HIGHEST = settings.LOG_VARIANCE


@dataclass(frozen=True, eq=False)
class IndependentRows:
    """Remainder as independent rows, everything in units of the noise.

    Attributes
    ----------
    values
        (R, m) contrasts within each pose, and √k times its mean.
    columns
        (R, m, n) effect of each joint, of unit mean square per component.
    repeats
        (R,) k for the mean of a pose measured k times, 0 for a contrast.
    weights
        (R,) of the row's log likelihood.
    lever
        (n,) what the columns were divided by: variances of the joints are those of the columns over its square.
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
    """The likeliest variances of one set of components.

    Attributes
    ----------
    logs
        Logarithms of the variances in squares of the noise: instrument (one for every three components), what poses
        have in common from no joint (where there are repeats), then the components.
    value
        Logarithm of the posterior density there.
    covariance
        (R, m, m) of each row.
    spread
        Covariance of the logarithms.
    """

    logs: Array
    value: float
    covariance: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Restricted likelihood of rows.

    Attributes
    ----------
    rows
        The data.
    stated
        For every three components, whether the noise is stated.
    tails
        Degrees of freedom of Student's law in m dimensions; infinite for the normal law. Its scale is such that its
        covariance is the model's.
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
