"""What the data cannot tell apart: another effect in the place of one that is nearly as probable."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.diagnosis import diagnose
from thermal_robot.diagnosis.findings import rivals, unknown_frames, within_frames
from thermal_robot.effects import choose
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.fit import fit
from thermal_robot.simulation import simulate as program

FEW = ("joint_offset", "joint_gain", "drift", "backlash")


@pytest.fixture(scope="module")
def known(rv_m2):
    """A joint whose zero is off, among four candidates."""
    return fit(simulate(rv_m2, ["joint_offset"], seed=2, places=["joint_3"])[0], choose(FEW))


def weighed(known, odds):
    """The same fit, where sets of effects are as probable as said; the best is what was found."""
    e = known.explanation
    sets = [e.best.blocks, *(tuple(known.blocks_of(name)[0] for name in names) for names in odds)]
    nothing = np.zeros(0)
    compared = [Combination(blocks, 0.0, 1.0, {}, nothing, nothing, 0.0) for blocks in sets]
    weight = np.array([1.0, *odds.values()])
    said = replace(known, explanation=replace(e, combinations=compared, probabilities=weight / weight.sum()))
    return rivals(said, {"joint_offset": e.best.blocks[0]})


@pytest.mark.parametrize(("chance", "told"), [(0.4, True), (0.02, True), (0.005, False), (1e-5, False)])
def test_another_effect_in_its_place_counts_from_a_hundredth(known, chance, told):
    found = weighed(known, {("joint_gain",): chance / (1.0 - chance)})
    assert found == ({"joint_offset": ("joint_gain",), "joint_gain": ("joint_offset",)} if told else {})


def test_two_effects_in_its_place_are_no_rival_of_it(known):
    assert weighed(known, {("joint_gain", "drift"): 0.5}) == {}


def test_an_effect_beside_it_is_no_rival(known):
    assert weighed(known, {("joint_offset", "drift"): 0.9}) == {}


def test_what_is_at_work_for_sure_has_no_rival(known):
    """However little mass its own set has beside others in doubt."""
    doubts = {("joint_offset", "drift"): 50.0, ("joint_offset", "backlash"): 50.0, ("joint_gain",): 0.14}
    assert weighed(known, {("joint_gain",): 0.14}) != {}
    assert weighed(known, doubts) == {}


@pytest.mark.parametrize("seed", range(33, 37))
def test_what_could_do_the_same_and_is_improbable_is_no_rival(rv_m2, seed):
    """A joint that its weight always seats on one side is off by a constant, as by lost motion, at its price."""
    off = {"joint_offset": {"joint_2": 8e-4}}
    found = diagnose(program(rv_m2, off, rows=70, tool=(0.05, 0.03, 0.1), noise=15e-6, base_known=False, seed=seed))
    assert found.finding("backlash").probability < 0.05
    assert found.finding("joint_offset").status == "found"
    assert found.separates == ()


@pytest.mark.parametrize("seed", range(3))
def test_links_and_joints_that_bend_are_told_together_on_few_rows(rv_m2, seed):
    bends = {"joint_compliance": {"joint_2": 1e-5}}
    found = diagnose(program(rv_m2, bends, rows=16, tool=(0.05, 0.03, 0.1), noise=2e-5, base_known=False, seed=seed))
    pair = {"joint_compliance", "link_compliance"}
    assert all({name, *found.finding(name).confounded_with} == pair for name in pair)


def test_unknown_frames_hold_the_first_zero_alone(known):
    own = {known.explanation.linear.blocks[b].effect.places: b for b in known.blocks_of("joint_offset")}
    assert set(unknown_frames(known)) == {"base_frame", "tool_frame"}
    assert not within_frames(known, own[()])
    assert not within_frames(known, own[("joint_3",)])
