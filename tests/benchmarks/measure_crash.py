"""Crashes by the physics of the blind trial: how often the joint whose zero moved is named, and a link told from it.

usage: python tests/benchmarks/measure_crash.py SEED ...

Twenty arms of each kind and seed: nine with one zero off, eight with two, three with one or two links as of another
variant; beside them the small errors of every arm. Prints each miss, then the counts.
"""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np

import thermal_robot as tr
from thermal_robot.blind.reality.world import World
from thermal_robot.campaign import Campaign

ARMS = {"builtin:rv_m2": "tool0", "example-robot-data:ur5": "tool0", "example-robot-data:panda": "panda_hand"}
KINDS = ("one zero",) * 9 + ("two zeros",) * 8 + ("another URDF",) * 3
ROWS, NOISE, TURN = 40, 5e-5, 2.4  # m; rad of a joint that may turn once round
ZERO, PLACE = (2e-3, 10e-3), (5e-3, 30e-3)  # rad, m: what the crash moved
ORDINARY_ZERO, ORDINARY_PLACE = 3e-4, 1.5e-4  # rad; m and rad
TARGET = np.array([0.1, -0.03, 0.08])  # m, tool frame: 104 mm off the last axis


def crashed(robot, world, kind, rng):
    """A campaign after the crash, and the joints whose zeros moved."""
    q = rng.uniform(np.maximum(robot.lower, -TURN), np.minimum(robot.upper, TURN), (ROWS, robot.n))
    body, movable = world.sound(ROWS), [k for k, joint in enumerate(world.chain) if joint.movable]
    body.joints += rng.normal(0.0, ORDINARY_ZERO, robot.n)
    body.placements[movable] += ORDINARY_PLACE * rng.normal(size=(robot.n, 6))
    hit = []
    if kind == "another URDF":
        for joint in rng.choice(np.arange(1, robot.n), rng.integers(1, 3), replace=False):
            along = rng.normal(size=3)
            body.placements[movable[joint], :3] += rng.uniform(*PLACE) * along / np.linalg.norm(along)
    else:
        hit = rng.choice(robot.n, 1 if kind == "one zero" else 2, replace=False).tolist()
        body.joints[:, hit] += rng.choice([-1.0, 1.0], len(hit)) * rng.uniform(*ZERO, len(hit))
    at = (world.poses(q, np.zeros(ROWS), body)[0] @ np.append(TARGET, 1.0))[:, :3]
    known = {"base_known": True, "tool_known": True, "target": TARGET, "noise_position": NOISE}
    position = at + NOISE * rng.normal(size=(ROWS, 3))
    return Campaign("crash", robot, q, position, **known), {robot.joint_names[joint] for joint in hit}


def main(*seeds):
    """Print misses as they come, and how many of each kind and arm were right; innocent joints are counted."""
    right, asked = Counter(), Counter()
    for seed in seeds:
        rng = np.random.default_rng(int(seed))
        for name, tool in ARMS.items():
            robot = tr.load_robot(name, tool)
            for kind in KINDS:
                campaign, hit = crashed(robot, World(robot.urdf, tool), kind, rng)
                found = tr.after_crash(campaign)
                named = {one.name for one in found.named if one.kind == "joint"}
                well = named == hit and found.verdict in (("link", "misfit") if kind == "another URDF" else ("zero",))
                asked.update((kind, name))
                right.update((kind, name) * well)
                asked["joints that had not moved, named"] += 1
                right["joints that had not moved, named"] += bool(named - hit)
                if not well:
                    print(f"{seed} {name} {kind} {sorted(hit)}: {found.to_dict()['summary']}", flush=True)
    for what, count in asked.items():
        print(f"{what}: {right[what]} of {count}")


if __name__ == "__main__":
    main(*sys.argv[1:])
