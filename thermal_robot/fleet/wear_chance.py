"""How often a series without change would look as if a parameter moved: the chance of a false alarm, stated.

The statistic is the largest squared significance z² = g²/V of any single move, a jump on any day or a trend, of any
parameter, beside what is known to move. Nothing of a prior is in it. Without a change each z² follows F(1, ν) where the
scatter of the campaigns is taken from themselves with ν degrees of freedom; the chance that any of the C moves that are
looked at comes so far is at most C times that of one (Bonferroni), whatever their correlations. Neighbouring days are
much alike, so that the bound is about twice what happens.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from thermal_robot.fleet.wear_moves import Beside, Grid, Move, Series

Array = NDArray[np.float64]


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
    moving = {move.parameter for move in moves}
    columns = series.columns
    inflation, degrees = scatter(series, grid, moves)
    shared = _significance(series, grid, moves, inflation) if len(columns) else np.zeros(0)
    for parameter in np.flatnonzero(series.followed).tolist():
        squares = shared
        if parameter in moving:
            rest = tuple(move for move in moves if move.parameter != parameter)
            squares = _significance(series, grid, rest, inflation)
        clearest = float(squares[columns // series.count == parameter].max())
        found[parameter] = min(len(columns) * float(fdtrc(1.0, degrees, clearest)), 1.0)
    return found


def scatter(series: Series, grid: Grid, moves: tuple[Move, ...]) -> tuple[float, float]:
    """Return φ² as the campaigns show it beside some moves, not less than 1, and its degrees of freedom."""
    distance, degrees = series.scattered
    beside = Beside.of(series, _wide(grid, 1.0), moves)
    if len(beside.columns):
        distance -= float(beside.mean[0] @ series.pull[beside.columns])
    left = max(degrees - len(beside.columns), 1.0)
    return max(distance / left, 1.0), left


def _significance(series: Series, grid: Grid, moves: tuple[Move, ...], inflation: float) -> Array:
    """(C,) z² of each single move beside others, which are taken as wide as the grid has them."""
    widest = _wide(grid, inflation)
    own, pull = Beside.of(series, widest, moves).left(series, widest, series.columns)
    seen = own[0] > 0.0
    return np.where(seen, pull[0] ** 2 / np.where(seen, own[0], 1.0), 0.0) / inflation


def _wide(grid: Grid, inflation: float) -> Grid:
    """Return the one point of a grid at which moves are held least, at a given φ²."""
    return Grid(grid.variance.max(keepdims=True), np.array([inflation]), np.zeros(1))
