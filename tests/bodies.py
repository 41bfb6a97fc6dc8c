"""The same robot here and in MuJoCo, where a link is a row of hinges: another program, another method."""

from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import commanded, tool_with

from thermal_robot.robot import load_robot

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


def hinged(arm, name, axis, moving):
    """The same arm with a hinge in the frame of a joint, moved by the joint or before it."""
    root = ElementTree.fromstring(arm.urdf)
    (joint,) = (j for j in root.findall("joint") if j.get("name") == name)
    origin, child = joint.find("origin"), joint.find("child")
    ElementTree.SubElement(root, "link", name="between")
    hinge = ElementTree.SubElement(root, "joint", name="hinge", type="revolute")
    ElementTree.SubElement(hinge, "axis", xyz=" ".join(map(repr, map(float, axis))))
    ElementTree.SubElement(hinge, "limit", lower="-1", upper="1", effort="1", velocity="1")
    ends = ("between", child.get("link")) if moving else (joint.find("parent").get("link"), "between")
    ElementTree.SubElement(hinge, "parent", link=ends[0])
    ElementTree.SubElement(hinge, "child", link=ends[1])
    if moving:
        child.set("link", "between")
    else:
        ElementTree.SubElement(hinge, "origin", dict(origin.attrib))
        joint.find("parent").set("link", "between")
        origin.set("xyz", "0 0 0")
        origin.set("rpy", "0 0 0")
    return load_robot(ElementTree.tostring(root, encoding="unicode"), arm.tool_frame, gravity=arm.gravity)
