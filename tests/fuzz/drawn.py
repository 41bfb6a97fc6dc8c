"""Campaigns as users bring them, drawn: sound files whose robot, commands and columns have what real ones have.

Joints that are held (exactly, or as encoders read them), tilt columns of the base and of links, sessions, joints that
mimic, masses that are wrong, torques that count the other way, copied rows: whatever is drawn, there is an answer.
"""

from __future__ import annotations

import json
import re
from random import Random

import numpy as np
from coupled import joint, link, urdf
from fuzz import corpus
from fuzz.corpus import Files

from thermal_robot import simulate
from thermal_robot.effects import FRAMES, library
from thermal_robot.kinematics import gravity_torques
from thermal_robot.observations import observe
from thermal_robot.robot import Robot, load_robot

AXES = ("0 0 1", "0 1 0", "1 0 0", "0 -1 0", "0 0 -1", "0.6 0 0.8")
MASSES = ("right", "none", "one", "huge", "tiny", "upside")


def drawn(rng: Random) -> Files:
    """The files of one campaign."""
    text = _arm(rng)
    robot = load_robot(text, "tool")
    chance = np.random.default_rng(rng.getrandbits(32))
    rows = rng.randint(24, 40)
    q, read = _commands(rng, chance, robot, rows)
    conditions = _conditions(rng, chance, robot, q)
    noise, measures = rng.choice((0.0, 1e-9, 1e-5, 1e-4, 1e-3)), rng.choice(("position", "position", "pose"))
    campaign = simulate(
        robot,
        _at_work(rng, chance, robot, q, conditions),
        commands=q,
        conditions=conditions,
        measures=measures,
        noise=noise,
        noise_orientation=3.0 * noise if measures == "pose" else 0.0,
        tool=(0.05, 0.02, 0.1),
        base_known=rng.random() < 0.3,
        tool_known=rng.random() < 0.3,
        seed=rng.getrandbits(30),
    )
    files = corpus.files_of(campaign)
    files |= {"robot.urdf": _weighed(rng, text).encode(), **_table(rng, chance, files, robot, read)}
    if rng.random() < 0.7:  # a few effects are asked for, which is cheap
        files["only.json"] = json.dumps(rng.sample(list(library()), rng.choice((1, 1, 2, 3, 5)))).encode()
    return files


def _arm(rng: Random) -> str:
    """A serial arm of 2 to 6 joints with masses; one may slide, one may mimic, a fixed link may stand between."""
    count = rng.choice((2, 2, 3, 3, 3, 4, 4, 6))
    slide = rng.randrange(count) if rng.random() < 0.35 else -1
    follower = rng.randrange(1, count) if rng.random() < 0.25 else -1
    parts, parent = [link("l0", 10.0, "0 0 0.1")], "l0"
    for k in range(1, count + 1):
        kind = "prismatic" if k - 1 == slide else rng.choice(("revolute", "revolute", "continuous"))
        limits = {"prismatic": (-0.4, 0.6), "revolute": (-2.6, 2.6)}.get(kind)
        mimic = 'joint="j1" multiplier="-0.5" offset="0.1"' if k - 1 == follower and slide != 0 else ""
        origin = f"{rng.choice((0, 0.05, 0.4))} {rng.choice((0, 0, 0.03))} {rng.choice((0, 0.1, 0.3))}"
        turn = rng.choice(("0 0 0", "0 0 0", "1.5707963 0 0", "0 0.3 0"))
        # neighbours that share an axis line are rare in real arms, but they exist
        parts += [joint(f"j{k}", kind, parent, f"l{k}", origin, turn, rng.choice(AXES), limits, mimic)]
        parts += [link(f"l{k}", 12.0 / k, "0.02 0 0.1")]
        parent = f"l{k}"
        if rng.random() < 0.2:
            parts += [joint(f"post{k}", "fixed", parent, f"post_{k}", "0 0 0.05"), link(f"post_{k}", 0.4, "0.01 0 0")]
            parent = f"post_{k}"
    return urdf(*parts, joint("flange", "fixed", parent, "tool", "0.05 0 0.02"), link("tool"))


def _commands(rng: Random, chance: np.random.Generator, robot: Robot, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """(N, n) positions that were gone to, and as the table tells them: some joints held, some positions repeated."""
    lower, upper = np.maximum(robot.lower, -2.4), np.minimum(robot.upper, 2.4)
    q = chance.uniform(0.8 * lower, 0.8 * upper, (rows, robot.n))
    if rng.random() < 0.3:  # poses that are repeated
        q = q[chance.integers(0, max(rows // 4, 7), rows)]
    if rng.random() < 0.2:  # one step of each joint
        q = np.round(q * 2.0) / 2.0
    read = q.copy()
    for j in rng.sample(range(robot.n), robot.n - 1):  # where nothing moves there is nothing to diagnose
        if rng.random() < 0.25:
            q[:, j] = rng.choice((0.0, q[0, j]))
            read[:, j] = q[:, j] + rng.choice((0.0, 1e-9, 3e-7, 1e-6, 2e-5, 2e-4)) * chance.normal(size=rows)
    if rng.random() < 0.2:
        read = read + 1e-6 * chance.normal(size=read.shape)
    return q, read


def _conditions(rng: Random, chance: np.random.Generator, robot: Robot, q: np.ndarray) -> dict[str, np.ndarray | None]:
    rows, names = len(q), robot.joint_names
    links = [f"temperature.{s.parent_link}" for s in robot.segments]
    time = np.cumsum(chance.uniform(20.0, 90.0, rows))
    found: dict[str, np.ndarray | None] = {"time": None, "temperature": None}
    if rng.random() < 0.6:
        found["time"] = time
    elif rng.random() < 0.5:
        found["order"] = np.arange(rows) + 1.0
    for name in ("temperature", *links):
        if rng.random() < (0.4 if name == "temperature" else 0.06):
            found[name] = 20.0 + rng.choice((0.0, 0.05, 5.0)) * np.sin(time / 900.0) + rng.choice((0.0, 3.0))
    if rng.random() < 0.3:
        found["payload"] = chance.choice([0.0, 2.0, 5.0], rows) if rng.random() < 0.8 else np.full(rows, 3.0)
    for name in names:
        if rng.random() < 0.15:
            found[f"approach.{name}"] = chance.choice([-1.0, 0.0, 1.0], rows)
    if rng.random() < 0.2:
        found["speed"] = chance.choice([0.1, 1.0], rows)
        for name in names[:2]:
            found[f"velocity.{name}"] = chance.normal(size=rows)
    if rng.random() < 0.3:
        torque = gravity_torques(robot, q) * rng.choice((1.0, -1.0, -1.0)) + 0.5 * chance.normal(size=q.shape)
        found |= {f"torque.{name}": torque[:, j] for j, name in enumerate(names) if rng.random() < 0.8}
    return found


def _at_work(rng: Random, chance: np.random.Generator, robot: Robot, q: np.ndarray, conditions: dict) -> list:
    """Effects in the setting in which they are first looked for, of sizes up to thirty times the expected ones."""
    plain = observe(simulate(robot, commands=q, conditions=conditions))
    able = [
        effect for effect in library().values() if not (effect.random or effect.name in FRAMES or effect.missing(plain))
    ]
    found = []
    for effect in rng.sample(able, min(rng.choice((0, 1, 1, 2, 3)), len(able))):
        own = effect.variants(plain)[0].parameters(plain)
        sizes = np.array([p.size for p in own]) * 10 ** rng.uniform(-1.0, 1.5)
        values = sizes * chance.normal(size=len(own)) * (chance.random(len(own)) < rng.choice((0.2, 1.0)))
        if len(own):
            found.append((effect.variants(plain)[0], np.where([p.positive for p in own], np.abs(values), values)))
    return found


def _weighed(rng: Random, text: str) -> str:
    """The URDF with masses that may be wrong."""
    kind = rng.choice(MASSES)
    masses = re.findall(r'<mass value="[^"]*"/>', text)
    kept = rng.randrange(len(masses))
    count = iter(range(len(masses)))

    def other(found: re.Match[str]) -> str:
        k, mass = next(count), float(found[1])
        told = {"none": 0.0, "huge": 1e4 * mass, "tiny": 1e-9 * mass, "one": mass * (k == kept)}.get(kind, mass)
        return f'<mass value="{told}"/>'

    return re.sub(r'<mass value="([^"]*)"/>', other, text)


def _table(rng: Random, chance: np.random.Generator, files: Files, robot: Robot, read: np.ndarray) -> Files:
    """The table with what the robot reads of itself, tilts, sessions, labels, columns of one value and copied rows."""
    table, rows = corpus.as_frame(files), len(read)
    for j, name in enumerate(robot.joint_names):
        table[name] = read[:, j]
    for place in ("", *(f"{s.parent_link}." for s in robot.segments)):
        if rng.random() < (0.2 if not place else 0.08):
            for axis in "xy":
                size = rng.choice((0.0, 1e-12, 1e-4, 3e-3))
                table[f"tilt.{place}{axis}"] = size * np.sin(read[:, 0]) + size / 10 * chance.normal(size=rows)
    if rng.random() < 0.3:
        # one session may be of a single row
        table["session"] = np.sort(chance.choice(["a", "b", "c"], rows, p=[0.6, 0.38, 0.02]))
    if rng.random() < 0.2:
        table["pose"] = np.unique(np.round(read, 3), axis=0, return_inverse=True)[1].ravel()
    if rng.random() < 0.3:
        table["humidity"] = rng.choice((40.0, 1e6)) + rng.choice((0.0, 1.0)) * chance.normal(size=rows)
    if rng.random() < 0.1:
        table["encoder." + robot.joint_names[0]] = read[:, 0] + 1e-5 * chance.normal(size=rows)
    if rng.random() < 0.15:
        table = table.iloc[[*range(rows), *chance.integers(0, rows, rng.choice((1, 20)))]]
    return {"measurements.csv": table.to_csv(index=False).encode()}
