"""Linear problems: small ones drawn at random, and those of a robot and its effects."""

from dataclasses import replace

import numpy as np
from simulate import simulate

from thermal_robot.effects import Effect, Parameter, at_joint
from thermal_robot.inference.columns import Block, block, frame_columns
from thermal_robot.inference.problem import Linear, Whitening, gram
from thermal_robot.inference.registration import register
from thermal_robot.observations import observe

WIDTHS = (1, 2, 3)


def columns_of(array, sizes=None):
    """A block of columns that no effect stands behind."""
    return Block(None, (), array, np.ones(array.shape[2]) if sizes is None else sizes)


def small_problem(seed, rows=12, present=(1,), noise=1.0, held=20.0):
    """Two flat frame columns, three blocks of which some are present, noise of known size."""
    rng = np.random.default_rng(seed)
    frames = rng.normal(size=(rows, 3, 2))
    blocks = tuple(columns_of(rng.normal(size=(rows, 3, w)), np.full(w, 2.0)) for w in WIDTHS)
    gap = noise * rng.normal(size=(rows, 3)) + frames @ [50.0, -20.0]
    for b in present:
        gap = gap + blocks[b].columns @ (2.0 * rng.choice([-1.0, 1.0], WIDTHS[b]))
    weights = rng.uniform(0.3, 1.0, rows)
    weights[0] = 0.0
    return Linear(gap, frames, blocks), Whitening(weights, np.full(3, noise), held)


class FirstJoint(Effect):
    """The zero of the first joint alone."""

    name = "first_joint"

    def parameters(self, observations):
        return (Parameter("offset", "rad", 1e-3, "joint", observations.robot.joint_names[0], (at_joint(0, 1.0),)),)


def problem_of(robot, effects, turning=None, base_known=False):
    campaign = simulate(robot, ["joint_offset"], seed=0, turning=turning)[0]
    if base_known:
        base = register(campaign).base
        campaign = replace(campaign, base_known=True, position=(campaign.position - base[:3, 3]) @ base[:3, :3])
    seen = observe(campaign, register(campaign))
    linear = Linear(seen.gap, frame_columns(seen)[0], tuple(block(seen, e) for e in effects))
    noise = np.repeat([25e-6, turning or 1.0], 3)[: linear.measures]
    return linear, gram(linear, Whitening(np.ones(campaign.samples), noise, 20.0))
