"""The overview: four panels that say what their own figures say, under the verdict."""

from dataclasses import replace

import numpy as np
from report.looking import labels, tick_labels, written

from thermal_robot.report import overview, plot_how_far, plot_which


def test_overview_holds_four_panels_and_the_verdict(case):
    figure = overview(case("found"))
    assert [axes._left_title.get_text() for axes in figure.axes] == [
        "How far",
        "Which",
        "Where",
        "The gap, seen from the side",
    ]
    assert " ".join(figure.get_suptitle().split()) == case("found").summary
    assert overview(case("found"), headline=False).get_suptitle() == ""


def test_panels_say_what_their_own_figures_say(case):
    diagnosis = case("confounded")
    how_far, which, where, map_ = overview(diagnosis).axes
    assert labels(how_far) == labels(plot_how_far(diagnosis).axes[0])
    assert tick_labels(which) == tick_labels(plot_which(diagnosis).axes[0])
    assert tick_labels(where) == [*diagnosis.joint_names, *diagnosis.where.links]
    assert len(map_.collections) == 2
    assert "not testable" in written(which)


def test_the_map_is_seen_from_where_it_is_broadest(case):
    diagnosis = case("found")
    flat = diagnosis.rows.position * np.array([1.0, 1.0, 0.05])
    above = diagnosis.rows.position * np.array([1.0, 0.6, 3.0])
    for position, view in ((flat, "the side"), (above, "above")):
        moved = replace(diagnosis, rows=replace(diagnosis.rows, position=position))
        map_ = overview(moved).axes[3]
        assert map_._left_title.get_text() == f"The gap, seen from {view}"
        assert map_.get_ylabel().startswith("z" if view == "the side" else "y")


def test_many_effects_make_the_figure_higher(case):
    base = case("found")
    many = replace(base, effects=tuple(replace(base.effects[1], name=f"effect_{k}") for k in range(30)))
    assert overview(many).get_figheight() > overview(base).get_figheight()
