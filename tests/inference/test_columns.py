"""Columns of effects and of the unknown frames."""

from dataclasses import replace

import numpy as np
import pytest
from simulate import simulate

from thermal_robot.effects import library
from thermal_robot.inference.columns import block, frame_columns, moved_by
from thermal_robot.inference.registration import moved
from thermal_robot.kinematics import exp6, rotation_to_quaternion
from thermal_robot.observations import Frames, observe


@pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda", "awkward-from-base"], indirect=True)
@pytest.mark.parametrize("turning", [None, 1e-5], ids=["positions", "poses"])
def test_frame_columns_are_the_derivative_of_the_exact_frames(arm, turning):
    campaign = simulate(arm, samples=8, turning=turning, seed=1)[0]
    rng = np.random.default_rng(3)
    frames = Frames(exp6(rng.normal(size=6) * 2.0), exp6(rng.normal(size=6) * [0.1, 0.1, 0.1, 1, 1, 1]))
    nominal = observe(campaign, frames)
    turned = rotation_to_quaternion(frames.base[:3, :3] @ nominal.rotation) if turning else None
    campaign = replace(campaign, position=nominal.predicted_position, orientation=turned)
    columns, names = frame_columns(observe(campaign, frames))
    assert names == ("base",) * 6 + ("tool",) * (3 if turning is None else 6)
    differences = np.zeros_like(columns)
    for k in range(len(names)):
        step = 1e-5 * np.eye(len(names))[k]
        ahead, behind = (observe(campaign, moved(frames, s, names)).gap for s in (step, -step))
        differences[:, :, k] = -(ahead - behind) / 2e-5
    scale = np.abs(columns).max(axis=(0, 1))
    np.testing.assert_array_less(np.abs(columns - differences).max(axis=(0, 1)), 1e-6 * scale)


def test_frames_that_are_known_have_no_columns(rv_m2):
    data = simulate(rv_m2, samples=8, seed=1)[0]
    both = frame_columns(observe(data))[1]
    base = frame_columns(observe(replace(data, tool_known=True)))[1]
    tool = frame_columns(observe(replace(data, base_known=True)))[1]
    assert both == (*base, *tool) == ("base",) * 6 + ("tool",) * 3
    none, names = frame_columns(observe(replace(data, base_known=True, tool_known=True)))
    assert none.shape == (8, 3, 0)
    assert names == ()
    # a simulator predicts the declared target
    simulated = replace(data, simulated_position=data.position)
    assert frame_columns(observe(simulated))[1] == base


def test_a_stated_prior_sets_the_size_and_keeps_proportions(rv_m2):
    campaign = replace(simulate(rv_m2, samples=8, seed=1)[0], priors={"joint_offset": 4e-3, "drift": 5e-4})
    nominal = observe(campaign)
    np.testing.assert_allclose(block(nominal, library()["joint_offset"]).sizes, 4e-3)
    np.testing.assert_allclose(block(nominal, library()["drift"]).sizes, 5e-4)
    np.testing.assert_allclose(block(nominal, library()["joint_gain"]).sizes, 5e-4)


def test_positions_are_the_upper_half_of_poses(rv_m2):
    poses = simulate(rv_m2, samples=8, turning=1e-5, seed=1)[0]
    positions = replace(poses, orientation=None)
    for effect in library().values():
        if not effect.missing(observe(poses)):
            whole, half = (block(observe(c), effect).columns for c in (poses, positions))
            np.testing.assert_array_equal(half, whole[:, :3])


def test_a_block_holds_neither_columns_nor_responses(rv_m2):
    """They are computed when they are asked for: those of all settings of a large campaign would fill the memory."""
    seen = observe(simulate(rv_m2, samples=8, seed=1)[0])
    effect = library()["transmission_error"]
    item = block(seen, effect)
    assert not any(p.responses for p in item.bare)
    assert [p.name for p in item.bare] == [p.name for p in effect.parameters(seen)] == [p.name for p in item.parameters]
    assert item.columns is not item.columns
    np.testing.assert_array_equal(item.columns, moved_by(seen, effect.parameters(seen)))
    given = replace(item, source=item.columns[:3])
    assert given.columns is given.source


def test_what_is_rounding_is_no_column(rv_m2):
    """A torque about an axis through the centre of mass is what the last bits leave: its column would be noise."""
    rng, data = np.random.default_rng(5), simulate(rv_m2, samples=30, seed=1)[0]
    sizes = dict(zip(rv_m2.joint_names, [20.0, 10.0, 5.0, 1.0, 4e-16], strict=False))
    torques = {f"torque.{joint}": size * rng.normal(size=30) for joint, size in sizes.items()}
    seen = observe(replace(data, covariates={**data.covariates, **torques}))
    item = block(seen, library()["joint_compliance"])
    largest = dict(zip([p.place for p in item.bare], np.abs(item.columns).max(axis=(0, 1)), strict=True))
    hidden = [joint for joint, size in sizes.items() if size < 1e-12]
    assert [largest[joint] for joint in hidden] == [0.0]
    assert all(largest[joint] > 0.0 for joint in sizes if joint not in hidden)
