"""Which names are kept: by what campaigns agree on."""

import numpy as np
import pytest

from thermal_robot.effects import library
from thermal_robot.effects.effect import Parameter
from thermal_robot.fleet.compare import _judged
from thermal_robot.fleet.compare_joint import joint
from thermal_robot.fleet.compare_sums import Candidate, Sums

SURE = 1e4
"""Information of each campaign on each parameter: deviations of a hundredth of the expected size."""


def verdict(values, named=None, blind=()):
    """Status and reason of an effect in two joints with these values in each campaign."""
    values = np.asarray(values, dtype=float)
    told = tuple(Parameter("size", "rad", 1.0, "joint", name, ()) for name in ("one", "two"))
    named = tuple(bool(row.any()) for row in values) if named is None else named
    item = Candidate("own", "own", library()["joint_offset"], told, np.ones(2), (told,) * len(values), named)
    said = [Sums(SURE * np.eye(2) * (k not in blind), SURE * row * (k not in blind)) for k, row in enumerate(values)]
    owners = [(0, 0), (0, 1)]
    return _judged(0, item, owners, joint([item], owners, said), said, ["a", "b", "c", "d"][: len(values)])


@pytest.mark.parametrize(
    ("values", "status", "reason"),
    [
        ([[1, -1], [1, -1]], "shared", ""),
        ([[1, -1], [1.3, -1]], "changed", ""),  # one joint of two
        ([[1, -1], [1.2, -1.2], [1.4, -1.4]], "changed", ""),  # wear
        ([[0, 0], [1, 0]], "changed", ""),  # a fault that began
        ([[0, 0], [1, 0], [1, 0]], "changed", ""),
        ([[0.4, 0], [1, 0]], "contradicts", "a and b each need another size, with none in common"),
        ([[0.4, 0], [1, 0], [2.5, 0]], "contradicts", "a, b and c each need another size, with none in common"),
        ([[0, 0], [1, 0], [0, 0]], "contradicts", "b alone needs it, and a and c exclude it"),
        ([[0.4, 0], [1, 0], [0, 0]], "contradicts", "a and b need it in different sizes, and c excludes it"),
        ([[1, -1], [-1, 1]], "contradicts", "a and b each need another size, with none in common"),
    ],
)
def test_a_name_is_kept_where_two_agree(values, status, reason):
    assert verdict(values) == (status, reason)


def test_what_nobody_needs_is_not_needed_or_absent():
    assert verdict([[0, 0], [0, 0]], named=(True, False)) == ("not_needed", "the campaigns together do not need it")
    assert verdict([[0, 0], [0, 0]])[0] == "absent"


def test_what_one_campaign_alone_tells_is_not_compared():
    assert verdict([[1, 1], [0, 0]], blind=(1,)) == ("not_compared", "a alone can tell it")
