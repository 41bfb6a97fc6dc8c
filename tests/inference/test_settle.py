"""A choice that stays: made again at its own exact fit it is the same, and the same from another start."""

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit
from thermal_robot.inference.rows import row_groups
from thermal_robot.inference.settings import NEVER
from thermal_robot.inference.settle import settle


def quiet(_):
    """Tell nobody."""


@pytest.fixture(scope="module")
def known(rv_m2):
    data, _, _ = simulate(rv_m2, ["joint_gain", "backlash"], seed=5, ratio=(6.0, 10.0))
    return fit(data, choose((), ("geometric",), ()))


@pytest.fixture(scope="module")
def settled(known):
    return settle(known.nominal, known.variants, row_groups(known.campaign), quiet)


def test_the_choice_is_what_is_at_work(settled):
    assert set(settled.names) == {"joint_gain", "backlash"}
    assert settled.noise == pytest.approx(25e-6, rel=0.15)


@pytest.mark.parametrize("begin", [("drift", "thermal_elongation"), ("joint_gain",), ("instrument_scale", "backlash")])
def test_it_is_the_same_from_any_start(known, settled, begin):
    other = settle(known.nominal, known.variants, row_groups(known.campaign), quiet, begin=begin)
    assert set(other.names) == set(settled.names)
    np.testing.assert_allclose(other.observations.gap, settled.observations.gap, atol=1e-8)


def test_settled_again_it_stays(known, settled):
    again = settle(settled.observations, known.variants, row_groups(known.campaign), quiet, settled)
    assert set(again.names) == set(settled.names)
    values = dict((effect.name, v) for effect, v in settled.held)
    for effect, found in again.held:
        np.testing.assert_allclose(found, values[effect.name], atol=1e-7)


def test_an_effect_that_only_scatter_had_feigned_is_not_chosen_again(known):
    rarity = {"backlash": NEVER}
    other = settle(known.nominal, known.variants, row_groups(known.campaign), quiet, rarity=rarity)
    assert "backlash" not in other.names


def test_nothing_in_an_explanation_of_small_effects_contains_another(settled):
    assert settled.containers == set()
    assert not settled.second_order
