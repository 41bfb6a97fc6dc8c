"""The discrepancy is the Gaussian process it claims to be, follows what is smooth, and does not follow noise."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from inference.densities import dense
from scipy.linalg import sqrtm
from simulate import simulate

from thermal_robot.inference import settings
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.explain import explain
from thermal_robot.inference.kernels import Form, Smooth, Spectrum, decomposed, forms
from thermal_robot.inference.problem import Linear
from thermal_robot.inference.registration import register
from thermal_robot.inference.weights import Noise
from thermal_robot.observations import Frames, observe

NOISE = 25e-6  # m
TAUS = (0.5, 3.0)


def one_for_all(rng, rows, functions, measures=3, components=3):
    return Form("one", rng.normal(size=(rows, functions)), rng.normal(size=(measures, components)))


def by_row(rng, rows, functions, measures=3, components=2):
    return Form("by row", rng.normal(size=(rows, functions)), rng.normal(size=(rows, measures, components)))


CASES = {
    "one matrix, narrow": lambda rng: one_for_all(rng, 14, 4),
    "one matrix, wide": lambda rng: one_for_all(rng, 9, 20),
    "one matrix, one direction": lambda rng: one_for_all(rng, 14, 4, components=1),
    "one matrix, poses": lambda rng: one_for_all(rng, 10, 3, measures=6, components=6),
    "by row, narrow": lambda rng: by_row(rng, 14, 5),
    "by row, wide": lambda rng: by_row(rng, 9, 30),
    "by row, poses": lambda rng: by_row(rng, 10, 4, measures=6, components=3),
}


@pytest.fixture(params=list(CASES))
def case(request):
    """A form's spectrum, weights of two rows zero; the dense covariance of those in use, and of all with them."""
    rng = np.random.default_rng(len(request.param))
    form = CASES[request.param](rng)
    count, measures = len(form.functions), form.moves.shape[-2]
    noise = np.repeat(rng.uniform(0.5, 2.0, measures // 3), 3)
    weights = rng.uniform(0.3, 1.0, count)
    weights[[1, 4]] = 0.0
    whole = dense(form, noise)
    used = np.repeat(weights > 0, measures)
    root = np.repeat(np.sqrt(weights), measures)
    across = whole * root  # of all rows with those in use, weighed
    inside = (root[:, None] * across)[np.ix_(used, used)]
    return Spectrum.of(form, weights, noise), inside, across[:, used], measures, rng


@pytest.mark.parametrize("tau", TAUS)
def test_products_are_those_beside_the_dense_covariance(case, tau):
    spectrum, inside, _, _, rng = case
    stack = rng.normal(size=(len(inside), 7))
    expected = stack.T @ np.linalg.solve(np.eye(len(inside)) + tau**2 * inside, stack)
    found = Smooth(spectrum, tau).products(stack)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    # from columns that were carried over once
    again = spectrum.products(tau, spectrum.along(stack), stack.T @ stack)
    np.testing.assert_allclose(again, found, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_no_columns_have_no_products(case):
    """As where both frames are known and no effect is found."""
    spectrum, inside, _, _, _ = case
    none = np.zeros((len(inside), 0))
    assert Smooth(spectrum, 1.0).products(none).shape == (0, 0)
    assert spectrum.spread(1.0, none).shape == (0, 0)
    assert Smooth(spectrum, 1.0).whitened(none).shape == none.shape


@pytest.mark.parametrize("tau", TAUS)
def test_columns_are_spread_by_the_dense_covariance(case, tau):
    spectrum, inside, _, _, rng = case
    stack = rng.normal(size=(len(inside), 7))
    expected = stack.T @ (np.eye(len(inside)) + tau**2 * inside) @ stack
    np.testing.assert_allclose(spectrum.spread(tau, stack), expected, rtol=0, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("tau", TAUS)
def test_columns_are_whitened_by_the_root_of_the_dense_covariance(case, tau):
    spectrum, inside, _, _, rng = case
    stack = rng.normal(size=(len(inside), 5))
    expected = np.linalg.inv(np.real(sqrtm(np.eye(len(inside)) + tau**2 * inside))) @ stack
    np.testing.assert_allclose(Smooth(spectrum, tau).whitened(stack), expected, rtol=0, atol=1e-8)
    white = Smooth(spectrum, tau).whitened(stack)
    products = Smooth(spectrum, tau).products(stack)
    np.testing.assert_allclose(white.T @ white, products, rtol=0, atol=1e-10 * np.abs(products).max())


@pytest.mark.parametrize("tau", TAUS)
def test_the_determinant_and_what_is_followed_are_those_of_the_dense_covariance(case, tau):
    spectrum, inside, _, _, _ = case
    covariance = np.eye(len(inside)) + tau**2 * inside
    smooth = Smooth(spectrum, tau)
    assert smooth.log_det == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-10)
    assert smooth.degrees == pytest.approx(np.trace(np.linalg.solve(covariance, tau**2 * inside)), rel=1e-10)


@pytest.mark.parametrize("tau", TAUS)
def test_the_eigenvectors_put_the_covariance_together(case, tau):
    spectrum, inside, _, _, _ = case
    vectors, variance = spectrum.eigen(tau, 1e-8)
    assert (variance > 1e-8).all()
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(len(variance)), rtol=0, atol=1e-8)
    np.testing.assert_allclose((vectors * variance) @ vectors.T, tau**2 * inside, rtol=0, atol=2e-8 * len(inside))
    few, large = spectrum.eigen(tau, float(np.median(variance)))
    assert few.shape[1] == len(large) < len(variance)


@pytest.mark.parametrize("tau", TAUS)
def test_the_mean_is_that_of_the_process_given_the_rows_in_use(case, tau):
    spectrum, inside, across, measures, rng = case
    left = rng.normal(size=len(inside))
    expected = tau**2 * across @ np.linalg.solve(np.eye(len(inside)) + tau**2 * inside, left)
    found = Smooth(spectrum, tau).mean(left)
    assert found.shape == (len(across) // measures, measures)
    np.testing.assert_allclose(found.ravel(), expected, rtol=0, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("name", list(CASES))
def test_a_unit_of_a_form_is_the_noise(name):
    """Whatever the units of functions and moves: the discrepancy's mean square is τ² times the noise's."""
    rng = np.random.default_rng(3)
    form = CASES[name](rng)
    count, measures = len(form.functions), form.moves.shape[-2]
    noise = np.repeat(rng.uniform(0.5, 2.0, measures // 3), 3)
    for factor in (1.0, 1e-5):
        other = replace(form, moves=factor * form.moves, functions=7.0 * form.functions)
        smooth = Smooth(Spectrum.of(other, np.ones(count), noise), 2.0)
        covariance = np.linalg.inv(smooth.products(np.eye(count * measures)))
        assert (np.diag(covariance) - 1.0).mean() == pytest.approx(4.0, rel=1e-8)


def one_hot(form):
    """A form that is anew, with a function for each pose or visit."""
    assert form.anew
    return replace(form, functions=np.eye(form.functions.max().astype(int) + 1)[form.functions.astype(int)])


def campaign_of(name, repeats=1, **told):
    plain = simulate(load_arm(name), samples=60, seed=2, **{"noise": NOISE, **told})[0]
    return plain.take(np.repeat(np.arange(60 // repeats), repeats)) if repeats > 1 else plain


def seen(campaign):
    return observe(campaign, register(campaign))


@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
@pytest.mark.parametrize(("repeats", "stated"), [(1, True), (1, False), (3, True), (3, False)])
def test_a_campaign_allows_what_it_can_tell(repeats, stated, turning):
    """What is smooth, anywhere, in one joint, or at the base, always; what is anew, where it is told from noise.

    What a pose brings is, by a stated noise or by repeats; what a visit brings, by repeats.
    """
    campaign = campaign_of("ur10", repeats, turning=turning)
    if not stated:
        campaign = replace(campaign, noise_position=None)
    joints = campaign.robot.joint_names
    found = forms(seen(campaign))
    names = [form.name for form in found]
    assert len(names) == len(set(names))
    smooth = {form.name for form in found if not form.anew}
    tool = {f"tool, {length:g}" for length in settings.LENGTHS}
    assert smooth == {*tool, "places", *(f"places, {place}" for place in (*joints, "base"))}
    anew = {form.name for form in found if form.anew}
    poses = {"poses", *(f"poses, {place}" for place in (*joints, "base"))} if stated or repeats > 1 else set()
    visits = {f"visits, {place}" for place in (*joints, "base")} if repeats > 1 else set()
    assert anew == poses | visits
    for form in found:
        if "," in form.name and form.name not in tool:
            assert form.place == (("base" if form.name.endswith("base") else "joint"), form.name.split(", ")[1])
        else:
            assert form.place == ("", "")
    measures = 3 if turning is None else 6
    for form in found:
        assert len(form.functions) == campaign.samples
        assert form.moves.shape[-2] == measures
        assert np.isfinite(form.functions).all()


def test_a_joint_that_never_moves_does_not_scatter(rv_m2):
    campaign = simulate(rv_m2, samples=40, seed=1, noise=NOISE)[0]
    q = campaign.q.copy()
    q[:, 2] = 0.3
    names = {form.name for form in forms(observe(replace(campaign, q=q), Frames.declared(campaign)))}
    assert "poses, joint_2" in names
    assert "poses, joint_3" not in names


@pytest.mark.parametrize("part", [0.5, 2.0])
def test_a_second_joint_errs_beside_the_first_and_independently_of_it(part):
    """Their covariances add up; the second's root mean square at the target is so many times the first's."""
    campaign, noise = campaign_of("ur10"), np.full(3, NOISE)
    one, other = (f for f in forms(seen(campaign)) if f.name in ("poses, elbow_joint", "poses, wrist_1_joint"))
    both = one.beside(other, part)
    assert (both.name, both.several, both.anew) == ("poses, elbow_joint, wrist_1_joint", True, True)
    expected = (dense(one_hot(one), noise) + part**2 * dense(one_hot(other), noise)) / (1.0 + part**2)
    np.testing.assert_allclose(dense(one_hot(both), noise), expected, rtol=0, atol=1e-10)


def test_visits_of_a_pose_share_what_the_pose_brings_and_not_what_a_visit_brings():
    campaign = campaign_of("rv_m2", 3)
    noise = np.full(3, NOISE)
    same = np.repeat(np.repeat(np.kron(np.eye(20), np.ones((3, 3))), 3, axis=0), 3, axis=1)
    own = np.repeat(np.repeat(np.eye(60), 3, axis=0), 3, axis=1)
    for form in forms(seen(campaign)):
        if form.anew:
            found = np.abs(dense(one_hot(form), noise)) > 1e-12
            assert not found[(same if form.name.startswith("poses") else own) == 0.0].any()
            assert found.any()


def bare(campaign):
    """The problem with frames alone."""
    observed = seen(campaign)
    return Linear(observed.gap, frame_columns(observed)[0], ()), forms(observed)


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
    smooth = explain(linear, Noise(NOISE), forms=[form for form in offered if not form.anew])
    assert smooth.discrepancy.probability > 0.999
    assert smooth.discrepancy.form.name == "places, joint_3"
    assert apart(smooth.smooth - moved) < 0.5 * NOISE
    # that the joint errs anew in every pose is no rival of what is smooth
    found = explain(linear, Noise(NOISE), forms=offered)
    assert found.discrepancy.form.name == "places, joint_3"
    assert found.discrepancy.forms["places, joint_3"] > 0.99
    assert apart(found.smooth - moved) < 0.5 * NOISE


def test_noise_is_not_followed():
    """In at least 95 of 100 draws a discrepancy is less probable than before."""
    beliefs = []
    campaign = campaign_of("rv_m2")
    linear, offered = bare(campaign)
    rng = np.random.default_rng(11)
    for _ in range(100):
        drawn = replace(linear, gap=NOISE * rng.normal(size=linear.gap.shape))
        beliefs.append(explain(drawn, Noise(NOISE), forms=offered).discrepancy.probability)
    assert np.mean(np.array(beliefs) < 0.5) >= 0.95, np.sort(beliefs)[-10:]


@pytest.mark.parametrize("turning", [None, 3e-5], ids=["positions", "poses"])
@pytest.mark.parametrize("number", [0, 3, 4, -1], ids=["tool", "places", "one place", "anew"])
def test_a_form_over_the_noise_of_each_row_is_the_dense_one_over_it(rv_m2, number, turning):
    """K of rows in units of their own noise is D⁻¹ K D⁻¹, up to its mean on the diagonal."""
    data = replace(simulate(rv_m2, samples=12, seed=2, turning=turning)[0], priors={})
    form = forms(observe(data, register(data)))[number]
    measures = 3 if turning is None else 6
    relative = np.ones((12, measures))
    relative[:, :3] = np.random.default_rng(0).uniform(0.3, 3.0, (12, 1))
    noise = np.repeat([2e-5, 3e-5], 3)[:measures]

    def dense_of(one):
        spectrum = decomposed(one, np.ones(12), noise)
        return spectrum.spread(1.0, np.eye(12 * measures)) if isinstance(spectrum, Spectrum) else grouped(spectrum)

    def grouped(found):
        inverse = found.whitened(1.0, np.eye(12 * measures))
        return np.linalg.inv(inverse @ inverse)

    plain, over = (dense_of(one) - np.eye(12 * measures) for one in (form, form.over(relative)))
    expected = plain / np.outer(relative.ravel(), relative.ravel())
    np.testing.assert_allclose(over / np.trace(over), expected / np.trace(expected), atol=1e-9)
    assert form.over(None) is form
