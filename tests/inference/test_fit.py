"""A fit ends where its choice stays and its constants are the likeliest, not at a point of a grid."""

import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from scipy.stats import chi2
from several import FLAT, LONG, simulated
from simulate import simulate
from time_constants import DRIFT, LAG, NOISE, campaign

import thermal_robot as tr
from thermal_robot import diagnose
from thermal_robot.effects import JointOffset, choose, gate, named
from thermal_robot.errors import EffectError, EstimationError
from thermal_robot.inference.exact import corrected_observations
from thermal_robot.inference.fit import fit, fit_named, less, refit

slow = pytest.mark.slow


def constant_of(effects, kind):
    """The time constant of the effect of that name."""
    (effect,) = [e for e, *_ in effects if e.name == kind]
    return effect.lag if kind == LAG else effect.time_constant


@pytest.mark.parametrize(
    ("kind", "constant"),
    [(LAG, 420.0), *(pytest.param(*own, marks=slow) for own in ((DRIFT, 0.067), (LAG, 1759.0), (DRIFT, 0.195)))],
)
def test_a_large_effect_leaves_nothing_to_others_whatever_its_constant(kind, constant):
    data = campaign("panda", 0, kind, constant, 35.0)
    known = fit(data, choose((), ()))
    assert [effect.name for effect, _ in known.effects] == [kind]
    assert constant_of(known.effects, kind) == pytest.approx(constant, rel=0.03)
    blocks = [known.explanation.linear.blocks[b] for b in known.explanation.best.blocks]
    assert [b.effect for b in blocks] == [effect for effect, _ in known.effects]
    assert known.explanation.best.noise * known.explanation.whitening.noise[0] == pytest.approx(NOISE, rel=0.15)


def test_a_fit_without_an_effect_is_the_one_that_never_had_it_to_choose(rv_m2):
    """Whether what was weighed is asked, or all is chosen again without it."""
    names = ["joint_gain", "joint_offset", "backlash"]
    data = simulate(rv_m2, names[:2], seed=2, samples=60)[0]
    known = fit(data, choose(names, (), ()))
    assert {effect.name for effect, _ in known.effects} == set(names[:2])
    rest, again = less(known, "joint_gain"), refit(known, {"joint_gain": ()})
    for one in (rest, again):
        assert "joint_gain" not in {*one.variants, *(effect.name for effect, _ in one.effects)}
        assert one.probability_of_just(one.names_of(one.explanation.best)) > 0.5
        np.testing.assert_allclose(
            one.corrected.gap, corrected_observations(data, one.corrected.frames, one.effects).gap, atol=1e-12
        )
    assert [effect for effect, _ in rest.effects] == [effect for effect, _ in again.effects]


def test_effects_and_sets_of_effects_share_one_probability(rv_m2):
    """Of two effects four sets are possible, and each effect is in two of them; faint ones leave all four some."""
    names = ["drift", "joint_gain"]
    data = simulate(rv_m2, names, seed=3, samples=60, ratio=(0.3, 0.3))[0]
    known = fit(data, choose(names, (), ()))
    sets = [set(), {"drift"}, {"joint_gain"}, set(names)]
    each = [known.probability_of_just(one) for one in sets]
    assert sum(each) == pytest.approx(1.0, abs=1e-9)
    assert min(each) > 0.0
    for name in names:
        assert known.probability(name) == pytest.approx(
            sum(p for one, p in zip(sets, each, strict=True) if name in one)
        )
        effects = {known.explanation.linear.blocks[b].effect.name for b in known.blocks_of(name)}
        assert effects == {name}
    assert known.names_of(known.explanation.best) == {effect.name for effect, _ in known.effects}


@slow
@pytest.mark.parametrize(("kind", "shortest", "longest"), [(LAG, 400.0, 4500.0), (DRIFT, 0.06, 1.2)])
def test_large_effects_are_the_verdict_at_constants_drawn_at_random(kind, shortest, longest):
    named = []
    for seed in range(16):
        rng = np.random.default_rng([seed, 8])
        constant = float(np.exp(rng.uniform(np.log(shortest), np.log(longest))))
        arm = ["rv_m2", "ur10", "panda", "ur5"][seed % 4]
        named.append(diagnose(campaign(arm, seed, kind, constant, rng.uniform(10.0, 40.0))).verdict)
    assert named.count((kind,)) >= 15, named


def unlike(data, times, seed):
    """The campaign with every second row measured by an instrument so many times as noisy."""
    rng, factor = np.random.default_rng([seed, 5]), np.where(np.arange(data.samples) % 2, times, 1.0)
    further = rng.normal(size=(data.samples, 3)) * data.noise_position * np.sqrt(factor**2 - 1.0)[:, None]
    sigmas = data.noise_position * factor
    return replace(data, position=data.position + further, noise_position=None, noise_of_rows=sigmas)


@slow
def test_rows_of_unlike_noise_count_by_it(rv_m2):
    """Parameters are off by what is said of them, and by far less than where all rows count alike."""
    off, said, alike = [], [], []
    for seed in range(40):
        data, truth, _ = simulate(rv_m2, ["instrument_scale"], seed=seed, samples=40, ratio=(12.0, 15.0))
        data = unlike(data, 10.0, seed)
        (true,) = truth["parts"]["instrument_scale"]["values"].values()
        for one, errors in ((data, off), (replace(data, noise_of_rows=None), alike)):
            known = fit(one, choose(("instrument_scale",), (), ()))
            value, covariance = known.explanation.values[known.explanation.best.blocks[0]]
            errors.append(float(value[0]) - true)
            if errors is off:
                said.append(float(np.sqrt(covariance[0, 0])))
    z2 = float(np.mean((np.array(off) / said) ** 2))
    assert chi2.ppf(0.001, 40) < 40 * z2 < chi2.ppf(0.999, 40)
    assert np.std(off) < 0.4 * np.std(alike)


@pytest.mark.slow
def test_one_noise_in_every_row_is_the_noise_of_all(rv_m2):
    data = simulate(rv_m2, ["joint_offset"], seed=4, samples=60)[0]
    each = replace(data, noise_position=None, noise_of_rows=np.full(60, data.noise_position))
    whole, same = (json.dumps(diagnose(one).to_dict(), sort_keys=True) for one in (data, each))
    assert same == whole


@pytest.mark.slow
def test_rows_of_unlike_noise_leave_a_diagnosis_as_it_is(rv_m2):
    """A thousand times the noise in every second row is as good as their absence."""
    data = simulate(rv_m2, ["joint_offset"], seed=4, samples=120)[0]
    found = diagnose(unlike(data, 1e3, 0)).to_dict()
    half = diagnose(data.take(np.arange(0, 120, 2))).to_dict()
    assert found["verdict"]["effects"] == half["verdict"]["effects"] == ["joint_offset"]
    for own, other in zip(found["effects"][0]["parameters"], half["effects"][0]["parameters"], strict=True):
        if other["identified"]:
            assert own["value"] == pytest.approx(other["value"], abs=other["std"] / 5)


@slow
@pytest.mark.parametrize(("targets", "lost"), [(FLAT, 0.0), (LONG, 0.15)], ids=["three", "four, some lost"])
def test_parameters_that_several_targets_tell_are_off_by_what_is_said_of_them(targets, lost):
    """Of the last joints, whose turns the targets tell; along the rod they tell it far worse than across."""
    arm, joints, z2 = load_arm("ur10"), ["wrist_2_joint", "wrist_3_joint"], []
    for seed in range(20):
        data, truth = simulated(arm, ["joint_gain"], targets, seed, ratio=(6.0, 8.0), places=joints, lost=lost)
        known = fit(data, choose(("joint_gain",), (), ()))
        (block,) = known.explanation.best.blocks
        values, covariance = known.explanation.values[block]
        true = truth["parts"]["joint_gain"]["values"]
        for k, parameter in enumerate(known.explanation.linear.blocks[block].parameters):
            if parameter.place in joints:
                z2.append(float((values[k] - true.get(parameter.name, 0.0)) ** 2 / covariance[k, k]))
    assert chi2.ppf(0.001, len(z2)) < sum(z2) < chi2.ppf(0.999, len(z2))


ARM, NAMED_NOISE = "builtin:rv_m2", 20e-6
OFF = {"joint_2": 1.2e-3, "joint_3": -8e-4, "joint_4": 5e-4}


def with_known_base(effects, rows=60, seed=1, **further):
    return tr.simulate(
        ARM,
        effects,
        rows=rows,
        noise=NAMED_NOISE,
        base=np.eye(4),
        tool=np.eye(4),
        tool_frame="tool0",
        seed=seed,
        **further,
    )


@pytest.fixture(scope="module")
def offsets():
    return with_known_base({"joint_offset": OFF})


def test_it_is_the_whole_fit_where_that_would_choose_the_same(offsets):
    whole = fit(offsets, choose(only=["joint_offset"]))
    own = fit_named(offsets, [JointOffset()])
    assert [effect for effect, _ in whole.effects] == [effect for effect, _ in own.effects]
    std = np.sqrt(np.diag(own.explanation.values[0][1]))
    assert (np.abs(whole.effects[0][1] - own.effects[0][1]) < 0.05 * std).all()
    np.testing.assert_allclose(own.nominal.gap, whole.nominal.gap, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(own.corrected.gap, whole.corrected.gap, rtol=0.0, atol=0.05 * NAMED_NOISE)


def test_an_effect_that_is_not_there_is_fitted_all_the_same(offsets):
    found = fit_named(offsets, [named("joint_offset"), named("backlash")])
    assert [effect.name for effect, _ in found.effects] == ["joint_offset", "backlash"]
    values, covariance = found.effects[1][1], found.explanation.values[1][1]
    assert (np.abs(values) < 4.0 * np.sqrt(np.diag(covariance))).all()


def test_without_noise_the_exact_model_is_found():
    offsets = tr.simulate(ARM, {"joint_offset": {"joint_3": 0.03}}, base=np.eye(4), tool_frame="tool0", seed=2)
    found = fit_named(offsets, [JointOffset()])
    assert np.abs(found.nominal.gap).max() > 1e-3
    assert np.abs(found.corrected.gap).max() < 1e-7


def test_another_step_would_move_nothing_that_is_measured(offsets):
    found = fit_named(offsets, [named("geometric")])
    again = tr.observe(offsets, found.corrected.frames, displacement=found.corrected.displacement)
    np.testing.assert_array_equal(again.gap, found.corrected.gap)
    e = found.explanation
    (linear, covariance), (_, exact) = e.values[0], found.effects[0]
    away = np.linalg.lstsq(covariance, linear - exact, rcond=1e-12)[0] @ (linear - exact)
    assert away < 0.1**2 * len(exact)


def test_gross_errors_are_set_aside_and_change_little(offsets):
    position, struck = offsets.position.copy(), [4, 17, 40]
    position[struck] += [[0.01, 0.0, 0.0], [0.0, -0.02, 0.0], [0.0, 0.0, 0.005]]
    spoilt = fit_named(replace(offsets, position=position), [JointOffset()])
    clean = fit_named(offsets, [JointOffset()])
    assert np.flatnonzero(spoilt.explanation.outliers).tolist() == struck
    std = np.sqrt(np.diag(clean.explanation.values[0][1]))
    assert (np.abs(spoilt.effects[0][1] - clean.effects[0][1]) < 2.0 * std).all()


def test_what_is_told_inside_another_is_not_fitted_beside_it(offsets):
    both = fit_named(offsets, [named("joint_offset"), named("geometric")])
    assert [effect.name for effect, _ in both.effects] == ["geometric"]
    assert set(both.variants) == {"joint_offset", "geometric"}


def test_constants_of_another_kind_are_fitted_too():
    seen = tr.observe(with_known_base({}, rows=80))
    slow = max(gate.variants(named("thermal_elongation"), seen), key=lambda e: e.lag)
    found = fit_named(with_known_base({slow: 2e-5}, rows=80), [named("thermal_elongation")])
    assert found.effects[0][0].lag == pytest.approx(slow.lag, rel=0.5)


def test_what_a_campaign_lacks_is_said(offsets):
    bare = offsets.drop_covariate("temperature")
    with pytest.raises(EffectError, match="'thermal_elongation' cannot be fitted to simulated, which lacks temp"):
        fit_named(bare, [named("thermal_elongation")])
    with pytest.raises(EstimationError, match="different poses are too few"):
        fit_named(offsets.take(np.arange(4)), [JointOffset()])
    two = np.arange(offsets.samples) % 2
    held = replace(offsets, q=offsets.q[two] + 1e-4 * np.sin(offsets.q), labels={"pose": two.astype(str)})
    read = replace(offsets, q=offsets.q[two].round(3) + 1e-5 * np.sin(offsets.q))
    for again in (held, read):  # by its label; by what an encoder adds
        with pytest.raises(EstimationError, match=r"^2 different poses are too few"):
            fit_named(again, [JointOffset()])
