"""Effects of bending against a robot in MuJoCo whose links are rows of hinges: another program, another method."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from helpers import commanded, tool_with

from thermal_robot.effects import Backlash, LinkCompliance, ThermalBending
from thermal_robot.observations import observe

pytest.importorskip("mujoco")

from thermal_robot.blind.reality.world import World

COM = (0.0, 0.0, 0.05)


def bodies(name):
    """The same robot here and in MuJoCo, with commands and a payload; the numbers of its beams there."""
    arm = load_arm(name)
    payload = np.tile([0.0, 2.0], 5)
    campaign = commanded(arm, {"payload": payload}, payload_com=np.array(COM))
    world = World(arm.urdf, arm.tool_frame, COM)
    at = [world.segments.index(k) for k, joint in enumerate(world.chain) if joint.name in long_segments(arm)]
    return campaign, world, at


def long_segments(arm):
    return [segment.name for segment in arm.segments if segment.length > 1e-6]


def displaced(world, campaign, body):
    there = world.poses(campaign.q, campaign.covariates["payload"], body)[0]
    sound = world.poses(campaign.q, campaign.covariates["payload"], world.sound(len(campaign.q)))[0]
    return (there - sound)[:, :3, 3]


def mine(campaign, effect, values):
    return tool_with(campaign, effect, values) - tool_with(campaign, effect, 0.0 * np.asarray(values))


@pytest.mark.parametrize("name", ["ur10", "panda", "rv_m2"])
def test_a_beam_of_hinges_bends_as_the_cantilever(name):
    campaign, world, at = bodies(name)
    stiffness = 1e-7 * (1.0 + np.arange(2.0 * len(at)).reshape(-1, 2))
    for chosen in (*range(len(at)), slice(None)):
        values = np.zeros_like(stiffness)
        values[chosen] = stiffness[chosen]
        body = world.sound(len(campaign.q))
        body.beams[at] = values
        expected = displaced(world, campaign, body)
        found = mine(campaign, LinkCompliance(), values.ravel())
        if np.abs(expected).max() < 1e-10:
            assert np.abs(found).max() < 1e-9
            continue
        # three hinges lack a 36th of what a force on the end does
        error = np.linalg.norm(found - expected, axis=1).max() / np.linalg.norm(expected, axis=1).max()
        assert error < 0.03, f"{name}, segment {chosen}: {error:.3f}"


@pytest.mark.parametrize("name", ["ur10", "panda", "rv_m2"])
def test_a_bowed_row_of_hinges_is_a_bowed_link(name):
    campaign, world, at = bodies(name)
    arm, samples = campaign.robot, len(campaign.q)
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


@pytest.mark.parametrize("name", ["ur10", "rv_m2"])
def test_play_that_hangs_lies_where_the_load_pushes_it(name):
    """A joint on a very soft spring goes with gravity; one that hangs in its play goes the same way."""
    campaign, world, _ = bodies(name)
    arm, samples = campaign.robot, len(campaign.q)
    approach = {f"approach.{joint}": np.tile([1.0, -1.0], samples // 2) for joint in arm.joint_names}
    campaign = replace(campaign, covariates={**campaign.covariates, **approach})
    effect = Backlash().variants(observe(campaign))[1]
    torque = world.poses(campaign.q, campaign.covariates["payload"], world.sound(samples))[1]
    for j, parameter in enumerate(effect.parameters(observe(campaign))):
        shift = parameter.responses[0].values
        heavy = np.abs(torque[:, j]) > 0.5 * np.abs(torque[:, j]).max()
        heavy &= np.abs(torque[:, j]).max() > 0.02 * np.abs(torque).max()
        np.testing.assert_array_equal(np.sign(shift[heavy]), -np.sign(torque[heavy, j]))
        np.testing.assert_array_equal(shift[~heavy], -0.5 * approach[f"approach.{arm.joint_names[j]}"][~heavy])
