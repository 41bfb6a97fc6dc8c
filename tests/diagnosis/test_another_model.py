"""A factor of a thousand is a unit's, one of two a sister's."""

import pytest

from thermal_robot.diagnosis.values import AnotherModel


@pytest.mark.parametrize(
    ("factor", "told"), [(None, False), (0.5, False), (25.4, False), (0.01, True), (1e3, True), (1e-3, True)]
)
def test_a_unit_is_told_from_a_sister(factor, told):
    model = AnotherModel(factor, joint="joint_3", off=0.2)
    assert model.in_another_unit is told
    assert bool(model.unit) is told
