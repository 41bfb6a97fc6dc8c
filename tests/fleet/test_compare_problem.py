"""The parts of a joint fit: products of those that are asked for, and which of many would better a combination."""

import numpy as np
import pytest
from compared import JOINTS, listed, said

from thermal_robot.fleet import compare_settings
from thermal_robot.fleet.compare_joint import Problem, joint, some_of
from thermal_robot.inference.search import Search

OWNERS = [(0, k) for k in range(4)]
TRUTH = np.array([1.0, -0.5, 0.3, 0.8])


def four(changes=()):
    """Four campaigns of one robot, with changes as (campaigns, joint, by how much)."""
    truths = [TRUTH.copy() for _ in range(4)]
    for where, k, by in changes:
        for c in where:
            truths[c][k] += by
    return said(truths, np.random.default_rng(5))


def test_every_set_may_differ_in_all_places_and_in_each():
    problem = Problem.of(listed(4), OWNERS, four())
    differing = [p for p in problem.parts if not p.shared]
    assert len(differing) == len(some_of(4)) * (1 + len(JOINTS))
    assert {p.where for p in differing} == set(some_of(4))
    assert [p.place for p in problem.parts if p.shared] == [("", ""), *(("joint", name) for name in JOINTS)]


def test_products_of_some_parts_are_those_of_all():
    problem = Problem.of(listed(4), OWNERS, four())
    which = [0, 7, 3, 40]
    some, every = problem.gram(which), problem.gram(range(len(problem.parts))).some(which)
    for name in ("matrix", "vector", "total", "spreads", "equations"):
        np.testing.assert_allclose(getattr(some, name), getattr(every, name), rtol=1e-12, atol=1e-9)
    assert some.slices == every.slices


def test_what_changed_is_found_among_all_and_what_is_there_already_is_not_offered():
    problem = Problem.of(listed(4), OWNERS, four([((1, 3), 2, 0.6)]))
    held = [0]
    search = Search(problem.gram(held), [problem.parts[0].log_prior])
    best = search.evaluate([0])
    found = problem.better(held, [best], best.log_evidence)
    assert ("joint", "three") in [problem.parts[k].place for k in found]
    assert not any(problem.parts[k].shared for k in found)
    assert len({problem.parts[k].place for k in found}) == len(found)
    without = search.evaluate([])
    instead = problem.better(held, [best, without], best.log_evidence)
    assert set(found) <= set(instead)


@pytest.mark.parametrize(
    "changes", [(), [((1, 3), 2, 0.6)], [((2, 3), 0, 0.5), ((0,), 1, -0.7)], [((1,), 3, 0.8), ((2,), 3, -0.8)]]
)
def test_of_many_parts_those_that_join_one_after_another_give_the_same(changes, monkeypatch):
    sums = four(changes)
    whole = joint(listed(4), OWNERS, sums)
    monkeypatch.setattr(compare_settings, "AT_ONCE", 7)
    by_and_by = joint(listed(4), OWNERS, sums)
    assert by_and_by.looked_at == whole.looked_at
    assert {(c.part.where, c.part.parameters) for c in by_and_by.changes} == {
        (c.part.where, c.part.parameters) for c in whole.changes
    }
    np.testing.assert_allclose(by_and_by.values, whole.values, atol=1e-6)
    np.testing.assert_allclose(by_and_by.covariance, whole.covariance, atol=1e-8)
