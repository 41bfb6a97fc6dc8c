"""Calibration of a UR10 whose base and tool are unknown, against programs that do just that."""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path

import numpy as np
from benchmarks.parts import Part
from benchmarks.peers.environments import PEERS, calibrated
from benchmarks.timing import by_turns

import thermal_robot as tr
from thermal_robot.effects import Geometric
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import exp3

ARM = ("example-robot-data:ur10", "tool0")
ROWS = (50, 500)
OFF, NOISE = 5e-4, 5e-5
"""Standard deviation of each component of each placement's error, m and rad; of the instrument per axis, m."""
FRESH = 500
"""Poses that nobody fits, without noise: what a calibration is for."""
TEXT = (
    "A UR10, every component of every placement off by 0.5 mm or 0.5 mrad (one sigma), positions with 0.05 mm of "
    "noise per axis, base and target unknown: the tracker is metres away, the target beside the tool. "
    "`tr.calibrate` fits the default effects; *told* is with all parameters, their deviations and the test of what "
    "is left. FIGAROH's time is that of `initialize`, which chooses parameters, and `solve`; *solving* is that of "
    "`solve` alone. robotkinecal does not fit where the tracker stands, and is handed positions in the root frame. "
    "*left* is the rms distance on the rows that were fitted, *fresh* that of 500 poses that nobody fitted to the "
    "true places without noise. *parameters* are counted with those of the frames; ours are held to their expected "
    "sizes, so that there may be more than the data determine. Ratios are of medians; ours is measured before and "
    "after each peer. Each program runs on one thread."
)


def campaigns(rows):
    """Return what is measured, and fresh poses without noise."""
    robot = tr.load_robot(*ARM)
    count = len(Geometric().parameters(tr.observe(tr.simulate(robot, rows=2))))
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3], tool[:3, 3] = exp3(np.array([0.1, -0.2, 2.0])), [1.0, 2.0, 0.3], [0.05, 0.02, 0.1]
    own = {"geometric": np.random.default_rng(1).normal(0.0, OFF, count)}
    drawn = tr.simulate(robot, rows=FRESH, seed=99).q
    return (
        tr.simulate(robot, own, rows=rows, noise=NOISE, base=base, tool=tool, seed=2),
        tr.simulate(robot, own, commands=drawn, base=base, tool=tool),
    )


def written(folder, campaign, fresh):
    """Write for the peers what they need; return the path."""
    robot, frames = campaign.robot, register(campaign)
    bare = re.sub(r"<(visual|collision)>.*?</\1>|<(visual|collision) .*?</\2>", "", robot.urdf, flags=re.S)
    urdf = Path(folder) / "robot.urdf"
    urdf.write_text(bare)
    zero, turned = np.zeros(robot.n), frames.base[:3, :3]
    chain = robot.jacobian(zero)  # of the tool's origin, in the axes of the root frame
    place = robot.forward(zero)
    # a screw's first part is the velocity of the point at the root's origin
    screws = [[*(column[:3] - np.cross(column[3:], place[:3, 3])), *column[3:]] for column in chain.T]
    answer = {
        "q": campaign.q.tolist(),
        "position": campaign.position.tolist(),
        "joints": list(robot.joint_names),
        "tool_frame": robot.tool_frame,
        "urdf": str(urdf),
        "in_root": ((campaign.position - frames.base[:3, 3]) @ turned).tolist(),
        "screws": screws,
        "tool_at_zero": (place @ frames.tool).tolist(),
        "fresh_q": fresh.q.tolist(),
        "fresh_position": fresh.position.tolist(),
        "fresh_in_root": ((fresh.position - frames.base[:3, 3]) @ turned).tolist(),
    }
    path = Path(folder) / "given.json"
    path.write_text(json.dumps(answer))
    return path


def measured(effort, peers):
    """Time ours beside each peer's."""
    tables = []
    for rows in ROWS:
        if rows > effort.largest:
            continue
        with tempfile.TemporaryDirectory() as folder:
            tables.append(_table(effort, peers, rows, folder))
    return Part("Calibration", TEXT, tuple(tables))


def _table(effort, peers, rows, folder):
    campaign, fresh = campaigns(rows)
    source = written(folder, campaign, fresh)
    found = tr.calibrate(campaign)
    away = found.model.prediction(fresh)[0] - fresh.position

    def own():
        whole = [lambda: tr.calibrate(campaign), lambda: str(tr.calibrate(campaign))]
        return 1e3 * np.median(by_turns(effort, *whole), axis=0)

    ours = [own()]
    lines = []
    for peer in PEERS:
        for method in peer.methods:
            answer = calibrated(peer, method, peers, source)
            ours.append(own())
            name = f"{peer.name} `{method}`" if len(peer.methods) > 1 else peer.name
            lines.append(_line(name, answer, np.mean(ours[-2:], axis=0)[0]))
    alone, told = np.median(ours, axis=0)
    count = str(sum(len(values) for _, values in found.fit.effects) + found.fit.before.frames.shape[2])
    left = f"{1e3 * found.rms_after:.4f}", f"{1e3 * np.sqrt((away**2).sum(axis=1).mean()):.4f}"
    return (
        (f"{rows} poses", "ms", "of it solving", "times ours", "parameters", "left, mm", "fresh, mm", "version"),
        ("`tr.calibrate`", f"{alone:.1f}", "", "1", count, *left, tr.__version__),
        ("… told", f"{told:.1f}", "", f"{told / alone:.1f}", count, *left, tr.__version__),
        *lines,
    )


def _line(name, answer, ours):
    if isinstance(answer, str):
        return (name, answer, *("",) * 6)
    time, solving = (1e3 * float(np.median(answer[key])) for key in ("seconds", "solving"))
    return (
        name,
        f"{time:.0f}",
        f"{solving:.0f}",
        f"{time / ours:.1f}",
        str(answer["parameters"]),
        f"{1e3 * answer['rms']:.4f}",
        f"{1e3 * answer['fresh']:.4f}",
        answer["version"],
    )
