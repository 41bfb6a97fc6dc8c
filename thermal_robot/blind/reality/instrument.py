"""The instrument: where it stands, how it scatters, which rows it spoils."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from thermal_robot.blind.reality.rigid import free_columns, from_vector
from thermal_robot.blind.reality.setting import Setting

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Instrument:
    """One instrument and one target.

    Attributes
    ----------
    pose
        (4, 4) the robot's root as the instrument sees it.
    target, declared
        (3,) the target in the tool frame: where it is, and where the file says it is, m.
    base_known, tool_known
        What the file declares known.
    noise, turning
        One sigma per axis, m and rad; ``turning`` is ``None`` where it measures no orientation.
    stated
        Whether the file states the noise.
    tails
        Degrees of freedom of Student's law that the noise has, more than 2; infinite for Gauss'.
    spoilt
        Share of rows that are grossly wrong.
    """

    pose: Array
    target: Array
    declared: Array
    base_known: bool
    tool_known: bool
    noise: float
    turning: float | None
    stated: bool
    tails: float
    spoilt: float


@dataclass(frozen=True)
class Measured:
    """(M, 3) positions m, (M, 4) quaternions or ``None``, and the table's row numbers that are spoilt."""

    position: Array
    quaternion: Array | None
    spoilt: list[int]


def measure(
    setting: Setting,
    seen: Array,
    turned: Array,
    rows: NDArray[np.int64],
    instrument: Instrument,
    rng: np.random.Generator,
) -> Measured:
    """Measure the rows that are given away."""
    count = len(rows)
    unit = rng.normal(size=(count, 3))
    if np.isfinite(instrument.tails):  # of the same variance
        unit *= np.sqrt((instrument.tails - 2.0) / rng.chisquare(instrument.tails, (count, 3)))
    position = seen[rows] + instrument.noise * unit
    wrong = np.flatnonzero(rng.uniform(size=count) < instrument.spoilt)
    position[wrong] += rng.normal(size=(len(wrong), 3)) * instrument.noise * rng.uniform(20, 200, (len(wrong), 1))
    quaternion = None
    if instrument.turning is not None:
        turn = Rotation.from_rotvec(instrument.turning * rng.normal(size=(count, 3)))
        quaternion = np.roll((turn * Rotation.from_matrix(turned[rows])).as_quat(), 1, axis=1)
    return Measured(position, quaternion, (wrong + 2).tolist())


def registered(setting: Setting, measured: Measured, rows: NDArray[np.int64], instrument: Instrument) -> Array:
    """(N, 3) where the sound robot has the target after the unknown frames were fitted to what was measured.

    Gauss–Newton from the true frames, spoilt rows left out; by least squares of the positions.
    """
    good = np.ones(len(rows), dtype=bool)
    good[np.array(measured.spoilt, dtype=int) - 2] = False
    base, target = instrument.pose.copy(), instrument.declared.copy()
    unknown = (not instrument.base_known, not instrument.tool_known)
    for _ in range(8):
        poses = base @ setting.poses
        nominal = poses[:, :3, :3] @ target + poses[:, :3, 3]
        columns = free_columns(nominal[rows][good], poses[rows][good][:, :3, :3], *unknown)
        if not columns.shape[1]:
            break
        gap = (measured.position - nominal[rows])[good].ravel()
        step = np.linalg.lstsq(columns, gap, rcond=1e-11)[0]
        if unknown[0]:
            centre = nominal[rows][good].mean(axis=0)
            motion = from_vector(np.concatenate([np.zeros(3), step[3:6]])[None])[0]
            motion[:3, 3] = centre - motion[:3, :3] @ centre + step[:3]
            base, step = motion @ base, step[6:]
        if unknown[1]:
            target = target + step
    poses = base @ setting.poses
    return np.asarray(poses[:, :3, :3] @ target + poses[:, :3, 3])
