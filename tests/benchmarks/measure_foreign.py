"""Campaigns without an instrument by a foreign physics: the arm of the blind trial, in MuJoCo, with its own faults.

usage: python tests/benchmarks/measure_foreign.py SEED [KIND ...]

Arms, effects, rows and what is right are those of measure_kinds.py; where the ball, the wire or the image really is
says :mod:`thermal_robot.blind.reality`, of which the program under test knows nothing. Sockets and planes are closed by
Newton steps on that reality's places. Readings are made here: a norm, a plane's offset, a pinhole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from measure_kinds import LED, NOISE, TOOL, run

import thermal_robot as tr
from thermal_robot.blind.reality.fault import FAULTS
from thermal_robot.blind.reality.instrument import conditions
from thermal_robot.blind.reality.setting import draw_setting
from thermal_robot.blind.reality.sizes import Gauge, place, sized
from thermal_robot.blind.reality.world import World
from thermal_robot.kinematics import frame_jacobians

ROUNDS, CLOSED = 20, 1e-9  # Newton steps at most; m
STANDS, SOCKETS, APART = 3, 2, 0.05  # places of a holder with two sockets, m apart
FOCUS = 1000.0  # pixels


def places(setting, at_work):
    """Where the ball really is, (N, 3) m, root frame."""
    return place(setting, at_work, np.array(TOOL))[0]


def led(robot, setting, at_work, aims):
    """The setting with joints at which the ball really is where ``aims`` (M, 3) with normals (M, 3, 3) say; its rows.

    What is not along the normals is free; rows that do not get there within the limits are left out.
    """
    points, along = aims
    q, low, high = setting.q.copy(), robot.lower, robot.upper
    for _ in range(ROUNDS):
        here = replace(setting, q=q, poses=setting.world.poses(q, setting.payload, setting.world.sound(len(q)))[0])
        left = np.einsum("nij,nj->ni", along, points - places(here, at_work))
        slopes = along @ frame_jacobians(robot, q, point=np.array(TOOL))[:, :3]
        step = np.linalg.pinv(slopes, rcond=1e-3) @ left[:, :, None]
        q = np.clip(q + np.clip(step[:, :, 0], -1.0, 1.0), low, high)
    return here, np.abs(left).max(axis=1) < CLOSED


def touched(kind, robot, setting, at_work, rng):
    """Setting, rows that are reached, and labels of balls in sockets, or tips on planes; play is part of the aim."""
    sound, count = places(setting, []), setting.samples
    play = NOISE * rng.normal(size=(count, 3))
    if kind == "socket":
        middle = sound[rng.integers(count, size=STANDS)]
        away = rng.normal(size=(STANDS, 3))
        away *= APART / np.linalg.norm(away, axis=1, keepdims=True)
        stand, socket = np.arange(count) % STANDS, np.arange(count) // STANDS % SOCKETS
        points, along = middle[stand] + socket[:, None] * away[stand], np.tile(np.eye(3), (count, 1, 1))
        labels = {"stand": stand.astype(str), "socket": socket.astype(str)}
    else:
        number = np.arange(count) % 3
        along = np.eye(3)[number][:, None]
        points, labels = np.tile(np.median(sound, axis=0), (count, 1)), {"plane": number.astype(str)}
    return *led(robot, setting, at_work, (points + play, along)), labels


def read(kind, setting, at_work, rng):
    """Columns of wires to four anchors, or of two cameras that look at the middle of all places; camera's facts."""
    points = places(setting, at_work)
    middle, size = points.mean(axis=0), np.ptp(points, axis=0).max()
    number = np.arange(len(points))
    if kind == "distance":
        anchors = middle + 1.3 * size * np.array([[1, 1, 0.9], [1.1, -1, -1], [-1, 1, -0.8], [-0.9, -1, 1]]) / 1.7
        far = np.linalg.norm(points - anchors[number % 4], axis=1)
        return {"distance": far + 0.03 + NOISE * rng.normal(size=len(far)), "anchor": (number % 4).astype(str)}, {}
    turns = np.array([[[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [[1, 0, 0], [0, 0, 1], [0, -1, 0]]], dtype=float)
    seen = np.einsum("nji,nj->ni", turns[number % 2], points - middle) + np.array([0.0, 0.0, 1.3 * size])
    pixels = FOCUS * seen[:, :2] / seen[:, 2:] + FOCUS * NOISE / (1.3 * size) * rng.normal(size=(len(points), 2))
    lens = {"fx": FOCUS, "fy": FOCUS, "cx": 640.0, "cy": 512.0, "mount": "room"}
    u, v = (pixels + np.array([640.0, 512.0])).T
    return {"u": u, "v": v, "camera": (number % 2).astype(str)}, {"0": lens, "1": lens}


def campaign(robot, kind, name, ratio, rows, rng):
    """Return the campaign of an arm with one fault, ``ratio`` times the noise per axis, or with none."""
    world = World(robot.urdf, robot.tool_frame)
    setting = draw_setting(world, rows, rng, sensor="robot")
    at_work = []
    if name:
        gauge, wanted = Gauge(setting, np.arange(rows), np.array(TOOL), True, True), ratio * NOISE
        values = FAULTS[name].draw(setting, rng)
        if name == "transmission_error":
            values[:, 4] = 1.0  # of the joint's own side: that of the motor asks for gear ratios in the file
        at_work = [(FAULTS[name], sized(gauge, FAULTS[name], values, wanted))]
    reached, facts = np.ones(setting.samples, dtype=bool), {}
    if kind in LED:
        setting, reached, columns = touched(kind, robot, setting, at_work, rng)
    else:
        columns, facts = read(kind, setting, at_work, rng)
    told = conditions(setting)
    told = told[[c for c in told if not (kind in LED and c.startswith("approach."))]].copy()
    labels = {name: values for name, values in columns.items() if values.dtype.kind == "U"}
    readings = {name: values for name, values in columns.items() if values.dtype.kind != "U"}
    blank = tr.campaign_from_table(
        robot, told, angle_unit="rad", length_unit="mm", base="known", noise_position=NOISE * 1e3, measured=False
    )
    whole = replace(
        blank,
        labels={**blank.labels, **labels, "kind": np.full(rows, kind)},
        readings=readings,
        facts={**blank.facts, "camera": facts} if facts else blank.facts,
        moves="unknown" if kind in LED else blank.moves,
    )
    return whole.take(np.flatnonzero(reached))


if __name__ == "__main__":
    run(campaign)
