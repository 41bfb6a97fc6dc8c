"""Rows of section 3: elongations, displacements, the test of the mean, and the polygon (Eqs 5–15, Table 2, Fig 5)."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np
from scipy.optimize import linprog
from scipy.special import ndtri

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability.tolerance import polygon_in_plane
from thermal_robot.assembly.thermal import (
    displacement,
    expansion_coefficient,
    expansion_coefficients,
    mean_shift_test,
    segment_names,
)
from thermal_robot.kinematics import elongation_jacobian
from thermal_robot.paper import printed
from thermal_robot.paper.entry import (
    AGREES,
    ERRATUM,
    NOT_PRINTED,
    NOT_REPRODUCIBLE,
    PARTLY,
    TRUNCATED,
    Entry,
    floats,
    judge,
    numbers,
)
from thermal_robot.paper.inputs import PaperInputs, joints, rv_m2_with_hand

_DIGIT = 1e-6
# m, the last printed digit of Δl and of Table 2.


def calculated(row: int, inputs: PaperInputs) -> Entry:
    """Compare Table 2's displacement with Eqs 9–11, which need directions, not lengths.

    The paper calls it measured; "calculated" is this ledger's inference, and the row says so.
    """
    robot = rv_m2_with_hand()
    moved = displacement(robot, joints(inputs.poses[row]), inputs.delta_l)[0]
    figures = printed.TABLE_2[row]
    verdict = judge(figures, moved, otherwise=ERRATUM)
    # Could the printed Δl be rounded so that all six figures of the table come out rounded, not cut off?
    both = elongation_jacobian(robot, joints(*inputs.poses)).reshape(6, 5)
    targets = np.array([*printed.TABLE_2[0].values, *printed.TABLE_2[1].values])
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
        printed.U_OF_EQ_13,
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
        printed.U_BEFORE_STABILISATION,
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
        printed.DELTA_L,
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
        printed.FIGURE_ONLY,
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
    """Set up Eq 12 at ``sets`` times five random poses.

    Returns
    -------
    condition : ndarray
        (sets,) of four Δx and one Δz.
    errors : ndarray
        (sets, 5) standard errors of the elongations for a noise of 1.
    condition_of_ten : ndarray
        (sets,) with Δx and Δz at all five poses.
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


ROWS = (
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
"""Functions of the inputs, in the paper's order."""
