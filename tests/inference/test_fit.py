"""A fit ends where its choice stays and its constants are the likeliest, not at a point of a grid."""

import numpy as np
import pytest
from simulate import simulate
from time_constants import DRIFT, LAG, NOISE, campaign

from thermal_robot import diagnose
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit


def constant_of(effects, kind):
    """The time constant of the effect of that name."""
    (effect,) = [e for e, *_ in effects if e.name == kind]
    return effect.lag if kind == LAG else effect.time_constant


@pytest.mark.parametrize(("kind", "constant"), [(LAG, 1759.0), (LAG, 420.0), (DRIFT, 0.067), (DRIFT, 0.195)])
def test_a_large_effect_leaves_nothing_to_others_whatever_its_constant(kind, constant):
    data = campaign("panda", 0, kind, constant, 35.0)
    known = fit(data, choose((), ()))
    assert [effect.name for effect, _ in known.effects] == [kind]
    assert constant_of(known.effects, kind) == pytest.approx(constant, rel=0.03)
    assert known.explanation.best.noise * known.explanation.whitening.noise[0] == pytest.approx(NOISE, rel=0.15)


def test_what_was_chosen_is_what_was_fitted():
    """The explanation's blocks are the effects that are held, constants and all."""
    known = fit(campaign("rv_m2", 1, DRIFT, 0.4, 20.0), choose((), ()))
    blocks = [known.explanation.linear.blocks[b] for b in known.explanation.best.blocks]
    assert [b.effect for b in blocks] == [effect for effect, _ in known.effects]


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


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "shortest", "longest"), [(LAG, 400.0, 4500.0), (DRIFT, 0.06, 1.2)])
def test_large_effects_are_the_verdict_at_constants_drawn_at_random(kind, shortest, longest):
    named = []
    for seed in range(16):
        rng = np.random.default_rng([seed, 8])
        constant = float(np.exp(rng.uniform(np.log(shortest), np.log(longest))))
        arm = ["rv_m2", "ur10", "panda", "ur5"][seed % 4]
        named.append(diagnose(campaign(arm, seed, kind, constant, rng.uniform(10.0, 40.0))).verdict)
    assert named.count((kind,)) >= 15, named
