"""Rows on other slips of the text, and on correlations that it leaves out, with their consequences."""

from __future__ import annotations

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.assembly.probability import required_clearance
from thermal_robot.assembly.repeatability import tool_covariance
from thermal_robot.assembly.thermal import displacement, mean_shift_test
from thermal_robot.kinematics import elongation_jacobian, tool_poses
from thermal_robot.paper import printed
from thermal_robot.paper.entry import AGREES, ERRATUM, NEGLECTED, Entry, floats, numbers
from thermal_robot.paper.inputs import PaperInputs, joints, rv_m2_with_hand
from thermal_robot.paper.joining import capability_at
from thermal_robot.paper.warming import critical, median_error, random_systems


def q3_of_row_1(inputs: PaperInputs) -> Entry:
    """Compare two values of q3 in one pose: the tool's place, and the calculated displacement of Table 2."""
    robot, pose = rv_m2_with_hand(inputs.l5), inputs.poses[0]
    q = joints(*((pose[0], pose[1], q3, pose[3]) for q3 in printed.Q3_OF_ROW_1))
    places = tool_poses(robot, q)[:, :3, 3]
    apart = float(np.linalg.norm(places[1] - places[0]))
    moved = displacement(robot, q, inputs.delta_l)
    change = float(np.max(np.abs(moved[1] - moved[0])))
    one, two = printed.Q3_OF_ROW_1
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
        printed.QUANTILE_OF,
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
        f"From σ_q and l5, Eqs 2–4 with all of J Σ Jᵀ; C_p with the experimental σ at L = {1e3 * inputs.clearance:g} "
        "mm.",
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


ROWS = (
    q3_of_row_1,
    quantile_of,
    differential_of_eq_16,
    counts_of_eq_12,
    symbols,
    kinematic_correlation,
    thermal_correlation,
)
"""Functions of the inputs."""
