"""Fleets in files, small enough for a test, and processes that are ended while they work on one."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np

import thermal_robot as tr

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


def scattered(rng, robots, mean, spread, deviations):
    """(robots,) values as they would be measured: each robot's own, and the deviation of the measurement."""
    own = rng.normal(mean, spread, robots)
    return own + deviations * rng.normal(size=robots)


def deviations(rng, robots):
    return rng.uniform(0.5, 2.0, robots) * np.ones(robots)
