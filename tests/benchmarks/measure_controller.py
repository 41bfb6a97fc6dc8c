"""Forty pairs of models of one arm: the controller's own poses against a URDF, and whether what differs is named.

usage: python tests/benchmarks/measure_controller.py SEED

The controller's model is the URDF with other numbers in its XML: a calibration of this one arm, the e-series' lengths,
a joint's zero; or with a tool, a flange or a base frame of its own. Poses are rounded as a screen shows them.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

import thermal_robot as tr
from thermal_robot.kinematics import rotation_to_quaternion, tool_poses

ARMS = (
    ("example-robot-data:ur3", "tool0"),
    ("example-robot-data:ur5", "tool0"),
    ("example-robot-data:ur10", "tool0"),
    ("example-robot-data:panda", "panda_link8"),
    ("builtin:rv_m2", "tool0"),
)
E_SERIES = {  # m, of the DH parameters d1, a2, a3, d4, d5, d6: what Universal Robots publish, e-series less CB3
    "ur3": (-5e-5, -1e-4, -5e-5, 0.0187, 0.0, 0.0102),
    "ur5": (0.073341, 0.0, -5e-5, 0.02415, 0.00505, 0.0173),
    "ur10": (0.0534, 7e-4, -7.5e-4, 0.010209, 0.00415, 0.02435),
}
CAUSES = {
    "calibration": {"geometric"},
    "e-series": {"geometric"},
    "zero": {"joint_offset"},
    "tool": {"tool_frame"},
    "flange": {"tool_frame"},
    "base": {"base_frame"},
    "tool and calibration": {"tool_frame", "geometric"},
    "base and tool": {"base_frame", "tool_frame"},
    "the same": set(),
}
"""What differs, and its name."""


def moved(text, joint, xyz, rpy=(0.0, 0.0, 0.0)):
    """Return a URDF with the origin of a joint shifted, m, and turned in its own frame, rad."""
    root = ET.fromstring(text)
    origin = next(one for one in root.iter("joint") if one.get("name") == joint).find("origin")
    place, turn = (np.array([float(x) for x in origin.get(k, "0 0 0").split()]) for k in ("xyz", "rpy"))
    turned = Rotation.from_euler("xyz", turn) * Rotation.from_rotvec(rpy)
    origin.set("xyz", " ".join(f"{x:.12g}" for x in place + xyz))
    origin.set("rpy", " ".join(f"{x:.12g}" for x in turned.as_euler("xyz")))
    return ET.tostring(root, encoding="unicode")


def calibrated(text, robot, rng):
    """Return a URDF whose joints all stand elsewhere, by 0.3 mm and 1 mrad, one sigma."""
    for joint in robot.joint_names:
        text = moved(text, joint, 3e-4 * rng.normal(size=3), 1e-3 * rng.normal(size=3))
    return text


def e_series(text, name):
    """Return the URDF of a UR with the lengths of its e-series."""
    d1, a2, a3, d4, d5, d6 = E_SERIES[name]
    for joint, step in (
        ("shoulder_pan_joint", (0, 0, d1)),
        ("elbow_joint", (0, 0, a2)),
        ("wrist_1_joint", (0, 0, a3)),
        ("wrist_2_joint", (0, d4, 0)),
        ("wrist_3_joint", (0, 0, d5)),
        ("wrist_3_link-tool0_fixed_joint", (0, d6, 0)),
    ):
        text = moved(text, joint, np.array(step, dtype=float))
    return text


def frame(rng, length, turn):
    """Return a drawn frame (4, 4): shift of some length, m, turned about z by an angle, rad, and about x or not."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()
    found[:3, 3] = length * rng.normal(size=3)
    return found


def pose_campaign(robot, other, rng):
    """Return 40 poses of ``robot``'s commands, with the forward kinematics of another model as its measurement."""
    made = tr.simulate(robot, rows=40, measures="controller", tool=(0.0, 0.0, 0.0), seed=int(rng.integers(10**6)))
    poses = other(made.q)
    told = np.round(poses[:, :3, 3], 5), np.round(rotation_to_quaternion(poses[:, :3, :3]), 6)
    return replace(made, position=told[0], orientation=told[1], covariates={}, derived=(), moves="unknown")


def drawn(what, source, tool, rng):
    """Return the campaign of one pair of models."""
    robot = tr.load_robot(source, tool)
    text, base, held = robot.urdf, np.eye(4), np.eye(4)
    if "calibration" in what:
        text = calibrated(text, robot, rng)
    if what == "e-series":
        text = e_series(text, source.partition(":")[2])
    if what == "zero":
        size = rng.uniform(0.003, 0.05) * rng.choice([-1.0, 1.0])
        axis = robot.joint_names[int(rng.integers(1, len(robot.joint_names) - 1))]
        text = moved(text, axis, np.zeros(3), size * np.array(axis_of(text, axis)))
    if "tool" in what:
        held = frame(rng, 0.1, rng.choice([0.0, 0.5 * np.pi, rng.uniform(-np.pi, np.pi)]))
    if what == "flange":
        held = frame(rng, 0.0, rng.choice([-0.25, 0.5, -0.5, 1.0]) * np.pi)
    if "base" in what:
        base = frame(rng, rng.choice([0.0, 0.3]), rng.choice([1.0, 0.5, -0.5]) * np.pi)
    other = tr.load_robot(text, tool)
    return pose_campaign(robot, lambda q: base @ tool_poses(other, q) @ held, rng)


def axis_of(text, joint):
    """Return the axis of a joint of a URDF."""
    told = next(one for one in ET.fromstring(text).iter("joint") if one.get("name") == joint).find("axis")
    return [1.0, 0.0, 0.0] if told is None else [float(x) for x in told.get("xyz").split()]


def main(seed):
    """Print each pair and what is told of it, and how many are named exactly."""
    rng, right = np.random.default_rng(int(seed)), []
    for what, names in CAUSES.items():
        for source, tool in ARMS:
            if what == "e-series" and source.partition(":")[2] not in E_SERIES:
                continue
            found = tr.diagnose(drawn(what, source, tool, rng))
            another = what == "e-series" and not found.usable
            right.append(set(found.verdict) == names or another)
            said = ", ".join(found.verdict) if found.usable else found.summary
            print("right" if right[-1] else "WRONG", what, source, said or "nothing", flush=True)
    print(f"{sum(right)} of {len(right)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
