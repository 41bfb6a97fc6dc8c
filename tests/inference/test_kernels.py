"""The discrepancy is the Gaussian process it claims to be, follows what is smooth, and does not follow noise."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import some
from inference.densities import dense
from scipy.linalg import sqrtm
from simulate import simulate

from thermal_robot.inference import settings
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.explain import explain
from thermal_robot.inference.kernels import (
    DesignMatrix,
    GroupKernel,
    Kernel,
    KernelCovariance,
    SmoothKernel,
    decomposed,
    discrepancy_kernels,
)
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.registration import register
from thermal_robot.inference.weights import Noise
from thermal_robot.observations import Frames, observe

NOISE = 25e-6  # m
TAUS = (0.5, 3.0)


# name: rows, functions, measures, components, whether each row has moves of its own
SMOOTH = {
    "one matrix, narrow": (14, 4, 3, 3, False),
    "one matrix, wide": (9, 20, 3, 3, False),
    "one matrix, one direction": (14, 4, 3, 1, False),
    "one matrix, poses": (10, 3, 6, 6, False),
    "by row, narrow": (14, 5, 3, 2, True),
    "by row, wide": (9, 30, 3, 2, True),
    "by row, poses": (10, 4, 6, 3, True),
}
# name: groups of a dozen rows; measures, components, whether each row has moves of its own
ANEW = {
    "one column": (np.arange(12) // 3, 3, 1, True),
    "two columns": (np.arange(12) // 3, 3, 2, True),
    "more columns than a group has equations": (np.arange(12), 3, 5, True),
    "groups of poses": (np.arange(12) // 4, 6, 6, True),
    "the same moves for all rows": (np.arange(12) // 3, 3, 3, False),
    "groups of several sizes, mixed": (np.array([3, 0, 1, 3, 0, 3, 2, 1, 3, 0, 4, 3]), 3, 2, True),
    "numbers that no row has": (np.array([5, 0, 2, 5, 0, 5, 2, 8, 5, 0, 8, 5]), 3, 2, True),
    "all rows one group": (np.zeros(12, dtype=int), 3, 2, True),
}


def form_of(name, rng):
    """The kernel of a case; its groups, if it has any."""
    first, *functions, measures, components, by_row = {**SMOOTH, **ANEW}[name]
    rows = first if functions else len(first)
    moves = rng.normal(size=(rows, measures, components) if by_row else (measures, components))
    if functions:
        return Kernel(name, rng.normal(size=(rows, *functions)), moves), None
    return Kernel(name, first.astype(float), moves, grouped=True), first


class Case:
    """A kernel's decompositions and its dense covariances: of the rows in use, and of all rows with them.

    Two rows weigh nothing. Of a grouped kernel the last row's group weighs nothing either; it is decomposed by
    groups and with a function for each group.
    """

    def __init__(self, name):
        self.rng = np.random.default_rng([4, len(name)])
        kernel, groups = form_of(name, self.rng)
        rows, self.measures = len(kernel.functions), kernel.moves.shape[-2]
        noise = np.repeat(self.rng.uniform(0.5, 2.0, self.measures // 3), 3)
        weights = self.rng.uniform(0.3, 1.0, rows)
        weights[[1, 4]] = 0.0
        if groups is not None and len(set(groups)) > 1:
            weights[groups == groups[10]] = 0.0
        self.spectra, each = [decomposed(kernel, weights, noise)], kernel
        if groups is not None:
            each = replace(kernel, functions=np.eye(groups.max() + 1)[groups], grouped=False)
            # written out by row: where moves are the same for all, a spectrum takes another way
            written = np.broadcast_to(kernel.moves, (rows, *kernel.moves.shape[-2:]))
            self.spectra.append(SmoothKernel.of(replace(each, moves=written), weights, noise))
        root, used = np.repeat(np.sqrt(weights), self.measures), np.repeat(weights > 0, self.measures)
        across = dense(each, noise) * root  # of all rows with those in use, weighed
        self.inside, self.across = (root[:, None] * across)[np.ix_(used, used)], across[:, used]
        self.stack = self.rng.normal(size=(len(self.inside), 6))

    def covariance(self, tau):
        return np.eye(len(self.inside)) + tau**2 * self.inside


@pytest.fixture(params=[*SMOOTH, *ANEW])
def case(request):
    return Case(request.param)


def close(found, expected, to=1e-10):
    np.testing.assert_allclose(found, expected, rtol=0, atol=to * max(np.abs(expected).max(), 1.0))


@pytest.mark.parametrize("chunk", [5, 1024])
@pytest.mark.parametrize("tau", TAUS)
def test_products_and_the_mean_are_those_of_the_dense_covariance(case, tau, chunk, monkeypatch):
    """The mean is that of the process given the rows in use; it does not matter how many rows are taken at once."""
    monkeypatch.setattr(settings, "CHUNK", chunk)
    stack, plain, left = case.stack, case.stack.T @ case.stack, case.stack[:, 0]
    expected = stack.T @ np.linalg.solve(case.covariance(tau), stack)
    mean = tau**2 * case.across @ np.linalg.solve(case.covariance(tau), left)
    for own in case.spectra:
        smooth = KernelCovariance(own, tau)
        close(smooth.products(DesignMatrix.from_array(stack, case.measures)), expected)
        # from some columns that were carried over once
        some = own.along(DesignMatrix.from_array(stack, case.measures))[:, [4, 1]]
        close(smooth.reduced(plain[np.ix_([4, 1], [4, 1])], some), expected[np.ix_([4, 1], [4, 1])])
        found = smooth.mean(left)
        assert found.shape == (len(case.across) // case.measures, case.measures)
        close(found.ravel(), mean)


@pytest.mark.parametrize("tau", TAUS)
def test_whitened_columns_the_determinant_and_what_is_followed_are_those_of_the_dense_covariance(case, tau):
    covariance = case.covariance(tau)
    whitened = np.linalg.inv(np.real(sqrtm(covariance))) @ case.stack
    for own in case.spectra:
        smooth = KernelCovariance(own, tau)
        close(smooth.whitened(case.stack), whitened, 1e-8)
        close(
            smooth.whitened(case.stack).T @ smooth.whitened(case.stack),
            smooth.products(DesignMatrix.from_array(case.stack, case.measures)),
        )
        assert smooth.log_det == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-10)
        followed = np.trace(np.linalg.solve(covariance, tau**2 * case.inside))
        assert smooth.degrees == pytest.approx(followed, rel=1e-10)


def test_a_spectrum_puts_the_kernel_together(case):
    """Its factor in the eigenvectors is orthogonal, of the eigenvalues' lengths, and its square is the kernel."""
    for spectrum in case.spectra:
        factor = spectrum.back(np.eye(len(spectrum.value))).reshape(len(case.inside), -1)
        close(factor @ factor.T, case.inside, 1e-9)
        close(factor.T @ factor, np.diag(spectrum.value), 1e-9)
        close(spectrum.along(DesignMatrix.from_array(case.stack, case.measures)), factor.T @ case.stack)
        # no columns, as where both frames are known and no effect is found, have no products
        none = case.stack[:, :0]
        nothing = DesignMatrix.from_array(none, case.measures)
        assert KernelCovariance(spectrum, 2.0).products(nothing).shape == (0, 0)
        assert KernelCovariance(spectrum, 2.0).whitened(none).shape == none.shape


@pytest.mark.parametrize("name", ANEW)
@pytest.mark.parametrize("tau", TAUS)
def test_what_some_rows_have_in_common_is_that_of_their_own_covariance(name, tau):
    case = Case(name)
    assert isinstance(case.spectra[0], GroupKernel)
    rows = case.rng.random(len(case.stack) // case.measures) < 0.7
    own, columns = np.repeat(rows, case.measures), case.stack.reshape(len(rows), case.measures, -1)
    some, covariance = case.stack[own], case.covariance(tau)[np.ix_(own, own)]
    expected = some.T @ some - some.T @ np.linalg.solve(covariance, some)
    for spectrum in case.spectra:
        close(KernelCovariance(spectrum, tau).reduction(rows, lambda which: columns[which], 1e-8), expected, 1e-6)
        assert not KernelCovariance(spectrum, tau).reduction(rows, lambda which: columns[which], 1e9).any()
    # what lies below a floor is left out of both alike
    floor = float(np.median(np.linalg.eigvalsh(tau**2 * case.inside)[-4:]))
    close(*(KernelCovariance(s, tau).reduction(rows, lambda which: columns[which], floor) for s in case.spectra))


def test_of_a_group_that_no_row_in_use_has_nothing_is_known():
    """Its mean is that of the prior, nought; the other groups' is not."""
    case = Case("groups of several sizes, mixed")
    grouped = case.spectra[0]
    mean = KernelCovariance(grouped, 3.0).mean(case.stack[:, 0])
    alone = ~np.isin(grouped.groups, grouped.group)
    assert alone.any()
    assert (mean[alone] == 0.0).all()
    assert (np.abs(mean[~alone]).max(axis=1) > 1e-3).all()
    # a row that is set aside errs as the others of its group where the moves are the same
    case = Case("the same moves for all rows")
    mean = KernelCovariance(case.spectra[0], 3.0).mean(case.stack[:, 0])
    for group in range(4):
        assert np.ptp(mean[case.spectra[0].groups == group], axis=0).max() < 1e-12
    # where no row is in use there is nothing
    empty = KernelCovariance(GroupKernel.of(grouped.everywhere, grouped.groups, np.zeros(12), np.ones(3)), 3.0)
    assert (empty.log_det, empty.degrees) == (0.0, 0.0)
    assert (empty.mean(np.zeros(0)) == 0.0).all()


@pytest.mark.parametrize("name", [*SMOOTH, *ANEW])
def test_a_unit_of_a_form_is_the_noise(name):
    """Whatever the units of functions and moves: the discrepancy's mean square is τ² times the noise's."""
    rng = np.random.default_rng(3)
    kernel, groups = form_of(name, rng)
    count, measures = len(kernel.functions), kernel.moves.shape[-2]
    noise = np.repeat(rng.uniform(0.5, 2.0, measures // 3), 3)
    for factor in (1.0, 1e-5):
        functions = kernel.functions if groups is not None else 7.0 * kernel.functions
        other = replace(kernel, moves=factor * kernel.moves, functions=functions)
        smooth = KernelCovariance(decomposed(other, np.ones(count), noise), 2.0)
        covariance = np.linalg.inv(smooth.products(DesignMatrix.from_array(np.eye(count * measures), measures)))
        assert (np.diag(covariance) - 1.0).mean() == pytest.approx(4.0, rel=1e-8)


def one_hot(kernel):
    """A kernel of groups: one for each pose or visit."""
    assert kernel.grouped
    return replace(kernel, functions=np.eye(kernel.functions.max().astype(int) + 1)[kernel.functions.astype(int)])


def campaign_of(name, repeats=1, **told):
    plain = simulate(load_arm(name), samples=60, seed=2, **{"noise": NOISE, **told})[0]
    return plain.take(np.repeat(np.arange(60 // repeats), repeats)) if repeats > 1 else plain


def seen(campaign):
    return observe(campaign, register(campaign))


@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
@pytest.mark.parametrize(("repeats", "stated"), [(1, True), (1, False), (3, True), (3, False)])
def test_a_campaign_allows_what_it_can_tell(repeats, stated, turning):
    """What is smooth, anywhere, in one joint, or at the base, always; what is grouped, where it is told from noise.

    What a pose brings is, by a stated noise or by repeats; what a visit brings, by repeats.
    """
    campaign = campaign_of("ur10", repeats, turning=turning)
    if not stated:
        campaign = replace(campaign, noise_position=None)
    joints = campaign.robot.joint_names
    found = discrepancy_kernels(seen(campaign))
    names = [kernel.name for kernel in found]
    assert len(names) == len(set(names))
    smooth = {kernel.name for kernel in found if not kernel.grouped}
    tool = {f"tool, {length:g}" for length in settings.LENGTHS}
    assert smooth == {*tool, "places", *(f"places, {place}" for place in (*joints, "base"))}
    grouped = {kernel.name for kernel in found if kernel.grouped}
    poses = {"poses", *(f"poses, {place}" for place in (*joints, "base"))} if stated or repeats > 1 else set()
    visits = {f"visits, {place}" for place in (*joints, "base")} if repeats > 1 else set()
    assert grouped == poses | visits
    for kernel in found:
        if "," in kernel.name and kernel.name not in tool:
            assert kernel.place == (("base" if kernel.name.endswith("base") else "joint"), kernel.name.split(", ")[1])
        else:
            assert kernel.place == ("", "")
    measures = 3 if turning is None else 6
    for kernel in found:
        assert len(kernel.functions) == campaign.samples
        assert kernel.moves.shape[-2] == measures
        assert np.isfinite(kernel.functions).all()


def test_a_joint_that_never_moves_does_not_scatter(rv_m2):
    campaign = simulate(rv_m2, samples=40, seed=1, noise=NOISE)[0]
    q = campaign.q.copy()
    q[:, 2] = 0.3
    names = {kernel.name for kernel in discrepancy_kernels(observe(replace(campaign, q=q), Frames.declared(campaign)))}
    assert "poses, joint_2" in names
    assert "poses, joint_3" not in names


@pytest.mark.parametrize("part", [0.5, 2.0])
def test_a_second_joint_errs_beside_the_first_and_independently_of_it(part):
    """Their covariances add up; the second's root mean square at the target is so many times the first's."""
    campaign, noise = campaign_of("ur10"), np.full(3, NOISE)
    one, other = (
        f for f in discrepancy_kernels(seen(campaign)) if f.name in ("poses, elbow_joint", "poses, wrist_1_joint")
    )
    both = one.with_joint(other, part)
    assert (both.name, both.joints) == ("poses, elbow_joint, wrist_1_joint", ("elbow_joint", "wrist_1_joint"))
    expected = (dense(one_hot(one), noise) + part**2 * dense(one_hot(other), noise)) / (1.0 + part**2)
    np.testing.assert_allclose(dense(one_hot(both), noise), expected, rtol=0, atol=1e-10)


def test_visits_of_a_pose_share_what_the_pose_brings_and_not_what_a_visit_brings():
    campaign = campaign_of("rv_m2", 3)
    noise = np.full(3, NOISE)
    same = np.repeat(np.repeat(np.kron(np.eye(20), np.ones((3, 3))), 3, axis=0), 3, axis=1)
    own = np.repeat(np.repeat(np.eye(60), 3, axis=0), 3, axis=1)
    for kernel in discrepancy_kernels(seen(campaign)):
        if kernel.grouped:
            found = np.abs(dense(one_hot(kernel), noise)) > 1e-12
            assert not found[(same if kernel.name.startswith("poses") else own) == 0.0].any()
            assert found.any()


def bare(campaign):
    """The problem with frames alone."""
    observed = seen(campaign)
    return Linear(observed.gap, frame_columns(observed)[0], ()), discrepancy_kernels(observed)


def test_a_smooth_error_of_one_joint_is_followed(rv_m2):
    plain = simulate(rv_m2, samples=120, seed=4, noise=NOISE)[0]
    frames = Frames.declared(plain)
    nominal = observe(plain, frames)
    angle = 8e-4 * np.sin(2.0 * plain.q[:, 2])
    moved = nominal.joint_sensitivity[:, :3, 2] * angle[:, None]
    rng = np.random.default_rng(4)
    true = nominal.predicted_position + moved @ frames.base[:3, :3].T
    campaign = replace(plain, position=true + NOISE * rng.normal(size=true.shape), priors={})
    linear, offered = bare(campaign)
    design = linear.frames.reshape(-1, linear.frames.shape[2])

    def apart(values):
        """What frames do not take of it, root mean square."""
        flat = values.ravel()
        return np.sqrt(((flat - design @ np.linalg.lstsq(design, flat, rcond=None)[0]) ** 2).mean())

    assert apart(moved) > 2.0 * NOISE
    smooth = explain(linear, Noise(NOISE), kernels=[kernel for kernel in offered if not kernel.grouped])
    assert smooth.discrepancy.probability > 0.999
    assert smooth.discrepancy.kernel.name == "places, joint_3"
    assert apart(smooth.smooth - moved) < 0.5 * NOISE
    # that the joint errs anew in every pose is no rival of what is smooth
    found = explain(linear, Noise(NOISE), kernels=offered)
    assert found.discrepancy.kernel.name == "places, joint_3"
    assert found.discrepancy.kernels["places, joint_3"] > 0.99
    assert apart(found.smooth - moved) < 0.5 * NOISE


@pytest.mark.parametrize("draws", [20, pytest.param(100, marks=pytest.mark.slow)])
def test_noise_is_not_followed(draws):
    """In at least 95 of 100 draws a discrepancy is less probable than before."""
    beliefs = []
    campaign = campaign_of("rv_m2")
    linear, offered = bare(campaign)
    rng = np.random.default_rng(11)
    for _ in range(draws):
        drawn = replace(linear, gap=NOISE * rng.normal(size=linear.gap.shape))
        beliefs.append(explain(drawn, Noise(NOISE), kernels=offered).discrepancy.probability)
    assert np.mean(np.array(beliefs) < 0.5) >= 0.95, np.sort(beliefs)[-10:]


@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
@pytest.mark.parametrize("number", some([3, 0, 4, -1], 4))
def test_a_form_over_the_noise_of_each_row_is_the_dense_one_over_it(rv_m2, number, turning):
    """K of rows in units of their own noise is D⁻¹ K D⁻¹, up to its mean on the diagonal."""
    data = replace(simulate(rv_m2, samples=12, seed=2, turning=turning)[0], priors={})
    kernel = discrepancy_kernels(observe(data, register(data)))[number]
    measures = 3 if turning is None else 6
    relative = np.ones((12, measures))
    relative[:, :3] = np.random.default_rng(0).uniform(0.3, 3.0, (12, 1))
    noise = np.repeat([2e-5, 3e-5], 3)[:measures]

    def dense_of(one):
        factor = decomposed(one, np.ones(12), noise)
        factor = factor.back(np.eye(len(factor.value))).reshape(12 * measures, -1)
        return np.eye(12 * measures) + factor @ factor.T

    plain, over = (dense_of(one) - np.eye(12 * measures) for one in (kernel, kernel.over(relative)))
    expected = plain / np.outer(relative.ravel(), relative.ravel())
    np.testing.assert_allclose(over / np.trace(over), expected / np.trace(expected), atol=1e-9)
    assert kernel.over(None) is kernel
