"""Temperature, elongation, displacement and back (Eqs 5–13): laws of every arm, simulation, a known mean."""

import dataclasses

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import solve_ivp

from thermal_robot import kinematics as kin
from thermal_robot.assembly.repeatability import tool_covariance
from thermal_robot.assembly.thermal import (
    best_poses,
    displacement,
    elongation,
    expansion_coefficient,
    expansion_coefficients,
    identify_elongations,
    lengths,
    mean_shift_test,
    pseudo_inverse,
    segment_names,
    sensitivity,
    warm_up,
)
from thermal_robot.errors import EstimationError, RobotError
from thermal_robot.kinematics.model import PRISMATIC

# Table 2, row 1 with its own q3, and row 2; Δl of the paper's section 3.
Q = np.array([[0.5235, 0.8726, -1.3965, -1.0471, 0.0], [1.3963, 0.3839, -1.2217, -0.7330, 0.0]])
PAPER = 1e-6 * np.array([14, 5, 9, 7, 8])
LINKS = {"column": 22.0, "shoulder": 23.0, "upper_arm": 24.0, "forearm": 25.0, "hand": 26.0}
EQUATION_12 = ("x", "x", "x", "x", "z")
GOOD = np.deg2rad(
    [[90, 0, 0, 0, 0], [90, 90, -60, 60, 0], [90, 60, -120, 110, 0], [90, 90, -90, -90, 0], [0, 60, -10, 0, 0]]
)
# mm, Tables 1 and 2 as printed: measured means, static displacements, experimental σ.
MEANS = np.array([[0.007, 0.016, 0.011], [0.020, 0.003, 0.006]])
STATIC = np.array([[0.008, 0.014, 0.009], [0.017, 0.003, 0.004]])
SIGMA = np.array([[0.014, 0.018, 0.017], [0.023, 0.016, 0.018]])
TAU = {"column": 7200.0, "shoulder": 5400.0, "upper_arm": 2700.0, "forearm": 1800.0, "hand": 900.0}
SIGMA_Q, ALPHA = 1e-6 * np.array([33, 38, 62, 49, 0]), 11.9e-6
on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


def test_a_common_coefficient_is_of_segments_or_links_and_nearer_to_the_state_with_the_larger_rise(rv_m2):
    for names in (segment_names(rv_m2)[:4], ["column", "shoulder", "upper_arm", "forearm"]):
        assert 1e6 * expansion_coefficient(rv_m2, PAPER, 3.0, segments=names) == pytest.approx(11.857, abs=1e-3)
    grown = np.stack([2e-5 * lengths(rv_m2), 1e-5 * lengths(rv_m2) * 3.0])
    common = expansion_coefficient(rv_m2, grown, np.array([[1.0], [3.0]]) * np.ones(5))
    assert common == pytest.approx((2e-5 * 1.0 + 1e-5 * 9.0) / 10.0, rel=1e-12)


def test_elongation_is_equation_5_in_every_form(rv_m2):
    segments = dict(zip(segment_names(rv_m2), (1e-5, 2e-5, 3e-5, 4e-5, 5e-5), strict=True))
    expected = np.array([1e-5, 2e-5, 3e-5, 4e-5, 5e-5]) * lengths(rv_m2) * [2, 3, 4, 5, 6]
    for temperature in (LINKS, [22, 23, 24, 25, 26]):
        for coefficients in (segments, list(segments.values())):
            grown = elongation(rv_m2, temperature, coefficients=coefficients)
            np.testing.assert_allclose(grown, expected, rtol=1e-13)
    assert not np.any(elongation(rv_m2, 23.5, coefficients=1.2e-5, reference=23.5))
    # A segment's own value goes before its link's, in whatever order they are written.
    for mixed in ({**LINKS, "joint_3": 30.0}, {"joint_3": 30.0, **LINKS}):
        grown = elongation(rv_m2, mixed, coefficients=segments)
        np.testing.assert_allclose(grown[2], 3e-5 * 0.25 * 10.0, rtol=1e-13)
    over_time = elongation(rv_m2, {**LINKS, "hand": np.array([20.0, 26.0, 32.0])}, coefficients=segments)
    assert over_time.shape == (3, 5)
    np.testing.assert_allclose(over_time[1], expected, rtol=1e-13)


def test_elongation_is_linear_in_rise_and_length_and_gives_its_coefficient_back(arm):
    names = segment_names(arm)
    by_length = {segment.name: segment.length for segment in arm.segments}
    np.testing.assert_array_equal(lengths(arm), [by_length[name] for name in names])
    assert len(set(names)) == len(names)
    assert np.all(lengths(arm) > 0.0)
    rise = np.array([[1.0], [2.0], [-2.0]]) * np.ones(len(names))
    grown = elongation(arm, 20.0 + rise, coefficients=2.3e-5)
    np.testing.assert_allclose(grown, 2.3e-5 * rise * lengths(arm), rtol=1e-12)
    assert expansion_coefficient(arm, grown, rise) == pytest.approx(2.3e-5, rel=1e-12)
    np.testing.assert_allclose(expansion_coefficients(arm, grown, rise), 2.3e-5, rtol=1e-12)


def test_displacement_is_linear_in_elongations_however_large(arm, configurations):
    q = configurations(arm, 30)
    grown = np.random.default_rng(0).normal(0.0, 0.1, (30, len(segment_names(arm))))
    linear = displacement(arm, q, grown)
    np.testing.assert_allclose(displacement(arm, q, grown, exact=True), linear, rtol=0.0, atol=1e-13)
    augmented = kin.augmented_model(arm)
    moved = augmented.tool_poses(q, grown)[:, :3, 3] - augmented.tool_poses(q)[:, :3, 3]
    np.testing.assert_allclose(moved, linear, rtol=0.0, atol=1e-10)


def test_elongations_by_name_by_row_and_over_time_agree(rv_m2):
    by_name = dict(zip(segment_names(rv_m2), PAPER, strict=True))
    once = displacement(rv_m2, Q, PAPER)
    np.testing.assert_array_equal(displacement(rv_m2, Q, by_name), once)
    np.testing.assert_array_equal(displacement(rv_m2, Q, np.stack([PAPER, 2 * PAPER]))[0], once[0])
    for exact in (False, True):
        over_time = displacement(rv_m2, Q[0], np.outer([0.0, 1.0, 3.0], PAPER), exact=exact)
        np.testing.assert_allclose(over_time, np.outer([0.0, 1.0, 3.0], once[0]), rtol=0.0, atol=1e-15)


def test_an_even_warming_keeps_the_arms_shape(arm, configurations):
    # Every length times 1 + χΔT moves the tool point away from the root by χΔT of its distance; strokes do not grow.
    q = configurations(arm, 50)
    frames, places, chain = kin.chain_frames(arm, q), kin.tool_poses(arm, q)[:, :3, 3], arm.chain
    for k, stroke in zip(chain.movable, chain.coupling.positions(q).T, strict=True):
        if chain.kinds[k] == PRISMATIC:
            places = places - stroke[:, None] * (frames.rotations[:, k] @ chain.axes[k])
    grown = elongation(arm, 23.0, coefficients=1.2e-5)
    np.testing.assert_allclose(displacement(arm, q, grown), 3.6e-5 * places, rtol=0.0, atol=1e-15)


def test_sensitivity_is_the_displacement_for_a_kelvin_in_one_segment(arm, configurations):
    q, names = configurations(arm, 6), segment_names(arm)
    coefficients = np.random.default_rng(1).uniform(1e-5, 3e-5, len(names))
    per_kelvin = sensitivity(arm, q, coefficients=coefficients)
    for column, name in enumerate(names):
        grown = elongation(arm, dict.fromkeys(names, 20.0) | {name: 21.0}, coefficients=coefficients)
        np.testing.assert_allclose(per_kelvin[:, :, column], displacement(arm, q, grown), rtol=0.0, atol=1e-16)
    # Eqs 6–8: each column is a direction, and what grows below a joint does not care how the joints above it stand.
    moved = np.tile(coefficients * lengths(arm), (6, 1))
    np.testing.assert_allclose(np.linalg.norm(per_kelvin, axis=1), moved, rtol=1e-12)
    np.testing.assert_allclose(per_kelvin[:, :, 0], np.tile(per_kelvin[:1, :, 0], (6, 1)), atol=1e-18)


def test_the_papers_u_could_have_missed_a_tenth_of_the_scatter():
    found = mean_shift_test(MEANS, STATIC, SIGMA, n=100)
    assert found.accepted.all()
    np.testing.assert_allclose(found.p_value, 2 * stats.norm.sf(np.abs(found.u)), rtol=1e-12)
    np.testing.assert_allclose(found.power(SIGMA / 10), 0.170, atol=0.001)
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.n = 5


def test_a_sample_is_its_mean():
    drawn = np.random.default_rng(0).normal(0.009, 0.014, (100, 3))
    whole = mean_shift_test(drawn, STATIC[0], SIGMA[0])
    np.testing.assert_array_equal(whole.u, mean_shift_test(drawn.mean(axis=0), STATIC[0], SIGMA[0], n=100).u)
    assert whole.n == 100
    own = stats.ttest_1samp(drawn, STATIC[0]).statistic
    np.testing.assert_allclose(mean_shift_test(drawn, STATIC[0]).u, own, rtol=1e-12)


@pytest.mark.parametrize("alpha", [0.05, 0.01])
def test_it_rejects_as_often_as_it_says(alpha):
    rng, sigma, shift, n = np.random.default_rng(1), 0.016, 0.005, 40
    right = mean_shift_test(rng.normal(0.0, sigma / np.sqrt(n), 40_000), 0.0, sigma, n=n, alpha=alpha)
    assert np.mean(~right.accepted) == pytest.approx(alpha, abs=4 * np.sqrt(alpha / 40_000))
    wrong = mean_shift_test(rng.normal(shift, sigma / np.sqrt(n), 40_000), 0.0, sigma, n=n, alpha=alpha)
    assert np.mean(~wrong.accepted) == pytest.approx(float(wrong.power(shift)), abs=0.01)
    assert float(wrong.power(0.0)) == pytest.approx(alpha, rel=1e-12)
    np.testing.assert_array_equal(np.asarray(wrong.p_value) >= alpha, wrong.accepted)


def test_a_step_and_a_ramp_are_followed_exactly(rv_m2):
    times, taus = np.linspace(0.0, 20000.0, 41), np.array(list(TAU.values()))
    found = warm_up(rv_m2, times, 23.0, time_constants=TAU, initial=20.0)
    np.testing.assert_allclose(found.temperatures, 23.0 - 3.0 * np.exp(-times[:, None] / taus), rtol=0.0, atol=1e-12)
    ramp = warm_up(rv_m2, times, 20.0 + 1e-3 * times, time_constants=TAU)
    expected = 20.0 + 1e-3 * (times[:, None] + taus * np.expm1(-times[:, None] / taus))
    np.testing.assert_allclose(ramp.temperatures, expected, rtol=0.0, atol=1e-11)
    # Two equal times are a step; and a row of as many numbers as segments is the hall's temperature over time.
    instants = np.array([0.0, 1000.0, 1000.0, 1900.0, 1e6])
    steps = warm_up(rv_m2, instants, [20.0, 20.0, 25.0, 25.0, 25.0], time_constants=900.0)
    told = [20.0, 20.0, 20.0, 25.0 - 5.0 / np.e, 25.0]
    np.testing.assert_allclose(steps.temperatures, np.tile(told, (5, 1)).T, atol=1e-12)


def test_more_instants_on_the_same_straight_pieces_change_nothing(rv_m2):
    corners, heights = np.array([0.0, 3600.0, 5000.0, 9000.0]), np.array([20.0, 24.0, 21.0, 21.5])
    fine = np.union1d(np.linspace(0.0, 9000.0, 3001), corners)
    coarse = warm_up(rv_m2, corners, heights, time_constants=TAU, initial=19.0)
    detailed = warm_up(rv_m2, fine, np.interp(fine, corners, heights), time_constants=TAU, initial=19.0)
    np.testing.assert_allclose(detailed.temperatures[np.isin(fine, corners)], coarse.temperatures, rtol=0.0, atol=1e-11)

    def rate(t, temperature):  # for a solver that knows nothing of the exact solution
        return (np.interp(t, corners, heights) - temperature) / np.array(list(TAU.values()))

    solved = solve_ivp(rate, (0.0, 9000.0), np.full(5, 19.0), t_eval=corners, rtol=1e-10, atol=1e-10, max_step=50.0)
    np.testing.assert_allclose(coarse.temperatures, solved.y.T, rtol=0.0, atol=2e-6)


@on_arms
def test_a_link_may_have_surroundings_of_its_own(arm, configurations):
    names, times = segment_names(arm), np.linspace(0.0, 1e5, 50)
    motor = {name: 20.0 for name in names} | {names[1]: np.full(50, 35.0)}
    found = warm_up(arm, times, motor, time_constants=1800.0, initial=20.0)
    np.testing.assert_allclose(found.temperatures[-1], [35.0 if name == names[1] else 20.0 for name in names])
    q = configurations(arm, 1)[0]
    # while it warms up the tool is where links of those temperatures bring it: nowhere else at first, and in the end
    grown = elongation(arm, dict(zip(names, found.temperatures.T, strict=True)), coefficients=ALPHA)
    over_time = found.displacements(q, coefficients=ALPHA)
    np.testing.assert_allclose(over_time, displacement(arm, q, grown), rtol=0.0, atol=1e-15)
    final = displacement(arm, q, elongation(arm, motor | {names[1]: 35.0}, coefficients=ALPHA))
    np.testing.assert_allclose(over_time[[0, -1]], [np.zeros(3), final[0]], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("system", "rank", "known"),
    [
        (np.eye(3), 3, [True, True, True]),
        ([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0]], 2, [False, False, True]),  # only a + b is seen, and c
        (np.ones((5, 3)), 1, [False] * 3),
        (np.zeros((2, 3)), 0, [False] * 3),
        ([[0.0, 3.0, 0.0]], 1, [False, True, False]),
        # A millionth and a half of a hidden combination is already too much; a ten-millionth is not.
        ([[1.0, 1.5e-6]], 1, [False, False]),
        ([[1.0, 1e-7]], 1, [True, False]),
        (np.diag([5.0, 1.0, 1e-8]), 3, [True, True, True]),
        (np.diag([5.0, 1.0, 2.5e-9]), 2, [True, True, False]),
    ],
)
def test_an_unknown_is_known_when_no_hidden_combination_holds_it(system, rank, known):
    for unit in (1e-12, 1.0, 1e12):  # metres or micrometres
        scaled = unit * np.asarray(system)
        inverse, found, seen = pseudo_inverse(scaled)
        assert (found, seen.tolist()) == (rank, known)
        np.testing.assert_allclose(scaled @ inverse @ scaled, scaled, atol=5e-9 * unit)


def test_equation_12_gives_the_elongations_back(rv_m2):
    found = identify_elongations(rv_m2, GOOD, displacement(rv_m2, GOOD, PAPER), axes=EQUATION_12, sigma=3e-6)
    np.testing.assert_allclose(found.values, PAPER, rtol=0.0, atol=1e-15)
    assert found.names == segment_names(rv_m2)
    assert found.identified.all()
    assert np.isfinite(found.residuals).sum() == 5
    # Five equations, five unknowns: the covariance is σ² times the inverse of the square system, twice.
    jacobian = kin.elongation_jacobian(rv_m2, GOOD)
    square = np.vstack([jacobian[:4, 0], jacobian[4:, 2]])
    inverse = np.linalg.inv(square)
    np.testing.assert_allclose(found.covariance, 9e-12 * inverse @ inverse.T, rtol=1e-9, atol=1e-22)
    np.testing.assert_allclose(found.standard_errors**2, np.diag(found.covariance), rtol=1e-12)
    assert found.condition == pytest.approx(np.linalg.cond(square), rel=1e-9)
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.rank = 3


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward"], indirect=True)
def test_what_the_poses_do_not_tell_is_said(arm, configurations):
    q, names = configurations(arm, 12), segment_names(arm)
    truth = np.random.default_rng(0).normal(0.0, 1e-5, len(names))
    found = identify_elongations(arm, q, displacement(arm, q, truth), sigma=2e-6)
    np.testing.assert_allclose(found.values[found.identified], truth[found.identified], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(found.residuals, 0.0, atol=1e-15)
    for array in (found.values, found.standard_errors, found.covariance, found.covariance.T):
        assert np.all(np.isnan(array[~found.identified]))
    assert np.all(np.isfinite(found.covariance[np.ix_(found.identified, found.identified)]))
    # Along parallel axes that no joint turns against each other, only the sum moves the tool: the UR10's shoulder
    # and wrist offsets. Everything else is determined.
    lost = {"ur10": {"shoulder_lift_joint", "wrist_2_joint"}}.get(arm.name, set())
    assert {name for name, known in zip(names, found.identified, strict=True) if not known} == lost
    assert (found.condition == np.inf) == bool(lost)
    assert str(found).count("not identified by these poses") == len(lost)
    for line in str(found).splitlines()[1:-1]:
        assert ("±" in line) != ("not identified" in line)
    one = identify_elongations(arm, q[:1], displacement(arm, q[:1], truth), sigma=2e-6)
    assert one.rank <= 3
    assert np.all(np.isnan(one.values[~one.identified]))


def test_standard_errors_are_the_scatter_of_repeated_experiments(rv_m2, configurations):
    rng, q = np.random.default_rng(1), configurations(rv_m2, 6)
    # Noise of the robot itself, correlated between the axes of a pose: the mean of 100 repetitions.
    noise = tool_covariance(rv_m2, q, SIGMA_Q) / 100 + 1e-14 * np.eye(3)
    factor, moved = np.linalg.cholesky(noise), displacement(rv_m2, q, PAPER)
    drawn = moved + np.einsum("nij,knj->kni", factor, rng.standard_normal((600, 6, 3)))
    found = [identify_elongations(rv_m2, q, one, covariance=noise) for one in drawn]
    values, errors = np.array([one.values for one in found]), found[0].standard_errors
    np.testing.assert_allclose(values.std(axis=0) / errors, 1.0, atol=0.12)  # the error of a deviation of 600 is 2.9 %
    np.testing.assert_allclose((values.mean(axis=0) - PAPER) / errors, 0.0, atol=0.17)


def test_unknown_noise_is_taken_from_the_residuals(rv_m2, configurations):
    rng, q = np.random.default_rng(2), configurations(rv_m2, 300)
    moved = displacement(rv_m2, q, PAPER) + rng.normal(0.0, 4e-6, (300, 3))
    unknown, known = identify_elongations(rv_m2, q, moved), identify_elongations(rv_m2, q, moved, sigma=4e-6)
    np.testing.assert_allclose(unknown.values, known.values, rtol=1e-9)
    np.testing.assert_allclose(unknown.standard_errors, known.standard_errors, rtol=0.1)
    assert not np.array_equal(unknown.standard_errors, known.standard_errors)
    square = identify_elongations(rv_m2, GOOD, displacement(rv_m2, GOOD, PAPER), axes=EQUATION_12)
    assert np.all(np.isnan(square.standard_errors))
    assert "(noise unknown)" in str(square)


def test_a_noisy_component_counts_less_and_a_missing_one_must_not_be_asked_for(rv_m2, configurations):
    q = configurations(rv_m2, 20)
    moved = displacement(rv_m2, q, PAPER)
    moved[:, 1] += 1e-3
    noisy = identify_elongations(rv_m2, q, moved, sigma=np.array([1e-6, 1.0, 1e-6]))
    np.testing.assert_allclose(noisy.values, PAPER, atol=1e-8)
    moved[:, 1] = np.nan
    np.testing.assert_allclose(identify_elongations(rv_m2, q, moved, axes="xz").values, PAPER, atol=1e-14)
    with pytest.raises(EstimationError, match="not a finite number"):
        identify_elongations(rv_m2, q, moved)


def quality(system, criterion):
    """The criterion over what can be seen at all, the larger the better."""
    eigenvalues = np.linalg.eigvalsh(system.T @ system)
    eigenvalues = eigenvalues[eigenvalues > 1e-9]
    return {"D": np.sum(np.log(eigenvalues)), "A": -np.sum(1 / eigenvalues), "E": eigenvalues[0]}[criterion]


@pytest.mark.parametrize("criterion", ["D", "A", "E"])
def test_five_poses_for_equation_12(rv_m2, configurations, criterion):
    found = best_poses(rv_m2, 5, axes=EQUATION_12, criterion=criterion)
    assert np.all((found.q >= rv_m2.lower) & (found.q <= rv_m2.upper))
    jacobian = kin.elongation_jacobian(rv_m2, found.q)
    system = np.vstack([jacobian[:4, 0], jacobian[4:, 2]])
    np.testing.assert_allclose(found.errors, np.linalg.norm(np.linalg.inv(system), axis=1), rtol=1e-9)
    assert found.condition == pytest.approx(np.linalg.cond(system), rel=1e-9)
    drawn = kin.elongation_jacobian(rv_m2, configurations(rv_m2, 100_000, seed=1)).reshape(20_000, 5, 3, 5)
    square = np.concatenate([drawn[:, :4, 0], drawn[:, 4:, 2]], axis=1)
    condition = np.linalg.cond(square)
    assert quality(system, criterion) > max(quality(one, criterion) for one in square[condition < 30])
    if criterion == "E":
        assert found.condition < 4.0
        assert found.errors.max() < 1.2


@on_arms
@pytest.mark.parametrize("criterion", ["D", "A", "E"])
def test_no_exchange_of_one_pose_is_better(arm, configurations, criterion):
    pool = configurations(arm, 60)
    found = best_poses(arm, 5, candidates=np.vstack([pool + 9.0, pool]), criterion=criterion)  # some beyond the limits
    index = [int(np.flatnonzero(np.all(pool == q, axis=1))[0]) for q in found.q]
    assert len(set(index)) == 5
    rows = kin.elongation_jacobian(arm, pool)
    here = quality(np.concatenate(rows[index]), criterion)
    for slot in range(5):
        for candidate in set(range(60)) - set(index):
            changed = [candidate if k == slot else c for k, c in enumerate(index)]
            assert quality(np.concatenate(rows[changed]), criterion) <= here + 1e-6 * abs(here)
    identified = identify_elongations(arm, found.q, displacement(arm, found.q, 1e-5), axes=found.axes, sigma=3e-6)
    np.testing.assert_allclose(identified.standard_errors, 3e-6 * found.errors, rtol=1e-9)
    np.testing.assert_array_equal(np.isnan(found.errors), ~identified.identified)
    assert found.names == identified.names


def test_a_draw_is_repeated_with_its_seed_and_fewer_components_than_unknowns_are_chosen_too(rv_m2):
    one, same, other = (best_poses(rv_m2, 5, candidates=200, seed=seed).q for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)
    assert best_poses(rv_m2, 5, criterion="A").errors.max() < 0.6
    found = best_poses(rv_m2, 2, axes="z", candidates=200)
    assert found.condition == np.inf
    assert np.all(np.isnan(found.errors[1:2]))  # a vertical displacement never shows l2


def identified(**options):
    return lambda r: identify_elongations(r, GOOD, np.zeros((5, 3)), **options)


def warmed(times, ambient, tau):
    return lambda r: warm_up(r, times, ambient, time_constants=tau)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda r: displacement(r, Q, np.zeros((3, 5))), RobotError, r"\(3, 5\) do not fit 2 configurations"),
        (lambda r: displacement(r, Q, np.zeros((1, 2, 5))), RobotError, r"\(1, 2, 5\) do not fit"),
        (lambda r: displacement(r, Q[:, :4], PAPER), RobotError, r"expected \(N, 5\)"),
        (lambda r: displacement(r, Q, {"hand": 1e-6}), RobotError, "no elongation is given for column_top"),
        (lambda r: sensitivity(r, Q, coefficients=[1e-5]), RobotError, r"shape \(1,\) does not fit the 5 segments"),
        (
            lambda r: elongation(r, {"column": 20.0}, coefficients=1e-5),
            RobotError,
            "no temperature .* joint_2, joint_3",
        ),
        (
            lambda r: elongation(r, 20.0, coefficients={"elbow": 1e-5}),
            RobotError,
            "'elbow' is no .* column_top, column",
        ),
        (lambda r: expansion_coefficient(r, PAPER, 3.0, segments=["joint_5"]), RobotError, "'joint_5' is no segment"),
        (lambda r: mean_shift_test(1.0, 0.0, 1.0), EstimationError, "give n if this is their mean"),
        (lambda r: mean_shift_test(1.0, 0.0, n=9), EstimationError, "give sigma"),
        (lambda r: mean_shift_test(1.0, 0.0, 0.0, n=9), EstimationError, "σ > 0"),
        (lambda r: mean_shift_test(1.0, 0.0, 1.0, n=0), EstimationError, "n ≥ 1"),
        (lambda r: mean_shift_test(1.0, 0.0, 1.0, n=9, alpha=1.0), EstimationError, "α < 1"),
        (warmed([1.0, 0.0], 20.0, 900.0), RobotError, "do not decrease"),
        (warmed([], 20.0, 900.0), RobotError, "at least one number"),
        (warmed([0.0, 1.0], 20.0, 0.0), RobotError, "positive time constant"),
        (warmed([0.0, 1.0], 20.0, np.inf), RobotError, "positive time constant"),
        (warmed([0.0, 1.0], [20.0] * 3, 900.0), RobotError, "3 ambient temperatures do not fit 2 times"),
        (warmed([0.0, 1.0], np.full((3, 5), 20.0), 900.0), RobotError, r"\(3, 5\) do not fit 2 times"),
        (warmed([0.0, 1.0], {"column": 20.0}, 900.0), RobotError, "no ambient temperature is given for joint_2"),
        (identified(axes=("x", "y")), EstimationError, "given for 2 poses, but there are 5"),
        (identified(axes="xq"), EstimationError, "not 'xq'"),
        (identified(axes="xx"), EstimationError, "not 'xx'"),
        (identified(axes=""), EstimationError, "not ''"),
        (identified(sigma=[1.0, 2.0]), EstimationError, r"sigma of shape \(2,\)"),
        (identified(covariance=np.eye(2)), EstimationError, r"covariance of shape \(2, 2\)"),
        (identified(covariance=np.zeros((3, 3))), EstimationError, "not positive definite"),
        (identified(covariance=np.full((3, 3), np.nan)), EstimationError, "not a finite number"),
        (identified(sigma=1.0, covariance=np.eye(3)), EstimationError, "not as both"),
        (lambda r: identify_elongations(r, GOOD, np.zeros((4, 3))), EstimationError, r"\(4, 3\) do not fit"),
        (lambda r: best_poses(r, 5, criterion="G"), EstimationError, "D, A or E, not 'G'"),
        (lambda r: best_poses(r, 5, candidates=4), EstimationError, "5 poses cannot be chosen from 4"),
        (lambda r: best_poses(r, 5, candidates=np.full((9, 5), 9.0)), EstimationError, "cannot be chosen from 0"),
        (lambda r: best_poses(r, 5, candidates=np.zeros((9, 4))), EstimationError, r"expected \(M, 5\)"),
        (lambda r: best_poses(r, 5, axes=("x", "z")), EstimationError, "given for 2 poses, but there are 5"),
    ],
)
def test_what_does_not_fit_is_said(rv_m2, call, error, words):
    with pytest.raises(error, match=words):
        call(rv_m2)
