"""Attained poses whose criteria can be computed by hand."""

import numpy as np

from thermal_robot.campaign import Campaign
from thermal_robot.iso9283 import Attained
from thermal_robot.kinematics import exp3, rotation_to_quaternion
from thermal_robot.observations import Frames, observe

# Five pairs on opposite sides of the origin, 2, 5, 5, 5 and 8 mm away. Their mean distance is 5 mm; the squares of
# what they differ by add up to 2 (9 + 0 + 0 + 0 + 9) = 36 mm², over n − 1 = 9 that is 4, so S_l = 2 mm.
# RP_l = 5 + 3 · 2 = 11 mm.
PAIRS = 1e-3 * np.array([[2.0, 0, 0], [3, 4, 0], [0, 3, 4], [4, 0, 3], [0, 0, 8]])
ELEVEN = np.vstack([PAIRS, -PAIRS])

# Turns of ten cycles about one axis, mrad: their mean is 0, and the squares add up to 36, over 9 that is 4, S = 2 mrad.
# RP about that axis is 6 mrad, about the others 0.
TURNS = 1e-3 * np.array([3.0, -3, 3, -3, 0, 0, 0, 0, 0, 0])


def cloud(place=(0.0, 0.0, 0.0), size=1.0, about_z=None, mean_turn=0.0):
    """Ten cycles about a place (m): RP_l is ``size`` · 11 mm, and RP_c ``about_z`` · 6 mrad where turns are known."""
    rotation = None
    if about_z is not None:
        rotation = exp3(np.outer(mean_turn + about_z * TURNS, [0.0, 0.0, 1.0]))
    return Attained(np.array(place) + size * ELEVEN, rotation)


def cell(robot, number, shift=0.0, *, frames=None, turn=None, known=True, q=None, seed=4, **fields):
    """A campaign of the nominal robot: row k is at pose ``number[k]``, off by ``shift`` (N, 3) in the base's axes, m.

    ``turn`` (N, 3) are rotation vectors about these axes, rad.
    """
    number = np.asarray(number)
    rows = len(number)
    if q is None:
        middle, half = (robot.lower + robot.upper) / 2, (robot.upper - robot.lower) / 2
        drawn = np.random.default_rng(seed).uniform(-0.6, 0.6, (number.max() + 1, robot.n))
        q = (middle + drawn * half)[number]
    frames = frames or Frames(np.eye(4), np.eye(4))
    labels = {"pose": np.array([f"P{k + 1}" for k in number])} | fields.pop("labels", {})
    facts = {"labels": labels, "base_known": known, "tool_known": known, "target": frames.tool[:3, 3], **fields}
    bare = Campaign("cell", robot, q, np.zeros((rows, 3)), **facts)
    seen = observe(bare, frames)
    turned = frames.base[:3, :3]
    position = seen.predicted_position + np.broadcast_to(shift, (rows, 3)) @ turned.T
    orientation = None
    if turn is not None:
        orientation = rotation_to_quaternion(turned @ exp3(np.broadcast_to(turn, (rows, 3))) @ seen.rotation)
    return Campaign("cell", robot, q, position, orientation, **facts)
