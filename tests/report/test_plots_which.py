"""Which: bars as long as the shares, with interval and probability beside each."""

from dataclasses import replace

import pytest
from matplotlib.patches import Rectangle
from report.looking import lines_of, tick_labels, written

from thermal_robot.report import plot_which
from thermal_robot.report.drawing import Drawing
from thermal_robot.report.plots import draw_which


def test_which_draws_share_interval_and_probability(case):
    (axes,) = plot_which(case("found")).axes
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
    (axes,) = plot_which(diagnosis).axes
    assert axes.get_yticklabels()[0].get_text() == "thermal_elongation"
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first stands above


def test_the_probability_stands_beside_its_effect(case):
    (axes,) = plot_which(case("confounded")).axes
    names = tick_labels(axes)
    assert all(t.get_position()[0] > 1.0 for t in axes.texts if t.get_text().endswith(" %"))  # of the panel's width
    beside = {round(t.get_position()[1]): t.get_text() for t in axes.texts if t.get_text().endswith(" %")}
    assert {names[k]: said for k, said in beside.items()} == {
        "geometric": "> 99.9 %",
        "joint_offset": "97.0 %",
        "base_frame": "97.0 %",
        "drift": "< 0.1 %",
    }


def test_found_is_filled_and_confounded_is_hatched(case):
    (axes,) = plot_which(case("confounded")).axes
    looks = {name: bar for name, bar in zip(tick_labels(axes), axes.patches, strict=False)}
    assert looks["geometric"].get_hatch() is None
    assert looks["geometric"].get_facecolor()[3] == 1.0
    assert looks["joint_offset"].get_hatch()
    assert looks["joint_offset"].get_facecolor()[3] == 0.0


def test_a_wild_interval_does_not_squeeze_the_rest(case):
    found, wild, *rest = case("found").effects
    wild = replace(wild, shrinkage=-3.0, shrinkage_ci95=(-9.0, 4.0))
    (axes,) = plot_which(replace(case("found"), effects=(found, wild, *rest))).axes
    low, high = axes.get_xlim()
    assert -30.0 < low < 0.0
    assert 100.0 < high < 160.0


def test_where_there_is_little_room_what_is_not_testable_does_not_say_why(case):
    axes = Drawing(6.0, 4.0).subplots()
    draw_which(axes, case("found"), brief=True)
    assert written(axes).count("not testable") == 2
    assert not any("needs" in said for said in written(axes))


def test_no_candidate_at_all_is_said(case):
    (axes,) = plot_which(replace(case("found"), effects=())).axes
    assert written(axes) == ["No effect was tried."]
