"""What is measured where, and what a system of such rows can see."""

import numpy as np
import pytest

from thermal_robot.assembly.thermal import RANK_TOLERANCE, axes_of, measured, rank_of, visible
from thermal_robot.errors import EstimationError


def seen(system):
    """Rank of a system, and which unknowns it determines."""
    _, singular, right = np.linalg.svd(system, full_matrices=True)
    rank = rank_of(singular)
    return rank, visible(right, rank).tolist()


def test_letters_for_all_poses_are_a_word_for_each():
    assert axes_of("xz", 3) == ("xz",) * 3 == axes_of(["xz"] * 3, 3)
    assert axes_of(("x", "x", "x", "x", "z"), 5) == ("x", "x", "x", "x", "z")
    assert axes_of("xyz", 0) == ()


def test_components_stand_in_the_order_of_the_axes_whatever_that_of_the_letters():
    np.testing.assert_array_equal(measured(("zx", "y")), [[True, False, True], [False, True, False]])
    assert measured(()).shape == (0, 3)
    assert measured(axes_of("xyz", 4)).all()


@pytest.mark.parametrize(
    ("axes", "words"),
    [("xq", "not 'xq'"), ("", "not ''"), (("x", "yy"), "not 'yy'"), (("x",), "for 1 poses, but there are 2")],
)
def test_axes_that_make_no_sense_are_refused(axes, words):
    with pytest.raises(EstimationError, match=words):
        axes_of(axes, 2)


def test_rank_counts_what_is_not_rounding():
    assert rank_of(np.array([])) == 0
    assert rank_of(np.zeros(3)) == 0
    assert rank_of(np.array([5.0, 1.0, 5.0 * RANK_TOLERANCE * 2.0])) == 3
    assert rank_of(np.array([5.0, 1.0, 5.0 * RANK_TOLERANCE / 2.0])) == 2
    # The unit does not matter: metres or micrometres.
    for factor in (1e-12, 1e12):
        assert rank_of(factor * np.array([5.0, 1.0, 0.0])) == 2


def test_an_unknown_is_visible_when_no_hidden_combination_holds_it():
    assert seen(np.eye(3)) == (3, [True, True, True])
    # Only a + b is seen, and c.
    assert seen(np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0]])) == (2, [False, False, True])
    # Five rows that all say the same see no more than one.
    assert seen(np.tile([[1.0, 1.0, 1.0]], (5, 1))) == (1, [False, False, False])
    assert seen(np.array([[0.0, 3.0, 0.0]])) == (1, [False, True, False])
    # A millionth and a half of a hidden combination is already too much; a ten-millionth is not.
    assert seen(np.array([[1.0, 1.5e-6]])) == (1, [False, False])
    assert seen(np.array([[1.0, 1e-7]])) == (1, [True, False])


def test_visible_unknowns_are_those_that_every_solution_shares():
    rng = np.random.default_rng(0)
    system = rng.normal(size=(4, 6))
    system[:, 5] = 2.0 * system[:, 4]  # only their sum shows
    system[:, :2] = np.eye(4)[:, :2]
    system[:2, 2:] = 0.0
    rank, known = seen(system)
    hidden = np.linalg.svd(system)[2][rank:]
    np.testing.assert_allclose(system @ hidden.T, 0.0, atol=1e-12)
    # Whatever hidden part is added to a solution, the visible unknowns stay, and the others need not.
    moved = np.abs(rng.normal(size=(50, len(hidden))) @ hidden).max(axis=0) > 1e-9
    assert known == (~moved).tolist()
    assert known[:2] == [True, True]
    assert not any(known[4:])
