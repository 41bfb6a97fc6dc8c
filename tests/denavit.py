"""Campaigns of arms whose zeros are off and whose axes err as Denavit and Hartenberg's parameters do."""

from dataclasses import replace

import numpy as np
from simulate import random_motion, simulate

from thermal_robot.campaign import Campaign
from thermal_robot.effects import Geometric, JointOffset
from thermal_robot.effects.apply import displacement
from thermal_robot.kinematics import exp3, rotation_to_quaternion
from thermal_robot.observations import Frames, observe


def errors_of_axes(robot):
    """Each error of an axis against the one before, as segment and twist (6,) in its own frame.

    By finite motions of the axis in space: along the common normal, about it, across both axes where they are
    parallel, along the axis itself.
    """
    moves = observe(Campaign("axes", robot, np.zeros((1, robot.n)))).chain
    found, before = [], None
    for s, segment in enumerate(robot.segments):
        if not segment.movable:
            continue
        frame, origin = moves.rotations[0, segment.index], moves.positions[0, segment.index]
        axis = frame @ robot.chain.axes[segment.index]
        pairs = [(axis, None, origin)]
        if before is not None:
            first, along = before
            normal, parallel = np.cross(along, axis), np.linalg.norm(np.cross(along, axis)) < 1e-6
            if parallel:
                away = origin - first - along * ((origin - first) @ along)
                normal, foot = away if np.linalg.norm(away) > 1e-9 else np.cross(axis, [0.3, 0.5, 0.8]), origin
            else:
                steps = np.linalg.lstsq(np.column_stack([axis, -along]), first - origin, rcond=None)[0]
                foot = origin + steps[0] * axis
            normal = normal / np.linalg.norm(normal)
            pairs += [(normal, None, origin), (None, normal, foot)]
            pairs += [(None, np.cross(axis, normal), foot)] if parallel else []
        for shift, turn, about in pairs:
            linear = np.cross(turn, origin - about) if shift is None else shift
            found.append((s, np.concatenate([frame.T @ linear, frame.T @ (np.zeros(3) if turn is None else turn)])))
        before = origin, axis
    return found


def off(robot, seed, *, zero=1e-3, size=2e-4, samples=100, noise=25e-6, turning=None):
    """A campaign of such an arm, and its (n,) zeros; rad and m."""
    rng = np.random.default_rng([seed, 7])
    plain = simulate(robot, samples=samples, seed=seed, noise=noise, turning=turning)[0]
    frames = Frames(random_motion(rng, 2.0), random_motion(rng, 0.12))
    nominal = observe(replace(plain, position=np.zeros((samples, 3))), frames)
    zeros, geometry, of = zero * rng.normal(size=robot.n), Geometric(), Geometric().parameters(nominal)
    values = np.zeros(len(of))
    for segment, twist in errors_of_axes(robot):
        own = [k for k, p in enumerate(of) if p.responses[0].index == segment]
        values[own] += size * rng.normal() * twist
    moved, _ = displacement(nominal, [(JointOffset(), zeros), (geometry, values)])
    real = observe(nominal.campaign, frames, displacement=moved)
    position = real.predicted_position + noise * rng.normal(size=(samples, 3))
    target = frames.tool[:3, 3] + rng.uniform(-0.01, 0.01, 3)
    if turning is not None:
        turned = exp3(turning * rng.normal(size=(samples, 3))) @ frames.base[:3, :3] @ real.rotation
        plain = replace(plain, orientation=rotation_to_quaternion(turned))
    return replace(plain, position=position, target=target, priors={}), zeros
