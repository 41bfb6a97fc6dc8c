"""Logs that tell nothing of the joints' servos, refused with the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermal_robot.arrays import Array
from thermal_robot.campaign.names import listed
from thermal_robot.errors import CampaignError
from thermal_robot.motion.following import Moves, at, usual_step
from thermal_robot.motion.log import Motion, MotionLog
from thermal_robot.motion.settings import FOREIGN, FROZEN, LEAST_RATE, LONGEST_LAG, NO_LAG, STILL_COMMAND, STRIDE


def refused(log: MotionLog, files: str) -> MotionLog:
    """Raise an error if no servo can be identified from a log; else return it with notes on what is doubtful."""
    rate = 1.0 / float(np.median([usual_step(motion.position) for motion in log.motions]))
    if rate < LEAST_RATE:
        raise CampaignError(files, "is sampled too slowly", found=f"{rate:.3g} Hz", expected="at least 30 Hz")
    if not log.commanded:
        return log
    copied = [motion.name for motion in log.motions if _copied(motion)]
    led = [m.name for m in log.motions if m.name in copied or _foreign(m) > FOREIGN or _dropped(m)]
    if len(led) == len(log.motions):
        how = "the command is the encoder's own reading" if copied else "the joints move while the command stands still"
        problem = (
            f"{how}: an external force, such as a hand or, where the torque is off, the weight, moved it, and no servo"
        )
        raise CampaignError(files, problem, expected="motions that follow a command")
    notes = list(log.notes)
    if led:
        notes.append(f"left out, as an external force moved them and not their commands: the motions {listed(led)}")
        log = replace(log, motions=tuple(motion for motion in log.motions if motion.name not in led))
    if fed_forward(log):
        problem = "the joints follow their commands without the lag of a position servo: feed-forward unknown"
        if all(motion.torque is None for motion in log.motions):
            expected = "columns tau.<joint>, or [servo.<joint>] kp where it is a position servo"
            raise CampaignError(files, f"{problem}; a cascaded controller's gap tells no effect", expected=expected)
        notes.append(f"{problem}; the torque tells, and the gap does not")
    return replace(log, notes=tuple(notes))


def _foreign(motion: Motion) -> float:
    """Share of the squared measured motion with no command moving within LONGEST_LAG; 0 if nothing moves."""
    moves = Moves.of(motion)
    moving = np.abs(moves.commanded).max(axis=1) > STILL_COMMAND
    reach = int(np.ceil(LONGEST_LAG / moves.step))
    near = np.convolve(moving, np.ones(2 * reach + 1))[reach : reach + len(moving)] > 0.5
    energy = (moves.measured**2).sum(axis=1)
    return float(energy[~near].sum() / max(energy.sum(), 1e-12))


def _dropped(motion: Motion) -> bool:
    """Whether a joint leaves a command at rest, by FROZEN farther than it ever was from a moving one: no servo does."""
    import pandas as pd

    times = motion.position.time
    command, before = (at(motion.command, times - shift) for shift in (0.0, STRIDE))
    error = np.nan_to_num(np.abs(command - motion.position.values))
    still = np.abs(command - before) <= STILL_COMMAND
    began = pd.DataFrame(np.where(still, np.nan, error)).ffill().fillna(np.inf).to_numpy()  # where it came to rest
    largest = np.where(still, 0.0, error).max(axis=0)
    return bool((still & (error > np.maximum(largest, began) + FROZEN)).any())


def _copied(motion: Motion) -> bool:
    """Whether the command equals the encoder's reading at its instants in all joints that move."""
    q, measured = at(motion.position, motion.command.time), motion.position.values
    moved = np.nanmax(measured, axis=0) - np.nanmin(measured, axis=0) > STILL_COMMAND
    same = np.isclose(q, motion.command.values, rtol=0.0, atol=1e-9) | np.isnan(motion.command.values)
    return bool(moved.any() and same[:, moved].all())


def explains_torques(log: MotionLog) -> bool:
    """Whether torques are fitted and no servo: all motions have them, and commands are absent or fed forward."""
    return all(motion.torque is not None for motion in log.motions) and (not log.commanded or fed_forward(log))


def fed_forward(log: MotionLog) -> bool:
    """Whether joints of unstated kp move, and each that does has a median lag below :data:`NO_LAG` in size."""
    lags = np.array([_lags(motion) for motion in log.motions])  # (motions, joints), NaN where a joint rests
    lags = lags[:, [log.servo(joint).kp is None for joint in log.joints]]
    moving = ~np.isnan(lags).all(axis=0)
    return bool(moving.any()) and bool((np.abs(np.nanmedian(lags[:, moving], axis=0)) < NO_LAG).all())


def _lags(motion: Motion) -> Array:
    """(joints,) lag, s: minus the slope on commanded velocity in a regression of the gap on position and velocity."""
    times = motion.position.time
    command, q = at(motion.command, times), motion.position.values
    speed = np.gradient(command, times, axis=0)
    lags = np.full(q.shape[1], np.nan)
    for j in range(q.shape[1]):
        kept = ~np.isnan(q[:, j] + command[:, j])
        if np.ptp(command[kept, j], axis=0) > 100.0 * STILL_COMMAND if kept.any() else False:
            columns = np.column_stack([np.ones(kept.sum()), command[kept, j], speed[kept, j]])
            lags[j] = -np.linalg.lstsq(columns, q[kept, j] - command[kept, j], rcond=None)[0][2]
    return lags
