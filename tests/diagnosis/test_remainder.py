"""What an explanation leaves, whitened, and what repeats say of it."""

from dataclasses import replace

import numpy as np
import pytest

from thermal_robot import EstimationError, diagnose
from thermal_robot.inference.frames import register
from thermal_robot.observations import observe


def repeated(campaign, times, seed, noise=20e-6):
    """Each command measured several times, in turn."""
    rows = np.tile(np.arange(campaign.samples), times)
    again = replace(campaign.take(rows), rows=np.arange(2, len(rows) + 2), covariates={})
    exact = simulate_exact(campaign)
    noisy = exact[rows] + noise * np.random.default_rng(seed).normal(size=(len(rows), 3))
    return replace(again, position=noisy)


def simulate_exact(campaign):
    """Where the nominal robot has the target, with the frames of the campaign."""

    return observe(campaign, register(campaign)).predicted_position


def _noise(campaign, stated):
    return campaign if stated else replace(campaign, noise_position=None)


@pytest.mark.parametrize("stated", [True, False], ids=["noise stated", "noise from repeats"])
def test_repeated_commands_without_a_fault_leave_nothing_unexplained(clean, stated):
    found = [diagnose(_noise(repeated(clean, 2, seed), stated)) for seed in range(4)]
    assert sum(d.verdict == () and not d.unexplained.flagged for d in found) >= 3
    if not stated:
        floors = [d.gap.noise_floor / np.sqrt(3.0) for d in found]
        assert np.median(floors) == pytest.approx(20e-6, rel=0.15)
        assert {d.gap.noise_source for d in found} == {"repeats"}


@pytest.mark.parametrize("rows", [3, 4, 6])
def test_too_few_poses_are_refused_and_the_need_is_named(clean, rows):
    with pytest.raises(EstimationError, match=f"{rows} different poses are too few: 9 unknowns .* at least 7"):
        diagnose(clean.take(np.arange(rows)))


def test_three_poses_repeated_are_three_poses(clean):
    with pytest.raises(EstimationError, match="3 different poses"):
        diagnose(repeated(clean.take(np.arange(3)), 20, 0))
