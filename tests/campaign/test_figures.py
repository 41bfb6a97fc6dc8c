"""Figures that no campaign holds are found in their row, and the smallest are none."""

import numpy as np
import pytest

from thermal_robot.campaign.checked import first_beyond, settled


@pytest.mark.parametrize("figure", [np.nan, np.inf, -np.inf, 1e21, -1e300])
def test_the_first_figure_beyond_is_found(figure: float) -> None:
    assert first_beyond(np.array([0.0, 1e20, figure, figure])) == 2
    assert first_beyond(np.array([[0.0, 1.0], [2.0, figure]])) == 1
    assert first_beyond(np.array([0.0, -1e20])) is None
    assert first_beyond(np.array([0.0, 3.0]), most=2.0) == 1


def test_what_is_next_to_nothing_is_nothing() -> None:
    assert settled(np.array([1e-31, -5e-324, 2e-30, 0.0])).tolist() == [0.0, 0.0, 2e-30, 0.0]
    sound = np.array([1.0, 0.0])
    assert settled(sound) is sound
