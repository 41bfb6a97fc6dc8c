"""Links that bow with heat: against rows of hinges in MuJoCo, and by what they are warmer than."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import bodies, displaced, mine
from helpers import commanded, tool_at, tool_with

from thermal_robot.effects import ThermalBending
from thermal_robot.observations import observe


def link_temperatures(arm, seed=3):
    rng = np.random.default_rng(seed)
    return {f"temperature.{s.parent_link}": 20.0 + rng.uniform(0, 9, 10) for s in arm.segments}


@pytest.mark.parametrize("arm", ["ur10", "panda", "rv_m2"], indirect=True)
def test_a_bowed_row_of_hinges_is_a_bowed_link(arm):
    campaign, world, at = bodies(arm)
    samples = len(campaign.q)
    rng = np.random.default_rng(0)
    links = {segment.parent_link: 22.0 + 5.0 * rng.uniform(size=samples) for segment in arm.segments}
    recorded = {f"temperature.{link}": t for link, t in links.items()} | {"temperature": rng.uniform(20, 24, samples)}
    campaign = replace(campaign, covariates={**campaign.covariates, **recorded})
    values = 1e-5 * rng.normal(size=(len(at), 2))
    body = world.sound(samples)
    for s, k in enumerate(at):
        warmer = recorded[f"temperature.{world.links[k]}"] - recorded["temperature"]
        body.bow[:, k] = warmer[:, None] * values[s]
    expected = displaced(world, campaign, body)
    found = mine(campaign, ThermalBending(), values.ravel())
    assert np.linalg.norm(found - expected, axis=1).max() < 0.01 * np.linalg.norm(expected, axis=1).max()


@pytest.mark.parametrize("arm", ["ur10"], indirect=True)
def test_bending_by_heat_is_of_the_difference_to_the_robot(arm):
    own = link_temperatures(arm)
    mean = np.mean([own[c] for c in ThermalBending().reads(observe(commanded(arm, own)))], axis=0)
    values = 1e-3 * np.random.default_rng(4).normal(size=len(ThermalBending().parameters(observe(commanded(arm, own)))))
    stated = commanded(arm, {**own, "temperature": mean})
    expected = tool_with(stated, ThermalBending(), values)
    np.testing.assert_allclose(tool_with(commanded(arm, own), ThermalBending(), values), expected, atol=1e-14)
    even = commanded(arm, {name: mean for name in own})
    assert ThermalBending().missing(observe(even))
    np.testing.assert_allclose(tool_with(even, ThermalBending(), values), tool_at(arm, even.q), atol=1e-14)


def test_it_is_drawn_against_how_much_warmer_the_link_is(rv_m2):
    own = link_temperatures(rv_m2)
    general = np.linspace(20.0, 23.0, 10)
    observations = observe(commanded(rv_m2, {**own, "temperature": general}))
    for parameter in ThermalBending().parameters(observations):
        name, unit, values = ThermalBending().driver(observations, [parameter], np.zeros(10))
        assert (name, unit) == (f"{parameter.place} warmer than the robot by", "K")
        np.testing.assert_allclose(values, own[f"temperature.{parameter.place}"] - general, atol=1e-12)
        # twice as much warmer, twice the bow
        response = np.linalg.norm(parameter.responses[0].values, axis=1)
        np.testing.assert_allclose(response / np.abs(values), (response / np.abs(values))[0], rtol=1e-9)
