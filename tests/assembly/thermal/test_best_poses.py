"""Where to measure: better than chance, within the limits, and no single exchange improves it."""

import numpy as np
import pytest

from thermal_robot import kinematics as kin
from thermal_robot.assembly.thermal import best_poses, displacement, identify_elongations
from thermal_robot.errors import EstimationError

EQUATION_12 = ("x", "x", "x", "x", "z")
on_arms = pytest.mark.parametrize("arm", ["rv_m2", "ur10", "panda"], indirect=True)


def rows(robot, q, axes):
    chosen = np.array([[letter in word for letter in "xyz"] for word in axes])
    return kin.elongation_jacobian(robot, q)[chosen]


def quality(system, criterion):
    """The criterion over what can be seen at all, the larger the better."""
    eigenvalues = np.linalg.eigvalsh(system.T @ system)
    eigenvalues = eigenvalues[eigenvalues > 1e-9]
    return {"D": np.sum(np.log(eigenvalues)), "A": -np.sum(1 / eigenvalues), "E": eigenvalues[0]}[criterion]


@pytest.mark.parametrize("criterion", ["D", "A", "E"])
def test_five_poses_for_equation_12(rv_m2, configurations, criterion):
    found = best_poses(rv_m2, 5, axes=EQUATION_12, criterion=criterion)
    assert np.all((found.q >= rv_m2.lower) & (found.q <= rv_m2.upper))
    system = rows(rv_m2, found.q, found.axes)
    np.testing.assert_allclose(found.errors, np.sqrt(np.sum(np.linalg.inv(system) ** 2, axis=1)), rtol=1e-9)
    assert found.condition == pytest.approx(np.linalg.cond(system), rel=1e-9)
    drawn = configurations(rv_m2, 100_000, seed=1).reshape(20_000, 5, 5)
    jacobian = kin.elongation_jacobian(rv_m2, drawn.reshape(-1, 5)).reshape(20_000, 5, 3, 5)
    square = np.concatenate([jacobian[:, :4, 0], jacobian[:, 4:, 2]], axis=1)
    by_chance = max(quality(one, criterion) for one in square[np.linalg.cond(square) < 30])
    assert quality(system, criterion) > by_chance


def test_the_worst_combination_is_as_good_as_facts_best(rv_m2):
    # facts: the best condition over random poses is about 4, a random set's median 59.
    found = best_poses(rv_m2, 5, axes=EQUATION_12, criterion="E")
    assert found.condition < 4.0
    assert found.errors.max() < 1.2
    with_all_axes = best_poses(rv_m2, 5, criterion="A")
    assert with_all_axes.errors.max() < 0.6


@on_arms
@pytest.mark.parametrize("criterion", ["D", "A", "E"])
def test_no_exchange_of_one_pose_is_better(arm, configurations, criterion):
    pool = configurations(arm, 60)
    found = best_poses(arm, 5, candidates=pool, criterion=criterion)
    index = [int(np.flatnonzero(np.all(pool == q, axis=1))[0]) for q in found.q]
    assert len(set(index)) == 5
    here = quality(rows(arm, found.q, found.axes), criterion)
    for slot in range(5):
        for candidate in set(range(60)) - set(index):
            changed = found.q.copy()
            changed[slot] = pool[candidate]
            assert quality(rows(arm, changed, found.axes), criterion) <= here + 1e-6 * abs(here)


@on_arms
def test_errors_are_those_of_the_identification(arm):
    found = best_poses(arm, 6, candidates=300)
    moved = displacement(arm, found.q, 1e-5)
    identified = identify_elongations(arm, found.q, moved, axes=found.axes, sigma=3e-6)
    np.testing.assert_allclose(identified.standard_errors, 3e-6 * found.errors, rtol=1e-9)
    np.testing.assert_array_equal(np.isnan(found.errors), ~identified.identified)
    assert found.names == identified.names


def test_candidates_beyond_the_limits_are_left_out(rv_m2, configurations):
    pool = configurations(rv_m2, 40)
    beyond = pool + np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    found = best_poses(rv_m2, 5, candidates=np.vstack([beyond, pool]))
    assert np.all(found.q <= rv_m2.upper)


def test_a_draw_is_repeated_with_its_seed(rv_m2):
    one, same, other = (best_poses(rv_m2, 5, candidates=200, seed=seed).q for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_fewer_components_than_unknowns_are_chosen_too(rv_m2):
    found = best_poses(rv_m2, 2, axes="z", candidates=200)
    assert found.condition == np.inf
    assert np.all(np.isnan(found.errors[1:2]))  # a vertical displacement never shows l2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"criterion": "G"}, "D, A or E, not 'G'"),
        ({"candidates": 4}, "5 poses cannot be chosen from 4"),
        ({"candidates": np.full((9, 5), 9.0)}, "5 poses cannot be chosen from 0"),
        ({"candidates": np.zeros((9, 4))}, r"expected \(M, 5\)"),
        ({"axes": ("x", "z")}, "given for 2 poses, but there are 5"),
    ],
)
def test_what_does_not_fit_is_said(rv_m2, options, words):
    with pytest.raises(EstimationError, match=words):
        best_poses(rv_m2, 5, **options)
