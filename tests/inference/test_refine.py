"""Constants end where the evidence does: no setting of a fine grid is better by more than is asked for."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate
from time_constants import DRIFT, LAG, campaign

import thermal_robot
from thermal_robot.effects import choose
from thermal_robot.effects.backlash import Backlash
from thermal_robot.inference.columns import block, frame_columns
from thermal_robot.inference.exact import heard, refined
from thermal_robot.inference.explain import Noise, explain
from thermal_robot.inference.fit import fit
from thermal_robot.inference.problem import Linear, gram
from thermal_robot.inference.registration import register
from thermal_robot.inference.search import Search
from thermal_robot.observations import Frames, observe


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
    return Search(gram(linear, heard(explanation)), [0.0]).evaluate((0,)).log_evidence


@pytest.mark.parametrize(("kind", "constant", "attribute"), [(LAG, 900.0, "lag"), (DRIFT, 0.15, "time_constant")])
@pytest.mark.parametrize("ratio", [3.0, 30.0])
def test_no_constant_of_a_fine_grid_is_much_better(kind, constant, attribute, ratio):
    for seed in range(3):
        seen, explanation = explained(campaign("panda", seed, kind, constant, ratio), (kind,))
        ((effect, values),) = refined(explanation, seen, 1.6)
        own, found = evidence(explanation, seen, effect), getattr(effect, attribute)
        assert len(values) == len(explanation.linear.blocks[0].sizes)
        grid = found * np.exp(np.linspace(-1.0, 1.0, 401))
        settings = [type(effect)(**{**effect.arguments(), attribute: float(c)}) for c in grid]
        # where an elongation that would be negative drops out, the evidence has a step of several tenths
        assert max(evidence(explanation, seen, s) for s in settings) < own + 0.4


def test_effects_without_a_constant_stay_as_they_were(rv_m2):
    data = simulate(rv_m2, ["joint_offset", "joint_gain"], seed=3)[0]
    seen, explanation = explained(data, ("joint_offset", "joint_gain"))
    for b, (effect, values) in zip(explanation.best.blocks, refined(explanation, seen, 1.6), strict=True):
        assert effect is explanation.linear.blocks[b].effect
        np.testing.assert_array_equal(values, explanation.values[b][0])


def test_constants_of_several_effects_are_moved_together(rv_m2):
    """Values belong to the constants that were found: the remainder they leave is smaller than before."""
    drifting, lagging = (campaign("rv_m2", 2, *own, 20.0) for own in ((DRIFT, 0.2), (LAG, 900.0)))
    # both start from the same robot in the same place: to first order what they do adds up
    still = observe(drifting, Frames.declared(drifting)).predicted_position
    data = replace(drifting, position=drifting.position + lagging.position - still)
    seen, explanation = explained(data, (DRIFT, LAG))
    after = refined(explanation, seen, 1.6)
    assert len(after) == len(explanation.best.blocks)

    def left(pairs):
        gap = explanation.linear.gap - sum(block(seen, e).columns @ v for e, v in pairs)
        flat = explanation.linear.frames.reshape(gap.size, -1)
        return np.linalg.norm(gap.ravel() - flat @ np.linalg.lstsq(flat, gap.ravel(), rcond=None)[0])

    before = [(explanation.linear.blocks[b].effect, explanation.values[b][0]) for b in explanation.best.blocks]
    assert left(after) < 0.7 * left(before)


@pytest.mark.parametrize("other", ["instrument_scale", "drift"])
def test_what_only_pays_for_a_constant_that_is_off_is_left_out(other):
    """At 3600 s instead of 2200 s both are needed; once the constant has moved, one is enough."""
    needed = 0
    for seed in range(3):
        data = campaign("panda", seed, LAG, 2200.0, 20.0)
        needed += len(explained(data, (LAG, other))[1].best.blocks) == 2
        ((effect, _),) = fit(data, choose((LAG, other), (), ())).effects
        assert effect.name == LAG
        assert effect.lag == pytest.approx(2200.0, rel=0.1)
    assert needed >= 2


def test_an_effect_at_work_stays_beside_a_constant(rv_m2):
    data = simulate(rv_m2, ["joint_gain", LAG], seed=3, ratio=(5.0, 6.0))[0]
    seen, explanation = explained(data, ("joint_gain", LAG))
    assert [e.name for e, _ in refined(explanation, seen, 1.6)] == ["joint_gain", LAG]


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
