"""One effect: points at the quantity that drives it, its law through them, axes that can be compared."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from report.looking import line, outside, overlapping, texts

from thermal_robot.diagnosis.values import Explained, Place
from thermal_robot.report import explain_figure
from thermal_robot.report import plots as plots_explain
from thermal_robot.report.drawing import BEFORE

SLOPE = 8e-6  # m/K


def place(rows=80, seed=1, **other):
    """A link that grows by 8 µm a kelvin, seen with 5 µm of noise."""
    rng = np.random.default_rng(seed)
    warm = rng.uniform(20.0, 30.0, rows)
    noise = 5e-6 * rng.standard_normal(rows)
    known = {
        "kind": "link",
        "name": "column",
        "share": 0.28,
        "quantity": "temperature",
        "quantity_unit": "°C",
        "values": warm,
        "levels": False,
        "unit": "m",
        "before": SLOPE * (warm - 20.0) + noise,
        "after": noise,
        "spread": np.full(rows, 5e-6),
        "line": np.array([[20.0, 30.0], [0.0, SLOPE * 10.0]]),
    }
    return Place(**{**known, **other})


def sides(rows=60, seed=2, **other):
    """A joint with 0.4 mrad of lost motion."""
    rng = np.random.default_rng(seed)
    approach = np.where(np.arange(rows) % 2, 1.0, -1.0)
    noise = 2e-5 * rng.standard_normal(rows)
    known = {
        "kind": "joint",
        "name": "joint_3",
        "share": 0.6,
        "quantity": "approach.joint_3",
        "quantity_unit": "",
        "values": approach,
        "levels": True,
        "unit": "rad",
        "before": -2e-4 * approach + noise,
        "after": noise,
        "spread": np.full(rows, 2e-5),
        "line": np.array([[-1.0, 1.0], [2e-4, -2e-4]]),
    }
    return Place(**{**known, **other})


def test_points_and_law_are_drawn_as_they_are():
    one = place()
    (axes,) = explain_figure(Explained("thermal_elongation", (one,), 0)).axes
    for label, error in (("as measured", one.before), ("with this effect taken off", one.after)):
        np.testing.assert_allclose(line(axes, label), [one.values, 1e6 * error])
    np.testing.assert_allclose(line(axes, "fitted law"), [[20.0, 30.0], [0.0, 80.0]])
    assert axes.get_xlabel() == "temperature (°C)"
    assert axes.get_ylabel() == "error (µm)"
    assert axes._left_title.get_text() == "link column: 28 %"


def test_few_values_stand_apart_with_before_and_after_beside_each_other():
    one = sides()
    (axes,) = explain_figure(Explained("backlash", (one,), 0)).axes
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


def test_a_quantity_with_a_single_value_is_no_failure():
    one = sides(values=np.ones(60), line=np.array([[1.0], [2e-4]]))
    explain_figure(Explained("backlash", (one,), 0)).draw_without_rendering()


def test_rows_in_which_the_place_hardly_moves_the_target_are_left_out():
    spread = np.full(80, 5e-6)
    spread[:10] = 1e-3
    wild = place(spread=spread)
    wild.before[:10] = 1.0
    (axes,) = explain_figure(Explained("thermal_elongation", (wild,), 0)).axes
    assert line(axes, "as measured").shape[1] == 70
    assert axes.get_ylim()[1] < 200.0  # µm


def test_of_a_long_campaign_some_points_are_drawn():
    (axes,) = explain_figure(Explained("thermal_elongation", (place(rows=9000),), 0)).axes
    assert line(axes, "as measured").shape[1] == 1500
    assert axes.get_lines()[0].get_rasterized()


def test_panels_of_one_unit_share_their_axis_and_those_of_another_do_not():
    large = place(share=0.3, line=np.array([[20.0, 30.0], [0.0, 2e-3]]))
    figure = explain_figure(Explained("an_effect", (large, place(seed=5), sides()), 0))
    first, second, third = figure.axes
    assert first.get_ylim() == second.get_ylim()
    assert first.get_ylim()[1] > 2.0  # the law is seen to its end, mm
    assert first.get_ylabel() == "error (mm)"
    assert second.get_ylabel() == ""
    assert third.get_ylabel() == "error (mrad)"
    assert third.get_ylim() != first.get_ylim()


def test_an_error_that_shifts_and_turns_is_told_at_the_tool():
    (axes,) = explain_figure(Explained("geometric", (place(unit="m at the tool"),), 0)).axes
    assert axes.get_ylabel() == "error (µm at the tool)"


def test_a_share_is_told_in_per_cent_and_a_kind_only_where_the_name_lacks_it():
    places = (sides(share=0.604), sides(name="elbow", share=0.3))
    figure = explain_figure(Explained("backlash", places, 2))
    assert [axes._left_title.get_text() for axes in figure.axes] == ["joint_3: 60 %", "joint elbow: 30 %"]
    assert figure.get_suptitle() == "What backlash explains; 2 smaller places are not shown"
    assert explain_figure(Explained("backlash", places, 0)).get_suptitle() == "What backlash explains"


@pytest.mark.parametrize("count", [1, 4, 8])
def test_every_place_has_a_panel_and_no_text_meets_another(count):
    places = tuple(sides(name=f"left_arm_{k}_joint", quantity=f"approach.left_arm_{k}_joint") for k in range(count))
    figure = explain_figure(Explained("backlash", places, 0))
    assert sum(axes.axison for axes in figure.axes) == count
    said = texts(figure)
    assert outside(figure, said) == []
    assert overlapping(said) == []


def test_the_law_is_drawn_over_the_points():
    (axes,) = explain_figure(Explained("backlash", (sides(),), 0)).axes
    law = next(one for one in axes.get_lines() if one.get_label() == "fitted law")
    assert law.get_color() == BEFORE
    assert axes.get_lines().index(law) == len(axes.get_lines()) - 1


def test_an_effect_that_is_nowhere_gives_an_empty_figure():
    figure = explain_figure(Explained("backlash", (), 0))
    assert not any(axes.axison for axes in figure.axes)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_names_are_no_formulas():
    one = replace(sides(), name="$a_1$ joint", quantity="$x$")
    (axes,) = explain_figure(Explained("$y$", (one,), 0)).axes
    assert axes._left_title.get_text() == r"\$a_1\$ joint: 60 %"
    assert axes.get_xlabel() == r"\$x\$"


def test_it_knows_what_it_draws_by_type_only():
    tree = ast.parse(Path(plots_explain.__file__).read_text(encoding="utf-8"))
    loaded = [n.module for n in tree.body if isinstance(n, ast.ImportFrom)]
    assert not any("diagnosis" in module for module in loaded)
