"""How large a fault is: what it leaves after alignment, and what no other single fault can imitate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.reality.fault import Fault, Place
from thermal_robot.blind.reality.faults import FAULTS
from thermal_robot.blind.reality.rigid import free_columns
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.unlisted import Slopes, slopes

Array = NDArray[np.float64]


_ROUNDS = 8
_NEAR = 0.01  # of a size, as a share of it


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
        poses = self.setting.poses[self.rows]
        self.sound = poses[:, :3, :3] @ self.target + poses[:, :3, 3]
        columns = free_columns(self.sound, poses[:, :3, :3], self.base, self.tool)
        self.frames = np.linalg.qr(columns)[0] if columns.shape[1] else columns
        self.bases: dict[str, Array] = {}

    @cached_property
    def slopes(self) -> Slopes:
        """Derivatives of the sound robot."""
        return slopes(self.setting.world, self.setting.q[self.rows], self.setting.payload[self.rows], self.target)

    def moved(self, fault: Fault, values: Array) -> Array:
        """(3M,) displacement of the target by one fault alone."""
        return (place(self.setting, [(fault, values)], self.target, rows=self.rows)[0] - self.sound).ravel()

    def slope(self, fault: Fault, values: Array) -> Array:
        """(3M,) the same to first order, a thousand times as fast."""
        body = self.setting.world.sound(self.setting.samples)
        fault.act(body, self.setting, values)
        return (self.slopes.place(body.take(self.rows)) - self.sound).ravel()

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
        if fault.name not in self.bases:
            self.bases[fault.name] = self._basis(fault)
        return self.bases[fault.name]

    def _basis(self, fault: Fault) -> Array:
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
                column = self.left(self.slope(fault, unit))
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
    """Scale values until a measure of their displacement is as wanted; a few rounds, as faults are nearly linear.

    An encoder's steps are not: of the rounds the one that comes nearest counts.
    """
    nearest = np.inf, values
    for _ in range(_ROUNDS):
        reached = measure(gauge.moved(fault, values))
        if reached <= 1e-12:
            raise Unseen(f"{fault.name} cannot be seen in this campaign")
        nearest = min(nearest, (abs(float(np.log(wanted / reached))), values), key=lambda found: found[0])
        if nearest[0] < _NEAR:
            break
        values = fault.scaled(values, wanted / reached)
    return nearest[1]


def shares(gauge: Gauge, fault: Fault, values: Array) -> list[tuple[Place, int, float]]:
    """Return each place of a fault with its number and the rms that it alone leaves, largest first."""
    found = []
    for p, where in enumerate(fault.places(gauge.setting)):
        alone = np.zeros_like(values)
        alone[p] = values[p]
        for column, _ in fault.fixed:
            alone[:, column] = values[:, column]
        found.append((where, p, gauge.rms(gauge.left(gauge.slope(fault, alone)))))
    return sorted(found, key=lambda item: -item[2])


def place(
    setting: Setting,
    faults: Sequence[tuple[Fault, Array]],
    target: Array,
    instrument: Array | None = None,
    rows: NDArray[np.int64] | None = None,
) -> tuple[Array, Array]:
    """(N, 3) positions of the target and (N, 3, 3) orientations with these faults, in the instrument's frame.

    ``instrument`` is the (4, 4) pose of the robot's root in it; where it is left out the two are one. ``rows`` are all
    where they are left out.
    """
    world = setting.world
    body = world.sound(setting.samples)
    for fault, values in faults:
        fault.act(body, setting, values)
    rows = np.arange(setting.samples) if rows is None else rows
    body = body.take(rows)
    still = not (body.springs.any() or body.beams.any() or body.bow.any() or body.growth.any())
    if still and not body.joints.any() and not body.placements.any():
        poses = setting.poses[rows]
    else:
        poses, _ = world.poses(setting.q[rows], setting.payload[rows], body)
    poses = (np.eye(4) if instrument is None else instrument) @ body.base @ poses @ body.tool
    seen = (poses[:, :3, :3] @ target + poses[:, :3, 3]) * (1.0 + body.scale)
    return seen, poses[:, :3, :3]
