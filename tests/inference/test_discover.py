"""A cause that nobody listed is found beside the known effects, and none where there is none."""

import numpy as np
import pytest
from helpers import NOISE, with_law
from simulate import simulate

from thermal_robot.effects import choose
from thermal_robot.effects.law import Discovered
from thermal_robot.inference.discover import discover, instead, where
from thermal_robot.inference.fit import fit

LISTED = ("joint_offset", "joint_gain", "backlash")
STEP = Discovered(place="joint_3", quantity="time", shape="step", marks=(3600.0,))
BEND = Discovered(place="joint_2", quantity="joint_2", shape="hinge", marks=(0.3, 1.0))


def known(campaign, effects=LISTED):
    return fit(campaign, choose(effects, (), ()))


@pytest.fixture(scope="module")
def stepped(rv_m2):
    """An elbow that jumps after an hour."""
    return known(with_law(rv_m2, STEP, [0.0, 5e-4], seed=3)[0])


@pytest.fixture(scope="module")
def found(stepped):
    return discover(stepped, 2)


def test_place_and_quantity_are_found(found):
    assert found.law.name == "discovered.2"
    assert (found.law.kind, found.law.place, found.law.quantity) == ("joint", "joint_3", "time")
    assert found.law.shape in ("step", "slide")
    assert found.gain > 20.0


def test_places_and_quantities_have_probabilities(found):
    for pairs, first in ((found.places, ("joint", "joint_3")), (found.quantities, "time")):
        chances = [p for _, p in pairs]
        assert pairs[0][0] == first
        assert chances == sorted(chances, reverse=True)
        assert chances[0] > 0.9
        assert sum(chances) <= 1.0 + 1e-9  # one law at a time


def test_being_picked_out_of_many_costs_the_logarithm_of_their_number(stepped, found):
    """At each of five joints, base, tool: every quantity, three waves of each joint; and segments besides."""
    robot = stepped.campaign.robot
    assert np.exp(-found.rarity) > (robot.n + 2) * 15
    assert np.exp(-found.rarity) == pytest.approx(round(np.exp(-found.rarity)), abs=1e-6)


def test_in_noise_nothing_is_discovered(rv_m2):
    for seed in range(4):
        assert discover(known(simulate(rv_m2, seed=seed, noise=NOISE)[0]), 1) is None


@pytest.mark.parametrize("seed", [1, 3])
def test_a_known_effect_that_is_at_work_in_several_joints_leaves_nothing_to_find(rv_m2, seed):
    campaign, truth, _ = simulate(rv_m2, ["backlash"], seed=seed, noise=NOISE)
    assert len(truth["parts"]["backlash"]["values"]) > 1
    own = known(campaign)
    assert [effect.name for effect, _ in own.effects] == ["backlash"]
    assert discover(own, 1) is None
    assert instead(own, "backlash")[1] < -50.0


def test_an_effect_of_one_joint_is_no_more_than_a_law_of_that_joint(rv_m2):
    """An effect has a number for every joint; where one joint alone is at fault, a law says the same with fewer."""
    campaign, truth, _ = simulate(rv_m2, ["backlash"], seed=4, noise=NOISE)
    assert list(truth["parts"]["backlash"]["values"]) == ["lost motion, joint_5"]
    better, gain = instead(known(campaign), "backlash")
    assert (better.place, better.quantity) == ("joint_5", "approach.joint_5")
    assert 0.0 < gain < 25.0


@pytest.mark.parametrize("seed", [1, 3])
def test_effects_that_had_taken_the_cause_upon_themselves_go_again(rv_m2, seed):
    """A joint that errs on one side of a place alone looks like a zero and a gain."""
    own = known(with_law(rv_m2, BEND, [0.0, 4e-3], seed=seed)[0])
    assert {effect.name for effect, _ in own.effects} == {"joint_offset", "joint_gain"}
    again = discover(own, 1)
    assert (again.law.place, again.law.quantity) == ("joint_2", "joint_2")
    assert again.beside == ()
    assert again.gain > 50.0


def test_a_law_does_better_than_an_effect_that_stands_in_for_it(rv_m2):
    feigned = known(with_law(rv_m2, BEND, [0.0, 4e-3], seed=1)[0], ("joint_gain",))
    assert [effect.name for effect, _ in feigned.effects] == ["joint_gain"]
    better, gain = instead(feigned, "joint_gain")
    assert (better.place, better.quantity) == ("joint_2", "joint_2")
    assert gain > 100.0


def test_a_law_of_a_segment_is_placed_at_the_link_that_carries_it(stepped):
    robot = stepped.campaign.robot
    assert where(stepped, STEP) == ("joint", "joint_3")
    assert where(stepped, Discovered(kind="base", place="base")) == ("base", "base")
    for segment in robot.segments[1:]:
        if segment.movable:
            assert where(stepped, Discovered(kind="link", place=segment.name)) == ("link", segment.parent_link)
