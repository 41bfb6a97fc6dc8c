"""Identifiability of faults: size, imitation by other faults, and detectability of a change."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal_robot.blind.cases import CONDITION, Case
from thermal_robot.blind.reality.fault import FAULTS, Fault, Place
from thermal_robot.blind.reality.setting import Setting
from thermal_robot.blind.reality.world import Array, Slopes, World, free_columns, slopes

_ROUNDS = 8
_NEAR = 0.01  # of a size, as a share of it
_IMITATED = 1e-3  # of the largest: what a fault can do to less than that is rounding and what is not linear


class Unseen(Exception):
    """Error: a fault leaves nothing in the measurements of its campaign, or nothing that other faults cannot do."""


@dataclass
class Gauge:
    """Displacements of the target by faults on (M,) rows, and their residuals after alignment to the unknown frames.

    Attributes
    ----------
    target
        (3,) the target in the tool frame, m.
    base, tool
        Whether these frames are unknown: what they can do leaves nothing.
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
        """Derivatives of the target's position, on these rows, about the sound robot."""
        return slopes(self.setting.world, self.setting.q[self.rows], self.setting.payload[self.rows], self.target)

    def moved(self, fault: Fault, values: Array) -> Array:
        """Displacement (3M,) of the target by one fault alone, m, of the exact model."""
        return (place(self.setting, [(fault, values)], self.target, rows=self.rows)[0] - self.sound).ravel()

    def slope(self, fault: Fault, values: Array) -> Array:
        """First-order displacement (3M,) of the target by one fault alone, m."""
        body = self.setting.world.sound(self.setting.samples)
        fault.act(body, self.setting, values)
        return (self.slopes.place(body.take(self.rows)) - self.sound).ravel()

    def left(self, moved: Array) -> Array:
        """Residual (3M,) or (3M, K) of displacements after orthogonal projection off the unknown frames' columns."""
        return np.asarray(moved - self.frames @ (self.frames.T @ moved))

    def rms(self, moved: Array) -> float:
        """Root mean square per axis of a displacement (3M,)."""
        return float(np.sqrt((moved**2).mean()))

    def leaves(self, fault: Fault, values: Array) -> float:
        """Residual rms per axis, m, of one fault alone after alignment."""
        return self.rms(self.left(self.moved(fault, values)))

    def basis(self, fault: Fault) -> Array:
        """Orthonormal basis (3M, K) of a kind of fault's first-order displacements in all places, after alignment."""
        if fault.name in self.bases:
            return self.bases[fault.name]
        draw = fault.draw(self.setting, np.random.default_rng(0))
        fixed, columns = dict(fault.fixed), [np.zeros((len(self.frames), 0))]
        sizes = [d for d in range(draw.shape[1]) if d not in fixed]
        for settings, p, d in product(product(*fixed.values()), range(draw.shape[0]), sizes):
            unit = np.zeros_like(draw)
            unit[:, list(fixed)] = settings
            unit[p, d] = np.abs(draw[:, d]).max() or 1e-4
            column = self.left(self.slope(fault, unit))
            if self.rms(column) > 1e-12:
                columns.append(column[:, None] / np.linalg.norm(column))
        self.bases[fault.name] = found = _span(np.hstack(columns), _IMITATED)
        return found

    def beyond(self, fault: Fault, moved: Array, others: Iterable[str], together: int = 1) -> dict[str, float]:
        """Residual rms per axis, m, of a displacement after alignment and least squares by other faults' :meth:`basis`.

        One value for each combination of ``together`` testable faults of ``others``, by their names.
        """
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
    """Whether a campaign meets all conditions that a fault wants: motion, repeats, sessions, sensors, known frames."""
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


def sized(gauge: Gauge, fault: Fault, values: Array, wanted: float) -> Array:
    """Scale a fault's values until its residual rms per axis after alignment is ``wanted`` (m), within 1 %.

    Displacements are nearly linear in the values, but for an encoder's steps: of eight iterations at most the nearest
    is returned. :class:`Unseen` if the fault leaves nothing.
    """
    nearest = np.inf, values
    for _ in range(_ROUNDS):
        reached = gauge.leaves(fault, values)
        if reached <= 1e-12:
            raise Unseen(f"{fault.name} cannot be seen in this campaign")
        nearest = min(nearest, (abs(float(np.log(wanted / reached))), values), key=lambda found: found[0])
        if nearest[0] < _NEAR:
            break
        values = fault.scaled(values, wanted / reached)
    return nearest[1]


def shares(gauge: Gauge, fault: Fault, values: Array) -> list[tuple[Place, int, float]]:
    """Places of a fault, each with its index and the first-order residual rms per axis (m) of it alone, descending."""
    found = []
    for p, where in enumerate(fault.places(gauge.setting)):
        alone = fault.scaled(values, 0.0)
        alone[p] = values[p]
        found.append((where, p, gauge.rms(gauge.left(gauge.slope(fault, alone)))))
    return sorted(found, key=lambda item: -item[2])


def place(
    setting: Setting,
    faults: Sequence[tuple[Fault, Array]],
    target: Array,
    instrument: Array | None = None,
    rows: NDArray[np.int64] | None = None,
) -> tuple[Array, Array]:
    """Target positions (N, 3), m, and orientations (N, 3, 3) with these faults, as the instrument reads them.

    ``instrument`` is the (4, 4) pose of the robot's root in its frame, the identity where absent. ``rows`` are the
    indices of rows to compute, all where absent.
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


_CLEAR = 0.25  # of what the largest place leaves: places that leave less are not asked for


def truth(
    case: Case,
    gauge: Gauge,
    done: Sequence[tuple[Fault, Array]],
    background: Sequence[tuple[Fault, Array]],
    noise: float,
) -> dict[str, Any]:
    """Right answers to a case, as the ``truth`` of :mod:`thermal_robot.blind.cases`, without the outliers.

    It covers the faults asked for and those in the background; ``noise`` is one sigma per axis, m.
    """
    parts: dict[str, Any] = {}
    answers: list[Place] = []
    quantities: list[str] = []
    parameters: dict[str, dict[str, float]] = {}
    for fault, values in [*done, *background]:
        sites = shares(gauge, fault, values)
        clear = [item for item in sites if item[2] > _CLEAR * sites[0][2]]
        where = [item[0] for item in clear]
        main = any(fault is other for other, _ in done)
        listed = _named(where if fault.few else [])
        parts[fault.name] = {"ratio": gauge.leaves(fault, values) / noise, "main": main, "places": listed}
        for other, columns in fault.also:
            part = np.zeros_like(values)
            part[:, list(columns)] = values[:, list(columns)]
            parts.setdefault(other, {"ratio": gauge.leaves(fault, part) / noise, "main": False, "places": listed})
        if main and (fault.name == case.unlisted or case.kind in ("removed", "hidden")):
            answers += [*where, *_joints_of(gauge.setting, fault, [item[1] for item in clear])]
            quantities += fault.quantities(gauge.setting, where)
        if fault.name in case.effects:
            parameters[fault.name] = dict(fault.known_as(gauge.setting, values))
    return {
        "effects": list(case.effects),
        "unlisted": case.unlisted,
        "parts": parts,
        "parameters": parameters,
        "places": _named(answers),
        "near": _named(near(gauge.setting.world, answers)),
        "quantities": list(dict.fromkeys(quantities)),
        "needs": [CONDITION[name][0] for name in case.effects if case.hidden and name in CONDITION],
    }


def near(world: World, places: Sequence[Place]) -> list[Place]:
    """Places and their neighbours along the chain: base, link, joint, link, ..., tool.

    A joint's are the two links that it connects and the joint before and after; those of a link the joints at its ends
    and the links beyond them. Links that no joint moves against each other are one.
    """
    at: dict[Place, float] = {("base", "base"): 0.0, ("link", world.tree.root): 0.5}
    moved = 0
    for joint in world.chain:
        moved += joint.movable
        at[("joint", joint.name)] = float(moved) if joint.movable else moved + 0.5
        at[("link", joint.child)] = moved + 0.5
    at[("tool", "tool")] = moved + 1.0
    steps = [at[place] for place in places]
    return [place for place, here in at.items() if any(abs(here - step) <= 1.0 for step in steps)]


def _joints_of(setting: Setting, fault: Fault, numbers: Sequence[int]) -> list[Place]:
    """Movable joints with these numbers in the chain, if the fault displaces joints' placements; else none."""
    chain = setting.world.chain
    if len(fault.places(setting)) != len(chain) or fault.places(setting)[0][0] != "link":
        return []
    return [("joint", chain[p].name) for p in numbers if chain[p].movable]


def _named(places: Sequence[Place]) -> list[dict[str, str]]:
    return [{"kind": kind, "name": name} for kind, name in dict.fromkeys(places)]


SIZE = 0
"""The column of a fault's values that is its size."""
GROWS_ONLY = ("backlash", "joint_compliance")
"""Faults that wear only makes larger."""
_ZEROS = "joint_offset"
_STEP = 1e-4  # rad, rad/(N·m) ...: where a fault has no size yet, of which a derivative could be a share
_PRESENT = 0.1  # × noise: a number that leaves less is not at work
_SEEN = 1e-6  # of a column: what less is left of is rounding


@dataclass(frozen=True, eq=False)
class FaultParameter:
    """Size of a fault in one place, the row ``number`` of its values."""

    fault: Fault
    number: int

    def moved(self, values: Array, by: float) -> Array:
        """Copy of the fault's values (P, D) with the size in this place increased by ``by``."""
        result = values.copy()
        result[self.number, SIZE] += by
        return result

    def change(self, setting: Setting, values: Array, by: float) -> tuple[dict[str, Any], float]:
        """Effect, place and name of the parameter in formats.md, and its change, SI, if this size grows by ``by``."""
        before, after = (dict(self.fault.known_as(setting, v)) for v in (values, self.moved(values, by)))
        [name] = [key for key in after if after[key] != before[key]]
        [place] = _named([self.fault.places(setting)[self.number]])
        return {"effect": self.fault.name, "place": place, "parameter": name}, after[name] - before[name]


def draw_fault_parameter(fault: Fault, values: Array, rng: np.random.Generator) -> FaultParameter:
    """Draw one of the places where a fault's size is not zero; for joint zeros and all-zero faults any inner joint.

    The frames take up what zeros of the first and the last joint do.
    """
    size = values[:, SIZE]
    inner = np.arange(1, len(size) - 1)
    places = inner if fault.name == _ZEROS or not size.any() else np.flatnonzero(size)
    return FaultParameter(fault, int(rng.choice(places)))


def deviation(
    gauge: Gauge, spot: FaultParameter, values: Array, others: Sequence[tuple[Fault, Array]], noise: float
) -> tuple[float, float]:
    """Return the standard deviation σ / |x − P x| of one number of a fault, whose unit moves the target by x, (3M,).

    P projects on the columns of unknown frames, of every joint's zero, and of all other numbers at work; σ is the noise
    per axis, m. The examined program is not used. Also returns the residual rms per axis, m, of a unit of the number
    after alignment.
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
    every, aligned = np.column_stack(beside), gauge.left(own)
    length = np.linalg.norm(every, axis=0)
    beyond = gauge.left(every)
    seen = np.linalg.norm(beyond, axis=0) > _SEEN * length
    span = _span(beyond[:, seen] / length[seen], _SEEN)
    left = aligned - span @ (span.T @ aligned)
    alone = float(np.linalg.norm(left))
    if alone <= _SEEN * float(np.linalg.norm(own)) or alone == 0.0:
        raise Unseen(f"{spot.fault.name} is hidden there by what else is at work")
    return noise / alone, gauge.rms(aligned)


def _columns(gauge: Gauge, fault: Fault, values: Array) -> Iterator[tuple[tuple[int, int], Array]]:
    """Yield the index of each size parameter of a fault, and the derivative (3M,) of the target's position by it."""
    fixed = {column for column, _ in fault.fixed}
    now = gauge.slope(fault, values)
    for p, d in np.ndindex(*values.shape):
        if d not in fixed:
            step = float(np.abs(values[:, d]).max()) or _STEP
            more = values.copy()
            more[p, d] += step
            yield (p, d), (gauge.slope(fault, more) - now) / step


def _span(columns: Array, floor: float) -> Array:
    """Orthonormal basis (E, R) of columns (E, K) by SVD, of singular values above ``floor`` times the largest."""
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, size > floor * size.max(initial=0.0)])
