"""Covariances that are drawn."""

import numpy as np


def drawn(rng, ratio, count):
    """(count, 2, 2) covariances of deviations of 1 by up to ``ratio`` less, turned, in squares of 1e-5 m."""
    angle, narrow = rng.uniform(0.0, np.pi, count), ratio ** -rng.uniform(0.0, 1.0, count)
    axes = np.stack([np.stack([np.cos(angle), -np.sin(angle)], -1), np.stack([np.sin(angle), np.cos(angle)], -1)], -2)
    return 1e-10 * (axes * np.stack([np.ones(count), narrow**2], -1)[:, None, :]) @ axes.transpose(0, 2, 1)
