"""The engine of optimal design: gains are true, choices are the best, and of candidates alike one is chosen."""

import numpy as np
import pytest

from thermal_robot.diagnosis.next_samples import most_informative


@pytest.fixture
def offered():
    """Forty candidates of three components; six parameters, the first two are the frames'."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(40, 3, 6)) * rng.uniform(0.1, 3.0, (40, 1, 6))
    return root, root[:, :, :2]


def information(root, frames, rows):
    """By the matrices of all measurements together, which the engine never forms."""
    whole, known = (part[rows].reshape(-1, part.shape[2]) for part in (root, frames))
    return 0.5 * (
        np.linalg.slogdet(np.eye(len(whole)) + whole @ whole.T)[1]
        - np.linalg.slogdet(np.eye(len(known)) + known @ known.T)[1]
    )


def test_gains_are_the_information_of_all_that_was_chosen(offered):
    chosen, gains = most_informative(*offered, 12)
    assert len(set(chosen)) == 12
    for k in range(1, 13):
        assert gains[k - 1] == pytest.approx(information(*offered, chosen[:k]), rel=1e-9)


def test_each_choice_is_the_best_after_those_before(offered):
    chosen, _ = most_informative(*offered, 5)
    for k, row in enumerate(chosen):
        left = [c for c in range(40) if c not in chosen[:k]]
        assert row == max(left, key=lambda c: information(*offered, [*chosen[:k], c]))


def test_of_candidates_alike_one_is_chosen(offered):
    alike = np.repeat(np.arange(8), 5)
    chosen, _ = most_informative(*offered, 8, alike)
    assert sorted(alike[chosen].tolist()) == list(range(8))


def test_without_frames_all_information_counts(offered):
    root = offered[0]
    _, gains = most_informative(root, root[:, :, :0], 3)
    assert np.all(np.diff([0.0, *gains]) > 0.0)
