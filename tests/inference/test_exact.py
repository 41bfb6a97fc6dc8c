"""A choice is made again at its own exact fit until it stays."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from simulate import simulate
from time_constants import LAG
from time_constants import campaign as lagging

from thermal_robot.effects import choose, gate
from thermal_robot.effects.joint_gain import JointGain
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.columns import block
from thermal_robot.inference.exact import _leading, _others, corrected_observations, settle
from thermal_robot.inference.registration import register
from thermal_robot.observations import observe

NOISE = 25e-6  # m
NAMES = ("joint_offset", "joint_gain", "geometric", "drift")


class Rare(JointGain):
    """A gain that was picked out of very many."""

    share = 1e-200


def settled(campaign, names=NAMES, effects=(), **told):
    """The explanation at its exact fit, and what was said meanwhile."""
    start, said = observe(campaign, register(campaign)), []
    variants = {e.name: e.variants(start) for e in (*choose(names, (), ()), *effects)}
    return settle(start, variants, said.append, **told), said


def names_of(found):
    return tuple(effect.name for effect, _ in found.held)


@pytest.fixture(scope="module")
def gained(rv_m2):
    campaign = simulate(rv_m2, ["joint_gain"], seed=2, ratio=(20.0, 30.0))[0]
    return campaign, *settled(campaign)


def test_what_is_at_work_is_held_and_the_exact_model_leaves_the_noise(gained):
    campaign, found, _ = gained
    assert names_of(found) == ("joint_gain",)
    left = found.explanation.whitening.noise[0] * found.explanation.best.noise
    assert left == pytest.approx(NOISE, rel=0.15)
    exact = corrected_observations(campaign, found.observations.frames, found.held)
    np.testing.assert_allclose(found.observations.gap, exact.gap, rtol=0, atol=1e-12)
    # the explanation is linearised there: its remainder is the exact one's
    used = found.explanation.whitening.weights > 0
    assert np.abs(found.explanation.remainder - exact.gap)[used].max() < 0.1 * NOISE


def test_it_says_what_it_does(gained):
    said = gained[2]
    assert said[0] == "combinations of effects"
    assert said[1:] == [f"exact fit, revision {k}" for k in range(1, len(said))]
    assert 2 <= len(said) <= 4


def test_where_it_starts_does_not_matter(gained):
    campaign, found, _ = gained
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


def test_one_setting_is_never_beside_another_of_its_name(gained):
    _, found, _ = gained
    explanation = found.explanation
    assert len(found.families) == len(explanation.linear.blocks)
    for combination in explanation.combinations:
        names = [found.families[b] for b in combination.blocks]
        assert len(names) == len(set(names))


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
    return list(_others(chosen, nominal, (*known, *gate.alone(known[0], nominal))))


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
    assert list(_others(laws[1], nominal, laws)) == laws
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


def test_places_stay_with_the_settings_that_have_them(nominal):
    """Elongations of one link each are named by links, those common to all by joints besides."""
    (warm,) = choose(("thermal_elongation",), (), ())
    known = gate.variants(warm, nominal)
    for setting in (alone for whole in known for alone in gate.alone(whole, nominal)):
        for other in _others(setting, nominal, known):
            assert set(other.places) <= set(gate.places_of(gate.checked(replace(other, places=()), nominal)))
            gate.checked(other, nominal)
