"""What is shown, as numbers: the gap is measured − predicted, links are where Pinocchio has them, arrows end there."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from thermal_robot.campaign import Campaign
from thermal_robot.datasets import demo_campaign
from thermal_robot.diagnosis.result import told
from thermal_robot.diagnosis.values import DataFault, Misfit
from thermal_robot.errors import CampaignError
from thermal_robot.kinematics import quaternion_to_rotation, tool_poses
from thermal_robot.viewer.scene import arrows, readable, scene_of_campaign, scene_of_diagnosis, turned_along, unit_arrow
from thermal_robot.viewer.settings import FULL_SHARE, LONGEST_ARROW, NO_SHARE, colours, linear

SIZE = 2.0
VECTORS = np.vstack([np.eye(3), -np.eye(3), np.zeros((1, 3)), np.random.default_rng(0).normal(size=(50, 3))]) * 1e-4


def test_the_gap_leads_from_predicted_to_measured_with_its_remainder_and_shares(found, scene):
    """In the measurement frame, as the fitted base has it."""
    campaign, base = demo_campaign(), found.fit.nominal.frames.base
    there = (scene.predicted + scene.gap) @ base[:3, :3].T + base[:3, 3]
    np.testing.assert_allclose(there, campaign.position, atol=1e-12)
    np.testing.assert_array_equal(scene.rows, campaign.rows)
    np.testing.assert_array_equal(scene.remainder, found.rows.remainder[:, :3])
    assert set(scene.rows[scene.aside]) == set(found.outliers)
    kept = ~scene.aside
    assert np.linalg.norm(scene.remainder[kept]) < 0.5 * np.linalg.norm(scene.gap[kept])
    poses = tool_poses(scene.robot, scene.q)
    np.testing.assert_allclose(poses[:, :3, :3] @ scene.target + poses[:, :3, 3], scene.predicted, atol=1e-12)
    shares = list(scene.shares.values())
    assert shares == sorted(shares, reverse=True)
    for kind, known in (("joint", found.where.joints), ("link", found.where.links)):
        assert {name: s for (k, name), s in scene.shares.items() if k == kind} == known
    by_effects = sum(place.share for f in found.effects for place in f.locations if f.name in found.verdict)
    assert sum(shares) == pytest.approx(by_effects)
    beyond = replace(found.where, beyond={"tool": 0.25})
    assert scene_of_diagnosis(replace(found, where=beyond)).shares["tool", "tool"] == 0.25


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
    known = {"position": np.arange(12.0).reshape(4, 3), "base_known": True, "tool_known": True}
    axes = scene_of_campaign(Campaign("a", awkward, np.repeat(q, 4, axis=0), **known)).joints(0)[1]
    for j, kind in enumerate(awkward.joint_types):
        step = 1e-6 * np.eye(awkward.n)[j]
        moved = (awkward.forward(q[0] + step) - awkward.forward(q[0] - step)) / 2e-6
        turned = moved[:3, :3] @ awkward.forward(q[0])[:3, :3].T
        along = moved[:3, 3] if kind == "prismatic" else np.array([turned[2, 1], turned[0, 2], turned[1, 0]])
        np.testing.assert_allclose(axes[j], along, atol=1e-6)


def test_without_a_diagnosis_or_where_the_table_does_not_fit_there_is_the_gap_alone(found):
    scene = scene_of_campaign(demo_campaign())
    assert (scene.remainder, scene.shares) == (None, {})
    assert not scene.aside.any()
    assert 50e-6 < np.sqrt(np.median((scene.gap**2).sum(axis=1))) < 80e-6
    with pytest.raises(CampaignError, match="nothing was measured"):
        scene_of_campaign(replace(demo_campaign(), position=None))
    fault = DataFault(("shifted rows",), "rows are shifted", "shift them back", 0.1, 1e-4)
    unusable = told(replace(found, misfit=Misfit(fault)))
    scene = scene_of_diagnosis(unusable)
    assert scene.summary == unusable.reason
    assert "Shift them back" in scene.summary
    assert (scene.remainder, scene.shares) == (None, {})
    np.testing.assert_array_equal(scene.gap, found.rows.gap[:, :3])
    with pytest.raises(ValueError, match="without its fit"):
        scene_of_diagnosis(replace(found, fit=None))


def test_the_eye_sees_all_of_it_and_the_arm_does_not_point_there(scene):
    away = scene.eye - scene.centre
    assert 0.5 * scene.size < np.linalg.norm(away) < 1.5 * scene.size
    assert away @ scene.up > 0.0
    mean = scene.predicted.mean(axis=0)
    ahead, level = (of - (of @ scene.up) * scene.up for of in (mean, away))
    assert abs(ahead @ level) < 0.5 * np.linalg.norm(ahead) * np.linalg.norm(level)
    corners = np.array([scene.predicted.min(axis=0), scene.predicted.max(axis=0)])
    assert np.linalg.norm(np.ptp(corners, axis=0)) <= scene.size


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, 0.0, 9.81), (9.81, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_up_is_against_gravity(scene, gravity):
    turned = replace(scene, robot=replace(scene.robot, gravity=np.array(gravity)))
    assert np.linalg.norm(turned.up) == pytest.approx(1.0)
    assert turned.up @ gravity == pytest.approx(-np.linalg.norm(gravity))
    assert np.isfinite(turned.eye).all()
    around = replace(turned, predicted=np.zeros_like(scene.predicted))  # it reaches in no direction
    assert 0.5 * scene.size < np.linalg.norm(around.eye - around.centre) < 1.5 * scene.size


def tips(displacements, magnification):
    """Where the tips of arrows come to lie from their starts."""
    turns, stretches = arrows(displacements, magnification, SIZE)
    return np.einsum("nij,nj->ni", quaternion_to_rotation(turns), np.array([0.0, 0.0, 1.0]) * stretches)


def test_arrows_are_magnified_displacements_and_gross_errors_are_cut():
    for magnification in (1.0, 250.0):
        np.testing.assert_allclose(tips(VECTORS, magnification), magnification * VECTORS, atol=1e-12)
    long = tips(np.array([[3.0, 4.0, 0.0]]), 100.0)
    np.testing.assert_allclose(long, [LONGEST_ARROW * SIZE * np.array([0.6, 0.8, 0.0])], atol=1e-12)
    thin, thick = (arrows(VECTORS, 100.0, SIZE, by)[1] for by in (1.0, 3.0))
    assert (thin[:, 0] <= thin[:, 2]).all()  # none is wider than long
    assert (thick[:, 0] >= thin[:, 0]).all()
    assert (thick[:6, 0] > thin[:6, 0]).all()
    np.testing.assert_array_equal(thick[:, 2], thin[:, 2])
    turns = turned_along(VECTORS)
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)


def test_the_unit_arrow_is_closed_and_points_along_z():
    mesh = unit_arrow()
    assert mesh.is_watertight
    assert mesh.volume > 0.0  # seen from outside
    np.testing.assert_allclose(mesh.bounds, [[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]], atol=1e-12)
    assert mesh.center_mass[2] > 0.5  # the head is at the end


@pytest.mark.parametrize("scale", [1e-6, 3e-5, 1e-4, 7e-4, 1e-2])
def test_what_is_readable_is_a_round_number_that_fits(scale):
    given = scale / 1e-4 * VECTORS
    magnification = readable(given, SIZE)
    leading = magnification / 10.0 ** np.floor(np.log10(magnification) + 1e-9)
    assert min(abs(leading - step) for step in (1, 2, 5)) < 1e-9
    assert 0.02 * SIZE < np.quantile(arrows(given, magnification, SIZE)[1][:, 2], 0.9) < 0.1 * SIZE
    assert readable(np.zeros((4, 3)), SIZE) == readable(np.zeros((0, 3)), SIZE) == 1.0


def test_colours_are_ordered_by_share_and_pale_where_no_place_matters():
    def brightness(colour):
        """Relative luminance, ITU-R BT.709, of colours as they are stored."""
        return np.dot([0.2126, 0.7152, 0.0722], colour)

    shares = {("joint", f"j{k}"): share for k, share in enumerate([0.61, 0.2, 0.12, 0.05, 0.02, 0.0])}
    bright = [brightness(colour) for colour in colours(shares).values()]
    assert (np.diff(bright) > 0.0).all()  # the larger the share the darker, for those too who see no colours
    assert (colours(shares)["joint", "j0"], colours(shares)["joint", "j5"]) == (FULL_SHARE, NO_SHARE)
    pale = colours({("link", "a"): 0.01, ("link", "b"): 0.002, ("link", "c"): -1.0})
    assert min(map(brightness, pale.values())) > 0.5 * (brightness(NO_SHARE) + brightness(FULL_SHARE))
    assert pale["link", "c"] == NO_SHARE
    assert colours({}) == {}


def test_half_the_light_is_more_than_half_of_what_a_screen_takes():
    """Printed pairs of sRGB: 188 is half the light, 118 is 18 %, the grey card of photographers."""
    assert linear([0, 255, 188]).tolist() == [0, 255, 128]
    assert linear([118]).item() == round(0.18 * 255)
    assert (np.diff(linear(np.arange(256)).astype(int)) >= 0).all()
