"""Numbers of the comparison over time that would make nonsense of it, were they otherwise."""

import math

import pytest

from thermal_robot.fleet import wear_settings as settings


def test_kinds_share_what_moves():
    assert math.fsum(settings.KINDS.values()) == pytest.approx(1.0)
    assert min(settings.KINDS.values()) > 0.0


def test_deviations_are_never_made_smaller():
    assert settings.SCATTER[0] == 1.0
    assert list(settings.SCATTER) == sorted(settings.SCATTER)
    assert settings.SCALES[-1] < settings.WIDE
