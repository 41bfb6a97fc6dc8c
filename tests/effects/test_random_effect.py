"""What all effects that scatter have in common."""

import numpy as np
import pytest
from helpers import commanded

from thermal_robot.effects import RandomEffect, random_effects
from thermal_robot.effects.gate import checked
from thermal_robot.observations import observe


def test_no_mean_follows_from_them(rv_m2):
    observations = observe(commanded(rv_m2))
    for effect in random_effects():
        assert isinstance(effect, RandomEffect)
        assert effect.random
        assert checked(effect, observations) == ()
        assert effect.driver(observations, (), np.zeros(10)) is None
        assert effect.variants(observations) == (effect,)


def test_each_kind_of_scatter_has_one_effect_in_words_of_its_own():
    found = random_effects()
    assert [effect.component for effect in found] == ["pose", "visit"]
    for field in ("name", "title", "label"):
        assert len({getattr(effect, field) for effect in found}) == 2
    assert all(effect.factor >= 1.0 for effect in found)


def test_one_that_states_no_component_cannot_be_told():
    class Vague(RandomEffect):
        name = "vague"

    with pytest.raises(AttributeError):
        _ = Vague().component
