"""Logs of a five-joint arm whose servos lag, sag and stick: as tables, to be spoilt in a place, and as files."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from thermal_robot.motion import motion_from_table, read_motion
from thermal_robot.robot import load_robot

JOINTS = tuple(f"joint_{k}" for k in range(1, 6))
STEP, COUNT = 0.02, 2 * np.pi / 4096
TOML = """[robot]
urdf = "builtin:rv_m2"
[motion]
log = ["state.csv", "command.csv"]
angle_unit = "rad"
"""


@cache
def robot():
    return load_robot("builtin:rv_m2", "tool0")


def servo(command, time, lag, stick):
    """A joint that is drawn after its command and sticks while the pull is small; (n,) rad."""
    q, v = np.empty_like(command), 0.0
    q[0] = command[0]
    for k in range(1, len(time)):
        pull = command[k] - q[k - 1]
        v = np.sign(pull) * max(abs(pull) - stick, 0.0) / lag
        q[k] = q[k - 1] + (time[k] - time[k - 1]) * v
    return q


@cache
def _tables(motions, seconds, seed):
    draw = np.random.default_rng(seed)
    states, commands = [], []
    for m in range(motions):
        jitter = draw.uniform(-0.1, 0.1, round(seconds / STEP)) * STEP
        time = np.arange(0.0, seconds, STEP) + np.where(np.arange(len(jitter)) > 0, jitter, 0.0)
        fine = np.arange(0.0, seconds + 1.0, 0.002)
        state, command = {"motion": f"m{m}", "time": time}, {"motion": f"m{m}", "time": np.arange(0.0, seconds, STEP)}
        for k, joint in enumerate(JOINTS):
            size, rate, phase = draw.uniform([0.1, 0.3, 0.0], [0.3, 4.0, 6.0], (3, 3)).T[:, :, None]
            wave = (size * (np.sin(rate * fine + phase) - np.sin(phase))).sum(axis=0)
            reached = servo(wave, fine, 0.05 + 0.01 * k, 0.004)
            command[f"cmd.{joint}"] = np.interp(command["time"], fine, wave)
            speed = np.gradient(reached, fine)
            state[f"q.{joint}"] = COUNT * np.round(np.interp(time, fine, reached) / COUNT)
            state[f"qd.{joint}"] = np.interp(time, fine, speed) + draw.normal(0.0, 0.01, len(time))
        states.append(pd.DataFrame(state))
        commands.append(pd.DataFrame(command))
    return pd.concat(states, ignore_index=True), pd.concat(commands, ignore_index=True)


def tables(motions=6, seconds=20.0, seed=1):
    """State and command of some motions."""
    state, command = _tables(motions, seconds, seed)
    return state.copy(), command.copy()


def log(state, command, **told):
    return motion_from_table(robot(), [state, command], **told)


def put(folder: Path, state=None, command=None, toml=TOML) -> Path:
    own = tables(3)
    (own[0] if state is None else state).to_csv(folder / "state.csv", index=False)
    (own[1] if command is None else command).to_csv(folder / "command.csv", index=False)
    (folder / "motion.toml").write_text(toml)
    return folder


def read(folder: Path, *tables, toml=TOML):
    return read_motion(put(folder, *tables, toml=toml))
