"""The same robot here and in MuJoCo, where a link is a row of hinges: another program, another method."""

import numpy as np
import pytest
from helpers import commanded, tool_with

COM = (0.0, 0.0, 0.05)


def bodies(arm):
    """A campaign with payloads, the same arm in MuJoCo, and the numbers of its beams there."""
    pytest.importorskip("mujoco")
    from thermal_robot.blind.reality.world import World

    campaign = commanded(arm, {"payload": np.tile([0.0, 2.0], 5)}, payload_com=np.array(COM))
    world = World(arm.urdf, arm.tool_frame, COM)
    long = [segment.name for segment in arm.segments if segment.length > 1e-6]
    return campaign, world, [world.segments.index(k) for k, joint in enumerate(world.chain) if joint.name in long]


def displaced(world, campaign, body):
    there = world.poses(campaign.q, campaign.covariates["payload"], body)[0]
    sound = world.poses(campaign.q, campaign.covariates["payload"], world.sound(len(campaign.q)))[0]
    return (there - sound)[:, :3, 3]


def mine(campaign, effect, values):
    return tool_with(campaign, effect, values) - tool_with(campaign, effect, 0.0 * np.asarray(values))
