"""What is expected of a robot file alone is what it does on fresh rows, read again by the program's own reader."""

from dataclasses import replace

import numpy as np
import pytest
from floor import real_robot

from thermal_robot import CorrectedModel, calibrate, load_robot, simulate
from thermal_robot.correction import calibrated, calibrated_urdf, zero_offsets
from thermal_robot.correction.holding import at_poses
from thermal_robot.inference.registration import register
from thermal_robot.observations import observe

TRAINED, FRESH = np.arange(120), np.arange(120, 500)


def gap(campaign):
    """Rms distance, m, of rows whose unknown frames are registered anew."""
    seen = observe(campaign, register(campaign))
    return np.sqrt((seen.gap[:, :3] ** 2).sum(axis=1).mean())


def with_file(model, fresh, expected):
    how = {"min_sigma": expected.min_sigma, "alone": bool(expected.alone)}
    if expected.holds == "placements":
        return replace(fresh, robot=load_robot(calibrated_urdf(calibrated(model, **how)), model.robot.tool_frame))
    zeros = -zero_offsets(model, **how)["add_to_command"].to_numpy()
    return replace(fresh, q=fresh.q + zeros, travelled={})


def shrinks(model, fresh, expected):
    return 1.0 - (gap(with_file(model, fresh, expected)) / gap(fresh)) ** 2


def test_a_file_shrinks_the_gap_of_fresh_rows_as_it_is_expected_to(rv_m2):
    campaign = real_robot(rv_m2, 3, zeros=[0.0, 1.5e-3, -1e-3, 8e-4, 0.0], samples=500)
    model = calibrate(campaign.take(TRAINED), "joint_offset").model
    model = CorrectedModel.from_dict(model.to_dict())
    assert {(f.holds, f.min_sigma, bool(f.alone)) for f in model.files} >= {
        ("placements", None, True),
        ("zeros", 2.0, False),
    }
    for expected in model.files:
        if expected.holds != "ticks":
            assert shrinks(model, campaign.take(FRESH), expected) == pytest.approx(expected.shrinkage, abs=0.05)
            assert expected.shrinkage > 0.9


def test_beside_what_no_file_holds_a_file_that_was_fitted_alone_does_better(rv_m2):
    """Gears that yield stay in the model; zeros fitted beside them are not the best zeros without them."""
    worn = {"joint_offset": {"joint_2": 8e-4, "joint_3": -6e-4}, "joint_compliance": {"joint_2": 3e-5, "joint_3": 4e-5}}
    campaign = simulate("builtin:rv_m2", worn, tool_frame="tool0", rows=500, noise=2e-5, seed=2, base_known=False)
    model = calibrate(campaign.take(TRAINED), ["joint_offset", "joint_compliance"]).model
    files = {(f.holds, bool(f.alone)): f for f in model.files if f.min_sigma is None}
    stands, alone = (files["placements", own] for own in (False, True))
    fresh = campaign.take(FRESH)
    assert alone.shrinkage > stands.shrinkage
    assert shrinks(model, fresh, alone) > shrinks(model, fresh, stands)
    for expected in (stands, alone):
        low, high = expected.shrinkage_ci95
        assert low < expected.shrinkage < high
        assert shrinks(model, fresh, expected) == pytest.approx(expected.shrinkage, abs=(high - low))


def test_at_poses_of_another_kind_the_model_tells_what_a_file_does(rv_m2):
    """Gears yield most where the arm is stretched; of the rows where it is not, the held-out share tells nothing."""
    worn = {"joint_offset": {"joint_2": 8e-4, "joint_3": -6e-4}, "joint_compliance": {"joint_2": 3e-5, "joint_3": 4e-5}}
    campaign = simulate("builtin:rv_m2", worn, tool_frame="tool0", rows=900, noise=2e-5, seed=2, base_known=False)
    model = calibrate(campaign.take(np.arange(300)), ["joint_offset", "joint_compliance"]).model
    far = 300 + np.argsort(np.linalg.norm(observe(campaign).position[300:], axis=1))
    left = []
    for rows in (far[:150], far[-150:]):
        there = campaign.take(np.sort(rows))
        for said, own in zip(at_poses(model, there), model.files, strict=True):
            if own.holds != "ticks":
                left.append([1.0 - share for share in (said.shrinkage, own.shrinkage, shrinks(model, there, own))])
    at_these, held_out, real = np.sqrt(left).T
    assert np.abs(at_these - real).max() < 0.05
    assert np.abs(held_out - real).max() > 0.3


def test_of_a_model_without_a_constant_part_nothing_is_expected(rv_m2):
    worn = {"backlash": {"joint_3": 3e-4}}
    campaign = simulate("builtin:rv_m2", worn, tool_frame="tool0", rows=60, noise=2e-5, seed=1)
    assert calibrate(campaign, "backlash").model.files == ()
