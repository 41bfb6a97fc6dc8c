"""Batches of configurations: the engines against a Python loop over Pinocchio that stores, and against the memory."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import pinocchio as pin
from benchmarks.parts import Curve, Part, Plot
from benchmarks.timing import by_turns, medians

from thermal_robot import compiling, load_robot
from thermal_robot.kinematics import (
    compiled,
    frame_jacobians,
    gravity_torques,
    placement_sensitivities,
    settings,
    tool_poses,
)

ARM = ("example-robot-data:ur5", "tool0")
SIZES = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000)
PIECE = 100_000
"""Configurations of one call: more are done in pieces of so many into the same array, as results of ten million
placements would fill 17 GB."""
MOST_LOOPED = 100_000
"""Rows that the loop runs over; its time a row does not depend on their number, except for fresh memory."""
SIDED = (100_000, 1_000_000)
"""Sizes at which threads are compared."""
BATCHES = {
    "poses": tool_poses,
    "Jacobians": frame_jacobians,
    "placement sensitivities": placement_sensitivities,
    "gravity torques": gravity_torques,
}
TEXT = (
    "A UR5. The loop calls Pinocchio once or twice for each configuration and stores what it returns, for one "
    "configuration without storing; above {most} configurations it is taken to cost what it costs there. *default* "
    "is the public functions without numba: Pinocchio itself up to {few} configurations, then NumPy; *compiled* "
    "the same with numba (extra `fast`), from {many} on, on all processors. Both are given the arrays for their "
    "results (`out=`), and above {piece} configurations work in pieces of so many. *memory* is the time in which "
    "NumPy's `fill` writes the same results, one thread; no engine that writes them can be faster."
)


def loops(robot):
    """Return for each quantity a loop over configurations that calls Pinocchio and stores what the batch returns."""
    model = robot.model
    data, tool = model.createData(), model.getFrameId(robot.tool_frame, pin.FrameType.BODY)

    def poses(q):
        stored = np.empty((len(q), 4, 4))
        for i, row in enumerate(q):
            pin.forwardKinematics(model, data, row)
            stored[i] = pin.updateFramePlacement(model, data, tool).homogeneous
        return stored

    def jacobians(q):
        stored = np.empty((len(q), 6, model.nv))
        for i, row in enumerate(q):
            stored[i] = pin.computeFrameJacobian(model, data, row, tool, pin.LOCAL_WORLD_ALIGNED)
        return stored

    def placements(q):
        stored = np.empty((len(q), 6, 6 * model.nv))
        for i, row in enumerate(q):
            pin.forwardKinematics(model, data, row)
            stored[i] = pin.computeFrameKinematicRegressor(model, data, tool, pin.LOCAL)
        return stored

    def gravity(q):
        stored = np.empty((len(q), model.nv))
        for i, row in enumerate(q):
            stored[i] = pin.computeGeneralizedGravity(model, data, row)
        return stored

    return dict(zip(BATCHES, (poses, jacobians, placements, gravity), strict=True))


def bare(robot):
    """Return for each quantity one call of Pinocchio for the first configuration, and nothing else."""
    model = robot.model
    data, tool = model.createData(), model.getFrameId(robot.tool_frame, pin.FrameType.BODY)

    def poses(q):
        pin.forwardKinematics(model, data, q[0])
        return pin.updateFramePlacement(model, data, tool).homogeneous

    def placements(q):
        pin.forwardKinematics(model, data, q[0])
        return pin.computeFrameKinematicRegressor(model, data, tool, pin.LOCAL)

    calls = (
        poses,
        lambda q: pin.computeFrameJacobian(model, data, q[0], tool, pin.LOCAL_WORLD_ALIGNED),
        placements,
        lambda q: pin.computeGeneralizedGravity(model, data, q[0]),
    )
    return dict(zip(BATCHES, calls, strict=True))


@contextmanager
def running(threads):
    """Let so many threads run compiled kernels, 0 for all processors; ``None`` lets NumPy alone work."""
    kept = settings.MANY, compiling.THREADS
    settings.MANY, compiling.THREADS = (2**62, 0) if threads is None else (kept[0], threads)
    try:
        yield
    finally:
        settings.MANY, compiling.THREADS = kept


def in_pieces(batch, robot, q, rows, out, threads):
    """Do so many configurations in pieces, all into the same array."""
    with running(threads):
        for _ in range(0, rows, len(q)):
            batch(robot, q, out=out)


def one(effort, robot, name, rows):
    """Return microseconds a configuration: of the loop, NumPy, compiled kernels (or nothing) and memory."""
    q = np.random.default_rng(0).uniform(-2.0, 2.0, (min(rows, PIECE), robot.n))
    few, batch = q[:MOST_LOOPED], BATCHES[name]
    out = batch(robot, q)
    loop = (bare if rows == 1 else loops)(robot)[name]
    calls = [
        lambda: loop(few),
        lambda: in_pieces(batch, robot, q, rows, out, None),
        lambda: [out.fill(0.0) for _ in range(0, rows, len(q))],
    ]
    fast = compiled.installed() and rows >= settings.MANY
    calls += [lambda: in_pieces(batch, robot, q, rows, out, 0)] if fast else []
    measured = by_turns(effort, *calls) / [len(few), *(rows,) * (len(calls) - 1)]
    times, faster = medians(measured)
    return 1e6 * times, faster


def measured(effort, peers):
    """Time all quantities at all sizes."""
    robot = load_robot(*ARM)
    sizes = [n for n in SIZES if n <= effort.largest]
    tables, plots = [], []
    for name in BATCHES:
        heading = (
            f"{name}, N",
            "loop, µs each",
            "default",
            "loop / default",
            "compiled",
            "loop / compiled",
            "memory",
            "default / memory",
        )
        rows, columns = [heading], {key: [] for key in ("loop", "default", "memory", "compiled")}
        for n in sizes:
            times, faster = one(effort, robot, name, n)
            fast = (f"{times[3]:.3f}", f"{faster[3]:.1f}") if len(times) > 3 else ("–", "–")
            rows.append(
                (f"{n:,}", f"{times[0]:.2f}", f"{times[1]:.3f}", f"{faster[1]:.2f}", *fast, f"{times[2]:.3f}",
                 f"{times[1] / times[2]:.1f}")
            )  # fmt: skip
            for key, time in zip(columns, times, strict=False):
                columns[key].append((n, 1e-6 * time * n))
        tables.append(tuple(rows))
        plots.append(_plot(name, columns))
    threads = _threads(effort, robot)
    text = TEXT.format(most=f"{MOST_LOOPED:,}", piece=f"{PIECE:,}", few=settings.FEW, many=f"{settings.MANY:,}")
    return Part("Batch kinematics", text, (*tables, *threads), tuple(plots))


def _plot(name, columns):
    curves = [Curve(key, *zip(*points, strict=True)) for key, points in columns.items() if points]
    return Plot(f"kinematics_{name.replace(' ', '_').lower()}", f"UR5, {name}", "configurations", tuple(curves))


def _threads(effort, robot):
    """Return the table of compiled kernels by threads; none where they are not installed."""
    sizes = [n for n in SIDED if n <= effort.largest]
    if not compiled.installed() or not sizes or compiling.threads() < 2:
        return ()
    rows = [("compiled kernels", "N", "one thread, µs each", f"{compiling.threads()} threads", "gain")]
    for name, batch in BATCHES.items():
        for n in sizes:
            q = np.random.default_rng(0).uniform(-2.0, 2.0, (min(n, PIECE), robot.n))
            out = batch(robot, q)
            calls = [lambda t=t, q=q, n=n, out=out, b=batch: in_pieces(b, robot, q, n, out, t) for t in (1, 0)]
            times, faster = medians(by_turns(effort, *calls))
            each = 1e6 * times / n
            rows.append((name, f"{n:,}", f"{each[0]:.3f}", f"{each[1]:.3f}", f"{faster[1]:.2f}"))
    return (tuple(rows),)
