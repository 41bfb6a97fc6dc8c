"""Rows of section 4: the flat-normal distribution and the test of normality (Eqs 16–20)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr

from thermal_robot.assembly.probability.normality import Power, normality_power, shapiro_wilk_critical
from thermal_robot.paper import printed
from thermal_robot.paper.entry import (
    AGREES,
    ERRATUM,
    NOT_PRINTED,
    NOT_REPRODUCIBLE,
    PARTLY,
    Entry,
    floats,
    judge,
    numbers,
)
from thermal_robot.paper.inputs import PaperInputs

_RATIOS = (0.5, 1.0, 3.0)
# r at which the area under Eq 18 is taken.


def area_of_eq_18(inputs: PaperInputs) -> Entry:
    """Integrate the density of Eq 18, with its factor as printed and mended."""
    areas = np.array([_area(1.0 / (2.0 * np.sqrt(6.0) * np.pi * r), r) for r in _RATIOS])
    mended = np.array([_area(1.0 / (2.0 * np.sqrt(6.0 * np.pi) * r), r) for r in _RATIOS])
    return Entry(
        "Eq 18, area under the density",
        "Eq 18",
        printed.AREA_OF_EQ_18.text,
        f"{numbers(areas[0], 4)}; {numbers(mended[0], 4)} with 1/(2√(6π) r)",
        floats(areas, mended),
        judge(printed.AREA_OF_EQ_18, areas[:1], otherwise=ERRATUM),
        f"The same for r = {', '.join(f'{r:g}' for r in _RATIOS)}, by quadrature: 1/√π. The root has to cover π too; "
        "in the paper, or in the transcription that is compared here.",
    )


def variance_of_eq_19(inputs: PaperInputs) -> Entry:
    """Compute the variance of the uniform part, Eq 19."""
    variance = _thermal_variance(inputs)
    return Entry(
        "Eq 19, σ_t²",
        "Eq 19",
        printed.EQ_19.text,
        f"{1e6 * variance * 1e5:.2f}e-5 mm²",
        floats(variance),
        judge(printed.EQ_19, variance, otherwise=ERRATUM),
        f"({numbers(2e3 * inputs.delta_y, 3)} mm)²/12; 8.1e-5 is 0.009²: σ_t = "
        f"{numbers(np.sqrt(variance), 5, factor=1e3)} mm was rounded before it was squared. The unit is mm², not mm.",
    )


def ratio(inputs: PaperInputs) -> Entry:
    """Compute the parameter r of Eq 17."""
    r, kinematic = _ratio(inputs), inputs.experimental_sigma[0][1]
    return Entry(
        "r = σ_t/σ_k",
        "Eq 17",
        printed.RATIO.text,
        f"{r:.3f}",
        floats(r),
        judge(printed.RATIO, r, otherwise=ERRATUM),
        f"{numbers(np.sqrt(_thermal_variance(inputs)), 5, factor=1e3)}/{numbers(kinematic, 3, factor=1e3)}; "
        "0.009/0.018 with the rounded σ_t.",
    )


def variance_of_eq_20(inputs: PaperInputs) -> Entry:
    """Compute the total variance, Eq 20."""
    kinematic = inputs.experimental_sigma[0][1] ** 2
    total, from_printed = kinematic + _thermal_variance(inputs), kinematic + printed.EQ_19.values[0]
    return Entry(
        "Eq 20, total variance",
        "Eq 20",
        printed.EQ_20,
        f"{1e10 * total:.2f}e-4 mm², σ = {numbers(np.sqrt(total), 4, factor=1e3)} mm",
        floats(total, np.sqrt(total), from_printed),
        NOT_PRINTED,
        f"{1e10 * from_printed:.2f}e-4 mm² with the printed 8.1e-5.",
    )


def critical_w(inputs: PaperInputs) -> Entry:
    """Compute the critical value of Shapiro–Wilk's W, and the level to which the printed one belongs."""
    w, one_percent = (shapiro_wilk_critical(inputs.n, alpha) for alpha in (inputs.alpha, 0.01))
    shown = printed.CRITICAL_W.values[0]
    level = float(brentq(lambda alpha: shapiro_wilk_critical(inputs.n, alpha) - shown, 1e-12, 1.0 - 1e-12))
    return Entry(
        "Shapiro–Wilk critical W, n = 100, α = 0.05",
        "section 4",
        printed.CRITICAL_W.text,
        f"{w:.4f} (1 % point: {one_percent:.4f})",
        floats(w, one_percent, level),
        judge(printed.CRITICAL_W, w, otherwise=ERRATUM),
        f"By Royston's approximation (AS R94). The printed value belongs to α = {100 * level:.1f} % (the fact sheet "
        "calls it the 1 % point, which rounds to 0.965): a sample with W between the two passes here, and should not "
        f"at {100 * inputs.alpha:g} %.",
    )


def not_rejected(inputs: PaperInputs) -> Entry:
    """Repeat the paper's own tests of normality, at its r."""
    r = _ratio(inputs)
    small, large = (_power(r, n, inputs) for n in (inputs.n, inputs.n_simulated))
    return Entry(
        "normality at r = 0.5, n = 100 and 5000",
        "section 4, Fig 8",
        printed.NOT_REJECTED,
        f"rejected in {_share(small)} and {_share(large)} of samples",
        floats(small.rejected, large.rejected, r),
        AGREES if _mostly_passes(small) and _mostly_passes(large) else NOT_REPRODUCIBLE,
        f"r = {r:.3f}, n = {inputs.n} and {inputs.n_simulated}, Shapiro–Wilk at α = {inputs.alpha:g}; "
        f"{_simulated(inputs)} A normal sample is rejected nearly as often: the test has nearly no power against so "
        "small a uniform part.",
    )


def normal_enough(inputs: PaperInputs) -> Entry:
    """Test the claim that the total error is normal enough for r < 1."""
    sizes = (inputs.n, inputs.n_simulated)
    half, one = ([_power(r, n, inputs) for n in sizes] for r in (0.5, 1.0))
    holds, holds_at_half = all(map(_mostly_passes, one)), all(map(_mostly_passes, half))
    kurtosis = [-1.2 * r**4 / (1.0 + r**2) ** 2 for r in (0.5, 1.0)]
    return Entry(
        '"normal enough for r < 1"',
        "sections 4 and 6",
        printed.NORMAL_ENOUGH,
        f"rejected at n = {sizes[0]}: {_share(half[0])} (r = 0.5), {_share(one[0])} (r = 1); at n = {sizes[1]}: "
        f"{_share(half[1])}, {_share(one[1])}",
        floats(*(power.rejected for power in (*half, *one))),
        AGREES if holds else PARTLY if holds_at_half else ERRATUM,
        f"{'Holds' if holds else 'Only below r ≈ 0.5' if holds_at_half else 'Does not hold'}: at r = 1 the larger "
        f"sample sees the difference, the smaller has no power. Excess kurtosis {numbers(kurtosis[0], 3)} and "
        f"{numbers(kurtosis[1], 2)}, of which the standard error is {np.sqrt(24.0 / sizes[0]):.2f} and "
        f"{np.sqrt(24.0 / sizes[1]):.2f}. {_simulated(inputs)}",
    )


def _area(factor: float, r: float) -> float:
    half = np.sqrt(3.0) * r
    height = factor * np.sqrt(2.0 * np.pi)
    whole, _ = quad(
        lambda eta: height * (ndtr(eta + half) - ndtr(eta - half)), 0.0, half + 12.0, epsabs=1e-13, epsrel=1e-12
    )
    return 2.0 * float(whole)


def _thermal_variance(inputs: PaperInputs) -> float:
    return (2.0 * inputs.delta_y) ** 2 / 12.0


def _ratio(inputs: PaperInputs) -> float:
    return float(np.sqrt(_thermal_variance(inputs)) / inputs.experimental_sigma[0][1])


def _power(r: float, n: int, inputs: PaperInputs) -> Power:
    return _simulate(r, n, inputs.alpha, inputs.repetitions, inputs.seed)


@lru_cache(maxsize=64)
def _simulate(r: float, n: int, alpha: float, samples: int, seed: int) -> Power:
    return normality_power(r, n, alpha, samples=samples, random_state=seed)


def _mostly_passes(power: Power) -> bool:
    """Whether it is rejected at most twice as often as a normal sample is."""
    return power.low <= 2.0 * power.alpha


def _share(power: Power) -> str:
    return f"{100.0 * power.rejected:.0f} %"


def _simulated(inputs: PaperInputs) -> str:
    error = 100.0 * np.sqrt(inputs.alpha * (1.0 - inputs.alpha) / inputs.repetitions)
    return (
        f"{inputs.repetitions} simulated samples each (seed {inputs.seed}), Monte Carlo error {error:.1f} % near "
        f"{100 * inputs.alpha:g} %."
    )


ROWS = (area_of_eq_18, variance_of_eq_19, ratio, variance_of_eq_20, critical_w, not_rejected, normal_enough)
"""Functions of the inputs, in the paper's order."""
