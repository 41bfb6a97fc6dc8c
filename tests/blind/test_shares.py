"""Shares on fresh rows: laws of Shapley's value."""

import numpy as np
import pytest

from thermal_robot.blind.score import shares

TRUE = np.zeros((50, 3))


def at(rms, seed=0):
    """Predictions that err by this rms distance."""
    drawn = np.random.default_rng(seed).normal(size=TRUE.shape)
    return TRUE + drawn * rms / np.sqrt((drawn**2).sum(axis=1).mean())


def test_one_effect_takes_away_what_is_gone():
    """10 → 2 with noise of variance 3 σ² = 12 in the gap: (100 − 4) / 112."""
    found = shares({"": at(10.0), "drift": at(2.0)}, TRUE, 2.0)
    assert found == {"drift": pytest.approx(96.0 / 112.0)}


def test_shares_sum_to_what_all_take_away_and_twins_have_the_same():
    left = {"": at(10.0), "a": at(6.0), "b": at(6.0, 1), "c": at(10.0), "a+b": at(2.0), "a+c": at(6.0), "b+c": at(6.0)}
    left["a+b+c"] = at(2.0)
    found = shares(left, TRUE, 0.0)
    assert sum(found.values()) == pytest.approx(0.96)
    assert found["a"] == pytest.approx(found["b"])
    assert found["c"] == pytest.approx(0.0, abs=1e-12)


def test_what_does_harm_has_a_share_below_nothing():
    assert shares({"": at(1.0), "a": at(2.0)}, TRUE, 0.0)["a"] == pytest.approx(-3.0)


def test_without_subsets_there_are_no_shares():
    assert shares({}, TRUE, 1.0) == {}
