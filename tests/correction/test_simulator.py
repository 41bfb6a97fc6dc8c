"""Your own simulator: the robot is compared with it, and the found cause is written back into it."""

import re
from dataclasses import replace

import numpy as np
import pytest
from conftest import load_arm
from floor import NOISE, TARGET, real_robot
from readers import displaced

from thermal_robot import CampaignError, diagnose, observe
from thermal_robot.campaign import Campaign
from thermal_robot.correction import calibrated, calibrated_mjcf, with_simulator
from thermal_robot.correction.mujoco_models import mjcf_of_urdf
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import quaternion_to_rotation, tool_poses
from thermal_robot.robot import load_robot


def gap(campaign):
    """Rms distance of the robot from what is predicted of it, the base fitted, m."""
    left = observe(campaign, register(campaign)).gap[:, :3]
    return np.sqrt((left**2).sum(axis=1).mean())


@pytest.mark.parametrize("name", ["rv_m2", "ur5", "awkward-from-base", "coupled"])
def test_the_simulators_prediction_is_that_of_its_model(name, configurations):
    arm = load_arm(name)
    robot, q = displaced(arm, 3), configurations(arm, 8)
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (8, 1))
    campaign = Campaign("commands", arm, q, np.zeros((8, 3)), turned, target=TARGET)
    plain = with_simulator(campaign, mjcf_of_urdf(arm.urdf))
    expected = (tool_poses(arm, q) @ np.append(TARGET, 1.0))[:, :3]
    np.testing.assert_allclose(plain.simulated_position, expected, atol=1e-12)
    # of a calibrated model its own target is taken, translated or placed anew
    for text in (calibrated_mjcf(robot), calibrated_mjcf(robot, mjcf_of_urdf(arm.urdf))):
        moved = with_simulator(campaign, text)
        poses = tool_poses(arm, q, robot.displacement) @ robot.target
        np.testing.assert_allclose(moved.simulated_position, poses[:, :3, 3], atol=1e-12)
        np.testing.assert_allclose(quaternion_to_rotation(moved.simulated_orientation), poses[:, :3, :3], atol=1e-12)


def test_zeros_that_are_found_against_the_simulator_mend_it(tmp_path):
    """The simulator has the robot's true lengths, the URDF has not: only the zeros are at fault."""
    arm = load_arm("ur5")
    zeros = np.array([0.0, 1.2e-3, -0.8e-3, 1.5e-3, 0.9e-3, 0.0])
    campaign = real_robot(arm, 4, zeros=zeros)
    file = tmp_path / "simulator.xml"
    file.write_text(mjcf_of_urdf(arm.urdf))
    forearm = re.search(r'<joint name="wrist_1_joint".*?xyz="[^" ]+ [^" ]+ ([\d.]+)"', arm.urdf, re.DOTALL)
    wrong = arm.urdf[: forearm.start(1)] + f"{float(forearm[1]) + 2e-3}" + arm.urdf[forearm.end(1) :]
    campaign = replace(campaign, robot=load_robot(wrong, arm.tool_frame, root_frame=arm.root_frame))
    against = with_simulator(campaign, file)
    found = diagnose(against)
    assert found.verdict == ("joint_offset",)
    known = {p.name.split(", ")[1]: p for p in found.finding("joint_offset").parameters if p.identified}
    for joint, value in zip(arm.joint_names, zeros, strict=True):
        if joint in known:
            assert abs(known[joint].value - value) < 4 * known[joint].std
    mended = with_simulator(campaign, calibrated_mjcf(calibrated(found.model), file))
    before, after = gap(against), gap(mended)
    assert before > 10 * NOISE
    assert after < 1.05 * np.sqrt(3.0) * NOISE
    assert diagnose(mended).verdict == ()


def test_geometry_that_is_found_mends_the_simulator_where_nothing_was_measured():
    arm = load_arm("rv_m2")
    campaign = real_robot(arm, 5, misplaced=4e-4, samples=240)
    train, rest = campaign.take(np.arange(0, 240, 2)), campaign.take(np.arange(1, 240, 2))
    text = mjcf_of_urdf(arm.urdf)
    found = diagnose(with_simulator(train, text))
    assert found.verdict == ("geometric",)
    for sigma in (None, 2.0):
        robot = calibrated(found.model, min_sigma=sigma)
        before, after = gap(with_simulator(rest, text)), gap(with_simulator(rest, calibrated_mjcf(robot, text)))
        assert before > 10 * NOISE
        assert after < 1.3 * np.sqrt(3.0) * NOISE, sigma


def test_a_simulator_is_mended_again_and_again():
    """What the first calibration missed, or came later, is added to it: tool and zeros."""
    arm, text = load_arm("rv_m2"), mjcf_of_urdf(load_arm("rv_m2").urdf)
    worn = real_robot(arm, 6, zeros=np.array([0.0, 1e-3, -1e-3, 2e-3, 0.0]))
    # the target sits elsewhere than declared, too
    first = replace(worn, target=TARGET + 2e-3)
    for _ in range(2):
        found = diagnose(with_simulator(first, text))
        text = calibrated_mjcf(calibrated(found.model), text)
        assert gap(with_simulator(first, text)) < 1.1 * np.sqrt(3.0) * NOISE
    crashed = replace(real_robot(arm, 6, zeros=np.array([0.0, 1e-3, 2e-3, 2e-3, 0.0])), target=first.target)
    assert gap(with_simulator(crashed, text)) > 10 * NOISE
    found = diagnose(with_simulator(crashed, text))
    known = {p.name: p.value for p in found.finding("joint_offset").parameters}
    assert known["zero offset, joint_3"] == pytest.approx(3e-3, abs=2e-4)
    mended = calibrated_mjcf(calibrated(found.model), text)
    assert gap(with_simulator(crashed, mended)) < 1.1 * np.sqrt(3.0) * NOISE


def test_what_the_model_lacks_is_named(rv_m2):
    campaign = Campaign("commands", rv_m2, np.zeros((2, 5)))
    text = mjcf_of_urdf(rv_m2.urdf)
    with pytest.raises(CampaignError, match="no joint 'joint_3'"):
        with_simulator(campaign, text.replace('"joint_3"', '"elbow"'))
    with pytest.raises(CampaignError, match="no tool frame 'tool0'"):
        with_simulator(campaign, text.replace('"tool0"', '"flange"'))
