"""What is asked of several campaigns: changes in turn, fleets in turn, and nothing that nobody could answer."""

from collections import Counter
from itertools import islice

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='the blind trial needs "thermal-robot[blind]"')

from thermal_robot.blind.cases import SEVERAL
from thermal_robot.blind.plan import BESIDE, CONTAINS, IMITATES, LOCAL, turns_of_several
from thermal_robot.blind.reality import FAULTS
from thermal_robot.errors import EffectError


def asked(kind, count, effects=tuple(FAULTS), seed=3):
    return list(islice(turns_of_several(kind, effects, np.random.default_rng(seed)), count))


def test_each_change_is_asked_as_often_as_any_other():
    ways = Counter((case["several"].moves, case["several"].how) for case in asked("series", 24))
    assert ways == {(name, how): 2 for name in LOCAL for how in ("begins", "jumps", "grows")}
    assert Counter(case["several"].moves for case in asked("changed", 12)) == dict.fromkeys(LOCAL, 3)
    fleets = Counter((case["several"].how, case["several"].moves) for case in asked("fleet", 24))
    shared = {(how, name): 2 for how in ("all", "hall") for name in LOCAL}
    assert fleets == {**shared, ("", ""): 8}  # a third of the fleets shares nothing


@pytest.mark.parametrize("kind", SEVERAL)
def test_what_changes_is_at_work_and_nothing_beside_it_does_the_same(kind):
    for case in asked(kind, 200):
        several, effects = case["several"], case["effects"]
        assert not several.moves or several.moves in effects
        assert len(set(effects)) == len(effects) <= 2
        assert set(effects) <= set(BESIDE)
        assert bool(several.how) == bool(several.moves)
        for outer, inner in (*CONTAINS.items(), *IMITATES.items()):
            assert not (outer in effects and inner & set(effects))


def test_nothing_changes_where_nothing_is_to():
    for kind, count in (("same", 2), ("steady", 12)):
        cases = asked(kind, 60)
        assert all(
            (c["several"].how, c["several"].moves, c["several"].campaigns) == ("", "", (count,) * 2) for c in cases
        )
        assert {len(c["effects"]) for c in cases} == {1, 2}


def test_two_to_four_robots_of_a_fleet_have_a_fault_of_their_own():
    cases = asked("fleet", 300)
    counts = Counter(len(case["several"].apart) for case in cases)
    assert set(counts) == {2, 3, 4}
    assert min(counts.values()) > 60
    assert set(name for case in cases for name in case["several"].apart) == set(LOCAL)
    # an arm of four joints has two between the first and the last
    assert all(max(Counter((*case["effects"], *case["several"].apart)).values()) <= 2 for case in cases)


def test_faults_that_may_not_be_asked_are_not():
    for case in asked("changed", 10, ("backlash", "drift")):
        assert case["effects"] == ("backlash",)
    for kind in SEVERAL:
        with pytest.raises(EffectError, match=kind):
            turns_of_several(kind, ("drift",), np.random.default_rng(0))
    # of an effect with many numbers a joint nobody asks which changed, but a robot may have it on all days
    assert asked("steady", 1, ("link_compliance",))[0]["effects"] == ("link_compliance",)
    with pytest.raises(EffectError, match="series"):
        turns_of_several("series", ("link_compliance",), np.random.default_rng(0))
