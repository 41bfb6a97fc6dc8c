"""Joints that trail their command."""

from dataclasses import replace

import numpy as np
from helpers import commanded, tool_at, tool_with

from thermal_robot.effects import TrackingLag
from thermal_robot.observations import observe


def test_servo_and_friction_hold_a_joint_back(rv_m2):
    arm = rv_m2
    rng = np.random.default_rng(1)
    moved, pushed = rng.normal(size=(2, 10, arm.n))
    recorded = {f"velocity.{n}": v for n, v in zip(arm.joint_names, moved.T, strict=True)}
    recorded |= {f"acceleration.{n}": a for n, a in zip(arm.joint_names[1:], pushed.T[1:], strict=True)}
    recorded["velocity.joint_3"] = np.zeros(10)
    moved[:, 2] = 0.0
    campaign = commanded(arm, recorded)
    effect = TrackingLag().variants(observe(campaign))[0]
    parameters = effect.parameters(observe(campaign))
    assert {p.place for p in parameters} == set(arm.joint_names) - {"joint_3"}
    assert [p.label for p in parameters if p.place == "joint_1"] == ["delay", "friction"]
    values = np.array([p.size for p in parameters]) * rng.uniform(1, 5, len(parameters))
    q = campaign.q.copy()
    for parameter, value in zip(parameters, values, strict=True):
        j = arm.joint_names.index(parameter.place)
        q[:, j] += value * {"delay": -moved, "friction": -np.sign(moved)}.get(parameter.label, pushed)[:, j]
    np.testing.assert_allclose(tool_with(campaign, effect, values), tool_at(arm, q), atol=1e-14)
    still = replace(campaign, covariates={name: 0.0 * v for name, v in recorded.items()})
    np.testing.assert_allclose(tool_with(still, effect, values), tool_at(arm, campaign.q), atol=1e-14)


def test_a_delay_is_where_the_joint_was_a_moment_ago(rv_m2):
    """Joints that run evenly, q = q₀ + v t: with a delay T they stand where the command stood at t − T."""
    plain = commanded(rv_m2)
    velocity = np.random.default_rng(2).normal(size=plain.q.shape)
    campaign = replace(
        plain, covariates={f"velocity.{n}": v for n, v in zip(rv_m2.joint_names, velocity.T, strict=True)}
    )
    effect = TrackingLag().variants(observe(campaign))[0]
    delay = [3e-3 if p.label == "delay" else 0.0 for p in effect.parameters(observe(campaign))]
    earlier = tool_at(rv_m2, plain.q - 3e-3 * velocity)
    np.testing.assert_allclose(tool_with(campaign, effect, delay), earlier, atol=1e-14)


def test_it_is_drawn_against_velocity_in_the_joints_unit(awkward):
    rng = np.random.default_rng(3)
    campaign = commanded(awkward, {f"velocity.{n}": rng.normal(size=10) for n in awkward.joint_names})
    observations, kinds = observe(campaign), dict(zip(awkward.joint_names, awkward.joint_types, strict=True))
    for parameter in TrackingLag().parameters(observations):
        name, unit, values = TrackingLag().driver(observations, [parameter], np.zeros(10))
        column = f"velocity.{parameter.place}"
        assert (name, unit) == (column, "m/s" if kinds[parameter.place] == "prismatic" else "rad/s")
        np.testing.assert_array_equal(values, campaign.covariates[column])
