"""How large a fault is: what it leaves after alignment, and what no other single fault can imitate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import Fault, Place
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.rigid import free_columns
from thermal_robot.blind.reality.setting import Setting

Array = NDArray[np.float64]


class Unseen(Exception):
    """A fault leaves nothing in the campaign that was drawn for it."""


@dataclass
class Gauge:
    """Measures displacements of the target on the rows that are given to the diagnosis.

    Attributes
    ----------
    setting
        The campaign's day.
    rows
        (M,) the rows.
    target
        (3,) the target in the tool frame, m.
    frames
        (3M, F) columns of the frames that are unknown.
    """

    setting: Setting
    rows: NDArray[np.int64]
    target: Array
    base: bool
    tool: bool

    def __post_init__(self) -> None:
        poses = self.setting.poses
        self.sound = poses[:, :3, :3] @ self.target + poses[:, :3, 3]
        columns = free_columns(self.sound[self.rows], poses[self.rows, :3, :3], self.base, self.tool)
        self.frames = np.linalg.qr(columns)[0] if columns.shape[1] else columns

    def moved(self, fault: Fault, values: Array) -> Array:
        """(3M,) displacement of the target by one fault alone."""
        return (self.place([(fault, values)]) - self.sound)[self.rows].ravel()

    def place(self, faults: Sequence[tuple[Fault, Array]]) -> Array:
        """(N, 3) where the target is with all these faults at once, in the frame of the sound robot's root."""
        return place(self.setting, faults, self.target)[0]

    def left(self, moved: Array, others: Iterable[Array] = ()) -> Array:
        """Return what remains of a displacement after alignment, and after the best of other columns."""
        rest = moved - self.frames @ (self.frames.T @ moved)
        for basis in others:
            rest = rest - basis @ (basis.T @ rest)
        return np.asarray(rest)

    def rms(self, moved: Array) -> float:
        """Root mean square per axis of a displacement (3M,)."""
        return float(np.sqrt((moved**2).mean()))

    def basis(self, fault: Fault) -> Array:
        """(3M, K) orthonormal: all that this kind of fault can do beyond the frames, to first order."""
        draw = fault.draw(self.setting, np.random.default_rng(0))
        fixed = dict(fault.fixed)
        columns = []
        for settings in product(*fixed.values()):
            for p, d in product(range(draw.shape[0]), range(draw.shape[1])):
                if d in fixed:
                    continue
                unit = np.zeros_like(draw)
                unit[:, list(fixed)] = settings
                unit[p, d] = np.abs(draw[:, d]).max() or 1e-4
                column = self.left(self.moved(fault, unit))
                if self.rms(column) > 1e-12:
                    columns.append(column / np.linalg.norm(column))
        if not columns:
            return np.zeros((len(self.frames), 0))
        left, size, _ = np.linalg.svd(np.column_stack(columns), full_matrices=False)
        return np.asarray(left[:, size > 1e-3 * size[0]])

    def beyond(self, fault: Fault, moved: Array, others: Iterable[str], together: int = 1) -> dict[str, float]:
        """Rms per axis that other kinds of fault leave of a displacement at their best, one or several ``together``."""
        left = self.left(moved)
        known = [FAULTS[name] for name in others if name != fault.name and not FAULTS[name].random]
        bases = {other.name: self.basis(other) for other in known if testable(other, self)}
        found = {}
        for names in combinations(bases, min(together, len(bases))):
            basis = bases[names[0]]
            if len(names) > 1:
                basis = np.linalg.qr(np.column_stack([bases[name] for name in names]))[0]
            found[" with ".join(names)] = self.rms(left - basis @ (basis.T @ left))
        return found


def testable(fault: Fault, gauge: Gauge) -> bool:
    """Whether this campaign lets a fault of this kind be seen."""
    setting = gauge.setting
    known = {
        "moving": setting.moving,
        "repeats": setting.pose is not None,
        "sessions": setting.session is not None,
        "sensor:links": setting.sensor == "links",
        "base_known": not gauge.base,
        "tool_known": not gauge.tool,
    }
    return all(known.get(want, True) for want in fault.wants)


def sized(gauge: Gauge, fault: Fault, values: Array, wanted: float, measure: Callable[[Array], float]) -> Array:
    """Scale values until a measure of their displacement is as wanted; a few rounds, as faults are nearly linear."""
    for _ in range(4):
        reached = measure(gauge.moved(fault, values))
        if reached <= 1e-12:
            raise Unseen(f"{fault.name} cannot be seen in this campaign")
        values = fault.scaled(values, wanted / reached)
    return values


def shares(gauge: Gauge, fault: Fault, values: Array) -> list[tuple[Place, int, float]]:
    """Return each place of a fault with its number and the rms that it alone leaves, largest first."""
    found = []
    for p, where in enumerate(fault.places(gauge.setting)):
        alone = np.zeros_like(values)
        alone[p] = values[p]
        for column, _ in fault.fixed:
            alone[:, column] = values[:, column]
        found.append((where, p, gauge.rms(gauge.left(gauge.moved(fault, alone)))))
    return sorted(found, key=lambda item: -item[2])


def place(
    setting: Setting, faults: Sequence[tuple[Fault, Array]], target: Array, instrument: Array | None = None
) -> tuple[Array, Array]:
    """(N, 3) positions of the target and (N, 3, 3) orientations with these faults, in the instrument's frame.

    ``instrument`` is the (4, 4) pose of the robot's root in it; where it is left out the two are one.
    """
    world = setting.world
    body = world.sound(setting.samples)
    for fault, values in faults:
        fault.act(body, setting, values)
    still = not (body.springs.any() or body.beams.any() or body.bow.any() or body.growth.any())
    if still and not body.joints.any() and not body.placements.any():
        poses = setting.poses
    else:
        poses, _ = world.poses(setting.q, setting.payload, body)
    poses = (np.eye(4) if instrument is None else instrument) @ body.base @ poses @ body.tool
    seen = (poses[:, :3, :3] @ target + poses[:, :3, 3]) * (1.0 + body.scale)
    return seen, poses[:, :3, :3]
