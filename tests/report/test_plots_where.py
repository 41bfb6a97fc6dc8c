"""Where: bars as long as the shares, joints and links from root to tool."""

from dataclasses import replace

import pytest
from report.looking import bars, tick_labels

from thermal_robot.diagnosis.values import Where
from thermal_robot.report import plot_where
from thermal_robot.report.drawing import AFTER, BEFORE, MUTED, THIRD


def test_where_follows_the_chain_from_root_to_tool(case):
    chain, other = plot_where(case("confounded")).axes
    names = [t.get_text() for t in chain.get_yticklabels()]
    assert names == [*case("confounded").joint_names, *case("confounded").where.links]
    assert list(chain.get_yticks()) == sorted(chain.get_yticks())
    assert chain.get_ylim()[0] > chain.get_ylim()[1]
    assert "24.0 %" in [t.get_text() for t in chain.texts]
    assert [t.get_text() for t in other.get_yticklabels()] == ["x", "y", "z", "temperature", "time"]


def test_where_says_that_nothing_is_placed(case):
    chain, other = plot_where(case("nothing")).axes
    assert "No effect was found" in chain.texts[0].get_text()
    assert [t.get_text() for t in other.get_yticklabels()] == ["x", "y", "z"]


def test_bars_are_as_long_as_the_shares(case):
    diagnosis = case("confounded")
    chain, other = plot_where(diagnosis).axes
    for axes, colour, shares in (
        (chain, AFTER, diagnosis.where.joints),
        (chain, THIRD, diagnosis.where.links),
        (other, MUTED, diagnosis.where.axes),
        (other, AFTER, diagnosis.where.covariates),
    ):
        assert bars(axes, colour) == pytest.approx([100.0 * share for share in shares.values()])


def test_a_share_is_written_beside_its_bar(case):
    chain, _ = plot_where(case("confounded")).axes
    at = dict(zip(chain.get_yticks(), tick_labels(chain), strict=True))
    said = {at[t.get_position()[1]]: t for t in chain.texts if t.get_text().endswith("%")}
    assert {name: t.get_text() for name, t in said.items() if "arm" in name} == {
        "upper_arm_link": "61.0 %",
        "forearm_link": "33.0 %",
    }
    assert said["upper_arm_link"].get_position()[0] > 61.0
    assert "wrist_2_joint" not in said  # nothing is written of nothing


def test_an_axis_ends_beyond_its_longest_bar_and_never_far_beyond_all_of_it(case):
    base = case("confounded")
    for largest in (1e-4, 0.05, 0.5, 1.0):
        where = Where({"x": 1.0, "y": 0.0, "z": 0.0}, {base.joint_names[0]: largest}, {}, {})
        chain, _ = plot_where(replace(base, where=where)).axes
        assert chain.get_xlim()[0] == 0.0
        assert 100.0 * largest < chain.get_xlim()[1] <= max(10.0, 118.0 * largest)


def test_joints_without_a_share_keep_their_place_in_the_chain(case):
    base = case("confounded")
    where = Where({"x": 1.0, "y": 0.0, "z": 0.0}, {"elbow_joint": 0.5}, {}, {})
    chain, _ = plot_where(replace(base, where=where)).axes
    assert tick_labels(chain) == list(base.joint_names)
    assert bars(chain, AFTER) == pytest.approx([0.0, 0.0, 50.0, 0.0, 0.0, 0.0])


def test_what_lies_beyond_joints_and_links_is_drawn_below_them(case):
    base = case("found")
    beyond = {"base": 0.18, "instrument": 0.02}
    chain, _ = plot_where(replace(base, where=replace(base.where, beyond=beyond))).axes
    assert tick_labels(chain)[-2:] == ["base", "instrument"]
    assert bars(chain, BEFORE) == pytest.approx([18.0, 2.0])
    alone, _ = plot_where(replace(base, where=Where(base.where.axes, {}, {}, {}, beyond))).axes
    assert tick_labels(alone) == ["base", "instrument"]


def test_the_eight_largest_quantities_are_drawn(case):
    many = {f"quantity_{k}": 0.01 * k for k in range(12)}
    base = case("found")
    _, other = plot_where(replace(base, where=replace(base.where, covariates=many))).axes
    assert tick_labels(other)[3:] == [f"quantity_{k}" for k in range(11, 3, -1)]


def test_long_names_put_the_panels_below_each_other(case):
    base = case("found")
    side_by_side = plot_where(base)
    long = {f"approach.left_arm_shoulder_{k}_joint": 0.1 for k in range(3)}
    stacked = plot_where(replace(base, where=replace(base.where, covariates=long)))
    for figure, above in ((side_by_side, False), (stacked, True)):
        figure.draw_without_rendering()
        first, second = (axes.get_position() for axes in figure.axes)
        assert bool(first.y0 > second.y1) is above
        assert bool(first.x1 < second.x0) is not above
