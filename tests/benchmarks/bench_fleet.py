"""A fleet of simulated robots with shared and own faults: make it, diagnose it, and say what that costs.

``bench_fleet.py make FOLDER [COUNT] [ROWS]``, then ``bench_fleet.py run FOLDER OUT [WORKERS]``: seconds, seconds of the
processors, and the memory of every process while it runs.
"""

from __future__ import annotations

import resource
import sys
import threading
import time
from pathlib import Path

import numpy as np

import thermal_robot as tr

HALLS, NOISE = 4, 20e-6
WARM, SHIFT, FAULTY = 1.2e-5, 4e-4, 10


def make(folder: Path, count: int, rows: int) -> None:
    """Write campaigns: all arms grow with temperature, those of hall 2 have a joint off, some one with lost motion."""
    robot = tr.load_robot("builtin:rv_m2", "tool0")
    for number in range(count):
        chance = np.random.default_rng([11, number])
        hall = number % HALLS
        effects = {"thermal_elongation": {"upper_arm": chance.normal(WARM, 0.1 * WARM)}}
        if hall == 2:
            effects["joint_offset"] = {"joint_2": chance.normal(SHIFT, 0.1 * SHIFT)}
        if number % FAULTY == 1:
            effects["backlash"] = {f"joint_{chance.integers(2, 5)}": chance.uniform(2e-4, 5e-4)}
        campaign = tr.simulate(robot, effects, rows=rows, noise=NOISE, seed=number)
        tr.write_campaign(campaign, folder / f"hall_{hall}" / f"robot_{number:05d}")


def run(folder: Path, out: Path, workers: int) -> None:
    """Diagnose them, and print what it took."""
    import psutil

    most: dict[int, list[int]] = {}
    stop = threading.Event()

    def watch() -> None:
        while not stop.wait(2.0):
            for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
                try:
                    most.setdefault(process.pid, []).append(process.memory_info().rss >> 20)
                except psutil.Error:
                    pass

    threading.Thread(target=watch, daemon=True).start()
    begun, told = time.perf_counter(), [0]

    def progress(stage: str, done: int, total: int) -> None:
        if stage == "campaigns" and 20 * done // total > told[0]:
            told[0] = 20 * done // total
            print(f"{done} of {total}: {time.perf_counter() - begun:.0f} s", flush=True)

    fleet = tr.diagnose_many(folder, out, labels=["hall", "robot"], workers=workers, progress=progress)
    spent = time.perf_counter() - begun
    stop.set()
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    print(fleet)
    print(f"{spent:.1f} s; processors: {', '.join(f'{u.ru_utime + u.ru_stime:.1f} s' for u in used)} (own, workers)")
    for pid, sizes in most.items():
        tenth = [sizes[min(k * len(sizes) // 10, len(sizes) - 1)] for k in range(10)]
        print(f"process {pid}: MB {' '.join(map(str, [*tenth, sizes[-1]]))}, at most {max(sizes)}")


if __name__ == "__main__":
    command, place, *more = sys.argv[1:]
    if command == "make":
        count, rows = (*map(int, more), *(1000, 100)[len(more) :])
        make(Path(place), count, rows)
    else:
        run(Path(place), Path(more[0]), int(more[1]) if len(more) > 1 else 2)
