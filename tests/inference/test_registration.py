"""Unknown frames are found wherever the instrument stands, and where it stands changes nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import some
from simulate import commands, simulate

from thermal_robot import EstimationError, diagnose
from thermal_robot.campaign import Campaign
from thermal_robot.inference.registration import register
from thermal_robot.kinematics import Displacement, align, exp3, quaternion_to_rotation, rotation_to_quaternion
from thermal_robot.observations import Frames, observe

SAMPLES = 60
on_arms = pytest.mark.parametrize("arm", some(["rv_m2", "ur10", "panda"], 3), indirect=True)
measures = pytest.mark.parametrize("with_orientation", [False, True], ids=["positions", "poses"])


def pose(turn, place):
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, place
    return motion


def turns(rng):
    """Directions that a tracker may look: as the robot, upside down about each axis, and anywhere."""
    return [np.eye(3), *exp3(np.pi * np.eye(3)), *exp3(np.pi * rng.normal(size=(2, 3)))]


def measured(robot, frames, rng, *, with_orientation, noise=0.0, turning=0.0, gross=0.0, **declared):
    """What a tracker at a given place reports of the nominal robot."""
    campaign = Campaign("registration", robot, commands(robot, SAMPLES, rng), **declared)
    seen = observe(campaign, frames)
    position = seen.predicted_position + noise * rng.normal(size=(SAMPLES, 3))
    spoilt = rng.choice(SAMPLES, int(gross * SAMPLES), replace=False)
    position[spoilt] += 0.05 * rng.normal(size=(len(spoilt), 3))
    rotation = exp3(turning * rng.normal(size=(SAMPLES, 3))) @ frames.base[:3, :3] @ seen.rotation
    rotation[spoilt] = exp3(0.3 * rng.normal(size=(len(spoilt), 3))) @ rotation[spoilt]
    return replace(
        campaign, position=position, orientation=rotation_to_quaternion(rotation) if with_orientation else None
    )


def far_frames(rng, turn):
    """The tracker metres away; the target 0.3 m from the tool frame, turned against it, declared to be at it."""
    place = rng.normal(size=3)
    tool = pose(exp3(2.0 * rng.normal(size=3)), 0.3 * place / np.linalg.norm(place))
    return Frames(pose(turn, rng.uniform(-6.0, 6.0, 3)), tool)


def assert_same_frames(found, true, within, turned_tool):
    np.testing.assert_allclose(found.base, true.base, rtol=0, atol=within)
    np.testing.assert_allclose(found.tool[:3, 3], true.tool[:3, 3], rtol=0, atol=within)
    if turned_tool:
        np.testing.assert_allclose(found.tool[:3, :3], true.tool[:3, :3], rtol=0, atol=within)


@on_arms
@measures
@pytest.mark.parametrize("gross", [0.0, 0.2])
def test_frames_are_found_exactly_wherever_the_tracker_stands(arm, with_orientation, gross):
    rng = np.random.default_rng(1)
    for turn in turns(rng):
        true = far_frames(rng, turn)
        campaign = measured(arm, true, rng, with_orientation=with_orientation, gross=gross)
        assert_same_frames(register(campaign), true, 1e-10, turned_tool=with_orientation)


@pytest.mark.parametrize("arm", some(["rv_m2", "panda"], 2), indirect=True)
@measures
@pytest.mark.parametrize("gross", [0.0, 0.2])
def test_frames_are_found_to_the_noise(arm, with_orientation, gross):
    """With 20 µm and 30 µrad a sample, sixty samples place the frames to a noise, gross errors or not."""
    rng = np.random.default_rng(2)
    misses = []
    for turn in turns(rng):
        true = far_frames(rng, turn)
        campaign = measured(arm, true, rng, with_orientation=with_orientation, noise=2e-5, turning=3e-5, gross=gross)
        found = register(campaign)
        again, exact = observe(campaign, found), observe(campaign, true)
        misses.append(np.sqrt(((again.predicted_position - exact.predicted_position) ** 2).sum(axis=1).mean()))
    # nine parameters, or twelve at orientation's help, of 180 equations: rms miss = noise · √(9/60) = 0.39 noise
    assert np.median(misses) < 2e-5 * np.sqrt(9 / 60 / (1 - gross)) * 1.3
    assert max(misses) < 2e-5


@on_arms
@measures
@pytest.mark.parametrize("base_known", [False, True])
@pytest.mark.parametrize("tool_known", [False, True])
def test_only_unknown_frames_are_fitted(arm, with_orientation, base_known, tool_known):
    rng = np.random.default_rng(3)
    true = far_frames(rng, exp3(rng.normal(size=3)))
    if base_known:
        true = replace(true, base=np.eye(4))
    if tool_known:
        tool = np.eye(4)
        tool[:3, 3] = true.tool[:3, 3]
        true = replace(true, tool=tool)
    declared = {"base_known": base_known, "tool_known": tool_known}
    target = true.tool[:3, 3] if tool_known else np.zeros(3)
    campaign = measured(arm, true, rng, with_orientation=with_orientation, target=target, **declared)
    assert_same_frames(register(campaign), true, 1e-10, turned_tool=with_orientation)
    wrong = replace(campaign, position=campaign.position + np.array([0.0, 0.0, 0.01]))
    found = register(wrong)
    if base_known:
        np.testing.assert_array_equal(found.base, np.eye(4))
    if tool_known:
        np.testing.assert_array_equal(found.tool, true.tool)


def test_rows_that_are_not_kept_do_not_matter(rv_m2):
    rng = np.random.default_rng(4)
    true = far_frames(rng, np.eye(3))
    campaign = measured(rv_m2, true, rng, with_orientation=False)
    keep = np.arange(SAMPLES) % 3 > 0
    position = campaign.position.copy()
    position[~keep] += 0.1
    assert_same_frames(register(replace(campaign, position=position), keep), true, 1e-10, turned_tool=False)
    with pytest.raises(EstimationError, match="three rows"):
        register(campaign, np.arange(SAMPLES) < 2)


def test_a_flat_or_noisy_cloud_is_turned_but_never_mirrored():
    """Points in a plane fit their mirror image as well as themselves; a tracker does not mirror."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        flat = rng.normal(size=(30, 3)) * [1.0, 1.0, 0.0]
        motion = pose(exp3(3.0 * rng.normal(size=3)), rng.normal(size=3))
        seen = flat @ motion[:3, :3].T + motion[:3, 3]
        np.testing.assert_allclose(align(flat, seen, np.ones(30)), motion, atol=1e-12)
        mirrored = align(flat + 1e-3 * rng.normal(size=(30, 3)), -seen, np.ones(30))
        assert np.linalg.det(mirrored[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "arm", ["rv_m2", *(pytest.param(arm, marks=pytest.mark.slow) for arm in ("ur10", "panda"))], indirect=True
)
def test_a_simulators_prediction_replaces_the_urdfs_and_keeps_the_declared_target(arm):
    rng = np.random.default_rng(7)
    true = far_frames(rng, exp3(rng.normal(size=3)))
    campaign = measured(arm, true, rng, with_orientation=False, target=np.array([0.0, 0.0, 0.1]))
    root = observe(campaign, replace(true, base=np.eye(4))).predicted_position
    # a simulator that knows the target, and links that the URDF does not: its own prediction in the root frame
    curved = root + 1e-3 * np.sin(3.0 * root[:, ::-1])
    told = replace(campaign, simulated_position=curved)
    told = replace(told, position=curved @ true.base[:3, :3].T + true.base[:3, 3])
    found = register(told)
    np.testing.assert_allclose(found.base, true.base, atol=1e-10)
    np.testing.assert_array_equal(found.tool, Frames.declared(told).tool)
    seen = observe(told, found)
    np.testing.assert_allclose(seen.position, curved, rtol=0, atol=1e-14)
    assert np.abs(seen.gap).max() < 1e-9
    assert diagnose(told, only=["geometric"]).gap.rms_before < 1e-9
    without = replace(told, simulated_position=None)
    assert np.sqrt((observe(without, register(without)).gap ** 2).sum(axis=1).mean()) > 1e-4


def test_a_simulators_orientation_is_the_prediction_too(rv_m2):
    rng = np.random.default_rng(9)
    campaign = simulate(rv_m2, ["joint_offset"], seed=9, samples=60, turning=3e-5)[0]
    frames = register(campaign)
    inward = np.linalg.inv(frames.base)
    told = replace(
        campaign,
        target=np.zeros(3),
        simulated_position=campaign.position @ inward[:3, :3].T + inward[:3, 3],
        simulated_orientation=rotation_to_quaternion(inward[:3, :3] @ quaternion_to_rotation(campaign.orientation)),
    )
    assert np.abs(observe(told, register(told)).gap).max() < 1e-9
    # what an error does to the URDF's pose it does to the simulator's
    error = Displacement(joint=1e-3 * rng.normal(size=5))
    plain = replace(campaign, target=np.zeros(3))
    gaps = [observe(c, displacement=d).rotation for c in (told, plain) for d in (None, error)]
    turned = [b @ a.transpose(0, 2, 1) for a, b in (gaps[:2], gaps[2:])]
    assert np.abs(turned[0] - np.eye(3)).max() > 1e-4
    np.testing.assert_allclose(turned[0], turned[1], rtol=0, atol=1e-12)
