"""The pose that the controller has of the same joints: what differs is its model's, and no robot's."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import some

import thermal_robot as tr


@pytest.fixture(scope="module")
def ur5():
    return tr.load_robot("example-robot-data:ur5", "tool0")


def reported(robot, effects=None, seed=0):
    """Poses as a controller writes them: to a micrometre."""
    made = tr.simulate(robot, effects, rows=40, measures="controller", tool=(0.0, 0.0, 0.0), seed=seed)
    return replace(made, position=np.round(made.position, 6), covariates={}, derived=(), moves="unknown")


@pytest.mark.parametrize(
    ("effect", "value", "said"),
    some(
        [
            ("joint_offset", {"elbow_joint": 0.01}, "other joint zeros in the controller"),
            ("tool_frame", {"translation z": 0.12}, "tool or flange frame set in the controller"),
            ("base_frame", {"rotation z": 0.3}, "base frame set in the controller"),
        ],
        3,
    ),
)
def test_what_is_set_is_named(ur5, effect, value, said):
    found = tr.diagnose(reported(ur5, {effect: value}))
    assert found.verdict == (effect,)
    assert said in found.summary
    (cause,) = (f for f in found.effects if f.name == effect)
    ((_, told),) = value.items()
    assert max(abs(p.value) for p in cause.parameters) == pytest.approx(told, rel=1e-3)


def test_the_same_model_differs_in_nothing(ur5):
    found = tr.diagnose(reported(ur5))
    assert found.verdict == ()
    assert found.gap.rms_before < 2e-6


def test_no_wear_is_looked_for(ur5):
    found = tr.diagnose(reported(ur5))
    names = {f.name for f in found.effects}
    assert {"tool_frame", "base_frame", "geometric", "joint_offset"} <= names
    assert not names & {"backlash", "joint_compliance", "drift", "transmission_error"}


@pytest.mark.slow
def test_another_robot_of_the_family_is_named(ur5):
    other = tr.load_robot("example-robot-data:ur3", "tool0")
    found = tr.diagnose(replace(reported(other), robot=ur5))
    assert not found.usable
    assert "example-robot-data:ur3 fits" in found.summary


def test_poses_of_a_controller_are_read_from_a_file(ur5, tmp_path):
    campaign = reported(ur5)
    again = tr.read_campaign(tr.write_campaign(campaign, tmp_path / "pendant"))
    assert again.kinds == ("controller",)
    assert again.base_known
    assert again.tool_known
    assert np.allclose(again.position, campaign.position, atol=1e-12)
