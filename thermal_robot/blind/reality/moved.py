"""How large a change of one number of a fault is: in deviations of what one campaign, or two, can tell of it.

A campaign of M positions with noise σ tells a number whose unit moves the target by x, (3M,), with the deviation
σ / |x − P x|, where P projects on the columns of unknown frames, of every joint's zero, and of all other numbers that
are at work. The program that is put to the test takes no part in that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import Fault, Place
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.sizes import Gauge, Unseen

Array = NDArray[np.float64]

SIZE = 0
"""The column of a fault's values that is its size."""
GROWS_ONLY = ("backlash", "joint_compliance")
"""What wear makes larger, and nothing smaller."""
_ZEROS = "joint_offset"
_STEP = 1e-4  # rad, rad/(N·m) ...: where a fault has no size yet, of which a derivative could be a share
_PRESENT = 0.1  # × noise: a number that leaves less is not at work
_SEEN = 1e-6  # of a column: what less is left of is rounding


@dataclass(frozen=True, eq=False)
class Spot:
    """One number of a fault, by its place, with its name and value in the words and units of formats.md."""

    fault: Fault
    number: int

    def moved(self, values: Array, by: float) -> Array:
        """Return values with this number larger."""
        result = values.copy()
        result[self.number, SIZE] += by
        return result

    def place(self, setting: Setting) -> Place:
        """Return where it is."""
        return self.fault.places(setting)[self.number]

    def told(self, setting: Setting, values: Array, by: float) -> tuple[str, float]:
        """Return the name of the parameter that this is, and by how much that changes."""
        before, after = (dict(self.fault.known_as(setting, v)) for v in (values, self.moved(values, by)))
        [name] = [key for key in after if after[key] != before[key]]
        return name, after[name] - before[name]


def draw_spot(fault: Fault, values: Array, rng: np.random.Generator) -> Spot:
    """Draw a place where a fault is at work, or, of joints' zeros and of what is not, any but the first and the last.

    Frames take up what the first and the last joint's zero do.
    """
    size = values[:, SIZE]
    inner = np.arange(1, len(size) - 1)
    places = inner if fault.name == _ZEROS or not size.any() else np.flatnonzero(size)
    return Spot(fault, int(rng.choice(places)))


def deviation(
    gauge: Gauge, spot: Spot, values: Array, others: Sequence[tuple[Fault, Array]], noise: float
) -> tuple[float, float]:
    """Return how well a campaign tells one number of a fault, and what a unit of it leaves after alignment.

    Parameters
    ----------
    gauge
        Of the campaign's rows.
    spot, values
        Which number, and the fault as it is.
    others
        All other faults at work.
    noise
        One sigma per axis, m.

    Returns
    -------
    tuple
        Standard deviation in the unit of the values, and rms per axis in m of one unit.

    Raises
    ------
    Unseen
        If frames or other numbers do the same.
    """
    known = {fault.name: values for fault, values in [*others, (spot.fault, values)]}
    known.setdefault(_ZEROS, np.zeros((gauge.setting.world.n, 1)))
    beside = []
    for name, now in known.items():
        for number, column in _columns(gauge, FAULTS[name], now):
            if (name, number) == (spot.fault.name, (spot.number, SIZE)):
                own = column
            elif name == _ZEROS or gauge.rms(gauge.left(column * now[number])) > _PRESENT * noise:
                beside.append(column)
    aligned = gauge.left(own)
    span = _span(gauge, np.column_stack(beside))
    left = aligned - span @ (span.T @ aligned)
    length = float(np.linalg.norm(left))
    if length <= _SEEN * float(np.linalg.norm(own)) or length == 0.0:
        raise Unseen(f"{spot.fault.name} is hidden there by what else is at work")
    return noise / length, gauge.rms(aligned)


def _columns(gauge: Gauge, fault: Fault, values: Array) -> Iterator[tuple[tuple[int, int], Array]]:
    """Yield each number of a fault that is a size, and (3M,) how its unit displaces the target."""
    fixed = {column for column, _ in fault.fixed}
    now = gauge.slope(fault, values)
    for p, d in np.ndindex(*values.shape):
        if d not in fixed:
            step = float(np.abs(values[:, d]).max()) or _STEP
            more = values.copy()
            more[p, d] += step
            yield (p, d), (gauge.slope(fault, more) - now) / step


def _span(gauge: Gauge, every: Array) -> Array:
    """(3M, R) orthonormal: all that these columns can do beside the frames."""
    aligned = every - gauge.frames @ (gauge.frames.T @ every)
    length = np.linalg.norm(every, axis=0)
    kept = np.linalg.norm(aligned, axis=0) > _SEEN * length
    if not kept.any():
        return np.zeros((len(every), 0))
    left, size, _ = np.linalg.svd(aligned[:, kept] / length[kept], full_matrices=False)
    return np.asarray(left[:, size > _SEEN * size[0]])
