"""Probability of a disc beside a normal part much narrower one way: chords along its longer axis (erf), summed across.

With ``x`` along the *narrow* axis, ``x = R cos c`` and the half chord ``R sin c``,

    P = integral of phi((x - m2) / s2) / s2 [Phi((R sin c - m1) / s1) - Phi((-R sin c - m1) / s1)] R sin c dc

over the part of the disc within so many narrow deviations of the mean: there 64 Gauss nodes in ``c`` are exact to
rounding, as long as the chord does not change by many wide deviations (`chords_resolve`). All differences of ``x`` are
products, so that the narrow deviation may be as small as one likes; without any the chord through the mean remains.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from thermal_robot.arrays import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_ROOT_2PI = np.sqrt(2.0 * np.pi)
_REACH = 9.0  # narrow standard deviations either side of the mean: what lies beyond is below 3e-19
_CHANGE = 12.0  # wide standard deviations by which a chord may change for 64 nodes to follow


def _window(narrow: Array, beside: Array) -> tuple[Array, Array, Array, Array]:
    """Angle of the mean, ends of the window about it, and how far the mean lies beyond the edge, over the radius.

    ``narrow`` and ``beside`` are the deviation and the mean's distance (not negative) over the radius. With ``1 - cos
    c = d`` the difference of two angles is ``2 asin`` of a quotient of products.
    """
    inner = np.clip(1.0 - beside, 0.0, 1.0)
    beyond = np.maximum(beside - 1.0, 0.0)
    start = 2.0 * np.arcsin(np.sqrt(0.5 * inner))
    low = -np.minimum(_REACH * narrow, inner)
    high = np.minimum(np.maximum(_REACH * narrow - beyond, 0.0), 2.0 - inner)
    ends = []
    for step in (low, high):
        here, there = 0.5 * inner, np.clip(0.5 * (inner + step), 0.0, 1.0)
        divisor = np.sqrt(there * (1.0 - here)) + np.sqrt(here * (1.0 - there))
        ends.append(2.0 * np.arcsin(np.clip(0.5 * step / np.where(divisor > 0.0, divisor, 1.0), -1.0, 1.0)))
    return start, ends[0], ends[1], beyond


def chords_resolve(axes: Array, centre: Array) -> npt.NDArray[np.bool_]:
    """Whether 64 nodes follow the chords of each disc; arguments as for `disc_by_chords`."""
    narrow = 1.0 / axes[:, 1]
    start, low, high, _ = _window(narrow, np.abs(centre[:, 1]))
    ends = np.sin(start + low), np.sin(start + high)
    top = (start + low < 0.5 * np.pi) & (start + high > 0.5 * np.pi)
    change = np.where(top, 1.0 - np.minimum(*ends), np.abs(ends[1] - ends[0]))
    return np.asarray(axes[:, 0] * change <= _CHANGE)


def disc_by_chords(axes: Array, centre: Array) -> tuple[Array, Array, Array]:
    """Probability of discs about the origin.

    Parameters
    ----------
    axes
        Radius over standard deviation along the wide and the narrow axis, shape ``(N, 2)``; the second may be ``inf``.
    centre
        Mean over standard deviation along the wide axis, over the *radius* along the narrow one, shape ``(N, 2)``.

    Returns
    -------
    inside, outside, rate : Array
        Shape ``(N,)``: ``P``, ``1 - P``, and the derivative of ``P`` to the logarithm of the radius. Absolute errors of
        rounding, relative ones of ``1 - P`` below 1e-11 where it exceeds 1e-7.
    """
    narrow, beside = 1.0 / axes[:, 1], np.abs(centre[:, 1])
    start, low, high, beyond = (v[:, None] for v in _window(narrow, beside))
    step = 0.5 * (high + low) + 0.5 * (high - low) * _NODES
    chord = np.sin(start + step)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        away = (2.0 * np.sin(start + 0.5 * step) * np.sin(0.5 * step) + beyond) / narrow[:, None]
        share = np.exp(-0.5 * away * away) * _WEIGHTS
        share *= 0.5 * (high - low) / (narrow[:, None] * _ROOT_2PI)
        weight = share * chord
        ends = ndtr((beside - 1.0) / narrow) + ndtr((-beside - 1.0) / narrow)
    point = narrow == 0.0
    weight[point] = np.where(beside[point] <= 1.0, 1.0 / len(_NODES), 0.0)[:, None]
    ends[point] = beside[point] > 1.0
    near, far = (axes[:, :1] * chord + sign * centre[:, :1] for sign in (-1.0, 1.0))
    missed = np.einsum("nk,nk->n", weight, ndtr(-near) + ndtr(-far))
    edge = (np.exp(-0.5 * near * near) + np.exp(-0.5 * far * far)) * (axes[:, :1] / _ROOT_2PI)
    share[point] = weight[point] / np.where(chord[point] > 0.0, chord[point], 1.0)
    return np.sum(weight, axis=1) - missed, missed + ends, np.einsum("nk,nk->n", share, edge)
