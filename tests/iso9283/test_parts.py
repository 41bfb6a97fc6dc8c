"""Values without behaviour: frozen, and plain enough for JSON."""

import json
from dataclasses import FrozenInstanceError, asdict, fields

import pytest

from thermal_robot.iso9283 import AlongPath, PathCriteria, PoseCriteria, Repeatability


@pytest.mark.parametrize(
    "value",
    [PoseCriteria("P1", 2, None, Repeatability(1e-5)), PathCriteria("seam", 3, 2, AlongPath(1e-4, (1.0, 2.0, 3.0)))],
)
def test_criteria_are_frozen_and_plain(value):
    with pytest.raises(FrozenInstanceError):
        value.cycles = 31
    assert set(json.loads(json.dumps(asdict(value)))) == {field.name for field in fields(value)}
