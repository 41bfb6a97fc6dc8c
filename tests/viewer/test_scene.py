"""What is shown, as numbers: the gap is measured − predicted, links are where Pinocchio has them, shares are told."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from thermal_robot.campaign import Campaign
from thermal_robot.datasets import demo_campaign
from thermal_robot.diagnosis.result import told
from thermal_robot.diagnosis.values import DataFault, Misfit
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import tool_poses
from thermal_robot.viewer.scene import scene_of_campaign, scene_of_diagnosis


def test_the_gap_leads_from_predicted_to_measured(found, scene):
    """In the measurement frame, as the fitted base has it."""
    campaign, base = demo_campaign(), found.fit.nominal.frames.base
    there = (scene.predicted + scene.gap) @ base[:3, :3].T + base[:3, 3]
    np.testing.assert_allclose(there, campaign.position, atol=1e-12)
    np.testing.assert_array_equal(scene.rows, campaign.rows)
    np.testing.assert_array_equal(scene.remainder, found.rows.remainder[:, :3])
    assert set(scene.rows[scene.aside]) == set(found.outliers)
    kept = ~scene.aside
    assert np.linalg.norm(scene.remainder[kept]) < 0.5 * np.linalg.norm(scene.gap[kept])


def test_the_target_is_at_the_tool(scene):
    poses = tool_poses(scene.robot, scene.q)
    np.testing.assert_allclose(poses[:, :3, :3] @ scene.target + poses[:, :3, 3], scene.predicted, atol=1e-12)


def test_links_and_joints_are_where_pinocchio_has_them(scene):
    model = pin.buildModelFromXML(scene.robot.urdf)
    data = model.createData()
    for row in (0, 17, len(scene.q) - 1):
        pin.framesForwardKinematics(model, data, scene.q[row])
        for link, pose in zip(scene.robot.urdf_links, scene.links(row), strict=True):
            np.testing.assert_allclose(pose, data.oMf[model.getFrameId(link)].homogeneous, atol=1e-9)
        jacobian = pin.computeJointJacobians(model, data, scene.q[row])  # of each joint: moment of its axis, axis
        for j, (origin, axis) in enumerate(zip(*scene.joints(row), strict=True)):
            joint = model.getJointId(scene.robot.joint_names[j])
            np.testing.assert_allclose(origin, data.oMi[joint].translation, atol=1e-9)
            np.testing.assert_allclose(axis, jacobian[3:, j], atol=1e-9)


def test_axes_of_slides_and_coupled_joints_are_those_along_which_they_move(awkward, configurations):
    q = configurations(awkward, 1)
    base = Campaign(
        "a", awkward, np.repeat(q, 4, axis=0), position=np.arange(12.0).reshape(4, 3), base_known=True, tool_known=True
    )
    axes = scene_of_campaign(base).joints(0)[1]
    for j, kind in enumerate(awkward.joint_types):
        step = np.zeros(awkward.n)
        step[j] = 1e-6
        moved = (awkward.forward(q[0] + step) - awkward.forward(q[0] - step)) / 2e-6
        turned = moved[:3, :3] @ awkward.forward(q[0])[:3, :3].T
        along = moved[:3, 3] if kind == "prismatic" else np.array([turned[2, 1], turned[0, 2], turned[1, 0]])
        np.testing.assert_allclose(axes[j], along, atol=1e-6)


def test_shares_are_those_of_the_diagnosis_largest_first(found, scene):
    shares = list(scene.shares.values())
    assert shares == sorted(shares, reverse=True)
    for kind, known in (("joint", found.where.joints), ("link", found.where.links)):
        assert {name: s for (k, name), s in scene.shares.items() if k == kind} == known
    by_effects = sum(place.share for f in found.effects for place in f.locations if f.name in found.verdict)
    assert sum(shares) == pytest.approx(by_effects)


def test_a_tool_that_errs_has_a_share(found):
    beyond = replace(found.where, beyond={"tool": 0.25})
    assert scene_of_diagnosis(replace(found, where=beyond)).shares["tool", "tool"] == 0.25


def test_without_a_diagnosis_there_is_the_gap_alone():
    scene = scene_of_campaign(demo_campaign())
    assert scene.remainder is None
    assert scene.shares == {}
    assert not scene.aside.any()
    assert 50e-6 < np.sqrt(np.median((scene.gap**2).sum(axis=1))) < 80e-6


def test_what_was_not_measured_cannot_be_seen():
    with pytest.raises(CampaignError, match="nothing was measured"):
        scene_of_campaign(replace(demo_campaign(), position=None))


def test_where_the_table_does_not_fit_the_robot_the_gap_is_shown_and_the_reason_told(found):
    fault = DataFault(("shifted rows",), "rows are shifted", "shift them back", 0.1, 1e-4)
    unusable = told(replace(found, misfit=Misfit(fault)))
    scene = scene_of_diagnosis(unusable)
    assert scene.summary == unusable.reason
    assert "Shift them back" in scene.summary
    assert scene.remainder is None
    assert scene.shares == {}
    np.testing.assert_array_equal(scene.gap, found.rows.gap[:, :3])


def test_a_diagnosis_without_its_fit_is_refused(found):
    with pytest.raises(ValueError, match="without its fit"):
        scene_of_diagnosis(replace(found, fit=None))


def test_the_eye_sees_all_of_it_and_the_arm_does_not_point_there(scene):
    away = scene.eye - scene.centre
    assert 0.5 * scene.size < np.linalg.norm(away) < 1.5 * scene.size
    assert away @ scene.up > 0.0
    mean = scene.predicted.mean(axis=0)
    ahead = mean - (mean @ scene.up) * scene.up
    level = away - (away @ scene.up) * scene.up
    assert abs(ahead @ level) < 0.5 * np.linalg.norm(ahead) * np.linalg.norm(level)
    corners = np.array([scene.predicted.min(axis=0), scene.predicted.max(axis=0)])
    assert np.linalg.norm(np.ptp(corners, axis=0)) <= scene.size


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, 0.0, 9.81), (9.81, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_up_is_against_gravity(scene, gravity):
    robot = replace(scene.robot, gravity=np.array(gravity))
    turned = replace(scene, robot=robot)
    assert np.linalg.norm(turned.up) == pytest.approx(1.0)
    assert turned.up @ gravity == pytest.approx(-np.linalg.norm(gravity))
    assert np.isfinite(turned.eye).all()
