"""How often a series without change would look as if a parameter moved: the chance of a false alarm, stated.

The statistic of a single move, a jump on some day or a trend of one parameter, beside what is known to move, is its
squared significance z² = g²/V over the scatter of the campaigns that it leaves, (Q − z²)/(ν − 1), where that is above
1. Nothing of a prior is in it. Without a change it follows F(1, ν − 1) or less. The C moves that are looked at share
the chance unevenly, with weights that add up to 1: alike among parameters, and within one in inverse proportion to the
information V, so that an amount is seen on the first day as on one in the middle, where both sides are known well. The
chance that any comes so far is at most tail/weight (Bonferroni), whatever their correlations, and for small chances not
much less.
"""

from __future__ import annotations

import numpy as np
from scipy.special import fdtrc

from thermal_robot.arrays import Array
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.fleet.wear_moves import Beside, Grid, Move, Series


def chances(series: Series, grid: Grid, moves: tuple[Move, ...]) -> Array:
    """(P,) bound on the chance that a series without change shows a move as clear as the clearest of each parameter.

    Parameters
    ----------
    series, grid
        The campaigns.
    moves
        The best explanation: each parameter is judged beside the moves of the others.

    Returns
    -------
    numpy.ndarray
        1 for parameters that are not followed.
    """
    found = np.ones(len(series.followed))
    moving, columns = {move.parameter for move in moves}, series.columns
    shared = _chances(series, grid, moves) if len(columns) else np.zeros(0)
    for parameter in np.flatnonzero(series.followed).tolist():
        rest = tuple(move for move in moves if move.parameter != parameter)
        single = _chances(series, grid, rest) if parameter in moving else shared
        found[parameter] = min(float(single[columns // series.count == parameter].min()), 1.0)
    return found


def scatter(series: Series, grid: Grid, moves: tuple[Move, ...]) -> float:
    """Return φ² as the campaigns show it beside some moves, not less than 1."""
    distance, degrees = _left(series, grid, moves)
    return max(distance / degrees, 1.0)


def _left(series: Series, grid: Grid, moves: tuple[Move, ...]) -> tuple[float, float]:
    """Return Q and ν: the squared distance of the campaigns from what some moves say, and its degrees of freedom."""
    distance, degrees = series.scattered
    beside = Beside.of(series, _wide(grid), moves)
    if len(beside.columns):
        distance -= float(beside.mean[0] @ series.pull[beside.columns])
    return max(distance, 0.0), max(degrees - len(beside.columns), 2.0)


def _chances(series: Series, grid: Grid, moves: tuple[Move, ...]) -> Array:
    """(C,) bound on the chance of each single move beside others, which are taken as wide as the grid has them."""
    own, pull = Beside.of(series, _wide(grid), moves).left(series, _wide(grid), series.columns)
    seen = own[0] > settings.HIDDEN * np.diag(series.information)[series.columns]
    square = np.where(seen, pull[0] ** 2 / np.where(seen, own[0], 1.0), 0.0)
    distance, degrees = _left(series, grid, moves)
    rest = np.maximum(distance - square, 0.0) / (degrees - 1.0)
    tail = fdtrc(1.0, degrees - 1.0, square / np.maximum(rest, 1.0))
    return np.asarray(np.where(seen, tail, 1.0) / _weights(series))


def _weights(series: Series) -> Array:
    """(C,) share of each single move in the chance."""
    information = np.diag(series.information)[series.columns]
    inverse = 1.0 / np.maximum(information, settings.HIDDEN * max(float(information.max()), settings.HIDDEN))
    owner = series.columns // series.count
    return np.asarray(inverse / np.bincount(owner, inverse)[owner] / len(np.unique(owner)))


def _wide(grid: Grid) -> Grid:
    """Return the one point of a grid at which moves are held least, and campaigns scatter as they say."""
    return Grid(grid.variance.max(keepdims=True), np.ones(1), np.zeros(1))
