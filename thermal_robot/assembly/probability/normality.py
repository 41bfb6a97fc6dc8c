"""Shapiro-Wilk test of normality with its power at the sample size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.special import ndtri

from thermal_robot.assembly.probability.flat_normal import flat_normal
from thermal_robot.errors import EstimationError

_SMALLEST, _LARGEST = 12, 5000  # Royston's approximation has this form from 12 on, and was made for n <= 5000
_SEED = 20180622


def shapiro_wilk_critical(n: int, alpha: float = 0.05) -> float:
    """Critical value of Shapiro-Wilk's W: a sample of ``n`` is rejected at level ``alpha`` when its W is smaller.

    Royston's approximation (AS R94, the one in `scipy.stats.shapiro`) inverted in closed form: ``ln(1 - W)`` is
    normal with mean and standard deviation polynomial in ``ln n``. For ``n = 100`` it is 0.9746 at 5 % and 0.9654 at
    1 %, as simulation confirms (0.9747 and 0.9655): the 0.964 that the paper prints for 5 % is beyond the 1 % point.

    Parameters
    ----------
    n
        Sample size, 12 to 5000.
    alpha
        Level, between 0 and 1.
    """
    if not _SMALLEST <= n <= _LARGEST:
        raise ValueError(f"the approximation holds for samples of {_SMALLEST} to {_LARGEST}, not {n}")
    _check_share(alpha, "alpha")
    log_n = np.log(n)
    mean = np.polynomial.polynomial.polyval(log_n, [-1.5861, -0.31082, -0.083751, 0.0038915])
    deviation = np.exp(np.polynomial.polynomial.polyval(log_n, [-0.4803, -0.082676, 0.0030302]))
    return float(1.0 - np.exp(mean + deviation * ndtri(1.0 - alpha)))


@dataclass(frozen=True)
class Power:
    """Power of the Shapiro-Wilk test: share of flat-normal samples in which it rejects normality.

    Parameters
    ----------
    r
        Ratio of the uniform to the normal standard deviation (Eq 17) in the samples.
    n, alpha
        Sample size and level.
    rejected
        Estimated share.
    low, high
        Its confidence interval (Clopper-Pearson).
    confidence
        Level of that interval.
    samples
        Simulated samples.
    """

    r: float
    n: int
    alpha: float
    rejected: float
    low: float
    high: float
    confidence: float
    samples: int


def normality_power(
    r: float,
    n: int,
    alpha: float = 0.05,
    *,
    samples: int = 2000,
    confidence: float = 0.95,
    random_state: int | np.random.Generator | None = _SEED,
) -> Power:
    """Power of Shapiro-Wilk's test against a flat-normal distribution, by simulation.

    Parameters
    ----------
    r
        Ratio of the uniform to the normal standard deviation (Eq 17); 0 gives the test's level, ``inf`` a uniform
        sample.
    n, alpha
        Sample size (12 to 5000) and level.
    samples
        Samples to simulate.
    confidence
        Level of the confidence interval.
    random_state
        Seed or generator; a fixed seed by default, so that the answer is the same every time.
    """
    critical = shapiro_wilk_critical(n, alpha)
    if not r >= 0.0:
        raise ValueError(f"r must not be negative, found {r}")
    if samples < 1:
        raise ValueError("at least one sample must be simulated")
    _check_share(confidence, "confidence")
    generator = np.random.default_rng(random_state)
    count = sum(
        float(stats.shapiro(flat_normal.rvs(r, size=n, random_state=generator)).statistic) < critical
        for _ in range(samples)
    )
    low, high = stats.binomtest(count, samples).proportion_ci(confidence)
    return Power(float(r), n, alpha, count / samples, float(low), float(high), confidence, samples)


def sample_size_to_see(
    r: float,
    power: float = 0.8,
    alpha: float = 0.05,
    *,
    samples: int = 1000,
    random_state: int | None = _SEED,
) -> int | None:
    """Smallest sample size, to 2 %, at which Shapiro-Wilk's test rejects a flat-normal distribution with a given power.

    Bisection in ``ln n`` on simulated power, every size with the same seed; the result carries the simulation's error
    (about 3 % in power with 1000 samples).

    Parameters
    ----------
    r
        Ratio of the uniform to the normal standard deviation (Eq 17).
    power
        Share of samples that must be rejected.
    alpha
        Level of the test.
    samples, random_state
        As in `normality_power`.

    Returns
    -------
    int or None
        ``None`` when even 5000, the largest sample the test is made for, does not suffice.
    """
    _check_share(power, "power")

    def reached(n: int) -> bool:
        return normality_power(r, n, alpha, samples=samples, random_state=random_state).rejected >= power

    low, high = _SMALLEST, _LARGEST
    if not reached(high):
        return None
    if reached(low):
        return low
    # Down to two per cent: the simulation says no more than that.
    while high > low * 1.02 and high - low > 1:
        middle = round(float(np.sqrt(low * high)))
        if reached(middle):
            high = middle
        else:
            low = middle
    return high


@dataclass(frozen=True)
class NormalityDecision:
    """Decision of Shapiro-Wilk's test with its power.

    Parameters
    ----------
    rejected
        Whether normality is rejected at level ``alpha``.
    statistic, critical
        W of the sample, and the value below which it is rejected.
    p_value
        Probability of so small a W from a normal sample.
    n, alpha
        Sample size and level.
    power
        Power of this very test against flat-normal alternatives, one for each ``r`` asked for.
    """

    rejected: bool
    statistic: float
    critical: float
    p_value: float
    n: int
    alpha: float
    power: tuple[Power, ...]

    def __str__(self) -> str:
        """Decision and power in one or two sentences."""
        verdict = "is rejected" if self.rejected else "is not rejected"
        text = f"Normality {verdict}: W = {self.statistic:.4f}, critical {self.critical:.4f}"
        text += f" (n = {self.n}, alpha = {self.alpha:g})."
        chances = ", ".join(f"{100.0 * p.rejected:.0f} % for r = {p.r:g}" for p in self.power)
        return text + (f" The test would reject a flat-normal sample in {chances}." if chances else "")


def normality_test(
    sample: npt.ArrayLike,
    alpha: float = 0.05,
    *,
    alternatives: tuple[float, ...] = (0.5, 1.0, 2.0),
    samples: int = 500,
    random_state: int | None = _SEED,
) -> NormalityDecision:
    """Shapiro-Wilk test of a sample, with its power against flat-normal distributions.

    Parameters
    ----------
    sample
        Errors, 12 to 5000 values.
    alpha
        Level.
    alternatives
        Ratios ``r`` (Eq 17) for which the power is reported; empty for none.
    samples, random_state
        As in `normality_power`.

    Raises
    ------
    EstimationError
        For a sample too short or too long, with values that are not finite, or all alike.
    """
    values = np.asarray(sample, dtype=float).ravel()
    if not np.all(np.isfinite(values)):
        raise EstimationError("the sample holds values that are not finite")
    if not _SMALLEST <= values.size <= _LARGEST:
        raise EstimationError(f"the test needs {_SMALLEST} to {_LARGEST} values, not {values.size}")
    if np.ptp(values) == 0.0:
        raise EstimationError("all values of the sample are equal")
    outcome = stats.shapiro(values)
    critical = shapiro_wilk_critical(values.size, alpha)
    power = tuple(
        normality_power(r, values.size, alpha, samples=samples, random_state=random_state) for r in alternatives
    )
    statistic = float(outcome.statistic)
    return NormalityDecision(
        statistic < critical, statistic, critical, float(outcome.pvalue), values.size, alpha, power
    )


def _check_share(value: float, name: str) -> None:
    if not 0.0 < value < 1.0:
        raise ValueError(f"{name} must lie between 0 and 1, found {value}")
