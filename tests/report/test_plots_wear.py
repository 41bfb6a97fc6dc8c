"""A robot over time, drawn: dots with deviations, a line as it moves, a band where a jump lies."""

from dataclasses import replace

import numpy as np
import pytest
from report.looking import outside, overlapping, texts
from wear_cases import by_hand

from thermal_robot.report import plot_wear


def test_dots_and_line_are_where_the_values_are():
    axes = plot_wear(by_hand()).axes
    assert axes[0].get_title(loc="left") == "zero offset, elbow\nALARM: jump"
    line, dots = axes[0].get_lines()[0], axes[0].containers[0].lines[0]
    np.testing.assert_allclose(dots.get_xdata(), [0.0, 31.0, 59.0, 90.0])
    np.testing.assert_allclose(np.diff(dots.get_ydata()), [0.01, 0.19, 0.01])  # mrad
    assert line.get_xdata().tolist() == [0.0, 31.0, 45.0, 45.0, 59.0, 90.0]
    assert np.ptp(line.get_ydata()) == pytest.approx(0.2)
    assert axes[1].containers[0].lines[0].get_xdata().tolist() == [0.0, 31.0, 90.0]  # one campaign says nothing of it


def test_only_what_can_be_compared_is_drawn():
    shown = [a.get_title(loc="left").split("\n")[0] for a in plot_wear(by_hand()).axes if a.axison]
    assert shown == ["zero offset, elbow", "lost motion, wrist", "zero offset, lift"]


@pytest.mark.parametrize("dated", [True, False])
def test_no_text_leaves_the_figure_or_meets_another(dated):
    figure = plot_wear(by_hand(dated))
    said = texts(figure)
    assert outside(figure, said) == []
    assert overlapping(said) == []


def test_nothing_to_compare_is_said():
    wear = by_hand()
    axes = plot_wear(replace(wear, parameters=wear.parameters[-1:])).axes
    assert axes[0].texts[0].get_text() == "No parameter can be compared."
