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


@pytest.mark.parametrize("effect", random_effects(), ids=lambda effect: effect.name)
def test_a_draw_has_the_spread_that_its_parameter_says(effect):
    rng = np.random.default_rng(0)
    command, pose = rng.uniform(-2.0, 2.0, 20_000), np.arange(20_000)
    away = effect.drawn(command, pose, 3e-3 * effect.factor, rng)
    assert abs(away.mean()) < 1e-4
    assert away.std() == pytest.approx(3e-3, rel=0.03)
    assert not np.any(effect.drawn(command, pose, 0.0, rng))


@pytest.mark.parametrize("effect", random_effects(), ids=lambda effect: effect.name)
def test_a_draw_repeats_where_the_pose_does_if_it_counts_by_the_pose(effect):
    pose = np.repeat(np.arange(50), 4)
    away = effect.drawn(0.1 * pose, pose, 1e-3, np.random.default_rng(1)).reshape(50, 4)
    assert np.all((np.ptp(away, axis=1) == 0.0) == (effect.component == "pose"))


def test_it_is_in_its_places_and_not_in_those_excluded():
    kind = type(random_effects()[0])
    chain = ("a", "b", "c")
    assert kind().joints(chain) == chain
    assert kind(places=("c", "a")).joints(chain) == ("a", "c")
    assert kind(excluded=("b",)).joints(chain) == ("a", "c")
