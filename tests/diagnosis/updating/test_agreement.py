"""Chances that are chances where nothing changes, and small where something does."""

import numpy as np
import pytest
from updating_cases import EFFECTS, in_full, measured

import thermal_robot as tr
from thermal_robot.diagnosis.updated import Agreement, scatter_of, start


@pytest.fixture(scope="module")
def stream():
    """A robot that is well known."""
    return start(tr.diagnose(measured(300, seed=40), only=["joint_offset", "backlash"]).fit)


def look(stream, new, last):
    grown, watch, _ = stream
    return watch.look(grown, new, last)


@pytest.fixture(scope="module")
def chances(stream):
    """(seeds, 3) of batches of 20 fresh rows of the same robot: misfit, change, misfit of all."""
    found = []
    for seed in range(60):
        agreement = look(stream, in_full(measured(20, seed=100 + seed)), Agreement())
        found.append((agreement.p_batch, agreement.p_change, agreement.p_aside))
    return np.array(found)


def test_chances_are_even_where_nothing_changes(chances):
    # Kolmogorov's distance of 60 draws from an even law exceeds 0.25 once in a thousand.
    p = np.sort(chances[:, 0])
    assert np.abs(p - (np.arange(60) + 0.5) / 60).max() < 0.25
    # By Bonferroni it is at least as large as it should be; batches share the errors of one diagnosis.
    assert (chances[:, 1] < 0.1).sum() <= 16
    assert (chances[:, 1] < 1e-3).sum() <= 2
    # rows without gross errors speak of none
    assert (chances[:, 2] > 0.5).all()


@pytest.mark.parametrize("size", [2e-4, pytest.param(4e-4, marks=pytest.mark.slow)])
def test_play_that_begins_is_seen_and_named(stream, size):
    worn = {**EFFECTS, "backlash": {**EFFECTS["backlash"], "joint_4": size}}
    agreement = look(stream, in_full(measured(60, seed=7, effects=worn)), Agreement())
    assert agreement.p_change < 1e-6
    assert agreement.changed == ("backlash", "lost motion, joint_4")


def test_gross_errors_that_were_not_there_before_are_counted(stream):
    agreement = look(stream, in_full(measured(60, seed=9, gross=0.2)), Agreement())
    assert agreement.aside >= 6
    assert agreement.p_aside < 1e-4
    assert agreement.p_batch > 1e-3


def test_misfits_add_up_over_batches(stream):
    first = look(stream, in_full(measured(20, seed=1)), Agreement())
    both = look(stream, in_full(measured(20, seed=2)), first)
    assert both.whole == pytest.approx(first.chi2 + both.chi2)
    assert both.whole_figures == first.figures + both.figures
    assert both.rows == 40


def test_blocks_of_noise_scatter_as_chi_square_says_and_blocks_that_differ_more():
    rng, labels = np.random.default_rng(0), np.repeat(np.arange(20), 30)
    blocks, noise = [labels == k for k in range(20)], rng.normal(size=(600, 3))
    assert scatter_of(noise, blocks) < 2.2  # beyond it, chi-square of 19 degrees is once in a thousand
    assert scatter_of(noise * np.where(labels % 2, 2.0, 1.0)[:, None], blocks) > 5.0
    assert scatter_of(noise, blocks[:1]) == 1.0
