"""Rows of other inputs: extremes, scales, and verdicts that follow; the equations are tested where they live."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from thermal_robot.paper import PaperInputs, rows
from thermal_robot.paper.ledger import compute
from thermal_robot.paper.rows import median_error, random_systems, warmed

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
def test_calculated_displacements_are_called_measured_by_the_paper_alone(n):
    # The paper: "The results of measurements of the gripper displacement … are shown in Table 2".
    why = row(f"Table 2 row {n}, calculated").why
    assert all(words in why for words in ("calls these figures measured", "an inference of this ledger"))


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


def test_verdicts_follow_sample_level_ratio_and_scatter():
    quick = {"n_simulated": 120, "repetitions": 60}
    enough = row(ENOUGH, **quick)
    assert enough.verdict == "agrees", "no sample is large enough to see the difference"
    assert "Excess kurtosis −0.048 and −0.30" in enough.why
    given = tuple(map(tuple, np.round(np.reshape(row("Table 1, theoretical σ").values, (2, 3)), 6).tolist()))
    assert row("Table 1, experimental σ", experimental_sigma=given).verdict == "agrees", "the very σ are compatible"
    # A test at 30 % rejects three normal samples in ten, which says nothing against the law.
    entry = row(NORMALITY, alpha=0.3, n_simulated=120, repetitions=300)
    assert min(entry.values[:2]) > 0.2
    assert entry.verdict == "agrees"
    assert row(NORMALITY, delta_y=400e-6, **quick).verdict == "not reproducible"
    wide = row("r = σ_t/σ_k", delta_y=400e-6)
    assert wide.verdict == "erratum"
    assert wide.values[0] == pytest.approx(25.0 * row("r = σ_t/σ_k").values[0], rel=1e-13)


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


def test_slips_without_a_figure_are_errata_and_say_so():
    for entry in (row("Eq 16, convolution"), row("symbols of σ")):
        assert (entry.verdict, entry.computed) == ("erratum", "–")
        assert "No figure follows from it." in entry.why
