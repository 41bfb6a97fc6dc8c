"""Arms with joints that mimic others, and the same arms with every joint driven by hand."""

import re

import numpy as np

from thermal_robot.robot import load_robot


def link(name, mass=0.0, centre="0 0 0"):
    inertia = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
    body = f'<inertial><origin xyz="{centre}"/><mass value="{mass}"/>{inertia}</inertial>' if mass else ""
    return f'<link name="{name}">{body}</link>'


def joint(name, kind, parent, child, origin="0 0 0", rpy="0 0 0", axis="0 0 1", limits=None, mimic=""):
    """One joint; ``mimic`` holds the attributes of the tag."""
    limit = f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="1" velocity="1"/>' if limits else ""
    follows = f"<mimic {mimic}/>" if mimic else ""
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{origin}" rpy="{rpy}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<axis xyz="{axis}"/>{limit}{follows}</joint>\n'


def urdf(*parts):
    return f'<robot name="coupled">{"".join(parts)}</robot>'


PARALLELOGRAM = urdf(
    link("base"),
    link("column", 8.0, "0 0 0.2"),
    link("arm", 5.0, "0.25 0 0.02"),
    link("forearm", 3.0, "0.2 0.01 0"),
    link("hand", 1.0, "0.05 0 0"),
    link("tool"),
    joint("turn", "revolute", "base", "column", "0 0 0.3", limits=(-2.5, 2.5)),
    joint("lift", "revolute", "column", "arm", "0.1 0 0.2", axis="0 1 0", limits=(-1.2, 0.9)),
    joint("reach", "revolute", "arm", "forearm", "0.6 0 0", axis="0 1 0", limits=(-1.4, 1.6)),
    # keeps the hand upright while the arm is lifted, as the bars of a palletiser do
    joint(
        "upright", "revolute", "forearm", "hand", "0.5 0 0", axis="0 1 0", limits=(-1.0, 1.8),
        mimic='joint="reach" multiplier="-1" offset="0.3"',
    ),
    joint("spin", "continuous", "hand", "tool", "0.1 0 -0.1"),
)  # fmt: skip
"""A palletiser: the hand turns back by what the forearm turns."""

THUMB = joint(
    "thumb", "continuous", "finger", "thumb", "0.1 0 0", "0 0 0", "1 0 0", mimic='joint="jaw" multiplier="-1"'
)
THUMB_BY_HAND = joint("thumb", "fixed", "finger", "thumb", "0.1 0 0", "-0.7 0 0")
"""The finger stands at its lower limit of 0.2 m, the jaw at 3 · 0.2 + 0.1."""

COUPLED = urdf(
    link("ground"),
    link("base", 10.0, "0 0 0.1"),
    link("early", 4.0, "0.1 0 0.1"),
    link("turret", 3.0, "0.02 0 0.1"),
    link("boom", 2.5, "0 0 0.3"),
    link("stage", 2.0, "0 0 0.2"),
    link("tip_stage", 1.5, "0.02 0 0.15"),
    link("geared", 1.2, "0 0.1 0.1"),
    link("rack", 0.8, "0 0.05 0"),
    link("held", 0.4, "0 0 0.03"),
    link("wrist", 0.5, "0.05 0 0"),
    link("finger", 0.3, "0 0 0.1"),
    link("thumb", 0.2, "0 0 0.2"),
    link("tip"),
    joint("mount", "fixed", "ground", "base", "0.1 0.2 0.3", "0.4 -0.5 0.6"),
    # follows a joint further out
    joint("early", "revolute", "base", "early", "0 0 0.4", "0.3 0.2 -0.1", "1 2 -3", (-2, 2),
          'joint="swing" multiplier="0.4" offset="-0.2"'),
    joint("turret", "continuous", "early", "turret", "0.1 0.3 -0.2", "0 0 0.7"),
    joint("swing", "revolute", "turret", "boom", "0.2 0 0.1", "0 0.5 0", "0 1 0", (-1.5, 1.5)),
    # a telescope of three stages, the third driven by the second
    joint("stage_1", "prismatic", "boom", "stage", "0 0 0.5", "0 0.1 0", "0 0 1", (0, 0.4)),
    joint("stage_2", "prismatic", "stage", "tip_stage", "0 0 0.4", "0 0 0.2", "0 0 1", (0, 0.5),
          'joint="stage_1" multiplier="1.1" offset="0.02"'),
    joint("stage_3", "prismatic", "tip_stage", "geared", "0.05 0 0.3", "0.1 0 0", "0 1 1", (-1, 1),
          'joint="stage_2" multiplier="-2" offset="0.05"'),
    # follows a continuous joint by half, and a rack on it by metres a radian
    joint("half", "continuous", "geared", "rack", "0 0.2 0", "0 0 1", "-1 1 2", None,
          'joint="turret" multiplier="0.5" offset="1.3"'),
    joint("rack", "prismatic", "rack", "held", "0.1 0 0.1", "-1 0 0", "0 -1 0", (-1, 1),
          'joint="turret" multiplier="0.05"'),
    # follows a finger, which stands beside the chain
    joint("jaw", "revolute", "held", "wrist", "0 0 0.1", "0.2 0 0", "1 0 0", (-1, 1),
          'joint="finger" multiplier="3" offset="0.1"'),
    joint("finger", "prismatic", "held", "finger", "0 0.1 0", "0 0 0.3", "0 1 0", (0.2, 0.5)),
    THUMB,
    joint("tip_joint", "fixed", "wrist", "tip", "0.02 0.03 0.12", "0.1 0.2 0.3"),
)  # fmt: skip
"""Every kind of joint follows every other; chains of mimics, a joint that follows one further out, and one beside."""

DRIVEN = {"parallelogram": ("turn", "lift", "reach", "spin"), "coupled": ("turret", "swing", "stage_1", "finger")}
"""Joints that a table has columns for."""


def by_hand(name, q):
    """Positions of all movable joints, from the root on, at (N, n) positions of the driven ones."""
    if name == "parallelogram":
        turn, lift, reach, spin = q.T
        return np.stack([turn, lift, reach, 0.3 - reach, spin], axis=1)
    turret, swing, stage, finger = q.T
    second = 1.1 * stage + 0.02
    jaw = 3 * finger + 0.1
    moves = [0.4 * swing - 0.2, turret, swing, stage, second, 0.05 - 2 * second, 0.5 * turret + 1.3, 0.05 * turret, jaw]
    return np.stack(moves, axis=1)


ARMS = {"parallelogram": (PARALLELOGRAM, "tool"), "coupled": (COUPLED, "tip")}


def coupled(name):
    """The arm whose joints mimic."""
    text, tool = ARMS[name]
    return load_robot(text, tool)


def explicit(name):
    """The same arm without a mimic tag; branches stand where they stand on the other one."""
    text, tool = ARMS[name]
    return load_robot(re.sub(r"<mimic[^>]*>", "", text.replace(THUMB, THUMB_BY_HAND)), tool)
