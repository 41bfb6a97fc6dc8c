"""Fleets in files, small enough for a test, and processes that are ended while they work on one."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

import thermal_robot as tr
from thermal_robot.fleet.many import limited
from thermal_robot.fleet.rows import write_rows

ROWS, NOISE = 40, 20e-6
ONLY = ("backlash", "joint_offset")
"""Effects that are looked for where a test need not wait for all."""


def write_robot(robot, folder: Path, effects=None, seed=0, rows=ROWS):
    """Write the campaign of one robot; return its folder."""
    campaign = tr.simulate(robot, effects or {}, rows=rows, noise=NOISE, seed=seed)
    return tr.write_campaign(campaign, folder).parent


def write_fleet(robot, root: Path, count: int):
    """Write a small fleet: every third robot has lost motion in a joint."""
    for k in range(count):
        effects = {"backlash": {"joint_2": 4e-4}} if k % 3 == 0 else {}
        write_robot(robot, root / f"hall_{k % 2}" / f"arm_{k:02d}", effects, seed=k)
    return root


def square(number, slow, deadly=()):
    """Work that takes a while, and ends its own process for some numbers."""
    time.sleep(slow)
    if number in deadly:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def square_in_time(number, slow, limit):
    """The same, in a process that ends where it takes longer than the limit."""
    with limited(limit):
        return square(number, slow if number == 3 else 0.0)


def samples_kept():
    """How many samples Dask has kept of where this process was: what makes it grow, task after task."""
    from distributed import get_worker

    time.sleep(0.5)
    worker = get_worker()
    return len(worker.profile_history) + len(worker.profile_recent["children"])


def threads():
    """How many threads this process multiplies matrices with, as a set of what its libraries say."""
    np.ones((2, 2)) @ np.ones((2, 2))
    return {pool["num_threads"] for pool in threadpool_info()}


def told_rows(name, labels, effects, gap=1e-4, outcome="diagnosed", reason=""):
    """Rows as a campaign's diagnosis would give: effects by name with (found, places, {parameter: (value, std)})."""
    campaign = {"campaign": name, **labels, "model": "arm", "outcome": outcome, "reason": reason, "rms_before": gap}
    campaign |= {"rms_after": 2e-5, "unexplained": False}
    if not effects:
        return [campaign]
    rows = []
    for effect, (found, place, values) in effects.items():
        free = [{"name": p, "value": float(v), "std": float(s), "unit": "rad"} for p, (v, s) in values.items()]
        row = {**campaign, "effect": effect, "status": "found" if found else "not_found"}
        row |= {"probability": 0.99 if found else 0.01, "shrinkage": 0.9 if found else 0.0, "free": free}
        row["places"] = [{"kind": "joint", "name": place, "share": 0.9}] if found else []
        rows.append(row)
    return rows


def write_told(path, campaigns, labels=("hall",)):
    """Write a table of such rows."""
    write_rows(path, labels, (row for rows in campaigns for row in rows))
    return path
