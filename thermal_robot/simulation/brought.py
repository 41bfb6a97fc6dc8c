"""Closed loops: a robot with effects at work is brought to where a reading says that its target is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import KIND
from thermal_robot.effects import Effect
from thermal_robot.errors import CampaignError
from thermal_robot.inference.exact import corrected_observations
from thermal_robot.observables.socket import Stand
from thermal_robot.observations import Frames, observe
from thermal_robot.robot import Robot

ROUNDS, CLOSED = 40, 1e-11
"""Newton steps at most, and the distance in m at which a loop is closed: rounding of a metre is a thousandth of it."""
LEAST = 1e-3  # share of a Jacobian's largest singular value below which a joint is no way to close a loop
SWAY, BETWEEN = 1.0, 0.05
"""By how much, rad or m, postures at one socket differ at most; m from one socket of a stand to the next."""


def brought(
    plan: Campaign, frames: Frames, effects: Sequence[tuple[Effect, Array]] = (), away: Array | None = None
) -> Campaign:
    """Inverse kinematics by Newton's method: commands with which each row reads what it says.

    Parameters
    ----------
    plan
        Rows near where they are to be.
    frames
        The true frames and artefacts.
    effects
        What is at work, with the (P,) values of each.
    away
        (N, m) by how much each row is to miss what it says, root frame axes, m and rad: play and noise.

    Raises
    ------
    CampaignError
        Rows that the robot cannot bring there.
    """
    for _ in range(ROUNDS):
        seen = corrected_observations(plan, frames, effects)
        left = seen.gap / (seen.sight.size.relative if seen.sight.size else 1.0)
        left = left if away is None else left - away
        if np.abs(left).max() < CLOSED:
            return plan
        slopes = seen.joint_sensitivity[:, : left.shape[1]]
        step = np.linalg.pinv(slopes, rcond=LEAST) @ left[:, :, None]
        plan = replace(plan, q=plan.q + np.clip(step[:, :, 0], -SWAY, SWAY))
    raise CampaignError(plan.name, "the robot does not reach what it is to touch", expected="another place or seed")


def sockets(
    robot: Robot,
    effects: Sequence[tuple[Effect, Array]] = (),
    *,
    stands: int = 3,
    each: int = 2,
    rows: int = 20,
    noise: float = 0.0,
    target: Array | None = None,
    tool: Array | None = None,
    seed: int = 0,
) -> Campaign:
    """Simulate a campaign of sockets: so many stands with so many sockets each, so many postures at every one.

    ``noise`` is one sigma per axis of the play, m; ``target`` (3,) is where the ball truly sits on the tool,
    m, ``tool`` what is declared of it.
    """
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -2.0), np.minimum(robot.upper, 2.0)
    middles = rng.uniform(low + 0.25 * (high - low), high - 0.25 * (high - low), (stands, robot.n))
    q = np.repeat(middles, each * rows, axis=0)
    q = np.clip(q + rng.uniform(-SWAY, SWAY, q.shape), low, high)
    labels = {
        KIND: np.full(len(q), "socket"),
        "stand": np.repeat([f"place {k}" for k in range(stands)], each * rows),
        "socket": np.tile(np.repeat([str(k) for k in range(each)], rows), stands),
    }
    true, told = (np.zeros(3) if own is None else np.asarray(own, dtype=float) for own in (target, tool))
    plan = Campaign("sockets", robot, q, labels=labels, target=told, base_known=True, moves="unknown")
    sits = np.eye(4)
    sits[:3, 3] = true
    held = Campaign("middles", robot, middles, target=true, base_known=True)
    places = observe(held).position
    apart = BETWEEN * np.arange(each)[:, None] * np.array([0.0, 1.0, 0.0])
    artefacts = {
        f"stand place {k}": Stand(tuple(map(str, range(each))), place + apart) for k, place in enumerate(places)
    }
    away = noise * rng.normal(size=(len(q), 3))
    found = brought(plan, Frames(np.eye(4), sits, artefacts), effects, away)
    return replace(found, noise_position=noise or None)
