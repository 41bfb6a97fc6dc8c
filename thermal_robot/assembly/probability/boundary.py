r"""Probability of a disc as an integral along its edge (Green): a trapezoidal rule that is exact to rounding.

In the principal axes of the normal part, each in its standard deviation, the disc's edge about the mean is
``z(t) = (a1 cos t - b1, a2 sin t - b2)`` with ``a = R / sigma`` and ``b = mean / sigma``. The field

    F(z) = z (1 - exp(-|z|**2 / 2)) / (2 pi |z|**2)        div F = exp(-|z|**2 / 2) / (2 pi)

is entire, so that the sum over ``n`` even angles converges faster than any power: with ``h = |z|**2 / 2`` and
``w = z1 dz2/dt - z2 dz1/dt = a1 a2 - b1 a2 cos t - b2 a1 sin t``

    P = mean of w (1 - exp(-h)) / (2 h)        1 - P = mean of w exp(-h) / (2 h), for a mean within the disc.

The second is a sum of positive terms and keeps its digits however small it is; its poles (``z1 + i z2 = 0``, two
roots in ``exp(it)``) change the sum by a known amount, which is taken out. With a uniform part along a segment,
``z`` turned so that the segment is the first axis and ``A`` its half length there,

    P = integral of phi(v) G(u) dv        G(u) = [I(u + A) - I(u - A)] / (2 A) - 1/2,        I(t) = t Phi(t) + phi(t).
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from thermal_robot.arrays import Array

NODES = np.array([32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024])
"""Numbers of angles that are used; multiples of four."""

# Angles per standard deviation, the shorter one, from the disc's farther edge to the mean, and besides: measured
# against the chords' integral, the absolute error is then below 2e-15 and that of a small 1 - P below 1e-11 of it.
PER_DEVIATION, BESIDES = 8.0, 16.0
NEAR = 0.01  # squared distances (halved) of a node from the mean below which (1 - exp(-h)) / h is taken by its series
SERIES = (-1.0 / 720.0, 1.0 / 120.0, -1.0 / 24.0, 1.0 / 6.0, -0.5, 1.0)
FRACTION = 0.05  # a failing probability above this is one minus the other
_ROOT_2PI = np.sqrt(2.0 * np.pi)


def angles_needed(axes: Array, centre: Array) -> Array:
    """Return how many angles resolve discs with half axes ``(N, 2)`` about ``-centre``, shape ``(N,)``.

    A second axis last: the one with the smaller deviation.
    """
    ratio = axes[:, 1] / axes[:, 0]
    distance = np.hypot(centre[:, 0] * ratio, centre[:, 1])  # in the smaller deviation
    return np.asarray(PER_DEVIATION * (axes[:, 1] + distance) + BESIDES)


def disc_by_edge(axes: Array, centre: Array, count: int, *, central: bool = False) -> tuple[Array, Array, Array]:
    """Probability of discs about the origin, by ``count`` angles on the edge.

    Parameters
    ----------
    axes
        Radius over standard deviation along both principal axes, shape ``(N, 2)``.
    centre
        Mean over standard deviation along them, shape ``(N, 2)``.
    count
        Number of angles, at least `angles_needed`, a multiple of four.
    central
        The means are zero: a quarter of the edge says all.

    Returns
    -------
    inside, outside, rate : Array
        Shape ``(N,)``: ``P``, ``1 - P``, and the derivative of ``P`` to the logarithm of the radius. ``1 - P`` is
        relatively accurate for a mean within the disc.
    """
    angle = (2.0 * np.pi / count) * (np.arange(count // 4 if central else count) + 0.5)
    cosine, sine = np.cos(angle), np.sin(angle)
    area = axes[:, 0] * axes[:, 1]
    first, second = np.multiply.outer(axes[:, 0], cosine), np.multiply.outer(axes[:, 1], sine)
    if not central:
        first -= centre[:, :1]
        second -= centre[:, 1:]
    first *= first
    second *= second
    first += second
    half = first
    half *= 0.5  # h
    if central:
        weight: Array = area[:, None]
    else:
        slopes = np.stack([area, -centre[:, 0] * axes[:, 1], -centre[:, 1] * axes[:, 0]], axis=1)
        weight = slopes @ np.stack([np.ones_like(cosine), cosine, sine])
    decay = np.negative(half, out=second)
    np.exp(decay, out=decay)
    rate = area * np.mean(decay, axis=1)
    close = np.min(half, axis=1) < NEAR
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.divide(weight, half, out=None if np.any(close) else half)
    outer = 0.5 * np.einsum("nk,nk->n", share, decay) / len(angle)
    decay = np.subtract(1.0, decay, out=decay)
    inside = 0.5 * np.einsum("nk,nk->n", share, decay) / len(angle)
    if np.any(close):
        near = np.broadcast_to(weight, half.shape)[close] * _mean_decay(half[close])
        inside[close] = 0.5 * np.mean(near, axis=1)
    outside = 1.0 - inside
    small = np.flatnonzero(outside < FRACTION)
    outside[small] = outer[small] + _poles(axes[small], centre[small], count)
    return inside, outside, rate


def _mean_decay(half: Array) -> Array:
    """``(1 - exp(-h)) / h``, also at zero."""
    near = half < NEAR
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(near, np.polyval(SERIES, half), (1.0 - np.exp(-half)) / half)


def _poles(axes: Array, centre: Array, count: int) -> Array:
    """Return what the poles add to the sum of ``exp(-h)``: one for each root of ``z1 + i z2`` in ``exp(it)``.

    Over the ``n`` roots of -1 the mean of ``z / (z - c)`` is ``1 / (1 + c**n)``.
    """
    lead, low = 0.5 * (axes[:, 0] + axes[:, 1]), 0.5 * (axes[:, 0] - axes[:, 1])
    middle = centre[:, 0] + 1j * centre[:, 1]
    root = np.sqrt(middle * middle - 4.0 * lead * low)
    root = np.where((np.conj(middle) * root).real >= 0.0, root, -root)
    larger = 0.5 * (middle + root)
    total = np.zeros(len(axes))
    with np.errstate(divide="ignore", invalid="ignore"):
        for pole in (larger / lead, np.where(larger == 0.0, 0.0, low / larger)):
            power = pole**count
            total += (power / (1.0 + power)).real
    return total


def segment_by_edge(axes: Array, centre: Array, segment: Array, count: int) -> tuple[Array, Array]:
    """Probability of discs about the origin, the mean uniform on a segment about ``centre``.

    Parameters
    ----------
    axes, centre, count
        As for `disc_by_edge`; ``centre`` is the segment's. Where the segment is longer than one, the angles that a
        centred disc needs are enough.
    segment
        Half of the segment over the standard deviations, shape ``(N, 2)``; not short beside one.

    Returns
    -------
    inside, rate : Array
        ``P``, with an absolute error of rounding, and its derivative to the logarithm of the radius.
    """
    angle = (2.0 * np.pi / count) * (np.arange(count) + 0.5)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    length = np.hypot(segment[:, 0], segment[:, 1])[:, None]
    along = segment / length
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    u = (along * axes) @ circle - np.sum(along * centre, axis=1)[:, None]
    v = (across * axes) @ circle - np.sum(across * centre, axis=1)[:, None]
    step = (across * axes) @ np.stack([-circle[1], circle[0]])
    decay = np.exp(-0.5 * v * v)
    # G is odd: 1/2 less the tail beyond |u|, which vanishes without rounding far out.
    side = np.abs(u)
    near, far = length - side, -length - side
    after, before = ndtr(near), ndtr(far)
    tail = near * after - far * before
    tail += (np.exp(-0.5 * near * near) - np.exp(-0.5 * far * far)) / _ROOT_2PI
    level = np.copysign(0.5 - tail / (2.0 * length), u)
    inside = (_ROOT_2PI / count) * np.einsum("nk,nk,nk->n", decay, level, step)
    density = np.einsum("nk,nk->n", decay, after - before) / (2.0 * length[:, 0])
    return inside, axes[:, 0] * axes[:, 1] * (_ROOT_2PI / count) * density
