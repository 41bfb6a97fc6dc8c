"""Recordings of a robot that goes from pose to pose and rests, and of an instrument with a clock of its own."""

from dataclasses import dataclass

import numpy as np

from thermal_robot.campaign.importers.rosbag import Stream
from thermal_robot.kinematics import exp3, tool_poses

TARGET = np.array([0.02, -0.03, 0.11])
REST = 1.2


@dataclass(frozen=True)
class Motion:
    """Joint positions at rest (P, n), when each rest begins and ends, and the moves between."""

    poses: np.ndarray
    begins: np.ndarray
    ends: np.ndarray

    def at(self, times):
        """Joint positions: smooth moves (Flash and Hogan's, without a jerk at their ends) between rests."""
        k = np.clip(np.searchsorted(self.ends, times), 0, len(self.poses) - 1)
        before = np.maximum(k - 1, 0)
        length = np.where(k > 0, self.begins[k] - self.ends[before], 1.0)
        s = np.clip(np.where(k > 0, times - self.ends[before], 1.0) / length, 0, 1)[:, None]
        share = 10 * s**3 - 15 * s**4 + 6 * s**5
        return self.poses[before] + share * (self.poses[k] - self.poses[before])


def motion(robot, rng, poses=25):
    lower, upper = np.maximum(robot.lower, -1.5), np.minimum(robot.upper, 1.5)
    q = rng.uniform(lower, upper, (poses, robot.n)) * 0.6
    moves = rng.uniform(1.0, 3.0, poses)
    begins = np.cumsum(moves + REST) - moves[0] - REST
    return Motion(q, begins, begins + REST)


def recorded(robot, rng, *, offset, poses=25, joint_rate=100.0, rate=60.0, noise=5e-5, bent=0.0, start=1.6e9):
    """Joint states and positions of the target, where the robot's clock shows ``offset`` more; and the motion.

    ``bent`` turns the robot's second joint by that much more than its model, rad, times the joint's position.
    """
    path = motion(robot, rng, poses)
    span = path.ends[-1]
    joint_times = np.arange(0.0, span, 1 / joint_rate) + rng.uniform(0, 1 / joint_rate)
    joints = np.round(path.at(joint_times) / 1e-5) * 1e-5
    times = np.arange(0.3, span - 0.2, 1 / rate)
    times = times + 0.1 / rate * rng.uniform(-1, 1, len(times))
    q = path.at(times)
    q[:, 1] += bent * np.sin(2 * q[:, 1])
    tool = tool_poses(robot, q)
    frame, shift = exp3(rng.normal(size=3)), rng.uniform(-3, 3, 3)
    places = (tool[:, :3, 3] + tool[:, :3, :3] @ TARGET) @ frame.T + shift + noise * rng.normal(size=(len(times), 3))
    own = Stream("joints", joint_times + start, joints, robot.joint_names)
    return own, Stream("target", times + start - offset, places, ("x", "y", "z")), path
