"""What the data cannot tell apart: another effect in the place of one, within three nats."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.diagnosis.rivals import rivals, unknown_frames, within_frames
from thermal_robot.effects import choose
from thermal_robot.inference.evidence import Combination
from thermal_robot.inference.fit import fit

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


@pytest.mark.parametrize(("nats", "told"), [(0.5, True), (2.9, True), (3.1, False), (9.0, False)])
def test_another_effect_in_its_place_counts_up_to_three_nats(known, nats, told):
    found = weighed(known, {("joint_gain",): np.exp(-nats)})
    assert found == ({"joint_offset": ("joint_gain",), "joint_gain": ("joint_offset",)} if told else {})


def test_two_effects_in_its_place_are_no_rival_of_it(known):
    assert weighed(known, {("joint_gain", "drift"): 0.5}) == {}


def test_an_effect_beside_it_is_no_rival(known):
    assert weighed(known, {("joint_offset", "drift"): 0.9}) == {}


def test_what_is_at_work_for_sure_has_no_rival(known):
    """Beside others in doubt, its own set has little mass, and its rival's in proportion more."""
    doubts = {("joint_offset", "drift"): 1.0, ("joint_offset", "backlash"): 1.0, ("joint_gain",): 0.14}
    assert weighed(known, {("joint_gain",): 0.14}) != {}
    assert weighed(known, doubts) == {}


def test_unknown_frames_hold_the_first_zero_alone(known):
    own = {known.explanation.linear.blocks[b].effect.places: b for b in known.blocks_of("joint_offset")}
    assert set(unknown_frames(known)) == {"base_frame", "tool_frame"}
    assert not within_frames(known, own[()])
    assert not within_frames(known, own[("joint_3",)])
