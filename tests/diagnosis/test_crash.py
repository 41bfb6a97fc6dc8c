"""After a crash: the joint whose zero moved is named, a link that sits elsewhere is told from it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from thermal_robot import after_crash, load_robot, simulate
from thermal_robot.campaign import Campaign
from thermal_robot.diagnosis.crash import Crash, Moved

TOOL = np.eye(4)
TOOL[:3, 3] = 0.1, -0.03, 0.08
"""Where the target sits: off the axis of the last joint."""


def crashed(effects, seed=0, **how):
    """Forty rows of an arm with ordinary errors, and these."""
    rng = np.random.default_rng(seed)
    robot = load_robot("builtin:rv_m2", "tool0")
    ordinary = {name: 2e-4 * rng.normal() for name in robot.joint_names}
    zeros = {**ordinary, **effects.get("joint_offset", {})}
    with_zeros = {"joint_offset": zeros, **{k: v for k, v in effects.items() if k != "joint_offset"}}
    campaign = simulate(robot, with_zeros, rows=40, noise=5e-5, seed=seed, tool=TOOL, **how)
    assert isinstance(campaign, Campaign)
    return campaign


@pytest.mark.parametrize("moved", [{"joint_3": 4e-3}, {"joint_1": -6e-3}, {"joint_2": 5e-3, "joint_4": -7e-3}])
def test_the_joints_whose_zeros_moved_are_named_with_how_far(moved):
    found = after_crash(crashed({"joint_offset": moved}))
    assert found.verdict == "zero"
    named = {one.name: one for one in found.named}
    assert set(named) == set(moved)
    for joint, zero in moved.items():
        assert named[joint].values[0] == pytest.approx(zero, abs=max(4 * named[joint].stds[0], 3e-4))
    told = json.loads(json.dumps(found.to_dict()))
    assert told["verdict"] == "zero"
    assert all(joint in str(found) and joint in told["summary"] for joint in moved)


def test_a_link_that_sits_elsewhere_is_no_zero():
    found = after_crash(crashed({"geometric": {"translation x of joint_3, upper_arm": 8e-3}}))
    assert found.verdict == "link"
    assert "URDF or a bent link" in str(found)


def test_an_arm_that_did_not_crash_has_nothing():
    found = after_crash(crashed({}))
    assert found.verdict == "nothing"
    assert found.named == ()


def test_what_an_unknown_base_takes_up_is_said_and_not_named():
    found = after_crash(replace(crashed({"joint_offset": {"joint_1": 5e-3}}), base_known=False))
    assert "joint_1" in found.hidden
    assert "joint_1" not in {one.name for one in found.moved}
    assert "Not told" in str(found)


def test_another_unit_is_the_tables_fault():
    campaign = crashed({})
    found = after_crash(replace(campaign, position=1e3 * np.asarray(campaign.position)))
    assert found.verdict == "misfit"
    assert found.moved == ()


def test_where_the_rows_do_not_tell_the_joint_none_is_to_be_mastered():
    moved = Moved("joint", "joint_3", 0.44, (3e-3,), (7e-4,), ("rad",))
    said = str(Crash("after", 40, "zero", 0.45, (moved,)))
    assert "which of them the rows do not tell" in said
    assert "forty further poses" in said
    assert "master" not in said
    assert "master that joint" in str(Crash("after", 40, "zero", 0.95, (replace(moved, probability=0.97),)))
