"""What the normal equations hold: frames projected out, rows in their own noise, what nothing tells apart left out."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import some
from inference.problems import WIDTHS, FirstJoint, columns_of, problem_of, small_problem
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.effects import choose
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.problem import (
    Linear,
    Products,
    Whitening,
    contained,
    frame_step,
    generalised,
    gram,
    parameter_values,
    whitened,
)
from thermal_robot.inference.registration import register
from thermal_robot.inference.search import Search
from thermal_robot.observations import observe


def flat(linear, whitening, columns):
    """(rows·m, K) columns of the rows with weight, in noise."""
    used = whitening.weights > 0
    root = np.sqrt(whitening.weights[used])[:, None, None] / whitening.noise[:, None]
    return (columns[used] * root).reshape(-1, columns.shape[2])


def residual(linear, whitening, columns):
    """The same with what the frames explain of them by least squares taken away."""
    frames, own = flat(linear, whitening, linear.frames), flat(linear, whitening, columns)
    return own - frames @ np.linalg.lstsq(frames, own, rcond=None)[0]


def test_the_gram_is_that_of_the_residuals_of_a_fit_of_the_frames():
    for seed in range(5):
        linear, whitening = small_problem(seed, present=(0, 2))
        seen = gram(linear, whitening)
        columns = residual(linear, whitening, np.concatenate([b.columns * b.sizes for b in linear.blocks], axis=2))
        gap = residual(linear, whitening, linear.gap[:, :, None])[:, 0]
        turned = np.hstack([columns[:, s] @ basis for s, basis in zip(seen.slices, seen.bases, strict=True)])
        np.testing.assert_allclose(seen.matrix, turned.T @ turned, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(seen.vector, turned.T @ gap, rtol=1e-9, atol=1e-8)
        assert seen.total == pytest.approx(gap @ gap, rel=1e-9)
        # every direction is seen, so that the reduced columns are the columns turned
        assert [b.shape for b in seen.bases] == [(w, w) for w in WIDTHS]
        for basis in seen.bases:
            np.testing.assert_allclose(basis.T @ basis, np.eye(len(basis)), atol=1e-12)


def test_aliases_of_the_frames_vanish():
    linear, whitening = small_problem(1)
    rng = np.random.default_rng(1)
    alias = linear.frames @ rng.normal(size=(2, 3))
    free = rng.normal(size=(12, 3, 1))
    mixed = np.concatenate([alias[:, :, :2], free], axis=2)
    seen = gram(Linear(linear.gap, linear.frames, (columns_of(alias), columns_of(mixed))), whitening)
    assert seen.bases[0].shape == (3, 0)
    np.testing.assert_allclose(np.abs(seen.bases[1]), [[0.0], [0.0], [1.0]], atol=1e-6)
    # whatever the frames could take up, a shift of them changes nothing
    shifted = replace(linear, gap=linear.gap + linear.frames @ [3.0, -8.0])
    again, plain = gram(shifted, whitening), gram(linear, whitening)
    np.testing.assert_allclose(again.vector, plain.vector, atol=1e-8)
    assert again.total == pytest.approx(plain.total, rel=1e-9)


def test_rows_without_weight_do_not_count():
    linear, whitening = small_problem(3)
    spoilt = replace(linear, gap=linear.gap.copy())
    spoilt.gap[whitening.weights == 0.0] = 1e6
    plain, again = gram(linear, whitening), gram(spoilt, whitening)
    assert (again.total, again.equations) == (plain.total, plain.equations)
    assert len(whitened(linear, whitening)) == 11 * 3
    # four rows of half the weight are two
    half = replace(whitening, weights=np.full(12, 0.5))
    whole = replace(whitening, weights=np.ones(12))
    np.testing.assert_allclose(2.0 * gram(linear, half).matrix, gram(linear, whole).matrix, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("twice", [False, True], ids=["each determined", "one of them there twice"])
def test_the_frames_step_leaves_nothing_that_frames_could_explain(twice):
    linear, whitening = small_problem(5)
    if twice:
        linear = replace(linear, frames=np.concatenate([linear.frames, linear.frames[:, :, :1]], axis=2))
    step = frame_step(linear, whitening, linear.gap)
    left = flat(linear, whitening, (linear.gap - linear.frames @ step)[:, :, None])
    assert np.abs(flat(linear, whitening, linear.frames).T @ left).max() < 1e-9
    # and a frame that is there twice counts once
    plain, again = gram(small_problem(5)[0], whitening), gram(linear, whitening)
    assert again.equations == plain.equations
    np.testing.assert_allclose(again.matrix, plain.matrix, rtol=1e-9, atol=1e-9)
    none = replace(linear, frames=linear.frames[:, :, :0])
    assert frame_step(none, whitening, linear.gap).shape == (0,)


def test_a_direction_that_nothing_sees_keeps_its_prior():
    linear, whitening = small_problem(6)
    twins = np.repeat(linear.blocks[0].columns, 2, axis=2)
    sizes = np.array([2.0, 2.0])
    linear = replace(linear, gap=linear.gap + twins @ [3.0, 3.0], blocks=(columns_of(twins, sizes),))
    seen = gram(linear, whitening)
    assert seen.bases[0].shape == (2, 1)
    found = Search(seen, (0.0,)).evaluate((0,))
    mean, covariance = parameter_values(linear, seen, found)[0]
    apart = np.array([1.0, -1.0]) / np.sqrt(2.0)
    assert apart @ mean == pytest.approx(0.0, abs=1e-12)
    assert apart @ covariance @ apart == pytest.approx((2.0 * found.scales[0]) ** 2, rel=1e-9)
    both = np.array([1.0, 1.0]) / np.sqrt(2.0)
    assert both @ covariance @ both < 0.1 * apart @ covariance @ apart


@pytest.mark.parametrize(("left", "held"), [(0.0, True), (1e-3, True), (0.3, False)])
def test_a_block_lies_within_another_where_the_data_cannot_tell(left, held):
    rng = np.random.default_rng(7)
    large = rng.normal(size=(40, 3, 4))
    small = 100.0 * (large @ rng.normal(size=(4, 2)) + left * rng.normal(size=(40, 3, 2)))
    linear, whitening = small_problem(7, rows=40)
    linear = replace(linear, blocks=(columns_of(small), columns_of(large), columns_of(rng.normal(size=(40, 3, 2)))))
    assert contained(gram(linear, whitening)) == ({frozenset({0, 1})} if held else frozenset())
    # what moves the gap by less than its noise is not told from anything
    faint = replace(linear, blocks=(*linear.blocks[:2], columns_of(1e-3 * linear.blocks[2].columns)))
    assert frozenset({1, 2}) in contained(gram(faint, whitening))


def test_values_are_the_posterior_mean_and_covariance():
    linear, whitening = small_problem(3, present=(0, 2))
    problem = gram(linear, whitening)
    found = Search(problem, (0, 0, 0)).evaluate((0, 2))
    used = whitening.weights > 0
    root = np.sqrt(whitening.weights[used])[:, None, None]
    columns = [(linear.blocks[b].columns[used] * root).reshape(-1, WIDTHS[b]) for b in (0, 2)]
    frames = (linear.frames[used] * root).reshape(len(columns[0]), -1)
    # all unknowns at once: frames with a flat prior, parameters with theirs
    design = np.hstack([frames, *columns])
    sizes = np.repeat([2.0 * found.scales[0], 2.0 * found.scales[2]], [1, 3])
    precision = design.T @ design / found.noise**2 + np.diag([0.0, 0.0, *(1.0 / sizes**2)])
    covariance = np.linalg.inv(precision)
    mean = covariance @ design.T @ (linear.gap[used] * root[:, :, 0]).ravel() / found.noise**2
    values = parameter_values(linear, problem, found)
    np.testing.assert_allclose(np.concatenate([values[0][0], values[2][0]]), mean[2:], rtol=1e-9)
    np.testing.assert_allclose(values[0][1], covariance[2:3, 2:3], rtol=1e-9)
    np.testing.assert_allclose(values[2][1], covariance[3:, 3:], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_units_do_not_matter(unit):
    """Metres or millimetres for the gap; parameters in any unit whose expected size is stated in it."""
    linear, whitening = small_problem(2, present=(0, 2))
    plain = gram(linear, whitening)
    blocks = tuple(replace(b, source=b.columns * unit) for b in linear.blocks)
    longer = Linear(linear.gap * unit, linear.frames * 7.0, blocks)
    longer = gram(longer, replace(whitening, noise=whitening.noise * unit))
    blocks = tuple(replace(b, source=b.columns * unit, sizes=b.sizes / unit) for b in linear.blocks)
    other = gram(replace(linear, blocks=blocks), whitening)
    for again in (longer, other):
        assert again.equations == plain.equations == 11 * 3 - 2
        assert again.total == pytest.approx(plain.total, rel=1e-12)
        np.testing.assert_allclose(again.matrix, plain.matrix, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(np.abs(again.vector), np.abs(plain.vector), rtol=1e-9)


on_arms = pytest.mark.parametrize("arm", some(["rv_m2", "ur10", "panda"], 3), indirect=True)


@on_arms
@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
def test_an_offset_of_the_first_joint_is_a_turn_of_an_unknown_base(arm, turning):
    offset = choose(["joint_offset"])[0]
    _, seen = problem_of(arm, [FirstJoint(), offset], turning)
    assert seen.bases[0].shape == (1, 0)
    assert seen.slices[0] == slice(0, 0)
    assert np.abs(seen.bases[1][0]).max() < 1e-6  # no visible direction holds the first joint
    # the last joint's is a turn of the unknown target, on an axis or in a pose
    assert np.abs(seen.bases[1][-1]).max() < 1e-6
    assert seen.bases[1].shape[1] == arm.n - 2
    _, seen = problem_of(arm, [FirstJoint(), offset], turning, base_known=True)
    assert seen.bases[0].shape == (1, 1)
    assert seen.bases[1].shape[1] == arm.n - 1


def test_what_lies_in_the_frames_is_confounded_with_them(rv_m2):
    campaign = simulate(rv_m2, seed=1, samples=60)[0]
    finding = diagnose(campaign, effects=[FirstJoint()]).finding("first_joint")
    assert finding.status == "confounded"
    assert finding.confounded_with == ("base_frame", "tool_frame")
    assert finding.parameters == ()


@on_arms
@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
def test_geometric_contains_offsets_and_for_positions_scale_and_nothing_else(arm, turning):
    names = ["joint_offset", "joint_gain", "transmission_error", "backlash", "joint_compliance", "geometric"]
    names += ["thermal_elongation", "drift", "instrument_scale"]
    effects = choose(names)
    _, seen = problem_of(arm, effects, turning)
    pairs = {tuple(sorted(effects[b].name for b in pair)) for pair in contained(seen)}
    held = {("geometric", "joint_offset"), ("geometric", "instrument_scale")}
    assert held == {pair for pair in pairs if "geometric" in pair}
    search = Search(seen, (-2.2,) * len(effects), contained(seen))
    search.run()
    assert len(search.seen) > 10
    assert not any(pair <= set(blocks) for pair in contained(seen) for blocks in search.seen)


@pytest.mark.slow
@pytest.mark.parametrize("arm", ["ur10"], indirect=True)
@pytest.mark.parametrize("part", ["joint_offset", "instrument_scale"])
def test_two_effects_of_which_one_contains_the_other_are_never_named_together(arm, part):
    found = diagnose(simulate(arm, ["geometric", part], seed=int(part == "instrument_scale"))[0])
    assert found.verdict == ("geometric",)
    assert found.finding(part).status != "found"


def test_each_row_is_whitened_by_its_own_noise():
    linear, even = small_problem(3)
    relative = np.random.default_rng(3).uniform(0.5, 5.0, linear.gap.shape)
    scaled = Linear(
        linear.gap * relative,
        linear.frames * relative[:, :, None],
        tuple(columns_of(b.columns * relative[:, :, None], b.sizes) for b in linear.blocks),
    )
    own = replace(even, relative=relative)
    np.testing.assert_allclose(whitened(scaled, own), whitened(linear, even), rtol=1e-12)
    np.testing.assert_array_equal(own.sigma([2, 4]), even.noise * relative[[2, 4]])


NAMES = ("joint_offset", "joint_gain", "backlash", "drift")


@pytest.fixture(scope="module")
def seen(rv_m2):
    data = simulate(rv_m2, ["joint_offset", "drift"], samples=50, seed=4)[0]
    return observe(data, register(data))


@pytest.fixture(scope="module")
def whitening(seen):
    weights = np.random.default_rng(0).uniform(0.0, 1.0, len(seen.gap)).round(1)  # some rows are not used
    assert (weights == 0.0).any()
    return Whitening(weights, np.array([2e-5, 3e-5, 4e-5]), 5.0)


def test_every_selection_in_any_order_is_as_if_formed_anew(seen, whitening):
    blocks = [block(seen, effect) for effect in choose(NAMES)]
    whole = Linear(seen.gap, frame_columns(seen)[0], ())
    kept = Products(whole, whitening)
    for which in ([0], [0, 1], [1, 0], [3, 2, 1], [0, 1, 2, 3], [2], []):
        some = [blocks[k] for k in which]
        linear, found = kept.problem(some)
        assert linear.blocks == tuple(some)
        expected = gram(Linear(whole.gap, whole.frames, tuple(some)), whitening)
        assert (found.slices, found.equations, found.ranks) == (expected.slices, expected.equations, expected.ranks)
        assert found.total == pytest.approx(expected.total, rel=1e-10)
        # the reduction of a block is free up to turns: what is seen of the parameters is not
        for a, b, basis, other in zip(found.slices, expected.slices, found.bases, expected.bases, strict=True):
            mine, theirs = basis @ found.vector[a], other @ expected.vector[b]
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max(initial=0.0))
            mine = basis @ found.matrix[a, a] @ basis.T
            theirs = other @ expected.matrix[b, b] @ other.T
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max(initial=0.0))


NOISE = np.array([2e-5, 3e-5, 5e-5])


def covariances(rng, rows):
    """(rows, 3, 3) positive definite, the smallest and largest axis apart by orders of magnitude."""
    turned = np.linalg.qr(rng.normal(size=(rows, 3, 3)))[0]
    return (turned * 10.0 ** rng.uniform(-10, -6, (rows, 1, 3))) @ turned.transpose(0, 2, 1)


def test_squared_lengths_are_those_of_the_covariance():
    """Of the gap and of every column: |x|² in noise is xᵀ S⁻¹ x."""
    rng = np.random.default_rng(1)
    linear = small_problem(1)[0]
    covariance = covariances(rng, 12)
    plain, white = linear.stack, generalised(linear, covariance, NOISE).stack / NOISE[:, None]
    expected = np.einsum("nik,nij,njl->nkl", plain, np.linalg.inv(covariance), plain)
    found = np.einsum("nik,nil->nkl", white, white)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_the_fit_is_that_of_weighted_least_squares():
    """The parameters of the normal equations Xᵀ S⁻¹ X θ = Xᵀ S⁻¹ y (Aitken)."""
    rng = np.random.default_rng(2)
    linear = small_problem(2)[0]
    # rows that differ by a factor of three
    covariance = covariances(rng, 12) / 1e-8 + 0.3 * np.eye(3)
    columns = linear.stack[:, :, :-1]
    inverse = np.linalg.inv(covariance)
    expected = np.linalg.solve(
        np.einsum("nik,nij,njl->kl", columns, inverse, columns),
        np.einsum("nik,nij,nj->k", columns, inverse, linear.gap),
    )
    white = generalised(linear, covariance, NOISE)
    root = (white.stack / NOISE[:, None]).reshape(36, -1)
    np.testing.assert_allclose(np.linalg.lstsq(root[:, :-1], root[:, -1], rcond=None)[0], expected, rtol=1e-7)
