"""A base that yields: energy, the moment of all weights, and an inclinometer in its place."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import SAMPLES, commanded, tool_with, without_masses
from simulate import simulate

from thermal_robot.effects import BaseCompliance, choose
from thermal_robot.effects.base_compliance import overturning
from thermal_robot.inference.fit import fit
from thermal_robot.observations import observe


@pytest.mark.parametrize("arm", ["ur10", "panda", "rv_m2", "awkward"], indirect=True)
def test_the_moment_is_what_a_turn_of_the_base_works_against(arm):
    """Virtual work: a payload on a weightless arm, turned about an axis through the origin, rises by e × r."""
    bare = without_masses(arm)
    place = np.array([0.02, -0.01, 0.05])
    campaign = commanded(bare, {"payload": np.full(SAMPLES, 3.0)}, payload_com=place, target=place)
    observations = observe(campaign)
    turns = observations.base_sensitivity[:, :3, 3:]
    np.testing.assert_allclose(overturning(observations), 3.0 * np.einsum("nik,i->nk", turns, bare.gravity), atol=1e-9)


@pytest.mark.parametrize("values", [[1e-6, 1e-6], [1e-6, 7e-7, 1e-6, 7e-7]])
def test_an_arm_on_a_soft_base_sinks(rv_m2, values):
    campaign = commanded(rv_m2)
    campaign = replace(campaign, q=np.linspace(-0.4, 0.4, SAMPLES)[:, None] * np.ones(rv_m2.n))
    soft = BaseCompliance(below=len(values) > 2)
    sunk = tool_with(campaign, soft, values) - tool_with(campaign, soft, np.zeros(len(values)))
    # outstretched, all weights lie on the tool's side: it goes down
    assert (sunk[:, 2] < 0.0).all()


def test_what_it_turns_about_lies_below(rv_m2):
    """A point at the depth stays where it is: each turn by ω shifts the origin, 0.7 m above, by 0.7 ω × up."""
    parameters = BaseCompliance(below=True).parameters(observe(commanded(rv_m2)))
    assert [p.unit for p in parameters] == ["rad/(N·m)", "m/(N·m)"] * 2
    for spring, shift in zip(parameters[::2], parameters[1::2], strict=True):
        twist = spring.responses[0].values + 0.7 * shift.responses[0].values
        np.testing.assert_allclose(twist[:, :3] + np.cross(twist[:, 3:], [0.0, 0.0, -0.7]), 0.0, atol=1e-12)
        assert np.ptp(twist[:, 3:]) > 0.0


def test_it_needs_masses_or_an_inclinometer(rv_m2):
    assert BaseCompliance().missing(observe(commanded(rv_m2))) == ()
    bare = without_masses(rv_m2)
    lacking = ("tilt.x", "tilt.y", "masses in the URDF")
    assert BaseCompliance().missing(observe(commanded(bare))) == lacking
    assert BaseCompliance().missing(observe(commanded(bare, {"payload": np.arange(10.0)}))) == lacking
    tilted = observe(commanded(bare, {"tilt.x": np.arange(10.0) * 1e-4}))
    assert BaseCompliance().missing(tilted) == ()
    assert {effect.tilt for effect in BaseCompliance().variants(tilted)} == {True}


def test_a_measured_tilt_turns_the_base_by_itself(rv_m2):
    tilt = 1e-4 * np.random.default_rng(2).normal(size=(2, SAMPLES))
    campaign = commanded(rv_m2, dict(zip(("tilt.x", "tilt.y"), tilt, strict=True)))
    moved = tool_with(campaign, BaseCompliance(tilt=True), [1.0]) - tool_with(
        campaign, BaseCompliance(tilt=True), [0.0]
    )
    place = observe(campaign).position
    np.testing.assert_allclose(moved, np.cross(np.column_stack([*tilt, np.zeros(SAMPLES)]), place), atol=1e-7)


def test_a_soft_base_is_named_and_its_springs_are_measured(rv_m2):
    campaign, truth, _ = simulate(rv_m2, ["base_compliance"], seed=4, ratio=(6.0, 6.0))
    known = fit(campaign, choose())
    ((effect, values),) = known.effects
    assert effect.name == "base_compliance"
    spread = np.sqrt(np.diag(known.explanation.values[known.explanation.best.blocks[0]][1]))
    true = list(truth["parts"]["base_compliance"]["values"].values())
    assert (np.abs(values - true) < 3.0 * spread).all()
