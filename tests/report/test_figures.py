"""Figures show the numbers of the diagnosis, with units, legibly."""

import subprocess
import sys
import time
from dataclasses import replace
from io import BytesIO
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Rectangle

from thermal_robot import report
from thermal_robot.diagnosis.parts import Dependence, Where

PLOTS = ("plot_how_far", "plot_which", "plot_where", "plot_remainder", "plot_map", "overview")
LONG = tuple(f"left_arm_{part}_{k}_joint" for k, part in enumerate(("shoulder", "upper", "elbow", "wrist") * 2))[:7]


@pytest.fixture(params=PLOTS)
def plot(request):
    return getattr(report, request.param)


def lines_of(axes):
    return [line for line in axes.get_lines() if len(line.get_xdata())]


def labels(axes):
    return [t.get_text() for t in axes.get_legend().get_texts()]


def drawn(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.get_renderer()


def test_importing_the_room_loads_no_matplotlib():
    code = "import sys, thermal_robot.report as r; r.text, r.schema; print('matplotlib' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def test_drawing_does_not_load_pyplot():
    code = "import sys; from thermal_robot.report import html, overview; print('matplotlib.pyplot' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def test_the_room_lists_what_it_has():
    assert set(report.__all__) <= set(dir(report))
    assert all(callable(getattr(report, name)) for name in report.__all__)
    with pytest.raises(AttributeError, match="no attribute 'plot_nothing'"):
        report.plot_nothing  # noqa: B018


def test_every_axis_that_shows_lengths_or_shares_names_its_unit(plot, diagnosis):
    for axes in plot(diagnosis).axes:
        label = axes.get_xlabel()
        if not axes.axison or not label:
            continue
        without = ("row in the file",)
        assert label.endswith(("(µm)", "(mm)", "(mrad)", "(%)", "(m)", "(s)")) or label in without, label


def test_it_draws_for_every_kind_and_shows_itself_in_a_notebook(plot, diagnosis):
    figure = plot(diagnosis)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_no_text_leaves_the_figure_or_meets_another_label(plot, case, make_rows):
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
    renderer = drawn(figure)
    for axes in figure.axes:
        texts = [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label, *axes.get_yticklabels()]
        boxes = [t.get_window_extent(renderer) for t in texts if t.get_visible() and t.get_text() and axes.axison]
        for box in boxes:
            assert box.x0 > -1.0
            assert box.x1 < figure.bbox.x1 + 1.0
        ticks = [t.get_window_extent(renderer) for t in axes.get_yticklabels() if t.get_text()]
        ticks.sort(key=lambda box: box.y0)
        assert all(below.y1 <= above.y0 + 1.0 for below, above in pairwise(ticks))


def test_how_far_counts_every_row_that_was_not_set_aside(case):
    figure = report.plot_how_far(case("found"))
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
    position, orientation = report.plot_how_far(case("confounded")).axes
    assert position.get_xlabel().endswith("(mm)")
    assert orientation.get_xlabel().endswith("(mrad)")
    assert labels(orientation) == ["before: rms 1.040 mrad", "after: rms 0.042 mrad"]


def test_which_draws_share_interval_and_probability(case):
    (axes,) = report.plot_which(case("found")).axes
    names = [t.get_text() for t in axes.get_yticklabels()]
    assert names == [f.name for f in case("found").effects]
    bars = [p for p in axes.patches if isinstance(p, Rectangle)]
    assert [b.get_width() for b in bars] == pytest.approx([96.2, 0.12, -0.03, -3.1])
    assert list(lines_of(axes)[0].get_xdata()) == pytest.approx([94.1, 97.4])
    written = [t.get_text() for t in axes.texts]
    assert "> 99.9 %" in written
    assert "not testable: needs approach.<joint>" in written


def test_which_puts_the_found_before_the_rest(case):
    diagnosis = replace(case("found"), effects=case("found").effects[::-1])
    (axes,) = report.plot_which(diagnosis).axes
    assert axes.get_yticklabels()[0].get_text() == "thermal_elongation"
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first stands above


def test_where_follows_the_chain_from_root_to_tool(case):
    chain, other = report.plot_where(case("confounded")).axes
    names = [t.get_text() for t in chain.get_yticklabels()]
    assert names == [*case("confounded").joint_names, *case("confounded").where.links]
    assert list(chain.get_yticks()) == sorted(chain.get_yticks())
    assert chain.get_ylim()[0] > chain.get_ylim()[1]
    assert "24.0 %" in [t.get_text() for t in chain.texts]
    assert [t.get_text() for t in other.get_yticklabels()] == ["x", "y", "z", "temperature", "time"]


def test_where_says_that_nothing_is_placed(case):
    chain, other = report.plot_where(case("nothing")).axes
    assert "No effect was found" in chain.texts[0].get_text()
    assert [t.get_text() for t in other.get_yticklabels()] == ["x", "y", "z"]


def test_remainder_is_drawn_against_what_it_follows(case):
    figure = report.plot_remainder(case("unexplained"))
    assert len(figure.axes) == 6
    assert {axes.get_xlabel() for axes in figure.axes} == {"", "row in the file", "time (s)"}
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == ["x (µm)", "y (µm)", "z (µm)"]
    points, median, crosses, _ = lines_of(figure.axes[2])
    assert len(points.get_xdata()) == 118
    assert list(crosses.get_xdata()) == [17, 80]
    assert np.all(np.abs(crosses.get_ydata()) < figure.axes[2].get_ylim()[1])
    steps = median.get_ydata()
    assert steps[0] == pytest.approx(40.0, abs=15.0)
    assert steps[-1] == pytest.approx(-90.0, abs=15.0)


@pytest.mark.parametrize("name", ["elbow_joint", "order"])
def test_remainder_finds_joints_and_the_order_of_rows(case, name):
    left = replace(case("unexplained").unexplained, depends_on=(Dependence(name, 1e-4),))
    figure = report.plot_remainder(replace(case("unexplained"), unexplained=left))
    assert len(figure.axes) == 6


def test_remainder_does_without_a_quantity_that_is_not_recorded(case):
    left = replace(case("unexplained").unexplained, depends_on=(Dependence("session", 1e-4),))
    assert len(report.plot_remainder(replace(case("unexplained"), unexplained=left)).axes) == 3


def test_remainder_leaves_out_rows_without_the_quantity(case):
    diagnosis = case("unexplained")
    time_ = np.where(np.arange(120) % 3 == 0, np.nan, diagnosis.rows.covariates["time"])
    diagnosis = replace(diagnosis, rows=replace(diagnosis.rows, covariates={"time": time_}))
    points = lines_of(report.plot_remainder(diagnosis).axes[1])[0]
    assert len(points.get_xdata()) == int((np.isfinite(time_) & ~diagnosis.rows.outliers).sum())


def test_map_states_its_exaggeration_and_keeps_directions(case):
    diagnosis = case("found")
    figure = report.plot_map(diagnosis)
    above, side = figure.axes
    assert above.get_xlabel() == "x of the root frame (m)"
    assert side.get_ylabel() == "z of the root frame (m)"
    assert above.get_aspect() == 1.0
    assert "gap of 200 µm, drawn 500 times larger" in [t.get_text() for t in above.texts]
    before, after = above.collections
    used = ~diagnosis.rows.outliers
    assert np.allclose(before.U, 500.0 * diagnosis.rows.gap[used, 0])
    assert np.allclose(after.V, 500.0 * diagnosis.rows.remainder[used, 1])


def test_overview_holds_four_panels_and_the_verdict(case):
    figure = report.overview(case("found"))
    assert [axes._left_title.get_text() for axes in figure.axes] == [
        "How far",
        "Which",
        "Where",
        "The gap, seen from the side",
    ]
    assert " ".join(figure.get_suptitle().split()) == case("found").summary
    assert report.overview(case("found"), headline=False).get_suptitle() == ""


def test_a_long_campaign_is_thinned_and_drawn_fast(plot, case, make_rows):
    diagnosis = replace(case("unexplained"), samples=12000, rows=make_rows(12000))
    began = time.perf_counter()
    figure = plot(diagnosis)
    stream = BytesIO()
    figure.savefig(stream, format="svg")
    assert time.perf_counter() - began < 10.0
    assert len(stream.getvalue()) < 1_500_000


@pytest.mark.parametrize("aside", [(2, 3, 4), (2, 3), ()])
def test_hardly_any_row_is_no_failure(plot, case, make_rows, aside):
    drawn(plot(replace(case("unexplained"), rows=make_rows(3, aside=aside), outliers=aside)))


def test_no_gap_at_all_is_no_failure(plot, case):
    diagnosis = case("nothing")
    zero = np.zeros_like(diagnosis.rows.gap)
    rows = replace(diagnosis.rows, gap=zero, remainder=zero, held_out_after=zero[:, 0], position=zero)
    drawn(plot(replace(diagnosis, rows=rows, gap=replace(diagnosis.gap, rms_before=0.0, noise_floor=0.0))))
