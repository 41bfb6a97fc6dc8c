"""What effects do, computed by hand on an arm of two links; joints that scatter; effects as a model has them."""

from dataclasses import replace

import numpy as np
import pytest
from several import FLAT, simulated

from thermal_robot import (
    CorrectedModel,
    simulate,
)
from thermal_robot.effects import library
from thermal_robot.kinematics import exp6
from thermal_robot.observations import Frames

UPPER = 0.5  # m, of the planar arm


def test_a_warm_link_is_longer_along_itself(planar):
    q = np.array([[0.3, 1.0], [0.3, 1.0], [-2.0, 0.5]])
    warm = {"temperature": [20.0, 30.0, 25.0]}
    grown = simulate(planar, {"thermal_elongation": {"upper": 2e-5}}, commands=q, conditions=warm)
    shift = grown.position - simulate(planar, commands=q, conditions=warm).position
    longer = UPPER * 2e-5 * np.array([0.0, 10.0, 5.0])
    expected = longer[:, None] * np.column_stack([np.cos(q[:, 0]), np.sin(q[:, 0]), np.zeros(3)])
    np.testing.assert_allclose(shift, expected, atol=1e-14)


def test_lost_motion_is_the_gap_between_the_two_sides(planar):
    q = [[0.0, 0.5], [1.0, 0.5], [2.0, 0.5], [1.0, 0.5], [0.0, 0.5]]
    found = simulate(planar, {"backlash": {"shoulder": 1e-3}}, commands=q)
    below, above = found.position[1], found.position[3]
    turn = np.arctan2(above[1], above[0]) - np.arctan2(below[1], below[0])
    assert turn == pytest.approx(1e-3, rel=1e-9)


def angle(campaign):
    """Where the shoulder stands, told from a straight arm."""
    return np.arctan2(campaign.position[:, 1], campaign.position[:, 0])


def straight(rows):
    return np.column_stack([np.random.default_rng(2).uniform(-2.0, 2.0, rows), np.zeros(rows)])


def test_a_joint_that_scatters_comes_to_another_place_at_each_visit(planar):
    found = simulate(planar, {"excess_repeatability": {"shoulder": 2e-3}}, commands=straight(1000), repeats=3)
    away = angle(found) - found.q[:, 0]
    assert away.std() == pytest.approx(2e-3, rel=0.06)
    pose = np.unique(found.labels["pose"], return_inverse=True)[1]
    within = away - (np.bincount(pose, away) / 3.0)[pose]
    assert within.std() * np.sqrt(3.0 / 2.0) == pytest.approx(2e-3, rel=0.06)


def test_a_coarse_encoder_stands_on_its_steps_and_repeats(planar):
    step = 0.02
    found = simulate(planar, {"encoder_resolution": {"shoulder": step}}, commands=straight(200), repeats=2)
    stands = angle(found)
    assert np.abs(stands - found.q[:, 0]).max() == pytest.approx(step / 2.0, rel=0.1)
    steps = (stands - stands[0]) / step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    for pose in set(found.labels["pose"]):
        assert np.ptp(stands[found.labels["pose"] == pose]) < 1e-12


def test_effects_together_are_the_model_that_has_them(rv_m2):
    base, tool = exp6(np.array([0.4, -1.0, 0.2, 0.1, 0.3, 1.0])), exp6(np.array([0.05, 0.0, 0.1, 0.2, 0.0, 0.1]))
    values = {"thermal_elongation": np.arange(1.0, 6.0) * 1e-5, "backlash": {"joint_3": 3e-4}, "instrument_scale": 2e-5}
    found = simulate(rv_m2, values, base=base, tool=tool, measures="pose")
    known = library()
    effects = (
        (known["thermal_elongation"], values["thermal_elongation"]),
        (known["backlash"], np.array([0.0, 0.0, 3e-4, 0.0, 0.0])),
        (known["instrument_scale"], np.array([2e-5])),
    )
    model = CorrectedModel(rv_m2, found.settings, Frames(base, tool), effects, "pose", tuple(found.covariates))
    position, orientation = model.predict(found)
    np.testing.assert_array_equal(found.position, position)
    np.testing.assert_array_equal(found.orientation, orientation)
    again = simulate(rv_m2, model.effects, base=base, tool=tool, measures="pose")
    np.testing.assert_array_equal(again.position, found.position)


def test_targets_and_noises_of_the_campaign_that_lent_its_commands_are_gone(rv_m2):
    lent = simulate(rv_m2, rows=40, noise=1e-5, measures="pose", seed=2)
    lent = replace(lent, noise_of_rows=np.full(40, 2e-5))
    found = simulate(rv_m2, commands=lent, noise=1e-5, seed=3)
    assert found.noise_of_rows is None
    assert found.noise_position == 1e-5
    several, _ = simulated(rv_m2, ["joint_offset"], FLAT, 1)
    assert several.targets is not None
    found = simulate(rv_m2, commands=several, seed=3)
    assert found.targets is None
    assert {"x", "y", "z", "qw"} <= set(found.to_frame())
