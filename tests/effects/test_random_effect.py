"""Effects that scatter: no mean, a spread that the parameter says, repeats that show it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import commanded

from thermal_robot.effects import EncoderResolution, ExcessRepeatability, RandomEffect, random_effects
from thermal_robot.effects.gate import checked
from thermal_robot.observations import observe


@pytest.mark.parametrize("effect", random_effects(), ids=lambda effect: effect.name)
def test_no_mean_follows_from_scatter_and_a_draw_has_the_spread_that_its_parameter_says(rv_m2, effect):
    seen = observe(commanded(rv_m2))
    assert effect.random
    assert checked(effect, seen) == ()
    assert effect.driver(seen, (), np.zeros(10)) is None
    assert effect.variants(seen) == (effect,)
    rng = np.random.default_rng(0)
    command, pose = rng.uniform(-2.0, 2.0, 20_000), np.arange(20_000)
    away = effect.drawn(command, pose, 3e-3 * effect.factor, rng)
    assert abs(away.mean()) < 1e-4
    assert away.std() == pytest.approx(3e-3, rel=0.03)
    assert not np.any(effect.drawn(command, pose, 0.0, rng))
    # a draw repeats where the pose does if it counts by the pose
    pose = np.repeat(np.arange(50), 4)
    away = effect.drawn(0.1 * pose, pose, 1e-3, np.random.default_rng(1)).reshape(50, 4)
    assert np.all((np.ptp(away, axis=1) == 0.0) == (effect.component == "pose"))


def test_each_kind_of_scatter_has_one_effect_in_words_of_its_own_and_in_its_places():
    # each kind of scatter has one effect in words of its own
    found = random_effects()
    assert [(e.component, e.label) for e in found] == [("pose", "step"), ("visit", "standard deviation")]
    assert [e.title for e in found] == [
        "encoders that count in coarse steps",
        "joints that scatter more than the instrument",
    ]
    assert [e.factor for e in found] == pytest.approx([np.sqrt(12.0), 1.0])

    class Vague(RandomEffect):
        name = "vague"

    with pytest.raises(AttributeError):  # one that states no component cannot be told
        _ = Vague().component
    # it is in its places and not in those excluded
    chain = ("a", "b", "c")
    told = [EncoderResolution(**given).joints(chain) for given in ({}, {"places": ("c", "a")}, {"excluded": ("b",)})]
    assert told == [chain, ("a", "c"), ("a", "c")]


def test_excess_needs_a_pose_that_is_visited_twice_by_its_label_or_else_its_command(rv_m2):
    once = commanded(rv_m2)
    near, off = once.q.copy(), once.q.copy()
    near[7] = near[2] + 1e-9
    off[7] = off[2] + 1e-4 * (np.arange(5) == 3)
    same = replace(once, q=np.tile(once.q[:1], (10, 1)))

    def labelled(campaign, *labels):
        return replace(campaign, labels={"pose": np.array(labels + ("",) * (10 - len(labels)))})

    repeated = [replace(once, q=near), same, labelled(once, "p", "", "p")]
    alone = [once, replace(once, q=off), labelled(same, *(f"p{k}" for k in range(10))), labelled(same, "p")]
    assert [ExcessRepeatability().missing(observe(campaign)) for campaign in repeated] == [()] * 3
    assert [ExcessRepeatability().missing(observe(campaign)) for campaign in alone] == [("pose",)] * 4
    assert EncoderResolution().missing(observe(once)) == ()
