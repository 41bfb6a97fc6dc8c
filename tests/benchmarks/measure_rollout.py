"""Closed loop in MuJoCo: a cause that was told is written into the MJCF, whose own rollout must shrink as was told.

usage: python tests/benchmarks/measure_rollout.py SEED [COUNT]

Drawn worlds of the blind trial of motions, of two to four joints with stated servos; faults that an MJCF holds, in
turn. Seven motions are diagnosed, three are rolled out from their commands alone.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from thermal_robot.blind.motions.fault import EVERYTHING
from thermal_robot.blind.motions.world import Unseen, draw_log, draw_world
from thermal_robot.motion.diagnose import diagnose_motion
from thermal_robot.motion.rollout import rollout
from thermal_robot.motion.write import motion_mjcf

HELD = ("coulomb", "armature", "payload", "delay", "kp", "viscous", "zero", "torque limit", "end stop")
"""Faults that an MJCF holds."""
FITTED = 7
"""Motions of ten that are diagnosed."""


def main(seed, count=12):
    """Print, by world, the fault, what is told, and both shrinkages."""
    kept, agree = [one for one in EVERYTHING if one in HELD], []
    for number in range(int(count)):
        fault, joints = kept[number % len(kept)], 2 + number % 3
        rng = np.random.default_rng([int(seed) + number, EVERYTHING.index(fault), joints])
        world = draw_world(rng, joints, 10)
        try:
            log, _ = draw_log(rng, world, fault, True)
        except Unseen:
            print(fault, joints, "unseen")
            continue
        found = diagnose_motion(replace(log, motions=log.motions[:FITTED]))
        did = rollout(found, motion_mjcf(found, world.mjcf()).text, replace(log, motions=log.motions[FITTED:]))
        agree.append(did.agrees)
        told = f"told {did.shrinkage_told:.3f} rolled out {did.shrinkage:.3f}"
        print(fault, joints, told, "agrees" if did.agrees else "DIFFERS", *found.verdict, flush=True)
    print(f"{sum(agree)} of {len(agree)} agree within a tenth")


if __name__ == "__main__":
    main(*sys.argv[1:])
