"""The arm for a drawing: links where Pinocchio has them, each place with its share."""

import numpy as np
import pinocchio as pin

from thermal_robot.diagnosis import arm as drawn
from thermal_robot.diagnosis.arm import link_poses
from thermal_robot.diagnosis.parts import Where


def positions(robot, row):
    """Pinocchio's configuration: a joint without limits is a point on the circle."""
    full = pin.neutral(robot.model)
    names = [robot.chain.names[k] for k in robot.chain.movable]
    for name, value in zip(names, robot.chain.coupling.positions(row[None])[0], strict=True):
        joint = robot.model.joints[robot.model.getJointId(name)]
        turns = joint.nq > joint.nv
        full[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(value), np.sin(value)] if turns else [value]
    return full


def test_links_stand_where_pinocchio_has_them(arm, configurations):
    robot = arm
    q = configurations(robot, 5)
    model = robot.model
    data = model.createData()
    for row, poses in zip(q, link_poses(robot, q), strict=True):
        full = positions(robot, row)
        pin.framesForwardKinematics(model, data, full)
        root = data.oMf[model.getFrameId(robot.root_frame, pin.FrameType.BODY)]
        for name, pose in zip((*robot.chain.parent_links, robot.tool_frame), poses, strict=True):
            expected = root.actInv(data.oMf[model.getFrameId(name, pin.FrameType.BODY)]).homogeneous
            np.testing.assert_allclose(pose, expected, atol=1e-12)


def test_each_place_has_its_share(arm):
    robot = arm
    joint, link = robot.joint_names[1], robot.chain.parent_links[1]
    shown = drawn.arm(robot, np.zeros((1, robot.n)), Where({}, {joint: 0.4}, {link: 0.3}, {}))
    assert dict(zip(shown.joints, shown.joint_shares, strict=True))[joint] == 0.4
    assert dict(zip(shown.links, shown.link_shares, strict=True))[link] == 0.3
    assert shown.joint_shares.sum() == 0.4
    assert shown.link_shares.sum() == 0.3
    assert shown.links[-1] == robot.tool_frame
    # what a joint moves is the child of its placement
    assert [robot.chain.parent_links[k - 1] for k in shown.moves] == [
        robot.chain.parent_links[k] for k in robot.chain.movable
    ]
