"""What every figure keeps to: units on its axes, texts apart and inside, few points of many rows, none of few."""

from dataclasses import replace

import numpy as np
import pytest
from report.looking import outside, overlapping, texts

from thermal_robot import report
from thermal_robot.diagnosis.values import Dependence, Where

PLOTS = ("plot_how_far", "plot_which", "plot_where", "plot_remainder", "plot_map", "overview")
ROWS = ("overview", "plot_remainder")  # the overview holds all other panels that show rows
LONG = tuple(f"left_arm_{part}_{k}_joint" for k, part in enumerate(("shoulder", "upper", "elbow", "wrist") * 2))[:7]


@pytest.fixture(params=PLOTS)
def plot(request):
    return getattr(report, request.param)


@pytest.fixture(params=ROWS)
def plot_of_rows(request):
    return getattr(report, request.param)


def test_every_axis_that_shows_lengths_or_shares_names_its_unit(plot, diagnosis):
    for axes in plot(diagnosis).axes:
        label = axes.get_xlabel()
        if not axes.axison or not label:
            continue
        without = ("row in the file",)
        assert label.endswith(("(µm)", "(mm)", "(mrad)", "(%)", "(m)", "(s)")) or label in without, label


def test_it_shows_itself_in_a_notebook(plot_of_rows, case):
    assert plot_of_rows(case("confounded"))._repr_png_().startswith(b"\x89PNG")


def test_no_text_leaves_the_figure_or_meets_another(plot, case):
    figure = plot(case("unexplained"))
    said = texts(figure)
    assert len(said) > 10
    assert outside(figure, said) == []
    assert overlapping(said) == []


def test_long_names_leave_no_figure_and_meet_no_other(plot, case, make_rows):
    shares = dict.fromkeys(LONG, 0.1)
    links = {name.replace("joint", "link"): 0.05 for name in LONG}
    diagnosis = replace(
        case("unexplained"),
        joint_names=LONG,
        rows=make_rows(joints=LONG),
        where=Where({"x": 0.3, "y": 0.3, "z": 0.4}, shares, links, {f"approach.{n}": 0.1 for n in LONG}),
        unexplained=replace(case("unexplained").unexplained, depends_on=(Dependence(LONG[2], 1e-5),)),
    )
    figure = plot(diagnosis)
    said = texts(figure)
    assert outside(figure, said) == []
    assert overlapping(said) == []


def test_of_a_long_campaign_some_thousand_points_are_drawn(plot_of_rows, case, make_rows):
    diagnosis = replace(case("unexplained"), samples=12000, rows=make_rows(12000))
    for axes in plot_of_rows(diagnosis).axes:
        for line in axes.get_lines():
            assert len(line.get_xdata()) <= 6000
            assert line.get_rasterized() or len(line.get_xdata()) <= 2000
        assert all(len(arrows.U) <= 250 for arrows in axes.collections if hasattr(arrows, "U"))


@pytest.mark.parametrize("aside", [(2, 3, 4), (2, 3), ()])
def test_hardly_any_row_is_no_failure(plot_of_rows, case, make_rows, aside):
    plot_of_rows(replace(case("unexplained"), rows=make_rows(3, aside=aside), outliers=aside)).draw_without_rendering()


def test_no_gap_at_all_is_no_failure(plot_of_rows, case):
    diagnosis = case("nothing")
    zero = np.zeros_like(diagnosis.rows.gap)
    rows = replace(diagnosis.rows, gap=zero, remainder=zero, held_out_after=zero[:, 0], position=zero)
    gap = replace(diagnosis.gap, rms_before=0.0, noise_floor=0.0)
    plot_of_rows(replace(diagnosis, rows=rows, gap=gap)).draw_without_rendering()
