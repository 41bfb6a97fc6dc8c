"""Measurement of one day: instrument, noise, outliers, and the files of the campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from thermal_robot.blind.cases import Case
from thermal_robot.blind.reality.fault import Fault
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.sizes import Gauge, place
from thermal_robot.blind.reality.world import Array, free_columns, from_vector
from thermal_robot.files import write_text


@dataclass(frozen=True)
class Instrument:
    """Simulated instrument: its pose, target, noise and outliers, and what the campaign's file declares of them.

    Attributes
    ----------
    pose
        (4, 4) pose of the robot's root frame in the instrument's frame.
    target, declared
        (3,) the target in the tool frame: where it is, and where the file says it is, m.
    noise, turning
        One sigma per axis, m and rad; ``turning`` is ``None`` where it measures no orientation.
    base_known, tool_known, stated
        What the file declares known, and whether it states the noise.
    tails
        Degrees of freedom of Student's law that the noise has, more than 2; infinite for Gauss'.
    spoilt
        Probability that a row is an outlier, by 20 to 200 times the noise.
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


@dataclass(frozen=True, eq=False)
class Day:
    """Simulated campaign: commands, and the instrument that measures them."""

    setting: Setting
    instrument: Instrument

    @cached_property
    def gauge(self) -> Gauge:
        """Gauge of the target's displacements on measured rows, aligned to the frames that the file leaves unknown."""
        known = self.instrument
        return Gauge(self.setting, self.rows, known.target, not known.base_known, not known.tool_known)

    @property
    def rows(self) -> NDArray[np.int64]:
        """Indices (M,) of the rows that are measured and given to the diagnosis."""
        return np.flatnonzero(self.setting.given)


def measure(
    day: Day, faults: Sequence[tuple[Fault, Array]], rng: np.random.Generator
) -> tuple[Array, pd.DataFrame, list[int]]:
    """Simulate the measurement of a robot with faults: exact positions, plus normal or Student noise, plus outliers.

    Returns all rows' positions (N, 3) without noise, m; of the given rows the columns x, y, z (m) and, if orientations
    are measured, the quaternion; and the line numbers of the outliers in the table (its head is line 1).
    """
    instrument, count = day.instrument, len(day.rows)
    seen, turned = place(day.setting, faults, instrument.target, instrument.pose)
    unit = rng.normal(size=(count, 3))
    if np.isfinite(instrument.tails):  # of the same variance
        unit *= np.sqrt((instrument.tails - 2.0) / rng.chisquare(instrument.tails, (count, 3)))
    position = seen[day.rows] + instrument.noise * unit
    wrong = np.flatnonzero(rng.uniform(size=count) < instrument.spoilt)
    position[wrong] += rng.normal(size=(len(wrong), 3)) * instrument.noise * rng.uniform(20, 200, (len(wrong), 1))
    measured = pd.DataFrame(position, columns=["x", "y", "z"])
    if instrument.turning is not None:
        turn = Rotation.from_rotvec(instrument.turning * rng.normal(size=(count, 3)))
        measured[["qx", "qy", "qz", "qw"]] = (turn * Rotation.from_matrix(turned[day.rows])).as_quat()
    return seen, measured, (wrong + 2).tolist()


def registered(day: Day, position: Array, spoilt: Sequence[int]) -> Array:
    """Positions (N, 3) of the sound robot's target, with unknown frames fitted to (M, 3) measured positions, m.

    Least squares by Gauss–Newton steps from the true base and the declared target, outliers left out.
    """
    setting, instrument = day.setting, day.instrument
    good = np.delete(np.arange(len(day.rows)), np.array(spoilt, dtype=int) - 2)
    base, target = instrument.pose.copy(), instrument.declared.copy()
    unknown = (not instrument.base_known, not instrument.tool_known)
    for _ in range(8 if any(unknown) else 0):
        poses = (base @ setting.poses)[day.rows][good]
        nominal = poses[:, :3, :3] @ target + poses[:, :3, 3]
        columns = free_columns(nominal, poses[:, :3, :3], *unknown)
        step = np.linalg.lstsq(columns, (position[good] - nominal).ravel(), rcond=1e-11)[0]
        if unknown[0]:
            centre = nominal.mean(axis=0)
            motion = from_vector(np.concatenate([np.zeros(3), step[3:6]])[None])[0]
            motion[:3, 3] = centre - motion[:3, :3] @ centre + step[:3]
            base, step = motion @ base, step[6:]
        if unknown[1]:
            target = target + step
    poses = base @ setting.poses
    return np.asarray(poses[:, :3, :3] @ target + poses[:, :3, 3])


def write_folder(
    folder: Path, case: Case, day: Day, measured: pd.DataFrame, gears: dict[str, float] | None = None
) -> None:
    """Write campaign.toml, robot.urdf, measurements.csv and, with samples to predict, fresh.csv.

    Hidden columns are left out of both tables. ``gears`` are the transmission ratios by joint.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "robot.urdf", case.robot.urdf)
    write_text(folder / "campaign.toml", _document(case, day.instrument, gears or {}))
    columns = conditions(day.setting)
    table = columns[day.setting.given].reset_index(drop=True)
    for axis in "xyz":
        table[axis] = (1e3 * measured[axis]).round(6)
    for name in ("qw", "qx", "qy", "qz"):
        if name in measured:
            table[name] = measured[name].round(10)
    hidden = [c for c in map(str, columns) if any(c == h or c.startswith(h + ".") for h in case.hidden)]
    for file, rows in (("measurements.csv", table), ("fresh.csv", columns[~day.setting.given])):
        if len(rows):
            write_text(folder / file, rows.drop(columns=hidden).to_csv(index=False))


def conditions(setting: Setting) -> pd.DataFrame:
    """Table of commands and all recorded conditions, one row each: rad, mm, s, °C, kg."""
    names = setting.world.names
    unit = np.where(setting.world.slides, 1e3, 1.0)  # a sliding joint's column is in mm, a turning one's in rad
    table = pd.DataFrame((setting.q * unit).round(9), columns=list(names))
    table["time"] = setting.time
    table["temperature"] = (setting.links.mean(axis=1) if setting.sensor == "robot" else setting.air).round(3)
    if setting.sensor == "links":
        for s, link in enumerate(setting.world.links):
            table[f"temperature.{link}"] = setting.links[:, s].round(3)
    table["payload"] = setting.payload
    for j, name in enumerate(names):
        table[f"approach.{name}"] = setting.approach[:, j].astype(int)
    for j, name in enumerate(names if setting.moving else ()):
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
    text = f"""[robot]
urdf = "robot.urdf"
tool_frame = "{case.robot.tool_frame}"

[measurements]
file = "measurements.csv"
angle_unit = "rad"
length_unit = "mm"

[frames]
base = "{"" if instrument.base_known else "un"}known"
tool = "{"" if instrument.tool_known else "un"}known"
target = [{target}]

[payload]
com = [0.0, 0.0, 50.0]
"""
    if instrument.stated:
        text += f"\n[noise]\nposition = {1e3 * instrument.noise:.6f}\n"
        if instrument.turning is not None:
            text += f"orientation = {instrument.turning:.1e}\n"
    if gears:
        text += "\n[gears]\n" + "".join(f'"{name}" = {ratio:g}\n' for name, ratio in gears.items())
    return text
