"""The batch functions against a Python loop over Pinocchio that stores, as ratios in one run; start it as a script.

The numbers of configurations may follow on the command line: ``bench_kinematics.py 1 100000``. Each figure is a median;
the loop and the batch take turns. ``--reuse`` hands every batch the array of the one before as ``out``.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import pinocchio as pin

from thermal_robot import load_robot
from thermal_robot.kinematics import frame_jacobians, gravity_torques, placement_sensitivities, tool_poses

SIZES = (1, 10, 1000, 100_000)
REPEATS = 7
LONG_ENOUGH = 0.02
"""Seconds that one measurement lasts at least: short calls are made several times."""
MOST_LOOPED = 100_000
"""Rows that the loop runs over; its time a row does not depend on their number, except for fresh memory."""


def loops(robot):
    """Return for each quantity a loop that calls Pinocchio once or twice a row and stores what the batch returns."""
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

    return {"poses": poses, "jacobians": jacobians, "placement sensitivities": placements, "gravity torques": gravity}


def bare(robot):
    """Return for each quantity one call of Pinocchio and nothing else."""
    model = robot.model
    data, tool = model.createData(), model.getFrameId(robot.tool_frame, pin.FrameType.BODY)

    def poses(q):
        pin.forwardKinematics(model, data, q)
        return pin.updateFramePlacement(model, data, tool).homogeneous

    def placements(q):
        pin.forwardKinematics(model, data, q)
        return pin.computeFrameKinematicRegressor(model, data, tool, pin.LOCAL)

    return {
        "poses": poses,
        "jacobians": lambda q: pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL_WORLD_ALIGNED),
        "placement sensitivities": placements,
        "gravity torques": lambda q: pin.computeGeneralizedGravity(model, data, q),
    }


def times_for(function, argument):
    """How often to call a function for one measurement."""
    begun = time.perf_counter()
    function(argument)
    return max(1, int(LONG_ENOUGH / (time.perf_counter() - begun)))


def seconds(function, argument, times):
    """Mean time of one call."""
    begun = time.perf_counter()
    for _ in range(times):
        function(argument)
    return (time.perf_counter() - begun) / times


def side_by_side(first, first_argument, second, second_argument):
    """Medians of both times, measured in turns, and the median of their ratios."""
    first(first_argument), second(second_argument)  # what is done once is not timed
    counts = times_for(first, first_argument), times_for(second, second_argument)
    measured = np.array(
        [
            (seconds(first, first_argument, counts[0]), seconds(second, second_argument, counts[1]))
            for _ in range(REPEATS)
        ]
    )
    return *np.median(measured, axis=0), np.median(measured[:, 0] / measured[:, 1])


def main(arguments):
    """Print microseconds a row of both, and their ratio."""
    reuse = "--reuse" in arguments
    sizes = [int(text) for text in arguments if text.isdigit()] or SIZES
    robot = load_robot("example-robot-data:ur5", "tool0")
    batches = (tool_poses, frame_jacobians, placement_sensitivities, gravity_torques)
    for rows in sizes:
        q = np.random.default_rng(0).uniform(-2, 2, (rows, robot.n))
        few = q[:MOST_LOOPED]
        print(f"{f'UR5, {rows} rows, µs a row':34s}{'Pinocchio':>10s}{'batch':>8s}{'ratio':>8s}")
        others = bare(robot) if rows == 1 else loops(robot)
        for (name, loop), batch in zip(others.items(), batches, strict=True):
            kept = {"out": batch(robot, q)} if reuse else {}
            slow, fast, _ = side_by_side(
                loop, few[0] if rows == 1 else few, lambda q, batch=batch, kept=kept: batch(robot, q, **kept), q
            )
            slow, fast = slow / len(few), fast / rows
            print(f"{name:34s}{slow * 1e6:10.2f}{fast * 1e6:8.3f}{slow / fast:8.2f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
