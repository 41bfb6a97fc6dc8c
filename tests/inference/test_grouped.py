"""What is anew in each pose or visit: group by group as by dense algebra, and as with a function for each group."""

from dataclasses import replace

import numpy as np
import pytest
from inference.densities import dense
from scipy.linalg import sqrtm

from thermal_robot.inference.kernels import Form, Grouped, Smooth, Spectrum, decomposed

TAUS = (0.5, 3.0)
# rows' groups of a dozen rows; measures and columns a group; whether the moves are the same for all rows
CASES = {
    "one column": (np.arange(12) // 3, 3, 1, False),
    "two columns": (np.arange(12) // 3, 3, 2, False),
    "more columns than a group has equations": (np.arange(12), 3, 5, False),
    "poses": (np.arange(12) // 4, 6, 6, False),
    "the same moves for all rows": (np.arange(12) // 3, 3, 3, True),
    "groups of several sizes, mixed": (np.array([3, 0, 1, 3, 0, 3, 2, 1, 3, 0, 4, 3]), 3, 2, False),
    "numbers that no row has": (np.array([5, 0, 2, 5, 0, 5, 2, 8, 5, 0, 8, 5]), 3, 2, False),
    "all rows one group": (np.zeros(12, dtype=int), 3, 2, False),
}


class Case:
    """A form that is anew, by groups and with a function each; its dense covariances.

    Two rows weigh nothing, and those of the last row's group neither: that group is empty among the rows in use.
    """

    def __init__(self, name):
        groups, self.measures, columns, same = CASES[name]
        self.rng = np.random.default_rng([4, len(name)])
        rows = len(groups)
        moves = self.rng.normal(size=(self.measures, columns) if same else (rows, self.measures, columns))
        form = Form("poses", groups.astype(float), moves, anew=True)
        noise = np.repeat(self.rng.uniform(0.5, 2.0, self.measures // 3), 3)
        weights = self.rng.uniform(0.3, 1.0, rows)
        weights[[1, 4]] = 0.0
        if len(set(groups)) > 1:
            weights[groups == groups[10]] = 0.0
        self.grouped = decomposed(form, weights, noise)
        each = replace(form, functions=np.eye(groups.max() + 1)[groups], anew=False)
        # written out by row: where moves are the same for all, a spectrum takes another way
        written = np.broadcast_to(moves, (rows, self.measures, columns))
        self.spectrum = Spectrum.of(replace(each, moves=written), weights, noise)
        root, used = np.repeat(np.sqrt(weights), self.measures), np.repeat(weights > 0, self.measures)
        across = dense(each, noise) * root  # of all rows with those in use, weighed
        self.inside, self.across = (root[:, None] * across)[np.ix_(used, used)], across[:, used]
        self.stack = self.rng.normal(size=(len(self.inside), 6))


@pytest.fixture(params=list(CASES))
def case(request):
    return Case(request.param)


def close(found, expected, to=1e-10):
    np.testing.assert_allclose(found, expected, rtol=0, atol=to * max(np.abs(expected).max(), 1.0))


def test_a_form_that_is_anew_is_treated_by_groups_and_another_is_not(case):
    assert isinstance(case.grouped, Grouped)
    smooth = Form("smooth", np.ones((12, 2)), np.eye(case.measures))
    assert isinstance(decomposed(smooth, np.ones(12), np.ones(case.measures)), Spectrum)


@pytest.mark.parametrize("tau", TAUS)
def test_products_are_those_beside_the_dense_covariance(case, tau):
    stack, plain = case.stack, case.stack.T @ case.stack
    expected = stack.T @ np.linalg.solve(np.eye(len(stack)) + tau**2 * case.inside, stack)
    for own in (case.grouped, case.spectrum):
        close(Smooth(own, tau).products(stack), expected)
        # from some columns that were carried over once
        some = [along[:, [4, 1]] for along in own.along(stack)]
        close(own.products(tau, some, plain[np.ix_([4, 1], [4, 1])]), expected[np.ix_([4, 1], [4, 1])])


@pytest.mark.parametrize("tau", TAUS)
def test_columns_are_whitened_by_the_root_of_the_dense_covariance(case, tau):
    expected = np.linalg.inv(np.real(sqrtm(np.eye(len(case.stack)) + tau**2 * case.inside))) @ case.stack
    for own in (case.grouped, case.spectrum):
        close(Smooth(own, tau).whitened(case.stack), expected)


@pytest.mark.parametrize("tau", TAUS)
def test_the_determinant_and_what_is_followed_are_those_of_the_dense_covariance(case, tau):
    covariance = np.eye(len(case.inside)) + tau**2 * case.inside
    for own in (case.grouped, case.spectrum):
        smooth = Smooth(own, tau)
        assert smooth.log_det == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-10)
        followed = np.trace(np.linalg.solve(covariance, tau**2 * case.inside))
        assert smooth.degrees == pytest.approx(followed, rel=1e-10)


@pytest.mark.parametrize("tau", TAUS)
def test_the_mean_is_that_of_the_process_given_the_rows_in_use(case, tau):
    left = case.stack[:, 0]
    expected = tau**2 * case.across @ np.linalg.solve(np.eye(len(left)) + tau**2 * case.inside, left)
    for own in (case.grouped, case.spectrum):
        found = Smooth(own, tau).mean(left)
        assert found.shape == (12, case.measures)
        close(found.ravel(), expected)


@pytest.mark.parametrize("tau", TAUS)
def test_what_some_rows_have_in_common_is_that_of_their_own_covariance(case, tau):
    rows = case.rng.random(len(case.stack) // case.measures) < 0.7
    own, columns = np.repeat(rows, case.measures), case.stack.reshape(len(rows), case.measures, -1)
    some, covariance = case.stack[own], (np.eye(len(case.stack)) + tau**2 * case.inside)[np.ix_(own, own)]
    expected = some.T @ some - some.T @ np.linalg.solve(covariance, some)
    for spectrum in (case.grouped, case.spectrum):
        close(Smooth(spectrum, tau).taken(rows, lambda which: columns[which], 1e-8), expected, 1e-6)
        assert not Smooth(spectrum, tau).taken(rows, lambda which: columns[which], 1e9).any()
    # what lies below a floor is left out of both alike
    floor = float(np.median(np.linalg.eigvalsh(tau**2 * case.inside)[-4:]))
    left = [Smooth(s, tau).taken(rows, lambda which: columns[which], floor) for s in (case.grouped, case.spectrum)]
    close(*left)


def test_of_a_group_that_no_row_in_use_has_nothing_is_known():
    """Its mean is that of the prior, nought; the other groups' is not."""
    case = Case("groups of several sizes, mixed")
    mean = Smooth(case.grouped, 3.0).mean(case.stack[:, 0])
    groups = case.grouped.groups
    alone = ~np.isin(groups, case.grouped.group)
    assert alone.any()
    assert (mean[alone] == 0.0).all()
    assert (np.abs(mean[~alone]).max(axis=1) > 1e-3).all()


def test_rows_without_weight_are_told_what_their_group_has():
    """A pose's row that is set aside errs as the other visits of the pose do where the moves are the same."""
    case = Case("the same moves for all rows")
    mean = Smooth(case.grouped, 3.0).mean(case.stack[:, 0])
    for group in range(4):
        assert np.ptp(mean[case.grouped.groups == group], axis=0).max() < 1e-12


def test_where_no_row_is_in_use_there_is_nothing():
    case = Case("two columns")
    empty = Grouped.of(case.grouped.everywhere, case.grouped.groups, np.zeros(12), np.ones(3))
    assert (empty.log_det(3.0), empty.degrees(3.0)) == (0.0, 0.0)
    assert (empty.mean(3.0, np.zeros(0)) == 0.0).all()


@pytest.mark.parametrize("name", list(CASES))
def test_a_unit_is_the_noise(name):
    """Whatever the units of the moves: the discrepancy's mean square is τ² times the noise's."""
    groups, measures, columns, _ = CASES[name]
    rng = np.random.default_rng(8)
    moves, noise = rng.normal(size=(12, measures, columns)), np.repeat(rng.uniform(0.5, 2.0, measures // 3), 3)
    for factor in (1.0, 1e-5):
        smooth = Smooth(Grouped.of(factor * moves, groups, np.ones(12), noise), 2.0)
        covariance = np.linalg.inv(smooth.products(np.eye(12 * measures)))
        assert (np.diag(covariance) - 1.0).mean() == pytest.approx(4.0, rel=1e-8)
