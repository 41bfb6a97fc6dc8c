"""Waves of a joint's own position, of any order: a periodogram of a remainder, seen from that joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal_robot.arrays import Array
from thermal_robot.campaign.settings import STILL
from thermal_robot.campaign.turning import moves
from thermal_robot.inference import settings
from thermal_robot.inference.target import Seat


def orders(q: Array, slides: bool = False) -> Array:
    """Return the (K,) orders that are looked at in a joint, rad per rad, or rad/m where it slides.

    They stand an eighth of a peak's width apart, and end where the positions (N,) could no longer tell an order from
    its alias: positions on a lattice of spacing d know no order above π/d (Shannon). A joint of very many turns is
    looked at up to :data:`settings.MOST_ORDERS` of them.
    """
    if not moves(q):
        return np.zeros(0)
    reach = float(np.ptp(q))
    lowest = np.pi / reach if slides else settings.LOWEST_ORDER
    highest = 2.0 * np.pi / settings.SHORTEST_PERIOD if slides else settings.HIGHEST_ORDER
    step = settings.ORDER_STEP * 2.0 * np.pi / reach
    return np.arange(lowest, min(highest, _nyquist(q), lowest + settings.MOST_ORDERS * step), step)


def independent(grid: Array) -> float:
    """Return how many of the orders of :func:`orders` are independent: one for each width of a peak (Baluev 2008)."""
    return max(len(grid) * settings.ORDER_STEP, 1.0) if len(grid) else 0.0


def periodogram(seat: Seat, q: Array, at: Array) -> Array:
    """(K,) log evidence that a wave of each order gains: 1, sin kq and cos kq by least squares.

    The least-squares periodogram with a floating mean (Zechmeister and Kuerster, *The generalised Lomb-Scargle
    periodogram*, 2009), of many equations a row, the design projected out. Positions q (N,), rad or m; orders in equal
    steps (K,). Gains are those of :meth:`~thermal_robot.inference.target.Seat.gains`; orders that the design can do, or
    whose sine and cosine the positions cannot tell apart, gain −∞.
    """
    found = [_chunk(seat, q, at[k : k + settings.ORDER_CHUNK]) for k in range(0, len(at), settings.ORDER_CHUNK)]
    return np.concatenate([*found, np.zeros(0)])


def peak(seat: Seat, q: Array, grid: Array) -> float:
    """Return the order that gains most, refined from the grid (K,) of at least one order to its peak."""
    best = float(grid[np.argmax(periodogram(seat, q, grid))])
    step = settings.ORDER_STEP * 2.0 * np.pi / float(np.ptp(q))
    for _ in range(settings.ORDER_ZOOMS):
        near = best + step * np.linspace(-1.0, 1.0, 17)
        best, step = float(near[np.argmax(periodogram(seat, q, near))]), step / 8
    return best


def _chunk(seat: Seat, q: Array, at: Array) -> Array:
    weight, design, remainder = seat.weight[:, 0, 0], seat.design[:, 0], seat.remainder[:, 0]
    # equal steps: e^(i k q) of the first, times powers of one step
    wave = _waves(q, at)
    both = np.concatenate([wave.real, wave.imag], axis=1)
    count = len(at)
    inside = design @ both
    twice = weight @ wave**2
    whole = float(weight.sum())
    squares = 0.5 * np.concatenate([whole + twice.real, whole - twice.real]) - np.einsum("rk,rk->k", inside, inside)
    cross = 0.5 * twice.imag - np.einsum("rk,rk->k", inside[:, :count], inside[:, count:])
    values = remainder @ both
    constant = design.sum(axis=1)
    left = whole - float(constant @ constant)
    explained, rank = 0.0, 2.0
    if left > settings.ALIAS * whole:
        shared = weight @ both - constant @ inside
        mean = float(remainder.sum()) / left
        values = values - shared * mean
        squares = squares - shared**2 / left
        cross = cross - shared[:count] * shared[count:] / left
        explained, rank = mean**2 * left, 3.0
    first, second = np.split(squares, 2)
    apart = first * second - cross**2
    seen = (np.minimum(first, second) > settings.ALIAS * whole) & (apart > settings.LAW_FLOOR * first * second)
    a, b = np.split(values, 2)
    part = (second * a**2 - 2.0 * cross * a * b + first * b**2) / np.where(seen, apart, 1.0)
    rest = np.maximum(seat.total - explained - part, settings.TINY)
    gain = 0.5 * seat.freedom * np.log(seat.total / rest) - 0.5 * rank * np.log(seat.freedom)
    return np.where(seen & (seat.freedom - rank >= settings.FEWEST_LEFT), gain, -np.inf)


def _waves(q: Array, at: Array) -> NDArray[np.complex128]:
    """(N, K) e^(i k q) of orders in equal steps: a table of roots, multiplied."""
    fine = int(np.ceil(np.sqrt(len(at))))
    step = at[1] - at[0] if len(at) > 1 else 0.0
    small = np.exp(1j * np.outer(q, step * np.arange(fine)))
    large = np.exp(1j * np.outer(q, at[::fine]))
    return np.asarray((large[:, :, None] * small[:, None, :]).reshape(len(q), -1)[:, : len(at)])


def _nyquist(q: Array) -> float:
    """Return the order above which positions on a lattice repeat themselves; infinite where they lie on none."""
    levels = np.unique(q)
    gaps = np.diff(levels)
    gaps = gaps[gaps > STILL]
    if not len(gaps):
        return np.inf
    spacing = float(levels[-1] - levels[0]) / float(np.round(gaps / gaps.min()).sum())
    steps = (levels - levels[0]) / spacing
    return np.pi / spacing if np.abs(steps - np.round(steps)).max() < settings.LATTICE else np.inf
