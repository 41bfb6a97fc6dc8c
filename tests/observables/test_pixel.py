"""A camera on the hand, and one in the room: reprojection, its derivatives, and what is found from it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import some

import thermal_robot as tr
from thermal_robot.effects import library
from thermal_robot.effects.gate import checked
from thermal_robot.inference.algebra import equations_of, orthonormal, without
from thermal_robot.inference.columns import frame_columns
from thermal_robot.inference.fit import fit_named
from thermal_robot.inference.registration import moved, register
from thermal_robot.kinematics import homogeneous, quaternion_to_rotation
from thermal_robot.observations import observe

FX, CX, CY = 900.0, 640.0, 480.0
TRUE = np.array([0.0, 4e-3, -3e-3, 3e-3, -4e-3, 0.0])
CORNERS = np.array([[x, y, 0.0] for x in (0.0, 0.08, 0.16) for y in (0.0, 0.06, 0.12)])
EYE = np.array([[0.0, -1.0, 0.0, 0.02], [1.0, 0.0, 0.0, 0.05], [0.0, 0.0, 1.0, 0.04], [0.0, 0.0, 0.0, 1.0]])
"""Camera on the hand, a quarter turned, or board on the tool."""


@pytest.fixture(scope="module")
def ur10():
    return tr.load_robot("example-robot-data:ur10", "tool0")


def looking(eyes, at):
    """(N, 4, 4) poses at some places that look to a point, z ahead."""
    ahead = (at - eyes) / np.linalg.norm(at - eyes, axis=1, keepdims=True)
    right = np.cross(np.array([0.1, 0.2, 1.0]), ahead)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    return homogeneous(np.stack([right, np.cross(ahead, right), ahead], axis=2), eyes)


def seen_by(mount, robot, noise=0.0, poses=40, seed=0):
    """Corners of a board in images: mounted on the hand the camera moves, in the room the board does."""
    rng = np.random.default_rng(seed)
    named = dict(zip(robot.joint_names, TRUE, strict=True))
    true = tr.simulate(robot, {"joint_offset": named}, rows=poses, measures="pose", tool=EYE, base=np.eye(4), seed=seed)
    target = homogeneous(quaternion_to_rotation(true.orientation), true.position)
    if mount == "hand":
        # a board for every pose would be another campaign: the arm is led round one, by postures that see it
        board = homogeneous(np.eye(3), [0.6, 0.3, -0.2])
        points = np.tile(CORNERS @ board[:3, :3].T + board[:3, 3], (poses, 1, 1))
        inside = np.einsum("nji,nkj->nki", target[:, :3, :3], points - target[:, None, :3, 3])
    else:
        camera = looking(np.array([[2.5, 1.0, 1.2]]), np.zeros(3))[0]
        points = np.einsum("nij,kj->nki", target[:, :3, :3], CORNERS) + target[:, None, :3, 3]
        inside = (points - camera[:3, 3]) @ camera[:3, :3]
    ahead = (inside[:, :, 2] > 0.15).all(axis=1) & (np.abs(inside[:, :, :2] / inside[:, :, 2:]) < 1.5).all(axis=(1, 2))
    pixels = FX * inside[:, :, :2] / inside[:, :, 2:] + [CX, CY]
    pixels = pixels[ahead] + noise * rng.normal(size=pixels[ahead].shape)
    rows, each = np.repeat(np.flatnonzero(ahead), len(CORNERS)), np.tile(CORNERS, (int(ahead.sum()), 1))
    readings = dict(zip(("u", "v"), pixels.reshape(-1, 2).T, strict=True))
    readings |= dict(zip(("board.x", "board.y", "board.z"), each.T, strict=True))
    labels = {"kind": np.full(len(rows), "pixel"), "camera": np.full(len(rows), "front")}
    facts = {"camera": {"front": {"fx": FX, "fy": FX, "cx": CX, "cy": CY, "mount": mount}}}
    return tr.Campaign(
        mount, robot, true.q[rows], readings=readings, labels=labels, facts=facts, base_known=True, moves="unknown"
    )


@pytest.fixture(scope="module", params=["room", "hand"])
def campaign(request, ur10):
    return seen_by(request.param, ur10, poses=60 if request.param == "room" else 600)


def test_frames_are_found_from_nothing(campaign):
    seen = observe(campaign, register(campaign))
    assert len(campaign.q) > 150
    assert np.abs(seen.frames.tool[:3, :3] - EYE[:3, :3]).max() < 0.05
    assert np.linalg.norm(seen.gap, axis=1).max() < 0.05


def test_columns_are_derivatives_of_the_gap(campaign):
    some = campaign.take(np.arange(0, campaign.samples, 7))
    some = replace(some, facts={"camera": {"front": {**some.facts["camera"]["front"], "refine": True}}})
    seen = observe(some, register(some))
    columns, names = frame_columns(seen)
    assert names.count("tool") == 6
    assert names.count("camera front") == 10
    for k in range(len(names)):
        step = np.zeros(len(names))
        step[k] = 1e-6
        there, back = (observe(some, moved(seen.frames, s, names)).gap for s in (step, -step))
        assert np.allclose((back - there) / 2e-6, columns[:, :, k], atol=20.0 * np.abs(seen.gap).max())


def test_a_rigid_motion_of_all_is_an_alias(campaign):
    seen = observe(campaign, register(campaign))
    basis = orthonormal(equations_of(frame_columns(seen)[0]))
    left = without(equations_of(seen.base_sensitivity[:, :3]), basis)
    assert np.abs(left).max() < 1e-6 * np.abs(seen.base_sensitivity).max()


@pytest.mark.parametrize("mount", some(["room", "hand"], 2))
def test_what_was_wrong_is_found(ur10, mount):
    campaign = seen_by(mount, ur10, noise=0.2, poses=60 if mount == "room" else 600, seed=2)
    fit = fit_named(campaign, [library()["joint_offset"]])
    ((effect, values),) = fit.effects
    found = {p.place: v for p, v in zip(checked(effect, fit.nominal), values, strict=True)}
    for joint, value in zip(ur10.joint_names[1:5], TRUE[1:5], strict=True):
        assert found[joint] == pytest.approx(value, abs=5e-4)


def test_a_camera_is_written_and_read_again(campaign, tmp_path):
    again = tr.read_campaign(tr.write_campaign(campaign, tmp_path / "seen"))
    assert again.facts == campaign.facts
    assert np.allclose(again.readings["u"], campaign.readings["u"], atol=1e-9)
    assert np.allclose(again.readings["board.y"], campaign.readings["board.y"], atol=1e-12)
