"""A choice is made again at its own exact fit until it stays, with constants where the evidence is largest."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from inference.problems import FirstJoint
from simulate import simulate
from time_constants import DRIFT, LAG
from time_constants import campaign as lagging

import thermal_robot
from thermal_robot.effects import Backlash, JointGain, choose, gate
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.exact import (
    _alternatives,
    _leading,
    corrected_observations,
    downweighted,
    gauss_newton,
    refined,
    select_exactly,
)
from thermal_robot.inference.explain import Noise, explain
from thermal_robot.inference.fit import fit
from thermal_robot.inference.problem import Linear, gram, parameter_values
from thermal_robot.inference.registration import moved, register
from thermal_robot.inference.search import Search
from thermal_robot.observations import Frames, observe

NOISE = 25e-6  # m
NAMES = ("joint_offset", "joint_gain", "geometric", "drift")


class Rare(JointGain):
    """A gain that was picked out of very many."""

    share = 1e-200


def settled(campaign, names=NAMES, effects=(), **told):
    """The explanation at its exact fit, and what was said meanwhile."""
    start, said = observe(campaign, register(campaign)), []
    variants = {e.name: e.variants(start) for e in (*choose(names, (), ()), *effects)}
    return select_exactly(start, variants, said.append, **told), said


def names_of(found):
    return tuple(effect.name for effect, _ in found.held)


@pytest.fixture(scope="module")
def bic_gain(rv_m2):
    campaign = simulate(rv_m2, ["joint_gain"], seed=2, ratio=(20.0, 30.0))[0]
    return campaign, *settled(campaign)


def test_what_is_at_work_is_held_and_the_exact_model_leaves_the_noise(bic_gain):
    campaign, found, said = bic_gain
    assert names_of(found) == ("joint_gain",)
    left = found.explanation.whitening.noise[0] * found.explanation.best.noise
    assert left == pytest.approx(NOISE, rel=0.15)
    exact = corrected_observations(campaign, found.observations.frames, found.held)
    np.testing.assert_allclose(found.observations.gap, exact.gap, rtol=0, atol=1e-12)
    # the explanation is linearised there: its remainder is the exact one's
    used = found.explanation.whitening.weights > 0
    assert np.abs(found.explanation.remainder - exact.gap)[used].max() < 0.1 * NOISE
    # it says what it does
    assert said == ["combinations of effects", "selection at the exact fit"]
    # and one setting is never beside another of its name
    assert len(found.families) == len(found.explanation.linear.blocks)
    for combination in found.explanation.combinations:
        names = [found.families[b] for b in combination.blocks]
        assert len(names) == len(set(names))


def test_where_it_starts_does_not_matter(bic_gain):
    campaign, found, _ = bic_gain
    start = observe(campaign, register(campaign))
    begin = [choose((name,), (), ())[0].variants(start)[0] for name in ("joint_offset", "drift")]
    for told in ({"starts": [begin]}, {"held": found.held, "before": found.explanation}):
        again, _ = settled(campaign, **told)
        assert [e for e, _ in again.held] == [e for e, _ in found.held]
        np.testing.assert_allclose(again.held[0][1], found.held[0][1], rtol=0, atol=1e-6)


def test_what_was_picked_out_of_many_must_explain_more(rv_m2):
    """The natural logarithm of 1e200 is 460: more than a gap of two to three times the noise can bring."""
    campaign = simulate(rv_m2, ["joint_gain"], seed=2, ratio=(2.0, 3.0))[0]
    assert names_of(settled(campaign)[0]) == ("joint_gain",)
    assert "joint_gain" not in names_of(settled(campaign, ("joint_offset", "drift"), (Rare(),))[0])


def test_a_constant_is_moved_off_the_grid_to_where_it_is(rv_m2):
    found, _ = settled(lagging("rv_m2", 1, LAG, 1300.0, 30.0), (LAG,))
    assert found.held[0][0].lag == pytest.approx(1300.0, rel=0.05)
    own = found.explanation.linear.blocks[found.explanation.best.blocks[0]].effect
    assert own == found.held[0][0]


def test_nothing_is_held_in_noise(rv_m2):
    found, _ = settled(simulate(rv_m2, seed=6)[0])
    assert found.held == ()


@pytest.fixture(scope="module")
def nominal(rv_m2):
    campaign = simulate(rv_m2, seed=6)[0]
    return observe(campaign, register(campaign))


def rivals(chosen, nominal):
    known = gate.variants(replace(chosen, places=()), nominal)
    return list(_alternatives(chosen, nominal, (*known, *gate.alone(known[0], nominal))))


def test_rivals_of_a_setting_have_one_joint_less_one_more_or_another(nominal):
    """Of all joints each alone; of a law all that were compared with it; an effect of no joint has itself alone."""
    joints = nominal.robot.joint_names
    gain, scale = (choose((name,), (), ())[0] for name in ("joint_gain", "instrument_scale"))
    alone = {frozenset({j}) for j in joints}

    def places(*own):
        return {frozenset(setting.places) for setting in rivals(replace(gain, places=own), nominal)}

    assert places() == {frozenset(), *alone}
    assert places("joint_2") == {frozenset(), *alone, *(frozenset({"joint_2", j}) for j in joints)}
    pair = {"joint_2", "joint_4"}
    found = places(*sorted(pair))
    assert {len(own) for own in found} == {0, 1, 2, 3}
    assert {frozenset({j}) for j in pair} <= found
    another = {frozenset({kept, j}) for kept in pair for j in set(joints) - pair}
    assert {own for own in found if len(own) == 2} == {frozenset(pair), *another}
    assert {own for own in found if len(own) == 3} == {frozenset({*pair, j}) for j in set(joints) - pair}
    laws = [Discovered(place=f"joint_{k}", quantity="time", tried=50.0) for k in (1, 2, 3)]
    assert list(_alternatives(laws[1], nominal, laws)) == laws
    assert set(rivals(scale, nominal)) == {scale}


def test_an_effect_in_all_joints_is_tried_in_those_that_do_most(nominal):
    joints = nominal.robot.joint_names
    (offset,) = choose(("joint_offset",), (), ())
    values = 1e-4 * np.array([0.0, 5.0, 0.1, 4.0, 0.0])
    found = [e.places for e in _leading(offset, block(nominal, offset), values)]
    assert [len(own) for own in found] == [2, 3, 4]
    assert found[0] == (joints[1], joints[3])
    assert all(set(a) < set(b) for a, b in pairwise(found))
    assert list(_leading(replace(offset, places=("joint_2",)), block(nominal, offset), values)) == []


def explained(data, names):
    """The observations, and the explanation by these effects in one setting each."""
    seen = observe(data, register(data))
    variants = [effect.variants(seen) for effect in choose(names, (), ())]
    settings = [own[-1] for own in variants]
    linear = Linear(seen.gap, frame_columns(seen)[0], tuple(block(seen, s) for s in settings))
    return seen, explain(linear, Noise(data.noise_position), starts=[tuple(range(len(settings)))])


def evidence(explanation, seen, effect):
    """Log evidence of one effect alone, rows set aside heard."""
    linear = Linear(explanation.linear.gap, explanation.linear.frames, (block(seen, effect),))
    return Search(gram(linear, downweighted(explanation)), [0.0]).evaluate((0,)).log_evidence


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "constant", "attribute"), [(LAG, 900.0, "lag"), (DRIFT, 0.15, "time_constant")])
@pytest.mark.parametrize("ratio", [30.0, 3.0])
def test_no_constant_of_a_fine_grid_is_much_better(kind, constant, attribute, ratio):
    for seed in range(2):
        seen, explanation = explained(lagging("panda", seed, kind, constant, ratio), (kind,))
        ((effect, values),) = refined(explanation, seen, 1.6)
        own, found = evidence(explanation, seen, effect), getattr(effect, attribute)
        assert len(values) == len(explanation.linear.blocks[0].sizes)
        grid = found * np.exp(np.linspace(-1.0, 1.0, 161))
        settings = [type(effect)(**{**effect.arguments(), attribute: float(c)}) for c in grid]
        # where an elongation that would be negative drops out, the evidence has a step of several tenths
        assert max(evidence(explanation, seen, s) for s in settings) < own + 0.4


def test_constants_of_several_effects_are_moved_together(rv_m2):
    """Values belong to the constants that were found: the remainder they leave is smaller than before."""
    drifting, grown = (lagging("rv_m2", 2, *own, 20.0) for own in ((DRIFT, 0.2), (LAG, 900.0)))
    # both start from the same robot in the same place: to first order what they do adds up
    still = observe(drifting, Frames.declared(drifting)).predicted_position
    data = replace(drifting, position=drifting.position + grown.position - still)
    seen, explanation = explained(data, (DRIFT, LAG))
    after = refined(explanation, seen, 1.6)
    assert len(after) == len(explanation.best.blocks)

    def left(pairs):
        gap = explanation.linear.gap - sum(block(seen, e).columns @ v for e, v in pairs)
        flat = explanation.linear.frames.reshape(gap.size, -1)
        return np.linalg.norm(gap.ravel() - flat @ np.linalg.lstsq(flat, gap.ravel(), rcond=None)[0])

    before = [(explanation.linear.blocks[b].effect, explanation.values[b][0]) for b in explanation.best.blocks]
    assert left(after) < 0.7 * left(before)


@pytest.mark.slow
@pytest.mark.parametrize("other", ["instrument_scale", "drift"])
def test_what_only_pays_for_a_constant_that_is_off_is_left_out(other):
    """At 3600 s instead of 2200 s both are needed; once the constant has moved, one is enough."""
    needed = 0
    for seed in range(3):
        data = lagging("panda", seed, LAG, 2200.0, 20.0)
        needed += len(explained(data, (LAG, other))[1].best.blocks) == 2
        ((effect, _),) = fit(data, choose((LAG, other), (), ())).effects
        assert effect.name == LAG
        assert effect.lag == pytest.approx(2200.0, rel=0.1)
    assert needed >= 2


@pytest.mark.parametrize("other", [LAG, "joint_offset"])
def test_an_effect_without_a_constant_stays_as_it_was_beside_others(rv_m2, other):
    names = ("joint_gain", other)
    seen, explanation = explained(simulate(rv_m2, names, seed=3, ratio=(5.0, 6.0))[0], names)
    kept = refined(explanation, seen, 1.6)
    assert {effect.name for effect, _ in kept} == set(names)
    if other != LAG:  # nor do values move where no constant does
        for b, (effect, values) in zip(explanation.best.blocks, kept, strict=True):
            assert effect is explanation.linear.blocks[b].effect
            np.testing.assert_array_equal(values, explanation.values[b][0])


def test_a_share_of_friction_is_moved_no_closer_than_the_data_tell(rv_m2, monkeypatch):
    # a joint whose share differs from the others' has a price, however little it differs: that says nothing of the step
    chance, rows = np.random.default_rng(4), 80
    plain = simulate(rv_m2, samples=rows, seed=4)[0]
    approach = {f"approach.{j}": chance.choice([-1.0, 1.0], rows) for j in rv_m2.joint_names}
    seen = observe(thermal_robot.simulate(rv_m2, commands=plain.q, conditions=approach))
    true = next(e for e in Backlash().variants(seen) if e.held)
    parameters = len(true.parameters(seen))
    told = dict(conditions=approach, noise=2e-5, tool=(0.05, 0.02, 0.1), seed=4)
    data = thermal_robot.simulate(rv_m2, [(true, np.full(parameters, 2e-3))], commands=plain.q, **told)
    asked, nearby = [], Backlash.nearby
    monkeypatch.setattr(Backlash, "nearby", lambda self, factor: asked.append(factor) or nearby(self, factor))
    seen = observe(data, register(data))
    linear = Linear(seen.gap, frame_columns(seen)[0], (block(seen, true),))
    explanation = explain(linear, Noise(data.noise_position), starts=[(0,)])
    ((found, _),) = refined(explanation, seen, 1.6)
    assert found.apart == 0
    assert min(factor for factor in asked if factor > 1.0) > 1.001


SETTLED = 1e-4  # standard deviations


def of_all(campaign, effects):
    """Frames fitted to the nominal robot, and the explanation by all of some effects, linearised there."""
    seen = observe(campaign, register(campaign))
    linear = Linear(seen.gap, frame_columns(seen)[0], tuple(block(seen, e) for e in effects))
    explanation = explain(replace(linear, blocks=()), Noise(campaign.noise_position))
    problem = gram(linear, explanation.whitening)
    best = Search(problem, [0.0] * len(effects)).evaluate(range(len(effects)))
    values = parameter_values(linear, problem, best)
    return seen, replace(explanation, linear=linear, problem=problem, best=best, values=values)


def objective(campaign, explanation, frames, pairs):
    """Half of the squared remainder, weighted, in noise, and of the values in their prior sizes."""
    whitening, best = explanation.whitening, explanation.best
    gap = corrected_observations(campaign, frames, pairs).gap / (whitening.noise * best.noise)
    sizes = [explanation.linear.blocks[b].sizes * best.scales[b] for b in best.blocks]
    penalty = sum(((v / s) ** 2).sum() for (_, v), s in zip(pairs, sizes, strict=True))
    return 0.5 * float((whitening.weights[:, None] * gap**2).sum() + penalty)


@pytest.fixture(scope="module")
def fitted(rv_m2):
    """Offsets and gains of ten millimetres at the target: far from linear beside 25 µm."""
    campaign = simulate(rv_m2, ["joint_offset", "joint_gain"], seed=2, ratio=(300.0, 400.0))[0]
    effects = choose(("joint_offset", "joint_gain"), (), ())
    seen, explanation = of_all(campaign, effects)
    held = [(effects[b], explanation.values[b][0]) for b in explanation.best.blocks]
    return campaign, explanation, held, seen, gauss_newton(campaign, seen.frames, explanation, held, SETTLED)


def assert_least(campaign, explanation, observations, held, step):
    """No step of a value or a frame lowers the objective: the middle of its parabola is here."""
    least = objective(campaign, explanation, observations.frames, held)
    for k, (effect, values) in enumerate(held):
        for axis in np.eye(len(values)):
            near = [[*held[:k], (effect, values + s * step * axis), *held[k + 1 :]] for s in (1.0, -1.0)]
            ahead, behind = (objective(campaign, explanation, observations.frames, pairs) for pairs in near)
            # to within a hundredth of the parabola's own width
            bend = ahead + behind - 2.0 * least
            assert abs(ahead - behind) / (2.0 * np.sqrt(bend)) < 0.01
    names = frame_columns(observations)[1]
    for axis in np.eye(len(names)):
        near = [moved(observations.frames, s * 1e-5 * axis, names) for s in (1.0, -1.0)]
        assert min(objective(campaign, explanation, frames, held) for frames in near) > least


def test_no_neighbour_of_the_fit_has_a_smaller_misfit_and_another_fit_moves_nothing(fitted):
    campaign, explanation, before, seen, (observations, held) = fitted
    assert_least(campaign, explanation, observations, held, 1e-6)
    again, values = gauss_newton(campaign, observations.frames, explanation, held, SETTLED)
    assert np.abs(again.gap - observations.gap).max() < 1e-3 * NOISE
    for (_, now), (_, then) in zip(values, held, strict=True):
        np.testing.assert_allclose(now, then, rtol=0, atol=1e-8)
    # it leaves the noise where the linear one did not
    linear = corrected_observations(campaign, seen.frames, before).gap
    assert np.sqrt((linear**2).mean()) > 5.0 * NOISE
    used = explanation.whitening.weights > 0
    assert np.sqrt((observations.gap[used] ** 2).mean()) < 1.2 * NOISE


def test_a_firm_prior_is_balanced_against_the_data(rv_m2):
    """Offsets that are believed to be ten microradians, and are a hundred."""
    campaign = simulate(rv_m2, ["joint_offset"], seed=6)[0]
    seen, explanation = of_all(campaign, choose(("joint_offset",), (), ()))
    size = explanation.linear.blocks[0].sizes[0]
    held = [(explanation.linear.blocks[0].effect, explanation.values[0][0])]
    firm = replace(explanation, best=replace(explanation.best, scales={0: 1e-5 / size}))
    free, tight = (gauss_newton(campaign, seen.frames, e, held, SETTLED) for e in (explanation, firm))
    assert_least(campaign, firm, *tight, 1e-6)
    assert 0.0 < np.linalg.norm(tight[1][0][1]) < 0.9 * np.linalg.norm(free[1][0][1])


def test_rows_without_weight_do_not_matter(fitted):
    campaign, explanation, before, seen, _ = fitted
    off = np.arange(campaign.samples) % 6 == 0
    weights = np.where(off, 0.0, explanation.whitening.weights)
    light = replace(explanation, whitening=replace(explanation.whitening, weights=weights))
    spoilt = replace(campaign, position=campaign.position + np.where(off[:, None], 0.1, 0.0))
    (_, plain), (_, other) = (gauss_newton(c, seen.frames, light, before, SETTLED) for c in (campaign, spoilt))
    for (_, now), (_, then) in zip(other, plain, strict=True):
        np.testing.assert_array_equal(now, then)


def test_frames_alone_are_fitted_where_nothing_is_explained(rv_m2):
    campaign = simulate(rv_m2, seed=3)[0]
    seen, explanation = of_all(campaign, ())
    observations, held = gauss_newton(campaign, seen.frames, explanation, (), SETTLED)
    assert held == []
    assert np.sqrt((observations.gap**2).mean()) == pytest.approx(NOISE, rel=0.1)


def test_what_only_the_frames_see_stays_at_zero(rv_m2):
    """An offset of the first joint and a turn of the base do the same: the prior leaves it to the base."""
    campaign = simulate(rv_m2, ["joint_gain"], seed=4)[0]
    effects = [*choose(("joint_gain",), (), ()), FirstJoint()]
    seen, explanation = of_all(campaign, effects)
    held = [(effects[0], np.zeros(rv_m2.n)), (effects[1], np.zeros(1))]
    observations, found = gauss_newton(campaign, seen.frames, explanation, held, SETTLED)
    assert abs(found[1][1][0]) < 1e-9
    assert np.sqrt((observations.gap**2).mean()) < 1.2 * NOISE


def test_without_effects_the_corrected_model_is_the_nominal_one(rv_m2):
    campaign = simulate(rv_m2, seed=5, samples=20)[0]
    frames = register(campaign)
    effects = choose(("joint_offset", "instrument_scale"), (), ())
    plain = observe(campaign, frames)
    sizes = [len(block(plain, e).sizes) for e in effects]
    for pairs in ([], [(e, np.zeros(k)) for e, k in zip(effects, sizes, strict=True)]):
        np.testing.assert_allclose(corrected_observations(campaign, frames, pairs).gap, plain.gap, rtol=0, atol=1e-15)
    # a small effect takes its columns away from the gap
    values = [1e-7 * np.ones(k) for k in sizes]
    taken = sum(block(plain, e).columns @ v for e, v in zip(effects, values, strict=True))
    gap = corrected_observations(campaign, frames, list(zip(effects, values, strict=True))).gap
    np.testing.assert_allclose(plain.gap - gap, taken, rtol=0, atol=1e-5 * np.abs(taken).max())


def test_a_linear_fit_that_went_astray_does_not_end_worse_than_it_began(fitted):
    """Sizes of which the sum of two is right and each is turns away, as of effects that cancel each other."""
    campaign, explanation, held, seen, (_, right) = fitted
    astray = [(effect, values + 40.0) for effect, values in held]
    lost, far = gauss_newton(campaign, seen.frames, explanation, astray, SETTLED)
    begun = objective(campaign, explanation, seen.frames, [(e, np.zeros(len(v))) for e, v in held])
    assert objective(campaign, explanation, lost.frames, far) > begun
    kept, found = gauss_newton(campaign, seen.frames, explanation, astray, SETTLED, ())
    assert objective(campaign, explanation, kept.frames, found) < begun
    for (_, one), (_, other) in zip(found, right, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)
