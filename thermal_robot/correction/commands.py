"""Commands for the robot as it really is: joint positions at which its tool reaches the nominal poses.

The nominal pose of a row is where the nominal robot would bring the target at the row's joint positions, p₀(q₀), in the
root frame, on the target as it was fitted. The real robot brings it to p(q) = p₀ displaced by all that the effects do
in the chain, at the row's conditions. Wanted is the q with p(q) = p₀(q₀).

What displaces the base counts too (a pedestal that yields, drift): the pose is meant where the base was when the
frames were fitted. What an instrument adds does not: its scale says nothing of where the tool is, and a robot that was
moved for it would miss. Where a campaign brought the predictions of a simulator, what the simulator says at q is taken
to differ from what it said at q₀ as the URDF's poses do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.units import SI
from thermal_robot.effects import Effect
from thermal_robot.effects.apply import displacement
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import Displacement, inverse_kinematics, nearest_postures, tool_poses
from thermal_robot.observations import Frames, observe
from thermal_robot.prediction import Spread
from thermal_robot.robot import Robot

MISSED = 1e-7
"""m; a command that brings the target no nearer does not reach the pose: a hundredth of what any tracker sees."""
ROUNDED = 1e-9
"""rad, m by which a position may lie beyond its limit as it was rounded; less than a hundredth of :data:`MISSED`."""
ORTHOGONAL = 1e-6
"""By which the axes of a pose may fail to be orthogonal and of length one: rounding to six digits."""
FARTHEST = {"revolute": 0.2, "continuous": 0.2, "prismatic": 0.05}
"""rad, m; a joint goes no farther from its nominal position: ten times the largest errors of robots. What asks for more
lies at a singular pose, or is another posture, whose way there nobody has looked at."""


@dataclass(frozen=True, eq=False)
class Commands:
    """Joint positions to command, and what will be reached.

    Attributes
    ----------
    q
        (N, n) rad or m, in the chain's order, within the joints' limits.
    std
        (N, 3) one standard deviation per axis of where the target will be, measurement frame, m; NaN where the model
        does not tell.
    outside
        Per row: the joints and columns in which it leaves what was measured.
    direction
        (N,) rad by which the direction of the target is missed: 0 but for rounding, unless the arm has fewer than six
        joints, or stands at a singular pose or at a limit.

    Examples
    --------
    >>> import thermal_robot as tr
    >>> campaign = tr.demo_campaign()
    >>> commands = tr.diagnose(campaign).model.corrected_commands(campaign.take([0, 1]))
    >>> commands.q.shape, commands.std.shape, commands.outside
    ((2, 5), (2, 3), ((), ()))
    """

    q: Array
    std: Array
    outside: tuple[tuple[str, ...], ...]
    direction: Array


def corrected(
    samples: Campaign, frames: Frames, effects: Sequence[tuple[Effect, Array]], spread: Spread | None
) -> Commands:
    """Return the commands that bring the real target to the nominal poses of samples.

    A pose that cannot be reached within the limits, and a joint beyond its limit, is refused with its row.
    """
    robot, tool = samples.robot, frames.tool
    farthest = np.array([FARTHEST[kind] for kind in robot.joint_types])
    # a row beyond a limit is solved as it stands; the correction may bring it back
    low = np.minimum(np.maximum(samples.q - farthest, robot.lower), samples.q)
    high = np.maximum(np.minimum(samples.q + farthest, robot.upper), samples.q)

    def displaced(q: Array) -> Displacement:
        there = replace(samples, q=q, travelled=samples.since_turn)
        return displacement(observe(there, frames), effects)[0]

    wanted = tool_poses(robot, samples.q) @ tool
    found = inverse_kinematics(robot, wanted, samples.q, tool=tool, displaced=displaced, within=(low, high))
    _require_within_limits(samples, found.q)
    _require_reached(samples, found.miss)
    q = np.clip(found.q, robot.lower, robot.upper)
    there = replace(samples, q=q, travelled=samples.since_turn)
    if spread is None:
        return Commands(q, np.full((samples.samples, 3), np.nan), ((),) * samples.samples, found.turned)
    outside = spread.outside(there, effects)
    std = spread.std(observe(there, frames, displacement=displaced(q)), effects, outside, noise=False)
    return Commands(q, std, outside, found.turned)


def nominal_positions(robot: Robot, frames: Frames, poses: ArrayLike) -> Array:
    """(N, n) joint positions, rad or m, at which the nominal robot brings the target to poses (N, 4, 4), root frame.

    One that is out of reach is refused by its row among them, which count from 1.
    """
    expected = "an array (N, 4, 4) of poses, m"
    try:
        wanted = np.asarray(poses, dtype=float)
    except (TypeError, ValueError) as error:
        raise CampaignError("<poses>", "these are no poses", found=str(error), expected=expected) from error
    turns = wanted[..., :3, :3]
    if wanted.shape[1:] != (4, 4) or not np.allclose(turns @ turns.swapaxes(-1, -2), np.eye(3), atol=ORTHOGONAL):
        raise CampaignError("<poses>", "these are no poses", found=f"shape {wanted.shape}", expected=expected)
    found = nearest_postures(robot, wanted, tool=frames.tool)
    missed = np.flatnonzero(~(found.miss <= MISSED))
    if missed.size:
        left = f"{1e3 * found.miss[missed[0]]:.3g} mm are left"
        raise CampaignError("<poses>", "out of reach for the nominal robot", row=int(missed[0]) + 1, found=left)
    return found.q


def _require_within_limits(samples: Campaign, q: Array) -> None:
    """Refuse rows beyond a limit that no correction brings back: only such have commands (N, n) beyond one."""
    robot = samples.robot
    wrong = np.argwhere(np.maximum(robot.lower - q, q - robot.upper) > ROUNDED)
    if len(wrong):
        row, joint = (int(k) for k in wrong[0])
        more = len(np.unique(wrong[:, 0])) - 1
        low, high = (_in_units(samples, joint, end[joint]) for end in (robot.lower, robot.upper))
        raise CampaignError(
            samples.name,
            "the joint cannot stand beyond its limit" + (f", nor in {more} more rows" if more else ""),
            row=int(samples.rows[row]),
            column=robot.joint_names[joint],
            found=_in_units(samples, joint, samples.q[row, joint]),
            expected=f"a position from {low} to {high} (arrays are in rad and m)",
        )


def _in_units(samples: Campaign, joint: int, position: float) -> str:
    """Return a joint's position as the campaign's tables have it, and as arrays have it where that differs."""
    kind = samples.robot.joint_types[joint]
    units = dict.fromkeys((samples.units, SI))
    own, *si = dict.fromkeys(f"{position / u.joint_scale(kind):.6g} {u.joint_unit(kind)}" for u in units)
    return f"{own} ({si[0]})" if si else own


def _require_reached(samples: Campaign, miss: Array) -> None:
    missed = np.flatnonzero(~(miss <= MISSED))
    if missed.size:
        row = int(missed[0])
        more = f", and so are {missed.size - 1} more rows" if missed.size > 1 else ""
        raise CampaignError(
            samples.name,
            f"the pose of this row is out of reach for the real robot{more}",
            row=int(samples.rows[row]),
            found=f"{1e3 * miss[row]:.3g} mm are left",
            expected="a pose within the limits, and away from singular ones",
        )
