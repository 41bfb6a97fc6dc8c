"""How far: every row is counted once, in the unit and at the place that its distance has."""

from dataclasses import replace

import numpy as np
import pytest
from report.looking import labels, line, lines_of, written

from thermal_robot.report import plot_how_far


def test_how_far_counts_every_row_that_was_not_set_aside(case):
    figure = plot_how_far(case("found"))
    (axes,) = figure.axes
    assert labels(axes) == [
        "before: rms 412 µm",
        "after: rms 28 µm",
        "after, on rows held out: rms 30 µm",
        "noise floor: rms 26 µm",
    ]
    for patch in axes.patches:
        values, _, _ = patch.get_data()
        assert values.sum() == 118
    before = axes.patches[0].get_data()
    middle = before.edges[np.argmax(before.values)]
    assert 200.0 < middle < 600.0  # µm
    (floor,) = lines_of(axes)
    assert floor.get_xdata()[0] == pytest.approx(26.0)


def test_how_far_shows_orientation_in_its_own_unit(case):
    position, orientation = plot_how_far(case("confounded")).axes
    assert position.get_xlabel().endswith("(mm)")
    assert orientation.get_xlabel().endswith("(mrad)")
    assert labels(orientation) == ["before: rms 1.040 mrad", "after: rms 0.042 mrad"]


def test_rows_that_fit_perfectly_stay_counted_and_do_not_stretch_the_axis(case):
    diagnosis = case("found")
    remainder = diagnosis.rows.remainder.copy()
    remainder[5] = 1e-15
    (axes,) = plot_how_far(replace(diagnosis, rows=replace(diagnosis.rows, remainder=remainder))).axes
    assert axes.get_xlim()[0] > 0.1  # µm
    for patch in axes.patches:
        assert patch.get_data().values.sum() == 118


@pytest.mark.parametrize("kind", ["found", "nothing", "unexplained", "confounded"])
def test_all_bars_and_the_noise_floor_stand_inside_the_axis_and_below_the_key(case, kind):
    axes = plot_how_far(case(kind)).axes[0]
    low, high = axes.get_xlim()
    tallest = 0.0
    for patch in axes.patches:
        values, edges, _ = patch.get_data()
        tallest = max(tallest, values.max())
        assert low < edges[0]
        assert edges[-1] < high
        assert np.allclose(np.diff(np.log(edges)), np.log(edges[1] / edges[0]))  # equally wide as they are seen
    assert axes.get_ylim()[1] > 1.2 * tallest
    (floor,) = lines_of(axes)
    assert low < floor.get_xdata()[0] < high


def test_the_middle_of_each_outline_is_the_median_distance(case):
    diagnosis = case("found")
    (axes,) = plot_how_far(diagnosis).axes
    used = ~diagnosis.rows.outliers
    distances = [np.linalg.norm(v[used], axis=1) * 1e6 for v in (diagnosis.rows.gap, diagnosis.rows.remainder)]
    for patch, distance in zip((axes.patches[0], axes.patches[2]), distances, strict=True):
        values, edges, _ = patch.get_data()
        below = np.searchsorted(np.cumsum(values), 59)
        assert edges[below - 1] <= np.median(distance) <= edges[below + 2]


def test_the_noise_floor_is_left_out_where_it_is_not_known(case):
    diagnosis = case("found")
    (axes,) = plot_how_far(replace(diagnosis, gap=replace(diagnosis.gap, noise_floor=0.0))).axes
    assert lines_of(axes) == []
    assert len(labels(axes)) == 3


def test_rows_that_were_never_held_out_draw_no_third_outline(case):
    diagnosis = case("found")
    unknown = np.full(120, np.nan)
    (axes,) = plot_how_far(replace(diagnosis, rows=replace(diagnosis.rows, held_out_after=unknown))).axes
    assert not any("held out" in label for label in labels(axes))
    assert line(axes, "noise floor: rms 26 µm")[0, 0] == pytest.approx(26.0)


def test_no_gap_at_all_is_said(case):
    diagnosis = case("nothing")
    zero = np.zeros_like(diagnosis.rows.gap)
    rows = replace(diagnosis.rows, gap=zero, remainder=zero, held_out_after=zero[:, 0])
    (axes,) = plot_how_far(replace(diagnosis, rows=rows)).axes
    assert written(axes) == ["There is no gap to be drawn."]
