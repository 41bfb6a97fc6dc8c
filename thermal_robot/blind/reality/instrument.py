"""The instrument: where it stands, how it scatters, which rows it spoils."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from thermal_robot.blind.cases import Case
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import free_columns, from_vector
from thermal_robot.files import write_text

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
    noise: float
    base_known: bool = False
    tool_known: bool = False
    turning: float | None = None
    stated: bool = True
    tails: float = np.inf
    spoilt: float = 0.0


@dataclass(frozen=True)
class Measured:
    """(M, 3) positions m, (M, 4) quaternions or ``None``, and the table's row numbers that are spoilt."""

    position: Array
    quaternion: Array | None
    spoilt: list[int]


def measure(
    seen: Array, turned: Array, rows: NDArray[np.int64], instrument: Instrument, rng: np.random.Generator
) -> Measured:
    """Measure the rows that are given away, of (N, 3) positions and (N, 3, 3) orientations in its frame."""
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


def write_folder(
    folder: Path,
    case: Case,
    setting: Setting,
    measured: Measured,
    rows: NDArray[np.int64],
    others: NDArray[np.int64],
    instrument: Instrument,
    gears: dict[str, float] | None = None,
) -> None:
    """Write campaign.toml, robot.urdf, measurements.csv and, where something is to be predicted, fresh.csv.

    Rows are given with their measurements, others are to be predicted; gears are the transmission ratios by joint.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "robot.urdf", case.robot.urdf)
    write_text(folder / "campaign.toml", _document(case, instrument, gears or {}))
    columns = conditions(setting)
    table = columns.iloc[rows].reset_index(drop=True)
    for axis, values in zip("xyz", 1e3 * measured.position.T, strict=True):
        table[axis] = values.round(6)
    if measured.quaternion is not None:
        for name, values in zip(("qw", "qx", "qy", "qz"), measured.quaternion.T, strict=True):
            table[name] = values.round(10)
    hidden = [c for c in map(str, columns) if any(c == h or c.startswith(h + ".") for h in case.hidden)]
    for name, rows_given in (("measurements.csv", table), ("fresh.csv", columns.iloc[others])):
        if len(rows_given):
            write_text(folder / name, rows_given.drop(columns=hidden).to_csv(index=False))


def conditions(setting: Setting) -> pd.DataFrame:
    """Return commands and everything that is recorded beside the measurement, one row each: rad, mm, s, °C, kg."""
    names = setting.world.names
    unit = np.where(setting.world.slides, 1e3, 1.0)  # a sliding joint's column is in mm, a turning one's in rad
    table = pd.DataFrame({name: (setting.q[:, j] * unit[j]).round(9) for j, name in enumerate(names)})
    table["time"] = setting.time
    if setting.sensor == "robot":
        table["temperature"] = setting.links.mean(axis=1).round(3)
    else:
        table["temperature"] = setting.air.round(3)
    if setting.sensor == "links":
        for s, link in enumerate(setting.world.links):
            table[f"temperature.{link}"] = setting.links[:, s].round(3)
    table["payload"] = setting.payload
    for j, name in enumerate(names):
        table[f"approach.{name}"] = setting.approach[:, j].astype(int)
    if setting.moving:
        for j, name in enumerate(names):
            table[f"velocity.{name}"] = (setting.velocity[:, j] * unit[j]).round(6)
            table[f"acceleration.{name}"] = (setting.acceleration[:, j] * unit[j]).round(6)
    for name, values in setting.extra.items():
        table[name] = values
    if setting.session is not None:
        table["session"] = [f"s{number + 1}" for number in setting.session]
    if setting.pose is not None:
        table["pose"] = [f"p{number + 1:03d}" for number in setting.pose]
    return table


def _document(case: Case, instrument: Instrument, gears: dict[str, float]) -> str:
    target = ", ".join(f"{1e3 * value:.6f}" for value in instrument.declared)
    lines = [
        "[robot]",
        'urdf = "robot.urdf"',
        f'tool_frame = "{case.robot.tool_frame}"',
        "",
        "[measurements]",
        'file = "measurements.csv"',
        'angle_unit = "rad"',
        'length_unit = "mm"',
        "",
        "[frames]",
        f'base = "{"" if instrument.base_known else "un"}known"',
        f'tool = "{"" if instrument.tool_known else "un"}known"',
        f"target = [{target}]",
        "",
        "[payload]",
        "com = [0.0, 0.0, 50.0]",
    ]
    if instrument.stated:
        lines += ["", "[noise]", f"position = {1e3 * instrument.noise:.6f}"]
        if instrument.turning is not None:
            lines.append(f"orientation = {instrument.turning:.1e}")
    if gears:
        lines += ["", "[gears]", *(f'"{name}" = {ratio:g}' for name, ratio in gears.items())]
    return "\n".join(lines) + "\n"
