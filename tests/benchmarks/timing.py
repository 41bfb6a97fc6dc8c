"""How anything is timed here: by turns, so that all meet the same machine; medians, and the median of the ratios."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Effort:
    """How much time may be spent on a figure."""

    long_enough: float  # seconds that one measurement lasts at least: short calls are made several times
    turns: int  # at most
    budget: float  # seconds after which no further turn begins once there are three
    largest: int  # configurations, covariances, rows or places at most


FEWEST = 3
"""Turns, where so many are allowed: a median of fewer is none."""
SHORT = 0.5
"""Seconds of a first call after which a second one tells how often to call; longer ones are called once anyway."""
FULL = Effort(0.02, 7, 3.0, 10**7)
"""A measurement of 20 ms is long beside the clock; medians of seven are good to some per cent on a shared machine."""
QUICK = Effort(0.01, 3, 0.5, 10**5)
"""A look: three turns, sizes up to a hundred thousand."""
TINY = Effort(0.0, 1, 0.0, 200)
"""For the test of the benchmark's own code."""


def by_turns(effort, *calls):
    """Return (T, C) seconds of C calls in T turns; one call before the first turn is not counted, as it compiles."""
    counts = []
    for call in calls if effort.long_enough else ():
        once = seconds(call)
        # what loads or compiles is timed again to see how long it takes itself
        once = seconds(call) if once < SHORT else once
        counts.append(max(1, int(effort.long_enough / max(once, 1e-9))))
    counts = counts or [1] * len(calls)
    measured, begun = [], time.perf_counter()
    while len(measured) < effort.turns and (len(measured) < FEWEST or time.perf_counter() - begun < effort.budget):
        measured.append([seconds(call, times) for call, times in zip(calls, counts, strict=True)])
    return np.array(measured)


def seconds(call, times=1):
    """Return the mean time of a call."""
    begun = time.perf_counter()
    for _ in range(times):
        call()
    return (time.perf_counter() - begun) / times


def medians(measured):
    """Return the (C,) medians of what was measured by turns, and how often faster than the first each is."""
    return np.median(measured, axis=0), np.median(measured[:, :1] / measured, axis=0)


def exponent(sizes, times):
    """Return p of time ~ size^p by least squares of the logarithms; ``None`` of fewer than three."""
    known = [(n, t) for n, t in zip(sizes, times, strict=True) if t is not None and t > 0.0]
    if len(known) < 3:
        return None
    n, t = np.log(np.array(known, dtype=float)).T
    return float(np.polyfit(n, t, 1)[0])


def busy():
    """Return how many processes have waited for a processor in the last minute, on average."""
    return os.getloadavg()[0]
