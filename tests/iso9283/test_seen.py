"""A campaign in the axes of its base: what is fitted, and what then cannot be told."""

from dataclasses import replace

import numpy as np
import pytest
from clouds import cell
from simulate import random_motion

from thermal_robot.errors import CampaignError
from thermal_robot.iso9283.measure import Seen
from thermal_robot.observations import Frames, observe

SHIFT = np.array([1e-3, 2e-3, 2e-3])


def test_known_frames_are_taken_as_they_stand(rv_m2):
    campaign = cell(rv_m2, np.arange(5), SHIFT, turn=[0, 0, 3e-3])
    seen = Seen.of(campaign, None, None)
    assert (seen.fitted, seen.unknowns, seen.figures, seen.corrected) == ((), 0, 30, None)
    found = seen.accuracy(np.array([2]))
    assert found.axes == pytest.approx(tuple(SHIFT))
    assert found.angles == pytest.approx((0, 0, 3e-3), abs=1e-9)
    assert seen.after(np.array([2])) is None


def test_axes_are_those_of_the_base_wherever_the_instrument_stands(rv_m2):
    frames = Frames(random_motion(np.random.default_rng(1), 3.0), np.eye(4))
    campaign = cell(rv_m2, np.arange(5), SHIFT, frames=frames, turn=[2e-3, 0, 0])
    found = Seen.of(campaign, frames, None).accuracy(np.array([1]))
    assert found.axes == pytest.approx(tuple(SHIFT))
    assert found.angles == pytest.approx((2e-3, 0, 0), abs=1e-9)


def test_unknown_frames_are_fitted_and_take_up_what_is_common(rv_m2):
    frames = Frames(random_motion(np.random.default_rng(2), 3.0), random_motion(np.random.default_rng(3), 0.1))
    campaign = cell(rv_m2, np.arange(8), SHIFT, frames=frames, turn=np.zeros(3), known=False)
    seen = Seen.of(campaign, None, None)
    assert (seen.fitted, seen.unknowns, seen.figures) == (("base", "tool"), 12, 48)
    assert all(seen.accuracy(np.array([k])).position < 1e-7 for k in range(8))
    assert Seen.of(replace(campaign, tool_known=True), None, None).fitted == ("base",)


@pytest.mark.parametrize(("poses", "told"), [(3, False), (4, True)])
def test_frames_that_take_up_all_figures_leave_no_accuracy(rv_m2, poses, told):
    """Nine unknowns: three positions, however often, are nine figures."""
    campaign = cell(rv_m2, np.repeat(np.arange(poses), 4), np.random.default_rng(0).normal(size=(4 * poses, 3)) * 1e-4)
    seen = Seen.of(replace(campaign, base_known=False, tool_known=False), None, None)
    assert (seen.accuracy(np.arange(4)) is not None) == told


def test_a_prediction_is_compared_where_it_is_finite(rv_m2):
    campaign = cell(rv_m2, [0, 0, 1, 1], SHIFT, turn=np.zeros(3))
    nominal = observe(campaign).predicted_position
    nominal[[1, 2, 3]] = np.nan
    seen = Seen.of(campaign, None, (nominal, campaign.orientation))
    assert seen.after(np.array([0, 1])).axes == pytest.approx(tuple(SHIFT))
    assert seen.after(np.array([0, 1])).angles == pytest.approx((0, 0, 0), abs=1e-9)
    assert seen.after(np.array([2, 3])) is None


@pytest.mark.parametrize("wrong", [np.zeros((2, 3)), (np.zeros((2, 3)), None), (np.zeros((3, 3)), np.zeros((2, 4)))])
def test_predictions_of_other_rows_are_refused(rv_m2, wrong):
    with pytest.raises(CampaignError, match="predict"):
        Seen.of(cell(rv_m2, [0, 0, 1]), None, wrong)
