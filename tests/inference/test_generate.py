"""A cause that nobody listed is found beside the known effects, and none where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import NOISE, with_law
from simulate import simulate

from thermal_robot.diagnosis.prune import grown
from thermal_robot.effects import choose
from thermal_robot.effects.law import Discovered
from thermal_robot.inference import settings
from thermal_robot.inference.fit import fit, refit
from thermal_robot.inference.generate import candidates, discovered, events, listed, where
from thermal_robot.inference.screening import Thin

LISTED = ("joint_offset", "joint_gain", "backlash")
STEP = Discovered(place="joint_3", quantity="time", shape="step", marks=(3600.0,))
BEND = Discovered(place="joint_2", quantity="joint_2", shape="hinge", marks=(0.3, 1.0))


def known(campaign, effects=LISTED):
    return fit(campaign, choose(effects, (), ()))


def lawful(own, number=1):
    """The fit with a law among its effects, where one is worth its place; else the fit itself."""
    return grown(own, number, lambda _: None) or own


@pytest.fixture(scope="module")
def stepped(rv_m2):
    """An elbow that jumps after an hour."""
    return known(with_law(rv_m2, STEP, [0.0, 5e-4], seed=3)[0])


@pytest.fixture(scope="module")
def offered(stepped):
    return candidates(stepped, 2, events(stepped))


@pytest.fixture(scope="module")
def found(stepped):
    return lawful(stepped)


def test_the_true_law_is_the_first_that_is_offered(offered):
    assert 1 < len(offered) <= settings.COMPARED_LAWS
    assert len(set(offered)) == len(offered)
    assert {law.name for law in offered} == {"discovered.2"}
    assert (offered[0].kind, offered[0].place, offered[0].quantity) == ("joint", "joint_3", "time")
    assert offered[0].shape in ("step", "slide")


def test_a_law_pays_for_all_places_quantities_and_shapes_among_which_it_was_picked(stepped, offered):
    """At each of five joints, base, tool: every quantity, and of each shapes; and segments besides."""
    robot = stepped.campaign.robot
    for law in offered:
        # a mark in time has its share of the range, all others are counted
        assert law.shape == "step" or law.tried == round(law.tried)
        assert law.tried > (robot.n + 2) * 15
        assert law.share == pytest.approx(1.0 / law.tried)


def test_in_which_order_laws_are_offered_does_not_matter(stepped, offered):
    for laws in (offered, offered[::-1]):
        ((law, _),) = refit(stepped, {"discovered.2": laws}, [[law] for law in laws]).effects
        assert (law.place, law.quantity) == ("joint_3", "time")


def test_place_and_quantity_have_probabilities(found):
    (law,) = discovered(found)
    assert law.law.name == "discovered.1"
    assert (law.law.place, law.law.quantity) == ("joint_3", "time")
    assert law.probability > 0.9
    for pairs, first in ((law.places, ("joint", "joint_3")), (law.quantities, "time")):
        chances = [p for _, p in pairs]
        assert pairs[0][0] == first
        assert chances == sorted(chances, reverse=True)
        assert chances[0] >= law.probability - 1e-9
        assert sum(chances) <= 1.0 + 1e-9  # one law at a time


def test_a_fit_without_laws_has_discovered_none(stepped):
    assert discovered(stepped) == ()


@pytest.mark.parametrize(
    ("law", "values"), [(STEP, [0.0, 6e-4]), (BEND, [0.0, 4e-3])], ids=["a step in time", "a bend of a joint"]
)
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_an_injected_law_is_found_with_place_and_quantity(rv_m2, law, values, seed):
    own = lawful(known(with_law(rv_m2, law, values, seed=seed)[0]))
    (named,) = discovered(own)
    assert (named.law.place, named.law.quantity) == (law.place, law.quantity)
    assert [effect.name for effect, _ in own.effects] == ["discovered.1"]


def test_a_law_of_the_base_is_placed_there(rv_m2):
    """A tracker that is warmed: the base moves with the temperature."""
    shape = Discovered(kind="base", place="base", quantity="temperature", shape="step", marks=(22.0,))
    values = np.zeros(12)
    values[[1, 3]] = 1.5e-4
    own = lawful(known(with_law(rv_m2, shape, values, seed=2)[0]))
    (named,) = discovered(own)
    assert (named.law.kind, named.law.quantity) == ("base", "temperature")


@pytest.mark.slow
def test_noise_makes_no_law(rv_m2):
    """Of thirty campaigns of noise none has a law that is worth its place."""
    worth = []
    for seed in range(30):
        own = known(simulate(rv_m2, samples=80, seed=seed, noise=NOISE)[0], ("joint_offset",))
        wider = grown(own, 1, lambda _: None)
        if wider is not None:
            worth.append((seed, [e.name for e, _ in wider.effects]))
    assert worth == []


def test_repeats_of_few_poses_make_no_law_of_what_a_pose_brings(rv_m2):
    """Threefold visits to poses that each have an error of their own: rows of one pose count once."""
    worth = []
    for seed in range(8):
        plain = simulate(rv_m2, samples=40, seed=seed, noise=NOISE)[0].take(np.repeat(np.arange(40), 3))
        rng = np.random.default_rng(seed)
        shared = np.repeat(2.0 * NOISE * rng.normal(size=(40, 3)), 3, axis=0)
        single = plain.position + shared + NOISE * rng.normal(size=(120, 3))
        own = known(replace(plain, position=single, rows=np.arange(2, 122)), ("joint_offset",))
        wider = grown(own, 1, lambda _: None)
        if wider is not None:
            worth.append((seed, [(e.name, getattr(e, "quantity", "")) for e, _ in wider.effects]))
    assert worth == []


def test_what_a_known_effect_and_a_zero_do_is_no_law(rv_m2):
    """Two levels by the direction of approach are lost motion and a zero; without one of the two they are a law."""
    campaign, _, _ = simulate(rv_m2, ["backlash"], seed=4, noise=NOISE)
    levels = Discovered(
        place="joint_3", quantity="approach.joint_3", shape="levels", marks=(-1.0, 1.0), origin=-1.0, span=2.0
    )
    thin = Thin.of(known(campaign))
    assert listed(thin, levels)
    assert not listed(thin, replace(levels, place="joint_2"))
    assert not listed(thin, replace(STEP, span=3600.0))
    for fewer in (("joint_offset", "joint_gain"), ("joint_gain", "backlash")):
        assert not listed(Thin.of(known(campaign, fewer)), levels)


@pytest.mark.parametrize("seed", [1, 3])
def test_a_known_effect_that_is_at_work_in_several_joints_leaves_nothing_to_find(rv_m2, seed):
    campaign, truth, _ = simulate(rv_m2, ["backlash"], seed=seed, noise=NOISE)
    assert len(truth["parts"]["backlash"]["values"]) > 1
    own = known(campaign)
    assert [effect.name for effect, _ in own.effects] == ["backlash"]
    assert grown(own, 1, lambda _: None) is None


def test_an_effect_of_one_joint_is_that_effect_in_that_joint_and_no_law(rv_m2):
    campaign, truth, _ = simulate(rv_m2, ["backlash"], seed=4, noise=NOISE)
    assert list(truth["parts"]["backlash"]["values"]) == ["lost motion, joint_5"]
    own = known(campaign)
    ((effect, _),) = own.effects
    assert (effect.name, effect.places) == ("backlash", ("joint_5",))
    assert grown(own, 1, lambda _: None) is None


@pytest.mark.parametrize("seed", [1, 3])
def test_effects_that_had_taken_the_cause_upon_themselves_go_again(rv_m2, seed):
    """A joint that errs on one side of a place alone looks like a zero and a gain."""
    own = known(with_law(rv_m2, BEND, [0.0, 4e-3], seed=seed)[0])
    assert own.effects
    assert not any(isinstance(effect, Discovered) for effect, _ in own.effects)
    again = lawful(own)
    ((law, _),) = again.effects
    assert (law.place, law.quantity) == ("joint_2", "joint_2")


def test_a_law_does_better_than_an_effect_that_stands_in_for_it(rv_m2):
    feigned = known(with_law(rv_m2, BEND, [0.0, 4e-3], seed=1)[0], ("joint_gain",))
    assert [effect.name for effect, _ in feigned.effects] == ["joint_gain"]
    ((law, _),) = lawful(feigned).effects
    assert (law.place, law.quantity) == ("joint_2", "joint_2")


def test_a_law_of_a_segment_is_placed_at_the_link_that_carries_it(stepped):
    robot = stepped.campaign.robot
    assert where(stepped, STEP) == ("joint", "joint_3")
    assert where(stepped, Discovered(kind="base", place="base")) == ("base", "base")
    for segment in robot.segments[1:]:
        if segment.movable:
            assert where(stepped, Discovered(kind="link", place=segment.name)) == ("link", segment.parent_link)
