"""The same motions kept back from MuJoCo's system identification and from a diagnosis: what stays of each joint's gap.

usage: python tests/benchmarks/measure_sysid.py MOTION.toml PYTHON

Every third motion is kept back. PYTHON is that of an environment with ``mujoco[sysid]``; it fits four numbers of each
joint, which its user chose. The diagnosis is told nothing; motions that it refuses are fitted by the other alone.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

import thermal_robot as tr
from thermal_robot.motion.faults import find_faults
from thermal_robot.motion.fit import fit
from thermal_robot.motion.model import ServoModel

EACH = 3
"""Of so many motions one is kept back."""


def exported(log, held):
    """Write robot and log for the other program; return the paths."""
    found = {"joints": np.array(log.joints), "motions": np.array(len(log.motions)), "held": held}
    for k, motion in enumerate(log.motions):
        found |= {f"t.{k}": motion.command.time, f"u.{k}": motion.command.values}
        found |= {f"s.{k}": motion.position.time, f"q.{k}": motion.position.values}
    folder = Path(mkdtemp())
    (folder / "robot.urdf").write_text(log.robot.urdf)
    np.savez(folder / "log.npz", **found)
    return str(folder / "robot.urdf"), str(folder / "log.npz")


def ours(log, held):
    """Diagnose the motions that are not held; return the diagnosis and each joint's rms in the others, rad."""
    names = {log.motions[k].name for k in held}
    found = tr.diagnose(replace(log, motions=tuple(m for m in log.motions if m.name not in names)))
    sound = find_faults(log)
    kept = tuple(m for m in sound.log.motions if (m.kind or m.name) not in found.refused)
    model = ServoModel(replace(sound.log.with_joints(sound.joints), motions=kept))
    active = np.array([key in found.values for key in model.keys])
    begun = np.array([found.values.get(key, 0.0) for key in model.keys])
    begun = np.where(active & model.of_effects(("contact", "low_stop", "high_stop")), model.start(), begun)
    out = np.array([m.name in names for m in kept])
    model.refreshed(begun)
    values = fit(model, begun, active, ~out)
    model.refreshed(values)
    values = fit(model, values, active, ~out)
    model.refreshed(values)  # a plane presses as these servos let it
    left = [one[out[model.motion_of(j)]] for j, one in enumerate(model.all_residuals(values))]
    return found, [float(np.sqrt(np.mean(one**2))) for one in left]


def main(path, python):
    """Print a line of each joint's rms, mrad, for the command and both programs."""
    log = tr.read_motion(path)
    held = np.arange(len(log.motions))[EACH - 1 :: EACH]
    found, left = ours(log, held)
    print(found, flush=True)
    script = Path(__file__).parent / "peers" / "mujoco_identifies.py"
    call = [python, str(script), *exported(log, held)]
    told = json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout.splitlines()[-1])
    for name, each in (("start", told["before"]), ("MuJoCo sysid", told["held"]), ("diagnosis", left)):
        print(f"{name:14}" + "".join(f"{1e3 * one:8.2f}" for one in each))
    values = told["parameters"]
    print(f"MuJoCo {told['version']}, {told['seconds']:.0f} s;", *(f"{k} {v:.3g}" for k, v in values.items()))


if __name__ == "__main__":
    main(*sys.argv[1:])
