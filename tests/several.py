"""Campaigns in which several targets of one pose were measured, with known answers."""

import numpy as np
import pandas as pd
from simulate import simulate

from thermal_robot.campaign import campaign_from_table
from thermal_robot.kinematics import quaternion_to_rotation

NOISE = 25e-6
FLAT = np.array([[0.1, 0.0, 0.0], [-0.05, 0.08, 0.0], [-0.05, -0.08, 0.02]])
LONG = np.array([[0.02, 0.01, 0.15], [-0.02, 0.01, -0.15], [0.0, -0.02, 0.05], [0.01, 0.0, -0.05]])
"""Places of targets on the tool, m: three nearly in a plane, and four along a rod."""


def table_of(poses, targets, rng, noise=NOISE, lost=0.0):
    """The table of a campaign of exact poses as several targets tell them, a share of them not seen."""
    turn = quaternion_to_rotation(poses.orientation)
    points = poses.position[:, None] + targets @ turn.transpose(0, 2, 1)
    points = points + np.reshape(noise, (-1, 1, 1)) * rng.normal(size=points.shape)
    points[rng.uniform(size=points.shape[:2]) < lost] = np.nan
    columns = {name: poses.q[:, j] for j, name in enumerate(poses.robot.joint_names)} | dict(poses.covariates)
    for k in range(len(targets)):
        columns |= {f"{axis}.{k + 1}": points[:, k, a] for a, axis in enumerate("xyz")}
    return pd.DataFrame(columns)


def simulated(robot, effects, targets, seed, *, samples=60, ratio=(3.0, 6.0), noise=NOISE, lost=0.0, **told):
    """A campaign of several targets with its truth; effects leave ``ratio`` times :data:`NOISE` of a target."""
    exact = NOISE * 1e-3
    scaled = tuple(1e3 * r for r in ratio)
    poses, truth, _ = simulate(
        robot, effects, samples=samples, seed=seed, noise=exact, turning=1e-12, ratio=scaled, **told
    )
    table = table_of(poses, targets, np.random.default_rng([seed, 7]), noise, lost)
    return campaign_from_table(robot, table, noise_position=NOISE), truth
