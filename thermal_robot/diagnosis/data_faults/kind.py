"""Faults of the data: what each is called, what mends it, and the tables in which it is mended.

Joints' columns are reversed, exchanged, coupled, in another unit, counted from another zero; measured columns in
another unit, of exchanged or mirrored axes, of quaternions of another convention; or both are paired wrongly.

Where readings were interpolated to another clock, each is a mixture of what was commanded at two rows: w = A u with two
entries a row of A. What was mixed is given back by A⁺ w, as far as that is determined.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from thermal_robot.arrays import Array
from thermal_robot.campaign.units import LENGTH_UNITS
from thermal_robot.diagnosis.data_faults import settings
from thermal_robot.diagnosis.data_faults.readings import Readings, Rows

Repair = Callable[[Readings, Rows], Readings]
"""Readings, and the (N,) rows that the fault struck; returns the readings mended in these rows."""


@dataclass(frozen=True)
class Proposal:
    """One fault that may have struck, and the readings without it."""

    kind: Kind  # what kind of fault
    # where it struck, in words: joints, columns, how many rows; several are listed where data cannot tell them
    place: str
    repair: Repair  # mends it
    # those that are turned round, where that is what is wrong: a larger set that fits no better says nothing more
    joints: frozenset[str] = frozenset()


Fault = tuple[Proposal, ...]
"""What is wrong with a table: nothing, one fault, or two at once, mended one after the other."""


def repaired(fault: Fault, readings: Readings, struck: Rows) -> Readings:
    """Return the readings with one repair after the other in the rows struck; a row must stay known in each."""
    for proposal in fault:
        readings = proposal.repair(readings, struck)
    return readings


class Offsets(NamedTuple):
    """Faults of one kind that differ by a number: which to try first, and the fault of each."""

    tried: tuple[float, ...]  # numbers, in order, between which the best is looked for
    of: Callable[[float], Proposal]  # returns the proposal of a number


@dataclass(frozen=True)
class Kind:
    """A kind of fault."""

    name: str  # short, for those who count kinds
    says: str  # what is wrong, ``{}`` standing for the place
    remedy: str  # what to do about it
    # yields place and repair of each fault of this kind that readings may have, and the joints turned round, if any
    proposals: Callable[[Readings], Iterable[tuple[str, Repair] | tuple[str, Repair, frozenset[str]]]] = lambda _: ()
    # yields families of such faults that differ by a number
    offsets: Callable[[Readings], Iterable[tuple[tuple[float, ...], Callable[[float], tuple[str, Repair]]]]] = (
        lambda _: ()
    )

    def proposed(self, readings: Readings) -> Iterator[Proposal]:
        """Yield the faults of this kind that readings may have."""
        for found in self.proposals(readings):
            yield Proposal(self, *found)

    def families(self, readings: Readings) -> Iterator[Offsets]:
        """Yield the families of such faults."""
        for tried, of in self.offsets(readings):
            yield Offsets(tried, lambda number, of=of: Proposal(self, *of(number)))  # type: ignore[misc]


def _changed(joints: list[int], change: Callable[[Array], Array]) -> Repair:
    """Return a repair that changes the columns of some joints."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        q = np.array(readings.q)
        q[..., joints] = np.where(struck[:, None], change(q[..., joints]), q[..., joints])
        return replace(readings, q=q)

    return repair


def _turning(readings: Readings) -> list[int]:
    return [j for j, kind in enumerate(readings.robot.joint_types) if kind != "prismatic"]


def sign_patterns(joints: int) -> NDArray[np.int64]:
    """(P, n) signs of the joints, all that are not all right; the fewest reversed first, of many joints the first."""
    most = joints if joints <= settings.MOST_PATTERNS else settings.FEW_REVERSED
    sets = [own for count in range(1, most + 1) for own in combinations(range(joints), count)]
    return np.array([[-1 if j in own else 1 for j in range(joints)] for own in sets])


def reversing(signs: NDArray[np.int64], readings: Readings) -> tuple[str, Repair, frozenset[str]]:
    """Return place and repair of joints that are reversed, those of sign −1, and their names."""
    joints = [int(j) for j in np.flatnonzero(signs < 0)]
    names = [readings.robot.joint_names[j] for j in joints]
    usual = " (as a KUKA's do)" if len(signs) == settings.KUKA_JOINTS and joints == settings.KUKA_REVERSED else ""
    said = f"{', '.join(names[:-1])} and {names[-1]} count the other way round{usual}" if names[1:] else names[0]
    return said, _changed(joints, np.negative), frozenset(names)


def _reversed(readings: Readings, several: bool) -> Iterator[tuple[str, Repair, frozenset[str]]]:
    for signs in sign_patterns(readings.robot.n):
        if ((signs < 0).sum() > 1) is np.bool_(several):
            yield reversing(signs, readings)


def _coupled(readings: Readings) -> Iterator[tuple[str, Repair]]:
    """Pendants that count a joint from the ground, not from the link before it, and wrists that turn together."""
    names = readings.robot.joint_names
    for j, k in permutations(range(len(names)), 2):
        if abs(j - k) == 1 and readings.robot.joint_types[j] != "prismatic" != readings.robot.joint_types[k]:
            for word, sign in (("minus", 1.0), ("plus", -1.0)):
                usual = ", as on a Fanuc's pendant" if (j, k, word) == (2, 1, "minus") else ""
                place = f"{names[j]} holds {names[j]} {word} {names[k]} (coupled{usual})"
                yield place, _changed([j, k], lambda two, s=sign: two + two[..., 1:] * [s, 0.0])  # type: ignore[misc]


def _exchanged(readings: Readings) -> Iterator[tuple[str, Repair]]:
    names = readings.robot.joint_names
    for i, j in combinations(range(len(names)), 2):
        yield f"{names[i]} and {names[j]}", _changed([i, j], lambda two: two[..., ::-1])


def _scaled(readings: Readings, factor: float) -> Iterator[tuple[str, Repair]]:
    turning = _turning(readings)
    for j in turning:
        yield readings.robot.joint_names[j], _changed([j], lambda angle: angle * factor)
    if len(turning) > 1:
        yield "all joints", _changed(turning, lambda angle: angle * factor)


def _zeros(readings: Readings, shifts: tuple[float, ...]) -> Iterator[tuple[str, Repair]]:
    for j in _turning(readings):
        for shift in shifts:
            yield readings.robot.joint_names[j], _changed([j], lambda angle, by=shift: angle + by)  # type: ignore[misc]


JOINT_KINDS = (
    Kind(
        "reversed joint",
        "{} is reversed: it counts the other way round",
        "change the sign of its column",
        partial(_reversed, several=False),
    ),
    Kind("reversed joints", "{}", "change the sign of their columns", partial(_reversed, several=True)),
    Kind("coupled joints", "the column of {}", "undo the coupling", _coupled),
    Kind("exchanged joints", "the columns of {} are exchanged", "exchange their headers", _exchanged),
    Kind("degrees read as rad", "degrees are read as rad in {}", "convert them", partial(_scaled, factor=np.pi / 180)),
    Kind("rad read as degrees", "rad are read as degrees in {}", "convert them", partial(_scaled, factor=180 / np.pi)),
    Kind(
        "zero off by 90°",
        "the zero of {} is 90° off",
        "add 90° or take it off",
        partial(_zeros, shifts=(settings.TURN / 2, -settings.TURN / 2)),
    ),
    Kind("zero off by 180°", "the zero of {} is 180° off", "add 180°", partial(_zeros, shifts=(settings.TURN,))),
)


def _measured(column: str, change: Callable[[Array], Array]) -> Repair:
    """Return a repair that changes measured positions, or orientations."""

    def repair(readings: Readings, struck: Rows) -> Readings:
        measured = np.asarray(getattr(readings, column))
        return replace(readings, **{column: np.where(struck[:, None], change(measured), measured)})  # type: ignore[arg-type]

    return repair


_at_places, _turns_changed = partial(_measured, "position"), partial(_measured, "orientation")


def _sizes(readings: Readings, steps: tuple[float, ...], ask: str = "") -> Iterator[tuple[str, Repair]]:
    """Propose factors; one that is no unit beside the declared one was applied twice, or where none was due."""
    if readings.spread() > settings.LARGEST_VOLUME:
        return
    read = LENGTH_UNITS[readings.length_unit]
    for by in (sign for step in steps for sign in (step, 1.0 / step)):
        size = f"lengths are {by if by > 1.0 else 1.0 / by:.4g} times too {'small' if by > 1.0 else 'large'}"
        unit = next((own for own, one in LENGTH_UNITS.items() if abs(one / read / by - 1.0) < settings.ALIKE), "")
        said = f"positions stand in {unit}, not in {readings.length_unit}: {size}" if unit else f"{size}{ask}"
        yield said, _at_places(lambda p, by=by: p * by)  # type: ignore[misc]


def _axes_exchanged(_: Readings) -> Iterator[tuple[str, Repair]]:
    for i, j in combinations(range(3), 2):
        order = [{i: j, j: i}.get(k, k) for k in range(3)]
        yield f"{'xyz'[i]} and {'xyz'[j]}", _at_places(lambda p, order=order: p[..., order])  # type: ignore[misc]


def _mirrored(_: Readings) -> Iterator[tuple[str, Repair]]:
    for k, axis in enumerate("xyz"):
        sign = np.where(np.arange(3) == k, -1.0, 1.0)
        yield axis, _at_places(lambda p, sign=sign: p * sign)  # type: ignore[misc]


_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def _ordered(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        for by, own, headed in ((1, "x y z w", "w x y z"), (-1, "w x y z", "x y z w")):
            for also, sign in (("", np.ones(4)), (" and conjugate", _CONJUGATE)):
                place = f"{own}{also} under headers in the order {headed}"
                yield place, _turns_changed(lambda q, by=by, sign=sign: np.roll(q, by, axis=-1) * sign)  # type: ignore[misc]


def _conjugate(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        yield "", _turns_changed(lambda wxyz: wxyz * _CONJUGATE)


ANGLES = {
    "xyz": "rotations about fixed x y z",
    "zyx": "rotations about fixed z y x",
    "zyz": "rotations about fixed z y z",
    "XYZ": "rotations about turning x y z",
    "ZYX": "rotations about turning z y x",
    "ZYZ": "rotations about turning z y z",
    "rotvec": "a rotation vector",
}
"""Three numbers that tell a turn, as SciPy names them, and in words."""


def _three(quaternions: Array, meant: str) -> Array:
    """(N, 3) rad, of which these (N, 4) quaternions were made."""
    turn = Rotation.from_quat(np.roll(quaternions, -1, axis=-1))
    return np.asarray(turn.as_rotvec() if meant == "rotvec" else turn.as_euler(meant, suppress_warnings=True))


def _wxyz(three: Array, meant: str) -> Array:
    turn = Rotation.from_rotvec(three) if meant == "rotvec" else Rotation.from_euler(meant, three)
    return np.asarray(np.roll(turn.as_quat(), 1, axis=-1))


def _angles(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        for taken, meant in permutations(ANGLES, 2):
            change = lambda wxyz, taken=taken, meant=meant: _wxyz(_three(wxyz, taken), meant)  # noqa: E731
            yield f"{ANGLES[meant]}, not of {ANGLES[taken]}", _turns_changed(change)


def _angles_in_degrees(readings: Readings) -> Iterator[tuple[str, Repair]]:
    if readings.orientation is not None:
        for own, words in ANGLES.items():
            yield words, _turns_changed(lambda wxyz, own=own: _wxyz(np.rad2deg(_three(wxyz, own)), own))  # type: ignore[misc]


UNITS = (
    Kind("metric unit", "{}", "correct length_unit", partial(_sizes, steps=settings.METRIC)),
    Kind(
        "inch", "{}", "convert them, or correct length_unit", partial(_sizes, steps=settings.INCHES, ask=" (inches?)")
    ),
    Kind("foot", "{}", "convert them, or correct length_unit", partial(_sizes, steps=settings.FEET, ask=" (feet?)")),
)
AXES = (
    Kind("exchanged axes", "columns {} are exchanged", "exchange their headers", _axes_exchanged),
    Kind("mirrored axis", "the instrument's axis {} is mirrored", "change its sign", _mirrored),
)
TURNS = (
    Kind("quaternion order", "quaternions stand in the order {}", "set the headers right", _ordered),
    Kind(
        "conjugate quaternion",
        "quaternions turn the measurement frame into the target's, not back",
        "change the sign of qx, qy, qz",
        _conjugate,
    ),
    Kind("angles of orientations", "orientations are made of {}", "convert them anew", _angles),
    Kind("angles in degrees", "angles in rad are read as degrees in {}", "convert them anew", _angles_in_degrees),
)
MEASUREMENT_KINDS = (*UNITS, *AXES, *TURNS)


_JOINTS, _MEASURED = ("q", "simulated_position"), ("position",)


def _shifted(readings: Readings) -> Iterator[tuple[str, Repair]]:
    for rows in (sign * k for k in range(1, settings.MOST_SHIFT + 1) for sign in (1, -1)):
        yield (
            f"{abs(rows)} row{'' if abs(rows) == 1 else 's'} {'below' if rows > 0 else 'above'}",
            partial(_rolled, by=rows),
        )


def _rolled(readings: Readings, struck: Rows, by: int) -> Readings:
    source = np.arange(len(readings.q)) + by
    there = (source >= 0) & (source < len(source))
    source = np.where(struck & there, source, np.arange(len(source)))
    return _joints_of(readings, source, ~struck | there)


def _joints_of(readings: Readings, source: NDArray[np.int64], known: Rows) -> Readings:
    """Return the readings with the joints of other rows."""
    columns = {name: column[source] for name in _JOINTS if (column := getattr(readings, name)) is not None}
    return replace(readings, **columns, known=known)


def _offsets(readings: Readings) -> tuple[float, ...]:
    """Return the offsets that are tried, s: linear where they are near, geometric beyond and below."""
    ordered = np.sort(np.asarray(readings.clock))
    between = np.diff(ordered)[np.diff(ordered) > 0.0]
    if not len(between):
        return ()
    unit, longest = float(np.median(between)), 0.5 * float(np.ptp(ordered))
    ratio, near = settings.OFFSET_RATIO, settings.NEAR_OFFSETS
    low = np.geomspace(
        settings.SMALLEST_OFFSET, near, 1 + round(np.log(near / settings.SMALLEST_OFFSET) / np.log(ratio))
    )
    middle = np.arange(settings.ORDERED, near, settings.ORDERED)
    far = np.geomspace(near, settings.FAR_OFFSETS, 1 + round(np.log(settings.FAR_OFFSETS / near) / np.log(ratio)))
    sizes = np.unique(np.concatenate([low, middle, far])) * unit
    sizes = sizes[sizes < longest]
    return tuple(float(s) for s in np.concatenate([-sizes[::-1], sizes]))


def _late(readings: Readings) -> Iterator[tuple[tuple[float, ...], Callable[[float], tuple[str, Repair]]]]:
    clock = readings.clock
    if clock is None or not np.ptp(clock) > 0.0:
        return
    tried = _offsets(readings)
    # the arm goes straight on; waits in its pose; tables were joined by the nearest time
    for style in (_between, partial(_of_one, least=1.0), partial(_of_one, least=0.5)):
        yield tried, lambda by, style=style: (_words(by), partial(style, by=by))  # type: ignore[misc]
    if len(clock) <= settings.MIXED_ROWS:
        yield tried, lambda by: (_words(by), partial(_unmixed, by=-by, columns=_JOINTS))
        yield tried, lambda by: (_words(by), partial(_unmixed, by=by, columns=_MEASURED))


def _words(by: float) -> str:
    return f"{abs(by):.3g} s {'earlier' if by < 0 else 'later'}"


def _places(readings: Readings, by: float) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Rows]:
    """Return for each row at its time and an offset: the rows before and after, the part of the latter, what is known.

    All (N,), by row numbers of the table.
    """
    clock = np.asarray(readings.clock)
    order = np.argsort(clock, kind="stable")
    at = clock + by
    after = np.clip(np.searchsorted(clock[order], at, "right"), 1, len(clock) - 1)
    low, high = clock[order[after - 1]], clock[order[after]]
    part = np.clip((at - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    inside = (at >= clock[order[0]]) & (at <= clock[order[-1]])
    return order[after - 1], order[after], part, inside


def _between(readings: Readings, struck: Rows, by: float) -> Readings:
    """Joints between two rows, where the arm goes straight from one to the next."""
    first, second, part, inside = _places(readings, by)
    q = (1.0 - part)[:, None] * readings.q[first] + part[:, None] * readings.q[second]
    return replace(readings, q=np.where(struck[:, None], q, readings.q), known=~struck | inside)


def _of_one(readings: Readings, struck: Rows, by: float, least: float) -> Readings:
    """Joints of one row: of the next where so large a part of the way to it is gone, else of the last one."""
    first, second, part, inside = _places(readings, by)
    source = np.where(part >= least, second, first)
    return _joints_of(readings, np.where(struck, source, np.arange(len(source))), ~struck | inside)


def _unmixed(readings: Readings, struck: Rows, by: float, columns: tuple[str, ...]) -> Readings:
    """Columns that were interpolated at another time, as they were before."""
    first, second, part, _ = _places(readings, by)
    own = np.arange(len(part))
    mixture = np.zeros((len(part), len(part)))
    mixture[own, np.where(struck, first, own)] = np.where(struck, 1.0 - part, 1.0)
    mixture[own, second] += np.where(struck, part, 0.0)
    back = np.linalg.pinv(mixture, rcond=settings.MIXED_FLOOR)
    known = np.einsum("ij,ji->i", back, mixture) > settings.UNMIXED
    changed = {name: back @ column for name in columns if (column := getattr(readings, name)) is not None}
    return replace(readings, **changed, known=known)


PAIRING_KINDS = (
    Kind("shifted rows", "columns are shifted: measurements belong to the joints {}", "pair them anew", _shifted),
    Kind(
        "clock offset", "clocks differ: measurements belong to what the joints were {}", "pair them anew", offsets=_late
    ),
)
KINDS: tuple[Kind, ...] = (*JOINT_KINDS, *MEASUREMENT_KINDS, *PAIRING_KINDS)
