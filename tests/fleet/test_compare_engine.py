"""The joint fit of several campaigns on normal equations whose truth is known."""

import numpy as np
import pytest
from scipy.linalg import lstsq

from thermal_robot.effects import Parameter, library
from thermal_robot.fleet import settings
from thermal_robot.fleet.compare import _equal, _judged, _parameters
from thermal_robot.fleet.compare_joint import joint, some_of
from thermal_robot.fleet.compare_sums import Candidate, Sums, told
from thermal_robot.inference.algebra import solve

JOINTS = ("one", "two", "three", "four")
TRUTH = np.array([1.0, -0.5, 0.3, 0.8])
SURE = 1e4
"""Information of each campaign on each parameter: deviations of a hundredth of the expected size."""


def listed(campaigns, places=JOINTS, named=None, size=1.0):
    """One effect with a parameter in each of some joints."""
    own = tuple(Parameter("size", "rad", size, "joint", name, ()) for name in places)
    named = (True,) * campaigns if named is None else named
    at = tuple(range(len(own)))
    effect = library()["joint_offset"]
    return [Candidate("own", "own", effect, own, np.full(len(own), size), (own,) * campaigns, named, at)]


def said(truths, rng, rows=60):
    """What campaigns with these parameters say, noise one."""
    result = []
    for truth in truths:
        columns = rng.normal(size=(rows, 4)) * 4.0
        result.append(Sums(columns.T @ columns, columns.T @ (columns @ truth + rng.normal(size=rows))))
    return result


def fitted(truths, rng):
    return joint(listed(len(truths)), said(truths, rng))


def four(changes=()):
    """Four campaigns of one robot, with changes as (campaigns, joint, by how much)."""
    truths = np.tile(TRUTH, (4, 1))
    for where, k, by in changes:
        truths[list(where), k] += by
    return said(truths, np.random.default_rng(5))


def test_what_did_not_change_is_shared_as_least_squares_over_all_has_it():
    sums = said([TRUTH] * 3, np.random.default_rng(1))
    found = joint(listed(3), sums)
    assert found.changes == ()
    together = solve(sum(s.matrix for s in sums), sum(s.vector for s in sums))
    np.testing.assert_allclose(found.values, np.tile(together, (3, 1)), atol=2e-3)
    assert found.probability[0] > 0.999


def test_one_place_that_changed_is_found_with_when():
    later = TRUTH + np.array([0.0, 0.0, 0.25, 0.0])
    found = fitted([TRUTH, TRUTH, later, later], np.random.default_rng(2))
    (change,) = found.changes
    assert change.part.place == ("joint", "three")
    assert change.part.where in ((0, 1), (2, 3))
    assert found.values[3, 2] - found.values[0, 2] == pytest.approx(0.25, abs=0.1)
    np.testing.assert_array_equal(found.values[0, [0, 1, 3]], found.values[3, [0, 1, 3]])


def test_two_places_may_change_at_two_times():
    days = TRUTH + np.array([[0.0, 0.0, 0.0, 0.0], [0.4, 0.0, 0.0, 0.0], [0.4, 0.0, 0.0, -0.4]])
    found = fitted(days, np.random.default_rng(3))
    assert {change.part.place[1] for change in found.changes} == {"one", "four"}
    np.testing.assert_allclose(found.values, days, atol=0.12)


def test_chance_makes_no_change_more_often_than_stated():
    rng = np.random.default_rng(0)
    truths = rng.normal(size=(150, 4))
    # 2 % of 150 are 3; more than 8 have a chance of 0.4 %
    assert sum(bool(fitted([truth, truth], rng).changes) for truth in truths) <= 8


def test_a_change_of_five_deviations_is_found_and_nothing_else():
    rng, right = np.random.default_rng(0), 0
    for _ in range(60):
        truth, place = rng.normal(size=4), rng.integers(4)
        step = 5.0 * np.sqrt(2.0 / (60 * 16.0))
        changed = fitted([truth, truth + step * np.eye(4)[place]], rng).changes
        right += [c.part.place[1] for c in changed] == [JOINTS[place]]
    assert right >= 51


def test_which_sets_of_campaigns_may_differ():
    assert some_of(2) == ((0,), (1,))
    assert len(some_of(4)) == 2**4 - 2
    many = some_of(9)
    assert {(k,) for k in range(9)} < set(many)
    assert (0, 1, 2) in many
    assert (5, 6, 7, 8) in many
    assert len(many) == len(set(many)) < 2**9 - 2


@pytest.mark.parametrize(
    "changes", [(), [((1, 3), 2, 0.6)], [((2, 3), 0, 0.5), ((0,), 1, -0.7)], [((1,), 3, 0.8), ((2,), 3, -0.8)]]
)
def test_of_many_parts_those_that_join_one_after_another_give_the_same(changes, monkeypatch):
    whole = joint(listed(4), four(changes))
    monkeypatch.setattr(settings, "AT_ONCE", 7)
    by_and_by = joint(listed(4), four(changes))
    assert by_and_by.looked_at == whole.looked_at
    assert {(c.part.where, c.part.parameters) for c in by_and_by.changes} == {
        (c.part.where, c.part.parameters) for c in whole.changes
    }
    np.testing.assert_allclose(by_and_by.values, whole.values, atol=1e-6)


def verdict(values, named=None, blind=()):
    """Status and reason of an effect in two joints with these values in each campaign."""
    values = np.asarray(values, dtype=float)
    named = tuple(bool(row.any()) for row in values) if named is None else named
    items = listed(len(values), JOINTS[:2], named)
    sums = [Sums(SURE * np.eye(2) * (k not in blind), SURE * row * (k not in blind)) for k, row in enumerate(values)]
    return _judged(0, items[0], joint(items, sums), sums, ["a", "b", "c", "d"][: len(values)])


@pytest.mark.parametrize(
    ("values", "more", "status", "reason"),
    [
        ([[1, -1], [1, -1]], {}, "shared", ""),
        ([[1, -1], [1.3, -1]], {}, "changed", ""),  # one joint of two
        ([[1, -1], [1.2, -1.2], [1.4, -1.4]], {}, "changed", ""),  # wear
        ([[0, 0], [1, 0]], {}, "changed", ""),  # a fault that began
        ([[0, 0], [1, 0], [1, 0]], {}, "changed", ""),
        ([[0.4, 0], [1, 0]], {}, "contradicts", "a and b each need another size, with none in common"),
        ([[0.4, 0], [1, 0], [2.5, 0]], {}, "contradicts", "a, b and c each need another size, with none in common"),
        ([[0, 0], [1, 0], [0, 0]], {}, "contradicts", "b alone needs it, and a and c exclude it"),
        ([[0.4, 0], [1, 0], [0, 0]], {}, "contradicts", "a and b need it in different sizes, and c excludes it"),
        ([[1, -1], [-1, 1]], {}, "contradicts", "a and b each need another size, with none in common"),
        ([[0, 0], [0, 0]], {"named": (True, False)}, "not_needed", "the campaigns together do not need it"),
        ([[0, 0], [0, 0]], {}, "absent", ""),
        ([[1, 1], [0, 0]], {"blind": (1,)}, "not_compared", "a alone can tell it"),
        ([[1, 1], [1, 1]], {"blind": (0, 1)}, "not_compared", "no campaign tells it beside the frames"),
    ],
)
def test_a_name_is_kept_where_two_agree(values, more, status, reason):
    assert verdict(values, **more) == (status, reason)


def rows(seed, campaigns=3, count=40, width=5, blind=()):
    """Columns and values of some campaigns; a blind one does not see the first two columns apart."""
    rng, found = np.random.default_rng(seed), []
    for c in range(campaigns):
        columns = rng.normal(size=(count, width)) * 10.0
        if c in blind:
            columns[:, 1] = columns[:, 0]
        found.append((columns, columns @ rng.normal(size=width) * 0.1 + rng.normal(size=count)))
    return found


def squares(columns, values):
    return float(((values - columns @ lstsq(columns, values)[0]) ** 2).sum())


@pytest.mark.parametrize(("seed", "blind"), [(0, ()), (1, ()), (2, (1,)), (3, (0, 2))])
def test_equal_is_what_is_lost_by_sharing(seed, blind):
    """Against least squares over all rows, some columns shared by all campaigns and the others of each alone."""
    data, own, others = rows(seed, blind=blind), [0, 2], [1, 3, 4]
    wide = []
    for c, (columns, _) in enumerate(data):
        block = np.zeros((len(columns), len(own) + len(others) * len(data)))
        block[:, : len(own)] = columns[:, own]
        start = len(own) + c * len(others)
        block[:, start : start + len(others)] = columns[:, others]
        wide.append(block)
    whole = np.vstack(wide)
    together = squares(whole, np.concatenate([values for _, values in data]))
    chi2, degrees, p_value = _equal([Sums(x.T @ x, x.T @ y) for x, y in data], own)
    assert chi2 == pytest.approx(together - sum(squares(x, y) for x, y in data), rel=1e-6)
    assert degrees == sum(np.linalg.matrix_rank(x) for x, _ in data) - np.linalg.matrix_rank(whole)
    assert 0.0 <= p_value <= 1.0


def test_values_are_least_squares_and_what_is_not_seen_is_no_number():
    data = rows(5, campaigns=2, blind=(1,))
    sums = [Sums(x.T @ x, x.T @ y) for x, y in data]
    (item,) = listed(2, [f"j{k}" for k in range(5)], size=1e-3)
    found = _parameters(item, sums, list(range(5)), ["a", "b"])
    np.testing.assert_allclose([p.values[0] for p in found], lstsq(*data[0])[0] * 1e-3, rtol=1e-8)
    spread = np.sqrt(np.diag(np.linalg.inv(data[0][0].T @ data[0][0]))) * 1e-3
    np.testing.assert_allclose([p.stds[0] for p in found], spread, rtol=1e-8)
    assert [p.values[1] is None for p in found] == [True, True, False, False, False]
    assert found[0].difference is None
    p = found[3]
    assert p.between == ("a", "b")
    assert p.difference == pytest.approx(p.values[1] - p.values[0])
    assert p.chi2 == pytest.approx((p.difference / p.std) ** 2)
    assert p.std == pytest.approx(np.hypot(*p.stds))


def test_equal_follows_the_law_of_chi_square():
    rng = np.random.default_rng(0)
    data = rows(7, campaigns=3)
    truth, drawn = rng.normal(size=5), []
    for _ in range(300):
        sums = [Sums(x.T @ x, x.T @ (x @ truth + rng.normal(size=len(x)))) for x, _ in data]
        drawn.append(_equal(sums, [1, 3])[2])
    # p values are even between 0 and 1: Kolmogorov's distance of 300 of them is below 0.094 in 99 % of cases
    assert np.abs(np.sort(drawn) - (np.arange(300) + 0.5) / 300).max() < 0.094


def test_a_parameter_that_repeats_another_is_told_once():
    columns = np.random.default_rng(0).normal(size=(30, 3))
    columns = np.column_stack([columns, columns[:, 0] + columns[:, 1], np.zeros(30)])
    assert told([Sums(columns.T @ columns, np.zeros(5))] * 2) == [0, 1, 2]
