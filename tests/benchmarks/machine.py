"""The machine that figures are from, what it can do at most, and the versions of everything that was timed."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from benchmarks.timing import busy, by_turns
from threadpoolctl import threadpool_limits

LIBRARIES = ("thermal-robot", "pin", "numpy", "scipy", "numba", "pandas")
WRITTEN = 20_000_000
"""Numbers that are written to see how fast the memory is: 160 MB, more than any cache holds."""
SIDE = 800
"""Of the matrices that are multiplied to see how fast a core is."""


def described(effort):
    """Return the machine's state as words by name."""
    size = min(WRITTEN, 1000 * effort.largest)
    side = min(SIDE, effort.largest)
    array, matrix = np.empty(size), np.random.default_rng(0).normal(size=(side, side))
    with threadpool_limits(1):
        fill, product = np.median(by_turns(effort, lambda: array.fill(1.0), lambda: matrix @ matrix), axis=0)
    return {
        "processor": _processor(),
        "cores that this process may use": str(len(os.sched_getaffinity(0))),
        "memory written by one thread": f"{8e-9 * size / fill:.1f} GB/s",
        "products of matrices on one core": f"{2e-9 * side**3 / product:.0f} GFLOP/s",
        "processes that waited at the start": f"{busy():.1f}",
        "system": f"{platform.system()} {platform.release().split('-')[0]}, Python {platform.python_version()}",
        "versions": ", ".join(f"{name} {_version(name)}" for name in LIBRARIES),
    }


def _processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def _version(name):
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
