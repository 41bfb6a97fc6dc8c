"""Compiled loops, however few cases there are."""

import pytest

from thermal_robot.assembly.probability import compiled


@pytest.fixture
def always(monkeypatch):
    monkeypatch.setattr(compiled, "MANY", 1)
