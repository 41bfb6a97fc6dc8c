"""Batched kinematics against a tight Python loop over Pinocchio, as ratios in one run; start it as a script."""

from __future__ import annotations

import time

import numpy as np
import pinocchio as pin

from thermal_robot import load_robot
from thermal_robot.kinematics import frame_jacobians, gravity_torques, placement_sensitivities, tool_poses

ROWS = 12_000


def loops(robot):
    """Return for each quantity a loop that calls Pinocchio once or twice a row and stores what the batch returns."""
    model = robot.model
    data, tool = model.createData(), model.getFrameId(robot.tool_frame, pin.FrameType.BODY)

    def poses(q):
        stored = np.empty((len(q), 4, 4))
        for i, row in enumerate(q):
            pin.forwardKinematics(model, data, row)
            stored[i] = pin.updateFramePlacement(model, data, tool).homogeneous

    def jacobians(q):
        stored = np.empty((len(q), 6, model.nv))
        for i, row in enumerate(q):
            stored[i] = pin.computeFrameJacobian(model, data, row, tool, pin.LOCAL_WORLD_ALIGNED)

    def placements(q):
        stored = np.empty((len(q), 6, 6 * model.nv))
        for i, row in enumerate(q):
            pin.forwardKinematics(model, data, row)
            stored[i] = pin.computeFrameKinematicRegressor(model, data, tool, pin.LOCAL)

    def gravity(q):
        stored = np.empty((len(q), model.nv))
        for i, row in enumerate(q):
            stored[i] = pin.computeGeneralizedGravity(model, data, row)

    return {"poses": poses, "jacobians": jacobians, "placement sensitivities": placements, "gravity torques": gravity}


def seconds_a_row(function, q):
    """Best of five, after one call to warm up."""
    function(q[:50])
    best = np.inf
    for _ in range(5):
        begun = time.perf_counter()
        function(q)
        best = min(best, (time.perf_counter() - begun) / len(q))
    return best


def main():
    """Print microseconds a row of both, and their ratio."""
    robot = load_robot("example-robot-data:ur10", "tool0")
    q = np.random.default_rng(0).uniform(-2, 2, (ROWS, robot.n))
    batches = (tool_poses, frame_jacobians, placement_sensitivities, gravity_torques)
    print(f"{'UR10, µs a row':28s}{'loop':>8s}{'batch':>8s}{'ratio':>8s}")
    for (name, loop), batch in zip(loops(robot).items(), batches, strict=True):
        slow, fast = seconds_a_row(loop, q), seconds_a_row(lambda rows, batch=batch: batch(robot, rows), q)
        print(f"{name:28s}{slow * 1e6:8.2f}{fast * 1e6:8.2f}{slow / fast:8.1f}")


if __name__ == "__main__":
    main()
