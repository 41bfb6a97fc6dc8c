"""What goes into the ledger: a hand of some length, and nothing else about the robot."""

import numpy as np
import pytest

from thermal_robot import cli
from thermal_robot.errors import RobotError
from thermal_robot.kinematics import tool_poses
from thermal_robot.paper import PaperInputs, rv_m2_with_hand
from thermal_robot.paper.inputs import joints


def test_the_hand_is_the_only_change_of_the_robot():
    nominal, other = rv_m2_with_hand(PaperInputs().l5), rv_m2_with_hand(0.123)
    assert nominal.segments[-1].length == rv_m2_with_hand().segments[-1].length
    assert [s.name for s in other.segments] == [s.name for s in nominal.segments]
    assert [s.length for s in other.segments[:-1]] == [s.length for s in nominal.segments[:-1]]
    assert (nominal.segments[-1].length, other.segments[-1].length) == (0.15, 0.123)


@pytest.mark.parametrize("l5", ["0", "-0.1", "nan", "inf", "5e-324", "1e-9", "1001", "1e154", "1e308"])
def test_a_hand_that_arithmetic_does_not_bear_is_refused_in_one_line(capsys, l5):
    words = (
        "l5 must be from 0.001 to 1000 m long" if 0.0 < float(l5) < np.inf else "l5 must be a positive number of metres"
    )
    with pytest.raises(RobotError, match=words):
        PaperInputs(l5=float(l5))
    assert cli.main(["paper", f"--l5={l5}"]) == 2
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"thermal-robot: {words}, got {float(l5)}\n")


def test_a_word_for_a_length_is_refused_in_one_line(capsys):
    with pytest.raises(SystemExit, match="2"):
        cli.main(["paper", "--l5", "long"])
    assert capsys.readouterr().err.count("\n") == 1


def test_joints_are_those_of_the_robot_and_the_fifth_moves_nothing():
    q = joints(*PaperInputs().poses)
    assert q.shape == (2, 5)
    turned = q + np.array([0.0, 0.0, 0.0, 0.0, 1.3])
    places = [tool_poses(rv_m2_with_hand(), angles)[:, :3, 3] for angles in (q, turned)]
    np.testing.assert_allclose(places[1], places[0], atol=1e-15)


def test_poses_lie_within_the_limits_of_the_robot():
    robot, inputs = rv_m2_with_hand(), PaperInputs()
    q = joints(*inputs.poses, inputs.pose_5a)
    assert np.all((q >= robot.lower) & (q <= robot.upper))
