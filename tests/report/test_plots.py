"""Figures: what is drawn is as large as it is, in its unit, at its place; texts stay apart and inside."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.patches import Rectangle
from report.cases import case, rows
from report.fleets import SUMMARY
from report.looking import bars, labels, line, lines_of, outside, overlapping, texts, tick_labels, written
from simulate import simulate
from wear_cases import by_hand

from thermal_robot import diagnose, report
from thermal_robot.diagnosis.values import Dependence, Explained, Place, Where
from thermal_robot.report import (
    explain_figure,
    overview,
    plot_how_far,
    plot_map,
    plot_remainder,
    plot_wear,
    plot_where,
    plot_which,
    plots,
)
from thermal_robot.report.drawing import AFTER, BEFORE, MUTED, THIRD, Drawing, log_axis, note, plain, title

PLOTS = ("plot_how_far", "plot_which", "plot_where", "plot_remainder", "plot_map", "overview")
LONG = tuple(f"left_arm_{part}_{k}_joint" for k, part in enumerate(("shoulder", "upper", "elbow", "wrist") * 2))[:7]
KINDS = ("found", "nothing", "unexplained", "confounded")
FLAT = np.zeros((120, 3))
NO_GAP = {"gap": FLAT, "remainder": FLAT, "held_out_after": FLAT[:, 0]}


@pytest.fixture(params=PLOTS)
def plot(request):
    return getattr(report, request.param)


@pytest.fixture(params=("overview", "plot_remainder"))  # the overview holds all other panels that show rows
def plot_of_rows(request):
    return getattr(report, request.param)


def follows(name, **parts):
    """A remainder that follows a quantity."""
    return case("unexplained", unexplained={"depends_on": (Dependence(name, 1e-6),)}, **parts)


def in_order(figure):
    said = texts(figure)
    assert outside(figure, said) == []
    assert overlapping(said) == []
    return said


def test_every_axis_that_shows_lengths_or_shares_names_its_unit(plot, diagnosis):
    for axes in plot(diagnosis).axes:
        label = axes.get_xlabel()
        if axes.axison and label:
            assert label.endswith(("(µm)", "(mm)", "(mrad)", "(%)", "(m)", "(s)")) or label == "row in the file", label


def test_no_text_leaves_a_figure_or_meets_another_whatever_the_names(plot):
    assert len(in_order(plot(case("unexplained")))) > 10
    links = {name.replace("joint", "link"): 0.05 for name in LONG}
    quantities = {f"approach.{n}": 0.1 for n in LONG}
    where = Where({"x": 0.3, "y": 0.3, "z": 0.4}, dict.fromkeys(LONG, 0.1), links, quantities)
    in_order(plot(follows(LONG[2], joint_names=LONG, rows=rows(joints=LONG), where=where)))


@pytest.mark.parametrize("dated", [True, False])
def test_no_text_leaves_the_figures_of_fleet_and_wear(dated):
    in_order(plot_wear(by_hand(dated)))
    effects = [{"effect": f"effect_{k}", "found": 28 - 2 * k, "testable": 28, "places": {}} for k in range(14)]
    assert len(in_order(plots.plot_fleet({**SUMMARY, "effects": effects}))) > 10


def test_of_a_long_campaign_some_thousand_points_are_drawn(plot_of_rows):
    for axes in plot_of_rows(case("unexplained", samples=12000, rows=rows(12000))).axes:
        for drawn in axes.get_lines():
            assert len(drawn.get_xdata()) <= 6000
            assert drawn.get_rasterized() or len(drawn.get_xdata()) <= 2000
        assert all(len(arrows.U) <= 250 for arrows in axes.collections if hasattr(arrows, "U"))


@pytest.mark.slow
def test_hardly_any_row_and_no_gap_at_all_are_no_failure(plot_of_rows):
    for aside in ((2, 3, 4), (2, 3), ()):
        plot_of_rows(case("unexplained", rows=rows(3, aside=aside), outliers=aside)).draw_without_rendering()
    nothing = case("nothing", rows={**NO_GAP, "position": FLAT}, gap={"rms_before": 0.0, "noise_floor": 0.0})
    plot_of_rows(nothing).draw_without_rendering()
    assert plot_of_rows(case("confounded"))._repr_png_().startswith(b"\x89PNG")


def test_how_far_counts_every_row_that_was_not_set_aside_where_its_distance_is():
    diagnosis = case("found")
    (axes,) = plot_how_far(diagnosis).axes
    rms = ("before: rms 412 µm", "after: rms 28 µm", "after, on rows held out: rms 30 µm", "noise floor: rms 26 µm")
    assert labels(axes) == list(rms)
    assert all(patch.get_data().values.sum() == 118 for patch in axes.patches)
    assert lines_of(axes)[0].get_xdata()[0] == pytest.approx(26.0)
    used = ~diagnosis.rows.outliers
    for patch, gap in zip(
        (axes.patches[0], axes.patches[2]), (diagnosis.rows.gap, diagnosis.rows.remainder), strict=True
    ):
        values, edges, _ = patch.get_data()
        below = np.searchsorted(np.cumsum(values), 59)
        assert edges[below - 1] <= 1e6 * np.median(np.linalg.norm(gap[used], axis=1)) <= edges[below + 2]
    position, orientation = plot_how_far(case("confounded")).axes
    assert position.get_xlabel().endswith("(mm)")
    assert orientation.get_xlabel().endswith("(mrad)")
    assert labels(orientation) == ["before: rms 1.040 mrad", "after: rms 0.042 mrad"]


def test_how_far_leaves_out_what_is_not_known_and_is_not_stretched_by_a_perfect_row():
    remainder = case("found").rows.remainder.copy()
    remainder[5] = 1e-15
    (axes,) = plot_how_far(case("found", rows={"remainder": remainder})).axes
    assert axes.get_xlim()[0] > 0.1  # µm
    assert all(patch.get_data().values.sum() == 118 for patch in axes.patches)
    (axes,) = plot_how_far(case("found", gap={"noise_floor": 0.0})).axes
    assert lines_of(axes) == []
    assert len(labels(axes)) == 3
    (axes,) = plot_how_far(case("found", rows={"held_out_after": np.full(120, np.nan)})).axes
    assert not any("held out" in label for label in labels(axes))
    assert line(axes, "noise floor: rms 26 µm")[0, 0] == pytest.approx(26.0)
    (axes,) = plot_how_far(case("nothing", rows=NO_GAP)).axes
    assert written(axes) == ["There is no gap to be drawn."]


@pytest.mark.parametrize("kind", KINDS)
def test_all_bars_and_the_noise_floor_stand_inside_the_axis_and_below_the_key(kind):
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


def test_which_draws_share_interval_and_probability_the_found_above_the_rest():
    (axes,) = plot_which(case("found")).axes
    assert tick_labels(axes) == [f.name for f in case("found").effects]
    widths = [p.get_width() for p in axes.patches if isinstance(p, Rectangle)]
    assert widths == pytest.approx([96.2, 0.12, -0.03, -3.1])
    assert list(lines_of(axes)[0].get_xdata()) == pytest.approx([94.1, 97.4])
    assert written(axes).count("not testable") == 2
    (turned,) = plot_which(case("found", effects=case("found").effects[::-1])).axes
    assert tick_labels(turned)[0] == "thermal_elongation"
    assert turned.get_ylim()[0] > turned.get_ylim()[1]  # the first stands above
    (axes,) = plot_which(case("confounded")).axes
    names = tick_labels(axes)
    said = [t for t in axes.texts if t.get_text().endswith(" %")]
    assert all(t.get_position()[0] > 1.0 for t in said)  # of the panel's width
    assert {names[round(t.get_position()[1])]: t.get_text() for t in said} == {
        "geometric": "> 99.9 %",
        "joint_offset": "97.0 %",
        "base_frame": "97.0 %",
        "drift": "< 0.1 %",
    }
    filled, hatched = (bar for _, bar in zip(("geometric", "joint_offset"), axes.patches, strict=False))
    assert (filled.get_hatch(), filled.get_facecolor()[3]) == (None, 1.0)
    assert hatched.get_hatch()
    assert hatched.get_facecolor()[3] == 0.0


def test_which_is_not_squeezed_by_a_wild_interval_and_says_that_nothing_was_tried():
    found, wild, *rest = case("found").effects
    wild = replace(wild, shrinkage=-3.0, shrinkage_ci95=(-9.0, 4.0))
    low, high = plot_which(case("found", effects=(found, wild, *rest))).axes[0].get_xlim()
    assert -30.0 < low < 0.0
    assert 100.0 < high < 160.0
    assert written(plot_which(case("found", effects=())).axes[0]) == ["No effect was tried."]


def test_where_follows_the_chain_with_bars_as_long_as_the_shares():
    diagnosis = case("confounded")
    chain, other = plot_where(diagnosis).axes
    where = diagnosis.where
    assert tick_labels(chain) == [*diagnosis.joint_names, *where.links]
    assert list(chain.get_yticks()) == sorted(chain.get_yticks())
    assert chain.get_ylim()[0] > chain.get_ylim()[1]
    assert tick_labels(other) == ["x", "y", "z", "temperature", "time"]
    for axes, colour, shares in (
        (chain, AFTER, where.joints),
        (chain, THIRD, where.links),
        (other, MUTED, where.axes),
        (other, AFTER, where.covariates),
    ):
        assert bars(axes, colour) == pytest.approx([100.0 * share for share in shares.values()])
    at = dict(zip(chain.get_yticks(), tick_labels(chain), strict=True))
    said = {at[t.get_position()[1]]: t for t in chain.texts if t.get_text().endswith("%")}
    told = {name: text.get_text() for name, text in said.items()}
    assert (told["upper_arm_link"], told["forearm_link"], told["shoulder_pan_joint"]) == ("61.0 %", "33.0 %", "24.0 %")
    assert said["upper_arm_link"].get_position()[0] > 61.0
    assert "wrist_2_joint" not in said  # nothing is written of nothing


def test_where_ends_beyond_its_longest_bar_and_keeps_joints_without_a_share():
    names = case("confounded").joint_names
    for largest in (1e-4, 0.05, 0.5, 1.0):
        where = Where({"x": 1.0, "y": 0.0, "z": 0.0}, {"elbow_joint": largest}, {}, {})
        chain, _ = plot_where(case("confounded", where=where)).axes
        assert chain.get_xlim()[0] == 0.0
        assert 100.0 * largest < chain.get_xlim()[1] <= max(10.0, 118.0 * largest)
        assert tick_labels(chain) == list(names)
        assert bars(chain, AFTER) == pytest.approx([0.0, 0.0, 100.0 * largest, 0.0, 0.0, 0.0])
    chain, other = plot_where(case("nothing")).axes
    assert "No effect was found" in written(chain)[0]
    assert tick_labels(other) == ["x", "y", "z"]


def test_where_draws_what_lies_beyond_the_chain_and_the_eight_largest_quantities():
    beyond, axes = {"base": 0.18, "instrument": 0.02}, case("found").where.axes
    chain, _ = plot_where(case("found", where={"beyond": beyond})).axes
    assert tick_labels(chain)[-2:] == ["base", "instrument"]
    assert bars(chain, BEFORE) == pytest.approx([18.0, 2.0])
    alone, _ = plot_where(case("found", where=Where(axes, {}, {}, {}, beyond))).axes
    assert tick_labels(alone) == ["base", "instrument"]
    many = {f"quantity_{k}": 0.01 * k for k in range(12)}
    _, other = plot_where(case("found", where={"covariates": many})).axes
    assert tick_labels(other)[3:] == [f"quantity_{k}" for k in range(11, 3, -1)]
    long = {f"approach.left_arm_shoulder_{k}_joint": 0.1 for k in range(3)}
    for figure, above in (
        (plot_where(case("found")), False),
        (plot_where(case("found", where={"covariates": long})), True),
    ):
        figure.draw_without_rendering()
        first, second = (axes.get_position() for axes in figure.axes)
        assert bool(first.y0 > second.y1) is above
        assert bool(first.x1 < second.x0) is not above


def test_the_map_draws_gaps_where_the_tool_was_so_many_times_larger_as_it_says():
    diagnosis = case("found")
    above, side = plot_map(diagnosis).axes
    assert above.get_xlabel() == "x of the root frame (m)"
    assert side.get_ylabel() == "z of the root frame (m)"
    assert above.get_aspect() == 1.0
    assert "gap of 200 µm, drawn 500 times larger" in written(above)
    used = ~diagnosis.rows.outliers
    for axes, plane in ((above, (0, 1)), (side, (1, 2))):
        for arrows, gap in zip(axes.collections, (diagnosis.rows.gap, diagnosis.rows.remainder), strict=True):
            np.testing.assert_allclose(arrows.XY, diagnosis.rows.position[used][:, plane])
            np.testing.assert_allclose(np.column_stack([arrows.U, arrows.V]), 500.0 * gap[used][:, plane])
    (arrow,) = (t for t in above.texts if t.get_text() == "")
    assert arrow.xy[0] - above.get_xlim()[0] == pytest.approx(200e-6 * 500.0)
    before, after = plot_map(case("found", rows=rows(3000))).axes[0].collections
    assert len(before.U) == 250
    assert np.array_equal(before.XY, after.XY)


@pytest.mark.parametrize("kind", KINDS)
def test_every_arrow_is_seen_whole_below_the_key(kind):
    for axes in plot_map(case(kind)).axes:
        low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
        for arrows in axes.collections:
            ends = arrows.XY + np.column_stack([arrows.U, arrows.V])
            assert np.all((ends > low) & (ends < high))
            assert np.all(ends[:, 1] < low[1] + 0.85 * (high - low)[1])


def test_the_map_is_seen_from_where_the_robot_is_broader():
    position = case("found").rows.position
    _, side = plot_map(case("found", rows={"position": position * np.array([3.0, 0.3, 1.0])})).axes
    assert (side.get_xlabel(), side.get_ylabel()) == ("x of the root frame (m)", "z of the root frame (m)")
    for stretch, view, up in (((1.0, 1.0, 0.05), "the side", "z"), ((1.0, 0.6, 3.0), "above", "y")):
        map_ = overview(case("found", rows={"position": position * np.array(stretch)})).axes[3]
        assert map_._left_title.get_text() == f"The gap, seen from {view}"
        assert map_.get_ylabel().startswith(up)
    for axes in plot_map(case("found", rows={"position": np.ones_like(position)})).axes:
        assert written(axes) == ["No two places with a gap are left to be mapped."]
        assert not axes.axison


def test_the_overview_holds_four_panels_that_say_what_their_own_figures_say():
    figure, base = overview(case("found")), case("found")
    panels = [axes._left_title.get_text() for axes in figure.axes]
    assert panels == ["How far", "Which", "Where", "The gap, seen from the side"]
    assert " ".join(figure.get_suptitle().split()) == base.summary
    assert overview(base, headline=False).get_suptitle() == ""
    many = case("found", effects=tuple(replace(base.effects[1], name=f"effect_{k}") for k in range(30)))
    assert overview(many).get_figheight() > figure.get_figheight()
    diagnosis = case("confounded")
    how_far, which, where, map_ = overview(diagnosis).axes
    assert labels(how_far) == labels(plot_how_far(diagnosis).axes[0])
    assert tick_labels(which) == tick_labels(plot_which(diagnosis).axes[0])
    assert tick_labels(where) == tick_labels(plot_where(diagnosis).axes[0])
    assert len(map_.collections) == 2
    assert written(which).count("not testable") == 2


def test_the_remainder_of_the_rows_that_count_is_drawn_against_row_and_quantity():
    diagnosis = case("unexplained")
    figure, used = plot_remainder(diagnosis), ~case("unexplained").rows.outliers
    assert {axes.get_xlabel() for axes in figure.axes} == {"", "row in the file", "time (s)"}
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == ["x (µm)", "y (µm)", "z (µm)"]
    for k, axes in enumerate(figure.axes[::2]):
        where, values = line(axes, "remainder")
        assert np.array_equal(where, diagnosis.rows.rows[used])
        assert np.allclose(values, 1e6 * diagnosis.rows.remainder[used, k])
        low, high = axes.get_ylim()
        assert low == -high
        assert np.all(np.abs(values) < high)
    _, median, crosses, _ = lines_of(figure.axes[2])
    assert list(crosses.get_xdata()) == [17, 80]
    steps = median.get_ydata()
    assert (steps[0], steps[-1]) == (pytest.approx(40.0, abs=15.0), pytest.approx(-90.0, abs=15.0))  # noise: 26 µm
    known = np.where(np.arange(120) % 3 == 0, np.nan, diagnosis.rows.covariates["time"])
    points = line(plot_remainder(case("unexplained", rows={"covariates": {"time": known}})).axes[1], "remainder")
    assert points.shape[1] == int((np.isfinite(known) & used).sum())
    assert len(plot_remainder(follows("session")).axes) == 3  # not recorded
    where, _ = line(plot_remainder(follows("elbow_joint")).axes[1], "remainder")
    assert np.array_equal(where, diagnosis.rows.q[used, 2])
    assert plot_remainder(follows("order")).axes[5].get_xlabel() == "order of the rows"


def test_the_band_holds_so_much_of_noise_as_two_sigma_must():
    for axes in plot_remainder(case("nothing", rows=rows(2000, before=1e-9, after=2.6e-5))).axes:
        low, high = axes.patches[0].get_y(), axes.patches[0].get_y() + axes.patches[0].get_height()
        assert high == -low
        assert np.mean(np.abs(line(axes, "remainder")[1]) < high) == pytest.approx(0.9545, abs=0.015)


def test_crosses_stay_whole_at_the_edge_and_true_inside():
    remainder = case("found").rows.remainder.copy()
    remainder[int(np.flatnonzero(case("found").rows.outliers)[0])] = (1e-5, -1.0, 1.0)
    x, y, z = plot_remainder(case("found", rows={"remainder": remainder})).axes
    assert line(x, "set aside")[1, 0] == pytest.approx(10.0)
    for axes, side in ((y, -1.0), (z, 1.0)):
        assert 0.8 < side * line(axes, "set aside")[1, 0] / axes.get_ylim()[1] < 0.92


def test_the_median_of_few_levels_stands_at_each_and_no_line_joins_them():
    payload = np.repeat([0.0, 2.5, 5.0], 40)
    remainder = np.repeat([1e-5, -2e-5, 3e-5], 40)[:, None] * np.ones(3)
    parts = {"remainder": remainder, "covariates": {"payload": payload}}
    axes = plot_remainder(follows("payload", rows=parts)).axes[1]
    np.testing.assert_allclose(line(axes, "median at each value"), [[0.0, 2.5, 5.0], [10.0, -20.0, 30.0]])
    assert [drawn.get_linestyle() for drawn in axes.lines if drawn.get_label() == "median at each value"] == ["None"]


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("temperature.hand", "temperature.hand (°C)"),
        ("approach.slide", "approach.slide (−1, 0, 1)"),
        ("speed", "speed (share of the maximum)"),
        ("order", "order (number)"),
        ("humidity", "humidity"),
        ("slide", "slide (m)"),
    ],
)
def test_an_axis_bears_the_unit_of_what_was_recorded(name, label):
    joints = {"slide": "m", "hand": "rad"}
    recorded = {} if name in joints else {name: np.linspace(0.0, 1.0, 120)}
    units = {"temperature.hand": "°C", **joints}
    known = {"q": case("found").rows.q[:, :2], "covariates": recorded, "units": units}
    assert plot_remainder(follows(name, joint_names=tuple(joints), rows=known)).axes[5].get_xlabel() == label


@pytest.mark.slow
def test_a_diagnosis_knows_the_unit_of_a_joint_that_slides(awkward):
    found = diagnose(simulate(awkward, ["drift"], seed=3, moving=True)[0], only=["drift"])
    for joint, kind in zip(awkward.joint_names, awkward.joint_types, strict=True):
        length = "m" if kind == "prismatic" else "rad"
        left = replace(found.unexplained, depends_on=(Dependence(f"velocity.{joint}", 1e-6),))
        assert plot_remainder(replace(found, unexplained=left)).axes[5].get_xlabel() == f"velocity.{joint} ({length}/s)"
        assert found.rows.units[joint] == length
    assert {*found.rows.covariates, *found.joint_names} == set(found.rows.units)


SLOPE = 8e-6  # m/K


def place(count=80, seed=1, **other):
    """A link that grows by 8 µm a kelvin, seen with 5 µm of noise."""
    rng = np.random.default_rng(seed)
    warm = rng.uniform(20.0, 30.0, count)
    noise = 5e-6 * rng.standard_normal(count)
    known = {
        "kind": "link", "name": "column", "share": 0.28, "quantity": "temperature", "quantity_unit": "°C",
        "values": warm, "levels": False, "unit": "m", "before": SLOPE * (warm - 20.0) + noise, "after": noise,
        "spread": np.full(count, 5e-6), "line": np.array([[20.0, 30.0], [0.0, SLOPE * 10.0]]),
    }  # fmt: skip
    return Place(**{**known, **other})


def sides(**other):
    """A joint with 0.4 mrad of lost motion."""
    approach = np.where(np.arange(60) % 2, 1.0, -1.0)
    noise = 2e-5 * np.random.default_rng(2).standard_normal(60)
    known = {
        "kind": "joint", "name": "joint_3", "share": 0.6, "quantity": "approach.joint_3", "quantity_unit": "",
        "values": approach, "levels": True, "unit": "rad", "before": -2e-4 * approach + noise, "after": noise,
        "spread": np.full(60, 2e-5), "line": np.array([[-1.0, 1.0], [2e-4, -2e-4]]),
    }  # fmt: skip
    return Place(**{**known, **other})


def explained(*places, effect="backlash", left_out=0):
    return explain_figure(Explained(effect, places, left_out))


def test_points_and_law_of_an_effect_are_drawn_as_they_are():
    one = place()
    (axes,) = explained(one).axes
    for label, error in (("as measured", one.before), ("with this effect taken off", one.after)):
        np.testing.assert_allclose(line(axes, label), [one.values, 1e6 * error])
    np.testing.assert_allclose(line(axes, "fitted law"), [[20.0, 30.0], [0.0, 80.0]])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("temperature (°C)", "error (µm)")
    assert axes._left_title.get_text() == "link column: 28 %"
    law = axes.get_lines()[-1]  # over the points
    assert (law.get_label(), law.get_color()) == ("fitted law", BEFORE)
    assert explained(place(unit="m at the tool")).axes[0].get_ylabel() == "error (µm at the tool)"
    assert explained(place(centred=True)).axes[0].get_ylabel() == "error less its mean (µm)"


def test_few_values_stand_apart_with_before_and_after_beside_each_other():
    one = sides()
    (axes,) = explained(one).axes
    before, after = line(axes, "as measured"), line(axes, "with this effect taken off")
    assert list(axes.get_xticks()) == [-1.0, 1.0]
    for level in (-1.0, 1.0):
        mine = one.values == level
        assert np.all(before[0, mine] < level)
        assert np.all(after[0, mine] > level)
        assert np.all(np.abs(before[0, mine] - level) < 0.5)
        np.testing.assert_allclose(before[1, mine], 1e3 * one.before[mine])
    law = line(axes, "fitted law")
    pieces = law[:, ~np.isnan(law[0])]
    assert np.isnan(law[0]).sum() == 2  # no stroke from one side to the other
    assert np.all(np.sign(pieces[0]) == -np.sign(pieces[1]))
    np.testing.assert_allclose(np.abs(pieces[1]), 0.2)
    explained(sides(values=np.ones(60), line=np.array([[1.0], [2e-4]]))).draw_without_rendering()


def test_rows_that_say_little_are_left_out_and_of_many_some_are_drawn():
    wild = place(spread=np.where(np.arange(80) < 10, 1e-3, 5e-6))
    wild.before[:10] = 1.0
    (axes,) = explained(wild).axes
    assert line(axes, "as measured").shape[1] == 70
    assert axes.get_ylim()[1] < 200.0  # µm
    (axes,) = explained(place(9000)).axes
    assert line(axes, "as measured").shape[1] == 1500
    assert axes.get_lines()[0].get_rasterized()


def test_panels_of_one_unit_share_their_axis_and_those_of_another_do_not():
    large = place(share=0.3, line=np.array([[20.0, 30.0], [0.0, 2e-3]]))
    first, second, third = explained(large, place(seed=5), sides()).axes
    assert first.get_ylim() == second.get_ylim()
    assert first.get_ylim()[1] > 2.0  # the law is seen to its end, mm
    assert [axes.get_ylabel() for axes in (first, second, third)] == ["error (mm)", "error (mm)", "error (mrad)"]
    assert third.get_ylim() != first.get_ylim()


def test_an_effect_says_where_it_acts_and_how_many_places_are_not_shown():
    figure = explained(sides(share=0.604), sides(name="elbow", share=0.3), left_out=2)
    assert [axes._left_title.get_text() for axes in figure.axes] == ["joint_3: 60 %", "joint elbow: 30 %"]
    assert figure.get_suptitle() == "What backlash explains; 2 smaller places are not shown"
    figure = explained(sides(name="$a_1$ joint", quantity="$x$"), effect="$y$")
    assert figure.axes[0]._left_title.get_text() == r"\$a_1\$ joint: 60 %"
    assert figure.axes[0].get_xlabel() == r"\$x\$"
    nowhere = explained()
    assert not any(axes.axison for axes in nowhere.axes)
    assert nowhere.get_suptitle() == "What backlash explains"
    assert nowhere._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize("count", [1, 4, 8])
def test_every_place_has_a_panel_and_no_text_meets_another(count):
    names = [f"left_arm_{k}_joint" for k in range(count)]
    figure = explained(*(sides(name=name, quantity=f"approach.{name}") for name in names))
    assert sum(axes.axison for axes in figure.axes) == count
    in_order(figure)


def test_the_largest_difference_of_a_comparison_is_drawn_first():
    sizes = {"a": 1e-5, "b": -9e-5, "c": 4e-5}
    told = [{"name": name, "difference": size, "std": 1e-5} for name, size in sizes.items()]
    axes = plots.plot_differences({"effects": [{"parameters": [*told, {"name": "d", "std": None}]}]}).axes[0]
    assert tick_labels(axes) == ["b", "c", "a"]
    assert [*bars(axes, AFTER), *bars(axes, BEFORE)] == pytest.approx([-9.0, 4.0, 1.0])


def test_a_robot_over_time_is_drawn_as_it_moves():
    wear = by_hand()
    axes = plot_wear(wear).axes
    shown = [a.get_title(loc="left").split("\n") for a in axes if a.axison]
    assert shown[0] == ["zero offset, elbow", "ALARM: jump; limit 3.00 mrad, far away"]
    assert [name for name, _ in shown] == ["zero offset, elbow", "lost motion, wrist", "zero offset, lift"]
    centre, moves = axes[0].get_lines()[:2]
    within, beyond = (one.lines[0].get_xydata() for one in axes[0].containers)
    np.testing.assert_allclose(within, [[0.0, 1.0], [31.0, 1.01]])  # days, mrad
    np.testing.assert_allclose(beyond, [[59.0, 1.2], [90.0, 1.21]])
    assert list(centre.get_ydata()) == pytest.approx([1.0, 1.0])
    band = axes[0].collections[0].get_paths()[0].get_extents()
    assert (band.y0, band.y1) == pytest.approx((0.967, 1.033))  # 3 of 10 µrad, which scatter 1.1 times as much
    assert moves.get_xdata().tolist() == [0.0, 31.0, 45.0, 45.0, 59.0, 90.0]
    assert np.ptp(moves.get_ydata()) == pytest.approx(0.2)
    assert sorted(x for one in axes[1].containers for x in one.lines[0].get_xdata()) == [0.0, 31.0, 90.0]
    assert axes[1].get_lines()[-1].get_ydata()[0] == pytest.approx(0.5)  # its limit, mrad
    none = plot_wear(replace(wear, parameters=wear.parameters[-1:])).axes
    assert written(none[0]) == ["No parameter can be compared."]


def test_a_drawing_shows_itself_without_a_display_and_is_written_whole(tmp_path):
    figure = Drawing(2.0, 1.0)
    figure.subplots()
    shown = figure._repr_png_()
    assert shown.startswith(b"\x89PNG")
    assert tuple(int.from_bytes(shown[k : k + 4], "big") for k in (16, 20)) == (220, 110)
    for name in ("a.png", "b.pdf", "c"):
        figure.savefig(tmp_path / name)
    figure.savefig(str(tmp_path / "d"), format="svg")
    found = {file.name: file.read_bytes()[:4] for file in tmp_path.iterdir()}
    assert found == {"a.png": b"\x89PNG", "b.pdf": b"%PDF", "c.png": b"\x89PNG", "d": b"<?xm"}


def test_names_with_dollar_signs_and_empty_panels_say_what_they_are():
    figure = Drawing(4.0, 2.0)
    axes = figure.subplots()
    title(axes, "$a^_1$")
    note(axes, "$x$")
    figure.draw_without_rendering()  # a broken formula would be an error
    for text, name in ((axes._left_title, "$a^_1$"), (axes.texts[0], "$x$")):
        assert text._preprocess_math(text.get_text()) == (name, False)
    assert plain("no sign") == "no sign"
    assert not axes.axison
    assert axes.texts[0].get_position() == (0.5, 0.5)


@pytest.mark.parametrize(("low", "high"), [(3.0, 180.0), (0.004, 5.0), (1e-3, 1e3)])
def test_a_logarithmic_axis_is_labelled_with_numbers_read_at_sight(low, high):
    figure = Drawing(6.0, 2.0)
    axes = figure.subplots()
    log_axis(axes, low, high)
    figure.draw_without_rendering()
    shown = [t.label1.get_text() for t in axes.xaxis._update_ticks() if t.label1.get_text()]
    assert len(shown) >= 3
    assert all(text.strip("0.").rstrip("0") in ("1", "2", "5") for text in shown)
    assert all(low <= float(text) <= high for text in shown)
