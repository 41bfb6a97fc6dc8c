"""Campaigns of one robot that are read with the URDF of another, and sound ones of coarse robots."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

from thermal_robot.effects import gate, named
from thermal_robot.kinematics import exp3, homogeneous
from thermal_robot.observations import observe
from thermal_robot.robot import joint_range, load_robot
from thermal_robot.simulation import simulate


def lengthened(robot, factors):
    """The robot with the origins of some joints farther out: ``{joint: factor}``."""
    tree = ElementTree.fromstring(robot.urdf)
    for joint in tree.iter("joint"):
        origin = joint.find("origin")
        if joint.get("name") in factors and origin is not None:
            xyz = [float(value) * factors[joint.get("name")] for value in origin.get("xyz", "0 0 0").split()]
            origin.set("xyz", " ".join(map(repr, xyz)))
    return load_robot(ElementTree.tostring(tree, encoding="unicode"), robot.tool_frame, root_frame=robot.root_frame)


def somewhere(rng, lever=0.15):
    """A base anywhere, and a target about so far from the tool frame."""
    base = homogeneous(exp3(rng.normal(size=3)), rng.normal(size=3))
    return base, homogeneous(np.eye(3), lever / np.sqrt(3) * rng.normal(size=3))


def measured(robot, seed, rows=60, measures="position", lever=0.15, share=1.0, **sizes):
    """A campaign of a robot with effects of these sizes: one sigma of their parameters, in the parameters' unit."""
    rng = np.random.default_rng([seed, 5])
    low, high = (np.clip(bound, -2.8, 2.8) for bound in joint_range(robot))
    middle = low + (high - low) * rng.uniform(share / 2, 1 - share / 2, robot.n)
    q = middle + share * (high - low) * rng.uniform(-0.5, 0.5, (rows, robot.n))
    base, tool = somewhere(rng, lever)
    turning = 5e-5 if measures == "pose" else 0.0
    plan = {"commands": q, "measures": measures, "noise": 3e-5, "noise_orientation": turning}
    plan |= {"base": base, "tool": tool, "seed": seed}
    bare, at_work = observe(simulate(robot, {}, **plan)), {}
    for name, size in sizes.items():
        known = parameters(name, bare)
        drawn = size * rng.normal(size=len(known))
        at_work[name] = np.where([p.positive for p in known], np.abs(drawn), drawn)
    return simulate(robot, at_work, **plan)


def parameters(name, observations):
    """Parameters of an effect in the setting in which it is first looked for."""
    return gate.checked(gate.variants(named(name), observations)[0], observations)


def read_with(campaign, robot):
    """The campaign as it is read with another URDF of as many joints."""
    plan = {"commands": campaign.q, "measures": campaign.measures, "noise": 3e-5, "base": np.eye(4), "tool": np.eye(4)}
    if campaign.orientation is not None:
        plan["noise_orientation"] = 5e-5
    other = simulate(robot, {}, **plan)
    return replace(other, position=campaign.position, orientation=campaign.orientation)


def base_moved(campaign, row, seed):
    """The campaign with another base from a row on, and no label that says so."""
    base, _ = somewhere(np.random.default_rng(seed))
    position = campaign.position.copy()
    position[row:] = position[row:] @ base[:3, :3].T + base[:3, 3]
    return replace(campaign, position=position)
