"""Whole diagnoses, each in a process of its own; the parts of one as shares; and what an import costs."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from benchmarks.bench_diagnosis import CASES, REAL, started
from benchmarks.parts import Part
from benchmarks.timing import by_turns
from simulate import simulate

from thermal_robot import diagnose, load_robot
from thermal_robot.diagnosis.cross_validation import held_out, worst_folds
from thermal_robot.diagnosis.next_measurement import next_samples
from thermal_robot.diagnosis.prune import held_out_tests
from thermal_robot.effects import choose
from thermal_robot.inference.fit import fit
from thermal_robot.inference.generate import candidates, events

SCRIPT = Path(__file__).resolve().parents[1] / "bench_diagnosis.py"
TREE = SCRIPT.parents[2]
RUNS, MOST = 3, 10**6
"""Runs of a case, and the largest size from which on there are so many, and real robots too, a minute or two each."""
AT_WORK = ["backlash", "joint_offset"]
"""In the campaign of which the parts are timed; a tiny run looks at the last one alone."""
IMPORTS = {
    "nothing": "",
    "numpy": "import numpy",
    "thermal_robot": "import thermal_robot",
    "thermal_robot, and `diagnose` loaded": "import thermal_robot; thermal_robot.diagnose",
}
TEXT = (
    "Seconds of the processor and the peak of memory of one diagnosis in a process of its own, the second one "
    "there, but for the real robots, which are diagnosed once. 100 rows are of a UR10. An import is told without "
    "the start of Python. Shares are of a UR10 with 100 rows and two effects.\n\n**Missed.** Asked were 0.15 s "
    "for 100 rows, 0.6 s with an unlisted cause, 4 s for the UR5, 8 s and 0.8 GB for the UR10. Since that was "
    "asked a diagnosis weighs discrepancies of every form and size beside the effects, looks for waves of gears "
    "and refines constants. It chooses among all combinations three times, and once more where something was "
    "taken out; what is taken out again is a query to what was weighed. Tried: neighbours foretold with their "
    "sides, so that a fifth of the exact evidences is left; evidences left early where they stay behind; sizes of"
    " discrepancies begun where they were found last; products in chunks; further choices begun at the exact "
    "model of the last one, which halves their number. What remains is spread over some hundred functions, none "
    "of which by itself takes more than 8 % of 100 rows."
)


def _whole(effort):
    rows = [("diagnosis", "s", "peak of memory, GB")]
    cases = CASES if effort.largest >= MOST else [case for case in CASES if case not in REAL]
    for case in cases if effort.budget > 0.0 else cases[:1]:
        if case in REAL and "THERMAL_ROBOT_DATA" not in os.environ:
            rows.append((case, "the data are not here", ""))
            continue
        runs = RUNS if case not in REAL and effort.largest >= MOST else 1
        told = [[float(v) for v in started([str(SCRIPT), "--measure", case], TREE)[0]] for _ in range(runs)]
        seconds, peak = np.median(told, axis=0)
        rows.append((case, f"{seconds:.3f}", f"{peak:.2f}"))
    return tuple(rows)


def _imports(effort):
    spent = {name: [] for name in IMPORTS}
    for _ in range(2 * effort.turns - 1):
        for name, code in IMPORTS.items():
            spent[name].append(started(["-c", code], TREE)[1])
    start = float(np.median(spent["nothing"]))
    took = {name: float(np.median(seconds)) - start for name, seconds in spent.items() if name != "nothing"}
    rows = [(name, f"{seconds:.3f}", f"{seconds / took['numpy']:.2f}") for name, seconds in took.items()]
    return (("import", "s", "times numpy's"), *rows)


def _shares(effort):
    robot = load_robot("example-robot-data:ur10", "tool0")
    campaign = simulate(robot, AT_WORK, samples=min(100, effort.largest // 4), seed=1)[0]
    only = () if effort.budget > 0.0 else AT_WORK[1:]
    found = fit(campaign, choose(only))
    calls = {
        "whole": lambda: diagnose(campaign, only=only or None),
        "choice and fit": lambda: fit(campaign, choose(only)),
        "scan for laws": lambda: candidates(found, 1, events(found)),
        "effects on rows held out": lambda: held_out_tests(found),
        "held-out figures": lambda: held_out(found),
        "worst ways of holding out": lambda: worst_folds(found),
        "next samples": lambda: next_samples(found),
    }
    times = np.median(by_turns(effort, *calls.values()), axis=0)
    rows = [(name, f"{time:.3f}", f"{time / times[0]:.2f}") for name, time in zip(calls, times, strict=True)]
    return (("part of a diagnosis", "s", "share"), *rows)


def measured(effort, peers):
    """Time diagnoses."""
    return Part("Diagnosis", TEXT, (_whole(effort), _shares(effort), _imports(effort)))
