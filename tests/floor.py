"""Robots on the floor: the trial's reality, which shares nothing with the program, measured by a tracker anywhere."""

import numpy as np
from simulate import random_motion

from thermal_robot.blind.reality import World
from thermal_robot.campaign import Campaign

NOISE = 25e-6
TARGET = np.array([0.03, -0.02, 0.08])
STEEL = 1.2e-5
"""1/K."""


def real_robot(arm, seed, *, zeros=None, misplaced=0.0, temperature=None, samples=100):
    """A campaign whose base is unknown and whose target is known.

    Zeros (n,) rad or m; placements of joints that err by so many m and rad; links of steel at (N,) °C.
    """
    rng = np.random.default_rng(seed)
    world = World(arm.urdf, arm.tool_frame)
    q = rng.uniform(np.maximum(arm.lower, -2.2), np.minimum(arm.upper, 2.2), (samples, arm.n))
    body = world.sound(samples)
    if zeros is not None:
        body.joints += zeros
    movable = [k for k, joint in enumerate(world.chain) if joint.movable]
    body.placements[movable] = misplaced * rng.normal(size=(len(movable), 6))
    conditions = {} if temperature is None else {"temperature": np.asarray(temperature, dtype=float)}
    for degrees in conditions.values():
        body.growth += STEEL * (degrees[:, None] - 20.0)
    poses = world.poses(q, np.zeros(samples), body)[0]
    place = (random_motion(rng, 2.0) @ poses @ np.append(TARGET, 1.0))[:, :3]
    measured = place + NOISE * rng.normal(size=place.shape)
    return Campaign(
        "real", arm, q, measured, covariates=conditions, tool_known=True, target=TARGET, noise_position=NOISE
    )
