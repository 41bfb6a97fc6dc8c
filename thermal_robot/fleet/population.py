"""Random-effects model by empirical Bayes: population mean of a quantity, spread between robots, and outliers.

The value y_i of robot i is known with standard deviation s_i. The robots scatter about the mean of their group,

    y_i ~ (1 − ε) N(μ_g, s_i² + τ²) + ε C(μ_g, W √(s_i² + τ²)),

with a wider Cauchy law C for outlying robots, which carry little information on μ_g. By empirical Bayes μ, τ and ε are
estimated from the fleet itself (Efron, *Large-Scale Inference*, 2010, on two groups; Gelman, *Bayesian Analysis* 1,
2006, on flat priors of τ): for each τ of a grid μ_g and ε are found by expectation and maximisation (Dempster, Laird
and Rubin, *J. R. Stat. Soc.* B 39, 1977), μ_g is integrated out by Laplace's method, and everything is averaged over
the posterior of τ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, fdtrc, logsumexp, ndtr

from thermal_robot.arrays import Array
from thermal_robot.fleet import settings

Codes = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Population:
    """Posterior of one quantity over n robots in G groups, in its unit.

    ``means`` (G,) of the groups and their standard ``deviations`` (G,); ``spread``, the standard deviation τ between
    robots of a group, and its own ``spread_std``; ``apart`` (n,), the probability that a robot is an outlier.
    """

    means: Array
    deviations: Array
    spread: float
    spread_std: float
    apart: Array

    @property
    def nothing(self) -> float:
        """Two-sided p-value, by the normal law, of the hypothesis that the (first) group's mean is zero."""
        return float(2.0 * ndtr(-abs(self.means[0]) / self.deviations[0]))

    @property
    def p_equal_means(self) -> float:
        """P-value of the F test that all group means are equal, each weighted by its inverse variance."""
        groups, robots = len(self.means), len(self.apart)
        weight = self.deviations**-2.0
        about = self.means - (weight * self.means).sum() / weight.sum()
        return float(fdtrc(groups - 1, robots - groups, (weight * about**2).sum() / (groups - 1)))


def population(values: Array, deviations: Array, groups: Codes | None = None) -> Population:
    """Fit the random-effects model by empirical Bayes to values (n,) with standard deviations (n,), with outliers.

    ``groups`` (n,) are codes 0 to G − 1, none empty; one group where left out.
    """
    codes = np.zeros(len(values), dtype=np.int64) if groups is None else groups
    order = np.argsort(codes, kind="stable")
    unit = _unit(values, deviations, codes)
    y, s, g = values[order] / unit, deviations[order] / unit, codes[order]
    starts = np.flatnonzero(np.diff(g, prepend=-1))
    tau = np.concatenate([[0.0], np.geomspace(*settings.SPREADS, settings.GRID)])
    means, tight, apart, fit = _maximised(y, s, starts, tau)
    weight = fit + np.log(np.gradient(tau))
    weight = np.exp(weight - logsumexp(weight))
    mean = weight @ means
    spread = float(weight @ tau)
    unlike = np.empty(len(y))
    unlike[order] = weight @ apart
    return Population(
        unit * mean,
        unit * np.sqrt(weight @ (1.0 / tight + (means - mean) ** 2)),
        unit * spread,
        unit * float(np.sqrt(weight @ (tau - spread) ** 2)),
        unlike,
    )


def _unit(values: Array, deviations: Array, codes: Codes) -> float:
    """Return the unit of the grid of τ: robust (MAD) scatter about group medians, in quadrature with the median s."""
    centres = np.array([np.median(values[codes == k]) for k in range(codes.max() + 1)])
    return float(np.hypot(1.4826 * np.median(np.abs(values - centres[codes])), np.median(deviations)))


def _maximised(y: Array, s: Array, starts: Codes, tau: Array) -> tuple[Array, Array, Array, Array]:
    """Run EM at each of T spreads: group means and precisions (T, G), outlier probabilities (T, n), log posterior (T,).

    ``y`` and ``s`` (n,) are values and deviations sorted by group, ``starts`` (G,) the index at which each begins. The
    means are integrated out of the log posterior by Laplace's method.
    """
    counts = np.diff(np.append(starts, len(y)))
    variance = s**2 + tau[:, None] ** 2
    means = np.tile([np.median(part) for part in np.split(y, starts[1:])], (len(tau), 1))
    unlike = np.full((len(tau), 1), settings.UNLIKE)
    for _ in range(settings.ROUNDS):
        square = (y - np.repeat(means, counts, axis=1)) ** 2 / variance
        odds = np.log(unlike / (1.0 - unlike)) + _cauchy(square) + 0.5 * square
        apart = expit(odds)
        # what is unlike the others says nothing of them, unless nobody is left
        weight = np.maximum(1.0 - apart, settings.LEAST_HEARD) / variance
        tight = np.add.reduceat(weight, starts, axis=1)
        means = np.add.reduceat(weight * y, starts, axis=1) / tight
        rare = settings.UNLIKE_PRIOR
        unlike = (apart.sum(axis=1, keepdims=True) + rare[0]) / (len(y) + sum(rare))
    square = (y - np.repeat(means, counts, axis=1)) ** 2 / variance
    alike = np.log1p(-unlike) - 0.5 * (square + np.log(variance))
    other = np.log(unlike) + _cauchy(square) - 0.5 * np.log(variance)
    held = rare[0] * np.log(unlike[:, 0]) + rare[1] * np.log1p(-unlike[:, 0])
    fit = np.logaddexp(alike, other).sum(axis=1) + held - 0.5 * np.log(tight).sum(axis=1)
    return means, tight, apart, fit


def _cauchy(square: Array) -> Array:
    """Log of √(2π) times the outliers' Cauchy density, at squared standardised deviations from the mean."""
    wide = settings.UNLIKE_WIDTH
    return np.asarray(np.log(np.sqrt(2.0 / np.pi) / wide) - np.log1p(square / wide**2))


def combined(values: Array, deviations: Array, owners: Codes) -> tuple[Codes, Array, Array]:
    """Inverse-variance weighted mean of the values of each robot, with Birge's ratio.

    Where a robot's values scatter more than their deviations say, the deviation of its mean is inflated by the root of
    the reduced chi-square (Birge, *Phys. Rev.* 40, 1932). Returns the n robots' codes, and values and deviations (n,).
    """
    robots, which = np.unique(owners, return_inverse=True)
    weight = deviations**-2.0
    total = np.bincount(which, weight)
    mean = np.bincount(which, weight * values) / total
    chi2 = np.bincount(which, weight * (values - mean[which]) ** 2)
    ratio = chi2 / np.maximum(np.bincount(which) - 1, 1)
    return robots, mean, np.sqrt(np.maximum(ratio, 1.0) / total)
