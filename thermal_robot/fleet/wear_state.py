"""What each parameter was over time, beside some moves: values, rate, and the day on which it crosses a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.fleet import wear_settings as settings
from thermal_robot.fleet.wear_moves import Beside, Grid, Move, Series


@dataclass(frozen=True, eq=False)
class State:
    """Constants and moves together.

    Attributes
    ----------
    series
        Of which.
    columns
        Numbers of the D moves.
    mean, covariance
        (P + D,) and (P + D, P + D) constants, then moves, in expected sizes.
    """

    series: Series
    columns: tuple[int, ...]
    mean: Array
    covariance: Array

    @classmethod
    def of(cls, series: Series, grid: Grid, moves: Sequence[Move]) -> State:
        """Solve for moves, at the most probable scale and scatter."""
        point = int(np.argmax(Beside.of(series, grid, moves).log_likelihood))
        columns = [c for move in moves for c in series.spans(move)]
        share = np.concatenate([*(series.shares(move) for move in moves), np.zeros(0)])
        return cls._solved(series, columns, grid.variance[point] * share, float(grid.inflation[point]))

    @classmethod
    def free(cls, series: Series, grid: Grid, moves: Sequence[Move], parameter: int) -> State:
        """Solve with one parameter as each campaign alone has it, beside the moves of the others."""
        rest = [move for move in moves if move.parameter != parameter]
        point = int(np.argmax(Beside.of(series, grid, moves).log_likelihood))
        columns = [c for move in rest for c in series.spans(move)]
        share = np.concatenate([*(series.shares(move) for move in rest), np.zeros(0)])
        steps = series.spans(Move(parameter, "walk"))
        variance = np.concatenate([grid.variance[point] * share, np.full(len(steps), settings.WIDE**2)])
        return cls._solved(series, [*columns, *steps], variance, float(grid.inflation[point]))

    @classmethod
    def _solved(cls, series: Series, columns: list[int], variance: Array, inflation: float) -> State:
        own = series.information[np.ix_(columns, columns)] / inflation + np.diag(1.0 / variance)
        moves = np.linalg.inv(own)
        amounts = moves @ series.pull[columns] / inflation
        carried = series.constants @ series.crossed[columns].T
        mean = series.constants @ series.vectors.sum(axis=0) - carried @ amounts
        across = -carried @ moves
        whole = np.block([[inflation * series.constants - across @ carried.T, across], [across.T, moves]])
        return cls(series, tuple(columns), np.concatenate([mean, amounts]), whole)

    def over_time(self, parameter: int) -> tuple[Array, Array]:
        """(K,) value of a parameter in each campaign, and its deviation."""
        along = np.zeros((self.series.count, len(self.mean)))
        along[:, parameter] = 1.0
        for k, column in enumerate(self.columns):
            owner, shape = divmod(column, self.series.count)
            if owner == parameter:
                along[:, len(self.series.followed) + k] = self.series.shapes[shape]
        variance = np.einsum("ki,ij,kj->k", along, self.covariance, along)
        return along @ self.mean, np.sqrt(np.maximum(variance, 0.0))

    def amount(self, column: int) -> tuple[float, float]:
        """Return how far one move goes, and its deviation."""
        k = len(self.series.followed) + self.columns.index(column)
        return float(self.mean[k]), float(np.sqrt(self.covariance[k, k]))

    def line(self, parameter: int, column: int) -> tuple[Array, Array]:
        """(2,) value of a parameter in the last campaign and its rate, per unit of time; (2, 2) their covariance."""
        k, last = len(self.series.followed) + self.columns.index(column), self.series.shapes[-1, -1]
        along = np.zeros((2, len(self.mean)))
        along[0, parameter], along[0, k], along[1, k] = 1.0, last, 1.0 / self.series.span
        return along @ self.mean, along @ self.covariance @ along.T


def fieller(value: Array, covariance: Array, limit: float) -> tuple[float, float, float | None] | None:
    """Return when a straight line reaches ±limit: the expected time from now, and a 95 % interval (Fieller 1954).

    Parameters
    ----------
    value, covariance
        (2,) value now and rate; (2, 2).
    limit
        Of the absolute value.

    Returns
    -------
    tuple or None
        Its upper end is ``None`` where the line may as well never get there; ``None`` where it does not move at all.
    """
    now, rate = float(value[0]), float(value[1])
    if rate == 0.0:
        return None
    z2, distance = settings.CROSSING**2, np.copysign(limit, rate) - now
    square = rate**2 - z2 * covariance[1, 1]
    middle = rate * distance + z2 * covariance[0, 1]
    rest = distance**2 - z2 * covariance[0, 0]
    root = np.sqrt(max(middle**2 - square * rest, 0.0))
    if square <= 0.0:  # the rate may be zero, or of the other sign
        ends = [(middle - root) / square, (middle + root) / square] if square else [rest / (2.0 * middle)]
        later = [end for end in ends if end > 0.0]
        return distance / rate, (min(later) if later and rest > 0.0 else 0.0), None
    return distance / rate, max((middle - root) / square, 0.0), max((middle + root) / square, 0.0)
