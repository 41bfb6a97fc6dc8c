"""Rows of Table 1: theoretical and experimental standard deviations, and its extremes and skewness (section 2)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import ndtr, ndtri

from thermal_robot.arrays import Array
from thermal_robot.assembly.repeatability import joint_sigmas, tool_covariance
from thermal_robot.paper import printed
from thermal_robot.paper.entry import (
    AGREES,
    NOT_REPRODUCIBLE,
    ONLY_BOUNDED,
    Entry,
    Printed,
    floats,
    judge,
    numbers,
)
from thermal_robot.paper.inputs import PaperInputs, joints, rv_m2_with_hand

_ROUNDING = 0.5e-6
# m, half of the last digit of Table 1.


def theoretical_sigma(inputs: PaperInputs) -> Entry:
    """Compare Table 1's theoretical σ with those of the joints' σ_q, by Eqs 2–4."""
    covariance = tool_covariance(rv_m2_with_hand(inputs.l5), joints(*inputs.poses), (*inputs.sigma_q, 0.0))
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return Entry(
        "Table 1, theoretical σ",
        "Table 1, Eqs 2–4",
        printed.TABLE_1_THEORETICAL.text,
        f"{numbers(sigma, 2, factor=1e6)} µm",
        floats(sigma),
        judge(printed.TABLE_1_THEORETICAL, sigma, otherwise=NOT_REPRODUCIBLE),
        f"x y z in rows 1 / 2, from σ_q = {numbers(inputs.sigma_q, 0, factor=1e6)} µrad and l5 = {_mm(inputs.l5)}, "
        "neither of which the paper prints: σ_q is fitted to this very column, six figures with four unknowns. The "
        "fact sheet has 16.8 and 21.3 for y of row 1 and x of row 2, from σ_q before they were rounded; 33 38 62 49 "
        "µrad and 150 mm give 16.75 and 21.25.",
    )


def sigma_q_behind_table_1(inputs: PaperInputs) -> Entry:
    """Find σ_q from the theoretical column of Table 1: Eqs 2–4 the other way round."""
    rows = np.reshape(printed.TABLE_1_THEORETICAL.values, (2, 3))
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
        printed.TABLE_1_EXPERIMENTAL.text,
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
    seen = np.array(printed.TABLE_1_MINIMUM.values) / sigma
    below = -np.expm1(inputs.n * np.log(ndtr(-seen)))
    ends = [ndtri(-np.expm1(np.log1p(-p) / inputs.n)) for p in _tails(inputs)]
    return _held(inputs, "Table 1, minimum", printed.TABLE_1_MINIMUM, np.array(ends)[:, None] * sigma, below, 1e6, 0)


def maximum(inputs: PaperInputs) -> Entry:
    """Hold the largest of n errors against its sampling distribution, Φ(x/σ)^n."""
    sigma = np.ravel(inputs.experimental_sigma)
    below = ndtr(np.array(printed.TABLE_1_MAXIMUM.values) / sigma) ** inputs.n
    ends = [ndtri(p ** (1.0 / inputs.n)) for p in _tails(inputs)]
    return _held(inputs, "Table 1, maximum", printed.TABLE_1_MAXIMUM, np.array(ends)[:, None] * sigma, below, 1e6, 0)


def skewness(inputs: PaperInputs) -> Entry:
    """Hold the skewness of n errors against its sampling distribution, simulated."""
    law = _skewness_law(inputs.n, 10 * inputs.repetitions, inputs.seed)
    seen = np.array(printed.TABLE_1_SKEWNESS.values)
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
        printed.TABLE_1_SKEWNESS,
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


def _mm(length: float) -> str:
    return f"{1e3 * length:g} mm"


ROWS = (theoretical_sigma, sigma_q_behind_table_1, experimental_sigma, minimum, maximum, skewness)
"""Functions of the inputs, in the paper's order."""
