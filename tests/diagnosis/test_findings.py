"""Which effect: status, probability, parameters; what the data cannot tell apart."""

from dataclasses import replace

import numpy as np
from conftest import load_arm
from simulate import simulate

from thermal_robot import diagnose
from thermal_robot.inference.frames import register


def in_the_root_frame(campaign):
    """The same measurements with both frames known."""
    frames = register(campaign)
    back = np.linalg.inv(frames.base)
    position = campaign.position @ back[:3, :3].T + back[:3, 3]
    return replace(campaign, position=position, base_known=True, tool_known=True, target=frames.tool[:3, 3])


def test_an_offset_of_the_first_joint_is_an_alias_of_a_known_base(clean):
    known = in_the_root_frame(clean)
    turned = 1e-3 * np.cross([0.0, 0.0, 1.0], known.position)
    found = diagnose(replace(known, position=known.position + turned))
    offset, base = found.finding("joint_offset"), found.finding("base_frame")
    assert {offset.status, base.status} == {"confounded"}
    assert "base_frame" in offset.confounded_with
    assert "joint_offset" in base.confounded_with


def test_a_suppressed_effect_is_not_found_rather_than_confounded(clean):
    found = diagnose(replace(clean, priors={"backlash": 1e-12}))
    assert found.finding("backlash").status == "not_found"
    assert found.finding("backlash").confounded_with == ()


def test_rows_in_another_sequence_leave_the_verdict():
    campaign = in_the_root_frame(simulate(load_arm("ur10"), ["drift"], samples=100, seed=3)[0])
    mixed = campaign.take(np.random.default_rng(0).permutation(100))
    assert diagnose(campaign).verdict == diagnose(mixed).verdict
