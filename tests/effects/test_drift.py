"""A base that settles while the campaign runs."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded, tool_at, tool_with

from thermal_robot.effects import Drift
from thermal_robot.kinematics import exp6
from thermal_robot.observations import Frames, observe


@pytest.mark.parametrize("clock", ["time", "order"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.6])
def test_drift_begins_at_zero_and_reaches_its_parameters_at_the_end(rv_m2, clock, share):
    values = np.sort(np.random.default_rng(7).uniform(100.0, 900.0, SAMPLES))
    campaign = commanded(rv_m2, {clock: values})
    settings = {s.time_constant: s for s in Drift().variants(observe(campaign))}
    effect = replace(settings[0.1], time_constant=share)
    base = exp6([1.0, -2.0, 0.5, 0.4, 1.0, -0.3])
    frames = Frames(base, np.eye(4))
    still = tool_with(campaign, effect, np.zeros(6), frames)
    gone = tool_with(campaign, effect, [2e-4, -1e-4, 3e-4, 0, 0, 0], frames) - still
    np.testing.assert_allclose(gone[0], 0.0, atol=1e-14)
    np.testing.assert_allclose(gone[-1], base[:3, :3] @ [2e-4, -1e-4, 3e-4], atol=1e-14)
    elapsed = (values - values[0]) / (values[-1] - values[0])
    growth = elapsed if share == 0 else (1 - np.exp(-elapsed / share)) / (1 - np.exp(-1 / share))
    np.testing.assert_allclose(gone, growth[:, None] * gone[-1], atol=1e-14)


def test_drift_turns_the_whole_robot_about_its_base(rv_m2):
    campaign = commanded(rv_m2, {"time": np.arange(SAMPLES, dtype=float)})
    effect = Drift().variants(observe(campaign))[0]
    turned = tool_with(campaign, effect, [0, 0, 0, 0, 0, 0.1])
    angle = 0.1 * np.linspace(0, 1, SAMPLES)
    x, y, z = tool_at(rv_m2, campaign.q).T
    expected = np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z], axis=1)
    np.testing.assert_allclose(turned, expected, atol=1e-14)


def test_near_a_straight_drift_lie_slow_exponentials_and_near_one_of_these_others():
    assert [s.time_constant for s in Drift().nearby(1.6)] == [0.0, 1.0, 2.0]
    assert [s.time_constant for s in Drift(time_constant=0.25).nearby(2.0)] == [0.25, 0.5, 0.125]


@pytest.mark.parametrize(("clock", "unit"), [("time", "s"), ("order", "")])
def test_it_is_drawn_against_the_clock(rv_m2, clock, unit):
    values = np.arange(SAMPLES, dtype=float)
    observations = observe(commanded(rv_m2, {clock: values}))
    found = Drift().driver(observations, Drift().parameters(observations), np.zeros(SAMPLES))
    assert found[:2] == (clock, unit)
    np.testing.assert_array_equal(found[2], values)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_in_another_campaign_drift_begins_with_that_one_at_the_same_rate(rv_m2, share):
    first = commanded(rv_m2, {"time": np.linspace(0.0, 1000.0, SAMPLES)})
    later = commanded(rv_m2, {"time": np.linspace(90_000.0, 90_500.0, SAMPLES)})
    effect = replace(Drift().variants(observe(first))[0], time_constant=share)
    there = effect.elsewhere(observe(later))
    values = [2e-4, -1e-4, 3e-4, 0, 0, 0]
    gone = tool_with(later, there, values) - tool_with(later, there, np.zeros(6))
    np.testing.assert_allclose(gone[0], 0.0, atol=1e-14)
    half = commanded(rv_m2, {"time": np.linspace(0.0, 500.0, SAMPLES)})
    same = tool_with(half, effect, values) - tool_with(half, effect, np.zeros(6))
    np.testing.assert_allclose(gone, same, atol=1e-13)
