"""Rows split into sums and rows kept: together they are all rows, and those near a limit are kept."""

import numpy as np
import pytest
from growing_cases import in_full

from thermal_robot.diagnosis.growing import settings
from thermal_robot.diagnosis.growing.grown import end_to_end, some, split
from thermal_robot.diagnosis.growing.settled import Begin
from thermal_robot.diagnosis.growing.sums import Seen, products


@pytest.fixture
def parted(whole, grown, monkeypatch):
    monkeypatch.setattr(settings, "KEPT", 150)
    return split(grown.choice, in_full(whole), Begin.about(grown.fitted))


def test_no_row_is_lost_and_none_counts_twice(whole, grown, parted):
    sums, kept = parted
    rest = np.setdiff1d(np.arange(whole.samples), kept)
    assert len(rest) == sums.rows == sums.used == sums.kept
    seen = Seen.at(whole.take(rest), grown.fitted.point, grown.choice, rivals=True)
    expected = products(seen.alike, np.ones(len(rest)))
    assert np.allclose(sums.weighed, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_rows_in_the_tail_are_kept(whole, grown, parted):
    gap = Seen.at(whole, grown.fitted.point, grown.choice).gap
    tail = np.linalg.norm(gap / grown.fitted.sigma, axis=1) > parted[0].guard.bend
    assert tail.sum() > 5
    assert set(np.flatnonzero(tail)) <= set(parted[1])


def test_rows_kept_are_as_many_as_are_asked_for(parted):
    assert len(parted[1]) == 150
    assert parted[0].guard.reach > 0.0


def test_some_rows_of_several_batches(whole):
    both = end_to_end([in_full(whole.take(np.arange(10))), in_full(whole.take(np.arange(10, 30)))])
    assert (some(both, np.array([3, 25])).campaign.rows == whole.rows[[3, 25]]).all()
    assert len(both.weights) == len(both.aside) == 30
