"""Faults of a log, found before faults of the robot: stamps, stale readings, exchanged joints, signs, units.

Each is a statistic with its standard error from the scatter between motions, and is reported beyond :data:`CLEAR`
standard errors. What can be undone is undone; a joint whose readings are of no use is left out.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import listed
from thermal_robot.motion import clocks, settings
from thermal_robot.motion.columns import UNITS
from thermal_robot.motion.following import Correlation, at, clusters, parts, slope, usual_step
from thermal_robot.motion.log import Channel, Motion, MotionLog
from thermal_robot.motion.model import Mask
from thermal_robot.motion.refuse import explains_torques
from thermal_robot.motion.torque import TorqueModel

_STEP_TAIL = 0.999  # quantile of an encoder's steps that a jump exceeds
_JUMP = 3.0  # times that
_SERVOS = ("velocity", "torque", "current", "temperature")  # what a joint's own servo reports beside its position
_LEAST = 0.1  # quantile of the motions' lags that counts as the least
_TINY = 1e-12


@dataclass(frozen=True)
class Fault:
    """A fault of the log.

    Attributes
    ----------
    joint
        Whose; empty where it is of all joints.
    what
        ``"jitter"``, ``"clock"``, ``"swap"``, ``"sign"``, ``"shift"``, ``"stale"`` or ``"unit"``.
    size, sigma
        A share (jitter, swap, stale), a ratio (clock, sign, unit) or s (shift), and its standard error.
    told
        In a sentence, with what was done about it.
    motion
        Label; empty where it is of all motions.
    """

    joint: str
    what: str
    size: float
    sigma: float
    told: str
    motion: str = ""


@dataclass(frozen=True, eq=False)
class Sound:
    """A log with its faults undone where that is possible; ``joints`` are those that may be fitted."""

    log: MotionLog
    joints: tuple[str, ...]
    faults: tuple[Fault, ...]


def find_faults(log: MotionLog) -> Sound:
    """Find faults of a log by cross-correlation and regression, and undo them: data validation before identification.

    Parameters
    ----------
    log
        As read.

    Returns
    -------
    Sound
        The log with what could be undone undone, the joints that may be fitted, and the faults.

    Examples
    --------
    >>> import numpy as np, pandas as pd
    >>> import thermal_robot as tr
    >>> from thermal_robot.motion import find_faults, motion_from_table
    >>> t = np.arange(0.0, 40.0, 0.02)
    >>> q = np.sin(t) + np.sin(1.7 * t)
    >>> moved = pd.DataFrame({"time": t, "cmd.joint_1": q, "q.joint_1": -np.interp(t - 0.06, t, q)})
    >>> find_faults(motion_from_table(tr.load_robot("builtin:rv_m2", "tool0"), moved)).faults[0].what
    'sign'
    """
    faults: list[Fault] = []
    lost: set[str] = set()
    for check in (_jitter, _clock, _swaps, _signs, _stale, _shifts, _gains, _speeds, _loads):
        log, found, unusable = check(log)
        faults += [fault for fault in found if fault.joint not in lost]
        lost |= unusable
    return Sound(log, tuple(joint for joint in log.joints if joint not in lost), tuple(faults))


_Checked = tuple[MotionLog, list[Fault], set[str]]


def _changed(log: MotionLog, channels: Sequence[str], values: Callable[[Array], Array]) -> MotionLog:
    """Return the log with the values of some channels, given by name, mapped by a function."""
    return log.with_motions(lambda motion: motion.with_channels(channels, lambda c: Channel(c.time, values(c.values))))


def _named(log: MotionLog, struck: Mask, what: str, size: Array, error: Array, told: str, *more: Array) -> list[Fault]:
    """Return a fault for each joint of a mask; in its sentence {0} is the joint, {1} and {2} size and its error."""
    each = [(log.joints[j], float(size[j]), float(error[j]), *(of[j] for of in more)) for j in np.flatnonzero(struck)]
    return [Fault(one[0], what, one[1], one[2], told.format(*one)) for one in each]


def _jitter(log: MotionLog) -> _Checked:
    spread, felt, error = clocks.jitter(log)
    if not (spread > settings.UNEQUAL and abs(felt) < settings.CLEAR * error < 1.0 - felt):
        return log, [], set()
    told = f"the encoder's stamps jitter by {spread:.0%} of a step and its samples do not: put on an even clock"
    return log.with_motions(clocks.evened), [Fault("", "jitter", spread, error, told)], set()


def _clock(log: MotionLog) -> _Checked:
    if not clocks.two_clocks(log):
        return log, [], set()
    found, error = clocks.rate(log)
    if not abs(found - 1.0) > settings.CLEAR * error:
        return log, [], set()
    told = (
        f"the commands' clock runs {found:.5f} ± {error:.5f} times as fast as the readings', which is brought to it; "
        "which of the two is wrong the log does not tell"
    )
    changed = log.with_motions(lambda motion: clocks.reclocked(motion, lambda t: found * t))
    return changed, [Fault("", "clock", found, error, told)], set()


def _shifts(log: MotionLog) -> _Checked:
    found = clocks.shifts(log) if clocks.two_clocks(log) else {}
    if not found:
        return log, [], set()
    if len(found) > len(log.motions) // 2:  # all by one amount: the least lag becomes none
        sizes = np.array([size for size, _ in found.values()])
        size, error = float(np.quantile(sizes, _LEAST)), float(sizes.std() / np.sqrt(len(sizes)))
        told = (
            f"the readings come {-size:.3f} ± {error:.3f} s before their commands: moved by that; no delay can be told "
            "from this log"
        )
        faults = [Fault("", "shift", size, error, told)]
        found = dict.fromkeys((motion.name for motion in log.motions), (size, error))
    else:
        told = "the readings of motion {!r} are stamped {:+.3f} ± {:.3f} s from where the others' lag puts them: moved"
        faults = [Fault("", "shift", *each, told.format(name, *each), name) for name, each in found.items()]
    late = {name: size for name, (size, _) in found.items()}
    return log.with_motions(lambda m: clocks.reclocked(m, lambda t: t - late.get(m.name, 0.0))), faults, set()


def _swaps(log: MotionLog) -> _Checked:
    """Assign readings to commands by the share explained (linear assignment); exchange them where significant."""
    from scipy.optimize import linear_sum_assignment

    pieces = [(moves, Correlation.of(moves)) for moves in clusters(log)]
    stirred = np.stack([1.0 * (piece.measured > len(moves.time) * settings.STIRRED**2) for moves, piece in pieces])
    shares = np.stack([piece.explained / np.maximum(piece.measured, _TINY)[:, None] for _, piece in pieces])
    shares *= stirred[:, :, None]
    rows, order = linear_sum_assignment(-shares.sum(axis=0))
    gain, error = slope(stirred, shares[:, rows, order] - shares[:, rows, rows])
    clear = (order != rows) & (gain > settings.CLEAR * error)
    if not clear.any() or not np.array_equal(np.sort(order[clear]), rows[clear]):
        return log, [], set()
    own = np.argsort(np.where(clear, order, rows))  # whose readings belong to each joint
    told = (
        "the readings called {0} follow the command of {3}, which explains {1:.0%} ± {2:.0%} of their moves more than "
        "its own: exchanged; the commands may be instead"
    )
    faults = _named(log, clear, "swap", gain, error, told, np.array(log.joints)[order])
    along = _SERVOS if (_likeness(log)[clear] > settings.LIKE).all() else ()
    return _changed(log, ("position", *along), lambda values: values[:, own]), faults, set()


def _signs(log: MotionLog) -> _Checked:
    pieces = [Correlation.of(moves) for moves in clusters(log)]
    size = np.stack([np.sqrt(np.maximum(piece.measured * piece.commanded, 0.0)) for piece in pieces])
    likeness, error = slope(size, np.stack([np.diag(piece.peaks) for piece in pieces]))
    turned = likeness < -settings.CLEAR * error
    if not turned.any():
        return log, [], set()
    told = "q.{0} moves against cmd.{0} (correlation {1:.3f} ± {2:.3f}): turned round; the command may be instead"
    faults, along = _named(log, turned, "sign", likeness, error, told), turned & (_likeness(log) > settings.LIKE)
    return _turned(_turned(log, turned, "position"), along, "velocity", "torque"), faults, set()


def _turned(log: MotionLog, joints: Mask, *channels: str) -> MotionLog:
    return _changed(log, channels, lambda values: values * np.where(joints, -1.0, 1.0))


def _gains(log: MotionLog) -> _Checked:
    """Compare the sizes of measured moves that follow their command with it; convert known units, drop unknown ones."""
    pieces = [Correlation.of(moves) for moves in clusters(log)]
    each = np.array([(piece.commanded, piece.measured, np.diag(piece.explained)) for piece in pieces]) + _TINY
    commanded, measured, explained = each.swapaxes(0, 1)
    follows = (explained > settings.FOLLOWS * measured) & (commanded > 1e3 * _TINY)
    sizes = np.where(follows, 0.5 * np.log(measured / commanded), 0.0)
    middle, error = slope(follows.astype(float), sizes)
    scale, _ = slope(*_windows(log)[:2])
    faults, lost, factor = [], set(), np.ones(len(log.joints))
    for j in np.flatnonzero(np.abs(middle) > np.maximum(np.log(settings.OTHER_GAIN), settings.CLEAR * error)):
        joint, size, sigma = log.joints[j], float(np.exp(middle[j])), float(np.exp(middle[j]) * error[j])
        word, factor[j] = _remedy(size, float(scale[j]))
        if not word and size < 1.0:
            continue  # a soft servo under load: less than the command is no sign of a unit that nobody knows
        lost |= set() if word else {joint}
        done = f"taken for {word}" if word else "the joint is left out"
        told = f"q.{joint} moves {size:.4g} ± {sigma:.2g} times as far as cmd.{joint}: another unit, {done}"
        faults.append(Fault(joint, "unit", size, sigma, told))
    return _changed(log, ["position"], lambda values: values / factor) if faults else log, faults, lost


def _remedy(size: float, speeds: float) -> tuple[str, float]:
    """Return the unit whose factor is nearest that of position over command, and the factor; "", 1 if none is near."""
    known = {word: 1.0 / scale for word, scale in UNITS["q"].items() if scale != 1.0}
    known |= {f"rad, the command for {word}": 1.0 / factor for word, factor in known.items()}
    if speeds > 0.0:
        known[f"{speeds:.4g} rad, as the integral of qd says"] = speeds
    nearest = min(known, key=lambda word: abs(np.log(size / known[word])))
    near = abs(np.log(size / known[nearest])) < np.log(settings.OTHER_GAIN) / 2.0
    return (nearest, known[nearest]) if near else ("", 1.0)


def _speeds(log: MotionLog) -> _Checked:
    """Regress position changes on the integral of velocity in 1 s windows; rescale velocity, or drop a foreign one."""
    squares, products, moved = _windows(log)
    scale, error = slope(squares, products)
    foreign = (np.abs(_likeness(log)) < settings.LIKE) & (moved.sum(axis=0) > settings.FROZEN)
    other = (np.abs(scale - 1.0) > np.maximum(settings.OTHER_UNIT, settings.CLEAR * error)) & ~foreign
    told = (
        "q.{0} is {1:.4f} ± {2:.4f} of what qd.{0} integrates to: the unit of one is wrong; q goes with cmd.{0}, so qd "
        "is brought to it"
    )
    strange = "qd.{0} is not the velocity of q.{0}, which is {1:.2f} ± {2:.2f} of what it integrates to: left out"
    faults = _named(log, other, "unit", scale, error, told) + _named(log, foreign, "swap", scale, error, strange)
    faults.sort(key=lambda fault: log.joints.index(fault.joint))
    factor = np.where(foreign, np.nan, np.where(other, scale, 1.0))
    return _changed(log, ["velocity"], lambda values: values * factor), faults, set()


def _loads(log: MotionLog) -> _Checked:
    """Regress recorded torques on the rigid-body model's along the motion; reverse those of clearly negative slope."""
    if not (log.robot.has_masses and explains_torques(log)):
        return log, [], set()
    found, error = TorqueModel(log).signs()
    turned = (found < -settings.CLEAR * error) & (found < settings.LEAST_AGAINST)
    told = "tau.{0} is {1:.3f} ± {2:.3f} of the torque that the URDF's masses need: of the other sign, turned round"
    return _turned(log, turned, "torque"), _named(log, turned, "sign", found, error, told), set()


def _likeness(log: MotionLog) -> Array:
    """(joints,) correlation of position changes with the integral of velocity in 1 s windows; 1 without velocity."""
    squares, products, moved = (each.sum(axis=0) for each in _windows(log))
    return np.where(squares > _TINY, products / np.sqrt(np.maximum(squares * moved, _TINY)), 1.0)


def _windows(log: MotionLog) -> tuple[Array, Array, Array]:
    """Return sums over windows, (clusters, joints): integrals² of velocity, integrals · position changes, changes²."""
    sums = []
    for motion in log.motions:
        if motion.velocity is None:
            continue
        t, v = motion.velocity.time, np.nan_to_num(motion.velocity.values)
        integral = cumulative_trapezoid(v, t, axis=0, initial=0.0)
        # whether the nearest reading before an instant, or at it, is a gap
        before = np.clip(np.searchsorted(motion.position.time, t, "right") - 1, 0, None)
        q, gaps = at(motion.position, t), np.cumsum(np.isnan(motion.position.values)[before], axis=0)
        count = max(1, int(np.searchsorted(t - t[0], settings.WINDOW)))
        whole = gaps[count:] == gaps[:-count]
        x, y = (np.where(whole, values[count:] - values[:-count], 0.0) for values in (integral, np.nan_to_num(q)))
        for rows in np.array_split(np.arange(len(x)), parts(log)):
            sums.append([(a[rows] * b[rows]).sum(axis=0) for a, b in ((x, x), (x, y), (y, y))])
    if not sums:
        return (np.zeros((1, len(log.joints))),) * 3
    squares, products, moved = np.array(sums).swapaxes(0, 1)
    return squares, products, moved


def _stale(log: MotionLog) -> _Checked:
    """Set frozen readings to NaN; drop a joint frozen in over half its motions for a median share above one half."""
    blank = [np.zeros(motion.position.values.shape, dtype=bool) for motion in log.motions]
    faults, lost = [], set()
    for j, joint in enumerate(log.joints):
        for motion, rows in zip(log.motions, blank, strict=True):
            for run in _frozen_runs(motion, j):
                rows[run, j] = True
        shares = np.array([rows[:, j].mean() for rows in blank])
        if not shares.any():
            continue
        names = [motion.name for motion, share in zip(log.motions, shares, strict=True) if share]
        useless = 2 * len(names) > len(shares) and float(np.median(shares[shares > 0.0])) > 0.5
        lost |= {joint} if useless else set()
        size, error = float(shares.mean()), float(shares.std() / np.sqrt(len(shares)))
        done = "the joint is left out" if useless else "those rows are left out"
        how = f"in {size:.1%} ± {error:.1%} of the rows ({listed(names, 3)})"
        told = f"q.{joint} stays the same while its command passes by, {how}: {done}"
        faults.append(Fault(joint, "stale", size, error, told))
    rest = iter(blank)
    changed = _changed(log, ["position"], lambda values: np.where(next(rest), np.nan, values)) if faults else log
    return changed, faults, lost


def _frozen_runs(motion: Motion, j: int) -> Iterator[slice]:
    """Yield the row ranges in which a joint's reading stays the same while its command moves past it.

    The command's moving average over the longest lag passes it on both sides, which no stop and no friction allows; or
    it moves on and the reading jumps at the end.
    """
    q, step = motion.position.values[:, j], usual_step(motion.position)
    width = max(1, round(settings.LONGEST_LAG / step))
    command = np.nan_to_num(at(motion.command, motion.position.time)[:, j])
    steps = np.abs(np.diff(q))
    edges = np.concatenate([[0], np.flatnonzero(~(steps == 0.0)) + 1, [len(q)]])
    moved = steps[steps > 0.0]
    jump = max(_JUMP * float(np.quantile(moved, _STEP_TAIL)), settings.FROZEN / 2.0) if len(moved) else np.inf
    for begin, end in itertools.pairwise(edges):
        if end - begin < width or np.isnan(q[begin]):
            continue
        gap = np.convolve(command[begin:end] - q[begin], np.ones(width) / width, "valid")
        passed = gap.max() > settings.FROZEN / 2.0 and gap.min() < -settings.FROZEN / 2.0
        if passed or (np.ptp(gap) > settings.FROZEN and end < len(q) and steps[end - 1] > jump):
            yield slice(begin, end)
