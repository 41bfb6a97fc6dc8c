"""The calibrated robot as kinematics.yaml: read back it leads where the model does."""

from dataclasses import replace

import numpy as np
import pytest
import ur_arm
from readers import displaced

from thermal_robot import CampaignError
from thermal_robot.campaign.ur_kinematics import with_kinematics
from thermal_robot.correction import ur_kinematics
from thermal_robot.kinematics import Displacement, tool_poses
from thermal_robot.robot import load_robot


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("prefix", ["", "r_"])
def test_written_and_read_it_leads_where_the_model_does(tmp_path, seed, prefix):
    rng = np.random.default_rng(seed)
    robot = load_robot(ur_arm.urdf(prefix=prefix), f"{prefix}tool0")
    moved = displaced(robot, rng, 1e-3)
    text = ur_kinematics(moved)
    (tmp_path / "k.yaml").write_text(text)
    q = rng.uniform(-3, 3, (10, 6))
    expected = tool_poses(robot, q, moved.displacement)
    assert np.abs(expected - tool_poses(robot, q)).max() > 1e-4
    read = with_kinematics(robot, tmp_path / "k.yaml")
    np.testing.assert_allclose(tool_poses(read, q), expected, rtol=0, atol=1e-12)
    still = Displacement(np.zeros(6), np.zeros((len(read.segments), 6)))
    (tmp_path / "again.yaml").write_text(ur_kinematics(replace(moved, robot=read, displacement=still)))
    again = with_kinematics(robot, tmp_path / "again.yaml")
    np.testing.assert_allclose(tool_poses(again, q), expected, rtol=0, atol=1e-12)


def test_robots_of_others_have_no_such_file():
    robot = load_robot("builtin:rv_m2", "tool0")
    with pytest.raises(CampaignError, match="'rv_m2' has no shoulder_pan_joint"):
        ur_kinematics(displaced(robot, np.random.default_rng(0), 1e-3))
