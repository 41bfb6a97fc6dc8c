"""Faults of a log's stamps: jitter, clocks of different rates, stamps that are shifted between two channels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.stats import siegelslopes

from thermal_robot.arrays import Array
from thermal_robot.motion.following import Correlation, Moves, slope
from thermal_robot.motion.log import CHANNELS, Channel, Motion, MotionLog
from thermal_robot.motion.settings import CLEAR, CLUSTERS, FAR, FOLLOWS, OUTLIER, PIECE, QUARTERS, RATES, STRIDE

_COARSE = 0.4  # of STRIDE: step of the grid on which rates are searched
_MOST = 8  # motions that tell a rate roughly
_SPAN = 120.0  # s of each that are looked at: enough for a rate to 0.001
_NEAR = 2.0  # s that clocks may differ by at their beginning
_SIGMA = 1.4826  # standard deviation over median absolute deviation of a normal law


def reclocked(motion: Motion, clock: Callable[[Array], Array]) -> Motion:
    """Return a motion with the stamps of all channels but the command mapped by the function ``clock``."""
    return motion.with_channels(CHANNELS[1:], lambda channel: Channel(clock(channel.time), channel.values))


def two_clocks(log: MotionLog) -> bool:
    """Whether commands and encoder readings have different stamps in any motion."""
    return any(not np.array_equal(each.command.time, each.position.time) for each in log.motions)


def jitter(log: MotionLog) -> tuple[float, float, float]:
    """Return the robust scatter of the encoder's steps over their median, and the share of it that the readings follow.

    Second differences of q follow those of the stamps times the velocity where the stamps are right, and do not where
    the samples are even and only their stamps late; the share is their slope, with its standard error.
    """
    spread, squares, products = [], [], []
    for motion in log.motions:
        t, q = motion.position.time, motion.position.values
        steps = np.diff(t)
        usual = np.median(steps)
        spread.append(_SIGMA * np.median(np.abs(steps - usual)) / usual)
        speed = (q[4:] - q[:-4]) / (t[4:] - t[:-4])[:, None]
        even = (np.abs(steps / usual - 1.0) < 0.5).astype(float)
        whole = (even[:-3] * even[1:-2] * even[2:-1] * even[3:])[:, None] > 0.0
        x = np.where(whole, speed * (steps[2:-1] - steps[1:-2])[:, None], np.nan)
        y = q[3:-1] - 2.0 * q[2:-2] + q[1:-3]
        squares.append([np.nansum(x * x)])
        products.append([np.nansum(x * y)])
    felt, error = slope(np.array(squares), np.array(products))
    return float(np.median(spread)), float(felt[0]), float(error[0])


def evened(motion: Motion) -> Motion:
    """Return a motion with its readings' stamps on a line fitted over sample number; missing rows leave their gap."""
    t = motion.position.time
    number = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(np.diff(t) / np.median(np.diff(t))), 1.0))])
    line = np.polynomial.Polynomial.fit(number, t, 1)
    return reclocked(motion, lambda stamps: stamps + np.interp(stamps, t, line(number) - t))


def rate(log: MotionLog) -> tuple[float, float]:
    """Estimate the command clock's rate over the readings' and its standard error: regression of the lag on time.

    A grid of rates finds where the moves are most alike; then the lags of pieces of ten seconds are fitted by a line in
    each motion with a common slope. The standard error is that of the scatter between motions or, in few, between
    pieces; and a servo's own lag may change by :data:`STRIDE` within a motion that grows faster, such as a chirp.
    """
    drift, error, far = _drift(log.motions)
    found = _searched(log) if far else 1.0
    for _ in range(3):
        drift, error, _ = _drift([reclocked(motion, partial(np.multiply, found)) for motion in log.motions])
        found *= 1.0 - drift
        if abs(drift) < 0.1 * error:
            break
    spans = [float(motion.position.time[-1]) for motion in log.motions]
    return found, float(np.hypot(error, STRIDE / np.linalg.norm(spans)))


def _searched(log: MotionLog) -> float:
    """Return the grid's clock rate at which moves of the longest motions correlate best with their commands'."""
    longest = sorted(log.motions, key=lambda motion: -float(motion.position.time[-1]))[:_MOST]
    spans = [float(m.position.time[-1] - m.position.time[0]) for m in longest]
    lengths = [float(np.ptp(m.command.time)) / span for m, span in zip(longest, spans, strict=True)]
    fine = 2.0 * STRIDE / min(max(spans), _SPAN)
    grid = np.arange(1.0 - RATES, 1.0 + RATES, fine)
    centre = float(np.median(lengths))
    grid = np.union1d(grid, centre * grid[np.abs(grid - 1.0) < 0.01]) if abs(centre - 1.0) > RATES else grid
    scores = [sum(_likeness(motion, r) for motion in longest) for r in grid]
    return float(grid[int(np.argmax(scores))])


def _likeness(motion: Motion, r: float) -> float:
    whole = Moves.of(reclocked(motion, lambda t: r * t), _COARSE * STRIDE)
    moves = next(whole.parts(-(-len(whole.time) // round(_SPAN / whole.step))))
    return Correlation.of(moves, _NEAR).best()[1] * len(moves.time)


def _drift(motions: Sequence[Motion]) -> tuple[float, float, bool]:
    """Regress the lag on time in motions: slope, standard error, and whether lags are large or mostly undetermined."""
    squares, products, sizes, lost = [], [], [0.0], 0
    for motion in motions:
        moves = Moves.of(motion)
        pieces = list(moves.parts(max(1, round((moves.time[-1] - moves.time[0]) / PIECE))))
        told = [(piece.time.mean(), *Correlation.of(piece, _NEAR).best()) for piece in pieces]
        t, lag = np.array([(t, lag) for t, lag, share in told if share > FOLLOWS] or np.empty((0, 2))).T
        lost += len(told) - len(t)
        sizes += np.abs(lag).tolist()
        if len(t) > 1:
            away = np.abs(lag - np.median(lag))
            kept = away <= CLEAR * max(_SIGMA * np.median(away), STRIDE)
            t, lag = t[kept] - t[kept].mean(), lag[kept] - lag[kept].mean()
            whole = len(motions) >= CLUSTERS
            squares += [(t @ t,)] if whole else [(each * each,) for each in t]
            products += [(t @ lag,)] if whole else [(a * b,) for a, b in zip(t, lag, strict=True)]
    far = lost > len(sizes) or max(sizes) > _NEAR / 4.0
    if not squares:
        return 0.0, np.inf, far
    found, error = slope(np.array(squares), np.array(products))
    return float(found[0]), float(error[0]), far


def shifts(log: MotionLog) -> dict[str, tuple[float, float]]:
    """Return by motion how late the readings' stamps are, s, and its standard error, if negative or an outlier.

    Negative: the readings precede their command. An outlier: the lag differs from that of the other motions, once the
    lag that friction makes, an angle over a speed, is taken off.
    """
    names, rows = [], []
    for motion in log.motions:
        moves = Moves.of(motion)
        whole, share = Correlation.of(moves, _NEAR).best()
        if share > FOLLOWS:
            told = [Correlation.of(part, _NEAR).best() for part in moves.parts(QUARTERS)]
            near = [each for each, part in told if part > FOLLOWS] or [whole]
            error = max(float(np.std(near)) / np.sqrt(len(near)), moves.step / 2.0)
            names.append(motion.name)
            rows.append((whole, error, moves.step, 1.0 / max(float(np.sqrt((moves.commanded**2).mean())), 1e-6)))
    if not names:
        return {}
    lag, error, step, slowness = np.array(rows).T
    usual, scatter = _usual_lag(lag, slowness)
    early = lag < -np.maximum(FAR * step, CLEAR * error)
    away = np.abs(lag - usual) > np.maximum(FAR * step, OUTLIER * np.hypot(scatter, error))
    size = np.where(early & ~away, lag, lag - usual)
    return {names[k]: (float(size[k]), float(error[k])) for k in np.flatnonzero(early | away)}


def _usual_lag(lag: Array, slow: Array) -> tuple[Array, float]:
    """Return (M,) lags, s, that Siegel's repeated-median line over slowness predicts, and robust scatter about it."""
    if len(lag) < FAR * 2:
        return np.full(len(lag), np.median(lag)), np.inf
    angle = max(float(siegelslopes(lag, slow).slope), 0.0) if np.ptp(slow) > 0.0 else 0.0
    rest = lag - angle * slow
    usual = np.median(rest)
    return usual + angle * slow, float(_SIGMA * np.median(np.abs(rest - usual)))
