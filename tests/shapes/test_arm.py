"""The arm for a drawing: links where Pinocchio has them, each place with its share."""

import numpy as np

from thermal_robot.shapes import arm as drawn


def test_the_tool_stands_where_the_robot_says(arm, configurations):
    q = configurations(arm, 5)
    shown = drawn.arm(arm, q, {})
    np.testing.assert_allclose(shown.poses[:, -1], arm.forward(q), atol=1e-12)
    np.testing.assert_allclose(shown.poses[:, 0], np.broadcast_to(np.eye(4), (5, 4, 4)), atol=1e-12)


def test_each_place_has_its_share(arm):
    robot = arm
    joint, link = robot.joint_names[1], robot.chain.parent_links[1]
    shown = drawn.arm(robot, np.zeros((1, robot.n)), {("joint", joint): 0.4, ("link", link): 0.3})
    assert dict(zip(shown.joints, shown.joint_shares, strict=True))[joint] == 0.4
    assert dict(zip(shown.links, shown.link_shares, strict=True))[link] == 0.3
    assert shown.joint_shares.sum() == 0.4
    assert shown.link_shares.sum() == 0.3
    assert (shown.base_share, shown.tool_share, shown.instrument_share) == (0.0, 0.0, 0.0)
    ends = drawn.arm(robot, np.zeros((1, robot.n)), {("base", "base"): 0.2, ("instrument", "instrument"): 0.1})
    assert (ends.base_share, ends.tool_share, ends.instrument_share) == (0.2, 0.0, 0.1)
    assert shown.links[-1] == robot.tool_frame
    # what a joint moves is the child of its placement
    assert [robot.chain.parent_links[k - 1] for k in shown.moves] == [
        robot.chain.parent_links[k] for k in robot.chain.movable
    ]
