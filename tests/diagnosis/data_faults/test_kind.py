"""A kind names what it proposes, and each number of a family gives its own proposal."""

import numpy as np

from thermal_robot.diagnosis.data_faults.faults import Kind


def test_every_number_of_a_family_gives_its_own_proposal():
    kind = Kind("late", "late by {}", "pair anew", offsets=lambda _: [((1.0, 2.0), lambda by: (f"{by:g} s", by))])
    (family,) = kind.families(None)
    proposals = [family.of(number) for number in family.tried]
    assert [(p.kind, p.place, p.repair) for p in proposals] == [(kind, "1 s", 1.0), (kind, "2 s", 2.0)]
    assert list(kind.proposed(None)) == []


def test_a_kind_proposes_each_of_its_places():
    kind = Kind("reversed", "{} is reversed", "turn it", lambda names: [(name, np.negative) for name in names])
    assert [p.kind.says.format(p.place) for p in kind.proposed(["a", "b"])] == ["a is reversed", "b is reversed"]
