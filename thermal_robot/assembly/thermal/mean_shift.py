"""Has a mean moved to where the model says? The parametric test of significance of Eq 13."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal_robot.arrays import Array
from thermal_robot.errors import EstimationError


@dataclass(frozen=True, eq=False)
class MeanShift:
    """Result of :func:`mean_shift_test`; arrays have the shape of the mean, one entry for each axis.

    Parameters
    ----------
    mean, mu0, sigma
        Mean of the sample, its value by the hypothesis, standard deviation of one measurement; in one unit.
    n
        Size of the sample.
    alpha
        Level of significance.
    u
        U = (mean − μ0) √n / σ, Eq 13; standard normal under the hypothesis.
    critical
        u(1 − α/2): the critical set is |U| beyond it.
    p_value
        Probability, under the hypothesis, of a |U| at least this large.
    accepted
        Whether there is no reason to reject the hypothesis; one bool for each axis.
    """

    mean: Array
    mu0: Array
    sigma: Array
    n: int
    alpha: float
    u: Array
    critical: float
    p_value: Array
    accepted: NDArray[np.bool_]

    def power(self, shift: ArrayLike) -> Array:
        """Probability of rejecting the hypothesis when the true mean is off μ0 by ``shift`` (unit of σ)."""
        return _power(np.asarray(shift, dtype=float) / self.sigma, self.n, self.critical)

    def required_n(self, shift: ArrayLike, power: float = 0.9) -> NDArray[np.int64]:
        """Smallest sample that rejects, with probability ``power``, a mean that is off μ0 by ``shift`` (unit of σ).

        Raises
        ------
        EstimationError
            If the shift is zero, or the power not between α and 1.
        """
        relative = np.abs(np.asarray(shift, dtype=float) / self.sigma)
        if not self.alpha < power < 1.0:
            raise EstimationError(f"the power must lie between alpha = {self.alpha} and 1, got {power}")
        if not np.all(relative > 0.0):
            raise EstimationError("no sample is large enough to see a shift of zero")
        from scipy.special import ndtri

        # The formula leaves out rejection on the far side, so that it may ask for too many: halve down from it.
        high = np.maximum(np.ceil(((self.critical + ndtri(power)) / relative) ** 2), 1.0)
        low = np.zeros_like(high)
        while np.any(high - low > 1.0):
            middle = np.ceil((low + high) / 2.0)
            enough = _power(relative, middle, self.critical) >= power
            low, high = np.where(enough, low, np.minimum(middle, high - 1.0)), np.where(enough, middle, high)
        sizes: NDArray[np.int64] = high.astype(np.int64)
        return sizes


def mean_shift_test(
    sample: ArrayLike, mu0: ArrayLike, sigma: ArrayLike | None = None, *, n: int | None = None, alpha: float = 0.05
) -> MeanShift:
    """Test whether a mean is μ0, two-sided, with known standard deviation (Eq 13).

    Parameters
    ----------
    sample
        Measurements (n,) or (n, axes); or, if ``n`` is given, their mean, a number or (axes,).
    mu0
        Mean by the hypothesis, such as the displacement that was found statically, in the unit of the sample.
    sigma
        Standard deviation of one measurement. ``None`` takes the sample's own, for which U is normal only for large
        samples (the paper: n > 30).
    n
        Size of the sample of which ``sample`` is the mean.
    alpha
        Level of significance.

    Returns
    -------
    MeanShift
        U, p-value and decision for each axis; the power of the test for any shift.

    Raises
    ------
    EstimationError
        If there are no measurements, σ is not positive, or α is not between 0 and 1.
    """
    from scipy.special import ndtr, ndtri

    values = np.asarray(sample, dtype=float)
    if n is None:
        if values.ndim == 0 or len(values) < 2:
            raise EstimationError("a sample has at least two measurements; give n if this is their mean")
        n, mean = len(values), values.mean(axis=0)
        spread = values.std(axis=0, ddof=1) if sigma is None else np.asarray(sigma, dtype=float)
    elif sigma is None:
        raise EstimationError("a mean alone has no standard deviation: give sigma")
    else:
        mean, spread = values, np.asarray(sigma, dtype=float)
    if n < 1 or not 0.0 < alpha < 1.0 or not np.all(spread > 0.0):
        raise EstimationError(f"needs n ≥ 1, σ > 0 and 0 < α < 1, got n = {n}, σ = {spread}, α = {alpha}")
    hypothesis = np.asarray(mu0, dtype=float)
    u = np.asarray((mean - hypothesis) / spread * np.sqrt(n))
    critical = float(ndtri(1.0 - alpha / 2.0))
    return MeanShift(
        np.asarray(mean),
        hypothesis,
        spread,
        n,
        alpha,
        u,
        critical,
        2.0 * ndtr(-np.abs(u)),
        np.asarray(np.abs(u) <= critical),
    )


def _power(relative: Array, n: float | Array, critical: float) -> Array:
    from scipy.special import ndtr

    moved = relative * np.sqrt(n)
    power: Array = ndtr(moved - critical) + ndtr(-moved - critical)
    return power
