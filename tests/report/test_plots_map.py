"""The map: arrows at the tool's positions, undistorted, longer than in truth by a stated factor."""

from dataclasses import replace

import numpy as np
import pytest
from report.looking import written

from thermal_robot.report import plot_map


def test_map_states_its_exaggeration_and_keeps_directions(case):
    diagnosis = case("found")
    figure = plot_map(diagnosis)
    above, side = figure.axes
    assert above.get_xlabel() == "x of the root frame (m)"
    assert side.get_ylabel() == "z of the root frame (m)"
    assert above.get_aspect() == 1.0
    assert "gap of 200 µm, drawn 500 times larger" in [t.get_text() for t in above.texts]
    before, after = above.collections
    used = ~diagnosis.rows.outliers
    assert np.allclose(before.U, 500.0 * diagnosis.rows.gap[used, 0])
    assert np.allclose(after.V, 500.0 * diagnosis.rows.remainder[used, 1])


def test_arrows_start_where_the_tool_was(case):
    diagnosis = case("found")
    used = ~diagnosis.rows.outliers
    for axes, plane in zip(plot_map(diagnosis).axes, ((0, 1), (1, 2)), strict=True):
        for arrows in axes.collections:
            np.testing.assert_allclose(arrows.XY, diagnosis.rows.position[used][:, plane])


@pytest.mark.parametrize("kind", ["found", "nothing", "unexplained", "confounded"])
def test_every_arrow_is_seen_whole_below_the_key(case, kind):
    for axes in plot_map(case(kind)).axes:
        low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
        for arrows in axes.collections:
            ends = arrows.XY + np.column_stack([arrows.U, arrows.V])
            assert np.all((ends > low) & (ends < high))
            assert np.all(ends[:, 1] < low[1] + 0.85 * (high - low)[1])


def test_the_key_is_as_long_as_an_arrow_of_the_gap_it_names(case):
    diagnosis = case("found")
    axes = plot_map(diagnosis).axes[0]
    factor = axes.collections[0].U / diagnosis.rows.gap[~diagnosis.rows.outliers, 0]
    (arrow,) = (t for t in axes.texts if t.get_text() == "")
    (said,) = (t for t in written(axes) if t)
    assert said.startswith("gap of 200 µm")
    assert arrow.xy[0] - axes.get_xlim()[0] == pytest.approx(200e-6 * factor[0])


def test_a_long_campaign_is_thinned_to_the_same_rows_before_and_after(case, make_rows):
    diagnosis = replace(case("found"), rows=make_rows(3000))
    before, after = plot_map(diagnosis).axes[0].collections
    assert len(before.U) == 250
    assert np.array_equal(before.XY, after.XY)


def test_the_side_is_that_from_which_the_robot_is_broader(case):
    diagnosis = case("found")
    position = diagnosis.rows.position * np.array([3.0, 0.3, 1.0])
    _, side = plot_map(replace(diagnosis, rows=replace(diagnosis.rows, position=position))).axes
    assert side.get_xlabel() == "x of the root frame (m)"
    assert side.get_ylabel() == "z of the root frame (m)"


def test_one_place_alone_cannot_be_mapped(case):
    diagnosis = case("found")
    position = np.ones_like(diagnosis.rows.position)
    for axes in plot_map(replace(diagnosis, rows=replace(diagnosis.rows, position=position))).axes:
        assert written(axes) == ["No two places with a gap are left to be mapped."]
        assert not axes.axison
