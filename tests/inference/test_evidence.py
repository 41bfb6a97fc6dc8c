"""The evidence is the density it claims to be, and what the data cannot see or tell apart is known as such."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.special import logsumexp
from scipy.stats import multivariate_normal
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.effects import Effect, Parameter, at_joint, choose
from thermal_robot.inference.columns import Block, block, frame_columns
from thermal_robot.inference.evidence import Search
from thermal_robot.inference.frames import register
from thermal_robot.inference.problem import Linear, Whitening, contained, gram, parameter_values
from thermal_robot.inference.robust import design_effect
from thermal_robot.observations import observe

SPREAD = 1.5  # of ln λ: effects of three times the stated size are no surprise
WIDTHS = (1, 2, 3)


def columns_of(array, sizes=None):
    """A block of columns that no effect stands behind."""
    return Block(None, (), array, np.ones(array.shape[2]) if sizes is None else sizes)


def small_problem(seed, rows=12, present=(1,), noise=1.0, held=20.0):
    """Two flat frame columns, three blocks of which some are present, noise of known size."""
    rng = np.random.default_rng(seed)
    frames = rng.normal(size=(rows, 3, 2))
    blocks = tuple(columns_of(rng.normal(size=(rows, 3, w)), np.full(w, 2.0)) for w in WIDTHS)
    gap = noise * rng.normal(size=(rows, 3)) + frames @ [50.0, -20.0]
    for b in present:
        gap = gap + blocks[b].columns @ (2.0 * rng.choice([-1.0, 1.0], WIDTHS[b]))
    weights = rng.uniform(0.3, 1.0, rows)
    weights[0] = 0.0
    return Linear(gap, frames, blocks), Whitening(weights, np.full(3, noise), held)


def seen_of(linear, whitening, blocks, noise=1.0):
    """Gap and each block's columns without what the frames take up, in units of the noise, of the prior sizes."""
    used = whitening.weights > 0
    root = np.sqrt(whitening.weights[used])[:, None, None] / whitening.noise[:, None]
    away = null_space((linear.frames[used] * root).reshape(used.sum() * 3, -1).T)
    gap = away.T @ (linear.gap[used][:, :, None] * root).ravel()
    items = (linear.blocks[b] for b in blocks)
    return gap / noise, [away.T @ (i.columns[used] * root * i.sizes).reshape(used.sum() * 3, -1) / noise for i in items]


def direct(linear, whitening, found, log_prior, scales=None, noise=None):
    """The same figure from the multivariate normal density of the gap, the frames projected out.

    Differs from it by a constant: that of the density, and those of the priors of noise and scales.
    """
    scales, noise = scales or found.scales, noise or found.noise
    gap, columns = seen_of(linear, whitening, found.blocks)
    covariance = noise**2 * np.eye(len(gap))
    for b, own in zip(found.blocks, columns, strict=True):
        covariance += scales[b] ** 2 * own @ own.T
    density = multivariate_normal(cov=covariance).logpdf(gap)
    density -= 0.5 * whitening.held * (np.log(noise**2) + 1.0 / noise**2)
    return (
        density
        - 0.5 * sum((np.log(s) / SPREAD) ** 2 for s in scales.values())
        + sum(log_prior[b] for b in found.blocks)
    )


def volume(linear, whitening, found):
    """What a parabola through the density's peak over the logarithms of all scales adds, over that of their prior.

    Its curvature is measured on the density itself, by differences of sixth order; NaN where there is no peak.
    """
    count, step = len(found.blocks), 0.05

    def at(move):
        scales = {b: found.scales[b] * np.exp(m) for b, m in zip(found.blocks, move, strict=True)}
        return direct(linear, whitening, found, (0, 0, 0), scales=scales)

    def along(way):
        weights = {0: -49 / 18, 1: 3 / 2, 2: -3 / 20, 3: 1 / 90}
        return -sum(w * (at(k * step * way) + (at(-k * step * way) if k else 0.0)) for k, w in weights.items())

    axes = np.eye(count)
    bend = np.array([[0.25 * (along(a + b) - along(a - b)) / step**2 for b in axes] for a in axes]).reshape(
        count, count
    )
    curvature = np.linalg.eigvalsh(bend) * SPREAD**2
    return -0.5 * np.log(curvature).sum() if (curvature > 0.0).all() else np.nan


def integrated(linear, whitening, found):
    """Logarithm of the density integrated over the logarithms of all scales with their prior, over that at its peak.

    The noise is held. The grid reaches six standard deviations of the prior; finer, it gives the same to 1e-6.
    """
    gap, columns = seen_of(linear, whitening, found.blocks, found.noise)
    # what no column reaches does not depend on the scales
    basis = np.linalg.qr(np.hstack(columns))[0]
    gap, columns = basis.T @ gap, [basis.T @ own for own in columns]
    logs = np.linspace(-9.0, 9.0, 121 if len(columns) == 1 else 61)
    outer = [own @ own.T for own in columns]

    def density(move):
        covariance = np.eye(len(gap)) + np.tensordot(np.exp(2.0 * move), outer, 1)
        solved = np.linalg.solve(covariance, np.broadcast_to(gap, move.shape[:-1] + gap.shape)[..., None])[..., 0]
        return -0.5 * (np.linalg.slogdet(covariance)[1] + solved @ gap + ((move / SPREAD) ** 2).sum(axis=-1))

    grid = np.stack(np.meshgrid(*[logs] * len(columns), indexing="ij"), axis=-1)
    total = logsumexp([logsumexp(density(line)) for line in grid])
    width = len(columns) * np.log((logs[1] - logs[0]) / np.sqrt(2.0 * np.pi * SPREAD**2))
    peak = density(np.log([found.scales[b] for b in found.blocks]))
    return total + width - peak


def all_combinations(linear, whitening, log_prior=(-1.0, -2.0, -0.5)):
    problem = gram(linear, whitening)
    search = Search(problem, log_prior)
    chosen = [c for size in range(4) for c in combinations(range(3), size)]
    return problem, search, [search.evaluate(c) for c in chosen]


@pytest.mark.parametrize("present", [(), (1,), (0, 2)])
@pytest.mark.parametrize("held", [0.0, 20.0])
def test_evidence_is_the_density_of_the_gap(present, held):
    log_prior = (-1.0, -2.0, -0.5)
    for seed in range(5):
        linear, whitening = small_problem(seed, present=present, held=held)
        _, _, found = all_combinations(linear, whitening, log_prior)
        ours = np.array([c.log_evidence for c in found])
        theirs = np.array([direct(linear, whitening, c, log_prior) + volume(linear, whitening, c) for c in found])
        np.testing.assert_allclose(ours - ours[0], theirs - theirs[0], rtol=0, atol=1e-6)


def test_evidence_is_the_density_of_the_gap_for_effects_much_larger_than_expected():
    for seed in range(6):
        linear, whitening = small_problem(seed, present=(0, 2))
        linear = replace(linear, blocks=tuple(replace(b, sizes=b.sizes / 30.0) for b in linear.blocks))
        _, _, found = all_combinations(linear, whitening, (0, 0, 0))
        ours = np.array([c.log_evidence for c in found])
        theirs = np.array([direct(linear, whitening, c, (0, 0, 0)) + volume(linear, whitening, c) for c in found])
        # in a valley between a small and a large size the search for the peak may end on its brim
        peaked = np.isfinite(theirs)
        assert peaked.sum() >= 6
        np.testing.assert_allclose((ours - ours[0])[peaked], (theirs - theirs[0])[peaked], rtol=0, atol=1e-3)


def test_evidence_is_the_integral_over_the_sizes_of_effects():
    """Blocks of 1, 2 and 3 columns and pairs of them, there or not, seen ten times as well or as badly as the noise.

    What is left is the skewness of the peak: most where a block is hardly seen.
    """
    errors = {}
    for seed in range(4):
        for present in ((), (0, 1, 2)):
            for noise in (0.2, 2.0, 20.0):
                linear, whitening = small_problem(seed, rows=30, present=present, noise=noise)
                search = Search(gram(linear, whitening), (0.0,) * 3)
                for blocks in ((0,), (1,), (2,), (0, 2), (1, 2)):
                    found = search.evaluate(blocks)
                    ours = found.log_evidence - direct(linear, whitening, found, (0, 0, 0))
                    constant = search.evaluate(()).log_evidence - direct(linear, whitening, search.evaluate(()), (0,))
                    error = ours - constant - integrated(linear, whitening, found)
                    how = "there" if present and noise < 1.0 else "hardly"
                    errors.setdefault((how, len(blocks)), []).append(error)
    assert np.abs(errors["there", 1]).max() < 0.1
    assert np.abs(errors["there", 2]).max() < 0.1
    assert np.abs(errors["hardly", 1]).max() < 0.3
    assert np.abs(errors["hardly", 2]).max() < 0.55
    assert np.abs(np.mean(errors["hardly", 1])) < 0.1


@pytest.mark.parametrize("present", [(), (1,), (0, 2)])
def test_scales_and_noise_are_the_most_probable_ones(present):
    """No other noise or scale, two per cent away, gives the gap a higher density."""
    for seed in range(5):
        linear, whitening = small_problem(seed, present=present, rows=30)
        _, _, found = all_combinations(linear, whitening)
        for c in found:
            best = direct(linear, whitening, c, (0, 0, 0))
            for factor in (0.98, 1.02):
                assert direct(linear, whitening, c, (0, 0, 0), noise=factor * c.noise) < best
                for b in c.blocks:
                    other = {**c.scales, b: factor * c.scales[b]}
                    assert direct(linear, whitening, c, (0, 0, 0), scales=other) < best


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


def test_probabilities_sum_to_one_and_favour_the_truth():
    for seed in range(10):
        linear, whitening = small_problem(seed, rows=30, present=(1,))
        search = Search(gram(linear, whitening), (-2.2,) * 3)
        best = search.run()
        order, probability = search.probabilities()
        assert probability.sum() == pytest.approx(1.0, abs=1e-12)
        assert (np.diff(probability) <= 0).all()
        assert order[0] is best
        assert best.blocks == (1,)


def test_the_search_finds_the_best_of_all_combinations():
    for seed in range(10):
        linear, whitening = small_problem(seed, present=((), (0,), (0, 2), (0, 1, 2))[seed % 4])
        search = Search(gram(linear, whitening), (-2.2,) * 3)
        best = search.run()
        _, _, found = all_combinations(linear, whitening, (-2.2,) * 3)
        assert best.log_evidence == pytest.approx(max(c.log_evidence for c in found), abs=1e-3)


def test_a_column_of_noise_lowers_the_evidence_on_average():
    gained = []
    for seed in range(40):
        linear, whitening = small_problem(seed, rows=30, present=(1,))
        search = Search(gram(linear, whitening), (0.0,) * 3)
        gained += [search.evaluate((1, b)).log_evidence - search.evaluate((1,)).log_evidence for b in (0, 2)]
    assert np.mean(gained) < -1.0
    assert np.mean(np.array(gained) > 0.0) < 0.15


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_units_do_not_matter(unit):
    """Metres or millimetres for the gap; parameters in any unit whose expected size is stated in it."""
    linear, whitening = small_problem(2, present=(0, 2))
    plain = gram(linear, whitening)
    blocks = tuple(replace(b, columns=b.columns * unit) for b in linear.blocks)
    longer = Linear(linear.gap * unit, linear.frames * 7.0, blocks)
    longer = gram(longer, replace(whitening, noise=whitening.noise * unit))
    blocks = tuple(replace(b, columns=b.columns * unit, sizes=b.sizes / unit) for b in linear.blocks)
    other = gram(replace(linear, blocks=blocks), whitening)
    for again in (longer, other):
        assert again.equations == plain.equations == 11 * 3 - 2
        assert again.total == pytest.approx(plain.total, rel=1e-12)
        np.testing.assert_allclose(again.matrix, plain.matrix, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(np.abs(again.vector), np.abs(plain.vector), rtol=1e-9)


# What a robot's columns are to the data ------------------------------------------------------------------


class FirstJoint(Effect):
    """The zero of the first joint alone."""

    name = "first_joint"

    def parameters(self, observations):
        return (Parameter("offset", "rad", 1e-3, "joint", observations.robot.joint_names[0], (at_joint(0, 1.0),)),)


def problem_of(robot, effects, turning=None, base_known=False):
    campaign = simulate(robot, ["joint_offset"], seed=0, turning=turning)[0]
    if base_known:
        base = register(campaign).base
        campaign = replace(campaign, base_known=True, position=(campaign.position - base[:3, 3]) @ base[:3, :3])
    seen = observe(campaign, register(campaign))
    linear = Linear(seen.gap, frame_columns(seen)[0], tuple(block(seen, e) for e in effects))
    noise = np.repeat([25e-6, turning or 1.0], 3)[: linear.measures]
    return linear, gram(linear, Whitening(np.ones(campaign.samples), noise, 20.0))


on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


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


@pytest.mark.parametrize("arm", ["ur10"], indirect=True)
def test_two_effects_of_which_one_contains_the_other_are_never_named_together(arm):
    for seed, both in enumerate([["geometric", "joint_offset"], ["geometric", "instrument_scale"]]):
        campaign = simulate(arm, both, seed=seed)[0]
        found = diagnose(campaign)
        assert found.verdict == ("geometric",)
        assert found.finding(both[1]).status != "found"


def test_rows_are_worth_one_each_unless_their_remainders_are_alike(rv_m2):
    linear, seen = problem_of(rv_m2, choose(["joint_offset", "joint_gain"]))
    whitening = Whitening(np.ones(120), np.full(3, 25e-6), 20.0)
    groups = (np.arange(120) // 10,)
    independent = []
    for seed in range(10):
        noise = 25e-6 * np.random.default_rng(seed).normal(size=(120, 3))
        independent.append(design_effect(linear, seen, noise, whitening, groups))
    assert np.median(independent) == 1.0
    assert max(independent) < 2.0
    # columns and remainders that are the same throughout each group of ten: ten rows are worth one
    rng = np.random.default_rng(10)
    constant = replace(linear, blocks=(columns_of(np.repeat(rng.normal(size=(12, 3, 2)), 10, axis=0)),))
    steady = gram(replace(constant, frames=linear.frames[:, :, :0]), whitening)
    shared = 25e-6 * np.repeat(rng.normal(size=(12, 3)), 10, axis=0)
    apart = (np.tile(np.arange(10), 12),)
    flat = replace(constant, frames=linear.frames[:, :, :0])
    assert design_effect(flat, steady, shared, whitening, groups) == pytest.approx(10.0, rel=1e-9)
    assert design_effect(flat, steady, shared, whitening, apart) == 1.0
    tempered = steady.tempered(10.0)
    assert tempered.equations == steady.equations / 10.0
    np.testing.assert_allclose(tempered.matrix, steady.matrix / 10.0)
