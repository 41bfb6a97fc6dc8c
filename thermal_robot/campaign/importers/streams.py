"""What a robot and an instrument recorded, each by its own clock: joints, and the places of the target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermal_robot.errors import CampaignError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stream:
    """N samples of k quantities.

    Attributes
    ----------
    file
        Where they come from, for messages.
    time
        (N,) s, increasing.
    values
        (N, k) in the unit of the recording.
    names
        Of the k columns: joints, or x y z and perhaps qw qx qy qz.
    """

    file: str
    time: Array
    values: Array
    names: tuple[str, ...]

    def between(self, times: Array) -> Array:
        """Return (M, k) values between the samples, on straight lines; held beyond the ends."""
        return np.column_stack([np.interp(times, self.time, column) for column in self.values.T])

    def scaled(self, scale: Array) -> Stream:
        """Return the stream in other units, (k,) of them to one of its own."""
        return replace(self, values=self.values * scale)

    def nearest(self, times: Array) -> NDArray[np.int64]:
        """Return (M,) indices of the samples that are nearest in time."""
        after = np.clip(np.searchsorted(self.time, times), 1, len(self.time) - 1)
        earlier = times - self.time[after - 1] < self.time[after] - times
        return np.where(earlier, after - 1, after)


def stream(file: str, time: Array, values: Array, names: Sequence[str]) -> Stream:
    """Return a stream in the sequence of its clock, without samples that have a gap and without repeated instants.

    Raises
    ------
    CampaignError
        Fewer than two samples.
    """
    kept = ~(np.isnan(time) | np.isnan(values).any(axis=1))
    _, first = np.unique(time[kept], return_index=True)
    if len(first) < 2:
        raise CampaignError(
            file, "has fewer than two samples", found=f"{len(first)} of {', '.join(names)}", expected="a recording"
        )
    return Stream(file, time[kept][first], values[kept][first], tuple(names))
