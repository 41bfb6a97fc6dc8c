"""The walk along a chain: its constant steps, and frames that are kept or not."""

import numpy as np
import pytest
import reference

from thermal_robot.kinematics.walk import NOWHERE, steps, walk


@pytest.mark.parametrize("keep", [True, False])
def test_the_tool_does_not_depend_on_whether_frames_are_kept(arm, configurations, keep):
    q, elements = configurations(arm, 50), len(arm.chain.names)
    frames, tool = np.full((elements, 3, 4, 50), np.nan), np.full((3, 4, 50), np.nan)
    walk(arm.chain, q, NOWHERE, slice(0, 50), frames, tool, keep=keep)
    expected = np.moveaxis(reference.tool_poses(arm, q)[:, :3], 0, -1)
    np.testing.assert_allclose(tool, expected, rtol=0.0, atol=1e-12)


def test_a_chunk_is_its_rows_of_all(awkward, configurations):
    q, elements = configurations(awkward, 90), len(awkward.chain.names)
    part = slice(30, 70)
    frames, tool = np.empty((elements, 3, 4, 40)), np.empty((3, 4, 40))
    walk(awkward.chain, q, NOWHERE, part, frames, tool)
    expected = reference.chain_frames(awkward, q[part])
    np.testing.assert_allclose(frames[:, :, :3], np.moveaxis(expected.rotations, 0, -1), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(frames[:, :, 3], np.moveaxis(expected.positions, 0, -1), rtol=0.0, atol=1e-12)


def test_steps_are_made_once_and_say_which_joints_follow(arm):
    taken = steps(arm.chain)
    assert steps(arm.chain) is taken
    assert taken.plain == (len(arm.chain.movable) == arm.n)
    assert [k for k, step in enumerate(taken.each) if step.joint is not None] == arm.chain.movable.tolist()
