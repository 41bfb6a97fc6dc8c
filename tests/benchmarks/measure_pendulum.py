"""Servo pendulums of known mass, length and stiffness: what is hidden must be named, and nothing else blamed.

usage: python tests/benchmarks/measure_pendulum.py FOLDER [MASS ...] [--pooled]

FOLDER holds the logs of one servo, a JSON file each (kscalelabs/sysid at ea99facd, data/feetech/…/processed; without a
licence, so no part of this repository); MASS, kg, are those that are asked for, by default all. A campaign is what one
pendulum did in one kind of motion at one stiffness, two repetitions of a command; with ``--pooled`` all kinds together,
whose bad ones the gate should refuse. Of each campaign four questions are asked, by what URDF and servo state:

- *hidden*: the arm without its mass; the payload must be named, and m·l be right within 10 %;
- *wrong mass*: 1.5 times the mass, or two thirds of it; the payload must be named;
- *wrong kp*: 1.5 times the stiffness, or two thirds of it; kp must be named;
- *nothing*: all as it is; neither may be named.

Named is what is told or confounded with what is told; wrong and clear is a payload or a kp that is told for the other,
or for nothing, and confounded with nothing. Delay, lag, inertia, friction and limits are not stated, and may be told.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pandas as pd

import thermal_robot as tr
from thermal_robot.motion import Servo, motion_from_table

ARMS = {0.1: 0.036, 0.15: 0.050}
"""kg of the arm, a rod, by its length, m: of the makers' experiment_configs."""
STIFFNESS, STARTING = 1.01, 0.17
"""N·m/rad of a unit of the firmware's kp, ± 0.03, and N·m of its starting force, ± 0.09: medians of 24 fits to the
sin_sin motions of 0.535 and 0.969 kg with all masses known; the makers' own fits give 0.73 to 1.0,
without the latter."""
CHANGED = 1.5
"""Factor of what is stated wrong; its inverse in every second campaign."""
RIGHT = {"hidden": "payload", "wrong mass": "payload", "wrong kp": "kp", "nothing": ""}
"""What is at work, by question."""
URDF = """<robot name="pendulum"><link name="base"/><link name="tip"/><link name="arm"><inertial>
<origin xyz="0 0 {centre}"/><mass value="{mass}"/>
<inertia ixx="{inertia}" iyy="{inertia}" izz="1e-9" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="servo" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-3.2" upper="3.2" effort="10" velocity="10"/></joint>
<joint name="end" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0 0 {tip}"/></joint></robot>"""
SCRATCH = Path(mkdtemp())


@cache
def pendulum(mass, length):
    """The robot that hangs down at zero, with a point mass at the end of its arm."""
    whole = mass + ARMS[length]
    centre = (mass + 0.5 * ARMS[length]) * length / whole
    inertia = (mass + ARMS[length] / 3.0) * length**2 - whole * centre**2
    path = SCRATCH / f"{mass:.4f}_{length}.urdf"
    path.write_text(URDF.format(mass=whole, centre=-centre, inertia=max(inertia, 1e-9), tip=-length))
    return tr.load_robot(path, "tip")


def campaigns(folder, masses, pooled):
    """Tables of the logs by mass, kg, length, m, the firmware's kp, and kind of motion."""
    found = defaultdict(list)
    for file in sorted(folder.glob("*.json")):
        one = json.loads(file.read_text())
        if masses and one["mass"] not in masses:
            continue
        rows, kind = pd.DataFrame(one["entries"]), one["trajectory"]
        own = {"motion": file.stem, "kind": kind, "time": rows["timestamp"]}
        own |= {"cmd.servo": rows["goal_position"], "q.servo": rows["position"]}
        found[one["mass"], one["length"], one["kp"], "all" if pooled else kind].append(pd.DataFrame(own))
    return found


def asked(key, tables, question, factor):
    """Diagnose a campaign under a question."""
    mass, length, kp, _ = key
    told = {"hidden": 0.0, "wrong mass": factor * mass}.get(question, mass)
    stiffness = STIFFNESS * kp * (factor if question == "wrong kp" else 1.0)
    servos = {"servo": Servo(kp=stiffness, dead_band=-STARTING / stiffness)}
    try:
        return tr.diagnose(motion_from_table(pendulum(told, length), pd.concat(tables), servos=servos))
    except tr.CampaignError:  # no servo moved these
        return None


def marks(found, question, mass):
    """Whether the right effect is named, whether another is told clearly, and m·l over the true one."""
    told = {one.name: set(one.confounded_with) for one in found.effects if one.name in found.verdict}
    named = set(told).union(*told.values())
    clear = {name for name, group in told.items() if not group} & {"payload", "kp"}
    right = RIGHT[question]
    return right in named, bool(clear) and right not in named, found.values.get(("payload", ""), 0.0) / mass


def main(folder, *said):
    """Print an answer a line, then the counts by kind of motion and question."""
    if not Path(folder).is_dir():
        sys.exit(f"{folder}: there is no such folder")
    pooled, counts = "--pooled" in said, defaultdict(list)
    every = campaigns(Path(folder), {float(one) for one in said if one != "--pooled"}, pooled)
    for number, (key, tables) in enumerate(sorted(every.items())):
        for question in RIGHT:
            found = asked(key, tables, question, CHANGED if number % 2 else 1.0 / CHANGED)
            if found is None:
                counts[key[3], question].append((False, False, False))
                print(*key, question, "refused", flush=True)
                continue
            named, wrong, share = marks(found, question, key[0])
            counts[key[3], question].append((named, wrong, question == "hidden" and abs(share - 1.0) <= 0.1))
            answer = f"{'named' if named else '-'} {'WRONG' if wrong else ''} m·l {share:.3f} of the true"
            gap = f"{1e3 * found.held_out.rms_before:.1f} > {1e3 * found.held_out.rms_after:.1f} mrad"
            refused = f"refused {' '.join(found.refused)}" if found.refused else ""
            print(*key, question, answer, "|", *found.verdict, "|", gap, refused, flush=True)
    for (kind, question), own in sorted(counts.items()):
        named, wrong, near = np.mean(own, axis=0)
        more = f", m·l within 10 % {near:.0%}" if question == "hidden" else ""
        print(f"{kind:16}{question:11}of {len(own)}: named {named:.0%}, wrong and clear {wrong:.0%}{more}")


if __name__ == "__main__":
    main(*sys.argv[1:])
