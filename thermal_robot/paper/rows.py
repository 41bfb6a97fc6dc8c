"""Equations of the ledger's rows, section by section; functions of inputs, printed numbers and case.

No computation reads its answer from the printed results. Measurements and conditions that the paper prints are inputs
and stand in :class:`~thermal_robot.paper.PaperInputs`. The one result that serves as data again is the theoretical
column of Table 1, from which the joints' σ are found.

A function returns what the texts of its row in ``ledger.toml`` name. Of these ``values`` are the entry's numbers,
``compared`` those that are held against the printed ones (by default all), ``low`` and ``high`` their range over the
rounding of the inputs, and ``verdict`` one that follows from something else.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import cache, lru_cache
from importlib.resources import files
from itertools import product
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.integrate import quad
from scipy.optimize import brentq, linprog
from scipy.special import ndtr, ndtri

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability import UniformSpread, capability, failing_probability, required_clearance
from thermal_robot.assembly.probability.normality import Power, normality_power, shapiro_wilk_critical
from thermal_robot.assembly.probability.spread import polygon_in_plane
from thermal_robot.assembly.repeatability import joint_sigmas, tool_covariance
from thermal_robot.assembly.thermal import (
    displacement,
    expansion_coefficient,
    expansion_coefficients,
    mean_shift_test,
    segment_names,
)
from thermal_robot.kinematics import elongation_jacobian, tool_poses
from thermal_robot.paper.entry import Printed, judge, numbers, rounds_to
from thermal_robot.paper.inputs import PaperInputs, joints, rv_m2_with_hand

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


Case: TypeAlias = Mapping[str, Any]
Found: TypeAlias = dict[str, Any]
Model = Literal["covariance", "uniform", "mean shift"]

_HALF = 0.5e-6  # m, half of the last digit of σ in Table 1, of Δl and of the displacements in Table 2
_RATIOS = (0.5, 1.0, 3.0)  # r at which the area under Eq 18 is taken
_AXES = [f"{axis} of row {row}" for row in (1, 2) for axis in "xyz"]


@cache
def table() -> list[dict[str, Any]]:
    """Rows of ``ledger.toml`` in order; a row with cases (``each``) is expanded to one for each case."""
    rows = tomllib.loads(files("thermal_robot.paper").joinpath("ledger.toml").read_text(encoding="utf-8"))["row"]
    return [row | case | {"quantity": row["quantity"].format(**case)} for row in rows for case in row.get("each", [{}])]


@cache
def printed(quantity: str) -> Printed:
    """Return the paper's printed numbers of the ledger row of that quantity."""
    row = next(row for row in table() if row["quantity"] == quantity)
    return Printed.of(row["printed"], row.get("digit"))


# Table 1: theoretical and experimental standard deviations, and its extremes and skewness (section 2).


def theoretical_sigma(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Return the tool's standard deviations x, y, z (2, 3) in both poses, propagated from the joints', Eqs 2–4."""
    covariance = tool_covariance(rv_m2_with_hand(i.l5), joints(*i.poses), (*i.sigma_q, 0.0))
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return {"values": sigma, "sigma": sigma}


def sigma_q_behind_table_1(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Joint standard deviations σ_q, and their feasible ranges, from the theoretical column of Table 1 (Eqs 2–4)."""
    rows = np.reshape(printed("Table 1, theoretical σ").values, (2, 3))
    found = joint_sigmas(rv_m2_with_hand(i.l5), joints(*i.poses), rows, rounding=_HALF)
    low, high, sigma = (values[:4] for values in (found.lower, found.upper, found.sigma))
    ranges = ", ".join(f"{numbers(a, factor=1e6)}–{numbers(b, factor=1e6)}" for a, b in zip(low, high, strict=True))
    open_ = ", ".join(f"σ_q{j + 1}" for j, status in enumerate(found.status) if status == "only bounded")
    return {
        "values": (low, high, sigma),
        "verdict": "not reproducible" if not found.compatible else "only bounded" if open_ else "agrees",
        "ranges": ranges if found.compatible else f"none; best fit {numbers(sigma, factor=1e6)}",
        "bounded": f"{open_} may be zero: only bounded. " if open_ else "",
        "sigma": sigma,
    }


def experimental_sigma(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Non-negative least squares for σ_q from the measured standard deviations of Table 1."""
    given = rv_m2_with_hand(i.l5), joints(*i.poses), i.experimental_sigma
    exact = joint_sigmas(*given, rounding=_HALF)
    sampled = joint_sigmas(*given, rounding=_HALF, sample_size=i.n, confidence=1.0 - i.alpha)
    return {
        "values": (exact.fitted, exact.misfit, exact.needed, sampled.needed),
        "verdict": "agrees" if exact.compatible else "not reproducible",
        "exact": exact,
        "some": "Some" if exact.compatible else "No",
        "error": np.max(i.experimental_sigma) / np.sqrt(2.0 * (i.n - 1)),
        "fits": "would fit" if sampled.compatible else "would not fit either",
    }


def sampled(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Two-sided p-values of Table 1's minima, maxima or skewness for samples of n normal errors, with intervals."""
    skew = case["extreme"] == "skewness"
    below, ends, said = _skewness(i, figures) if skew else _extreme(i, figures, case["extreme"])
    p = 2.0 * np.minimum(below, 1.0 - below)
    decimals, factor = (2, 1.0) if skew else (0, 1e6)
    spans = [f"{numbers(a, decimals, factor=factor)}…{numbers(b, decimals, factor=factor)}" for a, b in ends.T]
    outside = [f"{axis} (p = {value:.3f})" for axis, value in zip(_AXES, p, strict=True) if value < i.alpha]
    few = bool(np.min(p) * 6 >= i.alpha)
    return {
        "values": (ends, p),
        "verdict": "agrees" if few else "not reproducible",
        "level": 100.0 * (1.0 - i.alpha),
        "shown": spans[0] if skew else " / ".join(" ".join(part) for part in (spans[:3], spans[3:])),
        "unit": "" if skew else " µm",
        "p": p.reshape(2, 3),
        "outside": ", ".join(outside) or "none",
        "each": i.alpha / 6,
        "small": "none is so small" if few else "at least one is",
        "said": said,
    }


def _extreme(i: PaperInputs, figures: Printed, extreme: str) -> tuple[Array, Array, str]:
    """Lower-tail probabilities (6,) and central intervals (2, 6) of the largest or smallest of n normal errors."""
    sign = 1 if extreme == "maximum" else -1
    sigma, tails = np.ravel(i.experimental_sigma), np.array([i.alpha / 2.0, 1.0 - i.alpha / 2.0])
    below = ndtr(sign * np.array(figures.values) / sigma) ** i.n
    ends = sign * ndtri(tails[::sign] ** (1.0 / i.n))[:, None] * sigma
    return below if sign > 0 else 1.0 - below, ends, ""


def _skewness(i: PaperInputs, figures: Printed) -> tuple[Array, Array, str]:
    """Lower-tail probabilities and intervals of the skewness of n normal errors, and the simulation's settings."""
    law, seen = _skewness_law(i.n, 10 * i.repetitions, i.seed), np.array(figures.values)
    # Of a symmetric law both halves are used.
    below = (np.searchsorted(law, seen) + len(law) - np.searchsorted(law, -seen)) / (2.0 * len(law))
    end = float(np.quantile(np.abs(law), 1.0 - i.alpha))
    error = np.sqrt(i.alpha * (1.0 - i.alpha) / len(law))
    said = (
        f" Law of the skewness from {len(law)} samples of {i.n} normal numbers (seed {i.seed}); Monte Carlo error of a "
        f"p at {i.alpha:g}: {error:.4f}."
    )
    return below, np.array([[-end], [end]]) * np.ones(6), said


@lru_cache(maxsize=8)
def _skewness_law(n: int, samples: int, seed: int) -> Array:
    """Monte Carlo distribution of the skewness g1 of samples of ``n`` normal numbers: ``samples`` values, ascending."""
    rng = np.random.default_rng(seed)
    sizes = [min(5000, samples - start) for start in range(0, samples, 5000)]
    return np.sort(np.concatenate([stats.skew(rng.standard_normal((size, n)), axis=1) for size in sizes]))


# Section 3: elongations, displacements, the test of the mean, and the polygon (Eqs 5–15, Table 2, Fig 5).


def calculated(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Tool displacement of a row of Table 2 from the elongations, Eqs 9–11 (link directions, no lengths, enter)."""
    robot = rv_m2_with_hand()
    moved = displacement(robot, joints(i.poses[case["n"] - 1]), i.delta_l)[0]
    # Could the printed Δl be rounded so that all six figures of the table come out rounded, not cut off?
    both = elongation_jacobian(robot, joints(*i.poses)).reshape(6, 5)
    targets = np.concatenate([printed(f"Table 2 row {n}, calculated").values for n in (1, 2)])
    limits = np.concatenate([targets + _HALF, _HALF - targets]) / (2.0 * _HALF)
    bounds = [(grown / (2.0 * _HALF) - 0.5, grown / (2.0 * _HALF) + 0.5) for grown in i.delta_l]
    possible = linprog(np.zeros(5), A_ub=np.vstack([both, -both]), b_ub=limits, bounds=bounds).status == 0
    whole = np.round(moved / (2.0 * _HALF))
    axes = [
        f"{axis} would round to {numbers(value / 1000, 3)}"
        for axis, value, shown in zip("xyz", whole, figures.values, strict=True)
        if value != round(shown / (2.0 * _HALF))
    ]
    cut = judge(figures, moved, otherwise="") == "agrees when truncated"
    return {
        "values": moved,
        "moved": moved,
        "cut": f"Cut off, not rounded: {', '.join(axes)}. " if cut else "",
        "possible": "are" if possible else "are no",
        "likely": ", so that cutting off is likely, not certain" if possible else "",
    }


def u_of_eq_13(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Two-sided z test (statistic U, Eq 13) of Table 2's sample means against the static displacements."""
    row = case["n"] - 1
    sigma = i.experimental_sigma[row]
    test = mean_shift_test(i.sample_means[row], i.static_displacements[row], sigma, n=i.n, alpha=i.alpha)
    third = test.power(np.array(sigma) / 3.0)[0]
    verdict = "agrees" if bool(np.all(test.accepted)) else "erratum"
    return {"values": (test.u, test.critical, third), "verdict": verdict, "test": test, "third": third}


def u_before_stabilisation(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Share of the temperature rise that must still be missing for Eq 13's test to reject the final mean, per axis."""
    test = mean_shift_test(np.zeros((2, 3)), i.static_displacements, i.experimental_sigma, n=i.n, alpha=i.alpha)
    share = test.critical / np.abs(test.u)
    rejected = share < 1.0
    slow = [axis for axis, seen in zip(_AXES, np.ravel(rejected), strict=True) if not seen]
    first, second = np.min(share, axis=1)
    return {
        "values": (test.u, share),
        "verdict": "agrees" if np.all(rejected) else "agrees in part" if np.any(rejected) else "not reproducible",
        "u": test.u,
        "critical": np.sum(rejected),
        "first": first,
        "second": second,
        "never": f"; never in {', '.join(slow)}, where the shift is too small for n = {i.n}" if slow else "",
    }


def equation_12(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Condition number of Eq 12 (five elongations from four Δx, one Δz) and standard errors, over random poses."""
    condition, errors, _ = random_systems(i.pose_sets, i.seed)
    noise = i.reading_noise / np.sqrt(i.n)
    best, typical = noise * errors[np.argmin(errors.max(axis=1))], noise * np.median(errors, axis=0)
    middle, least = float(np.median(condition)), condition.min()
    return {
        "values": (middle, least, best.min(), best.max(), typical.min(), typical.max(), i.delta_l),
        "middle": middle,
        "least": least,
        "error": median_error(condition),
        "noise": noise,
        "best": _span(best),
        "typical": _span(typical),
        "grown": _span(np.array(i.delta_l), 0),
    }


def strain(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Coefficient of thermal expansion Δl/(l ΔT), Eq 5, of links and hand, and a common one of the four links."""
    robot, rise = rv_m2_with_hand(i.l5), i.temperature - i.reference_temperature
    found = expansion_coefficients(robot, i.delta_l, rise)
    common = expansion_coefficient(robot, i.delta_l, rise, segments=segment_names(robot)[:4])
    half = expansion_coefficients(robot, _HALF, rise)
    return {"values": (found, common), "links": found[:4], "hand": found[4], "common": common, "half": half}


def figure_5(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Largest displacement and area of the polygon of thermal displacements in y–z (Fig 5, Eqs 14–15)."""
    q = i.pose_5a if case["figure"] == "5a" else i.poses[0]
    sensitivities, grown = elongation_jacobian(rv_m2_with_hand(), joints(q))[0], np.array(i.delta_l)
    one, two = (polygon_in_plane(sensitivities, low, grown, "yz") for low in (0.0 * grown, -grown))
    vertices = len(one.vertices)
    return {
        "values": (one.farthest_distance, two.farthest_distance, one.area, two.area, vertices),
        "one": one,
        "two": two,
        "vertices": vertices,
        "area": 1e12 * one.area,
        "twice": 1e12 * two.area,
    }


def median_error(values: Array) -> float:
    """Return the standard error of a sample median: half the distance of the quantiles 0.5 ± 0.5/√n."""
    rank = 0.5 * np.sqrt(len(values)) / len(values)
    low, high = np.quantile(values, [0.5 - rank, 0.5 + rank])
    return float(high - low) / 2.0


@lru_cache(maxsize=4)
def random_systems(sets: int, seed: int) -> tuple[Array, Array, Array]:
    """Condition numbers and standard errors of Eq 12's design matrix, for ``sets`` times five random poses.

    Condition numbers ``(sets,)`` of four Δx and one Δz, the elongations' standard errors ``(sets, 5)`` from these for a
    noise of 1, and the condition numbers of five Δx and five Δz.
    """
    robot = rv_m2_with_hand()
    q = np.random.default_rng(seed).uniform(robot.lower, robot.upper, (5 * sets, robot.n))
    jacobian = elongation_jacobian(robot, q).reshape(sets, 5, 3, 5)
    square = np.concatenate([jacobian[:, :4, 0], jacobian[:, 4:, 2]], axis=1)
    ten = np.concatenate([jacobian[:, :, 0], jacobian[:, :, 2]], axis=1)
    errors = np.sqrt(np.sum(np.linalg.inv(square) ** 2, axis=2))
    return np.linalg.cond(square), errors, np.linalg.cond(ten)


def _span(lengths: Array, decimals: int = 1) -> str:
    return f"{1e6 * np.min(lengths):.{decimals}f}–{1e6 * np.max(lengths):.{decimals}f}"


# Section 4: the flat-normal distribution and the test of normality (Eqs 16–20).


def area_of_eq_18(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Area under the density of Eq 18, with its factor as printed and corrected."""

    def area(factor: float, r: float) -> float:
        half = np.sqrt(3.0) * r
        height = factor * np.sqrt(2.0 * np.pi)
        whole, _ = quad(
            lambda eta: height * (ndtr(eta + half) - ndtr(eta - half)), 0.0, half + 12.0, epsabs=1e-13, epsrel=1e-12
        )
        return 2.0 * float(whole)

    areas = [area(1.0 / (2.0 * np.sqrt(6.0) * np.pi * r), r) for r in _RATIOS]
    mended = [area(1.0 / (2.0 * np.sqrt(6.0 * np.pi) * r), r) for r in _RATIOS]
    ratios = ", ".join(f"{r:g}" for r in _RATIOS)
    values = {"values": (areas, mended), "compared": areas[:1]}
    return values | {"printed_factor": areas[0], "mended": mended[0], "ratios": ratios}


def variance_of_eq_19(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Variance (2Δy)²/12 of the uniform thermal displacement, Eq 19."""
    variance = _thermal_variance(i)
    shown = {"range": 2.0 * i.delta_y, "deviation": np.sqrt(variance), "mantissa": 1e11 * variance}
    return {"values": variance} | shown


def ratio(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Ratio r = σ_t/σ_k of the thermal to the kinematic standard deviation in y, Eq 17."""
    r = _ratio(i)
    return {"values": r, "r": r, "thermal": np.sqrt(_thermal_variance(i)), "kinematic": i.experimental_sigma[0][1]}


def variance_of_eq_20(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Total variance σ_k² + σ_t² of the kinematic and the thermal error in y, Eq 20."""
    kinematic = i.experimental_sigma[0][1] ** 2
    total, with_printed = kinematic + _thermal_variance(i), kinematic + printed("Eq 19, σ_t²").values[0]
    shown = {"mantissa": 1e10 * total, "deviation": np.sqrt(total), "from_printed": 1e10 * with_printed}
    return {"values": (total, np.sqrt(total), with_printed)} | shown


def critical_w(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Critical value of Shapiro–Wilk's W at n and α, and the level α to which the printed one belongs."""
    w, one_percent = (shapiro_wilk_critical(i.n, alpha) for alpha in (i.alpha, 0.01))
    level = brentq(lambda alpha: shapiro_wilk_critical(i.n, alpha) - figures.values[0], 1e-12, 1.0 - 1e-12)
    values = {"values": (w, one_percent, level), "compared": w}
    return values | {"w": w, "one_percent": one_percent, "level": level, "asked": 100 * i.alpha}


def not_rejected(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Power of the Shapiro–Wilk test at the paper's r and both of its sample sizes, by simulation."""
    r = _ratio(i)
    small, large = (_power(r, n, i) for n in (i.n, i.n_simulated))
    return {
        "values": (small.rejected, large.rejected, r),
        "verdict": "agrees" if _mostly_passes(small) and _mostly_passes(large) else "not reproducible",
        "small": small.rejected,
        "large": large.rejected,
        "r": r,
        "simulated": _simulated(i),
    }


def normal_enough(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Power of the Shapiro–Wilk test at r = 0.5 and 1, by simulation: the paper's claim of normality for r < 1."""
    half, one = ([_power(r, n, i) for n in (i.n, i.n_simulated)] for r in (0.5, 1.0))
    holds, holds_at_half = all(map(_mostly_passes, one)), all(map(_mostly_passes, half))
    shares = [[power.rejected for power in powers] for powers in (half, one)]
    return {
        "values": shares,
        "verdict": "agrees" if holds else "agrees in part" if holds_at_half else "erratum",
        "half": shares[0],
        "one": shares[1],
        "holds": "Holds" if holds else "Only below r ≈ 0.5" if holds_at_half else "Does not hold",
        "kurtosis": [-1.2 * r**4 / (1.0 + r**2) ** 2 for r in (0.5, 1.0)],
        "errors": [np.sqrt(24.0 / n) for n in (i.n, i.n_simulated)],
        "simulated": _simulated(i),
    }


def _thermal_variance(i: PaperInputs) -> float:
    return (2.0 * i.delta_y) ** 2 / 12.0


def _ratio(i: PaperInputs) -> float:
    return float(np.sqrt(_thermal_variance(i)) / i.experimental_sigma[0][1])


def _power(r: float, n: int, i: PaperInputs) -> Power:
    return _simulate(r, n, i.alpha, i.repetitions, i.seed)


@lru_cache(maxsize=64)
def _simulate(r: float, n: int, alpha: float, samples: int, seed: int) -> Power:
    return normality_power(r, n, alpha, samples=samples, random_state=seed)


def _mostly_passes(power: Power) -> bool:
    """Whether the lower confidence bound of the rejection rate is at most twice the level of the test."""
    return power.low <= 2.0 * power.alpha


def _simulated(i: PaperInputs) -> str:
    error = 100.0 * np.sqrt(i.alpha * (1.0 - i.alpha) / i.repetitions)
    return (
        f"{i.repetitions} simulated samples each (seed {i.seed}), Monte Carlo error {error:.1f} % near "
        f"{100 * i.alpha:g} %."
    )


# Section 5: capability, its loss with temperature, and the clearance that makes up for it (Eqs 21–22).


def capability_at(covariance: Array, clearance: float) -> float:
    """Capability C_p with P = 2Φ(3 C_p) − 1, where P (Eq 22) is the probability within the disc of that diameter, m."""
    return float(capability(failing=failing_probability(covariance, clearance)))


@lru_cache(maxsize=256)
def warmed(sigma: tuple[float, float], shift: tuple[float, float], required: float, model: Model) -> tuple[float, ...]:
    """Capability lost to a thermal error ±shift added to standard deviations sigma, both along x and y, m.

    Returns the clearance, m, that has the required capability without thermal error; the capability there with it; its
    loss, and the growth of the clearance that makes up for it, as shares. ``"covariance"``: shift²/3 is added to the
    variances, the paper's Λη. ``"uniform"``: independent uniform errors along both axes. ``"mean shift"``: the whole
    shift is added to the mean.
    """
    cold = np.diag(np.square(sigma))
    warm = cold + np.diag(np.square(shift)) / 3.0 if model == "covariance" else cold
    thermal = {"covariance": None, "uniform": UniformSpread.box(shift), "mean shift": np.array(shift)}[model]
    before = float(required_clearance(cold, capability=required))
    after = float(required_clearance(warm, capability=required, thermal=thermal))
    left = float(capability(failing=failing_probability(warm, before, thermal=thermal)))
    return before, left, 1.0 - left / required, after / before - 1.0


def capability_at_clearance(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Capability C_p at the clearance L of section 5, with its range over the rounding of the printed σ."""
    at, low, high = _capabilities(case["n"], i)
    return {"values": (at, low, high), "compared": at, "at": at, "low": low, "high": high}


def lower_in_row_2(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Share 1 − C_p2/C_p1 by which the capability in row 2 is below that in row 1, at the clearance of section 5."""
    first, second = _capabilities(1, i), _capabilities(2, i)
    at, low, high = (1.0 - second[a] / first[b] for a, b in ((0, 0), (2, 1), (1, 2)))
    return {"values": (at, low, high), "compared": at, "at": at, "low": low, "high": high}


def warmed_capability(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Capability, its loss and the growth of the clearance with a thermal error of ± the sample mean of Table 2."""
    own, other = case["n"], 3 - case["n"]
    sigma, shift = _plane(i.experimental_sigma[own - 1]), _plane(i.sample_means[own - 1])
    covariance, uniform, moved = (
        warmed(sigma, shift, i.capability, m) for m in ("covariance", "uniform", "mean shift")
    )
    low, high = _range(own, "covariance", i)
    fits: dict[tuple[int, str], bool] = {
        (row, m): rounds_to(printed(f"C_p row {row} with ±3 °C"), *_range(row, m, i))
        for row in (own, other)
        for m in ("covariance", "mean shift")
    }
    neither = not any(fits[own, m] and fits[other, m] for m in ("covariance", "mean shift"))
    said = [
        f"{c:.2f}, {numbers(loss, factor=1e2)} %, +{numbers(growth, factor=1e2)} %"
        for _, c, loss, growth in (covariance, moved, uniform)
    ]
    return {
        "values": (covariance, moved[1:], uniform[1:]),
        "compared": covariance[1:],
        "low": low,
        "high": high,
        **dict(zip(("covariance", "moved", "uniform"), said, strict=True)),
        "clearance": covariance[0],
        "as_shift": "reproduces" if fits[own, "mean shift"] else "does not reproduce",
        "neither": "; neither gives both rows" if neither else "",
    }


def loss_from_printed(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Relative loss of capability from 1.33 to the C_p that is printed for ±3 °C, over its rounding."""
    start, (end,), after = 1.33, Printed.of(case["after"]).values, case["after"]
    half = 0.5 * Printed.of(after).digits[0]
    found, low, high = (1.0 - (end + change) / start for change in (0.0, half, -half))
    words = {"values": (found, low, high), "compared": found, "low": low, "high": high, "found": found}
    if rounds_to(figures, found, found):
        return words | {"said": "", "behind": "From the printed C_p."}
    return words | {
        "said": f" ({numbers(low, factor=1e2)} %–{numbers(high, factor=1e2)} % over the rounding of {after})",
        "behind": f"With {after} exact it is a slip, as the fact sheet has it. But {after} is printed to one decimal, "
        f"and {figures.text} belongs to C_p = {start * (1.0 - figures.values[0]):.3f}, which rounds to it; compare the "
        "full shift of the mean in row 1 with ±3 °C.",
    }


def _capabilities(row: int, i: PaperInputs) -> tuple[float, float, float]:
    """Capability C_p of a row at the clearance of section 5; lower and upper bound over the rounding of σ."""
    sigma = np.array(_plane(i.experimental_sigma[row - 1]))
    at, high, low = (capability_at(np.diag((sigma + change) ** 2), i.clearance) for change in (0.0, -_HALF, _HALF))
    return at, low, high


def _range(row: int, model: Model, i: PaperInputs) -> tuple[Array, Array]:
    """Bounds (3,), (3,) of capability, loss and growth of clearance by :func:`warmed`, over rounding of σ and shift."""
    middle = np.array([*_plane(i.experimental_sigma[row - 1]), *_plane(i.sample_means[row - 1])])
    corners = [(middle + change).tolist() for change in product((-_HALF, _HALF), repeat=4)]
    found = [warmed((a, b), (c, d), i.capability, model)[1:] for a, b, c, d in corners]
    return np.min(found, axis=0), np.max(found, axis=0)


def _plane(vector: ArrayLike) -> tuple[float, float]:
    x, y = (float(v) for v in np.asarray(vector, dtype=float)[:2])
    return x, y


# Other slips of the text, and correlations that it leaves out, with their consequences.


def q3_of_row_1(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Effect of the two printed values of q3 in row 1: distance of the tool points, change of the displacement."""
    robot, pose = rv_m2_with_hand(i.l5), i.poses[0]
    q = joints(*((pose[0], pose[1], q3, pose[3]) for q3 in figures.values))
    places, moved = tool_poses(robot, q)[:, :3, 3], displacement(robot, q, i.delta_l)
    apart, change = np.linalg.norm(places[1] - places[0]), np.max(np.abs(moved[1] - moved[0]))
    degrees = np.round(np.degrees(figures.values[0]))
    shown = {"apart": apart, "change": change, "degrees": degrees, "radians": np.radians(degrees)}
    return {"values": (apart, change)} | shown


def law_of_u(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Critical value of U under N(0,1), its distribution (printed as N(1,0)), and how many |U| exceed 1."""
    test = mean_shift_test(i.sample_means, i.static_displacements, i.experimental_sigma, n=i.n, alpha=i.alpha)
    beyond = int(np.sum(np.abs(test.u) > 1.0))
    return {"values": (test.critical, beyond, test.u), "right": test.critical, "beyond": beyond}


def counts_of_eq_12(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Median condition number of Eq 12 with five and with ten equations, and the rank of the system as printed."""
    five, _, ten = random_systems(i.pose_sets, i.seed)
    robot = rv_m2_with_hand()
    q = np.random.default_rng(i.seed).uniform(robot.lower, robot.upper, (5, robot.n))
    rank = int(np.linalg.matrix_rank(elongation_jacobian(robot, q)[:, :1].reshape(-1, 5)))
    found = {"five": np.median(five), "ten": np.median(ten), "rank": rank}
    return {"values": tuple(found.values()), "five_error": median_error(five), "ten_error": median_error(ten)} | found


def kinematic_correlation(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Kinematic correlation of x and y, which the diagonal covariance of Eq 21 neglects, and its effect on C_p."""
    covariance = tool_covariance(rv_m2_with_hand(i.l5), joints(*i.poses), (*i.sigma_q, 0.0))
    rho = _correlations(covariance[:, :2, :2])
    change = np.empty(2)
    for row, sigma in enumerate(np.array(i.experimental_sigma)[:, :2]):
        full = np.outer(sigma, sigma) * np.array([[1.0, rho[row]], [rho[row], 1.0]])
        change[row] = capability_at(full, i.clearance) - capability_at(np.diag(sigma**2), i.clearance)
    return {"values": (rho, change), "rho": rho, "change": change}


def thermal_correlation(i: PaperInputs, figures: Printed, case: Case) -> Found:
    """Thermal correlation of x and y, since the arm grows in its own vertical plane, and its effect on C_p."""
    robot, q = rv_m2_with_hand(), joints(*i.poses)
    flat = elongation_jacobian(robot, q)[:, :2]
    rho = _correlations((flat * np.array(i.delta_l) ** 2) @ np.swapaxes(flat, 1, 2) / 3.0)
    moved, change = displacement(robot, q, i.delta_l)[:, :2], np.empty(2)
    for row, (sigma, shift) in enumerate(zip(np.array(i.experimental_sigma)[:, :2], moved, strict=True)):
        cold = np.diag(sigma**2)
        clearance = float(required_clearance(cold, capability=i.capability))
        along, apart = np.outer(shift, shift) / 3.0, np.diag(shift**2) / 3.0
        change[row] = capability_at(cold + along, clearance) - capability_at(cold + apart, clearance)
    return {"values": (rho, change), "rho": rho, "change": change}


def _correlations(covariance: Array) -> Array:
    return np.asarray(covariance[:, 0, 1] / np.sqrt(covariance[:, 0, 0] * covariance[:, 1, 1]))
