"""The calibrated robot: placements that do what the model's constants do, and notes that say what is in it."""

import numpy as np
import pytest
from readers import displaced, model_of

from thermal_robot import CampaignError
from thermal_robot.correction import calibrated
from thermal_robot.effects import BaseFrame, JointGain, JointOffset, ThermalElongation, ToolFrame
from thermal_robot.kinematics import exp6, tool_poses
from thermal_robot.observations import Frames


def test_placements_are_the_chain_at_zero(arm):
    robot = displaced(arm, seed=7)
    pose = np.eye(4)
    for placement in robot.placements:
        pose = pose @ placement
    # a joint that mimics another stands at its offset while that one is at zero
    if not arm.chain.coupling.offset.any():
        np.testing.assert_allclose(pose, tool_poses(arm, np.zeros(arm.n), robot.displacement)[0], atol=1e-14)
    assert set(robot.origins) == {segment.name for segment in arm.segments}


def test_base_and_tool_are_where_the_model_puts_them(rv_m2):
    base, tool = exp6([1.0, 2.0, 3.0, 0.3, -0.2, 0.1]), exp6([0.0, 0.1, 0.05, 0.2, 0.0, 0.4])
    effects = [(BaseFrame(), np.arange(1, 7) * 1e-3), (ToolFrame(turns=True), np.arange(6, 0, -1) * 1e-3)]
    model = model_of(rv_m2, *effects, frames=Frames(base, tool), base_known=True, tool_known=True)
    robot = calibrated(model)
    np.testing.assert_allclose(robot.base, base @ exp6(np.arange(1, 7) * 1e-3), atol=1e-15)
    np.testing.assert_allclose(robot.target, exp6(np.arange(6, 0, -1) * 1e-3) @ tool, atol=1e-15)
    assert robot.origins == {}
    assert list(robot.links) == ["tool0_target"]
    assert calibrated(model_of(rv_m2)).links == {}


def test_notes_list_what_is_in_it_and_what_is_not(rv_m2):
    model = model_of(rv_m2, (JointOffset(), [1e-3, 0, 0, 0, 0]), (JointGain(), [0, 2e-3, 0, 0, 0]))
    notes = calibrated(model).notes("a URDF")
    at = [notes.index(line) for line in notes if line.endswith(":")]
    assert [notes[k].split(",")[0] for k in at] == ["Written here:", "Not written"]
    assert notes[at[0] + 1] == "  joint_offset: zero offset, joint_1 = 0.001 rad"
    assert "  joint_gain: gain error, joint_2 = 0.002" in notes[at[1] :]
    assert "°C" not in notes[0]


def test_a_temperature_is_of_use_where_the_model_tells_how_it_grows(rv_m2):
    growing = model_of(rv_m2, (ThermalElongation(common=True), [2e-5]), needs=("temperature",))
    assert "its lengths at 24 °C" in calibrated(growing, temperature=24.0).notes("a URDF")[0]
    assert calibrated(growing).temperature == 20.0
    with pytest.raises(CampaignError, match="how the robot grows"):
        calibrated(model_of(rv_m2, (JointOffset(), np.ones(5))), temperature=24.0)
