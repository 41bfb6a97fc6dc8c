"""A chain as arrays of numbers: who follows whom, and where every frame is."""

import numpy as np

from thermal_robot import kinematics as kin
from thermal_robot.kinematics.model import PRISMATIC, REVOLUTE
from thermal_robot.kinematics.walk import FIXED, SLIDES, TURNS, TURNS_ALIGNED, arm_of


def test_kinds_are_those_of_the_chain(arm):
    kinds = arm_of(arm.chain, None).kinds
    np.testing.assert_array_equal(kinds == SLIDES, arm.chain.kinds == PRISMATIC)
    np.testing.assert_array_equal((kinds == TURNS) | (kinds == TURNS_ALIGNED), arm.chain.kinds == REVOLUTE)
    np.testing.assert_array_equal(np.flatnonzero(kinds != FIXED), arm.chain.movable)


def test_each_joint_follows_its_leader(arm, configurations):
    q, ready = configurations(arm, 20), arm_of(arm.chain, None)
    found = np.where(ready.lead >= 0, ready.factor * q[:, ready.lead], 0.0) + ready.offset
    np.testing.assert_allclose(found, arm.chain.coupling.positions(q), rtol=0.0, atol=1e-15)
    # of those with one leader one is the first and one is the last, and every driving joint leads
    for picked in (ready.first, ready.last):
        assert sorted(ready.lead[picked & (ready.lead >= 0)]) == list(range(arm.n))


def test_with_all_joints_at_zero_the_placements_lead_to_the_tool(arm):
    ready, tool = arm_of(arm.chain, None), np.eye(4)
    for place, aligned in zip(ready.place, ready.aligned, strict=True):
        tool = tool @ np.vstack([place, [0, 0, 0, 1]]) @ np.vstack([aligned, [0, 0, 0, 1]])
    tool = tool @ np.vstack([ready.back, [0, 0, 0, 1]])
    if not np.any(arm.chain.coupling.offset):
        np.testing.assert_allclose(tool, kin.tool_poses(arm, np.zeros(arm.n))[0], rtol=0.0, atol=1e-12)
