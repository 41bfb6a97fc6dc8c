"""Shares in per cent: what is not all is not told as all."""

import pytest

from thermal_robot.percents import percent


@pytest.mark.parametrize(
    ("share", "decimals", "told"),
    [
        (0.5, 1, "50.0 %"),
        (0.126, 0, "13 %"),
        (-0.031, 1, "−3.1 %"),
        (-0.0003, 1, "0.0 %"),
        (-0.004, 0, "0 %"),
        (0.9996, 1, "99.96 %"),
        (0.996, 0, "99.6 %"),
        (0.99999999, 0, "> 99.9999 %"),
        (1.0 - 1e-14, 1, "100.0 %"),
        (1.0, 0, "100 %"),
        (float("nan"), 1, "–"),
        (None, 1, "–"),
    ],
)
def test_a_share_is_written(share, decimals, told):
    assert percent(share, decimals) == told
