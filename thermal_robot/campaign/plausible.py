"""Plausibility checks of a campaign, a sentence each; detection of missing-value markers and of copied rows.

Instruments write −9999, 999, 0 0 0 or their last reading where they see no target. Such a figure is in several rows,
equal to the last digit, and does not follow the robot: under any rigid base and tool a measured coordinate is linear in
the nominal position and rotation matrix of the tool frame (13 coefficients), whatever the instrument's unit and axes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from thermal_robot.arrays import Array
from thermal_robot.campaign.campaign import Campaign
from thermal_robot.campaign.names import CLOCK, axes_of, listed
from thermal_robot.campaign.names import POSITION as XYZ
from thermal_robot.campaign.table import listed_rows
from thermal_robot.campaign.units import LENGTH_UNITS
from thermal_robot.kinematics import align, tool_poses

Mask = NDArray[np.bool_]

FEWEST_ROWS = 10  # rows from which figures that all end alike were rounded, and are no accident
# residuals over the others' median that tell a mark: three figures that are equal by chance are rare, one is not
ASTRAY_PLACE, ASTRAY_FIGURE = 3.0, 10.0
SAME_COMMAND = 1e-3  # rad or m: controllers repeat a pose to better, and a pose of its own is farther away
ROUNDING = 1e-6  # share of a coordinate's spread that counts as no distance: the last digits of exact figures
ROUNDS = 30  # of reweighted least squares, after which the least absolute deviations have settled to a per cent
STEADIEST = 1e-6  # m per axis: no arm repeats to better, so that equal figures that are finer were copied
RARE = 0.05  # expected number of repeats that agree by chance, above which equal rows may be repeats


def marks(campaign: Campaign) -> tuple[Mask, list[str]]:
    """Detect rows that hold a missing-value marker instead of a position: mask (N,), and a sentence for each marker."""
    places = [] if campaign.position is None else [(XYZ, campaign.position)]
    if campaign.targets is not None:
        axes = map(axes_of, campaign.targets.numbers)
        places = list(zip(axes, campaign.targets.points.swapaxes(0, 1), strict=True))
    places = places if campaign.samples >= FEWEST_ROWS else []
    found = [mark for columns, points in places for mark in _of_points(campaign, columns, points)]
    none = np.zeros(campaign.samples, dtype=bool)
    return np.any([none, *(rows for rows, _ in found)], axis=0), [sentence for _, sentence in found]


def _of_points(campaign: Campaign, names: tuple[str, ...], points: Array) -> Iterator[tuple[Mask, str]]:
    """Yield mask (N,) and sentence of each missing-value marker among positions (N, 3), m, NaN where not seen.

    A marker is a value that is equal at different commands and far off the regression on the nominal poses.
    """
    q, seen = campaign.q, np.asarray(np.isfinite(points).all(axis=1))
    places, figures = _equal(q, points, seen), [_equal(q, points[:, k], seen) for k in range(3)]
    # places that most rows share were meant: a ball in its socket
    if not any((places, *figures)) or 2 * sum(int(rows.sum()) for rows in places) > seen.sum():
        return
    away, told = _away(campaign, points, seen), points / campaign.units.length_scale
    for rows in places:
        if _astray(np.linalg.norm(away, axis=1), rows, seen, ASTRAY_PLACE):
            seen = seen & ~rows
            each = [_figure(value) for value in told[rows][0]]
            one = f"{' = '.join(names)} = {each[0]}"
            same = one if len(set(each)) == 1 else f"({', '.join(names)}) = ({', '.join(each)})"
            yield rows, f"{same} in {listed_rows(campaign.rows[rows])}: was the beam lost?"
    for k, name in enumerate(names):
        for rows in (group & seen for group in figures[k]):
            if _moved(q, rows) and _astray(away[:, k], rows, seen, ASTRAY_FIGURE):
                marked = f"{_figure(told[rows, k][0])} in {listed_rows(campaign.rows[rows])}"
                yield rows, f"{name} is {marked}: a mark of a missing value?"


def _equal(q: Array, values: Array, seen: Mask) -> list[Mask]:
    """Masks (N,) of the rows that share one exact value, for each value at different commands, most frequent first."""
    _, group, counts = np.unique(values[seen], axis=0, return_inverse=True, return_counts=True)
    groups = np.full(len(seen), -1)
    groups[seen] = group.reshape(-1)
    several = [groups == g for g in np.argsort(-counts, kind="stable") if counts[g] > 1]
    return [rows for rows in several if _moved(q, rows)]


def _moved(q: Array, rows: Mask) -> bool:
    """Whether the commands of some rows differ by more than 1e-3 rad or m in any joint."""
    return bool(rows.sum() > 1 and np.ptp(q[rows], axis=0).max() > SAME_COMMAND)


def _astray(away: Array, rows: Mask, seen: Mask, times: float) -> bool:
    """Whether the median residual of rows exceeds ``times`` the others' median, and they are fewer than the others."""
    others = seen & ~rows
    return bool(rows.sum() < others.sum() and np.median(away[rows]) > times * np.median(away[others]))


def _away(campaign: Campaign, points: Array, seen: Mask) -> Array:
    """Absolute residuals (N, 3), m, of the least-absolute-deviation regression of coordinates on the nominal poses."""
    poses = tool_poses(campaign.robot, campaign.q)
    known = [np.ones((len(poses), 1)), poses[:, :3, 3], poses[:, :3, :3].reshape(-1, 9)]
    different = len(np.unique(np.round(campaign.q[seen] / SAME_COMMAND), axis=0))
    # with fewer poses so many unknowns would follow the marks themselves
    design = np.hstack(known if different >= 3 * 13 else known[:2])
    away = np.full(points.shape, np.nan)
    for k in range(3):
        values, given = points[seen, k], design[seen]
        distance = np.abs(values - np.median(values))  # so that a mark far away does not bend the first fit
        least = max(ROUNDING * float(np.median(distance)), 1e-12)
        distance = np.maximum(distance, np.median(distance))
        for _ in range(ROUNDS):
            weight = 1.0 / np.sqrt(np.maximum(distance, least))
            fitted = given @ np.linalg.lstsq(given * weight[:, None], values * weight, rcond=None)[0]
            distance = np.abs(values - fitted)
        away[seen, k] = np.maximum(distance, least)
    return away


def copies(campaign: Campaign) -> Mask:
    """Mask (N,) of duplicated rows: equal to an earlier one in every recorded column, and not a repeated measurement.

    A repeat may have the same digits, but not the same time. Without a time or order, equal rows count as repeats if
    the figures are so coarse that more than 0.05 pairs are expected to agree by chance.
    """
    return np.asarray(_originals(campaign) != np.arange(campaign.samples))


def doubled(campaign: Campaign) -> Iterator[str]:
    """Yield a sentence that names duplicated rows."""
    if campaign.position is None:
        return
    original = _originals(campaign)
    again = original != np.arange(campaign.samples)
    rows = campaign.rows[again]
    if len(rows) == 1:
        yield f"rows {campaign.rows[original[again][0]]} and {rows[0]} are the same in every column: a copy, no repeat"
    elif len(rows):
        first = campaign.rows[np.unique(original[again])]
        yield f"{listed_rows(rows)} are the same in every column as {listed_rows(first)}: copies, no repeats"


def _originals(campaign: Campaign) -> NDArray[np.int64]:
    """Index (N,) of the first row that each row is a copy of, in every recorded column; its own where it is no copy."""
    recorded = [values[:, None] for name, values in campaign.covariates.items() if name not in campaign.derived]
    labels = [np.unique(label, return_inverse=True)[1][:, None] for label in campaign.labels.values()]
    measured = [part for part in (campaign.position, campaign.orientation) if part is not None]
    measured += [values[:, None] for values in campaign.readings.values()]
    table = np.hstack([campaign.q, *measured, *recorded, *labels])
    _, first, same = np.unique(table, axis=0, return_index=True, return_inverse=True)
    timed = any(name in campaign.covariates for name in CLOCK)
    if len(first) == len(table) or (not timed and _by_chance(campaign) > RARE):
        return np.arange(len(table))
    return np.asarray(first[same.reshape(-1)])


def _by_chance(campaign: Campaign) -> float:
    """Return the expected number of pairs of repeats with equal positions by chance, from scatter and resolution."""
    _, pose, counts = np.unique(campaign.q, axis=0, return_inverse=True, return_counts=True)
    position, pose = np.asarray(campaign.position), pose.reshape(-1)
    middle = np.array([np.bincount(pose, axis) for axis in position.T]).T / counts[:, None]
    scatter = np.sqrt(((position - middle[pose]) ** 2).mean(axis=0))
    sigma = np.maximum(scatter, max(campaign.noise_position or 0.0, STEADIEST))
    step = step_of(position / campaign.units.length_scale) * campaign.units.length_scale
    # the difference of two repeats is normal with √2 σ; its density at 0 times the step
    alike = np.prod(np.minimum(1.0, step / (2.0 * math.sqrt(math.pi) * sigma)))
    return float(alike * (counts * (counts - 1) / 2).sum())


def step_of(values: Array) -> float:
    """Resolution of figures: the largest power of ten from 1e-6 to 1000 of which all are multiples; 0 without one."""
    for power in range(3, -7, -1):
        parts = values * 10.0**-power
        if np.abs(parts - np.round(parts)).max() < 1e-6 * max(1.0, float(np.abs(parts).max()) * 1e-6):
            return 10.0**power
    return 0.0


def _figure(value: float) -> str:
    return f"{value + 0.0:.10g}".replace("-", "−")


LIMIT_TOLERANCE = 1e-6  # rad or m by which a command may pass a limit: the last digit of a file is not a violation
MOST_TURNS = 2  # turns of a command at most: wrists and cables allow two to either side; 13 degrees as rad are more
LEAST_ANGLE = 2 * math.pi  # degrees that a real campaign exceeds; commands in rad read as degrees stay within one turn
FEWEST_COMMANDS = 3  # rows from which small commands are a habit and not an accident
# lengths are compared with the reach by coarse bounds, as one that is read in a wrong unit is a thousand times off
FARTHEST_TARGET = 3.0  # reaches within which a target sits on the arm: a long tool is shorter
WORST_INSTRUMENT = 0.01  # reaches, one sigma of an instrument at most: 1 cm for 1 m, worse than a tape measure
LARGEST_EXTENT = 4.0  # reaches with the target: the ball that it can reach is two across; two more for commands outside
SMALLEST_EXTENT = 1 / 200  # reaches over which positions extend at least, once enough joints move: 5 mm for 1 m
MOVES = 0.5  # rad or m of a joint's range that carry the target visibly
MOVING_JOINTS = 3  # joints that may move and leave the target in place: those of a wrist about a target on its axes
LONGEST_ARM, SHORTEST_ARM = 100.0, 0.01  # m: mobile cranes reach 90 m, arms under a microscope some centimetres
THOUSAND = 1000.0  # by what lengths are too short that were converted to m twice
LONG_ARM = 10.0  # m: an arm that is longer is looked at; excavators reach 15
APART = 0.4  # ln of extents within which they tell a unit: cm and inches are 0.93 apart, a target changes them by less
TINY = 1e-9  # m, an extent that is none
URDF_UNITS = {"mm": "a thousand", "cm": "a hundred", "inch": "39"}
"""Units in which URDFs were exported, and how many times too long their links then are."""
LONG_TOOL = 0.5  # m from the tool frame at most of a target whose place is fitted: a welding gun, a long pointer
WORST_ARM = 0.05  # reaches by which no arm errs
PAIRED = 200  # rows, spread evenly, whose distances from each other are looked at
WARMEST = 55.0  # °C, median of a robot at most, whose motors run at 50: a hall of 20 °C has 68 °F
HOTTEST = 150.0  # °C that no robot reaches, whose grease ends at 120: 20 °C are 293 K
HEAVIEST = 3.0  # payload over the arm's mass at most: the strongest carry what they weigh, and grams are a thousand
HEAVIEST_ALONE = 1000.0  # kg, payload at most where the URDF has no masses: the largest robots carry as much
COARSEST_TURN = 0.1  # rad that no instrument's one-sigma exceeds, 6 degrees
FINEST = 1e-7  # m that no instrument that measures robots reaches: a laser tracker has some ten micrometres
ROUNDED_TO = 5e-4  # m: positions read to no better are told of where no noise is stated; every arm repeats to better
GRID = 5e-5  # m rms by which rounded commands move the tool, from which that is told: half of what good arms repeat to
SLIDES = 10.0  # limits of a slide: what is commanded beyond is in a wrong unit, the next one being a thousand
ANOTHER_ROBOT = 0.02  # reaches: a simulator of the same robot, however measured, is nearer to the URDF


def doubts(campaign: Campaign) -> list[str]:
    """Sentences of all plausibility checks, none for an ordinary campaign."""
    (marked, lost), robot = marks(campaign), campaign.robot
    seen = campaign.take(~marked) if marked.any() else campaign
    told = []
    for joint in (name for name in robot.joint_names if name not in robot.chain.names):
        led = [segment.name for segment in robot.segments if segment.joint == joint]
        word, verb = ("joint", "mimics") if len(led) == 1 else ("joints", "mimic")
        follows = f"{word} {listed(led)} of the chain {verb}"
        told.append(f"{follows} {joint!r}, which is outside the chain: its column is read")
    told += [*lost, *doubled(campaign), *_angle_unit(campaign), *([*_length_unit(seen)] or _apart(seen))]
    told += [*_limits(campaign), *_conditions(campaign), *_declared(campaign)]
    return [*told, *_rounded(seen), *_grid(campaign), *_simulator(campaign)]


def _angle_unit(campaign: Campaign) -> Iterator[str]:
    robot, units = campaign.robot, campaign.units
    turning = np.flatnonzero([kind != "prismatic" for kind in robot.joint_types])
    values = campaign.q[:, turning]
    if not values.size:
        return
    most = float(np.abs(values).max())
    if units.angle == "rad" and most > 2 * math.pi * MOST_TURNS:
        row, joint = np.unravel_index(int(np.abs(values).argmax()), values.shape)
        yield (
            f"joint {robot.joint_names[turning[joint]]!r} is commanded to {values[row, joint]:.6g} rad in row "
            f'{campaign.rows[row]}, more than two turns: is angle_unit = "deg" meant?'
        )
    small = most <= math.radians(LEAST_ANGLE)
    if units.angle == "deg" and campaign.samples >= FEWEST_COMMANDS and small and np.ptp(np.abs(values)) > 0:
        yield f'no joint leaves ±{most / units.angle_scale:.3g} degrees: is angle_unit = "rad" meant?'


def _reach(campaign: Campaign) -> float:
    """Maximum reach of the arm, m: the sum of its lengths; infinite where a slide has no limit."""
    robot = campaign.robot
    travel = np.maximum(np.abs(robot.lower), np.abs(robot.upper))[np.array(robot.joint_types) == "prismatic"]
    return sum(segment.length for segment in robot.segments) + float(travel.sum())


def another_unit(campaign: Campaign) -> float | None:
    """Detect a URDF in a wrong length unit: factor that converts it to m; ``None`` if the arm's length is plausible."""
    length = sum(segment.length for segment in campaign.robot.segments)
    if length <= LONG_ARM:
        return THOUSAND if 0.0 < length < SHORTEST_ARM else None
    if campaign.position is not None:
        led = tool_poses(campaign.robot, campaign.q)[:, :3, 3]
        wide, seen = (max(float(np.linalg.norm(np.ptp(own, axis=0))), TINY) for own in (led, campaign.position))
        for unit in URDF_UNITS:
            if abs(np.log(wide / seen * LENGTH_UNITS[unit])) < APART:
                return LENGTH_UNITS[unit]
    return LENGTH_UNITS["mm"] if length > LONGEST_ARM else None


def in_another_unit(factor: float) -> str:
    """Describe in words the wrong unit of a URDF, from the factor that converts its lengths to m."""
    if factor > 1.0:
        return "the links of the URDF are a thousand times too short"
    unit = min(URDF_UNITS, key=lambda own: abs(np.log(factor / LENGTH_UNITS[own])))
    return f"the URDF stands in {unit}: its links are {URDF_UNITS[unit]} times too long"


def _length_unit(campaign: Campaign) -> Iterator[str]:
    """Yield doubts on the length unit, from target, noise and extent of positions compared with the arm's reach."""
    robot, reach, factor = campaign.robot, _reach(campaign), another_unit(campaign)
    if factor is not None:
        yield f"{in_another_unit(factor)}, {reach:.3g} m together"
        return
    if not np.isfinite(reach):
        return
    ask = f'the arm reaches {reach:.3g} m: is length_unit = "{campaign.units.length}" right?'
    target = float(np.linalg.norm(campaign.target))
    if target > FARTHEST_TARGET * reach:
        yield f"the target lies {target:.3g} m away from {robot.tool_frame!r} and {ask}"
    if campaign.noise_position is not None and campaign.noise_position > WORST_INSTRUMENT * reach:
        yield f"the noise of position is {campaign.noise_position:.3g} m and {ask}"
    if campaign.position is None:
        return
    extent = float(np.ptp(campaign.position, axis=0).max())
    # A target on the last axes stays in place while they turn, so more than three joints have to move.
    moved = int((np.ptp(campaign.q, axis=0) > MOVES).sum())
    if extent > LARGEST_EXTENT * (reach + target) or (extent < SMALLEST_EXTENT * reach and moved > MOVING_JOINTS):
        yield f"the measured positions extend over {extent:.3g} m and {ask}"


def _apart(campaign: Campaign) -> Iterator[str]:
    """Yield a doubt if two points were measured farther apart than their commands allow for any base and target."""
    reach = _reach(campaign)
    simulated = campaign.simulated_position is not None
    if campaign.position is None or simulated or campaign.samples < FEWEST_ROWS or not np.isfinite(reach):
        return
    rows = np.linspace(0, campaign.samples - 1, min(campaign.samples, PAIRED)).round().astype(int)
    poses, measured = tool_poses(campaign.robot, campaign.q[rows]), campaign.position[rows]
    led, lie = cdist(poses[:, :3, 3], poses[:, :3, 3]), cdist(measured, measured)
    turns = poses[:, :3, :3].reshape(len(rows), 9)
    target = float(np.linalg.norm(campaign.target))
    lever = target if campaign.tool_known else max(target, LONG_TOOL)
    # two points of the tool come apart by the norm of the difference of their turns, 2 sin(angle / 2), times the lever
    allowed = led + lever * np.sqrt(np.maximum(3.0 - turns @ turns.T, 0.0)) + WORST_ARM * reach
    sessions = campaign.labels.get("session")
    if sessions is not None:
        allowed[sessions[rows][:, None] != sessions[rows]] = np.inf
    i, j = np.unravel_index(int((lie - allowed).argmax()), lie.shape)
    if lie[i, j] > allowed[i, j]:
        first, second = sorted((int(campaign.rows[rows[i]]), int(campaign.rows[rows[j]])))
        yield (
            f"rows {first} and {second} were measured {lie[i, j]:.3g} m apart, and their commands lead "
            f"{led[i, j]:.3g} m apart: no place of base and target mends that, unless one was moved in between; is the "
            f'URDF that of the robot, and is length_unit = "{campaign.units.length}" right?'
        )


def _limits(campaign: Campaign) -> Iterator[str]:
    robot, units = campaign.robot, campaign.units
    joints = list(zip(robot.joint_names, robot.joint_types, campaign.q.T, robot.lower, robot.upper, strict=True))
    free = [name for name, kind, _, *bounds in joints if kind != "continuous" and np.isinf(bounds).any()]
    if free:
        yield f"the URDF gives no limits for {listed(free)}: no command is checked against any there"
    for name, kind, q, lower, upper in joints:
        outside = np.flatnonzero((q < lower - LIMIT_TOLERANCE) | (q > upper + LIMIT_TOLERANCE))
        if len(outside):
            first, scale, unit = q[outside[0]], units.joint_scale(kind), units.joint_unit(kind)
            limit = f"{first / scale:.6g} {unit}, limit {(upper if first > upper else lower) / scale:.6g} {unit}"
            yield f"joint {name!r} is outside its limits in {_rows(campaign, outside)}: {limit}"
        farthest, limit = float(np.abs(q).max()), max(abs(lower), abs(upper))
        if kind == "prismatic" and math.isfinite(limit) and farthest > SLIDES * limit:
            yield (
                f"joint {name!r} slides, is commanded to {farthest:.4g} m and its limit is {limit:.4g} m: "
                f"is its column in {units.length}, as length_unit says?"
            )


def _conditions(campaign: Campaign) -> Iterator[str]:
    covariates, robot = campaign.covariates, campaign.robot
    time, speed = (covariates.get(name, np.empty(0)) for name in ("time", "speed"))
    back = np.flatnonzero(np.diff(time) < 0) + 1
    if len(back):
        times, row = f"{len(back)} time{'s' if len(back) > 1 else ''}", back[0]
        fell = f"{time[row]:.6g} s after {time[row - 1]:.6g} s"
        yield f"column 'time' runs backwards {times}, first in row {campaign.rows[row]}: {fell}"
    outside = np.flatnonzero((speed < 0) | (speed > 1))
    if len(outside):
        where = f"{_rows(campaign, outside)}: {speed[outside[0]]:.6g}"
        yield f"column 'speed' is outside 0..1 in {where}; it is a fraction of the maximum, not per cent"
    names = [n for n in covariates if n.split(".")[0] == "temperature" and n not in campaign.extra]
    told = [(f"column {n!r} has a median of", float(np.median(covariates[n]))) for n in names]
    for what, value in (*told, ("the reference temperature is", campaign.reference_temperature)):
        if value > WARMEST:
            yield f"{what} {value:.4g} °C: are these {'kelvin' if value > HOTTEST else 'degrees Fahrenheit'}?"
    heaviest = float(covariates.get("payload", np.zeros(1)).max())
    if heaviest > (HEAVIEST * robot.mass if robot.has_masses else HEAVIEST_ALONE):
        beside = f", and the arm weighs {robot.mass:.3g} kg" if robot.has_masses else ""
        yield f"the payload is up to {heaviest:.4g} kg{beside}: are these grams?"


def _rows(campaign: Campaign, chosen: NDArray[np.int64]) -> str:
    return f"{len(chosen)} row{'s' if len(chosen) != 1 else ''}, first in row {campaign.rows[chosen[0]]}"


def _declared(campaign: Campaign) -> Iterator[str]:
    """Yield doubts on declarations: a pose label with different commands, noise too large or too fine to be real."""
    labels = np.empty(0, dtype=str) if campaign.pose_labels is None else campaign.pose_labels
    known = [str(label) for label in np.unique(labels[labels != ""])]
    different = [label for label in known if np.ptp(campaign.q[labels == label], axis=0).max() > SAME_COMMAND]
    if different:
        yield f"rows with the same pose label have different joint commands: {listed(different, 5)}"
    turn, place = campaign.noise_orientation, campaign.noise_position
    if turn is not None and turn > COARSEST_TURN:
        yield f"the noise of orientation is {turn:.3g} rad, {math.degrees(turn):.3g} degrees: is it in rad?"
    if place is not None and place < FINEST:
        yield (
            f"the noise of position is {1e6 * place:.3g} µm, finer than any instrument that measures robots: "
            f"is it in {campaign.units.length}, as length_unit says?"
        )


def _rounded(campaign: Campaign) -> Iterator[str]:
    if campaign.position is None or campaign.samples < FEWEST_ROWS or not np.ptp(campaign.position) > 0.0:
        return
    step = step_of(campaign.position / campaign.units.length_scale) * campaign.units.length_scale
    alone, noise = step / math.sqrt(12.0), campaign.noise_position
    if step and (alone > noise if noise else step > ROUNDED_TO):
        stated = f", and the noise is stated as {1e3 * noise:.3g} mm" if noise else ""
        rounded = f"the measured positions are rounded to {1e3 * step:.3g} mm"
        yield f"{rounded}, which alone is a noise of {1e3 * alone:.2g} mm{stated}"


def _grid(campaign: Campaign) -> Iterator[str]:
    units, reach = campaign.units, _reach(campaign)
    turning = [j for j, kind in enumerate(campaign.robot.joint_types) if kind != "prismatic"]
    values = campaign.q[:, turning] / units.angle_scale
    if not turning or campaign.samples < FEWEST_ROWS or not math.isfinite(reach):
        return
    # who types commands takes few of them again and again
    if min(len(np.unique(column)) for column in values.T) <= campaign.samples / 2:
        return
    step = step_of(values)
    moved = step * units.angle_scale / math.sqrt(12.0) * reach
    if moved > max(GRID, campaign.noise_position or 0.0):
        yield (
            f"all joint commands are multiples of {step:g} {units.angle}: if they were rounded in writing, "
            f"that alone moves the tool by about {1e3 * moved:.2g} mm"
        )


def _simulator(campaign: Campaign) -> Iterator[str]:
    predicted, reach = campaign.simulated_position, _reach(campaign)
    if predicted is None or campaign.samples < FEWEST_ROWS or not math.isfinite(reach):
        return
    poses = tool_poses(campaign.robot, campaign.q)
    own = poses[:, :3, 3] + poses[:, :3, :3] @ campaign.target
    motion = align(own, predicted, np.ones(len(own)))
    away = float(np.sqrt(((own @ motion[:3, :3].T + motion[:3, 3] - predicted) ** 2).sum(axis=1).mean()))
    if away > ANOTHER_ROBOT * reach:
        yield (
            f"sim.x, sim.y, sim.z are of another robot, tool or units than the URDF: aligned as well as can be, "
            f"they are {away:.3g} m away from it"
        )
