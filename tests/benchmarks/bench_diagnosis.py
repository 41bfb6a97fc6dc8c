"""Time of a whole diagnosis, and of ``import thermal_robot``, beside another state of the program; start as a script.

usage: python tests/benchmarks/bench_diagnosis.py [--old FOLDER] [--repeats N] [--only CASE ...]

Every case runs in a process of its own, the two states by turns, so that both meet the same machine. Told are medians
of the processor's seconds, which other work on the machine lengthens less than those of the clock, and the peak of
memory. The real robots need ``THERMAL_ROBOT_DATA``; they are diagnosed once in a process, the others once before.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve()
REAL = {
    "real UR5, 1000 rows": "ur5_jacobi",
    "real UR10, 2800 rows": "ipa_ur10_c",
    "real UR10, 12000 rows": "ipa_ur10_a",
}
CASES = ("demo", "100 rows, no effect", "100 rows, one effect", "100 rows, unlisted", *REAL)


def unlisted(campaign):
    """Add to a sound campaign a turn of the second joint that no effect follows: by the first, with sharp edges."""
    from thermal_robot import diagnose

    seen = diagnose(campaign, only="joint_offset").fit.nominal
    turn = 1.5e-4 * np.tanh(4.0 * np.sin(2.0 * campaign.q[:, 0])) * (1.0 + 0.4 * campaign.q[:, 2])
    moved = seen.joint_sensitivity[:, :3, 1] * turn[:, None]
    return replace(campaign, position=campaign.position + moved @ seen.frames.base[:3, :3].T)


def campaign_of(case):
    """Return the campaign of a case."""
    from thermal_robot import demo_campaign, load_robot, read_campaign

    if case in REAL:
        return read_campaign(Path(os.environ["THERMAL_ROBOT_DATA"]) / REAL[case])
    if case == "demo":
        return demo_campaign()
    sys.path.insert(0, str(HERE.parents[1]))
    from simulate import simulate

    robot = load_robot("example-robot-data:ur10", "tool0")
    effects = ["backlash"] if case.endswith("one effect") else []
    campaign = simulate(robot, effects, samples=100, seed=3)[0]
    return unlisted(campaign) if case.endswith("unlisted") else campaign


def measured(case):
    """Print the processor's seconds of one diagnosis, and the peak of memory in GB."""
    from thermal_robot import diagnose

    campaign = campaign_of(case)
    if case not in REAL:
        diagnose(campaign)
    begun = time.process_time()
    diagnose(campaign)
    print(time.process_time() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6)


def started(arguments, tree):
    """Return what a process of this Python prints, with the program of a folder; and the processor's seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    done = subprocess.run(
        [sys.executable, *arguments], env=environment, cwd=tree, capture_output=True, text=True, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout.split(), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def imports(trees, repeats):
    """Print how long an import takes, against that of NumPy; the start of Python is taken out of both."""
    codes = {"nothing": "", "numpy": "import numpy", "thermal_robot": "import thermal_robot"}
    for name, tree in trees.items():
        spent = {k: [started(["-c", c], tree)[1] for _ in range(2 * repeats + 1)] for k, c in codes.items()}
        own, beside = (float(np.median(spent[k]) - np.median(spent["nothing"])) for k in ("thermal_robot", "numpy"))
        print(f"import, {name:8s}{own:8.3f} s{own / beside:8.2f} of numpy's", flush=True)


def main():
    """Print a line a case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--old", type=Path, help="folder of another state of the program")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", nargs="+", default=CASES, choices=CASES)
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        measured(options.measure)
        return
    trees = {"new": HERE.parents[2], **({"old": options.old.resolve()} if options.old else {})}
    imports(trees, options.repeats)
    for case in options.only:
        if case in REAL and "THERMAL_ROBOT_DATA" not in os.environ:
            print(f"{case:26s}left out: THERMAL_ROBOT_DATA is not set")
            continue
        found = {name: [] for name in trees}
        for _ in range(1 if case in REAL else options.repeats):
            for name, tree in trees.items():
                out, _ = started([str(HERE), "--measure", case], tree)
                found[name].append([float(v) for v in out])
        middle = {name: np.median(own, axis=0) for name, own in found.items()}
        line = "".join(f"{name:>6s}{seconds:9.3f} s{peak:6.2f} GB" for name, (seconds, peak) in middle.items())
        ratio = f"   old/new {middle['old'][0] / middle['new'][0]:.2f}" if options.old else ""
        print(f"{case:26s}{line}{ratio}", flush=True)


if __name__ == "__main__":
    main()
