"""Rows of the ledger, section by section, each a function of the inputs; and the figures that the paper prints.

No computation reads its answer from the printed results. Measurements and conditions that the paper prints are inputs
and stand in :class:`~thermal_robot.paper.PaperInputs`. The one result that serves as data again is the theoretical
column of Table 1, from which the joints' σ are found.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
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
from thermal_robot.paper.entry import (
    AGREES,
    ERRATUM,
    NEGLECTED,
    NOT_PRINTED,
    NOT_REPRODUCIBLE,
    ONLY_BOUNDED,
    PARTLY,
    TRUNCATED,
    Entry,
    Printed,
    floats,
    judge,
    numbers,
    rounds_to,
)
from thermal_robot.paper.inputs import PaperInputs, joints, rv_m2_with_hand

_MICRO = 1e-6

TABLE_1_THEORETICAL = Printed("16 17 17 / 21 16 16 µm", (16e-6, 17e-6, 17e-6, 21e-6, 16e-6, 16e-6), _MICRO)
TABLE_1_EXPERIMENTAL = Printed("14 18 17 / 23 16 18 µm", (14e-6, 18e-6, 17e-6, 23e-6, 16e-6, 18e-6), _MICRO)
TABLE_1_MINIMUM = Printed("−32 −54 −51 / −46 −48 −53 µm", (-32e-6, -54e-6, -51e-6, -46e-6, -48e-6, -53e-6), _MICRO)
TABLE_1_MAXIMUM = Printed("43 57 50 / 68 27 59 µm", (43e-6, 57e-6, 50e-6, 68e-6, 27e-6, 59e-6), _MICRO)
TABLE_1_SKEWNESS = Printed("0.067 0.287 0.075 / 0.225 −0.406 0.045", (0.067, 0.287, 0.075, 0.225, -0.406, 0.045), 0.001)
TABLE_2 = (
    Printed(".008 .014 .009 mm", (8e-6, 14e-6, 9e-6), _MICRO),
    Printed(".017 .003 .004 mm", (17e-6, 3e-6, 4e-6), _MICRO),
)
U_OF_EQ_13 = "outside the critical set"
U_BEFORE_STABILISATION = "in the critical set"
DELTA_L = "14 5 9 7 8 µm, averages"
FIGURE_ONLY = "figure only"
AREA_OF_EQ_18 = Printed("1, as a density", (1.0,), 1e-9)
EQ_19 = Printed("8.1e-5 mm", (8.1e-11,), 0.1e-11)
RATIO = Printed("0.5", (0.5,), 0.1)
EQ_20 = "value missing"
CRITICAL_W = Printed("0.964", (0.964,), 0.001)
NOT_REJECTED = "not rejected"
NORMAL_ENOUGH = "normal enough for r < 1"
CAPABILITY = (Printed("1.33", (1.33,), 0.01), Printed("1.00", (1.00,), 0.01))
LOWER = Printed("24.81 %", (0.2481,), 0.0001)
# C_p, its loss, and the growth of the clearance that makes up for it.
WARMED = (
    Printed("1.1; 17.8 %; +17.21 %", (1.1, 0.178, 0.1721), (0.1, 0.001, 0.0001)),
    Printed("1.17; 12 %; +12 %", (1.17, 0.12, 0.12), (0.01, 0.01, 0.01)),
)
_REQUIRED = Printed("1.33", (1.33,), 0.01)
LOSSES = (
    (_REQUIRED, Printed("1.1", (1.1,), 0.1), Printed("17.8 %", (0.178,), 0.001)),
    (_REQUIRED, Printed("1.17", (1.17,), 0.01), Printed("12 %", (0.12,), 0.01)),
    (_REQUIRED, Printed("1.00", (1.00,), 0.01), LOWER),
)
"""From and to which C_p, and the loss that is printed for it."""
Q3_OF_ROW_1 = (-1.3962, -1.3965)
"""rad, in Table 1 and in Table 2."""
QUANTILE_OF = "N(1,0)"

_ROUNDING = 0.5e-6
# m, half of the last digit of Table 1.


def theoretical_sigma(inputs: PaperInputs) -> Entry:
    """Compare Table 1's theoretical σ with those of the joints' σ_q, by Eqs 2–4."""
    covariance = tool_covariance(rv_m2_with_hand(inputs.l5), joints(*inputs.poses), (*inputs.sigma_q, 0.0))
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return Entry(
        "Table 1, theoretical σ",
        "Table 1, Eqs 2–4",
        TABLE_1_THEORETICAL.text,
        f"{numbers(sigma, 2, factor=1e6)} µm",
        floats(sigma),
        judge(TABLE_1_THEORETICAL, sigma, otherwise=NOT_REPRODUCIBLE),
        f"x y z in rows 1 / 2, from σ_q = {numbers(inputs.sigma_q, 0, factor=1e6)} µrad and l5 = {_mm(inputs.l5)}, "
        "neither of which the paper prints: σ_q is fitted to this very column, six figures with four unknowns. The "
        "fact sheet has 16.8 and 21.3 for y of row 1 and x of row 2, from σ_q before they were rounded; 33 38 62 49 "
        "µrad and 150 mm give 16.75 and 21.25.",
    )


def sigma_q_behind_table_1(inputs: PaperInputs) -> Entry:
    """Find σ_q from the theoretical column of Table 1: Eqs 2–4 the other way round."""
    rows = np.reshape(TABLE_1_THEORETICAL.values, (2, 3))
    found = joint_sigmas(rv_m2_with_hand(inputs.l5), joints(*inputs.poses), rows, rounding=_ROUNDING)
    low, high = found.lower[:4], found.upper[:4]
    ranges = ", ".join(
        f"{numbers(a, 1, factor=1e6)}–{numbers(b, 1, factor=1e6)}" for a, b in zip(low, high, strict=True)
    )
    open_ = [f"σ_q{i + 1}" for i, status in enumerate(found.status) if status == "only bounded"]
    verdict = NOT_REPRODUCIBLE if not found.compatible else ONLY_BOUNDED if open_ else AGREES
    said = f"{', '.join(open_)} may be zero: only bounded. " if open_ else ""
    return Entry(
        "σ_q behind Table 1",
        "Table 1, Eqs 2–4",
        "not printed",
        f"{ranges} µrad" if found.compatible else f"none; best fit {numbers(found.sigma[:4], 1, factor=1e6)} µrad",
        floats(low, high, found.sigma[:4]),
        verdict,
        "All σ_q ≥ 0 (joints 1–4) that give every printed theoretical σ within its rounding at l5 = "
        f"{_mm(inputs.l5)}; least squares chooses {numbers(found.sigma[:4], 0, factor=1e6)}. {said}q5 moves no point "
        "on its own axis, so that nothing is known of σ_q5.",
    )


def experimental_sigma(inputs: PaperInputs) -> Entry:
    """Fit the measured standard deviations of Table 1 with σ_q ≥ 0."""
    robot, q = rv_m2_with_hand(inputs.l5), joints(*inputs.poses)
    exact = joint_sigmas(robot, q, inputs.experimental_sigma, rounding=_ROUNDING)
    sampled = joint_sigmas(
        robot, q, inputs.experimental_sigma, rounding=_ROUNDING, sample_size=inputs.n, confidence=1.0 - inputs.alpha
    )
    error = np.max(inputs.experimental_sigma) / np.sqrt(2.0 * (inputs.n - 1))
    fits = "would fit" if sampled.compatible else "would not fit either"
    return Entry(
        "Table 1, experimental σ",
        "Table 1, Eqs 2–4",
        TABLE_1_EXPERIMENTAL.text,
        f"{numbers(exact.fitted, 1, factor=1e6)} µm, best fit: off by ≤ {numbers(exact.misfit, 2, factor=1e6)}",
        floats(exact.fitted, exact.misfit, exact.needed, sampled.needed),
        AGREES if exact.compatible else NOT_REPRODUCIBLE,
        f"{'Some' if exact.compatible else 'No'} σ_q ≥ 0 gives all six within their rounding (the tolerances would "
        f"have to be {exact.needed:.1f} times as wide). The sampling error of a standard deviation at n = {inputs.n} "
        f"is up to {numbers(error, 1, factor=1e6)} µm; with it they {fits}.",
    )


def minimum(inputs: PaperInputs) -> Entry:
    """Hold the smallest of n errors against its sampling distribution, 1 − (1 − Φ(x/σ))^n."""
    sigma = np.ravel(inputs.experimental_sigma)
    seen = np.array(TABLE_1_MINIMUM.values) / sigma
    below = -np.expm1(inputs.n * np.log(ndtr(-seen)))
    ends = [ndtri(-np.expm1(np.log1p(-p) / inputs.n)) for p in _tails(inputs)]
    return _held(inputs, "Table 1, minimum", TABLE_1_MINIMUM, np.array(ends)[:, None] * sigma, below, 1e6, 0)


def maximum(inputs: PaperInputs) -> Entry:
    """Hold the largest of n errors against its sampling distribution, Φ(x/σ)^n."""
    sigma = np.ravel(inputs.experimental_sigma)
    below = ndtr(np.array(TABLE_1_MAXIMUM.values) / sigma) ** inputs.n
    ends = [ndtri(p ** (1.0 / inputs.n)) for p in _tails(inputs)]
    return _held(inputs, "Table 1, maximum", TABLE_1_MAXIMUM, np.array(ends)[:, None] * sigma, below, 1e6, 0)


def skewness(inputs: PaperInputs) -> Entry:
    """Hold the skewness of n errors against its sampling distribution, simulated."""
    law = _skewness_law(inputs.n, 10 * inputs.repetitions, inputs.seed)
    seen = np.array(TABLE_1_SKEWNESS.values)
    # Of a symmetric law both halves are used.
    below = (np.searchsorted(law, seen) + len(law) - np.searchsorted(law, -seen)) / (2.0 * len(law))
    end = float(np.quantile(np.abs(law), 1.0 - inputs.alpha))
    error = np.sqrt(inputs.alpha * (1.0 - inputs.alpha) / len(law))
    said = (
        f" Law of the skewness from {len(law)} samples of {inputs.n} normal numbers (seed {inputs.seed}); Monte Carlo "
        f"error of a p at {inputs.alpha:g}: {error:.4f}."
    )
    return _held(
        inputs,
        "Table 1, skewness",
        TABLE_1_SKEWNESS,
        np.array([[-end], [end]]) * np.ones(6),
        below,
        1.0,
        2,
        said,
    )


def _held(
    inputs: PaperInputs,
    name: str,
    figures: Printed,
    ends: Array,
    below: Array,
    factor: float,
    decimals: int,
    said: str = "",
) -> Entry:
    """Hold six printed figures against central intervals (2, 6) and the probabilities of less, (6,)."""
    p = 2.0 * np.minimum(below, 1.0 - below)
    unit = " µm" if factor != 1.0 else ""
    spans = [f"{numbers(a, decimals, factor=factor)}…{numbers(b, decimals, factor=factor)}" for a, b in ends.T]
    level = 100.0 * (1.0 - inputs.alpha)
    shown = " / ".join(" ".join(part) for part in (spans[:3], spans[3:])) if len(set(spans)) > 1 else spans[0]
    axes = [f"{axis} of row {row}" for row in (1, 2) for axis in "xyz"]
    outside = [f"{axis} (p = {value:.3f})" for axis, value in zip(axes, p, strict=True) if value < inputs.alpha]
    few = bool(np.min(p) * 6 >= inputs.alpha)
    return Entry(
        name,
        "Table 1",
        figures.text,
        f"{level:g} % within {shown}{unit}",
        floats(ends[0], ends[1], p),
        AGREES if few else NOT_REPRODUCIBLE,
        f"Sampling distribution of n = {inputs.n} normal errors with the experimental σ and mean 0; p two-sided: "
        f"{numbers(p[:3], 2)} / {numbers(p[3:], 2)}. Outside its own interval: {', '.join(outside) or 'none'}; of six "
        f"figures at once p < {inputs.alpha / 6:.4f} would speak against the law, and "
        f"{'none is so small' if few else 'at least one is'}.{said}",
    )


def _tails(inputs: PaperInputs) -> tuple[float, float]:
    return inputs.alpha / 2.0, 1.0 - inputs.alpha / 2.0


@lru_cache(maxsize=8)
def _skewness_law(n: int, samples: int, seed: int) -> Array:
    """Simulate the skewness g1 of normal samples; ascending."""
    rng = np.random.default_rng(seed)
    found = []
    for start in range(0, samples, 5000):
        drawn = rng.standard_normal((min(5000, samples - start), n))
        drawn -= drawn.mean(axis=1, keepdims=True)
        found.append(np.mean(drawn**3, axis=1) / np.mean(drawn**2, axis=1) ** 1.5)
    return np.sort(np.concatenate(found))


SCATTER = (theoretical_sigma, sigma_q_behind_table_1, experimental_sigma, minimum, maximum, skewness)
"""Table 1: theoretical and experimental standard deviations, and its extremes and skewness (section 2)."""


_DIGIT = 1e-6
# m, the last printed digit of Δl and of Table 2.


def calculated(row: int, inputs: PaperInputs) -> Entry:
    """Compare Table 2's displacement with Eqs 9–11, which need directions, not lengths.

    The paper calls it measured; "calculated" is this ledger's inference, and the row says so.
    """
    robot = rv_m2_with_hand()
    moved = displacement(robot, joints(inputs.poses[row]), inputs.delta_l)[0]
    figures = TABLE_2[row]
    verdict = judge(figures, moved, otherwise=ERRATUM)
    # Could the printed Δl be rounded so that all six figures of the table come out rounded, not cut off?
    both = elongation_jacobian(robot, joints(*inputs.poses)).reshape(6, 5)
    targets = np.array([*TABLE_2[0].values, *TABLE_2[1].values])
    limits = np.concatenate([targets + _DIGIT / 2, -(targets - _DIGIT / 2)]) / _DIGIT
    bounds = [((grown / _DIGIT) - 0.5, (grown / _DIGIT) + 0.5) for grown in inputs.delta_l]
    possible = linprog(np.zeros(5), A_ub=np.vstack([both, -both]), b_ub=limits, bounds=bounds).status == 0
    axes = [
        f"{axis} would round to {numbers(round(value / _DIGIT) / 1000, 3)}"
        for axis, value, shown in zip("xyz", moved, figures.values, strict=True)
        if round(value / _DIGIT) != round(shown / _DIGIT)
    ]
    say = f"Cut off, not rounded: {', '.join(axes)}. " if verdict == TRUNCATED else ""
    return Entry(
        f"Table 2 row {row + 1}, calculated",
        "Table 2, Eqs 9–11",
        figures.text,
        f"{numbers(moved, 5, factor=1e3)} mm",
        floats(moved),
        verdict,
        "The paper calls these figures measured; that they were calculated, by Eqs 9–11 from Δl, is an inference of "
        f"this ledger. {say}Δl are themselves printed to 1 µm: within their rounding there "
        f"{'are' if possible else 'are no'} Δl for which both rows of Table 2 come out "
        f"rounded{', so that cutting off is likely, not certain' if possible else ''}.",
    )


def u_of_eq_13(row: int, inputs: PaperInputs) -> Entry:
    """Test the mean after stabilisation, Eq 13."""
    test = mean_shift_test(
        inputs.sample_means[row],
        inputs.static_displacements[row],
        inputs.experimental_sigma[row],
        n=inputs.n,
        alpha=inputs.alpha,
    )
    third = test.power(np.array(inputs.experimental_sigma[row]) / 3.0)[0]
    return Entry(
        f"U of Eq 13, row {row + 1}",
        "Eq 13, Table 2",
        U_OF_EQ_13,
        f"{numbers(test.u, 2)} (±{numbers(test.critical, 3)})",
        floats(test.u, test.critical, third),
        AGREES if bool(np.all(test.accepted)) else ERRATUM,
        f"x y z, with the experimental σ and n = {inputs.n}. Accepted means no more than this: a mean that is off by "
        f"σ/3 is seen with {100 * third:.0f} %.",
    )


def u_before_stabilisation(inputs: PaperInputs) -> Entry:
    """Find what is missing of the rise of temperature while Eq 13 still rejects the final mean."""
    test = mean_shift_test(
        np.zeros((2, 3)), inputs.static_displacements, inputs.experimental_sigma, n=inputs.n, alpha=inputs.alpha
    )
    share = test.critical / np.abs(test.u)
    rejected = share < 1.0
    slow = [f"{axis} of row {row + 1}" for row in (0, 1) for axis, s in zip("xyz", share[row], strict=True) if s >= 1.0]
    never = f"; never in {', '.join(slow)}, where the shift is too small for n = {inputs.n}" if slow else ""
    return Entry(
        "U of Eq 13 before stabilisation",
        "section 3",
        U_BEFORE_STABILISATION,
        f"{numbers(test.u, 1)} at the start",
        floats(test.u, share),
        AGREES if np.all(rejected) else PARTLY if np.any(rejected) else NOT_REPRODUCIBLE,
        f"Means still at 0, held against Table 2: {np.sum(rejected)} of 6 components are critical. If all links lag "
        "alike, the means are rejected until less than "
        f"{' and '.join(numbers(100 * s, 0) for s in np.min(share, axis=1))} % (rows 1 and 2) of the rise is "
        f"missing{never}. The paper prints neither times nor time constants.",
    )


def equation_12(inputs: PaperInputs) -> Entry:
    """Say how well five unknowns come from four Δx and one Δz, over random poses."""
    condition, errors, _ = random_systems(inputs.pose_sets, inputs.seed)
    noise = inputs.reading_noise / np.sqrt(inputs.n)
    best, typical = noise * errors[np.argmin(errors.max(axis=1))], noise * np.median(errors, axis=0)
    middle = float(np.median(condition))
    return Entry(
        "Eq 12, five unknowns",
        "Eq 12",
        DELTA_L,
        f"condition: median {middle:.0f} ± {median_error(condition):.1f}, best {condition.min():.1f}; standard error "
        f"{_span(best)} µm at best, {_span(typical)} typically",
        floats(middle, condition.min(), best.min(), best.max(), typical.min(), typical.max(), inputs.delta_l),
        NOT_REPRODUCIBLE,
        f"Neither the five poses nor their displacements are printed. {inputs.pose_sets} sets of five poses drawn "
        f"evenly within the joint limits (seed {inputs.seed}), noise {numbers(noise, 1, factor=1e6)} µm a component = "
        f"{numbers(inputs.reading_noise, 0, factor=1e6)} µm a reading over n = {inputs.n}: the Δl themselves are "
        f"{_span(np.array(inputs.delta_l), 0)} µm. The fact sheet says 2–4 at best and 13–31 typically for 30 µm: "
        "that holds for 3 µm a component, as here; a single reading of 30 µm has errors ten times as large.",
    )


def strain(inputs: PaperInputs) -> Entry:
    """Compute the strain for a kelvin, Δl/(l ΔT), Eq 5."""
    robot, rise = rv_m2_with_hand(inputs.l5), inputs.temperature - inputs.reference_temperature
    found = expansion_coefficients(robot, inputs.delta_l, rise)
    common = expansion_coefficient(robot, inputs.delta_l, rise, segments=segment_names(robot)[:4])
    half = expansion_coefficients(robot, 0.5 * _DIGIT, rise)
    return Entry(
        "strain Δl/(l·ΔT)",
        "section 3, Eq 5",
        "not printed",
        f"{numbers(found[:4], 1, factor=1e6)} (l1–l4), {numbers(found[4], 1, factor=1e6)} (l5); "
        f"{numbers(common, 1, factor=1e6)} together over l1–l4, 1e-6/K",
        floats(found, common),
        NOT_PRINTED,
        "Not aluminium's 23e-6/K: links like steel (11.5), or aluminium measured against a steel table (23 − 11.5). "
        f"The rounding of Δl alone is worth ±{numbers(half, 1, factor=1e6)}; l5 = {1e3 * inputs.l5:g} mm is assumed.",
    )


def fig_5(which: str, inputs: PaperInputs) -> Entry:
    """Find the farthest point of the polygon in y–z, Eqs 14–15."""
    q = inputs.pose_5a if which == "5a" else inputs.poses[0]
    sensitivities = elongation_jacobian(rv_m2_with_hand(), joints(q))[0]
    grown = np.array(inputs.delta_l)
    one, two = (polygon_in_plane(sensitivities, low, grown, "yz") for low in (0.0 * grown, -grown))
    note = " The fact sheet has 27.4 where the printed Δl give 27.35." if which == "5a" else ""
    return Entry(
        f"Fig {which}, farthest point in y–z",
        "Fig 5, Eqs 14–15",
        FIGURE_ONLY,
        f"{numbers(one.farthest_distance, 2, factor=1e6)} µm for Δl in [0, Δl]; "
        f"{numbers(two.farthest_distance, 2, factor=1e6)} µm for ±Δl",
        floats(one.farthest_distance, two.farthest_distance, one.area, two.area, len(one.vertices)),
        NOT_PRINTED,
        f"A zonotope with {len(one.vertices)} vertices and {numbers(one.area, 0, factor=1e12)} µm² "
        f"({numbers(two.area, 0, factor=1e12)} for ±Δl); the text has the figure's caption only, without the "
        f"bounds.{note}",
    )


def median_error(values: Array) -> float:
    """Return the Monte Carlo standard error of a median: order statistics one standard error of rank away."""
    rank = 0.5 * np.sqrt(len(values)) / len(values)
    low, high = np.quantile(values, [0.5 - rank, 0.5 + rank])
    return float(high - low) / 2.0


@lru_cache(maxsize=4)
def random_systems(sets: int, seed: int) -> tuple[Array, Array, Array]:
    """Set up Eq 12 at ``sets`` times five random poses; four Δx and one Δz, or all ten.

    Conditions ``(sets,)``, standard errors ``(sets, 5)`` of the elongations for a noise of 1, and the conditions of all
    ten.
    """
    robot = rv_m2_with_hand()
    q = np.random.default_rng(seed).uniform(robot.lower, robot.upper, (5 * sets, robot.n))
    jacobian = elongation_jacobian(robot, q).reshape(sets, 5, 3, 5)
    square = np.concatenate([jacobian[:, :4, 0], jacobian[:, 4:, 2]], axis=1)
    ten = np.concatenate([jacobian[:, :, 0], jacobian[:, :, 2]], axis=1)
    errors = np.sqrt(np.sum(np.linalg.inv(square) ** 2, axis=2))
    return np.linalg.cond(square), errors, np.linalg.cond(ten)


def critical(alpha: float) -> float:
    """Return u(1 − α/2) of N(0,1)."""
    return float(ndtri(1.0 - alpha / 2.0))


def _span(lengths: Array, decimals: int = 1) -> str:
    return f"{1e6 * np.min(lengths):.{decimals}f}–{1e6 * np.max(lengths):.{decimals}f}"


WARMING = (
    partial(calculated, 0),
    partial(calculated, 1),
    partial(u_of_eq_13, 0),
    partial(u_of_eq_13, 1),
    u_before_stabilisation,
    equation_12,
    strain,
    partial(fig_5, "5a"),
    partial(fig_5, "5b"),
)
"""Section 3: elongations, displacements, the test of the mean, and the polygon (Eqs 5–15, Table 2, Fig 5)."""


_RATIOS = (0.5, 1.0, 3.0)
# r at which the area under Eq 18 is taken.


def area_of_eq_18(inputs: PaperInputs) -> Entry:
    """Integrate the density of Eq 18, with its factor as printed and mended."""
    areas = np.array([_area(1.0 / (2.0 * np.sqrt(6.0) * np.pi * r), r) for r in _RATIOS])
    mended = np.array([_area(1.0 / (2.0 * np.sqrt(6.0 * np.pi) * r), r) for r in _RATIOS])
    return Entry(
        "Eq 18, area under the density",
        "Eq 18",
        AREA_OF_EQ_18.text,
        f"{numbers(areas[0], 4)}; {numbers(mended[0], 4)} with 1/(2√(6π) r)",
        floats(areas, mended),
        judge(AREA_OF_EQ_18, areas[:1], otherwise=ERRATUM),
        f"The same for r = {', '.join(f'{r:g}' for r in _RATIOS)}, by quadrature: 1/√π. The root has to cover π too; "
        "in the paper, or in the transcription that is compared here.",
    )


def variance_of_eq_19(inputs: PaperInputs) -> Entry:
    """Compute the variance of the uniform part, Eq 19."""
    variance = _thermal_variance(inputs)
    return Entry(
        "Eq 19, σ_t²",
        "Eq 19",
        EQ_19.text,
        f"{1e6 * variance * 1e5:.2f}e-5 mm²",
        floats(variance),
        judge(EQ_19, variance, otherwise=ERRATUM),
        f"({numbers(2e3 * inputs.delta_y, 3)} mm)²/12; 8.1e-5 is 0.009²: σ_t = "
        f"{numbers(np.sqrt(variance), 5, factor=1e3)} mm was rounded before it was squared. The unit is mm², not mm.",
    )


def ratio(inputs: PaperInputs) -> Entry:
    """Compute the parameter r of Eq 17."""
    r, kinematic = _ratio(inputs), inputs.experimental_sigma[0][1]
    return Entry(
        "r = σ_t/σ_k",
        "Eq 17",
        RATIO.text,
        f"{r:.3f}",
        floats(r),
        judge(RATIO, r, otherwise=ERRATUM),
        f"{numbers(np.sqrt(_thermal_variance(inputs)), 5, factor=1e3)}/{numbers(kinematic, 3, factor=1e3)}; "
        "0.009/0.018 with the rounded σ_t.",
    )


def variance_of_eq_20(inputs: PaperInputs) -> Entry:
    """Compute the total variance, Eq 20."""
    kinematic = inputs.experimental_sigma[0][1] ** 2
    total, from_printed = kinematic + _thermal_variance(inputs), kinematic + EQ_19.values[0]
    return Entry(
        "Eq 20, total variance",
        "Eq 20",
        EQ_20,
        f"{1e10 * total:.2f}e-4 mm², σ = {numbers(np.sqrt(total), 4, factor=1e3)} mm",
        floats(total, np.sqrt(total), from_printed),
        NOT_PRINTED,
        f"{1e10 * from_printed:.2f}e-4 mm² with the printed 8.1e-5.",
    )


def critical_w(inputs: PaperInputs) -> Entry:
    """Compute the critical value of Shapiro–Wilk's W, and the level to which the printed one belongs."""
    w, one_percent = (shapiro_wilk_critical(inputs.n, alpha) for alpha in (inputs.alpha, 0.01))
    shown = CRITICAL_W.values[0]
    level = float(brentq(lambda alpha: shapiro_wilk_critical(inputs.n, alpha) - shown, 1e-12, 1.0 - 1e-12))
    return Entry(
        "Shapiro–Wilk critical W, n = 100, α = 0.05",
        "section 4",
        CRITICAL_W.text,
        f"{w:.4f} (1 % point: {one_percent:.4f})",
        floats(w, one_percent, level),
        judge(CRITICAL_W, w, otherwise=ERRATUM),
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
        NOT_REJECTED,
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
        NORMAL_ENOUGH,
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


RANDOMISED = (area_of_eq_18, variance_of_eq_19, ratio, variance_of_eq_20, critical_w, not_rejected, normal_enough)
"""Section 4: the flat-normal distribution and the test of normality (Eqs 16–20)."""


Model = Literal["covariance", "uniform", "mean shift"]

_HALF = 0.5e-6
# m, half of the last digit of σ in Table 1 and of the displacements in Table 2.


@dataclass(frozen=True)
class Warmed:
    """What a thermal error does at the clearance where the process had the required capability.

    ``clearance``, m, is that where the capability without temperature is the required one; ``capability`` is there,
    with temperature; ``loss`` of it and ``growth`` of the clearance that makes up for it are shares.
    """

    clearance: float
    capability: float
    loss: float
    growth: float

    @property
    def compared(self) -> tuple[float, float, float]:
        """The three figures that the paper prints."""
        return self.capability, self.loss, self.growth


def capability_at(covariance: Array, clearance: float) -> float:
    """Return C_p by Eq 22 over the disc of diameter L and P = 2Φ(3 C_p) − 1."""
    return float(capability(failing=failing_probability(covariance, clearance)))


@lru_cache(maxsize=256)
def warmed(sigma: tuple[float, float], shift: tuple[float, float], required: float, model: Model) -> Warmed:
    """Compute what a thermal error of ±shift does beside standard deviations sigma, both along x and y, m.

    ``"covariance"``: shift²/3 is added to the variances, the paper's Λη. ``"uniform"``: the axes are uniform and
    independent, not replaced by normal ones. ``"mean shift"``: the whole shift stands.
    """
    cold = np.diag(np.square(sigma))
    warm = cold + np.diag(np.square(shift)) / 3.0 if model == "covariance" else cold
    thermal = {"covariance": None, "uniform": UniformSpread.box(shift), "mean shift": np.array(shift)}[model]
    before = float(required_clearance(cold, capability=required))
    after = float(required_clearance(warm, capability=required, thermal=thermal))
    left = float(capability(failing=failing_probability(warm, before, thermal=thermal)))
    return Warmed(before, left, 1.0 - left / required, after / before - 1.0)


def capability_row(row: int, inputs: PaperInputs) -> Entry:
    """Compute C_p at the clearance of section 5."""
    at, low, high = _capabilities(row, inputs)
    return Entry(
        f"C_p at L = 0.145 mm, row {row + 1}",
        "section 5, Eq 22",
        CAPABILITY[row].text,
        f"{at:.2f} ({low:.2f}–{high:.2f} over σ's rounding)",
        floats(at, low, high),
        judge(CAPABILITY[row], at, low=low, high=high, otherwise=NOT_REPRODUCIBLE),
        f"At L = {_mm(inputs.clearance)}, experimental σ without correlation, P over the disc of diameter L, P = "
        "2Φ(3 C_p) − 1: the paper does not print its convention, this one gives both rows.",
    )


def lower_in_row_2(inputs: PaperInputs) -> Entry:
    """Compute by how much the capability of row 2 is lower than that of row 1, at one clearance."""
    first, second = _capabilities(0, inputs), _capabilities(1, inputs)
    low, high = 1.0 - second[2] / first[1], 1.0 - second[1] / first[2]
    at = 1.0 - second[0] / first[0]
    return Entry(
        "C_p of row 2 below that of row 1",
        "section 5",
        LOWER.text,
        f"{_percent(at)} ({_percent(low)}–{_percent(high)} over σ's rounding)",
        floats(at, low, high),
        judge(LOWER, at, low=low, high=high, otherwise=NOT_REPRODUCIBLE),
        f"At L = {_mm(inputs.clearance)}. The figure is (1.33 − 1.00)/1.33, from capabilities that σ in whole µm "
        "determines to ±3 %: its four digits are two at most.",
    )


def warmed_row(row: int, inputs: PaperInputs) -> Entry:
    """Compute C_p, loss and clearance with a thermal error of ± the measured shift."""
    sigma, shift = _plane(inputs.experimental_sigma[row]), _plane(inputs.sample_means[row])
    by, uniform, moved = (warmed(sigma, shift, inputs.capability, m) for m in ("covariance", "uniform", "mean shift"))
    figures = WARMED[row]
    simple: tuple[Model, Model] = ("covariance", "mean shift")
    ranges = {m: _range(row, m, inputs) for m in simple}
    fits = {m: rounds_to(figures, *bounds) for m, bounds in ranges.items()}
    other = {m: rounds_to(WARMED[1 - row], *_range(1 - row, m, inputs)) for m in ranges}
    low, high = ranges["covariance"]
    verdict = judge(figures, by.compared, low=low, high=high, otherwise=NOT_REPRODUCIBLE)
    as_shift = "reproduces" if fits["mean shift"] else "does not reproduce"
    neither = not any(fits[m] and other[m] for m in ranges)
    return Entry(
        f"C_p row {row + 1} with ±3 °C",
        "section 5, Fig 10",
        figures.text,
        f"{_said(by)} (covariance Λη); {_said(moved)} (mean shift); {_said(uniform)} (uniform, exact)",
        floats(by.clearance, by.compared, moved.compared, uniform.compared),
        verdict,
        f"C_p, loss, clearance, at L = {numbers(by.clearance, 3, factor=1e3)} mm where C_p = {inputs.capability:g}, "
        "with Table 2's measured shifts. Over the rounding of σ and shift Λη, the paper's wording, gives "
        f"{_percent(low[1])}–{_percent(high[1])} and +{_percent(low[2])}–{_percent(high[2])}; the full shift of the "
        f"mean {as_shift} the printed figures{'; neither gives both rows' if neither else ''}. The fact sheet calls "
        "the first model uniform: it is the normal law of the same variance; the uniform law itself loses less.",
    )


def loss_from_printed(which: int, inputs: PaperInputs) -> Entry:
    """Compute a printed loss from the printed capabilities: arithmetic alone."""
    before, after, loss = LOSSES[which]
    start, end, half = before.values[0], after.values[0], 0.5 * np.max(after.digits)
    found, low, high = (1.0 - (end + change) / start for change in (0.0, half, -half))
    verdict = judge(loss, found, low=low, high=high, otherwise=ERRATUM)
    exact = rounds_to(loss, found)
    why = (
        "From the printed C_p."
        if exact
        else (
            f"With {after.text} exact it is a slip, as the fact sheet has it. But {after.text} is printed to one "
            f"decimal, and {loss.text} belongs to C_p = {start * (1.0 - loss.values[0]):.3f}, which rounds to it; "
            "compare the full shift of the mean in row 1 with ±3 °C."
        )
    )
    said = "" if exact else f" ({_percent(low)}–{_percent(high)} over the rounding of {after.text})"
    return Entry(
        f"({before.text} − {after.text})/{before.text}",
        "section 5",
        loss.text,
        f"{100 * found:.2f} %{said}",
        floats(found, low, high),
        verdict,
        why,
    )


def _capabilities(row: int, inputs: PaperInputs) -> tuple[float, float, float]:
    """C_p, and its least and largest value over the rounding of σ: it falls with either."""
    sigma = np.array(_plane(inputs.experimental_sigma[row]))
    at, high, low = (capability_at(np.diag((sigma + change) ** 2), inputs.clearance) for change in (0.0, -_HALF, _HALF))
    return at, low, high


def _range(row: int, model: Model, inputs: PaperInputs) -> tuple[Array, Array]:
    """Least and largest C_p, loss and growth over the corners of what the rounding of σ and shift leaves open."""
    middle = np.array([*_plane(inputs.experimental_sigma[row]), *_plane(inputs.sample_means[row])])
    found = []
    for change in product((-_HALF, _HALF), repeat=4):
        a, b, c, d = (float(v) for v in middle + np.array(change))
        found.append(warmed((a, b), (c, d), inputs.capability, model).compared)
    return np.min(found, axis=0), np.max(found, axis=0)


def _plane(vector: ArrayLike) -> tuple[float, float]:
    x, y = (float(v) for v in np.asarray(vector, dtype=float)[:2])
    return x, y


def _said(case: Warmed) -> str:
    return f"{case.capability:.2f}, {_percent(case.loss)}, +{_percent(case.growth)}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %".replace("-", "−")


def _mm(clearance: float) -> str:
    return f"{1e3 * clearance:g} mm"


JOINING = (
    partial(capability_row, 0),
    partial(capability_row, 1),
    lower_in_row_2,
    partial(warmed_row, 0),
    partial(warmed_row, 1),
    partial(loss_from_printed, 0),
    partial(loss_from_printed, 1),
    partial(loss_from_printed, 2),
)
"""Section 5: capability, its loss with temperature, and the clearance that makes up for it (Eqs 21–22)."""


def q3_of_row_1(inputs: PaperInputs) -> Entry:
    """Compare two values of q3 in one pose: the tool's place, and the calculated displacement of Table 2."""
    robot, pose = rv_m2_with_hand(inputs.l5), inputs.poses[0]
    q = joints(*((pose[0], pose[1], q3, pose[3]) for q3 in Q3_OF_ROW_1))
    places = tool_poses(robot, q)[:, :3, 3]
    apart = float(np.linalg.norm(places[1] - places[0]))
    moved = displacement(robot, q, inputs.delta_l)
    change = float(np.max(np.abs(moved[1] - moved[0])))
    one, two = Q3_OF_ROW_1
    degrees = round(np.degrees(one))
    return Entry(
        "q3 of row 1",
        "Tables 1 and 2",
        f"{numbers(one, 4)} and {numbers(two, 4)} rad",
        f"{numbers(apart, 0, factor=1e6)} µm at the tool; {numbers(change, 4, factor=1e6)} µm in Table 2",
        floats(apart, change),
        AGREES if one == two else ERRATUM,
        f"One pose, two values. {numbers(degrees, 0)}° are {numbers(np.radians(degrees), 5)} rad, of which the first "
        "is cut off as 0.5235 is of 30°; the second is no whole degree. For the place of the tool, compare the "
        "stated repeatability of ±0.1 mm; for its thermal displacement it hardly matters.",
    )


def quantile_of(inputs: PaperInputs) -> Entry:
    """Compare the quantiles of N(1,0) and N(0,1), the law of U."""
    u = mean_shift_test(
        inputs.sample_means, inputs.static_displacements, inputs.experimental_sigma, n=inputs.n, alpha=inputs.alpha
    ).u
    right, beyond = critical(inputs.alpha), int(np.sum(np.abs(u) > 1.0))
    return Entry(
        "law of U",
        "section 3",
        QUANTILE_OF,
        f"N(0,1): u(1 − α/2) = {right:.3f}",
        floats(right, beyond, u),
        ERRATUM,
        f"N(1,0) has no spread: each of its quantiles is 1, and {beyond} of the six U would be critical. Eq 13 itself "
        "has N(0,1).",
    )


def differential_of_eq_16(inputs: PaperInputs) -> Entry:
    """Note the convolution without its differential."""
    return Entry(
        "Eq 16, convolution",
        "Eq 16",
        "no differential",
        "–",
        (),
        ERRATUM,
        "The integral lacks dy, and its arguments are not those of a function of η. No figure follows from it.",
    )


def counts_of_eq_12(inputs: PaperInputs) -> Entry:
    """Count equations and unknowns of Eq 12, as it is printed and as the text says."""
    five, _, ten = random_systems(inputs.pose_sets, inputs.seed)
    robot = rv_m2_with_hand()
    q = np.random.default_rng(inputs.seed).uniform(robot.lower, robot.upper, (5, robot.n))
    ranks = [int(np.linalg.matrix_rank(elongation_jacobian(robot, q)[:, :1].reshape(-1, 5)))]
    return Entry(
        "Eq 12, points and equations",
        "Eq 12",
        "k = 1 … n − 1 (four), Δz without index; text: five points",
        f"4 Δx + 1 Δz: median condition {np.median(five):.0f} ± {median_error(five):.1f}; Δx and Δz at five: "
        f"{np.median(ten):.1f} ± {median_error(ten):.2f}",
        floats(np.median(five), np.median(ten), ranks[0]),
        ERRATUM,
        f"Four Δx alone leave l1 open (five of them have rank {ranks[0]}), so that one Δz at an unnamed point must "
        f"complete the five equations. Both components at all five points would cost nothing. {inputs.pose_sets} sets "
        f"(seed {inputs.seed}).",
    )


def symbols(inputs: PaperInputs) -> Entry:
    """Note symbols that change their letter."""
    return Entry(
        "symbols of σ",
        "sections 4 and 6",
        "σ_t, σ_r; σ_k, σ_i",
        "–",
        (),
        ERRATUM,
        "The thermal σ_t is also written σ_r, the kinematic σ_k also σ_i. No figure follows from it.",
    )


def kinematic_correlation(inputs: PaperInputs) -> Entry:
    """Compute the x–y correlation that the diagonal covariance of Eq 21 drops."""
    covariance = tool_covariance(rv_m2_with_hand(inputs.l5), joints(*inputs.poses), (*inputs.sigma_q, 0.0))
    rho = np.array([_correlation(c[:2, :2]) for c in covariance])
    change = np.empty(2)
    for row, sigma in enumerate(np.array(inputs.experimental_sigma)[:, :2]):
        full = np.outer(sigma, sigma) * np.array([[1.0, rho[row]], [rho[row], 1.0]])
        change[row] = capability_at(full, inputs.clearance) - capability_at(np.diag(sigma**2), inputs.clearance)
    return Entry(
        "x–y correlation of the kinematic error",
        "Eq 21",
        "left out",
        f"ρ = {numbers(rho[0], 2)} and {numbers(rho[1], 2)}; C_p changes by {numbers(change[0], 4)} and "
        f"{numbers(change[1], 4)}",
        floats(rho, change),
        NEGLECTED,
        f"From σ_q and l5, Eqs 2–4 with all of J Σ Jᵀ; C_p with the experimental σ at L = {_mm(inputs.clearance)}.",
    )


def thermal_correlation(inputs: PaperInputs) -> Entry:
    """Compute the x–y correlation of a thermal shift: the arm grows in its own vertical plane."""
    robot, q = rv_m2_with_hand(), joints(*inputs.poses)
    flat = elongation_jacobian(robot, q)[:, :2]
    spread = (flat * np.array(inputs.delta_l) ** 2) @ np.swapaxes(flat, 1, 2) / 3.0
    rho = np.array([_correlation(c) for c in spread])
    moved = displacement(robot, q, inputs.delta_l)[:, :2]
    change = np.empty(2)
    for row, (sigma, shift) in enumerate(zip(np.array(inputs.experimental_sigma)[:, :2], moved, strict=True)):
        cold = np.diag(sigma**2)
        clearance = float(required_clearance(cold, capability=inputs.capability))
        along, apart = np.outer(shift, shift) / 3.0, np.diag(shift**2) / 3.0
        change[row] = capability_at(cold + along, clearance) - capability_at(cold + apart, clearance)
    return Entry(
        "x–y correlation of the thermal error",
        "Eqs 20–21",
        "left out",
        f"ρ = {numbers(rho[0], 2)} and {numbers(rho[1], 2)}; C_p changes by {numbers(change[0], 4)} and "
        f"{numbers(change[1], 4)}",
        floats(rho, change),
        NEGLECTED,
        "Every elongation moves the tool in the vertical plane of the arm (Eqs 9–10: Δx/Δy = tan q1), up or down: "
        "±1, whatever the temperatures. C_p with the calculated shifts of Table 2, covariance Λη, where C_p = "
        f"{inputs.capability:g} without them.",
    )


def _correlation(covariance: Array) -> float:
    return float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]))


SLIPS = (
    q3_of_row_1,
    quantile_of,
    differential_of_eq_16,
    counts_of_eq_12,
    symbols,
    kinematic_correlation,
    thermal_correlation,
)
"""Other slips of the text, and correlations that it leaves out, with their consequences."""

ROWS = (*SCATTER, *WARMING, *RANDOMISED, *JOINING, *SLIPS)
"""Every row of the ledger as a function of the inputs, in the paper's order; slips last."""
