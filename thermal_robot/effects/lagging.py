"""A body that follows a recorded temperature with a time constant."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from thermal_robot.arrays import Array

_MOST = 500  # points of a history that are kept
_FOLLOWED = 64  # histories and lags of which it is kept how far a body is behind: all settings ask for each


@dataclass(frozen=True)
class History:
    """A temperature as it was recorded, straight between its points: increasing (K,) times, s, and temperatures, °C."""

    times: tuple[float, ...]
    temperatures: tuple[float, ...]

    @classmethod
    def of(cls, times: Array, temperatures: Array) -> History:
        """Keep a record of rows in any order; rows of one instant count as their mean, a long one is thinned."""
        instants, which = np.unique(times, return_inverse=True)
        values = np.bincount(which, temperatures) / np.bincount(which)
        kept = np.unique(np.linspace(0, len(instants) - 1, min(len(instants), _MOST)).round().astype(int))
        return cls(tuple(instants[kept].tolist()), tuple(values[kept].tolist()))

    def followed(self, lag: float, times: Array, temperatures: Array) -> Array:
        """(N,) temperature of a body that obeys dT/dt = (T_recorded − T) / lag, a first-order lag of ``lag`` s.

        It is in balance at the first point. Between two points the solution is exact: T = u(t) − r·lag + (T_i − u_i +
        r·lag) exp(−(t − t_i)/lag), where u runs at the rate r. Rows are asked for by times and temperatures (N,), s and
        °C: beyond the record the row's own is taken to have held since its end; before it the body is in balance with
        it.
        """
        t, u = np.array(self.times), np.array(self.temperatures)
        rate = np.diff(u) / np.diff(t)
        behind = _behind(self, lag)
        i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 1)
        late = times >= t[-1]
        rate = np.append(rate, 0.0)[i]
        since = np.maximum(times - t[i], 0.0)
        lagging = (behind[i] + rate * lag) * np.exp(-since / lag) - rate * lag
        inside = u[i] + rate * since + lagging
        after = temperatures + (u[-1] + behind[-1] - temperatures) * np.exp(-since / lag)
        return np.where(times < t[0], temperatures, np.where(late, after, inside))


@lru_cache(maxsize=_FOLLOWED)
def _behind(history: History, lag: float) -> Array:
    """(K,) by how much a body differs from the record at its points, K."""
    t, u = np.array(history.times), np.array(history.temperatures)
    gains = (np.diff(u) / np.diff(t) * lag).tolist()
    behind = [0.0]
    for gain, decay in zip(gains, np.exp(-np.diff(t) / lag).tolist(), strict=True):
        behind.append((behind[-1] + gain) * decay - gain)
    found = np.array(behind)
    found.setflags(write=False)
    return found
