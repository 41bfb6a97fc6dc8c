"""Candidate data faults of a table: columns concerned, repair, and distance to the prediction after the repair.

Joints' columns are reversed, exchanged, coupled, in another unit or counted from another zero; measured columns are in
another unit, of exchanged or mirrored axes, or turned by another convention; or both are paired wrongly. Nearly all of
these are linear maps of one column.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations, permutations, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from thermal_robot.arrays import Array
from thermal_robot.campaign import Campaign
from thermal_robot.campaign.units import LENGTH_UNITS
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.inference.registration import BaseAndTarget, alternate, middle, starts
from thermal_robot.inference.settings import LEVER, START_ROUNDS
from thermal_robot.kinematics import log3, quaternion_to_rotation, tool_poses
from thermal_robot.observables import of_model
from thermal_robot.observations import Frames
from thermal_robot.robot import Robot

Rows = NDArray[np.bool_]
_COLUMNS = ("q", "position", "orientation", "simulated_position")


@dataclass(frozen=True, eq=False)
class Readings:
    """Columns of a campaign that a data fault may concern; leading axes hold several repaired tables side by side."""

    robot: Robot
    q: Array  # (..., N, n) commanded joint positions, rad or m
    position: Array  # (..., N, 3) as measured, m
    orientation: Array | None  # (..., N, 4) wxyz as measured
    simulated_position: Array | None  # (..., N, 3) what the user's own simulator predicts, m
    clock: Array | None  # (N,) time, s
    base_known: bool
    tool_known: bool
    declared: Frames
    length_unit: str  # in which the file gives positions
    known: Rows  # (N,) rows that are determined: a shifted column ends before the table does

    @classmethod
    def of(cls, campaign: Campaign) -> Readings:
        """Take the columns of a campaign with measurements; frames that another model has set are unknown."""
        return cls(
            campaign.robot,
            campaign.q,
            np.asarray(campaign.position),
            # what axes do to several targets they do to the turn that these tell: their middle says enough
            campaign.orientation if campaign.targets is None else None,
            campaign.simulated_position,
            campaign.covariates.get("time"),
            campaign.base_known and not of_model(campaign),
            campaign.tool_known and not of_model(campaign),
            Frames.declared(campaign),
            campaign.units.length,
            np.ones(campaign.samples, dtype=bool),
        )

    def take(self, rows: NDArray[np.int64]) -> Readings:
        """Return some of the rows, by number; (S, K) numbers give readings side by side."""
        return _combined(lambda column: column[rows], [self], (*_COLUMNS, "clock", "known"))

    def where(self, own: Rows, other: Readings) -> Readings:
        """Combine two tables: rows where ``own`` (..., N) is true from this one, the others from ``other``."""
        return _combined(lambda mine, theirs: np.where(own[..., None], mine, theirs), [self, other])

    @cached_property
    def poses(self) -> Array:
        """Commanded poses (..., N, 4, 4) of the tool frame."""
        rows = tool_poses(self.robot, self.q.reshape(-1, self.robot.n))
        return np.ascontiguousarray(rows).reshape(*self.q.shape[:-1], 4, 4)

    @property
    def spread(self) -> float:
        """Diagonal of the volume over which the commands move the tool, m."""
        return float(np.linalg.norm(np.ptp(self.poses[:, :3, 3], axis=0)))

    @property
    def tolerance(self) -> float:
        """Gap, m, above which robot and table do not match."""
        return settings.MISFIT * self.spread

    def still(self) -> Array:
        """Median distance (...), m, of the measurements from their own median pose, as a robot at rest would have."""
        away2 = _norm2(self.position - np.median(self.position, axis=-2, keepdims=True))
        if self.orientation is not None:
            seen = quaternion_to_rotation(self.orientation)
            u, _, vt = np.linalg.svd(seen.sum(axis=-3))
            away2 = away2 + LEVER**2 * _norm2(log3(seen @ (u @ vt)[..., None, :, :].swapaxes(-1, -2)))
        return np.asarray(np.sqrt(middle(away2)))

    def align(self, *, coarse: bool = False, begun: Array | None = None) -> BaseAndTarget:
        """Estimate the unknown base and target by robust registration; ``coarse``: in few iterations from one start.

        ``begun`` (..., P, 3) are other places of the target to start from, m.
        """
        if begun is None or self.tool_known or self.simulated_position is not None:
            begun = self.declared.tool[:3, 3] + (starts(self)[:1] if coarse else starts(self))
        rounds = settings.COARSE_ROUNDS if coarse else START_ROUNDS
        poses = self.poses if self.simulated_position is None else None
        return alternate(self, self.declared, begun, rounds, poses=poses)[1]

    def distance(self, frames: BaseAndTarget, *, turns: bool = True) -> Array:
        """Distance (..., N) between measured and predicted pose, m; an angle counts times ``LEVER``.

        Without ``turns`` that of positions alone.
        """
        base, tool, poses = frames.base[..., None, :, :], frames.tool[..., None, :, :], self.poses
        predicted = self.simulated_position
        if predicted is None:
            predicted = (poses[..., :3, :] @ tool[..., :, 3:])[..., 0]
        away2 = _norm2(self.position - predicted @ frames.base[..., :3, :3].swapaxes(-1, -2) - base[..., :3, 3])
        if turns and self.orientation is not None and self.simulated_position is None:
            seen = base[..., :3, :3].swapaxes(-1, -2) @ quaternion_to_rotation(self.orientation)
            away = log3(seen @ (poses[..., :3, :3] @ tool[..., :3, :3]).swapaxes(-1, -2))
            away2 = away2 + LEVER**2 * _norm2(away)
        return np.asarray(np.sqrt(away2))

    @property
    def maps_place(self) -> bool:
        """Whether :meth:`relaxed` bounds rigid motions from below: the target's place is known, or rows can fit it."""
        known = self.simulated_position is not None or self.tool_known
        return known or self.q.shape[-2] >= settings.FEWEST_RELAXED

    def relaxed(self, weights: Array | None = None) -> tuple[Array, Array]:
        """Fit an affine map instead of a rigid motion to position and rotation of the tool frame (ridge regression).

        Its residual bounds from below that of any frames, unit, and exchanged or mirrored axes of the instrument. Rows
        have ``weights`` (..., N), equal ones by default without outliers. Returns distances (..., N), over the median
        distance that a robot at rest leaves, and the place (..., 3) of the target on the tool, m.
        """
        poses = self.poses
        if self.simulated_position is not None:
            parts = self.simulated_position
        elif self.tool_known or self.q.shape[-2] < settings.FEWEST_RELAXED:
            parts = (poses[..., :3, :] @ self.declared.tool[:, 3:])[..., 0]
        else:
            parts = np.concatenate([poses[..., :3, 3], poses[..., :3, :3].reshape(*poses.shape[:-2], 9)], axis=-1)
        measured = np.broadcast_to(self.position, (*parts.shape[:-1], 3))
        measured = measured - np.median(measured, axis=-2, keepdims=True)
        size = np.sqrt(_norm2(measured))
        share = size <= settings.STRAY * middle(size)[..., None] if weights is None else weights
        share = (share / share.sum(axis=-1, keepdims=True))[..., None]
        parts, wanted = (own - (share * own).sum(axis=-2, keepdims=True) for own in (parts, measured))
        weighted = (share * parts).swapaxes(-1, -2)
        gram = weighted @ parts
        ridge = settings.RIDGE * (np.trace(gram, axis1=-2, axis2=-1)[..., None, None] + settings.LEAST_GAP**2)
        found = np.linalg.solve(gram + ridge * np.eye(parts.shape[-1]), weighted @ wanted)
        left = np.sqrt(_norm2(wanted - parts @ found)) / (middle(size)[..., None] + settings.LEAST_GAP)
        if parts.shape[-1] < 12:
            return left, np.array(np.broadcast_to(self.declared.tool[:3, 3], (*found.shape[:-2], 3)))
        # m = R o + Σ pₖ R A eₖ: the coefficients of A's entries are pₖ times those of o
        turn, times = found[..., :3, :], found[..., 3:, :].reshape(*found.shape[:-2], 3, 3, 3)
        place = np.einsum("...rkl,...rl->...k", times, turn)
        return left, place / (_norm2(turn).sum(axis=-1)[..., None] + settings.LEAST_GAP**2)


def _combined(how: Callable[..., Any], several: Sequence[Readings], names: Sequence[str] = _COLUMNS) -> Readings:
    """Copy of the first readings with columns computed from the columns of all of them."""
    there = [name for name in names if getattr(several[0], name) is not None]
    columns: dict[str, Any] = {name: how(*(getattr(own, name) for own in several)) for name in there}
    return replace(several[0], **columns)


def stacked(several: Sequence[Readings]) -> Readings:
    """Stack readings of equal numbers of rows along a new first axis."""
    return _combined(lambda *own: np.stack(own), several)


def _norm2(vectors: Array) -> Array:
    """Squared lengths (...) of vectors (..., 3)."""
    return np.asarray((vectors * vectors).sum(axis=-1))


Repair = Callable[[Readings, Rows], Readings]
"""Function from readings and the affected rows (N,) to the readings repaired in these rows."""
Numbered = Callable[[float], tuple[str, Repair]]
"""Function from the number of a fault in its family, such as a time offset, to its place in words and its repair."""


@dataclass(frozen=True)
class Proposal:
    """One candidate fault: its kind, its place in words, and its repair."""

    kind: Kind
    place: str
    repair: Repair
    # those that are turned round, where that is what is wrong: a larger set that fits no better says nothing more
    joints: frozenset[str] = frozenset()


Fault = tuple[Proposal, ...]
"""Fault hypothesis of a table: none, one fault, or two at once, repaired one after the other."""


class Family(NamedTuple):
    """Faults of one kind that differ by a real number, such as a time offset."""

    kind: Kind
    tried: tuple[float, ...]  # numbers, in order, between which the best is looked for
    made: Numbered

    def of(self, number: float) -> Proposal:
        """Return the candidate fault of this family for one value of the number."""
        return Proposal(self.kind, *self.made(number))


@dataclass(frozen=True)
class Kind:
    """Kind of data fault: its name, words and remedy, and the generators of its candidates."""

    name: str  # short, for those who count kinds
    says: str  # what is wrong, ``{}`` standing for the place
    remedy: str  # what to do about it
    # places and repairs of the faults that readings may have, and the joints turned round, if any
    proposals: Callable[[Readings], Iterable[tuple[Any, ...]]] = lambda _: ()
    # numbers to try, and what makes place and repair of one
    offsets: Callable[[Readings], Iterable[tuple[tuple[float, ...], Numbered]]] = lambda _: ()

    def proposed(self, readings: Readings) -> list[Proposal]:
        """Candidate faults of this kind in some readings."""
        return [Proposal(self, *found) for found in self.proposals(readings)]

    def families(self, readings: Readings) -> list[Family]:
        """Families of candidates of this kind, each of faults that differ by a real number."""
        return [Family(self, *found) for found in self.offsets(readings)]


def _changed(column: str, change: Callable[[Array], Array]) -> Repair:
    """Return a repair that applies a function to one column, in the affected rows alone."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        return _combined(lambda own: np.where(struck[:, None], change(own), own), [readings], [column])

    return repair


def _mapped(column: str, matrix: Array, shift: Array | float = 0.0) -> Repair:
    """Return a repair by the affine map matrix · row + shift."""
    return _changed(column, lambda rows: rows @ matrix.T + shift)


def _but(size: int, where: Sequence[int], value: float) -> Array:
    """Diagonal matrix (size, size) of ones, with ``value`` at the places ``where``."""
    return np.diag(np.where(np.isin(np.arange(size), where), value, 1.0))


def _turning(readings: Readings) -> list[int]:
    return [j for j, kind in enumerate(readings.robot.joint_types) if kind != "prismatic"]


# --- joints ---

_USUAL: dict[tuple[int, tuple[int, ...]], str] = {(6, (0, 3, 5)): " (as a KUKA's do)"}
"""Robot makes that count some joints the other way, by the number of joints and those reversed."""


def _reversed(readings: Readings, several: bool) -> Iterator[tuple[str, Repair, frozenset[str]]]:
    """Candidates of joints with reversed sign, small sets first; of many joints small sets alone."""
    count = readings.robot.n
    most = count if count <= settings.MOST_PATTERNS else settings.FEW_REVERSED
    for size in range(2, most + 1) if several else (1,):
        for own in combinations(range(count), size):
            names = [readings.robot.joint_names[j] for j in own]
            usual = _USUAL.get((count, own), "")
            place = f"{', '.join(names[:-1])} and {names[-1]} count the other way round{usual}"
            yield place if several else names[0], _mapped("q", _but(count, own, -1.0)), frozenset(names)


def _coupled(readings: Readings) -> Iterator[tuple[str, Repair]]:
    """Candidates of coupled joints: a column is the sum or difference of the angles of two neighbouring joints."""
    names = readings.robot.joint_names
    for j, k in permutations(_turning(readings), 2):
        if abs(j - k) == 1:
            for word, sign in (("minus", 1.0), ("plus", -1.0)):
                usual = ", as on a Fanuc's pendant" if (j, k, word) == (2, 1, "minus") else ""
                matrix = np.eye(len(names))
                matrix[j, k] = sign
                yield f"{names[j]} holds {names[j]} {word} {names[k]} (coupled{usual})", _mapped("q", matrix)


def _exchanged(column: str, names: Sequence[str] = "xyz") -> Iterator[tuple[str, Repair]]:
    """Candidates in which two components of a column are exchanged."""
    for i, j in combinations(range(len(names)), 2):
        matrix = np.eye(len(names))
        matrix[[i, j]] = matrix[[j, i]]
        yield f"{names[i]} and {names[j]}", _mapped(column, matrix)


def _scaled(readings: Readings, factor: float) -> Iterator[tuple[str, Repair]]:
    turning, robot = _turning(readings), readings.robot
    for j in turning:
        yield robot.joint_names[j], _mapped("q", _but(robot.n, [j], factor))
    if len(turning) > 1:
        yield "all joints", _mapped("q", _but(robot.n, turning, factor))


def _zeros(readings: Readings, degrees: Sequence[float]) -> Iterator[tuple[str, Repair]]:
    one = np.eye(readings.robot.n)
    for j, by in product(_turning(readings), degrees):
        yield readings.robot.joint_names[j], _mapped("q", one, np.deg2rad(by) * one[j])


_HEADERS = "exchange their headers"
JOINT_KINDS = (
    Kind(
        "reversed joint",
        "{} is reversed: it counts the other way round",
        "change the sign of its column",
        partial(_reversed, several=False),
    ),
    Kind("reversed joints", "{}", "change the sign of their columns", partial(_reversed, several=True)),
    Kind("coupled joints", "the column of {}", "undo the coupling", _coupled),
    Kind(
        "exchanged joints",
        "the columns of {} are exchanged",
        _HEADERS,
        lambda own: _exchanged("q", own.robot.joint_names),
    ),
    Kind("degrees read as rad", "degrees are read as rad in {}", "convert them", partial(_scaled, factor=np.pi / 180)),
    Kind("rad read as degrees", "rad are read as degrees in {}", "convert them", partial(_scaled, factor=180 / np.pi)),
    Kind("zero off by 90°", "the zero of {} is 90° off", "add 90° or take it off", partial(_zeros, degrees=(90, -90))),
    Kind("zero off by 180°", "the zero of {} is 180° off", "add 180°", partial(_zeros, degrees=(180,))),
)


# --- measurements ---


def _sizes(readings: Readings, steps: Sequence[float], ask: str = "") -> Iterator[tuple[str, Repair]]:
    """Candidates of wrong units: factors between units, and a conversion that was applied twice or needlessly."""
    read = LENGTH_UNITS[readings.length_unit]
    for by in (sign for step in steps for sign in (step, 1.0 / step)):
        size = f"lengths are {by if by > 1.0 else 1.0 / by:.4g} times too {'small' if by > 1.0 else 'large'}"
        unit = next((own for own, one in LENGTH_UNITS.items() if math.isclose(one / read, by)), "")
        said = f"positions stand in {unit}, not in {readings.length_unit}: {size}" if unit else f"{size}{ask}"
        yield said, _mapped("position", by * np.eye(3))


_CONJUGATE = _but(4, [1, 2, 3], -1.0)
_ORDERS = [
    (f"{own}{also} under headers in the order {headed}", _mapped("orientation", signs @ np.roll(np.eye(4), by, axis=0)))
    for by, own, headed in ((1, "x y z w", "w x y z"), (-1, "w x y z", "x y z w"))
    for also, signs in (("", np.eye(4)), (" and conjugate", _CONJUGATE))
]


_ANGLES = {
    "xyz": "rotations about fixed x y z",
    "zyx": "rotations about fixed z y x",
    "zyz": "rotations about fixed z y z",
    "XYZ": "rotations about turning x y z",
    "ZYX": "rotations about turning z y x",
    "ZYZ": "rotations about turning z y z",
    "rotvec": "a rotation vector",
}
"""Conventions of orientations of three numbers: SciPy's name and words."""


def _converted(taken: str, meant: str, factor: float = 1.0) -> Repair:
    """Repair of orientations whose three numbers have another convention or another unit."""

    def change(wxyz: Array) -> Array:
        turn = Rotation.from_quat(wxyz, scalar_first=True)
        three = turn.as_rotvec() if taken == "rotvec" else turn.as_euler(taken, suppress_warnings=True)
        three = factor * three
        again = Rotation.from_rotvec(three) if meant == "rotvec" else Rotation.from_euler(meant, three)
        return np.asarray(again.as_quat(scalar_first=True))

    return _changed("orientation", change)


def _orientation_kind(name: str, says: str, remedy: str, proposals: Iterable[tuple[str, Repair]]) -> Kind:
    """Make a kind of fault from given proposals, which apply only to readings with measured orientations."""
    found = tuple(proposals)
    return Kind(name, says, remedy, lambda readings: () if readings.orientation is None else found)


_CONVERT = "convert them, or correct length_unit"
UNITS = (
    Kind("metric unit", "{}", "correct length_unit", partial(_sizes, steps=(10.0, 100.0, 1e3, 1e6))),
    Kind("inch", "{}", _CONVERT, partial(_sizes, steps=(25.4, 2.54, 1.0 / 0.0254), ask=" (inches?)")),
    Kind("foot", "{}", _CONVERT, partial(_sizes, steps=(304.8, 30.48, 1.0 / 0.3048), ask=" (feet?)")),
)
_MIRRORS = [(axis, _mapped("position", _but(3, [k], -1.0))) for k, axis in enumerate("xyz")]
AXES = (
    Kind("exchanged axes", "columns {} are exchanged", _HEADERS, lambda _: _exchanged("position")),
    Kind("mirrored axis", "the instrument's axis {} is mirrored", "change its sign", lambda _: _MIRRORS),
)
TURNS = (
    _orientation_kind("quaternion order", "quaternions stand in the order {}", "set the headers right", _ORDERS),
    _orientation_kind(
        "conjugate quaternion",
        "quaternions turn the measurement frame into the target's, not back",
        "change the sign of qx, qy, qz",
        [("", _mapped("orientation", _CONJUGATE))],
    ),
    _orientation_kind(
        "angles of orientations",
        "orientations are made of {}",
        "convert them anew",
        [
            (f"{_ANGLES[meant]}, not of {_ANGLES[taken]}", _converted(taken, meant))
            for taken, meant in permutations(_ANGLES, 2)
        ],
    ),
    _orientation_kind(
        "angles in degrees",
        "angles in rad are read as degrees in {}",
        "convert them anew",
        [(words, _converted(own, own, 180 / np.pi)) for own, words in _ANGLES.items()],
    ),
)
MEASUREMENT_KINDS = (*UNITS, *AXES, *TURNS)


# --- pairing ---

_JOINTS = ("q", "simulated_position")


def _shifted(_: Readings) -> Iterator[tuple[str, Repair]]:
    for by, sign in product(range(1, settings.MOST_SHIFT + 1), (1, -1)):
        place = f"{by} row{'' if by == 1 else 's'} {'below' if sign > 0 else 'above'}"
        yield place, partial(_resampled, by=sign * by, in_rows=True)


def _late(readings: Readings) -> Iterator[tuple[tuple[float, ...], Numbered]]:
    clock = readings.clock
    if clock is None or not np.ptp(clock) > 0.0:
        return
    # the arm goes straight on; waits in its pose; tables were joined by the nearest time; or were interpolated
    styles: list[Callable[..., Readings]] = [partial(_resampled, columns=("q",))]
    styles += [partial(_resampled, least=least) for least in (1.0, 0.5)]
    if len(clock) <= settings.MIXED_ROWS:
        styles += [partial(_unmixed, sign=-1.0, columns=_JOINTS), partial(_unmixed, sign=1.0, columns=("position",))]
    yield from ((_offsets(clock), partial(_at_offset, style)) for style in styles)


def _at_offset(style: Callable[..., Readings], by: float) -> tuple[str, Repair]:
    return f"{abs(by):.3g} s {'earlier' if by < 0 else 'later'}", partial(style, by=by)


def _offsets(clock: Array) -> tuple[float, ...]:
    """Time offsets of the trial grid, s: linear near zero, geometric beyond."""
    between = np.diff(np.sort(clock))
    unit, near = float(np.median(between[between > 0.0])), settings.NEAR_OFFSETS

    def geometric(low: float, high: float) -> Array:
        return np.geomspace(low, high, 1 + round(np.log(high / low) / np.log(settings.OFFSET_RATIO)))

    linear = np.arange(settings.ORDERED, near, settings.ORDERED)
    low, high = geometric(settings.SMALLEST_OFFSET, near), geometric(near, settings.FAR_OFFSETS)
    sizes = np.unique(np.concatenate([low, linear, high])) * unit
    sizes = sizes[sizes < 0.5 * np.ptp(clock)]
    return tuple(float(s) for s in np.concatenate([-sizes[::-1], sizes]))


def _bracketing(clock: Array, by: float) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Rows]:
    """Rows before and after each row's shifted time, weight of the latter, and whether inside the record; each (N,)."""
    order = np.argsort(clock, kind="stable")
    at, ordered = clock + by, clock[order]
    after = np.clip(np.searchsorted(ordered, at, "right"), 1, len(clock) - 1)
    low, high = ordered[after - 1], ordered[after]
    part = np.clip((at - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    return order[after - 1], order[after], part, (at >= ordered[0]) & (at <= ordered[-1])


def _resampled(
    readings: Readings,
    struck: Rows,
    by: float,
    columns: Sequence[str] = _JOINTS,
    least: float | None = None,
    in_rows: bool = False,
) -> Readings:
    """Interpolate columns linearly at times shifted ``by`` s, or rows; with ``least``, take one row of the two."""
    clock = np.arange(len(struck), dtype=float) if in_rows else np.asarray(readings.clock)
    first, second, part, inside = _bracketing(clock, by)
    later = (part if least is None else part >= least)[:, None]

    def change(own: Array) -> Array:
        return np.where(struck[:, None], (1.0 - later) * own[first] + later * own[second], own)

    return replace(_combined(change, [readings], columns), known=~struck | inside)


def _unmixed(readings: Readings, struck: Rows, by: float, sign: float, columns: Sequence[str]) -> Readings:
    """Undo the linear interpolation of columns at times shifted ``by`` s, by the pseudo-inverse of its matrix."""
    first, second, part, _ = _bracketing(np.asarray(readings.clock), sign * by)
    own, matrix = np.arange(len(part)), np.zeros((len(part), len(part)))
    matrix[own, np.where(struck, first, own)] = np.where(struck, 1.0 - part, 1.0)
    matrix[own, second] += np.where(struck, part, 0.0)
    back = np.linalg.pinv(matrix, rcond=settings.UNMIXED)
    known = np.einsum("ij,ji->i", back, matrix) > 1.0 - settings.UNMIXED
    return replace(_combined(lambda column: back @ column, [readings], columns), known=known)


_ANEW = "pair them anew"
PAIRING_KINDS = (
    Kind("shifted rows", "columns are shifted: measurements belong to the joints {}", _ANEW, _shifted),
    Kind("clock offset", "clocks differ: measurements belong to what the joints were {}", _ANEW, offsets=_late),
)
KINDS: tuple[Kind, ...] = (*JOINT_KINDS, *MEASUREMENT_KINDS, *PAIRING_KINDS)
