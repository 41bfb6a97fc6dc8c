"""The engine of NumPy: what has no number stays without, neighbours do not matter."""

import numpy as np
import pytest

from thermal_robot import kinematics as kin

ROWS = 5000
CALLS = (kin.tool_poses, kin.frame_jacobians, kin.placement_sensitivities, kin.gravity_torques)


@pytest.mark.parametrize("call", CALLS)
def test_what_is_no_number_shows_in_its_row_and_in_no_other(awkward, configurations, call):
    q = configurations(awkward, ROWS)
    clean = call(awkward, q).reshape(ROWS, -1)
    q[[3, 4000], 1] = np.nan
    spoilt = call(awkward, q).reshape(ROWS, -1)
    assert np.all(np.isnan(spoilt[[3, 4000]]).any(axis=1))
    others = np.setdiff1d(np.arange(ROWS), [3, 4000])
    np.testing.assert_array_equal(spoilt[others], clean[others])


@pytest.mark.parametrize("call", CALLS)
def test_rows_may_come_in_any_order(arm, configurations, call):
    q = configurations(arm, ROWS)
    order = np.random.default_rng(0).permutation(ROWS)
    np.testing.assert_allclose(call(arm, q[order]), call(arm, q)[order], rtol=0.0, atol=1e-12)


def test_frames_at_hand_are_not_computed_again(rv_m2, configurations):
    frames = kin.chain_frames(rv_m2, configurations(rv_m2, 10))
    nothing = np.full((10, rv_m2.n), np.nan)
    expected = kin.frame_jacobians(rv_m2, configurations(rv_m2, 10))
    np.testing.assert_allclose(kin.frame_jacobians(rv_m2, nothing, frames=frames), expected, rtol=0.0, atol=1e-14)
