"""Probability of joining and required clearance of many covariances at once, and the whole way from configurations."""

from __future__ import annotations

import numpy as np
from benchmarks.parts import Curve, Part, Plot
from benchmarks.timing import by_turns

from thermal_robot import load_robot
from thermal_robot.assembly.probability import joining_probability, required_clearance
from thermal_robot.kinematics import frame_jacobians

SIZES = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000)
RATIOS = {"typical, axes up to 1 : 10": 10.0, "axes up to 1 : 10 000": 1e4}
SIGMA, CLEARANCE = 1e-5, 1e-4
CHUNK = 20_000
SIGMA_Q = 5e-5
MOST_CLEARANCES = 100_000
TEXT = (
    "Covariances of the deviation in the plane of a hole, drawn with standard deviations about 10 µm and a ratio "
    "of axes up to what is said, a mean of as much, a clearance of 100 µm. `required_clearance` is asked for C_p = "
    "1.33. *The whole way*: Jacobians of a UR5, covariance of the tool's position in a plane from deviations of "
    "the joints, probability, in chunks of {chunk} configurations."
)


def drawn(count, ratio, seed=0):
    """Return (N, 2, 2) covariances of any direction and (N, 2) means, m."""
    chance = np.random.default_rng(seed)
    small = SIGMA * chance.uniform(0.5, 2.0, count)
    axes = np.stack([small, small * ratio ** -chance.uniform(0.0, 1.0, count)], axis=1)
    angle = chance.uniform(0.0, np.pi, count)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    return (turn * (axes**2)[:, None]) @ turn.transpose(0, 2, 1), chance.normal(0.0, SIGMA, (count, 2))


def whole_way(robot, count):
    """Return the mean probability over so many configurations."""
    chance, total = np.random.default_rng(1), 0.0
    out = frame_jacobians(robot, np.zeros((min(count, CHUNK), robot.n)))
    for start in range(0, count, CHUNK):
        rows = min(CHUNK, count - start)
        moves = frame_jacobians(robot, chance.uniform(-2.0, 2.0, (rows, robot.n)), out=out[:rows])[:, :2]
        covariance = SIGMA_Q**2 * (moves @ moves.transpose(0, 2, 1))
        total += float(joining_probability(covariance, 4.0 * CLEARANCE).sum())
    return total / count


def measured(effort, peers):
    """Time probabilities and clearances."""
    sizes = [n for n in SIZES if n <= effort.largest]
    heading = ("N", *(f"joining, {name}, µs each" for name in RATIOS), "required clearance, typical", "the whole way")
    rows, points = [heading], {key: [] for key in heading[1:]}
    robot = load_robot("example-robot-data:ur5", "tool0")
    for n in sizes:
        cases = [drawn(n, ratio) for ratio in RATIOS.values()]
        calls = [lambda c=c, m=m: joining_probability(c, CLEARANCE, m) for c, m in cases]
        if n <= MOST_CLEARANCES:
            calls.append(lambda c=cases[0]: required_clearance(c[0], capability=1.33, mean=c[1]))
        times = dict(zip(heading[1:], np.median(by_turns(effort, *calls), axis=0), strict=False))
        times[heading[4]] = float(np.median(by_turns(effort, lambda n=n: whole_way(robot, n))))
        for name, seconds in times.items():
            points[name].append((n, float(seconds)))
        told = (f"{1e6 * times[name] / n:.2f}" if name in times else "–" for name in heading[1:])
        rows.append((f"{n:,}", *told))
    curves = tuple(Curve(name, *zip(*known, strict=True)) for name, known in points.items() if known)
    text = TEXT.format(chunk=f"{CHUNK:,}")
    plot = Plot("probability", "Probability and clearance", "covariances", curves)
    return Part("Probability and required clearance", text, (tuple(rows),), (plot,))
