"""Closed loops: a robot with effects at work is brought to where a reading says that its target is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.names import KIND
from thermal_robot.effects import Effect
from thermal_robot.errors import CampaignError
from thermal_robot.inference.exact import corrected_observations
from thermal_robot.observables.plane import Plane
from thermal_robot.observables.socket import Stand
from thermal_robot.observations import Frames, observe

ROUNDS, STARTS, CLOSED = 40, 6, 1e-11
"""Newton steps at most; how often a row is begun nearer, by half the way; and the distance in m at which a loop is
closed: rounding of a metre is a thousandth of it."""
LEAST = 1e-3  # share of a Jacobian's largest singular value below which a joint is no way to close a loop
SWAY, BETWEEN, NEARBY, LED = 1.0, 0.05, 0.1, 2.0
"""By how much, rad or m, postures at one socket differ at most; m from one socket of a stand to the next, and by how
much, rad or m, each joint turns towards it; rad at most to which a joint is led."""


def closed(
    plan: Campaign,
    frames: Frames,
    effects: Sequence[tuple[Effect, Array]] = (),
    away: Array | None = None,
    near: Array | None = None,
) -> tuple[Campaign, NDArray[np.bool_]]:
    """Inverse kinematics by Newton's method within the limits: commands with which each row reads what it says.

    Parameters
    ----------
    plan
        Rows near where they are to be.
    frames
        The true frames and artefacts.
    effects
        Effects at work, with the (P,) values of each.
    away
        (N, m) gap that each row is to keep, root frame axes, m and rad: play and noise; none by default.
    near
        (N, n) postures that are nearer to it, from which rows begin that are not reached otherwise.

    Returns
    -------
    tuple
        The commands, and (N,) the rows in which the robot reaches what they say.
    """
    begun, reached = plan.q, np.zeros(plan.samples, dtype=bool)
    for start in range(STARTS if near is not None else 1):
        if start and near is not None:  # what is not reached is begun nearer
            begun = 0.5 * (begun + near)
            plan = replace(plan, q=np.where(reached[:, None], plan.q, begun))
        for number in range(ROUNDS + 1):
            seen = corrected_observations(plan, frames, effects)
            left = seen.gap / (seen.sight.size.relative if seen.sight.size else 1.0)
            left = np.nan_to_num(left if away is None else left - away, nan=1.0)
            reached = np.abs(left).max(axis=1) < CLOSED
            if reached.all():
                return plan, reached
            if number < ROUNDS:  # each step is looked at, the last one, too
                slopes = seen.joint_sensitivity[:, : left.shape[1]]
                step = np.linalg.pinv(slopes, rcond=LEAST) @ left[:, :, None]
                low, high = plan.robot.lower, plan.robot.upper
                plan = replace(plan, q=np.clip(plan.q + np.clip(step[:, :, 0], -SWAY, SWAY), low, high))
    return plan, reached


def brought(plan: Campaign, *given: Any) -> Campaign:
    """Return :func:`closed` rows; :class:`CampaignError` where the robot does not reach what one of them says."""
    found, reached = closed(plan, *given)
    if not reached.all():
        raise CampaignError(plan.name, "the robot does not reach what it is to touch", expected="another place or seed")
    return found


STANDS, SOCKETS, PLANES, ANCHORS, CAMERAS = 3, 2, 3, 4, 2
"""Of a campaign that is simulated: the fewest of which one can be held out; as printed; a corner; the fewest that see
every direction twice; the fewest that see a point's place."""
ABOUT = 1.2  # of the extent of the places: how far from their middle a draw wire or a camera stands
LENS = {"fx": 1000.0, "fy": 1000.0, "cx": 640.0, "cy": 512.0, "mount": "room"}  # pixels: an industrial camera


def touched(
    kind: str,
    plan: Campaign,
    frames: Frames,
    effects: Sequence[tuple[Effect, Array]],
    noise: float,
    rng: np.random.Generator,
) -> Campaign:
    """Simulate a robot that is led into sockets, or onto planes, from the postures of a plan, by inverse kinematics.

    ``noise`` is the standard deviation of the play, per axis in sockets, across planes, m.
    """
    labels, artefacts, q, near = _stands(plan, rng) if kind == "socket" else _planes(plan, frames)
    labels = {**plan.labels, KIND: np.full(plan.samples, kind), **labels}
    rows = replace(plan, q=q, labels=labels, base_known=True, moves="unknown", orientation=None)
    away = noise * rng.normal(size=(plan.samples, 3))
    if kind == "plane":  # play across a plane shows nothing
        normals = np.array([artefacts[f"plane {own}"].normal for own in labels["plane"]])
        away = normals * (away * normals).sum(axis=1, keepdims=True)
    true = Frames(np.eye(4), frames.tool, artefacts)
    return replace(brought(rows, true, effects, away, near), noise_position=noise or None)


def _stands(plan: Campaign, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any], Array, Array]:
    """Draw stands with sockets; returns labels, stands by name, start postures (N, n), and nearer ones (N, n)."""
    robot, each = plan.robot, -(-plan.samples // (STANDS * SOCKETS))
    low, high = np.maximum(robot.lower, -LED), np.minimum(robot.upper, LED)
    middles = rng.uniform(low + 0.25 * (high - low), high - 0.25 * (high - low), (STANDS, robot.n))
    stand = (np.arange(plan.samples) // (SOCKETS * each)).clip(max=STANDS - 1)
    socket = np.arange(plan.samples) // each % SOCKETS
    q = np.clip(middles[stand] + rng.uniform(-SWAY, SWAY, plan.q.shape), low, high)
    # the further sockets lie on the chord to where a posture nearby leads, so that the robot reaches them
    nearby = np.clip(middles + rng.choice([-NEARBY, NEARBY], middles.shape), low, high)
    ends = Campaign("middles", robot, np.concatenate([middles, nearby]), target=plan.target, base_known=True)
    first, further = np.split(observe(ends).position, 2)
    chord = BETWEEN * (further - first) / np.linalg.norm(further - first, axis=1, keepdims=True)
    places = first[:, None] + np.arange(SOCKETS)[:, None] * chord[:, None]
    sockets = tuple(str(k) for k in range(SOCKETS))
    artefacts = {f"stand place {k}": Stand(sockets, place) for k, place in enumerate(places)}
    labels = {"stand": np.char.add("place ", stand.astype(str)), "socket": socket.astype(str)}
    return labels, artefacts, q, middles[stand]


def _planes(plan: Campaign, frames: Frames) -> tuple[dict[str, Any], dict[str, Any], Array, Array]:
    """Put three orthogonal planes through the median place; returns labels, planes, and postures as :func:`_stands`."""
    places = observe(plan, frames).position
    middle = np.median(places, axis=0)
    number = np.arange(plan.samples) % PLANES
    planes = {f"plane {k}": Plane(normal, float(normal @ middle)) for k, normal in enumerate(np.eye(PLANES))}
    return {"plane": number.astype(str)}, planes, plan.q, plan.q[np.abs(places - middle).argmin(axis=0)[number]]


def as_kind(kind: str, campaign: Campaign) -> Campaign:
    """Convert measured positions to distances from anchors or pixels of cameras, or poses to those of a controller.

    Rows of any other kind are returned as they are.
    """
    if kind == "controller":
        labels = {**campaign.labels, KIND: np.full(campaign.samples, kind)}
        return replace(campaign, labels=labels, base_known=True, tool_known=True)
    if kind not in ("distance", "pixel"):
        return campaign
    points, number = np.asarray(campaign.position), np.arange(campaign.samples)
    if kind == "pixel":
        return _filmed(campaign, points, number % CAMERAS)
    number %= ANCHORS
    corners = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
    anchors = points.mean(axis=0) + ABOUT * np.ptp(points, axis=0).max() * corners / np.sqrt(3.0)
    read = {"distance": np.linalg.norm(points - anchors[number], axis=1)}
    labels = {**campaign.labels, KIND: np.full(campaign.samples, kind), "anchor": number.astype(str)}
    return replace(campaign, position=None, readings=read, labels=labels, base_known=True)


def _filmed(campaign: Campaign, points: Array, number: NDArray[np.int64]) -> Campaign:
    """Convert points (N, 3), m, to pixels u, v by perspective projection in the cameras of these numbers (N,)."""
    away = ABOUT * np.ptp(points, axis=0).max()
    # each looks along a horizontal axis of the measurement frame, the image's y down
    axes = np.array(
        [[[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]]
    )
    inside = np.einsum("nji,nj->ni", axes[number], points - points.mean(axis=0)) + np.array([0.0, 0.0, away])
    u, v = (LENS[f] * inside[:, k] / inside[:, 2] + LENS[c] for k, (f, c) in enumerate((("fx", "cx"), ("fy", "cy"))))
    labels = {**campaign.labels, KIND: np.full(campaign.samples, "pixel"), "camera": number.astype(str)}
    facts = {**campaign.facts, "camera": {str(k): LENS for k in range(CAMERAS)}}
    return replace(campaign, position=None, readings={"u": u, "v": v}, labels=labels, facts=facts, base_known=True)
