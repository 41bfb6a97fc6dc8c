"""Covariances that are drawn, and their chances by both engines."""

import numpy as np
import pytest

from thermal_robot import compiling
from thermal_robot.assembly.probability import compiled, failing_probability, joining_probability

needs_loops = pytest.mark.skipif(
    not compiling.loads("thermal_robot.assembly.probability.loops"),
    reason="the loops are in the extra fast: numba is not installed",
)


def drawn(rng, ratio, count):
    """(count, 2, 2) covariances of deviations of 1 by up to ``ratio`` less, turned, in squares of 1e-5 m."""
    angle, narrow = rng.uniform(0.0, np.pi, count), ratio ** -rng.uniform(0.0, 1.0, count)
    axes = np.stack([np.stack([np.cos(angle), -np.sin(angle)], -1), np.stack([np.sin(angle), np.cos(angle)], -1)], -2)
    return 1e-10 * (axes * np.stack([np.ones(count), narrow**2], -1)[:, None, :]) @ axes.transpose(0, 2, 1)


def both(monkeypatch, *case):
    """Return the chances inside and outside, by the loops and without them."""
    found = []
    for many in (1, 10**9):
        monkeypatch.setattr(compiled, "MANY", many)
        found.append((joining_probability(*case), failing_probability(*case)))
    return found
