"""A choice is made again at its own exact fit until it stays."""

import numpy as np
import pytest
from simulate import simulate
from time_constants import LAG
from time_constants import campaign as lagging

from thermal_robot.effects import choose
from thermal_robot.inference.frames import register
from thermal_robot.inference.gauss_newton import corrected_observations
from thermal_robot.inference.rows import row_groups
from thermal_robot.inference.settings import NEVER
from thermal_robot.inference.settle import settle
from thermal_robot.observations import observe

NOISE = 25e-6  # m
NAMES = ("joint_offset", "joint_gain", "geometric", "drift")


def settled(campaign, names=NAMES, **told):
    """The explanation at its exact fit, and what was said meanwhile."""
    start, said = observe(campaign, register(campaign)), []
    variants = {e.name: e.variants(start) for e in choose(names, (), ())}
    return settle(start, variants, row_groups(campaign), said.append, **told), said


@pytest.fixture(scope="module")
def gained(rv_m2):
    campaign = simulate(rv_m2, ["joint_gain"], seed=2, ratio=(20.0, 30.0))[0]
    return campaign, *settled(campaign)


def test_what_is_at_work_is_held_and_the_exact_model_leaves_the_noise(gained):
    campaign, found, _ = gained
    assert found.names == ("joint_gain",)
    assert found.noise == pytest.approx(NOISE, rel=0.15)
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
    for told in ({"begin": ("joint_offset", "drift")}, {"known": found}):
        again, _ = settled(campaign, **told)
        assert again.names == found.names
        np.testing.assert_allclose(again.held[0][1], found.held[0][1], rtol=0, atol=1e-6)


def test_what_was_picked_out_of_many_must_explain_more(gained):
    campaign, _, _ = gained
    assert "joint_gain" not in settled(campaign, rarity={"joint_gain": -1e5})[0].names


def test_an_effect_that_contains_others_is_known_as_such(rv_m2):
    large = simulate(rv_m2, ["geometric"], seed=1, ratio=(600.0, 700.0))[0]
    small = simulate(rv_m2, ["geometric"], seed=1)[0]
    for campaign, second_order in ((large, True), (small, False)):
        found, _ = settled(campaign)
        assert found.containers == {"geometric"}
        assert found.second_order == second_order
    # alone among the candidates it contains nothing
    assert settled(small, ("geometric", "drift"))[0].containers == set()


def test_a_constant_is_moved_off_the_grid_to_where_it_is(rv_m2):
    found, _ = settled(lagging("rv_m2", 1, LAG, 1300.0, 30.0), (LAG,))
    assert found.held[0][0].lag == pytest.approx(1300.0, rel=0.05)
    own = found.explanation.linear.blocks[found.explanation.best.blocks[0]].effect
    assert own == found.held[0][0]


def test_nothing_is_held_in_noise(rv_m2):
    found, _ = settled(simulate(rv_m2, seed=6)[0])
    assert found.held == ()
    assert found.containers == set()
    assert not found.second_order


def test_what_never_is_chosen_is_not_chosen_however_much_it_explains(gained):
    campaign, _, _ = gained
    found, _ = settled(campaign, ("joint_gain", "drift"), rarity={"joint_gain": NEVER})
    assert "joint_gain" not in found.names
