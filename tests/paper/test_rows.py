"""Equations behind the rows: closed forms, limits, simulation, and verdicts that follow the inputs."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import stats
from scipy.stats import norm

from thermal_robot.assembly.thermal import displacement
from thermal_robot.kinematics import tool_poses
from thermal_robot.paper import PaperInputs, rows, rv_m2_with_hand
from thermal_robot.paper.inputs import joints
from thermal_robot.paper.ledger import compute
from thermal_robot.paper.rows import capability_at, median_error, random_systems, warmed

MODELS = ("uniform", "covariance", "mean shift")
SIGMA, SHIFT = (14e-6, 18e-6), (7e-6, 16e-6)
NORMALITY, ENOUGH = "normality at r = 0.5, n = 100 and 5000", '"normal enough for r < 1"'


def row(quantity, **changed):
    """One row of other inputs, with few random poses."""
    of = next(r for r in rows.table() if r["quantity"] == quantity)
    return compute(of, replace(PaperInputs(pose_sets=50), **changed))


@pytest.mark.parametrize("which", ["minimum", "maximum"])
def test_extremes_have_their_sampling_distribution(which):
    sigma, rng, quantity = np.ravel(PaperInputs().experimental_sigma), np.random.default_rng(5), f"Table 1, {which}"
    drawn = getattr(np, which[:3])(rng.standard_normal((40_000, 100)), axis=1)
    values = np.reshape(row(quantity).values, (3, 6))
    np.testing.assert_allclose(values[:2] / sigma, np.quantile(drawn, [[0.025] * 6, [0.975] * 6]), atol=0.03)
    below = np.mean(drawn[:, None] <= np.array(rows.printed(quantity).values) / sigma, axis=0)
    np.testing.assert_allclose(values[2], 2 * np.minimum(below, 1 - below), atol=0.02)
    # One of the twelve lies outside its own interval: y of row 2 never went beyond 27 µm.
    assert (values[2] < 0.05).tolist() == [False] * 4 + [which == "maximum"] + [False]


@pytest.mark.parametrize("n", [40, 100])
def test_law_of_the_skewness_has_its_known_variance(n):
    # The skewness of n normal numbers has the variance 6 (n − 2) / ((n + 1) (n + 3)), and tails a little above normal.
    ends = np.array(row("Table 1, skewness", n=n).values[:12]).reshape(2, 6)
    assert (ends[0] == -ends[1]).all()
    deviation = np.sqrt(6.0 * (n - 2) / ((n + 1) * (n + 3)))
    assert ends[1, 0] / deviation == pytest.approx(1.97, abs=0.06)


def test_scatter_and_its_correlation_are_those_of_joints_that_err():
    inputs, rng, drawn = PaperInputs(), np.random.default_rng(11), 60_000
    sigma = np.reshape(row("Table 1, theoretical σ").values, (2, 3))
    rho = row("x–y correlation of the kinematic error").values[:2]
    for k in (0, 1):
        q = joints(inputs.poses[k]) + rng.standard_normal((drawn, 5)) * [*inputs.sigma_q, 0.0]
        places = tool_poses(rv_m2_with_hand(inputs.l5), q)[:, :3, 3]
        # The standard error of a standard deviation is its size over √(2N), that of a correlation (1 − ρ²)/√N.
        np.testing.assert_allclose(places.std(axis=0), sigma[k], rtol=5.0 / np.sqrt(2 * drawn))
        assert np.corrcoef(places.T)[0, 1] == pytest.approx(rho[k], abs=5.0 / np.sqrt(drawn))
    swapped = row("Table 1, theoretical σ", poses=inputs.poses[::-1]).values
    assert (*swapped[3:], *swapped[:3]) == tuple(sigma.ravel())
    # The very σ that these joints give are compatible, so that the row agrees.
    given = tuple(map(tuple, np.round(sigma, 6).tolist()))
    assert row("Table 1, experimental σ", experimental_sigma=given).verdict == "agrees"


def test_before_stabilisation_five_of_six_components_are_critical():
    quantity = "U of Eq 13 before stabilisation"
    entry = row(quantity)
    u, share = np.array(entry.values).reshape(2, 6)
    assert (np.abs(u) > norm.isf(0.025)).tolist() == (share < 1.0).tolist() == [True] * 4 + [False, True]
    assert "5 of 6 components" in entry.why
    assert "never in y of row 2" in entry.why
    larger, smaller = (row(quantity, n=n) for n in (1000, 4))
    assert (larger.verdict, smaller.verdict) == ("agrees", "not reproducible")
    assert "never" not in larger.why


def test_a_mean_that_is_off_belongs_to_the_critical_set():
    means = ((12e-6, 16e-6, 11e-6), (20e-6, 3e-6, 6e-6))
    assert [row(f"U of Eq 13, row {n}", sample_means=means).verdict for n in (1, 2)] == ["erratum", "agrees"]


@pytest.mark.parametrize("n", [1, 2])
def test_displacements_lie_in_the_arms_own_plane_and_grow_with_the_elongations(n):
    inputs, name = PaperInputs(), f"Table 2 row {n}, calculated"
    found = np.array(row(name).values)
    assert found[0] / found[1] == pytest.approx(np.tan(inputs.poses[n - 1][0]), rel=1e-12)
    np.testing.assert_allclose(row(name, delta_l=tuple(2.0 * np.array(inputs.delta_l))).values, 2.0 * found, rtol=1e-13)
    # Every kelvin lifts the column; l1 alone has no other effect.
    lifted = row(name, delta_l=(inputs.delta_l[0] + 1e-6, *inputs.delta_l[1:]))
    np.testing.assert_allclose(np.subtract(lifted.values, found), [0, 0, 1e-6], atol=1e-18)
    # The paper: "The results of measurements of the gripper displacement … are shown in Table 2".
    assert all(words in row(name).why for words in ("calls these figures measured", "an inference of this ledger"))


@pytest.mark.parametrize("which", ["5a", "5b"])
def test_farthest_point_is_that_of_the_farthest_corner(which):
    inputs = PaperInputs()
    q = joints(inputs.pose_5a if which == "5a" else inputs.poses[0])
    for lower, found in zip((0.0, -1.0), row(f"Fig {which}, farthest point in y–z").values[:2], strict=True):
        corners = np.array(list(product(*((lower * grown, grown) for grown in inputs.delta_l))))
        moved = displacement(rv_m2_with_hand(), q, corners)[:, 1:]
        assert found == pytest.approx(np.linalg.norm(moved, axis=1).max(), rel=1e-12, abs=0.0)


def test_strain_and_errors_scale_with_rise_sample_and_instrument():
    once, twice = (row("strain Δl/(l·ΔT)", temperature=t).values for t in (23.0, 26.0))
    np.testing.assert_allclose(twice, 0.5 * np.array(once), rtol=1e-13)
    changes = ({}, {"n": 400}, {"reading_noise": 0.0})
    errors = [np.array(row("Eq 12, five unknowns", **changed).values[2:6]) for changed in changes]
    np.testing.assert_allclose(errors[1], 0.5 * errors[0], rtol=1e-13)
    assert not np.any(errors[2])


def test_error_of_a_median_is_that_of_repeated_draws():
    drawn = np.random.default_rng(3).standard_normal((400, 1001))
    stated = np.mean([median_error(sample) for sample in drawn])
    # √(π/2) σ/√n for normal numbers; the standard error of 400 draws' deviation is 3.5 %.
    assert np.median(drawn, axis=1).std() == pytest.approx(stated, rel=0.15)
    assert stated == pytest.approx(np.sqrt(np.pi / 2.0 / 1001), rel=0.05)


def test_random_systems_follow_their_seed_and_agree_between_seeds():
    one, other = random_systems(4000, 1), random_systems(4000, 2)
    for first, second in ((one[0], other[0]), (one[2], other[2])):
        assert not np.array_equal(first, second)
        apart = abs(np.median(first) - np.median(second))
        assert apart < 5.0 * np.hypot(median_error(first), median_error(second))
    # Five equations need not be solvable well; ten always are better, and no condition number is below one.
    assert min(one[0].min(), one[2].min()) >= 1.0
    assert np.median(one[2]) < np.median(one[0])


def test_moments_of_the_total_error_are_those_of_drawn_errors():
    inputs, rng, drawn = PaperInputs(), np.random.default_rng(7), 400_000
    thermal = rng.uniform(-inputs.delta_y, inputs.delta_y, drawn)
    total = thermal + rng.normal(0.0, inputs.experimental_sigma[0][1], drawn)
    # The standard error of a variance is at most √(2/N) of it, less for what is flatter than a normal law.
    limit = 5.0 * np.sqrt(2.0 / drawn)
    assert row("Eq 19, σ_t²").values[0] == pytest.approx(thermal.var(), rel=limit, abs=0.0)
    assert row("Eq 20, total variance").values[0] == pytest.approx(total.var(), rel=limit, abs=0.0)
    assert "Excess kurtosis −0.048 and −0.30" in row(ENOUGH, n_simulated=120, repetitions=60).why
    for r, told in ((0.5, -0.048), (1.0, -0.30)):
        sample = rng.standard_normal(drawn) + r * np.sqrt(3.0) * rng.uniform(-1.0, 1.0, drawn)
        assert stats.kurtosis(sample) == pytest.approx(told, abs=5.0 * np.sqrt(24.0 / drawn) + 1e-3)


def test_critical_value_rejects_alpha_of_normal_samples():
    name = "Shapiro–Wilk critical W, n = 100, α = 0.05"
    w, one_percent, level = row(name).values
    rng, samples = np.random.default_rng(9), 3000
    drawn = np.array([stats.shapiro(rng.standard_normal(100)).statistic for _ in range(samples)])
    # The printed 0.964 rejects far fewer than the one in twenty that it is meant for.
    for share, value in ((0.05, w), (0.01, one_percent), (level, 0.964)):
        assert abs(np.mean(drawn < value) - share) < 5.0 * np.sqrt(share * (1.0 - share) / samples)
    other = row(name, alpha=0.2).values
    assert (other[2], other[0] > w) == (level, True)


def test_verdicts_on_normality_follow_sample_level_and_ratio():
    quick = {"n_simulated": 120, "repetitions": 60}
    assert row(ENOUGH, **quick).verdict == "agrees", "no sample is large enough to see the difference"
    # A test at 30 % rejects three normal samples in ten, which says nothing against the law.
    entry = row(NORMALITY, alpha=0.3, n_simulated=120, repetitions=300)
    assert min(entry.values[:2]) > 0.2
    assert entry.verdict == "agrees"
    assert row(NORMALITY, delta_y=400e-6, **quick).verdict == "not reproducible"
    wide = row("r = σ_t/σ_k", delta_y=400e-6)
    assert wide.verdict == "erratum"
    assert wide.values[0] == pytest.approx(25.0 * row("r = σ_t/σ_k").values[0], rel=1e-13)


@pytest.mark.parametrize("clearance", [20e-6, 145e-6, 400e-6])
def test_capability_of_round_scatter_has_a_closed_form(clearance):
    # A round normal error exceeds the radius L/2 with the probability exp(−L²/8σ²).
    failing = np.exp(-((clearance / 18e-6) ** 2) / 8.0)
    assert capability_at((18e-6) ** 2 * np.eye(2), clearance) == pytest.approx(norm.isf(0.5 * failing) / 3.0, rel=1e-10)


@pytest.mark.parametrize("model", MODELS)
def test_what_a_thermal_error_leaves_is_that_of_drawn_errors(model):
    # A required capability of 0.5 fails in 13 % of cases, which a simulation can count.
    before, left, _, growth = warmed(SIGMA, SHIFT, 0.5, model)
    rng, drawn = np.random.default_rng(4), 400_000
    moved = {
        "mean shift": 1.0,
        "uniform": rng.uniform(-1.0, 1.0, (drawn, 2)),
        "covariance": rng.standard_normal((drawn, 2)) / np.sqrt(3.0),
    }
    error = rng.standard_normal((drawn, 2)) * SIGMA + moved[model] * np.array(SHIFT)
    for clearance, capability in ((before, left), (before * (1.0 + growth), 0.5)):
        failing = 2.0 * norm.sf(3.0 * capability)
        counted = np.mean(np.hypot(*error.T) > clearance / 2.0)
        assert abs(counted - failing) < 5.0 * np.sqrt(failing * (1.0 - failing) / drawn)
    np.testing.assert_allclose(warmed(SIGMA, (0.0, 0.0), 1.33, model)[1:], [1.33, 0.0, 0.0], rtol=1e-9, atol=1e-9)
    one, large = warmed(SIGMA, SHIFT, 1.33, model), warmed((14.0, 18.0), (7.0, 16.0), 1.33, model)
    np.testing.assert_allclose(large, [1e6 * one[0], *one[1:]], rtol=1e-9)


def test_a_shift_that_stands_costs_most_and_no_model_gives_both_rows():
    losses = [warmed(SIGMA, SHIFT, 1.33, model)[2] for model in MODELS]
    assert 0.0 < losses[0] < losses[1] < losses[2]
    for n, words in ((1, "mean reproduces the printed figures"), (2, "mean does not reproduce the printed figures")):
        entry = row(f"C_p row {n} with ±3 °C")
        assert (entry.verdict, words in entry.why) == ("not reproducible", True)
        assert "neither gives both rows" in entry.why


@pytest.mark.parametrize("l5", [0.15, 0.08])
def test_two_values_of_q3_are_a_chord_about_the_elbow(l5):
    # Forearm and hand, 200 mm and l5 with the angle q4 between them, turn by 0.3 mrad.
    lever = np.sqrt(0.2**2 + l5**2 + 2.0 * 0.2 * l5 * np.cos(PaperInputs().poses[0][3]))
    assert row("q3 of row 1", l5=l5).values[0] == pytest.approx(2.0 * lever * np.sin(0.5 * 0.0003), rel=1e-7, abs=0.0)


def test_thermal_correlation_is_one_whatever_the_elongations_and_turns_with_the_arm():
    name, mirrored = "x–y correlation of the thermal error", [(-pose[0], *pose[1:]) for pose in PaperInputs().poses]
    np.testing.assert_allclose(row(name, delta_l=(3e-6, 20e-6, 1e-6, 9e-6, 5e-7)).values[:2], 1.0, rtol=1e-12)
    np.testing.assert_allclose(row(name, poses=tuple(mirrored)).values[:2], -1.0, rtol=1e-12)


def test_slips_without_a_figure_are_errata_and_say_so():
    for entry in (row("Eq 16, convolution"), row("symbols of σ")):
        assert (entry.verdict, entry.computed) == ("erratum", "–")
        assert "No figure follows from it." in entry.why
